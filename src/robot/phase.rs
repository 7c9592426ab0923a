//! A contact phase as it is written on a command line.

use std::fmt;
use std::str::FromStr;

use crate::{ContactFlags, FeetRule};

/// A phase by its name, and the feet that select it.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "String", into = "String")
)]
pub struct PhasePattern {
    /// Its name.
    pub name: String,
    /// When it holds.
    pub feet: FeetRule,
}

impl PhasePattern {
    /// The accepted forms of a pattern, in words.
    pub const EXPECTED: &str = "NAME=any, NAME=none, NAME=always, or NAME= and foot patterns in the order fr fl rr rl, \
                                such as rear=0011,0001";
}

impl fmt::Display for PhasePattern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.name, self.feet)
    }
}

impl From<PhasePattern> for String {
    fn from(pattern: PhasePattern) -> Self {
        pattern.to_string()
    }
}

impl TryFrom<String> for PhasePattern {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl FromStr for PhasePattern {
    /// The text found and the forms expected.
    type Err = String;

    /// Reads `NAME=any`, `NAME=none`, `NAME=always`, or a name with foot patterns.
    fn from_str(text: &str) -> Result<Self, String> {
        let refused = || format!("found {text:?}, expected {}", Self::EXPECTED);
        let (name, feet) = text.split_once('=').ok_or_else(refused)?;
        let pattern = |text: &str| flags(text.trim()).ok_or_else(refused);
        let feet = match feet.trim() {
            "any" => FeetRule::Any,
            "none" => FeetRule::None,
            "always" => FeetRule::always(),
            patterns => {
                FeetRule::Patterns(patterns.split(',').map(pattern).collect::<Result<_, _>>()?)
            }
        };
        let name = name.trim().to_owned();
        match name.is_empty() {
            true => Err(refused()),
            false => Ok(Self { name, feet }),
        }
    }
}

/// Feet of four digits.
fn flags(text: &str) -> Option<ContactFlags> {
    let flags = text.chars().map(|digit| match digit {
        '0' | '1' => Some(digit == '1'),
        _ => None,
    });
    flags.collect::<Option<Vec<bool>>>()?.try_into().ok()
}
