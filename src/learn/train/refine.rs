//! Refinement of the coefficients of a regression by their rollouts: Gauss-Newton on the errors of 0.1 s predictions
//! and of whole jumps (the prediction-error method, Ljung, System Identification, 2nd ed. 1999, section 7.2). Terms
//! with little effect on these rollouts are dropped, by the quadratic form of the errors (the optimal brain surgeon,
//! Hassibi and Stork, Second order derivatives for network pruning, NIPS 1992).

use super::knowledge::brake;
use super::rollout::CoefficientIndex;
use super::*;

/// Weight of relative changes of the coefficients, against squared errors that start at 1 for both kinds of windows.
const PRIOR: f64 = 1e-3;
const STEP: f64 = 1e-6; // relative, of the difference quotients
const ATTEMPTS: usize = 6;
const TOGETHER: usize = 64;
const LEAST_GAIN: f64 = 2e-3; // share of the squared errors that a step must lower them by to be followed by another

/// Coefficients of all phases, `library_dim x latent_dim` each, and the score that judges them.
#[derive(Clone, Debug)]
pub(super) struct Coefficients {
    pub xi: Vec<Xi>,
    pub score: f64,
}

impl Coefficients {
    pub(super) fn active(&self) -> usize {
        self.xi.iter().map(active_terms).sum()
    }
}

/// Coefficients that may change, and their sizes, which changes are relative to.
#[derive(Clone)]
struct FreeCoefficients {
    indices: Vec<CoefficientIndex>,
    scales: DVector<f64>,
}

impl FreeCoefficients {
    fn of(xi: &[Xi], knowledge: &[Knowledge]) -> Self {
        let mut free = Self {
            indices: Vec::new(),
            scales: DVector::default(),
        };
        for (phase, (xi, knowledge)) in xi.iter().zip(knowledge).enumerate() {
            let active = (0..xi.len()).filter(|&i| xi[i] != 0.0 && knowledge.free[i]);
            let places = active.map(|i| xi.vector_to_matrix_index(i));
            let places = places.filter(|(_, column)| !knowledge.is_settled(*column));
            (free.indices).extend(places.map(|(term, column)| (phase, term, column)));
        }
        free.scales = free.values(xi).abs();
        free
    }

    fn values(&self, xi: &[Xi]) -> DVector<f64> {
        let values = self.indices.iter();
        let values = values.map(|&(phase, term, k)| xi[phase][(term, k)]);
        DVector::from_iterator(self.indices.len(), values)
    }

    fn add(&self, xi: &mut [Xi], change: &DVector<f64>) {
        let changes = change.component_mul(&self.scales);
        for (&(phase, term, k), change) in self.indices.iter().zip(changes.iter()) {
            xi[phase][(term, k)] += change;
        }
    }
}

pub(super) struct Refiner<'a> {
    pub knowledge: &'a [Knowledge],
    pub mirror: &'a Mirror,
    pub growth: &'a Growth,
    pub training: &'a Judge<'a>,
    pub judge: &'a Judge<'a>,
}

/// The squared errors about some coefficients: `|r + J s|^2` for relative changes `s`.
struct ErrorModel {
    squared_error: f64,
    gram: DMatrix<f64>,
    gradient: DVector<f64>,
}

impl ErrorModel {
    /// The factor of the form's matrix with the prior, and damped relative to each coefficient's own weight.
    fn damped(&self, damping: f64) -> Option<Cholesky<f64, Dyn>> {
        let mut system = self.gram.clone();
        for i in 0..system.nrows() {
            system[(i, i)] += PRIOR + damping * self.gram[(i, i)];
        }
        system.cholesky()
    }
}

