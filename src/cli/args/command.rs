//! The program, its commands, and what each command offers.

use clap::{Parser, Subcommand};

use super::check::CheckArguments;
use super::compile::CompileArguments;
use super::convert::ConvertArguments;
use super::identify::IdentifyArguments;
use super::import::ImportArguments;
use super::manual::{CompletionsArguments, ManualArguments};
use super::plan::PlanArguments;
use super::robot::RobotArguments;
use super::run::{
    DemoArguments, InspectArguments, MpcArguments, ReportArguments, SimulateArguments,
};
use super::train::{StudyArguments, TrainArguments};

/// The reduced-order model compiler: from recorded jumps to equations, code and torques.
#[derive(Debug, Parser)]
#[command(
    name = "romc",
    version,
    propagate_version = true,
    after_help = "Start with `romc demo`. `romc <command> --help` explains a command with an example."
)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Command,
    /// Print one JSON object to stdout and nothing else there
    #[arg(long, global = true, help_heading = None)]
    pub json: bool,
}

/// One of romc's commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// The main job on the shipped model and recordings: equations, code, rollouts, controller
    Demo(DemoArguments),
    /// Describe a recording or a model, and list what is implausible in it
    Inspect(InspectArguments),
    /// Write recordings, or logs of other programs, as CSV or MCAP
    Convert(ConvertArguments),
    /// Find gravity, mass and the joints' losses in recordings
    Identify(IdentifyArguments),
    /// Learn a model from recordings
    Train(Box<TrainArguments>),
    /// Train every latent dimension with several seeds: accuracy against complexity
    Study(StudyArguments),
    /// Take over a model trained elsewhere: safetensors, npz, PySINDy, equations as text
    Import(ImportArguments),
    /// Show a robot, or what a TOML or URDF file says of one
    Robot(RobotArguments),
    /// Prove that two models, equation files or LaTeX papers say the same, or show where they differ
    Check(CheckArguments),
    /// Compile a model to equations, code (C, Rust, Python, MATLAB) or a controller
    Compile(CompileArguments),
    /// Roll a model out over recordings and measure how far it drifts
    Simulate(SimulateArguments),
    /// Run the latent-space controller along a recording
    Mpc(MpcArguments),
    /// Plan a jump that nobody recorded, as a recording
    Plan(PlanArguments),
    /// Put equations, errors, baselines and the controller's torques on one HTML page
    Report(ReportArguments),
    /// Write man pages, one per command
    Manual(ManualArguments),
    /// Print completions for a shell
    Completions(CompletionsArguments),
}
