//! Ranges of the numbers that users set, one [`table`] for flags, files of settings and programs.

pub mod table;

use std::fmt;
use std::str::FromStr;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Name of the setting: that of its flag without dashes.
    pub name: &'static str,
    kind: Kind,
    pub least: f64,
    pub most: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Whole,
    Real,
    Above,
}

#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{name} is {found}, expected {expected}")]
pub struct OutOfRange {
    pub name: &'static str,
    pub found: String,
    pub expected: String,
}

impl Range {
    pub(crate) const fn whole(name: &'static str, least: u32, most: u32) -> Self {
        Self::new(name, Kind::Whole, least as f64, most as f64)
    }

    pub(crate) const fn real(name: &'static str, least: f64, most: f64) -> Self {
        Self::new(name, Kind::Real, least, most)
    }

    pub(crate) const fn above(name: &'static str, least: f64, most: f64) -> Self {
        Self::new(name, Kind::Above, least, most)
    }

    const fn new(name: &'static str, kind: Kind, least: f64, most: f64) -> Self {
        Self {
            name,
            kind,
            least,
            most,
        }
    }

    /// Whether a number is in the range; NaN never is.
    pub(crate) fn contains(&self, value: f64) -> bool {
        let is_kind = match self.kind {
            Kind::Whole => value.fract() == 0.0,
            Kind::Real => true,
            Kind::Above => value > self.least,
        };
        is_kind && (self.least..=self.most).contains(&value)
    }

    pub fn check(&self, value: f64) -> Result<f64, OutOfRange> {
        (self.contains(value).then_some(value)).ok_or_else(|| self.refusal(short(value)))
    }

    pub fn check_count(&self, value: usize) -> Result<usize, OutOfRange> {
        (self.contains(value as f64).then_some(value)).ok_or_else(|| self.refusal(value))
    }

    pub fn parse<T: FromStr + Copy + fmt::Display>(&self, text: &str) -> Result<T, String> {
        let in_range = |number: &T| {
            // A whole number beyond 2^53 is far beyond every range, so that its rounding does not matter.
            let value = number.to_string().parse();
            value.is_ok_and(|value| self.contains(value))
        };
        let parsed = text.trim().parse().ok().filter(in_range);
        parsed.ok_or_else(|| format!("expected {}", self.in_words()))
    }

    /// "a whole number from 1 to 500"
    pub fn in_words(&self) -> String {
        let [least, most] = [self.least, self.most].map(short);
        match self.kind {
            Kind::Whole => format!("a whole number from {least} to {most}"),
            Kind::Real => format!("a number from {least} to {most}"),
            Kind::Above => format!("a number above {least} and at most {most}"),
        }
    }

    fn refusal(&self, found: impl fmt::Display) -> OutOfRange {
        OutOfRange {
            name: self.name,
            found: found.to_string(),
            expected: self.in_words(),
        }
    }
}

fn short(value: f64) -> String {
    let (plain, power) = (format!("{value}"), format!("{value:e}"));
    match plain.len() > power.len() {
        true => power,
        false => plain,
    }
}
