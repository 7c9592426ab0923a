//! Reduced-order models of legged robots as data: robots, maps, candidate terms, coefficients, and the files that hold
//! them.
//!
//! `romc` re-exports every module; depend on that.
#![allow(
    missing_docs,
    reason = "names are self-explanatory where there is no comment"
)]

use romc_cas as symbolic;
use romc_robot as robot;

pub mod artifact;
pub mod files;
pub mod limits;
pub mod model;
pub mod robot_file;
