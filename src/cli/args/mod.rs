//! The command line's grammar: the commands, their options, and an example for each.
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
mod convert;
mod identify;
mod import;
mod manual;
mod number;
mod plan;
mod reading;
mod robot;
mod run;
mod train;

pub use check::CheckArguments;
pub use command::{Arguments, Command};
pub use compile::{
    CodeArguments, CompileArguments, EquationArguments, SimplifyArguments, UnitsChoice,
};
pub use convert::ConvertArguments;
pub use identify::IdentifyArguments;
pub use import::{ImportArguments, LibraryArgument};
pub use manual::{CompletionsArguments, ManualArguments};
pub use plan::PlanArguments;
pub use reading::ReadingArguments;
pub use robot::{RobotArguments, RobotParser};
pub use run::{DemoArguments, InspectArguments, MpcArguments, ReportArguments, SimulateArguments};
pub use train::{Dimensions, PhaseSet, StudyArguments, TrainArguments, TrainSettings, Widths};
