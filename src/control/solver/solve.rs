//! The solve: the linear-quadratic optimum if it keeps every row, otherwise iterations from a guess.

use super::links::pull_before;
use super::point::{AGAIN, COLD, FAR, FAR_CHANGE, PATIENCE, Point, SHORT_STEP, WARM};
use super::problem::{Outcome, Program, Report, Residuals, Settings};
use super::riccati::{Products, add_product, add_transposed, eliminate};
use super::scalar::Real;

impl<T: Real, const NX: usize, const NU: usize, const LINKED: bool> Program<'_, T, NX, NU, LINKED> {
    /// Eliminates all stages without their rows: gains and constant parts of the linear-quadratic optimum from any
    /// initial state. False if a Hessian is not positive definite.
    #[inline(always)]
    pub fn prepare(&mut self) -> bool {
        let horizon = self.stages.len();
        let mut products: Products<T, NX, NU> = Products::zeros();
        let mut p = [[T::ZERO; NX]; NX];
        let mut linear = [T::ZERO; NX];
        for k in (0..horizon).rev() {
            let weight = self.cost.state_at(k, horizon);
            let at = self.at(k);
            let stage = &mut self.stages[at];
            for i in 0..NX {
                p[i][i] += weight[i];
            }
            add_product(&p, &stage.c, &mut linear);
            products.clear_hessian();
            for i in 0..NU {
                products.hvv[i][i] = self.cost.input[i];
            }
            if !eliminate(stage, &mut p, &mut products) {
                return false;
            }
            let mut by_v = [T::ZERO; NU];
            stage.pull(&mut linear, &mut by_v);
        }
        true
    }

    /// Solves the program from an initial state, with the gains of [`Program::prepare`] for the present stages.
    ///
    /// `is_warm` means that inputs and multipliers are a guess at the solution, such as the last solution shifted by a
    /// stage.
    #[inline(always)]
    pub fn solve(&mut self, x0: &[T; NX], is_warm: bool, settings: &Settings<T>) -> Report<T> {
        let worst = self.follow_gains(x0);
        if !worst.is_finite_number() {
            return failure(0);
        }
        let mut iterations = 0;
        let mut is_capped = false;
        if worst <= settings.tolerance {
            self.take_gains();
        } else {
            self.start(x0, is_warm);
            let is_far = self.change_of_gains() > T::of(FAR_CHANGE);
            let mut smallest = COLD;
            if is_warm {
                smallest = if is_far { FAR } else { WARM };
            }
            let mut may_restart = is_warm;
            let mut must_centre = true;
            let mut point: Point<T> = Point::zeros();
            loop {
                // First points and restarts are centred in one place, so that the pass is compiled once.
                if must_centre {
                    point = self.centre(smallest);
                    must_centre = false;
                }
                if !(point.infeasibility() + point.sum).is_finite_number() {
                    return failure(iterations);
                }
                if point.is_optimal(settings) {
                    break;
                }
                if iterations >= settings.max_iterations {
                    is_capped = true;
                    break;
                }
                iterations += 1;
                let length = self.step(&mut point, settings);
                if length < T::ZERO {
                    // Rounding prevents further progress: the residuals decide whether the point is accepted.
                    break;
                }
                if (may_restart && length < T::of(SHORT_STEP)) || iterations % PATIENCE == 0 {
                    smallest = AGAIN;
                    must_centre = true;
                }
                may_restart = false;
            }
        }
        let residuals = self.residuals(x0);
        let outcome = if is_capped {
            Outcome::IterationCap
        } else if residuals.within(settings.accepted_residual) {
            Outcome::Solved
        } else {
            Outcome::Inaccurate
        };
        Report {
            outcome,
            iterations,
            residuals,
        }
    }

    /// States and inputs that the gains give, kept if no row is violated; returns the largest violation.
    #[inline(always)]
    fn follow_gains(&mut self, x0: &[T; NX]) -> T {
        let mut worst = T::ZERO;
        let mut x = *x0;
        let mut before = [T::ZERO; NU];
        for k in 0..self.stages.len() {
            let at = self.at(k);
            let stage = &mut self.stages[at];
            let mut v = [T::ZERO; NU];
            let mut end = [T::ZERO; NX];
            stage.answer(&x, &mut v);
            stage.end(&x, &v, &mut end);
            stage.dv = v;
            stage.dx = end;
            x = end;
            let rows = self.rows_times(k, &before, &v, &x, T::ZERO);
            before = v;
            for i in 0..rows.count {
                let violation = rows.target[i] - rows.bound[i];
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

    /// Uses the point of the gains as the solution: no row is active.
    #[inline(always)]
    fn take_gains(&mut self) {
        let shape = self.shape;
        let price = self.cost.slack;
        for k in 0..self.stages.len() {
            let at = self.at(k);
            let stage = &mut self.stages[at];
            stage.v = stage.dv;
            stage.plain = stage.dv;
            stage.x = stage.dx;
            stage.t = T::ZERO;
            let mut rows = self.rows_of(k);
            rows.write_multipliers(shape.soft, shape.slack_row(), price);
        }
    }

    /// Residuals of the optimality conditions at the present point, from the program's own numbers.
    #[inline(always)]
    pub(crate) fn residuals(&mut self, x0: &[T; NX]) -> Residuals<T> {
        let horizon = self.stages.len();
        let linked = self.is_linked();
        let shape = self.shape;
        let mut primal = T::ZERO;
        let mut dual = T::ZERO;
        let mut gap = T::ZERO;
        let mut value = T::ZERO;
        let mut size = T::ONE;
        let mut multipliers = T::ONE;
        let mut x_before = *x0;
        let mut v_before = [T::ZERO; NU];
        for k in 0..horizon {
            let stage = &self.stages[self.at(k)];
            let v = stage.v;
            let x = stage.x;
            let t = stage.t;
            let mut end = [T::ZERO; NX];
            stage.end(&x_before, &v, &mut end);
            for i in 0..NX {
                primal = (end[i] - x[i]).magnitude().or_kept_larger(primal);
                size = x[i].magnitude().or_kept_larger(size);
            }
            let rows = self.rows_times(k, &v_before, &v, &x, t);
            x_before = x;
            v_before = v;
            for i in 0..rows.count {
                let room = rows.bound[i] - rows.target[i];
                let multiplier = rows.multiplier[i];
                primal = (-room).or_kept_larger(primal);
                dual = (-multiplier).or_kept_larger(dual);
                multipliers = multiplier.or_kept_larger(multipliers);
                gap += multiplier * room;
            }
        }
        let mut p = [T::ZERO; NX];
        let mut by_before = [T::ZERO; NU];
        for k in (0..horizon).rev() {
            let weight = self.cost.state_at(k, horizon);
            let at = self.at(k);
            let stage = &self.stages[at];
            let mut by_v = [T::ZERO; NU];
            for i in 0..NU {
                by_v[i] = self.cost.input[i] * stage.v[i];
                value += by_v[i] * stage.v[i];
            }
            for i in 0..NX {
                let pulled = weight[i] * stage.x[i];
                multipliers = pulled.magnitude().or_kept_larger(multipliers);
                value += pulled * stage.x[i];
                p[i] += pulled;
            }
            let y = &self.rows[at * shape.memory() + 2 * shape.rows()..][..shape.rows()];
            let by_t = self.add_rows_pull(k, y, &mut by_v, &mut p);
            if linked {
                for i in 0..NU {
                    by_v[i] += by_before[i];
                }
                if k > 0 {
                    let y_link = &y[shape.first_link()..];
                    pull_before(y_link, self.link_rows(k - 1), shape.link, &mut by_before);
                }
            }
            dual = by_t.magnitude().or_kept_larger(dual);
            add_transposed(&stage.b, &p, &mut by_v);
            for i in 0..NU {
                dual = by_v[i].magnitude().or_kept_larger(dual);
            }
            let mut next = [T::ZERO; NX];
            add_transposed(&stage.a, &p, &mut next);
            p = next;
        }
        Residuals {
            primal: primal / size,
            dual: dual / multipliers,
            gap: gap.magnitude() / value.or_kept_larger(T::ONE),
        }
    }
}

fn failure<T: Real>(iterations: u32) -> Report<T> {
    let zero = T::ZERO;
    let infinite = T::ONE / zero;
    Report {
        outcome: Outcome::NumericalFailure,
        iterations,
        residuals: Residuals {
            primal: infinite,
            dual: infinite,
            gap: infinite,
        },
    }
}

/// [`Program::prepare`] and [`Program::solve`] for vector units of 256 bits: sums keep their order and products are not
/// contracted, so that the bits are the same.
#[cfg(target_arch = "x86_64")]
impl<T: Real, const NX: usize, const NU: usize, const LINKED: bool> Program<'_, T, NX, NU, LINKED> {
    #[target_feature(enable = "avx2")]
    pub(crate) fn prepare_avx2(&mut self) -> bool {
        self.prepare()
    }

    #[target_feature(enable = "avx2")]
    pub(crate) fn solve_avx2(
        &mut self,
        x0: &[T; NX],
        is_warm: bool,
        settings: &Settings<T>,
    ) -> Report<T> {
        self.solve(x0, is_warm, settings)
    }
}
