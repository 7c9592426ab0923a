//! The command line. Each command is a file with one function from its arguments to an `Answer`, text or one JSON
//! object; [`run`] prints it and picks the exit code (0 done, 1 the run failed, 2 wrong usage). Human text and JSON go
//! to stdout; progress, warnings, errors to stderr. Start with `args`. All commands share the imports of this file
//! (`use super::*`).

mod args;
mod chart;
mod check;
mod compile;
mod convert;
mod demo;
#[cfg(test)]
#[path = "../../tests/cli/flags.rs"]
mod flags;
mod host;
mod identify;
mod import;
mod inspect;
mod manual;
mod mpc;
mod plan;
mod plan_settings;
mod prepared_recordings;
mod refine;
mod report;
mod robot;
mod shared;
mod simplification;
mod simulate;
mod study;
mod train;
mod train_settings;

pub use args::compile::UnitsChoice;
pub use demo::JUMPS as SHIPPED_JUMPS;
pub use host::{Host, HostAnswer, HostError, run_in};
pub use identify::text as identification_text;
pub use import::{Compared, import_compared};
pub use mpc::JudgedRuns;

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fmt::{Display, Write as _};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::{self, ExitCode};

use args::{PhaseSet, ReadingArguments, TrainArguments, TrainSettings, Widths, *};
use console::{Style, style};
use nalgebra::{DMatrix, DVector};
use prepared_recordings::RecordedSets;
use serde_json::{Map, Value, json};
use shared::{Format, Inputs, *};
use simplification::{RESTART_S, exact_words};

use crate::deploy::{self, EmitOptions, PlannedJump, Target};
use crate::equations::Equations;
use crate::evaluate::{
    Assessment, ControlMetrics, Horizon, Invariance, LAMBDA, ReferenceInput, RoundTrip,
    StrideGrowth, along_recording, control_metrics, usual_settings, verdict, verdict_by_default,
};
use crate::files::size::read_toml;
use crate::files::{
    Emitted, EmittedFile, Overwrite, Place, check_folder, earlier_files, is_invisible, write_files,
    write_files_since, write_whole,
};
use crate::import::{
    Chosen, Format as FileKind, ImportError, ImportOptions, ImportReport, Imported, SymbolNames,
    read_terms,
};
use crate::model::{
    Activation, LibraryChoice, LibraryOrder, ReducedModel, StandardLibrary, StateMap,
};
use crate::mpc::{ControlError, Drives, Lift, MpcSettings, controller};
use crate::recording::check::Finding;
use crate::recording::{
    Clocks, ColumnMap, ConditionOptions, ImplausibleSamples, PhaseRule, Reader, Reading,
    ReadingNotes, Recording, RecordingError, RecordingFault, RecordingFile, RecordingSet, Segment,
    WriteOptions, as_recorded, between, guess, mismatch, stride_s, write_as, write_mcap,
};
use crate::report::{
    Content, Figure, Introduction, NamedRun, PageOptions, all_figures, assessment_json,
    baseline_table, body_rms, control_figures, control_table, coordinate_table, dynamics_table,
    failed_runs, failures, figure_files, horizon_json, horizon_table, introduction,
    invariance_table, page, phase_table, plan_figures, plan_json, range, reach_figure, run_table,
    study_figures, verdict_lines, walk_reach_figure, without_statistics,
};
use crate::robot::{BODY_X, BODY_Z, JOINT_DIM, JOINT_NAMES, Leg, LegMoments, Robot, WrenchFrame};
use crate::robot_file::{self, RobotEntry, RobotOptions, read_actuators};
use crate::simplify::{
    Certificate, Domain, MARGIN, RolloutBasis, RolloutEffect, Samples, SimplifyError, Tolerance,
    bound_words, certificate_json, change_table, equation_table, lost_words, markdown, printed,
    rollout_table, rollouts_json, simplify,
};
use crate::study::{CellId, FOLDS, Shard, Spread, Store, Summary, cell_table};
use crate::train::{
    BodyEquations, BodyRows, Coordinates, MIN_SAMPLES, MapOptions, Method, Monitor, Origin,
    Progress, Recordings, ScaleOptions, SetMetrics, TrainError, TrainOptions, TrainReport, Trained,
    assess, sha256,
};
use crate::typeset::words::counted;
use crate::typeset::{
    COLUMNS, Cell, NumberStyle, PrintOptions, Rounding, SymbolTable, Table, model_text,
    significant, wrapped,
};
use crate::{Error, artifact};

type Result<T, E = Error> = std::result::Result<T, E>;

#[derive(Debug, Clone)]
pub(crate) struct Answer {
    pub text: String,
    /// The same as one JSON object; a command's object gets the command's name before these entries.
    pub json: Value,
    /// The exit code of a command that ran: 0, 130 for a training ended by Ctrl-C, or 1 if its own purpose failed:
    /// files that `check` finds different; torques or control for `mpc`, predictions of body x or z for `simulate` and
    /// `demo`, every use for `report`.
    pub code: u8,
}

