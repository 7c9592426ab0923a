//! What is learned, computed and judged along recordings: training, simulation, control, plans, evaluation.
//!
//! `romc` re-exports every module; depend on that.

use romc_cas as symbolic;
use romc_codegen::{ir, lower};
use romc_control::online;
use romc_data::recording;
use romc_model::{files, limits, model};
use romc_robot as robot;

pub mod evaluate;
pub mod mpc;
pub mod plan;
pub mod sim;
pub mod train;
