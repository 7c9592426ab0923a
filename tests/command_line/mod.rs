//! Runs the binary as a user does.

use std::path::Path;
use std::process::{Command, Output};

/// Runs `romc` in a folder.
pub fn romc(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_romc"));
    let command = command.current_dir(folder).args(arguments);
    command.output().expect("the binary runs")
}

/// Output as text.
pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}
