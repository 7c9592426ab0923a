//! The solve: the linear-quadratic optimum if it keeps every row, otherwise iterations from a guess.

use super::links::pull_before;
use super::point::{AGAIN, COLD, FAR, FAR_CHANGE, PATIENCE, SHORT_STEP, WARM};
use super::problem::{Outcome, Program, Report, Residuals, Settings};
use super::riccati::{Products, WIDE, add_transposed, answer, eliminate, plus_product, pull};
use super::scalar::Real;

impl<T: Real, const NX: usize, const NU: usize, const LINKED: bool> Program<'_, T, NX, NU, LINKED> {
    /// Eliminates all stages without their rows: gains and constant parts of the linear-quadratic
    /// optimum from any initial state. False if a Hessian is not positive definite.
    #[inline(always)]
    pub fn prepare(&mut self) -> bool {
        let horizon = self.stages.len();
        let mut products = Products::new();
        let mut p = [[T::ZERO; NX]; NX];
        let mut linear = [T::ZERO; NX];
        for k in (0..horizon).rev() {
            let weight = self.cost.state_at(k, horizon);
            for i in 0..NX {
                p[i][i] += weight[i];
            }
            let at = self.at(k);
            let stage = &mut self.stages[at];
            linear = plus_product(&p, &stage.c, linear);
            let mut hessian = [[T::ZERO; WIDE]; NU];
            for i in 0..NU {
                hessian[i][i] = self.cost.input[i];
            }
            if !eliminate::<T, NX, NU, false>(stage, &mut p, hessian, &mut products) {
                return false;
            }
            pull(stage, &mut linear, [T::ZERO; NU]);
        }
        true
    }

    /// Solves the program from an initial state, with the gains of [`Program::prepare`] for the present stages.
    ///
    /// `is_warm` says that inputs and multipliers are a guess at the solution, such as the last one's,
    /// shifted by a stage.
    #[inline(always)]
    pub fn solve(&mut self, x0: &[T; NX], is_warm: bool, settings: &Settings<T>) -> Report<T> {
        let worst = self.follow_gains(x0);
        if !worst.is_finite_number() {
            return self.broken(0);
        }
        let mut iterations = 0;
        let mut is_capped = false;
        if worst <= settings.tolerance {
            self.take_gains();
        } else {
            self.start(x0, is_warm);
            let is_far = self.change_of_gains() > T::of(FAR_CHANGE);
            let mut may_restart = is_warm;
            let mut smallest = match (is_warm, is_far) {
                (false, _) => COLD,
                (true, true) => FAR,
                (true, false) => WARM,
            };
            // First points and restarts are centred in one place, so that the pass is compiled once.
            'centred: loop {
                let mut point = self.centre(smallest);
                loop {
                    if !(point.infeasibility() + point.sum).is_finite_number() {
                        return self.broken(iterations);
                    }
                    if point.is_optimal(settings) {
                        break 'centred;
                    }
                    is_capped = iterations == settings.max_iterations;
                    if is_capped {
                        break 'centred;
                    }
                    iterations += 1;
                    // Where rounding ends the progress the residuals decide what the point is worth.
                    let Some(length) = self.step(&mut point, settings) else {
                        break 'centred;
                    };
                    let is_poor = may_restart && length < T::of(SHORT_STEP);
                    may_restart = false;
                    if is_poor || iterations % PATIENCE == 0 {
                        smallest = AGAIN;
                        break;
                    }
                }
            }
        }
        let residuals = self.residuals(x0);
        let outcome = match residuals.within(settings.accepted_residual) {
            _ if is_capped => Outcome::IterationCap,
            true => Outcome::Solved,
            false => Outcome::Inaccurate,
        };
        Report {
            outcome,
            iterations,
            residuals,
        }
    }

    fn broken(&self, iterations: u32) -> Report<T> {
        let none = T::ONE / T::ZERO;
        Report {
            outcome: Outcome::NumericalFailure,
            iterations,
            residuals: Residuals {
                primal: none,
                dual: none,
                gap: none,
            },
        }
    }

    /// States and inputs that the gains give, kept if no row is violated; returns the largest violation.
    #[inline(always)]
    fn follow_gains(&mut self, x0: &[T; NX]) -> T {
        let horizon = self.stages.len();
        let mut worst = T::ZERO;
        let mut x = *x0;
        let mut before = [T::ZERO; NU];
        for k in 0..horizon {
            let at = self.at(k);
            let stage = &mut self.stages[at];
            stage.dv = answer(stage, &x);
            stage.dx = plus_product(&stage.b, &stage.dv, plus_product(&stage.a, &x, stage.c));
            x = stage.dx;
            let (v, x) = (stage.dv, stage.dx);
            let rows = self.rows_times(k, (&before, &v), &x, T::ZERO);
            before = v;
            for (product, bound) in rows.target.iter().zip(rows.bound.iter()) {
                let violation = *product - *bound;
                // Written so that a violation that is not a number is kept.
                if !(violation <= worst) {
                    worst = violation;
                }
            }
            if !worst.is_finite_number() {
                return worst;
            }
        }
        worst
    }

    /// Takes the point of the gains for the solution: no row is active.
    #[inline(always)]
    fn take_gains(&mut self) {
        let soft = self.shape.soft;
        for k in 0..self.stages.len() {
            let at = self.at(k);
            let stage = &mut self.stages[at];
            stage.v = stage.dv;
            stage.plain = stage.dv;
            stage.x = stage.dx;
            stage.t = T::ZERO;
            let price = self.cost.slack;
            let slack_row = self.shape.input + soft;
            let rows = self.rows_of(k);
            rows.multiplier.fill(T::ZERO);
            if soft > 0 {
                rows.multiplier[slack_row] = price;
            }
        }
    }

    /// Residuals of the optimality conditions at the present point, from the program's own numbers.
    #[inline(always)]
    pub fn residuals(&mut self, x0: &[T; NX]) -> Residuals<T> {
        let (horizon, shape) = (self.stages.len(), self.shape);
        let (mut primal, mut dual, mut gap) = (T::ZERO, T::ZERO, T::ZERO);
        let (mut size, mut multipliers, mut value) = (T::ONE, T::ONE, T::ZERO);
        let mut v_before = [T::ZERO; NU];
        for k in 0..horizon {
            let stage = &self.stages[self.at(k)];
            let before = match k {
                0 => *x0,
                _ => self.stages[self.at(k - 1)].x,
            };
            let next = plus_product(&stage.b, &stage.v, plus_product(&stage.a, &before, stage.c));
            let (v, x, t) = (stage.v, stage.x, stage.t);
            for i in 0..NX {
                primal = kept_larger((next[i] - x[i]).magnitude(), primal);
                size = kept_larger(x[i].magnitude(), size);
            }
            let rows = self.rows_times(k, (&v_before, &v), &x, t);
            v_before = v;
            for i in 0..rows.bound.len() {
                let (room, multiplier) = (rows.bound[i] - rows.target[i], rows.multiplier[i]);
                primal = kept_larger(-room, primal);
                dual = kept_larger(-multiplier, dual);
                multipliers = kept_larger(multiplier, multipliers);
                gap += multiplier * room;
            }
        }
        let mut p = [T::ZERO; NX];
        let mut by_before = [T::ZERO; NU];
        for k in (0..horizon).rev() {
            let weight = self.cost.state_at(k, horizon);
            let stage = &self.stages[self.at(k)];
            let mut by_v = [T::ZERO; NU];
            for i in 0..NU {
                by_v[i] = self.cost.input[i] * stage.v[i];
                value += by_v[i] * stage.v[i];
            }
            for i in 0..NX {
                let pulled = weight[i] * stage.x[i];
                multipliers = kept_larger(pulled.magnitude(), multipliers);
                value += pulled * stage.x[i];
                p[i] += pulled;
            }
            let (count, memory) = (shape.rows(), shape.memory());
            let y = &self.rows[self.at(k) * memory + 2 * count..][..count];
            let by_t = self.add_rows_pull(k, y, &mut by_v, &mut p);
            if LINKED {
                for i in 0..NU {
                    by_v[i] += by_before[i];
                }
                by_before = pull_before(&y[count - shape.link..], self.link_pairs(k).1);
            }
            dual = kept_larger(by_t.magnitude(), dual);
            add_transposed(&stage.b, &p, &mut by_v);
            for entry in by_v {
                dual = kept_larger(entry.magnitude(), dual);
            }
            let mut next = [T::ZERO; NX];
            add_transposed(&stage.a, &p, &mut next);
            p = next;
        }
        Residuals {
            primal: primal / size,
            dual: dual / multipliers,
            gap: gap.magnitude() / kept_larger(value, T::ONE),
        }
    }
}

/// The larger of two numbers, or not a number if the new one is not.
#[inline(always)]
fn kept_larger<T: Real>(new: T, so_far: T) -> T {
    if new <= so_far { so_far } else { new }
}
