//! Recordings of legged robots, and the identification of parameters from them. `romc` re-exports every module; depend
//! on that.
#![allow(
    missing_docs,
    reason = "names are self-explanatory where there is no comment"
)]

use romc_model::{files, robot_file};
use romc_robot as robot;

pub mod identify;
pub mod recording;
