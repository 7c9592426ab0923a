//! Names and units of the coordinates of state and input.

use serde::{Deserialize, Serialize};

use super::error::{ModelError, check_shape};
use crate::robot::Robot;

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
    /// Those of the robots' state and input.
    pub fn of_robot() -> [Self; 2] {
        [
            (Robot::state_names(), Robot::state_units()),
            (Robot::input_names(), Robot::input_units()),
        ]
        .map(|(names, units)| Self {
            names: names.to_vec(),
            units: units.to_vec(),
        })
    }

    pub(crate) fn dim(&self) -> usize {
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
        let names = ("ASCII letters, digits, `.`, `_`, `-`", "._-");
        check_texts(&format!("{signals}.names"), &self.names, names)?;
        let units = ("ASCII letters, digits, space, `/`, `^`, `.`, `-`", " /^.-");
        check_texts(&format!("{signals}.units"), &self.units, units)?;
        let mut sorted: Vec<usize> = (0..dim).collect();
        sorted.sort_by_key(|&index| (&self.names[index], index));
        for pair in sorted.windows(2) {
            if self.names[pair[0]] == self.names[pair[1]] {
                let place = format!("`{signals}.names`[{}]", pair[1]);
                let found = format!("{:?} as in [{}] already", self.names[pair[1]], pair[0]);
                return Err(ModelError::invalid(place, found, "different names"));
            }
        }
        Ok(())
    }

    /// Complains unless the names are these of a robot.
    pub(super) fn check_robot(
        &self,
        signals: &str,
        expected: &[String],
        robot: &Robot,
    ) -> Result<(), ModelError> {
        let mut pairs = self.names.iter().zip(expected).enumerate();
        match pairs.find(|(_, (found, expected))| found != expected) {
            None => Ok(()),
            Some((index, (found, expected))) => {
                let place = format!("`{signals}.names`[{index}]");
                let expected = format!("{expected:?} as on robot {}", robot.name());
                Err(ModelError::invalid(place, format!("{found:?}"), expected))
            }
        }
    }
}

/// Refuses texts of other characters than letters, digits and the given punctuation, which comes
/// with its description.
fn check_texts(
    list: &str,
    texts: &[String],
    (allowed, punctuation): (&str, &str),
) -> Result<(), ModelError> {
    let fits = |text: &String| {
        (1..=MAX_TEXT_LEN).contains(&text.len())
            && !text.contains("//")
            && text
                .chars()
                .all(|c| c.is_ascii_alphanumeric() || punctuation.contains(c))
    };
    match texts.iter().position(|text| !fits(text)) {
        None => Ok(()),
        Some(index) => {
            let found: String = texts[index].chars().take(2 * MAX_TEXT_LEN).collect();
            let expected = format!("1 to {MAX_TEXT_LEN} characters out of {allowed}");
            let place = format!("`{list}`[{index}]");
            Err(ModelError::invalid(place, format!("{found:?}"), expected))
        }
    }
}
