//! The command line's grammar: commands, options, an example for each. Read `command.rs` first.

mod command;
mod compile;
mod idle;
mod import;
mod train;
mod value;

pub use command::Arguments;
pub(crate) use command::*;
pub use compile::UnitsChoice;
pub(crate) use compile::*;
pub(crate) use import::*;
pub(crate) use train::*;
pub(crate) use value::ReadingArguments;
