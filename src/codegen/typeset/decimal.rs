//! Printed numbers, and coefficients before terms with a record of their rounding errors.

use super::expression::with_coefficient;
use super::*;

/// How coefficients are rounded for print.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rounding {
    /// The paper's two decimals, or more if the rounding error would exceed 5 %. Never rounds a term to zero.
    #[default]
    Adaptive,
    /// Exactly this many places after the point, as the paper prints; small coefficients can vanish.
    Decimals(usize),
    /// This many significant digits (at least one).
    Significant(usize),
    /// The shortest text that reads back as the same `f64`.
    Exact,
}

/// A decimal number in print: sign, digits and perhaps a power of ten.
#[derive(Clone, Debug, PartialEq)]
pub struct Decimal {
    pub(crate) negative: bool,
    /// With their point, without sign and power of ten.
    pub(crate) digits: String,
    pub(crate) exponent: Option<i32>,
}

impl Rounding {
    /// Default of equations in physical units; the other default is that of the paper's equations (25), (26).
    pub const PHYSICAL: Self = Self::Significant(3);
}

const MOST_DIGITS: usize = 40;
pub(super) const LEAST_DECIMALS: usize = 2; // fewest after the point of `Rounding::Adaptive`
const MOST_DECIMALS: usize = 6; // beyond, it uses powers of ten
pub(super) const RELATIVE_ERROR: f64 = 0.05; // its largest |printed - value| / |value|
const LARGE: f64 = 1e7; // from here on with a power of ten
const SMALL: f64 = 1e-4; // below with a power of ten where digits are not fixed

impl Decimal {
    /// The shortest text that reads back as `value`, which must be finite.
    pub(crate) fn exact(value: f64) -> Self {
        let size = value.abs();
        if size != 0.0 && !(SMALL..LARGE).contains(&size) {
            Self::scientific(value, format!("{size:e}"))
        } else {
            Self::plain(value, format!("{size}"))
        }
    }

    pub(crate) fn integer(value: i64) -> Self {
        Self::plain(value as f64, value.unsigned_abs().to_string())
    }

    /// `value` rounded to at most 40 digits, ties to even; more digits than asked where fewer would leave the floats.
    pub fn rounded(value: f64, rounding: Rounding) -> Self {
        match rounding {
            Rounding::Exact => Self::exact(value),
            Rounding::Decimals(places) => Self::fixed(value, places.min(MOST_DIGITS)),
            Rounding::Significant(digits) => {
                Self::significant(value, finite_digits(value, digits.clamp(1, MOST_DIGITS)))
            }
            Rounding::Adaptive => Self::adaptive(value),
        }
    }

    fn adaptive(value: f64) -> Self {
        let size = value.abs();
        let is_close =
            |candidate: &Self| (candidate.value() - value).abs() <= RELATIVE_ERROR * size;
        let fixed = (LEAST_DECIMALS..=MOST_DECIMALS).map(|places| Self::fixed(value, places));
        let scientific = (1..17).map(|places| Self::scientific(value, format!("{size:.places$e}")));
        let mut all = fixed.filter(|_| size < LARGE).chain(scientific);
        all.find(is_close).unwrap_or_else(|| Self::exact(value))
    }

    fn significant(value: f64, digits: usize) -> Self {
        if value == 0.0 {
            return Self::plain(value, "0".to_owned());
        }
        let text = format!("{:.*e}", digits - 1, value.abs());
        let (_, exponent) = parts(&text);
        if exponent < -4 || exponent > 6.max(digits as i32) {
            return Self::scientific(value, text);
        }
        let places = digits as i32 - 1 - exponent;
        if places >= 0 {
            return Self::fixed(value, places as usize);
        }
        // More places before the point than digits: read the rounded digits back.
        let whole: f64 = text.parse().expect("formatted float reads back");
        Self::plain(value, format!("{whole}"))
    }

    fn fixed(value: f64, places: usize) -> Self {
        Self::plain(value, format!("{:.places$}", value.abs()))
    }

    fn plain(value: f64, digits: String) -> Self {
        Self {
            negative: value < 0.0,
            digits,
            exponent: None,
        }
    }

    /// From Rust's `1.25e-7` form.
    fn scientific(value: f64, text: String) -> Self {
        let (digits, exponent) = parts(&text);
        Self {
            exponent: (exponent != 0).then_some(exponent),
            ..Self::plain(value, digits.to_owned())
        }
    }

    /// The value of the printed text.
    pub fn value(&self) -> f64 {
        let value = self.to_string().parse();
        value.expect("sign, digits and exponent form a number")
    }

    pub(crate) fn is_zero(&self) -> bool {
        !self.digits.contains(|digit| ('1'..='9').contains(&digit))
    }

