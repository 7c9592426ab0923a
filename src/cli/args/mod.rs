//! The command line's grammar: the commands, their options, and an example for each.
//!
//! The command line enters; [`Arguments`] leaves, with everything checked that needs no file. Read `command.rs` first.

mod command;
mod compile;
mod idle;
mod import;
mod train;
mod value;

pub use command::Arguments;
pub(crate) use command::{
    CheckArguments, Command, CompletionsArguments, ConvertArguments, DemoArguments,
    IdentifyArguments, InspectArguments, ManualArguments, MpcArguments, PlanArguments,
    ReportArguments, RobotArguments, SimulateArguments,
};
pub use compile::UnitsChoice;
pub(crate) use compile::{CompileArguments, SimplifyArguments};
pub(crate) use import::{ImportArguments, LibraryArgument};
pub(crate) use train::{PhaseSet, StudyArguments, TrainArguments, TrainSettings, Widths};
pub(crate) use value::ReadingArguments;
