//! Adaptive integration of `dy/dt = f(t, y)`: an explicit Runge-Kutta pair first, and where its steps
//! become too many (a stiff problem), backward differentiation formulas from the same start.
//!
//! Only this file names diffsol. The paper uses LSODA, which switches in the same spirit.

use diffsol::{
    DiffsolError, NalgebraLU, NalgebraMat, NalgebraVec, OdeBuilder, OdeEquations, OdeSolverMethod,
    OdeSolverStopReason,
};
use nalgebra::DMatrix;

use super::error::SimError;

/// How exactly to integrate, and when to give up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IntegrationOptions {
    /// Relative tolerance of a step.
    pub relative_tolerance: f64,
    /// Absolute tolerance of a step, in the unit of the state.
    pub absolute_tolerance: f64,
    /// A state component beyond this magnitude counts as divergence.
    pub divergence_bound: f64,
    /// Steps of the explicit method per requested time before the problem counts as stiff.
    pub explicit_steps_per_time: usize,
}

impl Default for IntegrationOptions {
    fn default() -> Self {
        Self {
            relative_tolerance: 1e-11,
            absolute_tolerance: 1e-13,
            divergence_bound: 1e6,
            explicit_steps_per_time: 50,
        }
    }
}

/// States at the requested times, as far as the integration came.
#[derive(Debug, Clone, PartialEq)]
pub struct Integration {
    /// `state_dim x reached`: a column for each requested time that was reached.
    pub states: DMatrix<f64>,
    /// Time in seconds at which the state left the divergence bound, if it did.
    pub diverged_at_s: Option<f64>,
    /// The method that delivered the states.
    pub method: IntegrationMethod,
}

/// The family of the integration method.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum IntegrationMethod {
    /// Tsitouras' explicit 5(4) pair.
    Explicit,
    /// Variable-order backward differentiation formulas.
    BackwardDifferentiation,
}

/// How a stepper ended.
enum End {
    Reached,
    /// The state left the divergence bound, or no step was small enough (a finite-time blow-up).
    Diverged(f64),
    OverBudget,
}

/// States of `dy/dt = f(t, y)` at `times`, from `initial` at `times[0]`.
///
/// `rhs(t, y, dy)` writes `f`; `jacobian_times(t, y, v, jv)` writes `df/dy v`. Both are only called
/// with finite states.
///
/// # Errors
/// [`SimError::Solver`] if the problem cannot be set up.
pub fn integrate<F, J>(
    rhs: F,
    jacobian_times: J,
    initial: &[f64],
    times: &[f64],
    options: &IntegrationOptions,
) -> Result<Integration, SimError>
where
    F: Fn(f64, &[f64], &mut [f64]),
    J: Fn(f64, &[f64], &[f64], &mut [f64]),
{
    let (Some(&start), Some(&end)) = (times.first(), times.last()) else {
        return Ok(Integration {
            states: DMatrix::zeros(initial.len(), 0),
            diverged_at_s: None,
            method: IntegrationMethod::Explicit,
        });
    };
    let mut columns = vec![initial.to_vec()];
    let mut method = IntegrationMethod::Explicit;
    let mut diverged_at_s = None;
    if end > start {
        let problem = OdeBuilder::<NalgebraMat<f64>>::new()
            .t0(start)
            .rtol(options.relative_tolerance)
            .atol([options.absolute_tolerance])
            .rhs_implicit(
                |y: &[f64], _p: &[f64], t: f64, dy: &mut [f64]| rhs(t, y, dy),
                |y: &[f64], _p: &[f64], t: f64, v: &[f64], jv: &mut [f64]| {
                    jacobian_times(t, y, v, jv)
                },
            )
            .init(
                |_p: &[f64], _t: f64, y: &mut [f64]| y.copy_from_slice(initial),
                initial.len(),
            )
            .build()
            .map_err(solver_error)?;
        let budget = options.explicit_steps_per_time * times.len();
        let explicit = problem.tsit45().map_err(solver_error)?;
        let mut stepper_end = advance(explicit, times, budget, options, &mut columns);
        if !matches!(stepper_end, End::Reached) {
            method = IntegrationMethod::BackwardDifferentiation;
            columns.truncate(1);
            let implicit = problem.bdf::<NalgebraLU<f64>>().map_err(solver_error)?;
            stepper_end = advance(implicit, times, usize::MAX, options, &mut columns);
        }
        if let End::Diverged(time_s) = stepper_end {
            diverged_at_s = Some(time_s);
        }
    }
    let reached = columns.len();
    Ok(Integration {
        states: DMatrix::from_iterator(initial.len(), reached, columns.into_iter().flatten()),
        diverged_at_s,
        method,
    })
}

