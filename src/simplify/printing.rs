//! Errors of printed equations, whose coefficients are rounded.

use super::domain::{Domain, Samples};
use super::error::SimplifyError;
use super::measure::{Differences, Measured};
use super::workspace::Workspace;
use crate::equations::Equations;
use crate::symbolic::Interval;
use crate::typeset::{Decimal, Rounding};

/// How far a printed equation can be from the model's.
#[derive(Clone, Debug, PartialEq)]
pub struct PrintedEquation {
    /// The phase's name.
    pub phase: String,
    /// Index of the latent coordinate.
    pub output: usize,
    /// Contains `ddz` of the model minus `ddz` as printed at every point of the domain; `None`
    /// where the phase has none.
    pub bound: Option<Interval>,
    /// The same at the recorded samples in the domain.
    pub measured: Option<Measured>,
}

/// The errors of all equations when their coefficients are printed with `rounding`.
///
/// # Errors
/// [`SimplifyError::Model`] for samples of another model.
pub(crate) fn printed(
    equations: &Equations<'_>,
    domain: &Domain,
    samples: Option<&Samples>,
    rounding: Rounding,
) -> Result<Vec<PrintedEquation>, SimplifyError> {
    let workspace = Workspace::new(equations)?;
    let mut all = Vec::new();
    for (index, phase) in equations.phases().iter().enumerate() {
        let theta = domain.theta(index, samples, workspace.library())?;
        let mut ranges = domain.phase(index).map(|domain| workspace.ranges(domain));
        for (output, summands) in phase.ddz.iter().enumerate() {
            let differences = summands.iter().map(|summand| {
                let printed = Decimal::rounded(summand.coefficient, rounding).value();
                (summand.term, summand.coefficient, printed)
            });
            let differences = differences.filter(|(_, exact, printed)| exact != printed);
            let differences = Differences(differences.collect());
            all.push(PrintedEquation {
                phase: phase.name.clone(),
                output,
                bound: (ranges.as_mut()).map(|ranges| differences.bound(ranges)),
                measured: differences.measured(&theta),
            });
        }
    }
    Ok(all)
}
