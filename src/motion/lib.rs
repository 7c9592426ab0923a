//! Motions of legged robots: recordings, and what is learned, computed and judged along them.
//!
//! [`recording`] reads them, [`train`] learns a model from them, [`sim`], [`mpc`] and [`plan`] make
//! motions with it, [`evaluate`] compares.
//!
//! `romc` re-exports every module; depend on that.

#[cfg(test)]
use romc_algebra::artifact;
use romc_algebra::{files, ir, limits, lower, model, robot, symbolic};

pub mod evaluate;
pub mod identify;
pub mod mpc;
pub mod plan;
pub mod recording;
pub mod sim;
pub mod solver;
pub mod train;