fn solver_error(error: DiffsolError) -> SimError {
    SimError::Solver {
        message: error.to_string(),
    }
}

/// Steps `solver` through `times`, one column for each; `columns` holds the first already.
fn advance<'a, E, S>(
    mut solver: S,
    times: &[f64],
    budget: usize,
    options: &IntegrationOptions,
    columns: &mut Vec<Vec<f64>>,
) -> End
where
    E: OdeEquations<T = f64, V = NalgebraVec<f64>> + 'a,
    S: OdeSolverMethod<'a, E>,
{
    let end = times[times.len() - 1];
    if solver.set_stop_time(end).is_err() {
        return End::Diverged(times[0]);
    }
    for _ in 0..budget {
        let Ok(reason) = solver.step() else {
            return End::Diverged(solver.state().t);
        };
        let now = solver.state().t;
        if !within_bound(solver.state().y.batch_as_slice(0), options.divergence_bound) {
            return End::Diverged(now);
        }
        let stopped = matches!(reason, OdeSolverStopReason::TstopReached);
        while let Some(&time) = times.get(columns.len()) {
            if time > now && !(stopped && columns.len() + 1 == times.len()) {
                break;
            }
            let Ok(state) = solver.interpolate(time.min(now)) else {
                return End::Diverged(now);
            };
            columns.push(state.batch_as_slice(0).to_vec());
        }
        if stopped {
            return End::Reached;
        }
    }
    End::OverBudget
}

fn within_bound(state: &[f64], bound: f64) -> bool {
    state
        .iter()
        .all(|value| value.is_finite() && value.abs() <= bound)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(count: usize, end: f64) -> Vec<f64> {
        (0..count)
            .map(|k| end * k as f64 / (count - 1) as f64)
            .collect()
    }

    #[test]
    fn integrate_of_an_oscillator_follows_the_cosine() {
        let times = times(200, 10.0);
        let result = integrate(
            |_t, y, dy| {
                dy[0] = y[1];
                dy[1] = -y[0];
            },
            |_t, _y, v, jv| {
                jv[0] = v[1];
                jv[1] = -v[0];
            },
            &[1.0, 0.0],
            &times,
            &IntegrationOptions::default(),
        )
        .expect("solvable");
        assert_eq!(result.method, IntegrationMethod::Explicit);
        assert_eq!(result.states.ncols(), times.len());
        for (column, &time) in result.states.column_iter().zip(&times) {
            assert!((column[0] - time.cos()).abs() < 1e-6, "at {time}");
        }
    }

    #[test]
    fn integrate_of_a_stiff_problem_falls_back_to_bdf() {
        let rate = 1e7;
        let times = times(11, 1.0);
        let result = integrate(
            |t, y, dy| dy[0] = -rate * (y[0] - t.cos()),
            |_t, _y, v, jv| jv[0] = -rate * v[0],
            &[1.0],
            &times,
            &IntegrationOptions::default(),
        )
        .expect("solvable");
        assert_eq!(result.method, IntegrationMethod::BackwardDifferentiation);
        assert_eq!(result.diverged_at_s, None);
        assert!((result.states[(0, 10)] - 1f64.cos()).abs() < 1e-6);
    }

    #[test]
    fn integrate_of_a_finite_time_blow_up_tells_when_it_diverged() {
        // dy/dt = y^2 from 1 has its pole at t = 1
        let times = times(21, 2.0);
        let result = integrate(
            |_t, y, dy| dy[0] = y[0] * y[0],
            |_t, y, v, jv| jv[0] = 2.0 * y[0] * v[0],
            &[1.0],
            &times,
            &IntegrationOptions::default(),
        )
        .expect("set up");
        let time = result.diverged_at_s.expect("a pole");
        assert!((0.99..=1.01).contains(&time), "{time}");
        assert_eq!(result.states.ncols(), 10, "times 0 to 0.9");
        assert!(result.states.iter().all(|value| value.is_finite()));
    }
}
