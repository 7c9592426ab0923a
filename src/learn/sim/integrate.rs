//! Adaptive integration of `dy/dt = f(t, y)` by extrapolation: Gragg's explicit midpoint rule first. If it needs too
//! many evaluations (a stiff problem), the linearly implicit Euler rule restarts from the same state.
//!
//! A step of length `H` is computed with `n_0 < n_1 < ...` substeps, and the results are extrapolated to infinitely
//! many. After `j + 1` results the order is `2j + 2` or `j + 1` (Hairer, Norsett, Wanner, *Solving Ordinary
//! Differential Equations I*, II.9, and II, IV.9). Steps end at every requested time, where an input may have a kink.

use nalgebra::{DMatrix, DVector};

/// A system of ordinary differential equations `dy/dt = f(t, y)`; only asked at finite states.
pub(crate) trait OdeSystem {
    fn rate(&mut self, time_s: f64, y: &[f64], dy: &mut [f64]);

    /// Writes `df/dy`, `state_dim x state_dim`.
    fn jacobian(&mut self, time_s: f64, y: &[f64], jacobian: &mut DMatrix<f64>);
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct IntegrationOptions {
    pub relative_tolerance: f64,
    pub absolute_tolerance: f64,
    /// A state component beyond this magnitude counts as divergence.
    pub divergence_bound: f64,
    /// Evaluations of `f` per requested time before the problem counts as stiff.
    pub explicit_evaluations_per_time: usize,
}

impl Default for IntegrationOptions {
    fn default() -> Self {
        Self {
            relative_tolerance: 1e-11,
            absolute_tolerance: 1e-13,
            divergence_bound: 1e6,
            explicit_evaluations_per_time: 350,
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Integration {
    /// `state_dim x reached`: a column for each requested time that was reached.
    pub states: DMatrix<f64>,
    pub diverged_at_s: Option<f64>,
    pub method: IntegrationMethod,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum IntegrationMethod {
    Explicit,
    Implicit,
}

/// States at `times` from `initial` at `times[0]`; a step below 1e-13 of the whole time is a blow-up: divergence.
pub(crate) fn integrate(
    system: &mut impl OdeSystem,
    initial: &[f64],
    times: &[f64],
    options: &IntegrationOptions,
) -> Integration {
    let mut run = |method, budget| {
        let mut stepper = Stepper {
            system,
            method,
            options,
            shortest: 1e-13 * (times.last().unwrap_or(&0.0) - times.first().unwrap_or(&0.0)),
            evaluations: 0,
            goal: 4,
            budget,
        };
        stepper.advance(initial, times)
    };
    let budget = options.explicit_evaluations_per_time * times.len();
    let explicit = run(IntegrationMethod::Explicit, budget);
    if explicit.states.ncols() == times.len() {
        return explicit;
    }
    run(IntegrationMethod::Implicit, usize::MAX)
}

/// More results of a step would amplify the rounding errors of the linearly implicit rule to the default tolerance.
const MOST_RESULTS: usize = 8;

struct Stepper<'a, S> {
    system: &'a mut S,
    method: IntegrationMethod,
    options: &'a IntegrationOptions,
    shortest: f64,
    evaluations: usize,
    goal: usize, // index of the table expected to meet the tolerance
    budget: usize,
}

/// A step that was tried: its end if it met the tolerance, and the length to try next.
struct Trial {
    end: Option<DVector<f64>>,
    next: f64,
}

/// Evaluations for the length just tried, a length, and the index of the table expected to meet the tolerance at it.
struct Plan {
    work: f64,
    length: f64,
    goal: usize,
}

impl Plan {
    /// Chooses the step length at which entry `j`, whose `error` grows with the power `order`, is expected to succeed,
    /// if it costs less.
    fn consider(&mut self, j: usize, error: f64, order: usize, spent: f64, h: f64) {
        let factor = 0.9 * (0.5 / error.max(1e-300)).powf(1.0 / order as f64);
        let factor = factor.clamp(0.02, 4.0);
        if spent / factor < self.work {
            *self = Self {
                work: spent / factor,
                length: factor * h,
                goal: j,
            };
        }
    }
}

impl<S: OdeSystem> Stepper<'_, S> {
    fn advance(&mut self, initial: &[f64], times: &[f64]) -> Integration {
        let mut y = DVector::from_column_slice(initial);
        let mut columns = Vec::with_capacity(times.len());
        let mut diverged_at_s = None;
        let mut length = f64::INFINITY;
        let mut time = times.first().copied().unwrap_or_default();
        'times: for &target in times {
            while time < target {
                let left = target - time;
                let h = match left < 1.1 * length {
                    true => left,
                    false => length.min(0.5 * left),
                };
                if h < self.shortest || self.evaluations > self.budget {
                    diverged_at_s = Some(time);
                    break 'times;
                }
                let trial = self.step(time, &y, h);
                // a step that a requested time cut short does not determine the next length
                let cut = trial.end.is_some() && h < length && length.is_finite();
                let least = if cut { length } else { 0.0 };
                length = trial.next.max(least);
                let Some(end) = trial.end else { continue };
                y = end;
                time = if h == left { target } else { time + h };
                if y.amax() > self.options.divergence_bound {
                    diverged_at_s = Some(time);
                    break 'times;
                }
            }
            columns.push(y.clone());
        }
        let (dim, numbers) = (initial.len(), columns.iter().flatten().copied());
        let states = DMatrix::from_iterator(dim, columns.len(), numbers);
        Integration {
            states,
            diverged_at_s,
            method: self.method,
        }
    }

    /// Results with ever more substeps until two neighbours in the table agree or one more than expected fails.
    fn step(&mut self, time: f64, y: &DVector<f64>, h: f64) -> Trial {
        let begun = self.evaluations;
        let mut rate = DVector::zeros(y.len());
        self.rate(time, y, &mut rate);
        let mut jacobian = DMatrix::zeros(0, 0);
        if self.method == IntegrationMethod::Implicit {
            jacobian = DMatrix::zeros(y.len(), y.len());
            self.system.jacobian(time, y.as_slice(), &mut jacobian);
        }
        // Of the substeps; also the increase of the order with every result.
        let multiple = match self.method {
            IntegrationMethod::Explicit => 2,
            IntegrationMethod::Implicit => 1,
        };
        let mut table = Vec::new();
        let mut plan = Plan {
            work: f64::INFINITY,
            length: 0.25 * h,
            goal: 1,
        };
        for j in 0..MOST_RESULTS.min(self.goal + 2) {
            let substeps = multiple * (j + 1);
            let result = match self.method {
                IntegrationMethod::Explicit => self.midpoint(time, y, &rate, h, substeps),
                IntegrationMethod::Implicit => {
                    self.linearly_implicit(time, y, &jacobian, h, substeps)
                }
            };
            let Some(result) = result else { break };
            let correction = self.extrapolate(&mut table, result);
            if j == 0 {
                continue;
            }
            let error = self.relative_size(&correction, y, &table[j]);
            let spent = (self.evaluations - begun) as f64;
            plan.consider(j, error, multiple * j + 1, spent, h);
            if error <= 1.0 {
                if plan.goal == j && j + 1 < MOST_RESULTS {
                    // one result more may pay: try it at the length at which it costs as much
                    plan.length *= 1.0 + (substeps + multiple) as f64 / spent;
                    plan.goal += 1;
                }
                self.goal = plan.goal;
                return Trial {
                    end: table.pop(),
                    next: plan.length,
                };
            }
        }
        self.goal = plan.goal;
        Trial {
            end: None,
            next: plan.length.min(0.5 * h),
        }
    }

    /// Gragg's rule with `n` substeps, `n` even: errors in even powers of their length.
    fn midpoint(
        &mut self,
        time: f64,
        y: &DVector<f64>,
        rate: &DVector<f64>,
        step: f64,
        n: usize,
    ) -> Option<DVector<f64>> {
        let h = step / n as f64;
        let (mut last, mut current, mut f) = (y.clone(), y + rate * h, rate.clone());
        for m in 1..n {
            self.rate(time + m as f64 * h, &current, &mut f)?;
            last.axpy(2.0 * h, &f, 1.0);
            std::mem::swap(&mut last, &mut current);
        }
        self.rate(time + step, &current, &mut f)?;
        finite((last + current + f * h) * 0.5)
    }

    /// `n` substeps of `(I - h J) (y_m+1 - y_m) = h f(t_m+1, y_m)`.
    fn linearly_implicit(
        &mut self,
        time: f64,
        y: &DVector<f64>,
        jacobian: &DMatrix<f64>,
        step: f64,
        n: usize,
    ) -> Option<DVector<f64>> {
        let h = step / n as f64;
        let factors = (DMatrix::identity(y.len(), y.len()) - jacobian * h).lu();
        let (mut current, mut f) = (y.clone(), y.clone());
        for m in 1..=n {
            self.rate(time + m as f64 * h, &current, &mut f)?;
            f *= h;
            if !factors.solve_mut(&mut f) {
                return None;
            }
            current += &f;
        }
        finite(current)
    }

    fn rate(&mut self, time: f64, y: &DVector<f64>, f: &mut DVector<f64>) -> Option<()> {
        self.evaluations += 1;
        let defined = y.iter().all(|value| value.is_finite());
        defined.then(|| self.system.rate(time, y.as_slice(), f.as_mut_slice()))
    }

    /// Makes the last row of the extrapolation table the next one; returns the difference of its last two entries.
    fn extrapolate(&self, row: &mut Vec<DVector<f64>>, result: DVector<f64>) -> DVector<f64> {
        let n = (row.len() + 1) as f64;
        let mut entry = result;
        let mut correction = DVector::zeros(entry.len());
        for (k, above) in row.iter_mut().enumerate() {
            let ratio = n / (n - (k + 1) as f64);
            let power = match self.method {
                IntegrationMethod::Explicit => ratio * ratio,
                IntegrationMethod::Implicit => ratio,
            };
            correction = (&entry - &*above) / (power - 1.0);
            let next = &entry + &correction;
            *above = std::mem::replace(&mut entry, next);
        }
        row.push(entry);
        correction
    }

    /// Largest component of `error` in units of its tolerance.
    fn relative_size(&self, error: &DVector<f64>, from: &DVector<f64>, to: &DVector<f64>) -> f64 {
        let tolerance = |a: f64, b: f64| {
            self.options.absolute_tolerance + self.options.relative_tolerance * a.abs().max(b.abs())
        };
        let values = error.iter().zip(from).zip(to);
        values.fold(0.0, |largest: f64, ((error, &a), &b)| {
            largest.max(error.abs() / tolerance(a, b))
        })
    }
}

fn finite(values: DVector<f64>) -> Option<DVector<f64>> {
    let is_finite = values.iter().all(|value| value.is_finite());
    is_finite.then_some(values)
}
