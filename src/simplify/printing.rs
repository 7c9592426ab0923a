//! Errors of printed equations, whose coefficients are rounded.

use super::domain::{Domain, Samples};
use super::error::SimplifyError;
use super::measure::{Measured, at_samples};
use super::workspace::Workspace;
use crate::model::ReducedModel;
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
pub fn printed(
    model: &ReducedModel,
    domain: &Domain,
    samples: Option<&Samples>,
    rounding: Rounding,
) -> Result<Vec<PrintedEquation>, SimplifyError> {
    let workspace = Workspace::new(model)?;
    let mut equations = Vec::new();
    for (index, phase) in model.phases().iter().enumerate() {
        let theta = match samples.map(|samples| &samples.phases[index]) {
            None => None,
            Some(samples) => {
                let inside = domain.inside(index, samples);
                let of = |all: &nalgebra::DMatrix<f64>| all.select_columns(&inside);
                let [z, dz, u_lat] = [&samples.z, &samples.dz, &samples.u_lat].map(of);
                Some(workspace.library().evaluate_points(&z, &dz, &u_lat)?)
            }
        };
        let mut ranges = domain.phase(index).map(|domain| workspace.ranges(domain));
        for output in 0..model.latent_dim() {
            let errors = phase.active_terms(output).map(|(term, coefficient)| {
                let printed = Decimal::rounded(coefficient, rounding).value();
                (term.index(), coefficient, printed)
            });
            let errors: Vec<_> = errors
                .filter(|(_, exact, printed)| exact != printed)
                .collect();
            let intervals = errors.iter().map(|&(row, exact, printed)| {
                (row, Interval::point(exact) - Interval::point(printed))
            });
            let intervals: Vec<_> = intervals.collect();
            let parts: Vec<_> = errors
                .iter()
                .map(|&(row, exact, print)| (row, exact - print))
                .collect();
            equations.push(PrintedEquation {
                phase: phase.name.clone(),
                output,
                bound: (ranges.as_mut()).map(|ranges| ranges.combination(&intervals)),
                measured: (theta.as_ref())
                    .and_then(|theta| Measured::of(at_samples(theta, &parts))),
            });
        }
    }
    Ok(equations)
}
