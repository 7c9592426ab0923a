//! From a model, a domain and a tolerance to a simplified model and its certificate.

use super::certificate::{BeforeAfter, EquationCertificate};
use super::domain::check_count;
use super::equation::{Equation, is_same_decimal};
use super::measure::Differences;
use super::*;
use crate::ir::{Program, Statement};
use crate::lower::Form;
use crate::robot::{BODY_Z, GRAVITY_M_S2};

/// Factor by which the budget of the search is reduced until the final evaluation confirms the tolerance.
const RETREAT: f64 = 0.8;
const MAX_RETREATS: usize = 40;
/// Relative error of evaluating a sample in floating point, with room to spare.
const EVALUATION: f64 = 1e-9;

/// A simplified model with its certificate.
#[derive(Clone, Debug, PartialEq)]
pub struct Simplified {
    /// The model, equal to its original if nothing was changed. Provenance: tolerance, digest of the original, bounds.
    pub model: ReducedModel,
    /// The changes, and bounds of the resulting differences in `ddz`.
    pub certificate: Certificate,
}

/// Simplifies each equation of each phase as far as `tolerance` allows over `domain`. `samples` are needed for a
/// tolerance that is a share, and give the measured errors. A zero tolerance changes nothing.
///
/// # Errors
/// [`SimplifyError::NoSamples`], [`SimplifyError::Domain`] for samples of another model, and the internal error
/// [`SimplifyError::Contradiction`] if a sample refutes the result.
pub fn simplify(
    equations: &Equations<'_>,
    domain: &Domain,
    samples: Option<&Samples>,
    tolerance: Tolerance,
) -> Result<Simplified> {
    if samples.is_none() && matches!(tolerance, Tolerance::ShareOfRms(share) if share != 0.0) {
        return Err(SimplifyError::NoSamples);
    }
    let original = &equations.model;
    let n_phases = equations.phases.len();
    check_count(samples.map_or(n_phases, |s| s.phases.len()), n_phases)?;
    let workspace = Workspace::new(equations)?;
    let mut xi = Vec::new();
    let mut phases = Vec::new();
    for phase in 0..n_phases {
        let problem = PhaseProblem::new(equations, &workspace, domain, samples, phase)?;
        let (of_phase, certificate) = problem.solve(tolerance)?;
        xi.push(of_phase);
        phases.push(certificate);
    }
    let mut certificate = Certificate {
        tolerance,
        exact: equations.steps.clone(),
        phases,
    };
    let mut simplified = equations.to_model()?.into_owned();
    if certificate.n_changes() > 0 {
        simplified = workspace.finish(simplified, &xi)?;
    }
    if certificate.n_changes() > 0 || !certificate.exact.is_empty() {
        let mut provenance = original.provenance().clone();
        let entry = provenance_of(original, &certificate);
        provenance.insert("simplification".to_owned(), entry);
        simplified = simplified.into_builder().provenance(provenance).build()?;
    }
    let (learned, new) = (Equations::as_learned(original), Equations::of(&simplified));
    for (phase, certificate) in certificate.phases.iter_mut().enumerate() {
        certificate.operations = BeforeAfter {
            before: operations(equations, phase)?,
            after: operations(&new, phase)?,
        };
        let (before, after) = (variables(&learned, phase), variables(&new, phase));
        certificate.lost = before.into_iter().filter(|v| !after.contains(v)).collect();
    }
    Ok(Simplified {
        model: simplified,
        certificate,
    })
}

fn provenance_of(model: &ReducedModel, certificate: &Certificate) -> Value {
    let phase = |phase: &PhaseCertificate| {
        let bounds = phase.equations.iter().map(|e| e.bound.magnitude());
        (phase.name.clone(), bounds.collect::<Value>())
    };
    let bounds: serde_json::Map<_, _> = certificate.phases.iter().map(phase).collect();
    let mut entry = json!({
        "romc_version": env!("CARGO_PKG_VERSION"),
        "tolerance": certificate.tolerance.to_string(),
        "simplified_from": artifact::digest(model).to_string(),
        "ddz_bounds": bounds,
    });
    if !certificate.exact.is_empty() {
        entry["exact"] = (certificate.exact.iter())
            .map(ToString::to_string)
            .collect();
    }
    // the bounds are those to the model before, not to one that was simplified into it
    if let Some(earlier) = model.provenance().get("simplification") {
        entry["earlier"] = earlier.clone();
    }
    entry
}

struct PhaseProblem<'a> {
    name: &'a str,
    workspace: &'a Workspace,
    xi: DMatrix<f64>,
    domain: Option<&'a [Interval]>,
    /// One row per sample in the box, one column per term.
    theta: DMatrix<f64>,
    /// `-g` in the scaled units of a model with a robot's coordinates: known before any learning.
    gravity: Option<f64>,
    samples_outside: usize,
}

impl<'a> PhaseProblem<'a> {
    fn new(
        equations: &'a Equations<'_>,
        workspace: &'a Workspace,
        domain: &'a Domain,
        samples: Option<&Samples>,
        phase: usize,
    ) -> Result<Self> {
        let theta = domain.theta(phase, samples, &workspace.library)?;
        let factors = equations.model.state_factors();
        let recorded = samples.map_or(0, |samples| samples.phases[phase].ncols());
        Ok(Self {
            name: &equations.phases[phase].name,
            workspace,
            xi: workspace.coefficients(equations, phase),
            domain: domain.phase(phase),
            samples_outside: recorded - theta.nrows(),
            theta,
            gravity: factors.ok().map(|factors| -GRAVITY_M_S2 * factors[BODY_Z]),
        })
    }

