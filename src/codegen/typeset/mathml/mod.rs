//! Equations for pages: the typeset tree as MathML Core, which browsers draw without scripts.
//!
//! A [`ReducedModel`](crate::model::ReducedModel) enters, `NAME.html` leaves; [`system`] gives the `math` element of
//! one phase to pages made elsewhere.

mod math;
mod page;
mod prose;

pub use math::mathml;
pub use page::{Html, emit, system};
pub use prose::{HtmlProse, HtmlText};
