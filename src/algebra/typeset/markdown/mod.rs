//! Equations for READMEs and lab notebooks: a
//! [`ReducedModel`](crate::model::ReducedModel) enters, `NAME.md` leaves, with its
//! mathematics as GitHub and GitLab draw it. The formulas are those of the
//! [`latex`](crate::typeset::latex) backend.

mod document;
mod escape;

pub use document::emit;
pub use escape::markdown_text;
