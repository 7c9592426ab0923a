//! Latent-space model-predictive control: the stage problem, its solvers, and the controller from a measured state to
//! torques.
//!
//! Generated controllers hold these very sources and those of `romc-robot`. `romc` re-exports every module; depend on
//! that.

use romc_robot as robot;

#[cfg(test)]
#[path = "../../tests/mpc/linearise.rs"]
mod linearise;
pub mod online;
pub mod solver;
pub mod sources;
