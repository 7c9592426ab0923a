//! Arguments of `romc inspect`, `convert`, `identify` and `robot`, and how every command reads recordings.

use std::sync::Arc;

use super::*;
use crate::cli::Host;
use crate::cli::shared::quoted;
use crate::recording::Clocks;

#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = RECORDINGS)]
pub(crate) struct ReadingArguments {
    /// Map of columns for logs of other programs (see `romc inspect --help`) [default: none]
    #[arg(long, value_name = "MAP.toml")]
    pub columns: Option<PathBuf>,
    #[arg(long, value_name = "repaired|recorded", hide_possible_values = true)]
    #[arg(value_enum, help = clock_help("repaired"))]
    pub clock: Option<Clocks>,
    /// The program in which the command runs; none for the command line
    #[arg(skip)]
    pub host: Option<Arc<Host>>,
}

/// Help of `--clock` for a command with this default.
pub(super) fn clock_help(default: &str) -> String {
    format!(
        "Repair wrong times and rates, or leave them as recorded (see `romc inspect --help`) [default: {default}]"
    )
}

impl ReadingArguments {
    /// The flags as typed, with a blank before each.
    pub(crate) fn as_flags(&self) -> String {
        let columns = self.columns.iter();
        let columns = columns.map(|path| format!(" --columns {}", quoted(path)));
        let clock = self.clock.and_then(|clock| clock.to_possible_value());
        let clock = clock.map(|clock| format!(" --clock {}", clock.get_name()));
        columns.chain(clock).collect()
    }
}

/// The one description of `--columns` and `--clock`, and examples.
const OF_INSPECT: &str = "\
Columns: a map of columns describes the log of another program. It is a TOML file with the name, unit and sign of each \
column. `romc inspect --guess LOG` writes a first map, and docs/reference/column-maps.md describes its keys. Without a map, romc reads \
CSV files with its own column names, and MCAP files with named joints.

Clocks: the times of a log often disagree with the recorded motion. `--clock repaired` rebuilds times that are wrong by \
more than 3 % and resamples uneven steps. It replaces angular rates that contradict the angles, restores lost decimal \
points and advances a delayed body position. A note states each repair. `--clock recorded` changes nothing.

Examples:
  romc inspect models/go1-d4.json examples/recordings/go1/test_01.csv.gz
  romc inspect --guess my-log.csv > my-log.toml";

#[derive(Debug, Args)]
#[command(after_help = OF_INSPECT)]
#[command(mut_arg("columns", |columns| columns.help("Map of columns, see below [default: none]")))]
#[command(mut_arg("clock", |clock| clock.help("Repair times and rates, see below [default: recorded]")))]
pub(crate) struct InspectArguments {
    /// Models (.json) and recordings (.csv, .csv.gz, .mcap, and other logs with --columns)
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// Robot with the limits to check: go1, go2, a1, or a .toml or .urdf file
    #[arg(long, help_heading = RECORDINGS, value_name = "ROBOT", default_value = "go1")]
    #[arg(value_parser = RobotParser, hide_possible_values = true)]
    pub robot: String,
    #[command(flatten)]
    pub reading: ReadingArguments,
    /// Print a first map for --columns, guessed from the names and numbers of one log
    #[arg(long, help_heading = RECORDINGS, conflicts_with = "columns")]
    pub guess: bool,
    /// Write the guessed map to this file [default: stdout]
    #[arg(long, help_heading = OUTPUT, value_name = "MAP.toml", requires = "guess")]
    pub output: Option<PathBuf>,
    /// Replace an existing output file
    #[arg(long, help_heading = OUTPUT, action = ArgAction::SetTrue, value_parser = overwrite())]
    pub force: Overwrite,
}

#[derive(Debug, Args)]
#[command(mut_arg("clock", |clock| clock.help(clock_help("recorded"))))]
#[command(after_help = "Examples:\n  \
                  romc convert log.txt --columns my-log.toml --output jump.csv.gz\n  \
                  romc convert jump.mcap --output jump.csv --inputs-of models/go1-d4.json")]
pub(crate) struct ConvertArguments {
    /// Recordings, or logs with --columns; several become segments of the output, in order
    #[arg(required = true, value_name = "RECORDING")]
    pub recordings: Vec<PathBuf>,
    #[command(flatten)]
    pub reading: ReadingArguments,
    /// The file to write: .csv, .csv.gz, or .mcap for a single segment
    #[arg(long, help_heading = OUTPUT, value_name = "FILE")]
    pub output: PathBuf,
    /// Also write the 18 inputs of this model for each sample, in N and N m [default: none]
    #[arg(long, help_heading = OUTPUT, value_name = "MODEL.json")]
    pub inputs_of: Option<PathBuf>,
    /// Replace an existing output file
    #[arg(long, help_heading = OUTPUT, action = ArgAction::SetTrue, value_parser = overwrite())]
    pub force: Overwrite,
}

#[derive(Debug, Args)]
#[command(mut_arg("clock", |clock| clock.help(clock_help("recorded"))))]
#[command(
    after_help = "Recordings should contain jumps. Flight determines gravity and the inertia of the legs, moving legs \
                  their friction. Wrong times are always rebuilt here. The command takes about a second for 20 jumps.\n\n\
                  Example:\n  \
                  romc identify examples/recordings/go1/test_*.csv.gz --robot go1"
)]
pub(crate) struct IdentifyArguments {
    /// Recordings of one robot
    #[arg(required = true, value_name = "RECORDING")]
    pub recordings: Vec<PathBuf>,
    /// Robot with the geometry and limits to use: go1, go2, a1, or a .toml or .urdf file
    #[arg(long, help_heading = RECORDINGS, value_name = "ROBOT")]
    #[arg(value_parser = RobotParser, hide_possible_values = true)]
    pub robot: String,
    #[command(flatten)]
    pub reading: ReadingArguments,
    /// Write friction and inertia of the joints, gravity, mass and standard errors to this file [default: none]
    #[arg(long, help_heading = OUTPUT, value_name = "ACTUATORS.toml")]
    pub output: Option<PathBuf>,
    /// Replace an existing output file
    #[arg(long, help_heading = OUTPUT, action = ArgAction::SetTrue, value_parser = overwrite())]
    pub force: Overwrite,
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  romc robot go1\n  \
                  romc robot solo12.urdf --output solo12.toml\n  \
                  romc robot my.urdf --feet LF_FOOT,RF_FOOT,LH_FOOT,RH_FOOT --output my.toml\n  \
                  romc robot go1.urdf --name my-go1 --output my-go1.toml")]
pub(crate) struct RobotArguments {
    /// Robot: go1, go2, a1, or a .toml or .urdf file
    pub robot: String,
    /// Links of the four feet of a URDF, LINK,LINK,... Where a foot has no link, LINK:x,y,z states its position in the
    /// frame of another, in m [default: found by name or at the end of each leg]
    #[arg(
        long,
        help_heading = "Robot",
        value_name = "LINKS",
        value_delimiter = ','
    )]
    pub feet: Vec<String>,
    /// Name of the robot [default: that in the file]
    #[arg(long, help_heading = "Robot")]
    pub name: Option<String>,
    /// Write the robot to this file [default: none]
    #[arg(long, help_heading = OUTPUT, value_name = "FILE.toml")]
    pub output: Option<PathBuf>,
    /// Replace an existing output file
    #[arg(long, help_heading = OUTPUT, action = ArgAction::SetTrue, value_parser = overwrite())]
    pub force: Overwrite,
}
