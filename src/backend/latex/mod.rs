//! Equations for papers: a [`ReducedModel`](crate::model::ReducedModel) enters,
//! LaTeX files leave.
//!
//! Read [`document`](self::emit) first: it names the files. The layout of terms
//! and the rounding are done by [`typeset`](crate::backend::typeset); here it gets
//! its spelling ([`TexMath`]), its line breaks, tables and comments. Names from a
//! model file pass through [`TexText`] and nothing else.

mod document;
mod escape;
mod lines;
mod math;
mod nomenclature;
mod options;
mod table;

pub use document::emit;
pub use escape::{CommentText, TexText, label};
pub use lines::tex_cases;
pub use math::{NumberStyle, TexMath, TexNumber, TexSymbol, TexTerms};
pub use options::{Form, LatexOptions};
