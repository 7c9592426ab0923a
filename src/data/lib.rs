//! Recordings of legged robots, and what is identified from them. `romc` re-exports every module; depend on that.

use romc_model::{files, robot_file};
use romc_robot as robot;

pub mod identify;
pub mod recording;
