//! `romc plan`: jumps that nobody recorded.

use std::path::PathBuf;

use clap::Args;

use super::number::real;
use super::reading::ReadingArguments;
use crate::limits::table::{APEX, DISTANCE};

/// `romc plan`
#[derive(Debug, Args)]
#[command(
    after_help = "Exit code 1 and a reason where there is no plan to be trusted.\n\n\
                  Examples:\n  \
                  romc plan models/go1-d6.json --distance 0.35 --apex 0.15 --output plan.csv\n  \
                  romc plan models/go1-d6.json --reach --figures reach"
)]
pub struct PlanArguments {
    /// Model file with `landmarks` and `prior`, as `romc train` writes them
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// Distance of the body from start to end, in metres
    #[arg(
        long,
        value_name = "M",
        value_parser = real(&DISTANCE),
        allow_negative_numbers = true,
        required_unless_present = "reach"
    )]
    pub distance: Option<f64>,
    /// Rise of the body above its height at the start, in metres
    #[arg(
        long,
        value_name = "M",
        value_parser = real(&APEX),
        allow_negative_numbers = true,
        required_unless_present = "reach"
    )]
    pub apex: Option<f64>,
    /// Start from the first sample of this recording (default: the mean start of the training jumps)
    #[arg(long, value_name = "RECORDING")]
    pub start: Option<PathBuf>,
    /// Write the plan to this recording, which every other command takes
    #[arg(long, value_name = "PLAN.csv", required_unless_present = "reach")]
    pub output: Option<PathBuf>,
    /// Folder for figures of posture, body path, torques and phases, or of the reach: SVG, PDF, CSV
    #[arg(long, value_name = "DIR")]
    pub figures: Option<PathBuf>,
    /// Plan a grid of distances and apexes instead, and say which can be reached
    #[arg(long, conflicts_with_all = ["distance", "apex", "start", "output"])]
    pub reach: bool,
    /// Weights and bounds of the plan, a TOML file with the names of `docs/planning.md`
    #[arg(long, value_name = "FILE.toml")]
    pub settings: Option<PathBuf>,
    /// Write a plan that is not to be trusted, and replace existing files
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub reading: ReadingArguments,
}
