//! How recordings are read, for every command that reads some.

use std::path::PathBuf;

use clap::Args;

use crate::cli::output::quoted;
use crate::recording::Clocks;

/// How recordings are read.
#[derive(Debug, Clone, Default, Args)]
pub struct ReadingArguments {
    /// What the columns of the recordings are: names, units, signs, order, clocks of another program's log
    /// (`romc inspect --guess LOG` writes a first one)
    #[arg(long, value_name = "MAP.toml")]
    pub columns: Option<PathBuf>,
    /// Whether clocks and angular rates that disagree with the motion are mended (unless given they are, but not by
    /// `inspect`, `convert` and `plan`; by `identify` always)
    #[arg(long, value_enum, hide_possible_values = false)]
    pub clock: Option<Clocks>,
}

impl ReadingArguments {
    /// The flags as typed, with a blank before each.
    pub fn as_flags(&self) -> String {
        let columns = self.columns.iter();
        let columns = columns.map(|path| format!(" --columns {}", quoted(path)));
        let clock = self.clock.iter().map(|clock| match clock {
            Clocks::Recorded => " --clock recorded".to_owned(),
            Clocks::Repaired => " --clock repaired".to_owned(),
        });
        columns.chain(clock).collect()
    }
}
