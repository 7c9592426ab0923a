//! Names and units of the coordinates of state and input.

use serde::{Deserialize, Serialize};

use super::error::{ModelError, SignalPart, check_shape};

const MAX_TEXT_LEN: usize = 64;

/// Names and units of the coordinates of a vector, in order.
///
/// They reach comments and tables of generated files, so [`ReducedModel`](super::ReducedModel)
/// accepts only characters which mean nothing in C, Rust and CSV.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CoordinateNames {
    /// One name per coordinate, such as `fr.hx`.
    pub names: Vec<String>,
    /// One unit per coordinate, such as `N m`.
    pub units: Vec<String>,
}

impl CoordinateNames {
    /// Number of coordinates.
    pub fn dim(&self) -> usize {
        self.names.len()
    }

    /// Complains unless there are `dim` different names and `dim` units of harmless characters.
    pub(super) fn check(
        &self,
        signals: &'static str,
        dim: Option<usize>,
    ) -> Result<(), ModelError> {
        let dim = dim.unwrap_or(self.names.len());
        check_shape(&format!("{signals}.names"), (self.names.len(), 1), (dim, 1))?;
        check_shape(&format!("{signals}.units"), (self.units.len(), 1), (dim, 1))?;
        check_texts(signals, SignalPart::Name, &self.names)?;
        check_texts(signals, SignalPart::Unit, &self.units)?;
        let mut sorted: Vec<usize> = (0..dim).collect();
        sorted.sort_by_key(|&index| (&self.names[index], index));
        for pair in sorted.windows(2) {
            if self.names[pair[0]] == self.names[pair[1]] {
                return Err(ModelError::DuplicateSignal {
                    signals,
                    first: pair[0],
                    second: pair[1],
                    name: self.names[pair[1]].clone(),
                });
            }
        }
        Ok(())
    }
}

fn check_texts(
    signals: &'static str,
    part: SignalPart,
    texts: &[String],
) -> Result<(), ModelError> {
    let (allowed, punctuation) = match part {
        SignalPart::Name => ("ASCII letters, digits, `.`, `_`, `-`", "._-"),
        SignalPart::Unit => ("ASCII letters, digits, space, `/`, `^`, `.`, `-`", " /^.-"),
    };
    let fits = |text: &String| {
        (1..=MAX_TEXT_LEN).contains(&text.len())
            && !text.contains("//")
            && text
                .chars()
                .all(|c| c.is_ascii_alphanumeric() || punctuation.contains(c))
    };
    match texts.iter().position(|text| !fits(text)) {
        None => Ok(()),
        Some(index) => Err(ModelError::SignalText {
            signals,
            part,
            index,
            found: texts[index].chars().take(2 * MAX_TEXT_LEN).collect(),
            max: MAX_TEXT_LEN,
            allowed,
        }),
    }
}
