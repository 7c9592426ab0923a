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

/// The kinds in the order of [`LatentVariable::all`], with their names.
const KINDS: [(&str, fn(usize) -> LatentVariable); 3] = [
    ("z", LatentVariable::Z),
    ("dz", LatentVariable::Dz),
    ("u", LatentVariable::U),
];

impl LatentVariable {
    /// The variable with this name, if there is one at `latent_dim`.
    pub fn from_name(name: &str, latent_dim: usize) -> Option<Self> {
        let digits_at = name.find(|c: char| c.is_ascii_digit())?;
        let (kind, digits) = name.split_at(digits_at);
        let canonical = !digits.starts_with('0') && digits.bytes().all(|b| b.is_ascii_digit());
        let number: usize = digits.parse().ok().filter(|_| canonical)?;
        let index = number.checked_sub(1).filter(|&index| index < latent_dim)?;
        let (_, variable) = KINDS.iter().find(|(known, _)| *known == kind)?;
        Some(variable(index))
    }

    /// Its kind's place in [`KINDS`], and its index.
    fn parts(self) -> (usize, usize) {
        match self {
            LatentVariable::Z(index) => (0, index),
            LatentVariable::Dz(index) => (1, index),
            LatentVariable::U(index) => (2, index),
        }
    }

    /// Its place in [`Self::all`], if it is there at `latent_dim`.
    pub fn place(self, latent_dim: usize) -> Option<usize> {
        let (kind, index) = self.parts();
        (index < latent_dim).then_some(kind * latent_dim + index)
    }

    /// All variables at `latent_dim`: z, then dz, then u.
    pub fn all(latent_dim: usize) -> impl Iterator<Item = Self> {
        (KINDS.into_iter()).flat_map(move |(_, variable)| (0..latent_dim).map(variable))
    }
}

impl fmt::Display for LatentVariable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (kind, index) = self.parts();
        write!(f, "{}{}", KINDS[kind].0, index + 1)
    }
}
