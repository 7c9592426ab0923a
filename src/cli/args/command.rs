//! The program and its commands; arguments of most commands have files of their own.

use super::compile::CompileArguments;
use super::evaluation::{CheckArguments, MpcArguments, ReportArguments, SimulateArguments};
use super::import::ImportArguments;
use super::plan::PlanArguments;
use super::recordings::{ConvertArguments, IdentifyArguments, InspectArguments, RobotArguments};
use super::study::StudyArguments;
use super::train::TrainArguments;
use super::*;

/// The reduced-order model compiler: from recorded motions to equations, code and torques.
#[derive(Debug, Parser)]
#[command(
    name = "romc",
    version,
    propagate_version = true,
    max_term_width = 100,
    disable_help_flag = true,
    disable_version_flag = true,
    arg = help_flag(),
    arg = version_flag(),
    after_help = "Start with `romc demo`. `romc <command> --help` explains a command with an example."
)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
    /// Print one JSON object to stdout and nothing else there
    #[arg(long, global = true, help_heading = OUTPUT, display_order = 1000)]
    pub json: bool,
}

/// One of romc's commands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Run all steps on the shipped model and recordings
    Demo(DemoArguments),
    /// Describe recordings and models, and list implausible samples
    Inspect(InspectArguments),
    /// Write recordings, or logs of other programs, as CSV or MCAP
    Convert(ConvertArguments),
    /// Estimate gravity, mass, joint friction and rotor inertia from recordings
    Identify(IdentifyArguments),
    /// Learn a model from recordings
    Train(Box<TrainArguments>),
    /// Train models of several latent dimensions and seeds: accuracy against complexity
    Study(StudyArguments),
    /// Convert a model trained elsewhere: safetensors, npz, PySINDy, equations as text
    Import(ImportArguments),
    /// Show a robot, or convert a URDF file to a robot file
    Robot(RobotArguments),
    /// Prove that two models, equation files or papers are equal, or show a difference
    Check(CheckArguments),
    /// Compile a model to equations, code (C, Rust, Python, MATLAB) or a controller
    Compile(CompileArguments),
    /// Roll a model out over recordings and measure its errors
    Simulate(SimulateArguments),
    /// Run the latent-space controller along recordings
    Mpc(MpcArguments),
    /// Plan a new jump or walk and write it as a recording
    Plan(PlanArguments),
    /// Write one HTML page with equations, errors, baselines and the controller's torques
    Report(ReportArguments),
    /// Write man pages, one per command
    Manual(ManualArguments),
    /// Print completions for a shell
    Completions(CompletionsArguments),
}

#[derive(Debug, Args)]
#[command(
    after_help = "The demo takes about 5 seconds.\n\nExample:\n  romc demo --out-dir out/demo"
)]
pub(crate) struct DemoArguments {
    /// Folder for the files of the demo
    #[arg(long, help_heading = OUTPUT, value_name = "DIR", default_value = "out/demo")]
    pub out_dir: PathBuf,
    /// Also print every metric of every jump
    #[arg(long, help_heading = OUTPUT)]
    pub verbose: bool,
    /// Write into a folder that has files of other origin
    #[arg(long, help_heading = OUTPUT, action = ArgAction::SetTrue, value_parser = overwrite())]
    pub force: Overwrite,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  romc manual --out-dir ~/.local/share/man/man1 && man romc-compile"
)]
pub(crate) struct ManualArguments {
    /// Folder for the pages
    #[arg(long, help_heading = OUTPUT, value_name = "DIR")]
    pub out_dir: PathBuf,
    /// Replace files of other origin in the folder
    #[arg(long, help_heading = OUTPUT, action = ArgAction::SetTrue, value_parser = overwrite())]
    pub force: Overwrite,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  romc completions bash > ~/.local/share/bash-completion/completions/romc"
)]
pub(crate) struct CompletionsArguments {
    /// The shell
    #[arg(value_enum, value_name = "SHELL")]
    pub shell: clap_complete::Shell,
}
