//! A one-page assessment of a model, its tables and its figures.
//!
//! An assessment and controller runs come in; a self-contained HTML page and figures leave. `log.rs` makes another page
//! of a generated controller's log. `introduction.rs` and `verdict.rs` have the first screen, `tables.rs` contains the
//! tables and the same numbers for programs, `contents.rs` and `jump.rs` choose the drawings, `figures/` draws them,
//! `sections.rs` and `page.rs` place all. Start with `page.rs`. All files share its imports
//! (`use super::*`).

mod contents;
mod figures;
mod introduction;
mod jump;
mod log;
mod page;
mod plan;
mod sections;
mod tables;
mod verdict;

pub(crate) use contents::{
    Content, all_figures, control_figures, study_figures, without_statistics,
};
pub(crate) use figures::{Figure, figure_files, range};
pub(crate) use introduction::{Introduction, introduction};
pub(crate) use log::{LogFacts, log_figures, log_page};
pub(crate) use page::{PageOptions, page};
pub(crate) use plan::{plan_figures, reach_figure, walk_reach_figure};
pub(crate) use tables::{
    NamedRun, baseline_table, body_rms, control_table, coordinate_table, dynamics_table,
    failed_runs, failures, horizon_json, horizon_table, invariance_table, phase_table, run_table,
};
pub use tables::{assessment_json, plan_json, verdict_lines};

use std::path::{Path, PathBuf};

use contents::{AllFigures, JumpFigures};
use figures::{
    Drawing, Film, HeatMap, Motion, Panel, Role, Series, film, film_strip, floor_m, panel_svg,
    subscript,
};
use jump::{Jump, JumpName, modelled};
use serde_json::{Map, Value, json};

use crate::evaluate::{
    AslipSums, Assessment, Baseline, ByContact, ControlMetrics, CoordinateSums, Fit, FitSums,
    Horizon, Invariance, LinearisedPhase, PredictionError, Run, SegmentRun, StepRow, Verdict,
    VerdictRow, with_unit,
};
use crate::model::{JumpPrior, ModelError, ReducedModel};
use crate::plan::{GoalMap, MappedWalk, Plan, WalkMap};
use crate::recording::{Segment, stretches};
use crate::robot::{BODY_X, BODY_Z, GRAVITY_M_S2, JOINT_DIM, Robot, STATE_DIM};
use crate::typeset::mathml::{HTML, HtmlProse, HtmlText, system};
use crate::typeset::words::{counted, feet, listed, rendered, rounding};
use crate::typeset::{
    Cell, EquationSystem, Rounding, SymbolTable, Table, Typeset, TypesetError, alike, rounded,
    significant,
};

type Result<T, E = ModelError> = std::result::Result<T, E>;
