//! Names of latent variables: `z1`, `dz1`, `u1` and so on.

use std::fmt;

/// A variable of candidate terms; indices count from 0, names in files from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LatentVariable {
    /// Latent coordinate, `z1` for index 0.
    Z(usize),
    /// Latent velocity, `dz1` for index 0.
    Dz(usize),
    /// Latent input, `u1` for index 0.
    U(usize),
}

impl LatentVariable {
    /// The variable with this name, if there is one at `latent_dim`.
    pub fn from_name(name: &str, latent_dim: usize) -> Option<Self> {
        let digits_at = name.find(|c: char| c.is_ascii_digit())?;
        let (kind, digits) = name.split_at(digits_at);
        let canonical = !digits.starts_with('0') && digits.bytes().all(|b| b.is_ascii_digit());
        let number: usize = digits.parse().ok().filter(|_| canonical)?;
        let index = number.checked_sub(1).filter(|&index| index < latent_dim)?;
        match kind {
            "z" => Some(LatentVariable::Z(index)),
            "dz" => Some(LatentVariable::Dz(index)),
            "u" => Some(LatentVariable::U(index)),
            _ => None,
        }
    }

    /// Its place in [`Self::all`], if it is there at `latent_dim`.
    pub fn place(self, latent_dim: usize) -> Option<usize> {
        let (block, index) = match self {
            LatentVariable::Z(index) => (0, index),
            LatentVariable::Dz(index) => (1, index),
            LatentVariable::U(index) => (2, index),
        };
        (index < latent_dim).then_some(block * latent_dim + index)
    }

    /// All variables at `latent_dim`: z, then dz, then u.
    pub fn all(latent_dim: usize) -> impl Iterator<Item = Self> {
        let indices = move || 0..latent_dim;
        indices()
            .map(LatentVariable::Z)
            .chain(indices().map(LatentVariable::Dz))
            .chain(indices().map(LatentVariable::U))
    }
}

impl fmt::Display for LatentVariable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LatentVariable::Z(index) => write!(f, "z{}", index + 1),
            LatentVariable::Dz(index) => write!(f, "dz{}", index + 1),
            LatentVariable::U(index) => write!(f, "u{}", index + 1),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variable_names_are_read_and_written_alike() {
        for variable in LatentVariable::all(12) {
            assert_eq!(
                LatentVariable::from_name(&variable.to_string(), 12),
                Some(variable)
            );
        }
        for name in [
            "z0",
            "z13",
            "z01",
            "z",
            "z1x",
            "ddz1",
            "1",
            "u99999999999999999999",
        ] {
            assert_eq!(LatentVariable::from_name(name, 12), None, "{name}");
        }
    }
}
