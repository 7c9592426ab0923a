//! `romc identify`: what recordings say of the robot.

use std::path::PathBuf;

use super::robot::RobotParser;
use clap::Args;

use super::reading::ReadingArguments;

/// `romc identify`
#[derive(Debug, Args)]
#[command(
    after_help = "Recordings should hold jumps: flight shows gravity and the legs' inertia,\n\
                  moving legs their losses.\n\n\
                  Example:\n  \
                  romc identify examples/recordings/go1/test_*.csv.gz --robot go1"
)]
pub struct IdentifyArguments {
    /// Recordings of one robot
    #[arg(required = true, value_name = "RECORDING")]
    pub recordings: Vec<PathBuf>,
    /// Robot whose geometry and limits count: go1, go2, a1, or a .toml or .urdf file
    #[arg(long, value_name = "ROBOT", value_parser = RobotParser, hide_possible_values = true)]
    pub robot: String,
    /// Write losses of the twelve joints, gravity, mass, standard errors to this file
    #[arg(long, value_name = "ACTUATORS.toml")]
    pub output: Option<PathBuf>,
    /// Replace an existing output file
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub reading: ReadingArguments,
}
