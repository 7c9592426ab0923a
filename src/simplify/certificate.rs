//! The changes of a simplification and the bounds of their effect on `ddz`.

use std::fmt;
use std::str::FromStr;

use super::measure::Measured;
use super::*;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub(crate) struct BeforeAfter {
    pub before: usize,
    pub after: usize,
}

impl fmt::Display for BeforeAfter {
    /// `8 to 5`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} to {}", self.before, self.after)
    }
}

impl std::iter::Sum for BeforeAfter {
    fn sum<I: Iterator<Item = Self>>(counts: I) -> Self {
        counts.fold(Self::default(), |sum, count| Self {
            before: sum.before + count.before,
            after: sum.after + count.after,
        })
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum ChangeKind {
    Dropped,
    Constant,
    /// Replaced by a straight line: multiples of variables, perhaps with a constant.
    Linear,
    Rounded,
}

/// A coefficient before and after a change.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Effect {
    #[serde(skip)]
    pub(super) row: usize,
    pub term: String,
    pub before: f64,
    pub after: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Change {
    pub(crate) kind: ChangeKind,
    /// Significant digits of a rounding.
    pub digits: Option<usize>,
    #[serde(flatten)]
    pub own: Effect,
    /// Coefficients that changed in compensation.
    #[serde(rename = "others")]
    pub effects: Vec<Effect>,
    /// Contains `ddz` before this change minus `ddz` after it at every point of the domain.
    #[serde(serialize_with = "ends")]
    pub bound: Interval,
    /// The same at the recorded samples.
    pub(crate) measured: Option<Measured>,
}

impl Change {
    /// The coefficients that it changes, its own first.
    pub(crate) fn coefficients(&self) -> impl Iterator<Item = &Effect> {
        std::iter::once(&self.own).chain(&self.effects)
    }
}

/// One equation of one phase; all errors in scaled units per second squared.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct EquationCertificate {
    #[serde(rename = "equation", serialize_with = "equation")]
    pub output: usize,
    /// Root mean square of the model's `ddz` over the recorded samples.
    pub rms: Option<f64>,
    pub allowed: f64,
    /// Contains the model's `ddz` minus the simplified one over the domain; found from both models, not the changes.
    #[serde(serialize_with = "ends")]
    pub bound: Interval,
    /// The sum of the changes' bounds, which contains the same difference.
    #[serde(serialize_with = "ends")]
    pub sum_of_bounds: Interval,
    /// The difference at the recorded samples.
    pub(crate) measured: Option<Measured>,
    pub terms: BeforeAfter,
    /// Significant decimal digits that the coefficients need, added up.
    pub digits: BeforeAfter,
    pub changes: Vec<Change>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct PhaseCertificate {
    pub name: String,
    /// The box: each variable's name and range. `None` without samples of the phase, whose equations were kept.
    #[serde(serialize_with = "ranges")]
    pub domain: Option<Vec<(String, Interval)>>,
    /// Recorded samples in the box, at which errors were measured.
    pub samples: usize,
    /// Recorded samples of the phase outside the box, about which nothing is stated.
    #[serde(rename = "samples_outside_domain")]
    pub samples_outside: usize,
    /// Operations of the straight-line code of `ddz`; a sine with its cosine counts as two.
    pub operations: BeforeAfter,
    /// Variables that no `ddz` of the phase depends on any more: inputs among them can not be used for control.
    #[serde(rename = "no_longer_depends_on")]
    pub lost: Vec<LatentVariable>,
    pub equations: Vec<EquationCertificate>,
}

/// Bound of the difference between a simplified model and its original, with the reasons. At every point
/// `(z, dz, u_lat)` of a phase's domain at which the model is defined, `ddz_i - ddz_i,simplified` lies in
/// `EquationCertificate::bound`, in real numbers. Floating-point rounding, about 1e-16 of the largest summand, is
/// additional for both models.
#[derive(Clone, Debug, PartialEq)]
pub struct Certificate {
    pub(crate) tolerance: Tolerance,
    /// The preceding steps of exact simplification: equal as real functions, without any error.
    pub(crate) exact: Vec<ExactStep>,
    /// One entry per phase; differences are those to the exactly simplified equations.
    pub(crate) phases: Vec<PhaseCertificate>,
}

impl Certificate {
    /// All equations with the names of their phases.
    pub(crate) fn equations(&self) -> impl Iterator<Item = (&str, &EquationCertificate)> {
        let phases = self.phases.iter();
        phases.flat_map(|phase| phase.equations.iter().map(|e| (phase.name.as_str(), e)))
    }

    fn sum(&self, count: impl Fn(&EquationCertificate) -> BeforeAfter) -> BeforeAfter {
        self.equations().map(|(_, equation)| count(equation)).sum()
    }

    pub fn n_changes(&self) -> usize {
        self.equations().map(|(_, e)| e.changes.len()).sum()
    }

    pub(crate) fn terms(&self) -> BeforeAfter {
        self.sum(|equation| equation.terms)
    }

    pub(crate) fn digits(&self) -> BeforeAfter {
        self.sum(|equation| equation.digits)
    }

    pub(crate) fn operations(&self) -> BeforeAfter {
        self.phases.iter().map(|phase| phase.operations).sum()
    }

    /// The largest bound as a share of the root mean square of its `ddz`.
    pub(crate) fn largest_bound_share(&self) -> Option<f64> {
        self.largest_share(|equation| Some(equation.bound.magnitude()))
    }

    pub(crate) fn largest_measured_share(&self) -> Option<f64> {
        self.largest_share(|equation| equation.measured.map(|measured| measured.max))
    }

    pub(crate) fn largest_share(
        &self,
        error: impl Fn(&EquationCertificate) -> Option<f64>,
    ) -> Option<f64> {
        let shares = self.equations().filter_map(|(_, equation)| {
            let rms = equation.rms.filter(|&rms| rms > 0.0)?;
            Some(error(equation)? / rms)
        });
        shares.reduce(f64::max)
    }
}

pub fn certificate_json(certificate: &Certificate) -> Value {
    json!({
        "tolerance": certificate.tolerance.to_string(),
        "tolerance_is": match certificate.tolerance {
            Tolerance::ShareOfRms(_) => "share of the root mean square of each ddz over the recordings",
            Tolerance::Absolute(_) => "scaled units per s^2",
        },
        "terms": certificate.terms(),
        "digits": certificate.digits(),
        "operations": certificate.operations(),
        "largest_bound_share_of_rms": certificate.largest_bound_share(),
        "largest_measured_share_of_rms": certificate.largest_measured_share(),
        "phases": certificate.phases,
        "exact": certificate.exact,
    })
}

fn equation<S: Serializer>(output: &usize, to: S) -> Result<S::Ok, S::Error> {
    to.collect_str(&format_args!("ddz{}", output + 1))
}

fn ends<S: Serializer>(interval: &Interval, to: S) -> Result<S::Ok, S::Error> {
    [interval.lo(), interval.hi()].serialize(to)
}

fn ranges<S: Serializer>(
    domain: &Option<Vec<(String, Interval)>>,
    to: S,
) -> Result<S::Ok, S::Error> {
    let Some(ranges) = domain else {
        return to.serialize_none();
    };
    to.collect_map((ranges.iter()).map(|(name, range)| (name, [range.lo(), range.hi()])))
}

/// The largest |ddz of the model - ddz of the simplified model| over the domain, for each latent coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tolerance {
    /// A share of the root mean square of that `ddz` over the recorded samples of the phase: 0.01 for `1%`.
    ShareOfRms(f64),
    /// In scaled units per second squared.
    Absolute(f64),
}

/// Why a tolerance was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "found `{found}`, expected a share such as 1% (of the root mean square of each ddz over the recordings) or a number such as 0.05 (scaled units per s^2)"
)]
pub struct ToleranceError {
    /// The text.
    pub found: String,
}

impl Tolerance {
    pub(crate) fn words(self) -> String {
        let unit = match self {
            Self::ShareOfRms(_) => "of the root mean square of each ddz over the recordings",
            Self::Absolute(_) => "scaled units per s^2",
        };
        format!("{self} {unit}")
    }
}

impl FromStr for Tolerance {
    type Err = ToleranceError;

    fn from_str(text: &str) -> Result<Self, ToleranceError> {
        let refused = || ToleranceError {
            found: text.to_owned(),
        };
        let number = |text: &str| match text.trim().parse::<f64>() {
            Ok(value) if value.is_finite() && value >= 0.0 => Ok(value),
            _ => Err(refused()),
        };
        match text.trim().strip_suffix('%') {
            Some(percent) => Ok(Tolerance::ShareOfRms(number(percent)? / 100.0)),
            None => Ok(Tolerance::Absolute(number(text)?)),
        }
    }
}

impl fmt::Display for Tolerance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            // two roundings, of the division and of this product, may leave 0.30000000000000004
            Tolerance::ShareOfRms(share) => write!(f, "{}%", rounded(share * 100.0, 13)),
            Tolerance::Absolute(value) => write!(f, "{value}"),
        }
    }
}
