//! The command line's grammar: commands, options, an example for each. Read `command.rs` first.

pub(super) mod command;
pub(super) mod compile;
mod idle;
mod import;
mod train;
mod value;

pub(crate) use command::*;
pub(crate) use compile::*;
pub(crate) use import::*;
pub(crate) use train::*;
pub(crate) use value::ReadingArguments;
