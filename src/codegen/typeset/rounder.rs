//! Coefficients before terms, with a record of what rounding changed.

use nalgebra::DMatrix;

use super::decimal::{Decimal, LEAST_DECIMALS, Rounding};
use super::equations::{Equation, EquationSystem};
use super::expression::with_coefficient;
use super::tree::{Signed, Symbol};

/// A coefficient's place in the model.
#[derive(Clone, Debug, PartialEq)]
pub struct Place {
    /// The phase's name.
    pub phase: String,
    /// `ddz1` and so on.
    pub output: String,
    /// The candidate term in the library's syntax.
    pub term: String,
    /// The coefficient in full.
    pub coefficient: f64,
    /// The left side of its equation.
    pub left: Symbol,
    /// The term, laid out.
    pub math: Signed,
}

/// What rounding for print changed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RoundingReport {
    /// Largest |printed - coefficient|, where it is not zero, and where it occurs.
    pub largest: Option<(f64, Place)>,
    /// Largest |printed - coefficient| / |coefficient| of the terms that are printed.
    pub largest_relative: f64,
    /// Active terms whose coefficient prints as zero, so that they are left out.
    pub dropped: Vec<Place>,
    /// How many coefficients are active in all.
    pub active: usize,
}

/// Makes equations out of coefficients and terms, and keeps the record.
pub(super) struct Rounder {
    rounding: Rounding,
    /// Whether whole numbers are printed as such, and one is left out before a term.
    is_exact: bool,
    pub(super) report: RoundingReport,
}

/// Share of the coefficients that need every decimal from which a model counts as rounded to them.
const ROUNDED_SHARE: f64 = 0.6;

/// Whether a whole number among `coefficients` is one exactly: not where it could as well be a
/// rounded one, because digits were asked for or because the model itself was rounded.
fn are_whole_exact(rounding: Rounding, coefficients: impl Iterator<Item = f64>) -> bool {
    match rounding {
        Rounding::Significant(_) | Rounding::Exact => return true,
        Rounding::Decimals(_) => return false,
        Rounding::Adaptive => {}
    }
    let needs = |value: f64| {
        let number = Decimal::exact(value);
        let (_, after) = number.places();
        number.exponent().map_or(after, |_| usize::MAX)
    };
    let needed: Vec<usize> = coefficients.filter(|c| *c != 0.0).map(needs).collect();
    let all = needed.iter().filter(|places| **places == LEAST_DECIMALS);
    needed.iter().any(|places| *places > LEAST_DECIMALS)
        || (all.count() as f64) < ROUNDED_SHARE * needed.len() as f64
}

impl Rounder {
    pub(super) fn new(rounding: Rounding, coefficients: impl Iterator<Item = f64>) -> Self {
        Self {
            rounding,
            is_exact: are_whole_exact(rounding, coefficients),
            report: RoundingReport::default(),
        }
    }

    pub(super) fn round(&self, coefficient: f64) -> Decimal {
        let is_whole = self.is_exact && coefficient.fract() == 0.0;
        match self.rounding {
            Rounding::Adaptive if is_whole => Decimal::exact(coefficient),
            rounding => Decimal::rounded(coefficient, rounding),
        }
    }

    /// The equations of one phase out of `xi`, a row a term, a column an output, which has a symbol and
    /// a name for the record.
    pub(super) fn system(
        &mut self,
        phase: &str,
        outputs: &[(Symbol, String)],
        terms: &[(&str, Signed)],
        xi: &DMatrix<f64>,
    ) -> EquationSystem {
        let equations = outputs.iter().zip(xi.column_iter());
        let equations = equations.map(|((left, output), column)| {
            let entries = column.iter().zip(terms).filter(|(xi, _)| **xi != 0.0);
            self.equation(phase, left, output, entries)
        });
        EquationSystem {
            equations: equations.collect(),
            phase: phase.to_owned(),
        }
    }

    /// `left = sum of coefficient * term`; each term also as text, for the record.
    fn equation<'a>(
        &mut self,
        phase: &str,
        left: &Symbol,
        output: &str,
        entries: impl Iterator<Item = (&'a f64, &'a (&'a str, Signed))>,
    ) -> Equation {
        let mut terms = Vec::new();
        for (&coefficient, (text, term)) in entries {
            let place = || Place {
                phase: phase.to_owned(),
                output: output.to_owned(),
                term: (*text).to_owned(),
                coefficient,
                left: left.clone(),
                math: term.clone(),
            };
            let printed = self.round(coefficient);
            let report = &mut self.report;
            report.active += 1;
            let error = (printed.value() - coefficient).abs();
            let largest = report.largest.as_ref().map_or(0.0, |(error, _)| *error);
            if error > largest {
                report.largest = Some((error, place()));
            }
            if printed.is_zero() {
                report.dropped.push(place());
                continue;
            }
            report.largest_relative = report.largest_relative.max(error / coefficient.abs());
            // Only a true one: a rounded 1.00 says how well it is known.
            let is_omitted = coefficient.abs() == 1.0 && self.is_exact;
            terms.push(with_coefficient(&printed, is_omitted, term.clone()));
        }
        Equation {
            left: left.clone(),
            terms,
            is_approximate: false,
        }
    }
}
