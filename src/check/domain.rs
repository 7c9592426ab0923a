//! Ranges of variables in which two sides are compared.

use std::collections::BTreeMap;
use std::path::Path;

use super::side::CheckError;
use crate::model::{LatentVariable, MAX_LATENT_DIM};

/// A range per variable and phase; -1 to 1 where there is none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CheckDomain {
    phases: BTreeMap<String, BTreeMap<String, [f64; 2]>>,
}

impl CheckDomain {
    /// Reads a TOML text: a table per phase with ranges such as `z1 = [-0.2, 0.4]`, scaled units.
    pub(crate) fn from_toml(path: &Path, text: &str) -> Result<Self, CheckError> {
        let refused = |message: String| CheckError::Domain {
            path: path.to_owned(),
            message,
        };
        let phases: BTreeMap<String, BTreeMap<String, [f64; 2]>> =
            toml::from_str(text).map_err(|error| refused(error.to_string()))?;
        for (phase, ranges) in &phases {
            for (name, [lo, hi]) in ranges {
                let place = format!("[{phase}] `{name}`");
                if LatentVariable::from_name(name, MAX_LATENT_DIM).is_none() {
                    return Err(refused(format!("{place}: expected z1, dz1, u1 and so on")));
                }
                if !(lo.is_finite() && hi.is_finite() && lo <= hi) {
                    let found =
                        format!("{place}: found [{lo}, {hi}], expected two rising finite numbers");
                    return Err(refused(found));
                }
            }
        }
        Ok(Self { phases })
    }

    /// The first phase or variable that is none of these: its ranges would be without effect.
    pub fn foreign(&self, phases: &[&str], latent_dim: usize) -> Option<String> {
        let foreign = self.phases.iter().find_map(|(phase, ranges)| {
            if !phases.contains(&phase.as_str()) {
                return Some(format!("[{phase}]"));
            }
            let is_foreign = |name: &&String| LatentVariable::from_name(name, latent_dim).is_none();
            let name = ranges.keys().find(is_foreign)?;
            Some(format!("[{phase}] `{name}`"))
        });
        foreign.map(|found| {
            let phases = phases.join(", ");
            format!("{found}: expected phases {phases}, and variables of {latent_dim} latent coordinates")
        })
    }

    pub(crate) fn range(&self, phase: &str, variable: &str) -> Option<[f64; 2]> {
        self.phases.get(phase)?.get(variable).copied()
    }
}
