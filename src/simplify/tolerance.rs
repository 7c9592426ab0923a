//! How large the error of a simplified `ddz` may be.

use std::fmt;
use std::str::FromStr;

use crate::typeset::rounded;

/// The largest |ddz of the model - ddz of the simplified model| at any point of the domain, each latent coordinate for
/// itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tolerance {
    /// A share of the root mean square of that `ddz` over the recorded samples of the phase: 0.01 for `1%`.
    ShareOfRms(f64),
    /// In scaled units per second squared.
    Absolute(f64),
}

/// Why a tolerance was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "found `{found}`, expected a share such as 1% (of the root mean square of each ddz over the recordings) or a number such as 0.05 (scaled units per s^2)"
)]
pub struct ToleranceError {
    /// The text.
    pub found: String,
}

impl Tolerance {
    /// The tolerance with its unit, in words.
    pub fn words(self) -> String {
        match self {
            Self::ShareOfRms(_) => {
                format!("{self} of the root mean square of each ddz over the recordings")
            }
            Self::Absolute(_) => format!("{self} scaled units per s^2"),
        }
    }

    pub(crate) fn is_zero(self) -> bool {
        match self {
            Tolerance::ShareOfRms(value) | Tolerance::Absolute(value) => value == 0.0,
        }
    }
}

impl FromStr for Tolerance {
    type Err = ToleranceError;

    fn from_str(text: &str) -> Result<Self, ToleranceError> {
        let refused = || ToleranceError {
            found: text.to_owned(),
        };
        let number = |text: &str| match text.trim().parse::<f64>() {
            Ok(value) if value.is_finite() && value >= 0.0 => Ok(value),
            _ => Err(refused()),
        };
        match text.trim().strip_suffix('%') {
            Some(percent) => Ok(Tolerance::ShareOfRms(number(percent)? / 100.0)),
            None => Ok(Tolerance::Absolute(number(text)?)),
        }
    }
}

impl fmt::Display for Tolerance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            // two roundings, of the division and of this product, may leave 0.30000000000000004
            Tolerance::ShareOfRms(share) => {
                write!(f, "{}%", rounded(share * 100.0, 13))
            }
            Tolerance::Absolute(value) => write!(f, "{value}"),
        }
    }
}
