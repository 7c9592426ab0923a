//! Arguments of `romc study`.

use super::*;
use crate::limits::table;
use crate::study::Shard;
use crate::train::Method;

const STUDY: &str = "Study";
const PARTS: &str = "Parts";

#[derive(Debug, Args)]
#[command(mut_arg("clock", |clock| clock.help(clock_help("repaired; recorded with --paper"))))]
#[command(
    override_usage = "romc study [OPTIONS] <RECORDING>...\n       romc study [OPTIONS] --merge <DIR>...",
    after_help = "The example trains 45 models and takes about a minute on two cores. The same command continues a \
                  study that was stopped. On a cluster, `--shard 3/8` computes a part, and `romc study --merge part1 \
                  part2 --out-dir whole` joins parts.\n\n\
                  Example:\n  \
                  romc study examples/recordings/go1/train_*.csv.gz \\\n      \
                  --validation examples/recordings/go1/validation_*.csv.gz --latent-dims 1..9 --seeds 5"
)]
pub(crate) struct StudyArguments {
    /// Recordings to learn from
    #[arg(value_name = "RECORDING", required_unless_present = "merge")]
    pub recordings: Vec<PathBuf>,
    /// Recordings that choose among candidate models and give the metrics [default: the training recordings]
    #[arg(long, help_heading = RECORDINGS, value_name = "RECORDING", num_args = 1..)]
    pub validation: Vec<PathBuf>,
    /// Robot of the recordings: go1, go2, a1, or a .toml or .urdf file [default: go1]
    #[arg(long, help_heading = RECORDINGS, value_name = "ROBOT")]
    #[arg(value_parser = RobotParser, hide_possible_values = true)]
    pub robot: Option<String>,
    #[command(flatten)]
    pub reading: ReadingArguments,
    /// Latent dimensions: `4`, `1..18` (both ends included) or `2,4,6`. The default recipe has models up to 9
    #[arg(long, help_heading = STUDY, value_name = "DIMS", default_value = "1..9")]
    #[arg(value_parser = dimensions)]
    pub latent_dims: Dimensions,
    /// Number of seeds per dimension
    #[arg(long, help_heading = STUDY, value_name = "N", default_value_t = 5)]
    #[arg(value_parser = count(&table::SEEDS))]
    pub seeds: usize,
    /// Method of learning [default: closed-form; joint with --paper or a setting of it]
    #[arg(long, help_heading = STUDY, value_enum)]
    pub method: Option<Method>,
    /// Train as in the paper, by the joint method
    #[arg(long, help_heading = STUDY)]
    pub paper: bool,
    /// Settings of `romc train`, without `latent-dim`, `seed` and `seeds` [default: none]
    #[arg(long, help_heading = STUDY, value_name = "FILE.toml")]
    pub config: Option<PathBuf>,
    /// Weight lambda of the complexity in the combined loss 2 E_dec + 2 lambda ln |Xi|
    #[arg(long, help_heading = STUDY, default_value_t = crate::evaluate::LAMBDA)]
    #[arg(value_parser = real(&table::LAMBDA))]
    pub lambda: f64,
    /// Compute only this part of the study, such as 3/8 [default: 1/1]
    #[arg(long, help_heading = PARTS, value_name = "PART", value_parser = Shard::parse)]
    #[arg(conflicts_with = "merge")]
    pub shard: Option<Shard>,
    /// Join the finished parts in these folders instead of training [default: none]
    #[arg(long, help_heading = PARTS, value_name = "DIR", num_args = 1..)]
    #[arg(conflicts_with_all = ["recordings", "validation", "config", "latent_dims", "seeds", "method", "paper", "robot"])]
    pub merge: Vec<PathBuf>,
    /// Folder of the study
    #[arg(long, help_heading = OUTPUT, value_name = "DIR", default_value = "out/study")]
    pub out_dir: PathBuf,
    /// Replace tables and figures of other origin that have the same names
    #[arg(long, help_heading = OUTPUT, action = ArgAction::SetTrue, value_parser = overwrite())]
    pub force: Overwrite,
}

/// Latent dimensions of a study, ascending.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Dimensions(pub Vec<usize>);

fn dimensions(text: &str) -> Result<Dimensions, String> {
    let expected =
        || format!("found `{text}`, expected 4, 1..18 or 2,4,6, each from 1 to {STATE_DIM}");
    let number = |text: &str| match text.trim().parse::<usize>() {
        Ok(d) if (1..=STATE_DIM).contains(&d) => Ok(d),
        _ => Err(expected()),
    };
    let mut found = match text.split_once("..") {
        Some((first, last)) => (number(first)?..=number(last)?).collect(),
        None => text.split(',').map(number).collect::<Result<Vec<_>, _>>()?,
    };
    found.sort_unstable();
    match found.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(&[twice, _]) => Err(format!(
            "found {twice} twice in `{text}`, expected each once"
        )),
        _ if found.is_empty() => Err(expected()),
        _ => Ok(Dimensions(found)),
    }
}
