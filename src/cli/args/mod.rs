//! The command line's grammar: the commands, their options, and an example for each.
//!
//! The command line enters; [`Arguments`] leaves, with everything checked that needs no file. Read
//! `command.rs` first.

#![allow(
    missing_docs,
    reason = "a variant's help is in the structure of its arguments"
)]

mod command;
mod compile;
mod idle;
mod import;
mod train;
mod value;

pub use command::{
    Arguments, CheckArguments, Command, CompletionsArguments, ConvertArguments, DemoArguments,
    IdentifyArguments, InspectArguments, ManualArguments, MpcArguments, PlanArguments,
    ReportArguments, RobotArguments, SimulateArguments,
};
pub use compile::{CompileArguments, SimplifyArguments, UnitsChoice};
pub use idle::refuse_idle;
pub use import::{ImportArguments, LibraryArgument};
pub use train::{PhaseSet, StudyArguments, TrainArguments, TrainSettings, Widths};
pub use value::ReadingArguments;
