//! New jumps without a recording: a goal in, a trajectory of the model's coordinates out.
//!
//! In: a model with landmarks and prior of its training jumps (`JumpPrior`), a [`Goal`]. Out: a [`Plan`], which is a
//! recording, and its distance from the recorded jumps. Read `transcribe` first, which states the program. `seed` makes
//! the initial trajectory, `solve` solves the program by sequential convex programs on `QpSolver`, `motion` samples the
//! result and checks it between the nodes, `verdict` judges it.
//!
//! ```
//! use romc::plan::Goal;
//!
//! assert!(Goal::new(0.35, 0.15).is_ok());
//! assert!(Goal::new(0.35, -0.1).is_err());
//! ```

mod costs;
mod motion;
mod seed;
mod settings;
mod solve;
mod transcribe;
mod verdict;
mod walk;

pub use settings::{Goal, PlanError, PlanSettings};
pub use solve::{GoalMap, MappedGoal, Plan, PlannedPart, plan, reach};
pub use verdict::Verdict;
pub use walk::{MappedWalk, WalkGoal, WalkMap, WalkPlan, walk, walk_reach};

type Result<T, E = PlanError> = std::result::Result<T, E>;

use std::ops::Add;

use motion::Margins;
use nalgebra::{DMatrix, DVector};
use seed::{PITCH, Seed};
use transcribe::{Bound, Task};

use crate::model::{GOAL_DIM, JumpPart, JumpPrior, Landmark, ModelError, ReducedModel};
use crate::mpc::{ConeProgram, ControlError, Outcome, QpSettings, QpSolver, SolverProfile};
use crate::recording::{Recording, RecordingError, Segment, about_vertical};
use crate::robot::{
    BODY_NAMES, BODY_X, BODY_Z, GRAVITY_M_S2, InputRule, JOINT_DIM, JOINT_NAMES, Leg, Robot,
    STATE_DIM, YAW,
};
