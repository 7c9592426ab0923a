//! Parsers of numbers by their ranges, and of names.

use clap::builder::{
    BoolValueParser, PossibleValue, PossibleValuesParser, StringValueParser, TypedValueParser,
};

use super::train::Finite;
use super::*;
use crate::limits::Range;

pub(super) fn count(range: &'static Range) -> impl Fn(&str) -> Result<usize, String> + Clone {
    |text| range.parse(text)
}

pub(super) fn real(range: &'static Range) -> impl Fn(&str) -> Result<f64, String> + Clone {
    |text| range.parse(text)
}

pub(super) fn finite(range: &'static Range) -> impl Fn(&str) -> Result<Finite, String> + Clone {
    |text| range.parse::<f64>(text)?.try_into()
}

/// One of a table of names, each with its help.
pub(super) fn choice<T: Copy + Send + Sync>(
    table: &'static [(&'static str, &'static str, T)],
) -> impl TypedValueParser<Value = T> {
    let names = (table.iter()).map(|(name, help, _)| PossibleValue::new(*name).help(*help));
    PossibleValuesParser::new(names).map(|found| {
        let row = table.iter().find(|(name, ..)| *name == found);
        row.expect("clap accepts names of the table alone").2
    })
}

pub(super) fn overwrite() -> impl TypedValueParser<Value = Overwrite> {
    BoolValueParser::new().map(Overwrite::from)
}

/// Accepts any text; shells complete it with the names of romc's own robots.
#[derive(Clone, Debug)]
pub(crate) struct RobotParser;

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
        let names = crate::robot_file::known_names();
        Some(Box::new(names.into_iter().map(PossibleValue::new)))
    }
}

pub(crate) fn wrench_frame(text: &str) -> Result<WrenchFrame, String> {
    text.parse()
        .map_err(|()| format!("found `{text}`, expected `ground`, `world` or `body`"))
}
