//! Coefficients before terms, with a record of what rounding changed.

use super::decimal::{Decimal, Rounding};
use super::equations::Equation;
use super::expression::{Leading, with_coefficient};
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
    report: RoundingReport,
}

impl Rounder {
    pub(super) fn new(rounding: Rounding) -> Self {
        Self {
            rounding,
            report: RoundingReport::default(),
        }
    }

    /// A coefficient as it is printed.
    pub(super) fn round(&self, coefficient: f64) -> Decimal {
        Decimal::rounded(coefficient, self.rounding)
    }

    /// `left = sum of coefficient * term`; each entry carries its term also as text, and
    /// `(phase, output)` names the equation, for the record.
    pub(super) fn equation<'a>(
        &mut self,
        left: Symbol,
        (phase, output): (&str, &str),
        entries: impl Iterator<Item = (f64, &'a str, &'a Signed)>,
    ) -> Equation {
        let mut terms = Vec::new();
        for (coefficient, text, term) in entries.filter(|entry| entry.0 != 0.0) {
            let place = || Place {
                phase: phase.to_owned(),
                output: output.to_owned(),
                term: text.to_owned(),
                coefficient,
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
            let leading = if coefficient.abs() == 1.0 && self.rounding.omits_one() {
                Leading::Omitted
            } else {
                Leading::Printed
            };
            terms.push(with_coefficient(&printed, leading, term.clone()));
        }
        Equation { left, terms }
    }

    pub(super) fn into_report(self) -> RoundingReport {
        self.report
    }
}
