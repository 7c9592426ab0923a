//! Parsers of numbers by their ranges, and of names.

use clap::builder::{BoolValueParser, PossibleValue, StringValueParser, TypedValueParser};

use super::train::Finite;
use crate::files::Overwrite;
use crate::limits::Range;
use crate::robot::{Robot, WrenchFrame};

/// A whole number in a range.
pub(super) fn count(range: &'static Range) -> impl Fn(&str) -> Result<usize, String> + Clone {
    |text| range.parse(text)
}

/// A number in a range.
pub(super) fn real(range: &'static Range) -> impl Fn(&str) -> Result<f64, String> + Clone {
    |text| range.parse(text)
}

/// As [`real`], as settings hold it.
pub(super) fn finite(range: &'static Range) -> impl Fn(&str) -> Result<Finite, String> + Clone {
    |text| range.parse::<f64>(text)?.try_into()
}

/// `--force`, as those who write files take it.
pub(super) fn overwrite() -> impl TypedValueParser<Value = Overwrite> {
    BoolValueParser::new().map(Overwrite::when_forced)
}

/// Takes any text and offers the names of romc's own robots to shells.
#[derive(Clone, Debug)]
pub struct RobotParser;

impl TypedValueParser for RobotParser {
    type Value = String;

    fn parse_ref(
        &self,
        command: &clap::Command,
        argument: Option<&clap::Arg>,
        value: &std::ffi::OsStr,
    ) -> Result<String, clap::Error> {
        StringValueParser::new().parse_ref(command, argument, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        let names = Robot::known_names();
        Some(Box::new(names.into_iter().map(PossibleValue::new)))
    }
}

/// Reads `body` or `world`.
pub fn wrench_frame(text: &str) -> Result<WrenchFrame, String> {
    WrenchFrame::by_name(text).ok_or_else(|| format!("found `{text}`, expected `world` or `body`"))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use clap::CommandFactory as _;
    use clap::error::ErrorKind;

    use crate::cli::args::Arguments;
    use crate::limits::{Range, table};

    /// Flags that take a number and have no range of the table: any seed will do.
    const WITHOUT: [&str; 1] = ["seed"];

    /// Ranges by command and flag where it is not the training's.
    fn range(command: &str, flag: &str) -> Option<Range> {
        let others = [
            table::LAMBDA,
            table::HORIZON,
            table::STEP,
            table::TORQUE_RATE,
            table::RESTART_EVERY,
            table::MARGIN,
            table::WIDTH,
            table::DIGITS,
            table::SIGNIFICANT,
            table::SCALING,
            table::INPUT_SCALING,
            table::SAMPLE_TIME,
            table::DISTANCE,
            table::APEX,
        ];
        if (command, flag) == ("import", "latent-dim") {
            return Some(table::IMPORTED_LATENT_DIM);
        }
        if flag.ends_with("-layers") {
            return Some(table::LAYER_WIDTH);
        }
        let of_training = table::of_training(flag).copied();
        of_training.or_else(|| others.into_iter().find(|range| range.name == flag))
    }

    /// Whether a command refuses the value of a flag as such.
    fn refuses(command: &str, flag: &str, value: &str) -> bool {
        let flag = format!("--{flag}={value}");
        let found = Arguments::command().try_get_matches_from(["romc", command, &flag]);
        found.is_err_and(|error| error.kind() == ErrorKind::ValueValidation)
    }

    #[test]
    fn every_flag_that_takes_a_number_refuses_what_lies_outside_its_range() {
        let mut met = BTreeSet::new();
        for command in Arguments::command().get_subcommands() {
            let name = command.get_name();
            let flags = command
                .get_arguments()
                .filter_map(|argument| argument.get_long());
            for flag in flags.filter(|flag| !WITHOUT.contains(flag)) {
                let takes_one_of = |values: [&str; 3]| {
                    let mut values = values.into_iter();
                    values.any(|value| !refuses(name, flag, value))
                };
                let takes_numbers = refuses(name, flag, "words")
                    && takes_one_of(["1", "0.5", "3"])
                    && !takes_one_of(["1%", "1..2", "x=1"]);
                if !takes_numbers {
                    continue;
                }
                let range = range(name, flag);
                let range = range.unwrap_or_else(|| panic!("--{flag} of {name} has no range"));
                met.insert(range.name);
                let (least, most) = (range.least, range.most);
                assert!(!refuses(name, flag, &most.to_string()), "--{flag}={most}");
                let outside = match range.is_whole() {
                    true => [least - 1.0, most + 1.0],
                    false => [least - 1e-9 * most, most * (1.0 + 1e-9)],
                };
                for value in outside.into_iter().chain([f64::NAN, 1e300]) {
                    let value = value.to_string();
                    assert!(refuses(name, flag, &value), "--{flag}={value} of {name}");
                }
            }
        }
        assert!(met.len() >= 25, "{met:?}");
    }
}
