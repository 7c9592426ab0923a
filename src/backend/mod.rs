//! From programs and equations to text: C, Rust, LaTeX, Markdown, MathML.

pub mod latex;
pub mod markdown;
pub mod mathml;
mod target;
pub mod typeset;

pub use target::{EmitError, EmittedFile};
