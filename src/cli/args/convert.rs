//! `romc convert`: recordings and logs of other programs into one format.

use std::path::PathBuf;

use clap::Args;

use super::reading::ReadingArguments;

/// `romc convert`
#[derive(Debug, Args)]
#[command(
    after_help = "The ending of the output says its format: .csv, .csv.gz or .mcap. Clocks stay as recorded unless\n\
                  --clock repaired.\n\n\
                  Examples:\n  \
                  romc convert log.txt --columns my-log.toml --output jump.csv.gz\n  \
                  romc convert jump.mcap --output jump.csv --inputs-of models/go1-d4.json"
)]
pub struct ConvertArguments {
    /// Recordings, or logs that --columns describes; several follow each other in the output
    #[arg(required = true, value_name = "RECORDING")]
    pub recordings: Vec<PathBuf>,
    /// The file to write
    #[arg(long, value_name = "FILE")]
    pub output: PathBuf,
    /// Also write the 18 inputs that this model has of each sample, in N and N m
    #[arg(long, value_name = "MODEL.json")]
    pub inputs_of: Option<PathBuf>,
    /// Replace an existing output file
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub reading: ReadingArguments,
}