    /// The equation as it is; known is the constant that is gravity.
    fn equation(&self, output: usize) -> Equation {
        let is_gravity = |row: &usize| {
            (self.gravity).is_some_and(|gravity| is_same_decimal(gravity, self.xi[(*row, output)]))
        };
        let known = self.workspace.constant().filter(is_gravity);
        Equation::new(self.coefficients(output), known)
    }

    fn solve(&self, tolerance: Tolerance) -> Result<(DMatrix<f64>, PhaseCertificate)> {
        let mut xi = self.xi.clone();
        let mut terms = (self.domain).map(|d| Ranges::new(self.workspace, d));
        let mut equations = Vec::new();
        for output in 0..xi.ncols() {
            let rms = self.rms(output);
            let allowed = match tolerance {
                Tolerance::Absolute(value) => value,
                Tolerance::ShareOfRms(share) => share * rms.unwrap_or(0.0),
            };
            let (equation, bound) = match &mut terms {
                Some(terms) if allowed > 0.0 => self.search(terms, output, allowed),
                Some(_) | None => (self.equation(output), Interval::point(0.0)),
            };
            xi.set_column(output, &nalgebra::DVector::from_column_slice(&equation.xi));
            equations.push(self.certified(output, equation, bound, allowed, rms)?);
        }
        let certificate = PhaseCertificate {
            name: self.name.to_owned(),
            domain: self.domain.map(|ranges| {
                let variables = LatentVariable::all(self.workspace.library.latent_dim());
                let names = variables.map(|variable| variable.to_string());
                names.zip(ranges.iter().copied()).collect()
            }),
            samples: self.theta.nrows(),
            samples_outside: self.samples_outside,
            operations: BeforeAfter::default(),
            lost: Vec::new(),
            equations,
        };
        Ok((xi, certificate))
    }

    fn coefficients(&self, output: usize) -> Vec<f64> {
        self.xi.column(output).iter().copied().collect()
    }

    /// Simplifies an equation, and encloses its difference from the original again. If that exceeds the allowed
    /// difference, although the changes' own bounds do not, the budget of the search is reduced. In the end the
    /// equation stays unchanged.
    fn search(&self, terms: &mut Ranges<'_>, output: usize, allowed: f64) -> (Equation, Interval) {
        let mut budget = allowed;
        for _ in 0..MAX_RETREATS {
            let equation = self.equation(output).simplified(terms, budget);
            let differences = Differences::between(&self.coefficients(output), &equation.xi);
            let bound = differences.bound(terms);
            if bound.magnitude() <= allowed {
                return (equation, bound);
            }
            budget *= RETREAT;
        }
        (self.equation(output), Interval::point(0.0))
    }

    fn rms(&self, output: usize) -> Option<f64> {
        let all = self.coefficients(output);
        let active = Differences::between(&all, &vec![0.0; all.len()]);
        active.measured(&self.theta).map(|measured| measured.rms)
    }

    fn certified(
        &self,
        output: usize,
        mut equation: Equation,
        bound: Interval,
        allowed: f64,
        rms: Option<f64>,
    ) -> Result<EquationCertificate> {
        let before = self.coefficients(output);
        let differences = Differences::between(&before, &equation.xi);
        let measured = differences.measured(&self.theta);
        if let Some(measured) = measured {
            let parts = differences.0.iter();
            let sum: f64 = parts.map(|(_, before, after)| (before - after).abs()).sum();
            let size = self.theta.amax() * sum * differences.0.len() as f64;
            let slack = EVALUATION * bound.magnitude() + f64::EPSILON * size;
            if measured.max > bound.magnitude() + slack {
                return Err(SimplifyError::Contradiction {
                    phase: self.name.to_owned(),
                    output,
                    measured: measured.max,
                    bound: bound.magnitude(),
                });
            }
        }
        for change in &mut equation.changes {
            let effects = change.coefficients().map(|e| (e.row, e.before, e.after));
            change.measured = Differences(effects.collect()).measured(&self.theta);
        }
        let active = |xi: &[f64]| xi.iter().filter(|&&coefficient| coefficient != 0.0).count();
        let counts = |of: &dyn Fn(&[f64]) -> usize| BeforeAfter {
            before: of(&before),
            after: of(&equation.xi),
        };
        Ok(EquationCertificate {
            output,
            rms,
            allowed,
            bound,
            sum_of_bounds: equation.spent,
            measured,
            terms: counts(&active),
            digits: counts(&digits),
            changes: equation.changes,
        })
    }
}

/// Significant decimal digits of the shortest texts that read back as the coefficients.
fn digits(xi: &[f64]) -> usize {
    let active = xi.iter().filter(|&&coefficient| coefficient != 0.0);
    let of = |coefficient: &f64| {
        let text = format!("{coefficient:e}");
        let mantissa = text.split('e').next().unwrap_or_default();
        mantissa.chars().filter(char::is_ascii_digit).count()
    };
    active.map(of).sum()
}

fn operations(system: &Equations<'_>, phase: usize) -> Result<usize> {
    let program: Program = lower::dynamics(system, phase, Form::StraightLine)?;
    let counted = program.statements.iter().enumerate();
    Ok(counted
        .map(|(index, statement)| match statement {
            Statement::Constant(_) | Statement::Input { .. } => 0,
            _ => program.values_of(index).len(),
        })
        .sum())
}

/// The variables that any `ddz` of a phase depends on, in the order of [`LatentVariable::all`].
fn variables(system: &Equations<'_>, phase: usize) -> Vec<LatentVariable> {
    let summands = system.phases[phase].ddz.iter().flatten();
    let exprs = summands.map(|summand| system.terms[summand.term].expr);
    let symbols: BTreeSet<SymbolId> = exprs.flat_map(|e| system.pool.symbols_of(e)).collect();
    LatentVariable::all(system.latent_dim())
        .filter(|variable| symbols.contains(&system.symbol(*variable)))
        .collect()
}