impl Refiner<'_> {
    /// Lowers the errors that `training` measures in at most `steps` steps, and gives the coefficients that `judge`
    /// scores best on the way. Unchanged are known coefficients, those that are 0, and the equations of standing legs,
    /// which predict unseen jumps worse when refined.
    pub(super) fn refine(
        &self,
        start: Coefficients,
        steps: usize,
        monitor: &mut Monitor<'_>,
    ) -> Coefficients {
        let free = FreeCoefficients::of(&start.xi, self.knowledge);
        let Some(weights) = self.weights(&start.xi).filter(|_| !free.indices.is_empty()) else {
            return start;
        };
        monitor.stage("refining coefficients by rollouts", steps);
        self.descend(start, &free, weights, steps, monitor)
    }

    fn descend(
        &self,
        start: Coefficients,
        free: &FreeCoefficients,
        weights: [f64; 2],
        steps: usize,
        monitor: &mut Monitor<'_>,
    ) -> Coefficients {
        let origin = free.values(&start.xi);
        let moved = |xi: &[Xi]| (free.values(xi) - &origin).component_div(&free.scales);
        let cost = |squared_error: f64, xi: &[Xi]| squared_error + PRIOR * moved(xi).norm_squared();
        let mut current = start.xi.clone();
        self.admit(&mut current, free, Clone::clone);
        let mut best = Coefficients {
            score: self.score_within(&current, f64::MAX),
            xi: current.clone(),
        };
        let mut damping = 1e-3;
        for _ in 0..steps {
            if monitor.cancelled() {
                break;
            }
            let Some(model) = self.model(&current, free, weights) else {
                break;
            };
            let before = cost(model.squared_error, &current);
            let gradient = &model.gradient + moved(&current) * PRIOR;
            let lower = (0..ATTEMPTS).find_map(|_| {
                let factor = model.damped(damping)?;
                let change = -factor.solve(&gradient);
                let mut trial = current.clone();
                free.add(&mut trial, &change);
                self.admit(&mut trial, free, |gradient| factor.solve(gradient));
                let squared_error = self.squared_error(&trial, weights);
                let after = squared_error.map_or(f64::INFINITY, |error| cost(error, &trial));
                damping *= if after < before { 0.1 } else { 10.0 };
                (after < before).then_some((trial, after))
            });
            let Some((trial, after)) = lower else { break };
            let score = self.score_within(&trial, f64::MAX);
            monitor.done(format!("score {score:.4}"));
            if score < best.score {
                let xi = trial.clone();
                best = Coefficients { xi, score };
            }
            current = trial;
            if after > (1.0 - LEAST_GAIN) * before {
                break;
            }
        }
        best
    }

    /// Keeps the bound on growth by the least relative change (`inverse`), and braking coefficients at most 0.
    fn admit(
        &self,
        xi: &mut [Xi],
        free: &FreeCoefficients,
        inverse: impl Fn(&DVector<f64>) -> DVector<f64>,
    ) {
        self.growth.hold(xi, |gradient| {
            let change = inverse(&free.values(gradient).component_mul(&free.scales));
            let mut all: Vec<_> = gradient.iter().map(|each| each.map(|_| 0.0)).collect();
            free.add(&mut all, &change);
            all
        });
        brake(self.knowledge, xi);
    }

    /// Score of coefficients, infinite if they exceed the growth bound or diverge; some number above `limit` if the
    /// score is above it.
    pub(super) fn score_within(&self, xi: &[Xi], limit: f64) -> f64 {
        match self.growth.admits(xi) {
            true => self.judge.score_within(xi, limit),
            false => f64::INFINITY,
        }
    }

    fn squared_error(&self, xi: &[Xi], weights: [f64; 2]) -> Option<f64> {
        let of_part =
            |part| Some(stacked(&self.training.errors(xi, part)?, weights).norm_squared());
        self.training.parts().map(of_part).sum()
    }

    /// Weights under which the squared errors of both kinds of windows are 1; none if a rollout diverges.
    fn weights(&self, xi: &[Xi]) -> Option<[f64; 2]> {
        let mut squares = [0.0; 2];
        for part in self.training.parts() {
            let errors = self.training.errors(xi, part)?;
            for (square, errors) in squares.iter_mut().zip(&errors) {
                *square += errors.norm_squared();
            }
        }
        Some(squares.map(|square: f64| square.sqrt().max(f64::MIN_POSITIVE).recip()))
    }

    fn model(&self, xi: &[Xi], free: &FreeCoefficients, weights: [f64; 2]) -> Option<ErrorModel> {
        let n = free.indices.len();
        let mut model = ErrorModel {
            squared_error: 0.0,
            gram: DMatrix::zeros(n, n),
            gradient: DVector::zeros(n),
        };
        let steps = free.indices.iter().zip(free.scales.iter());
        let change = |(&place, scale): (_, &f64)| Change {
            place,
            by: STEP * scale,
        };
        let changes: Vec<Change> = steps.map(change).collect();
        for part in self.training.parts() {
            let residual = stacked(&self.training.errors(xi, part)?, weights);
            let mut sensitivity = DMatrix::zeros(residual.len(), n);
            for (group, changes) in changes.chunks(TOGETHER).enumerate() {
                let moved = self.training.errors_changed(xi, changes, part)?;
                for (column, moved) in (group * TOGETHER..).zip(&moved) {
                    let difference = stacked(moved, weights) - &residual;
                    sensitivity.set_column(column, &(difference / STEP));
                }
            }
            model.squared_error += residual.norm_squared();
            add_gram(&mut model.gram, &sensitivity);
            model.gradient += sensitivity.tr_mul(&residual);
        }
        Some(model)
    }
}

fn stacked(errors: &[DVector<f64>; 2], weights: [f64; 2]) -> DVector<f64> {
    let each = errors.iter().zip(weights);
    let values = each.flat_map(|(errors, weight)| errors.iter().map(move |e| e * weight));
    DVector::from_vec(values.collect())
}

