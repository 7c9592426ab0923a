//! `romc demo`, `inspect`, `simulate`, `mpc`, `report`: models compared with recordings.

use std::path::PathBuf;

use clap::Args;

use super::number::{count, real};
use super::reading::ReadingArguments;
use super::robot::RobotParser;
use crate::evaluate::ReferenceInput;
use crate::limits::table::{HORIZON, RESTART_EVERY, STEP, TORQUE_RATE};
use crate::mpc::{Lift, Solver};
use crate::simplify::Tolerance;

/// `romc demo`
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  romc demo --out-dir out/demo")]
pub struct DemoArguments {
    /// Folder for the files of the demo
    #[arg(long, value_name = "DIR", default_value = "out/demo")]
    pub out_dir: PathBuf,
    /// Write into a folder that holds files romc did not make
    #[arg(long)]
    pub force: bool,
}

/// `romc inspect`
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  romc inspect models/go1-d4.json examples/recordings/go1/test_01.csv.gz\n  romc inspect --guess my-log.csv > my-log.toml"
)]
pub struct InspectArguments {
    /// Models (`.json`) and recordings (`.csv`, `.csv.gz`)
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// Robot whose limits the recordings are compared with: go1, go2, a1, or a .toml or .urdf file
    #[arg(long, value_name = "ROBOT", default_value = "go1", value_parser = RobotParser, hide_possible_values = true)]
    pub robot: String,
    /// Write a first map of an unknown log for --columns, from its names and numbers
    #[arg(long, conflicts_with = "columns")]
    pub guess: bool,
    /// Write the guessed map to this file instead of to stdout
    #[arg(long, value_name = "MAP.toml", requires = "guess")]
    pub output: Option<PathBuf>,
    /// Replace an existing output file
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub reading: ReadingArguments,
}

/// `romc simulate`
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  romc simulate models/go1-d4.json examples/recordings/go1/test_*.csv.gz"
)]
pub struct SimulateArguments {
    /// Model file
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// Recordings to follow
    #[arg(required = true, value_name = "RECORDING")]
    pub recordings: Vec<PathBuf>,
    /// Time between restarts from the recorded state, in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 0.1, value_parser = real(&RESTART_EVERY))]
    pub restart_every: f64,
    /// Write the trajectories of all rollouts to this CSV file
    #[arg(long, value_name = "FILE.csv")]
    pub output: Option<PathBuf>,
    /// Replace an existing output file
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub reading: ReadingArguments,
}

/// `romc mpc`
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  romc mpc models/go1-d4.json examples/recordings/go1/test_01.csv.gz --output mpc.csv"
)]
pub struct MpcArguments {
    /// Model file
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// Recordings to follow
    #[arg(required = true, value_name = "RECORDING")]
    pub recordings: Vec<PathBuf>,
    /// Number of stages
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = count(&HORIZON))]
    pub horizon: usize,
    /// Length of a stage in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 0.01, value_parser = real(&STEP))]
    pub step: f64,
    /// How latent inputs become joint torques
    #[arg(long, value_enum, default_value = "transpose")]
    pub lift: Lift,
    /// Where the input reference comes from
    #[arg(long, value_enum, default_value = "recorded")]
    pub reference_input: ReferenceInput,
    /// What solves the quadratic program of a step
    #[arg(long, value_enum, default_value = "clarabel")]
    pub solver: Solver,
    /// Largest change of a torque that the transpose lift gives, in N m/s [default: none]
    #[arg(long, value_name = "N_M_PER_S", value_parser = real(&TORQUE_RATE))]
    pub torque_rate: Option<f64>,
    /// Write one row per control step to this CSV file
    #[arg(long, value_name = "FILE.csv")]
    pub output: Option<PathBuf>,
    /// Folder for figures of torques, latent inputs, latent tracking and solve times: SVG, PDF, CSV
    #[arg(long, value_name = "DIR")]
    pub figures: Option<PathBuf>,
    /// Replace an existing output file
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub reading: ReadingArguments,
}

/// `romc report`
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  romc report models/go1-d4.json examples/recordings/go1/test_*.csv.gz --output report.html"
)]
pub struct ReportArguments {
    /// Model file
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// Recordings that the model is compared with
    #[arg(required = true, value_name = "RECORDING")]
    pub recordings: Vec<PathBuf>,
    /// The page to write
    #[arg(long, value_name = "FILE.html")]
    pub output: PathBuf,
    /// Folder of a finished `romc study`, to show figures 10 and 11
    #[arg(long, value_name = "DIR")]
    pub study: Option<PathBuf>,
    /// Also write each figure as SVG, PDF and CSV into this folder
    #[arg(long, value_name = "DIR")]
    pub figures: Option<PathBuf>,
    /// The plan that the first jump follows, as `romc plan` writes it: drawn beside that jump
    #[arg(long, value_name = "PLAN.csv")]
    pub plan: Option<PathBuf>,
    /// Time between restarts from the recorded state, in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 0.1, value_parser = real(&RESTART_EVERY))]
    pub restart_every: f64,
    /// List what simplification within this error changes: 1% or 0.05, as in `romc compile`
    #[arg(
        long,
        value_name = "ERROR",
        default_value = "1%",
        allow_negative_numbers = true
    )]
    pub tolerance: Tolerance,
    /// Replace an existing page, or write into a folder that holds files romc did not make
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub reading: ReadingArguments,
}
