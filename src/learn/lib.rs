//! Training, simulation, control, planning and evaluation of reduced-order models; `romc` re-exports every module.
#![allow(
    missing_docs,
    reason = "names are self-explanatory where there is no comment"
)]

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
