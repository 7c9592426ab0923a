//! One page that tells whether a model is any good, and its figures on their own.
//!
//! An assessment and controller runs come in; a self-contained HTML page and figures leave.
//! `contents.rs` picks what is drawn, `figures/` draws it, `page.rs` places it. Start with
//! `page.rs`.

mod complexity;
mod contents;
mod control;
pub mod figures;
mod page;

pub use complexity::study_figures;
pub use contents::{AllFigures, Content, all_figures};
pub use control::control_figures;
pub use page::{PageOptions, PageTable, page};