impl Answer {
    fn new(text: String, json: Value) -> Self {
        let code = DONE;
        Self { text, json, code }
    }

    fn failed_if(self, is_failed: bool) -> Self {
        let code = if is_failed { FAILED } else { DONE };
        Self { code, ..self }
    }
}

/// Runs the command of the process's arguments and prints its answer.
pub fn run() -> ExitCode {
    ExitCode::from(run_with(std::env::args_os()))
}

/// The same with the arguments of another program, including its name; returns the exit code.
pub fn run_with(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    let arguments = match Arguments::read(arguments) {
        Ok(arguments) => arguments,
        Err(refusal) => {
            // clap returns help and version as errors that go to stdout; a closed pipe is no failure.
            let text = refusal.to_string();
            match printable(&text) {
                // Colours are kept if the arguments contain no control characters.
                Cow::Borrowed(_) => drop(refusal.print()),
                Cow::Owned(text) => eprint!("{text}"),
            }
            return u8::try_from(refusal.exit_code()).unwrap_or(WRONG_USAGE);
        }
    };
    match execute(&arguments) {
        Ok(Answer { text, json, code }) => {
            let text = match arguments.json {
                true => format!("{}\n", printable_json(&json.to_string())),
                false => coloured(&printable(&text)),
            };
            if print(&text) { code } else { FAILED }
        }
        Err(error) => {
            to_stderr("error:", Style::new().red().bold(), &error.to_string());
            let first = std::error::Error::source(&error);
            for cause in std::iter::successors(first, |cause| cause.source()) {
                to_stderr("  because:", Style::new(), &cause.to_string());
            }
            if error.is_usage() {
                WRONG_USAGE
            } else {
                FAILED
            }
        }
    }
}

const DONE: u8 = 0;
const FAILED: u8 = 1;
const WRONG_USAGE: u8 = 2;

fn execute(arguments: &Arguments) -> Result<Answer> {
    arguments.refuse_idle()?;
    let (name, mut answer) = match &arguments.command {
        Command::Check(arguments) => ("check", check::run(arguments)?),
        Command::Demo(arguments) => ("demo", demo::run(arguments)?),
        Command::Inspect(arguments) => ("inspect", inspect::run(arguments)?),
        Command::Train(arguments) => {
            let refined = arguments
                .from
                .as_deref()
                .map(|from| refine::run(arguments, from));
            ("train", refined.unwrap_or_else(|| train::run(arguments))?)
        }
        Command::Study(arguments) => ("study", study::run(arguments)?),
        Command::Convert(arguments) => ("convert", convert::run(arguments)?),
        Command::Identify(arguments) => ("identify", identify::run(arguments)?),
        Command::Import(arguments) => ("import", import::run(arguments)?),
        Command::Robot(arguments) => ("robot", robot::run(arguments)?),
        Command::Compile(arguments) => ("compile", compile::run(arguments)?),
        Command::Simulate(arguments) => ("simulate", simulate::run(arguments)?),
        Command::Mpc(arguments) => ("mpc", mpc::run(arguments)?),
        Command::Plan(arguments) => ("plan", plan::run(arguments)?),
        Command::Report(arguments) => ("report", report::run(arguments)?),
        Command::Manual(arguments) => ("manual", manual::pages(arguments)?),
        Command::Completions(arguments) => ("completions", manual::completions(arguments)),
    };
    let entries = std::mem::replace(&mut answer.json, json!({ "command": name }));
    extend(&mut answer.json, entries);
    Ok(answer)
}

/// The same text with the first words of failures, verdicts and notes in colour, where stdout is a terminal.
fn coloured(text: &str) -> String {
    if !console::colors_enabled() {
        return text.to_owned();
    }
    let heads = [
        ("FAILED", style("FAILED").red().bold()),
        ("verdict:", style("verdict:").bold()),
        ("warning:", style("warning:").yellow().bold()),
        ("note:", style("note:").cyan()),
    ];
    let line = |line: &str| {
        let head = heads.iter().find(|(head, _)| line.starts_with(head));
        match head {
            Some((head, styled)) => format!("{styled}{}", &line[head.len()..]),
            None => line.to_owned(),
        }
    };
    text.split_inclusive('\n').map(line).collect()
}

/// Prints to stdout, and returns whether that succeeded; a closed pipe (`| head`) is no failure.
fn print(text: &str) -> bool {
    let mut stdout = io::stdout().lock();
    let written = stdout.write_all(text.as_bytes());
    let error = written.and_then(|()| stdout.flush()).err();
    let error = error.filter(|error| error.kind() != io::ErrorKind::BrokenPipe);
    if let Some(error) = &error {
        eprintln!("error: cannot write to stdout: {error}");
    }
    error.is_none()
}
