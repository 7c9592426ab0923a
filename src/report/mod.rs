//! A one-page assessment of a model, its tables and its figures.
//!
//! An assessment and controller runs come in; a self-contained HTML page and figures leave.
//! `tables.rs` holds the tables, `json.rs` the same numbers for programs, `contents.rs` picks what is drawn, `figures/` draws it, `page.rs`
//! places all. Start with `page.rs`.

mod complexity;
mod contents;
mod control;
pub mod figures;
mod json;
mod page;
mod place;
mod plan;
mod tables;

pub use complexity::study_figures;
pub use contents::{AllFigures, Content, all_figures, modelled};
pub use control::{control_figures, without_statistics};
pub use json::{assessment_json, plan_json};
pub use page::{PageOptions, page};
pub use plan::{plan_figures, reach_figure};
pub use tables::{
    NamedRun, baseline_table, control_table, coordinate_table, dynamics_table, failures,
    invariance_table, phase_table, run_table, template_rms,
};
