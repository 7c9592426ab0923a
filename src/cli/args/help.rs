//! The two helps of every command: `-h` lists the main options, `--help` all of them and the meaning of each value.

use std::ffi::OsString;
use std::fmt::Write as _;

use clap::{Arg, CommandFactory as _, FromArgMatches as _};

use super::*;

/// Heading of the options that every command ends with.
pub(super) const OUTPUT: &str = "Output";
/// Heading of the options about reading recordings.
pub(super) const RECORDINGS: &str = "Recordings";

pub(super) fn help_flag() -> Arg {
    let help = "Print help: -h lists the main options, --help all options";
    let flag = Arg::new("help").short('h').long("help").help(help);
    last(flag.action(ArgAction::Help), 1001)
}

pub(super) fn version_flag() -> Arg {
    let flag = Arg::new("version").short('V').long("version");
    last(flag.action(ArgAction::Version).help("Print version"), 1002)
}

fn last(flag: Arg, order: usize) -> Arg {
    flag.global(true).help_heading(OUTPUT).display_order(order)
}

impl Arguments {
    /// Reads a command line; the first word is the program's name.
    pub(crate) fn read(words: impl IntoIterator<Item = OsString>) -> Result<Self, clap::Error> {
        let words: Vec<OsString> = words.into_iter().collect();
        let is_full = words.iter().any(|word| word == "--help" || word == "help");
        let command = Self::command();
        let mut command = if is_full { in_full(command) } else { command };
        let mut matches = command.try_get_matches_from_mut(words)?;
        Self::from_arg_matches_mut(&mut matches).map_err(|error| error.format(&mut command))
    }
}

/// Shows hidden options and the meaning of values in the layout of `-h`, which needs half the lines of clap's long help.
fn in_full(command: clap::Command) -> clap::Command {
    let after = command.get_after_long_help().or(command.get_after_help());
    let after = after.cloned().unwrap_or_default();
    let command = command.after_help(after).after_long_help(None);
    command.mut_args(with_values).mut_subcommands(in_full)
}

fn with_values(argument: Arg) -> Arg {
    let argument = argument.hide_short_help(false);
    let values = argument.get_possible_values();
    let is_explained = values.iter().any(|value| value.get_help().is_some());
    if argument.is_hide_possible_values_set() || !is_explained {
        return argument;
    }
    let mut text = argument.get_help().unwrap_or(&"".into()).to_string();
    for default in argument.get_default_values() {
        let _ = write!(text, " [default: {}]", default.display());
    }
    for value in values {
        let help = value
            .get_help()
            .map(ToString::to_string)
            .unwrap_or_default();
        let _ = write!(text, "\n- {}: {help}", value.get_name());
    }
    let argument = argument.help(text).hide_possible_values(true);
    argument.hide_default_value(true)
}