    pub(crate) fn is_one(&self) -> bool {
        self.exponent.is_none() && self.value().abs() == 1.0
    }

    pub(crate) fn magnitude(&self) -> Self {
        Self {
            negative: false,
            ..self.clone()
        }
    }

    pub(super) fn places(&self) -> (usize, usize) {
        let (before, after) = self.digits.split_once('.').unwrap_or((&self.digits, ""));
        (before.len(), after.len())
    }
}

/// `digits`, or more if a finite number rounds to infinity with these: 1.6e308 needs at least two.
pub(super) fn finite_digits(value: f64, digits: usize) -> usize {
    let is_finite = |digits: &usize| {
        let text = format!("{value:.*e}", digits - 1);
        text.parse::<f64>().is_ok_and(f64::is_finite)
    };
    (digits..digits + 17).find(is_finite).unwrap_or(digits)
}

/// Digits and exponent of Rust's `1.25e-7` form.
fn parts(scientific: &str) -> (&str, i32) {
    let parts = scientific.split_once('e');
    let (digits, exponent) = parts.expect("a float's scientific form has an exponent");
    (digits, exponent.parse().expect("an integer"))
}

impl fmt::Display for Decimal {
    /// Plain text: `-1.25e-7`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = if self.negative { "-" } else { "" };
        write!(f, "{sign}{}", self.digits)?;
        self.exponent.map_or(Ok(()), |power| write!(f, "e{power}"))
    }
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Occurrence {
    pub phase: String,
    pub output: String,
    pub term: String,
    pub coefficient: f64,
    pub left: Symbol,
    pub math: Signed,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct RoundingReport {
    /// Largest |printed - coefficient|, where it is not zero, and where it occurs.
    pub(crate) largest: Option<(f64, Occurrence)>,
    /// Largest |printed - coefficient| / |coefficient| of the terms that are printed.
    pub largest_relative: f64,
    /// Active terms whose coefficient prints as zero, so that they are left out.
    pub(crate) dropped: Vec<Occurrence>,
    pub active: usize,
    /// Whether factors inside terms are rounded also; the errors above are those of coefficients alone.
    pub(crate) are_terms_rounded: bool,
}

/// Makes equations out of coefficients and terms, and keeps the record.
pub(super) struct Rounder {
    rounding: Rounding,
    is_exact: bool, // whole numbers are printed as such, and one is left out before a term
    pub(super) report: RoundingReport,
}

/// Share of the coefficients that need every decimal from which a model counts as rounded to them.
const ROUNDED_SHARE: f64 = 0.6;

/// Whether whole numbers among `coefficients` are exact, not rounded by request or in the model itself.
fn are_whole_exact(rounding: Rounding, coefficients: impl Iterator<Item = f64>) -> bool {
    match rounding {
        Rounding::Significant(_) | Rounding::Exact => return true,
        Rounding::Decimals(_) => return false,
        Rounding::Adaptive => {}
    }
    let needs = |value: f64| {
        let number = Decimal::exact(value);
        let (_, after) = number.places();
        number.exponent.map_or(after, |_| usize::MAX)
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

    /// The equations of a phase: `xi` has a row per term, a column per output.
    pub(super) fn system(
        &mut self,
        phase: &str,
        outputs: &[(Symbol, String)],
        terms: &[(&str, Signed)],
        xi: &DMatrix<f64>,
    ) -> EquationSystem {
        let mut equations = Vec::with_capacity(outputs.len());
        for ((left, output), column) in outputs.iter().zip(xi.column_iter()) {
            let entries = column.iter().zip(terms).filter(|(xi, _)| **xi != 0.0);
            let terms = entries.filter_map(|(xi, term)| self.term(phase, left, output, *xi, term));
            equations.push(Equation {
                terms: terms.collect(),
                left: left.clone(),
                is_approximate: false,
            });
        }
        EquationSystem {
            equations,
            phase: phase.to_owned(),
        }
    }

    /// A coefficient before its term, whose text is for the record; nothing if it rounds to zero.
    fn term(
        &mut self,
        phase: &str,
        left: &Symbol,
        output: &str,
        coefficient: f64,
        (text, term): &(&str, Signed),
    ) -> Option<Signed> {
        let place = || Occurrence {
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
        if error > report.largest.as_ref().map_or(0.0, |(error, _)| *error) {
            report.largest = Some((error, place()));
        }
        if printed.is_zero() {
            report.dropped.push(place());
            return None;
        }
        report.largest_relative = report.largest_relative.max(error / coefficient.abs());
        // Only an exact 1 is omitted: a rounded 1.00 shows its precision.
        let is_omitted = coefficient.abs() == 1.0 && self.is_exact;
        Some(with_coefficient(&printed, is_omitted, term.clone()))
    }
}
