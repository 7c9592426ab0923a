//! `romc check`: the command; what it compares is in `check/units.rs`.

#[path = "check/command.rs"]
mod command;
mod command_line;