/// Adds `A^T A`, whose halves are the same.
fn add_gram(gram: &mut DMatrix<f64>, a: &DMatrix<f64>) {
    for i in 0..a.ncols() {
        for j in 0..=i {
            let product = a.column(i).dot(&a.column(j));
            gram[(i, j)] += product;
            if i != j {
                gram[(j, i)] += product;
            }
        }
    }
}

const DAMPING: f64 = 1e-3; // of the changes, relative to each coefficient's own weight
const DROP_ATTEMPTS: usize = 8; // terms tried about the same coefficients before none counts as droppable
const DROPPED_TOGETHER: usize = 4; // about the same coefficients; then the form is computed anew

impl Refiner<'_> {
    /// Drops terms one at a time, those first that training misses least, while `judge` scores at most `limit`. Inputs
    /// stay: a controller needs them, whether or not the recorded ones differ enough for a prediction to miss them.
    pub(super) fn thin(
        &self,
        refined: Coefficients,
        limit: f64,
        monitor: &mut Monitor<'_>,
    ) -> Coefficients {
        let Some(weights) = self.weights(&refined.xi) else {
            return refined;
        };
        let mut thinned = refined;
        monitor.stage("dropping terms that rollouts do not miss", None);
        while !monitor.cancelled() {
            let free = FreeCoefficients::of(&thinned.xi, self.knowledge);
            let model = self.model(&thinned.xi, &free, weights);
            let form = model.and_then(|model| QuadraticForm::new(&thinned, free, &model));
            let Some(mut form) = form else { break };
            let Some(fewer) = self.drop_about(&mut form, &thinned, limit) else {
                break;
            };
            thinned = fewer;
            monitor.done(format!("score {:.4}", thinned.score));
        }
        thinned
    }

    /// The coefficients without the first terms that may go about them, at most [`DROPPED_TOGETHER`]; none if none may.
    fn drop_about(
        &self,
        form: &mut QuadraticForm,
        from: &Coefficients,
        limit: f64,
    ) -> Option<Coefficients> {
        let mut best = None;
        for _ in 0..DROPPED_TOGETHER {
            let mut order = self.order(form).into_iter().take(DROP_ATTEMPTS);
            let found = order.find_map(|i| {
                let without = form.without(i);
                let mut xi = without.xi(from);
                brake(self.knowledge, &mut xi);
                let score = self.score_within(&xi, limit);
                (score <= limit).then_some((without, Coefficients { xi, score }))
            });
            let Some((without, coefficients)) = found else {
                break;
            };
            (*form, best) = (without, Some(coefficients));
        }
        best
    }

    fn order(&self, form: &QuadraticForm) -> Vec<usize> {
        let features = self.judge.features;
        let d = features.latent_dim;
        let inputs: Vec<_> = (2 * d..3 * d)
            .filter_map(|i| features.variable_term(i))
            .collect();
        let may_go = |(phase, term, column): CoefficientIndex| {
            !inputs.contains(&term) && !self.knowledge[phase].kept[(term, column)]
        };
        let mut order: Vec<usize> = (0..form.gone.len())
            .filter(|&i| !form.gone[i] && may_go(form.free.indices[i]))
            .collect();
        order.sort_by(|&a, &b| form.loss(a).total_cmp(&form.loss(b)));
        order
    }
}

/// The quadratic form about some coefficients, some of them dropped.
#[derive(Clone)]
struct QuadraticForm {
    free: FreeCoefficients,
    to_zero: DVector<f64>, // relative changes that make the coefficients zero
    lowest: DVector<f64>,  // where the form is lowest, with those that are gone at zero
    inverse: DMatrix<f64>, // of the form's matrix, on those that are not gone
    gone: Vec<bool>,
}

impl QuadraticForm {
    fn new(from: &Coefficients, free: FreeCoefficients, model: &ErrorModel) -> Option<Self> {
        let factor = model.damped(DAMPING)?;
        Some(Self {
            to_zero: -free.values(&from.xi).component_div(&free.scales),
            lowest: -factor.solve(&model.gradient),
            inverse: factor.inverse(),
            gone: vec![false; free.indices.len()],
            free,
        })
    }

    /// Increase of the form without a term, if the others minimise it then.
    fn loss(&self, i: usize) -> f64 {
        (self.to_zero[i] - self.lowest[i]).powi(2) / self.inverse[(i, i)]
    }

    fn without(&self, i: usize) -> Self {
        let mut next = self.clone();
        let column = self.inverse.column(i) / self.inverse[(i, i)];
        next.lowest += &column * (self.to_zero[i] - self.lowest[i]);
        next.inverse -= &column * self.inverse.row(i);
        next.gone[i] = true;
        next
    }

    fn xi(&self, from: &Coefficients) -> Vec<Xi> {
        let mut xi = from.xi.clone();
        self.free.add(&mut xi, &self.lowest);
        let each = self.free.indices.iter().zip(&self.gone);
        for (&(phase, term, column), _) in each.filter(|(_, gone)| **gone) {
            xi[phase][(term, column)] = 0.0;
        }
        xi
    }
}
