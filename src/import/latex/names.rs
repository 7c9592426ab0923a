//! How a document writes the model's variables.

use std::collections::BTreeMap;

use super::reader::has;
use crate::model::{LatentVariable, MAX_LATENT_DIM};

/// The Greek letters that a variable can be named by.
const GREEK: &str = "alpha beta gamma delta epsilon varepsilon zeta eta theta vartheta iota kappa \
    lambda mu nu xi pi rho sigma tau upsilon phi varphi chi psi omega Gamma Delta Theta Lambda Xi \
    Pi Sigma Upsilon Phi Psi Omega";

pub(super) fn is_greek(command: &str) -> bool {
    has(GREEK, command)
}

/// Why a name for a variable was refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{entry}`: expected `VARIABLE=NAME`, such as `z1=x`, `z2=theta` or `u1=F_lin,x`, each variable and name once"
)]
pub struct NameError {
    /// The entry as given.
    pub entry: String,
}

/// Names that a document gives to latent coordinates and inputs; `z_1` and `u_1` unless renamed.
///
/// A name is written as in `romc compile --rename`: a letter, word or Greek letter's name, with an optional subscript
/// (`x`, `theta`, `F_lin,x`). Velocities follow their coordinate.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SymbolNames {
    names: BTreeMap<String, LatentVariable>,
}

impl SymbolNames {
    /// Reads entries `VARIABLE=NAME`.
    ///
    /// # Errors
    /// [`NameError`] for an entry without `=`, with a left side other than `z1` to `z64` or `u1` and so on, or with a
    /// variable or name that was given before.
    pub fn parse<S: AsRef<str>>(entries: &[S]) -> Result<Self, NameError> {
        let mut names = BTreeMap::new();
        for entry in entries.iter().map(AsRef::as_ref) {
            let refused = || NameError {
                entry: entry.to_owned(),
            };
            let (left, right) = entry.split_once('=').ok_or_else(refused)?;
            let variable = LatentVariable::from_name(left.trim(), MAX_LATENT_DIM)
                .filter(|variable| !matches!(variable, LatentVariable::Dz(_)))
                .ok_or_else(refused)?;
            let name: String = (right.chars())
                .filter(|c| !c.is_whitespace() && !"{}\\".contains(*c))
                .collect();
            let is_part = |c: char| c.is_ascii_alphanumeric() || "_,".contains(c);
            let is_name =
                name.starts_with(|c: char| c.is_ascii_alphabetic()) && name.chars().all(is_part);
            let is_again = names.values().any(|other| *other == variable);
            if !is_name || is_again || names.insert(name, variable).is_some() {
                return Err(refused());
            }
        }
        Ok(Self { names })
    }

    /// The variable of a name as `Symbol` spells it: `z_1`, `F_lin,x`.
    ///
    /// `alone` allows `z` and `u` without a subscript, for the first of each.
    pub(super) fn variable(&self, name: &str, alone: bool) -> Option<LatentVariable> {
        if let Some(variable) = self.names.get(name) {
            return Some(*variable);
        }
        let plain = match name.split_once('_') {
            None if alone && matches!(name, "z" | "u") => format!("{name}1"),
            None => return None,
            Some(("u", subscript)) => format!("u{}", subscript.trim_start_matches("lat,")),
            Some(("z", subscript)) => format!("z{subscript}"),
            Some(_) => return None,
        };
        LatentVariable::from_name(&plain, MAX_LATENT_DIM)
            .filter(|variable| self.names.values().all(|renamed| renamed != variable))
    }

    /// The first entry whose variable equations of so many latent coordinates do not have.
    pub(in super::super) fn beyond(&self, latent_dim: usize) -> Option<String> {
        let is_beyond = |variable: &LatentVariable| match variable {
            LatentVariable::Z(k) | LatentVariable::Dz(k) | LatentVariable::U(k) => *k >= latent_dim,
        };
        let mut entries = self.names.iter();
        let (name, variable) = entries.find(|(_, variable)| is_beyond(variable))?;
        Some(format!("{variable}={name}"))
    }

    /// What can stand in an expression, for messages.
    pub(super) fn expected(&self) -> String {
        let renamed: Vec<&str> = self.names.keys().map(String::as_str).collect();
        match renamed.is_empty() {
            true => {
                "z_1, \\dot z_1, u_1 and so on (--symbols VARIABLE=NAME for other names)".to_owned()
            }
            false => format!("{}, z_k or u_k, with dots or without", renamed.join(", ")),
        }
    }
}
