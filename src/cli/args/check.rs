//! `romc check`: whether two files say the same.

use std::path::PathBuf;

use clap::Args;

/// `romc check`
#[derive(Debug, Args)]
#[command(
    after_help = "Phases of LaTeX go by a comment `% Phase NAME` (in Markdown a heading) or a label that ends in\n\
                  the name, else by their order. Decimals of LaTeX and Markdown stand for numbers rounded in\n\
                  their last digit, unless --exact. A domain is a TOML file with a table per phase and a range\n\
                  per variable (scaled units), such as `[contact]` and `z1 = [-0.2, 0.4]`; without it, points\n\
                  are searched in -1 to 1, then closer and farther.\n\n\
                  Exit code 0: proven equal; 1: different, or not decided; 2: a file could not be read.\n\n\
                  Examples:\n  \
                  romc check models/paper-2d.json paper.tex\n  \
                  romc check models/go1-d4.json equations.txt --domain ranges.toml"
)]
pub struct CheckArguments {
    /// A model (.json), equations (.txt), or LaTeX (.tex, .md)
    #[arg(value_name = "A")]
    pub left: PathBuf,
    /// What to compare it with, of any of these kinds
    #[arg(value_name = "B")]
    pub right: PathBuf,
    /// Ranges in which points of difference are searched
    #[arg(long, value_name = "FILE.toml")]
    pub domain: Option<PathBuf>,
    /// Take decimals of LaTeX and Markdown as exact
    #[arg(long)]
    pub exact: bool,
    /// Another name that LaTeX has for a variable, such as z1=x or u2=F_z; can be repeated
    #[arg(long, value_name = "VARIABLE=NAME")]
    pub symbols: Vec<String>,
}
