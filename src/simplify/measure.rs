//! Differences of equations, also of those in print, whose coefficients are rounded: bounds over a box, size at
//! samples.

use nalgebra::DMatrix;
use serde::Serialize;

use super::domain::{Domain, Samples, SimplifyError};
use super::ranges::Ranges;
use super::workspace::Workspace;
use crate::equations::Equations;
use crate::symbolic::Interval;
use crate::typeset::{Decimal, Rounding};

/// How large an error is at recorded samples (scaled units per second squared).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Measured {
    pub max: f64,
    pub rms: f64,
}

impl Measured {
    pub(crate) fn of(errors: impl IntoIterator<Item = f64>) -> Option<Self> {
        let (mut count, mut square, mut max) = (0usize, 0.0, 0.0f64);
        for error in errors {
            count += 1;
            square += error * error;
            max = max.max(error.abs());
        }
        (count > 0).then(|| Self {
            max,
            rms: (square / count as f64).sqrt(),
        })
    }
}

/// Rows of terms with their coefficients before and after a change.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Differences(pub Vec<(usize, f64, f64)>);

impl Differences {
    pub(crate) fn between(before: &[f64], after: &[f64]) -> Self {
        let rows = before.iter().zip(after).enumerate();
        let rows = rows.map(|(row, (&before, &after))| (row, before, after));
        Self(rows.filter(|(_, before, after)| before != after).collect())
    }

    /// Contains the equation before minus the equation after at every point of the box.
    pub(crate) fn bound(&self, ranges: &mut Ranges) -> Interval {
        let parts = self
            .0
            .iter()
            .map(|&(row, before, after)| (row, Interval::point(before) - Interval::point(after)));
        ranges.combination(&parts.collect::<Vec<_>>())
    }

    pub(crate) fn measured(&self, theta: &DMatrix<f64>) -> Option<Measured> {
        let at = |sample: usize| -> f64 {
            let parts = self.0.iter();
            parts
                .map(|&(row, before, after)| (before - after) * theta[(sample, row)])
                .sum()
        };
        Measured::of((0..theta.nrows()).map(at))
    }
}

/// How far a printed equation can be from the model's.
#[derive(Clone, Debug, PartialEq)]
pub struct PrintedEquation {
    /// The phase's name.
    pub phase: String,
    /// Index of the latent coordinate.
    pub output: usize,
    /// Contains `ddz` of the model minus `ddz` as printed at every point of the domain; `None` where the phase has
    /// none.
    pub bound: Option<Interval>,
    /// The same at the recorded samples in the domain.
    pub measured: Option<Measured>,
}

/// The errors of all equations when their coefficients are printed with `rounding`.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{FeetRule, Library, Phase, ReducedModel};

    #[test]
    fn printing_error_is_bounded_by_what_was_cut_off() {
        let library = Library::from_terms(1, &["z1", "u1"].map(str::to_owned)).unwrap();
        let phase = Phase {
            name: "contact".to_owned(),
            feet: FeetRule::Any,
            xi: DMatrix::from_column_slice(2, 1, &[0.126, 1.0]),
        };
        let model = ReducedModel::builder("single", library)
            .phase(phase)
            .build()
            .unwrap();
        let domain = Domain::new(&model, vec![Some(vec![Interval::new(-2.0, 1.0); 3])]).unwrap();
        let rounding = Rounding::Decimals(2);
        let printed = printed(&Equations::of(&model), &domain, None, rounding).unwrap();
        let bound = printed[0].bound.expect("has a box");
        assert!((bound.magnitude() - 0.008).abs() < 1e-12, "{bound}");
    }
}
