//! `romc manual`, `romc completions`: help outside the program.

use std::path::PathBuf;

use clap::Args;

/// `romc manual`
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  romc manual --out-dir ~/.local/share/man/man1 && man romc-compile"
)]
pub struct ManualArguments {
    /// Folder for the pages
    #[arg(long, value_name = "DIR")]
    pub out_dir: PathBuf,
    /// Replace files in the folder that romc did not make
    #[arg(long)]
    pub force: bool,
}

/// `romc completions`
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  romc completions bash > ~/.local/share/bash-completion/completions/romc"
)]
pub struct CompletionsArguments {
    /// The shell: bash, zsh, fish, elvish or powershell
    #[arg(value_enum, value_name = "SHELL")]
    pub shell: clap_complete::Shell,
}
