//! Equations for pages: the typeset tree as MathML Core, which browsers draw without scripts.
//!
//! A [`ReducedModel`](crate::model::ReducedModel) enters, `NAME.html` leaves; [`system`] gives the `math` element of
//! one phase to pages made elsewhere.

mod page;

pub use page::{Html, HtmlProse, HtmlText, emit, mathml, system};
