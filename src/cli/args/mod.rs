//! What can be typed: the commands, their options, and an example for each.
//!
//! The command line enters; [`Arguments`] leaves, with everything checked that needs no file. Read
//! `command.rs` first; each other file holds the commands of one family.

#![allow(
    missing_docs,
    reason = "a variant's help is in the structure of its arguments"
)]

mod check;
mod command;
mod compile;
mod identify;
mod import;
mod manual;
mod number;
mod run;
mod train;

pub use check::CheckArguments;
pub use command::{Arguments, Command, OutputArguments};
pub use compile::{
    CodeArguments, CompileArguments, EquationArguments, FormChoice, PrecisionChoice,
    SimplifyArguments, SinCosChoice, UnitsChoice,
};
pub use identify::IdentifyArguments;
pub use import::{ImportArguments, LibraryArgument};
pub use manual::{CompletionsArguments, ManualArguments};
pub use run::{
    DemoArguments, InspectArguments, LiftChoice, MpcArguments, ReferenceInput, ReportArguments,
    SimulateArguments,
};
pub use train::{
    AccelerationSource, BpttIntegrator, Dimensions, FilterShape, FilteredRows, HiddenActivation,
    PhaseSet, StudyArguments, TrainArguments, TrainMethod, TrainSettings, Widths,
};
