//! A one-page assessment of a model, its tables and its figures.
//!
//! An assessment and controller runs come in; a self-contained HTML page and figures leave.
//! `introduction.rs` has the first words, `tables.rs` holds the tables, `json.rs` the same numbers for programs, `contents.rs` and
//! `jump.rs` pick what is drawn, `figures/` draws it, `sections.rs` and `page.rs` place all. Start with `page.rs`.

mod complexity;
mod contents;
mod control;
mod figures;
mod introduction;
mod json;
mod jump;
mod page;
mod plan;
mod provenance;
mod sections;
mod tables;

pub(crate) use complexity::study_figures;
pub(crate) use contents::{Content, all_figures};
pub(crate) use control::{control_figures, without_statistics};
pub(crate) use figures::{Figure, figure_files};
pub(crate) use introduction::{Introduction, introduction};
pub use json::{assessment_json, plan_json};
pub(crate) use page::{PageOptions, page};
pub(crate) use plan::{plan_figures, reach_figure};
pub(crate) use tables::{
    NamedRun, baseline_table, control_table, coordinate_table, dynamics_table, failed_runs,
    failures, invariance_table, phase_table, run_table, verdict_lines,
};
