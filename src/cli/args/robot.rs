//! `romc robot`, and the option `--robot` of other commands.

use std::path::PathBuf;

use clap::Args;
use clap::builder::{PossibleValue, TypedValueParser};

use crate::robot::WrenchFrame;

/// Takes any text and offers the names of romc's own robots to shells.
#[derive(Clone, Debug)]
pub struct RobotParser;

impl TypedValueParser for RobotParser {
    type Value = String;

    fn parse_ref(
        &self,
        command: &clap::Command,
        argument: Option<&clap::Arg>,
        value: &std::ffi::OsStr,
    ) -> Result<String, clap::Error> {
        clap::builder::StringValueParser::new().parse_ref(command, argument, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        let names = crate::robot::Robot::known_names();
        Some(Box::new(names.into_iter().map(PossibleValue::new)))
    }
}

/// Reads `body` or `world`.
pub fn wrench_frame(text: &str) -> Result<WrenchFrame, String> {
    WrenchFrame::by_name(text).ok_or_else(|| format!("found `{text}`, expected `world` or `body`"))
}

/// `romc robot`
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  romc robot go1\n  \
                  romc robot solo12.urdf --output solo12.toml\n  \
                  romc robot my.urdf --feet LF_FOOT,RF_FOOT,LH_FOOT,RH_FOOT --output my.toml")]
pub struct RobotArguments {
    /// Robot: go1, go2, a1, or a .toml or .urdf file
    #[arg(value_name = "ROBOT")]
    pub robot: String,
    /// Links of the four feet of a URDF, where they are not found by themselves
    #[arg(long, value_name = "LINKS", value_delimiter = ',')]
    pub feet: Vec<String>,
    /// Write the robot to this file
    #[arg(long, value_name = "FILE.toml")]
    pub output: Option<PathBuf>,
    /// Replace an existing output file
    #[arg(long)]
    pub force: bool,
}
