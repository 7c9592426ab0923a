//! Arguments of `romc plan`.

use super::*;
use crate::limits::table::{APEX, DISTANCE, DURATION, SPEED, YAW_RATE};

const JUMP: &str = "Jump";
const WALK: &str = "Walk";

#[derive(Debug, Args)]
#[command(mut_arg("clock", |clock| clock.help(clock_help("recorded"))))]
#[command(
    override_usage = "romc plan [OPTIONS] --distance <M> --apex <M> --output <PLAN.csv> <MODEL>\n       \
                      romc plan [OPTIONS] --speed <M_S> --output <PLAN.csv> <MODEL>\n       \
                      romc plan [OPTIONS] --reach <MODEL>",
    after_help = "A plan of a jump takes about half a second, --reach about a minute. A plan that cannot be trusted is \
                  refused with the reason and exit code 1.\n\n\
                  Examples:\n  \
                  romc plan models/go1-d7.json --distance 0.35 --apex 0.15 --output plan.csv\n  \
                  romc plan models/go1-trot-d6.json --speed 0.5 --output walk.csv\n  \
                  romc plan models/go1-d7.json --reach --figures reach"
)]
pub(crate) struct PlanArguments {
    /// Model file of `romc train` with what a plan needs: `landmarks` and `prior` for a jump, `strides` for a walk
    pub model: PathBuf,
    /// Distance of the body from start to end, in m [required for a jump]
    #[arg(long, help_heading = JUMP, value_name = "M", value_parser = real(&DISTANCE))]
    #[arg(required_unless_present_any = ["reach", "speed"], allow_negative_numbers = true)]
    pub distance: Option<f64>,
    /// Rise of the body above its height at the start, in m [required for a jump]
    #[arg(long, help_heading = JUMP, value_name = "M", value_parser = real(&APEX))]
    #[arg(required_unless_present_any = ["reach", "speed"], allow_negative_numbers = true)]
    pub apex: Option<f64>,
    /// Start from the first sample of this recording [default: the mean start of the training jumps]
    #[arg(long, help_heading = JUMP, value_name = "RECORDING")]
    pub start: Option<PathBuf>,
    /// TOML file with weights and bounds of the plan; docs/reference/plan-settings.md lists names and defaults [default: none]
    #[arg(long, help_heading = JUMP, value_name = "FILE.toml")]
    pub settings: Option<PathBuf>,
    /// Speed of a walk, in m/s, for a model trained on walks [required for a walk]
    #[arg(long, help_heading = WALK, value_name = "M_S", value_parser = real(&SPEED))]
    #[arg(conflicts_with_all = ["distance", "apex", "start", "reach", "settings", "figures"])]
    #[arg(allow_negative_numbers = true)]
    pub speed: Option<f64>,
    /// Yaw rate of the walk in rad/s, positive to the left [default: 0]
    #[arg(long, help_heading = WALK, value_name = "RAD_S", value_parser = real(&YAW_RATE))]
    #[arg(allow_negative_numbers = true)]
    pub yaw_rate: Option<f64>,
    /// Duration of the walk in s [default: 5]
    #[arg(long, help_heading = WALK, value_name = "S", value_parser = real(&DURATION))]
    pub duration: Option<f64>,
    /// Plan a grid of goals and print which can be reached: distances and apexes, or speeds and yaw rates of walks
    #[arg(long, help_heading = "Reach", conflicts_with_all = ["distance", "apex", "start", "output"])]
    pub reach: bool,
    #[command(flatten)]
    pub reading: ReadingArguments,
    /// Write the plan as a recording for the other commands [required without --reach and --figures]
    #[arg(long, help_heading = OUTPUT, value_name = "PLAN.csv")]
    #[arg(required_unless_present_any = ["reach", "figures"])]
    pub output: Option<PathBuf>,
    /// Folder for figures as SVG, PDF and CSV: posture, path, torques and phases of a jump, or the reach [default: none]
    #[arg(long, help_heading = OUTPUT, value_name = "DIR")]
    pub figures: Option<PathBuf>,
    /// Write a plan that cannot be trusted, and replace existing files
    #[arg(long, help_heading = OUTPUT, action = ArgAction::SetTrue, value_parser = overwrite())]
    pub force: Overwrite,
}
