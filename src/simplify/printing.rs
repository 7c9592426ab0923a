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

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

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
