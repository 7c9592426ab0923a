//! Runs `romc check` on files. `check/units.rs` lists the tests of how it compares, which are mounted in the library.

#[path = "check/command.rs"]
mod command;
mod command_line;
