//! A one-page assessment of a model, its tables and its figures.
//!
//! An assessment and controller runs come in; a self-contained HTML page and figures leave. `log.rs` makes another page of
//! a generated controller's log. `introduction.rs` has the
//! first words, `tables.rs` holds the tables and the same numbers for programs, `contents.rs` and `jump.rs` pick
//! what is drawn, `figures/` draws it, `sections.rs` and `page.rs` place all. Start with `page.rs`. What this file
//! imports is what its files import with `use super::*`.

mod contents;
mod figures;
mod introduction;
mod jump;
mod log;
mod page;
mod plan;
mod sections;
mod tables;

pub(crate) use contents::{
    Content, all_figures, control_figures, study_figures, without_statistics,
};
pub(crate) use figures::{Figure, figure_files, range};
pub(crate) use introduction::{Introduction, introduction};
pub(crate) use log::{LogFacts, log_figures, log_page};
pub(crate) use page::{PageOptions, page};
pub(crate) use plan::{plan_figures, reach_figure};
pub(crate) use tables::{
    NamedRun, baseline_table, body_rms, control_table, coordinate_table, dynamics_table,
    failed_runs, failures, horizon_json, horizon_table, invariance_table, phase_table, run_table,
    verdict_lines,
};
pub use tables::{assessment_json, plan_json};

use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};

use crate::evaluate::{Assessment, CoordinateSums, Fit, SegmentRun, Verdict};
use crate::model::{ModelError, ReducedModel};
use crate::recording::Segment;
use crate::robot::{BODY_X, BODY_Z, JOINT_DIM, Robot};
use crate::typeset::words::counted;
use crate::typeset::{Cell, Table, rounded, significant};
use figures::{Film, Motion, Panel, Role, Series, film_strip, floor_m};

type Result<T, E = ModelError> = std::result::Result<T, E>;
