//! Weighted least squares with losses that are not negative, and honest standard errors.
//!
//! Rows of a group (contact, flight, joints in the air; by axis or kind) share one residual
//! deviation, estimated with the unknowns; residuals beyond three deviations count less (Huber).
//! Residuals of neighbouring windows are alike, so standard errors come from leaving out blocks of 0.1 s in turn
//! (jackknife), not from the residuals as if they were independent.

use nalgebra::{Cholesky, DMatrix, DVector, SMatrix, SVector};

use super::parameters::{DELAY, GRAVITY, INVERSE_MASS, NOT_NEGATIVE, PARAMETER_DIM, Prior};
use super::windows::{Group, OVERLAP, Row};

/// Unknowns, per mass except gravity.
pub type Estimate = SVector<f64, PARAMETER_DIM>;
type Square = SMatrix<f64, PARAMETER_DIM, PARAMETER_DIM>;

/// Deviations of a residual from which it counts less.
const HUBER: f64 = 3.0;
/// Smallest deviation of a group, m/s^2: what the model leaves out of the best recordings.
const LEAST_DEVIATION: f64 = 0.005;
/// Weights of body and joint rows before the deviations are known.
const FIRST_WEIGHTS: [f64; 2] = [1.0, 0.3];

/// The state of the iteration: unknowns, deviations of the groups.
#[derive(Debug, Clone, Default)]
pub struct Iteration {
    /// Present estimate; `None` before the first step.
    pub estimate: Option<Estimate>,
    deviations: Option<[f64; Group::COUNT]>,
}

/// Normal equations `matrix x = side`.
#[derive(Debug, Clone)]
struct Normal {
    matrix: Square,
    side: Estimate,
}

impl Normal {
    const ZERO: Self = Self {
        matrix: Square::from_array_storage(nalgebra::ArrayStorage(
            [[0.0; PARAMETER_DIM]; PARAMETER_DIM],
        )),
        side: Estimate::from_array_storage(nalgebra::ArrayStorage([[0.0; PARAMETER_DIM]; 1])),
    };

    fn add(&mut self, row: &Row, left: f64, weight: f64) {
        for (i, a) in row
            .coefficients
            .iter()
            .enumerate()
            .filter(|(_, a)| **a != 0.0)
        {
            self.side[i] += weight * a * left;
            for (j, b) in row.coefficients.iter().enumerate().take(i + 1) {
                self.matrix[(i, j)] += weight * a * b;
            }
        }
    }

    /// Copies the lower triangle, which [`Normal::add`] fills, to the upper.
    fn symmetric(mut self) -> Self {
        self.matrix.fill_upper_triangle_with_lower_triangle();
        self
    }

    /// Solution over the free unknowns, zero in the others.
    fn solve(&self, free: &[usize]) -> Option<Estimate> {
        // Scaled to a diagonal of ones: units of the unknowns differ by orders of magnitude.
        let scale = |i: usize| self.matrix[(i, i)].max(f64::MIN_POSITIVE).sqrt();
        let n = free.len();
        let matrix = DMatrix::from_fn(n, n, |i, j| {
            self.matrix[(free[i], free[j])] / (scale(free[i]) * scale(free[j]))
        });
        let side = DVector::from_fn(n, |i, _| self.side[free[i]] / scale(free[i]));
        let solution = Cholesky::new(matrix)?.solve(&side);
        let mut out = Estimate::zeros();
        for (place, unknown) in free.iter().enumerate() {
            out[*unknown] = solution[place] / scale(*unknown);
        }
        Some(out)
    }

    /// Solution with no negative loss, and its free unknowns: an active set that starts from all.
    fn solve_not_negative(&self) -> Option<(Estimate, Vec<usize>)> {
        let mut free: Vec<usize> = (0..PARAMETER_DIM).collect();
        let mut estimate = self.solve(&free)?;
        for _ in 0..4 * PARAMETER_DIM {
            let strength = |i: usize, value: f64| value * self.matrix[(i, i)].sqrt();
            let negative = NOT_NEGATIVE
                .into_iter()
                .filter(|i| free.contains(i) && estimate[*i] < 0.0)
                .min_by(|a, b| strength(*a, estimate[*a]).total_cmp(&strength(*b, estimate[*b])));
            if let Some(worst) = negative {
                free.retain(|i| *i != worst);
            } else {
                let slope = self.side - self.matrix * estimate;
                let gain = |i: usize| slope[i] / self.matrix[(i, i)].sqrt();
                let least = 1e-9 * self.side.amax().max(1.0);
                let freed = NOT_NEGATIVE
                    .into_iter()
                    .filter(|i| !free.contains(i) && gain(*i) > least)
                    .max_by(|a, b| gain(*a).total_cmp(&gain(*b)));
                match freed {
                    Some(unknown) => free.push(unknown),
                    None => break,
                }
            }
            free.sort_unstable();
            estimate = self.solve(&free)?;
        }
        Some((
            estimate.map_with_location(|i, _, value| {
                if NOT_NEGATIVE.contains(&i) {
                    value.max(0.0)
                } else {
                    value
                }
            }),
            free,
        ))
    }
}

/// What a row's equation leaves unexplained, m/s^2.
pub fn residual(row: &Row, estimate: &Estimate, mass_kg: f64) -> f64 {
    let product: f64 = (row.coefficients.iter().zip(estimate.iter()))
        .map(|(coefficient, value)| coefficient * value)
        .sum();
    left(row, mass_kg) - product
}

/// The left side per mass: joint equations are divided by it.
fn left(row: &Row, mass_kg: f64) -> f64 {
    match row.group {
        Group::Contact(_) | Group::Flight(_) => row.left,
        Group::Joint(_) => row.left / mass_kg,
    }
}

impl Iteration {
    /// Solves once with present deviations, then takes the deviations of the new residuals.
    ///
    /// `None` if the equations are singular even with the priors (not finite numbers).
    pub fn step(&mut self, rows: &[Row], priors: &[Prior], mass_kg: f64) -> Option<()> {
        let normal = self.normal(rows, priors, mass_kg, |_| true);
        let (estimate, _) = normal.solve_not_negative()?;
        self.estimate = Some(estimate);
        let mut sums = [(0.0, 0.0); Group::COUNT];
        for row in rows.iter().filter(|row| row.moving) {
            let group = row.group.index();
            let residual = residual(row, &estimate, mass_kg);
            let share = self
                .deviations
                .map_or(1.0, |all| huber(residual / all[group]));
            sums[group].0 += share * residual * residual;
            sums[group].1 += 1.0;
        }
        let found =
            sums.map(|(sum, count): (f64, f64)| (sum / count.max(1.0)).sqrt().max(LEAST_DEVIATION));
        // The geometric mean with the last deviations keeps the iteration from oscillating.
        self.deviations = Some(match self.deviations {
            None => found,
            Some(last) => std::array::from_fn(|group| (last[group] * found[group]).sqrt()),
        });
        Some(())
    }

    /// Covariance of the unknowns by leaving out blocks, with the uncertainty of a delay of
    /// `delay_deviation_s` beside the estimated one; `None` as for [`Iteration::step`].
    ///
    /// Unknowns at zero have the variance that they have when they are free.
    pub fn covariance(
        &self,
        rows: &[Row],
        blocks: usize,
        priors: &[Prior],
        mass_kg: f64,
        delay_deviation_s: f64,
    ) -> Option<Square> {
        let whole = self.normal(rows, priors, mass_kg, |_| true);
        let mut parts = vec![Normal::ZERO; blocks];
        for row in rows.iter().filter(|row| row.moving) {
            parts[row.block].add(row, left(row, mass_kg), self.weight(row, mass_kg));
        }
        let parts: Vec<Normal> = parts
            .into_iter()
            .filter(|part| part.matrix.trace() > 0.0)
            .map(Normal::symmetric)
            .collect();
        let (_, bounded) = whole.solve_not_negative()?;
        let everything: Vec<usize> = (0..PARAMETER_DIM).collect();
        let tight = spread(&whole, &parts, &bounded, mass_kg, delay_deviation_s)?;
        if bounded.len() == PARAMETER_DIM {
            return Some(tight);
        }
        let mut covariance = spread(&whole, &parts, &everything, mass_kg, delay_deviation_s)?;
        for &i in &bounded {
            for &j in &bounded {
                covariance[(i, j)] = tight[(i, j)];
            }
        }
        Some(covariance)
    }

    fn normal(
        &self,
        rows: &[Row],
        priors: &[Prior],
        mass_kg: f64,
        keep: impl Fn(&Row) -> bool,
    ) -> Normal {
        let mut normal = Normal::ZERO;
        for row in rows.iter().filter(|row| row.moving && keep(row)) {
            normal.add(row, left(row, mass_kg), self.weight(row, mass_kg));
        }
        let mut normal = normal.symmetric();
        for prior in priors {
            let weight = (mass_kg / prior.deviation).powi(2);
            for (i, a) in &prior.terms {
                for (j, b) in &prior.terms {
                    normal.matrix[(*i, *j)] += weight * a * b;
                }
            }
        }
        normal
    }

    fn weight(&self, row: &Row, mass_kg: f64) -> f64 {
        let overlap = OVERLAP as f64;
        let first = match row.group {
            Group::Contact(_) | Group::Flight(_) => FIRST_WEIGHTS[0],
            Group::Joint(_) => FIRST_WEIGHTS[1],
        };
        let (Some(deviations), Some(estimate)) = (&self.deviations, &self.estimate) else {
            return first * first / overlap;
        };
        let deviation = deviations[row.group.index()];
        let share = huber(residual(row, estimate, mass_kg) / deviation);
        share / (deviation * deviation * overlap)
    }
}

/// Weight of a residual in deviations.
fn huber(residual: f64) -> f64 {
    HUBER / residual.abs().max(HUBER)
}

/// Jackknife covariance of the free unknowns over blocks.
fn spread(
    whole: &Normal,
    parts: &[Normal],
    free: &[usize],
    mass_kg: f64,
    delay_deviation_s: f64,
) -> Option<Square> {
    let center = whole.solve(free)?;
    let mut sum = Square::zeros();
    for part in parts {
        let without = Normal {
            matrix: whole.matrix - part.matrix,
            side: whole.side - part.side,
        };
        let change = without.solve(free)? - center;
        sum += change * change.transpose();
    }
    let count = parts.len().max(1) as f64;
    let mut covariance = sum * ((count - 1.0) / count);
    let others: Vec<usize> = free.iter().copied().filter(|i| *i != DELAY).collect();
    let mut by_delay = Normal {
        matrix: whole.matrix,
        side: -whole.matrix.column(DELAY).into_owned(),
    }
    .solve(&others)?;
    by_delay[DELAY] = 1.0;
    by_delay *= delay_deviation_s / mass_kg;
    covariance += by_delay * by_delay.transpose();
    Some(covariance)
}

/// Gravity and inverse mass by the feet's forces alone, over rows in contact; `None` without any.
pub fn force_alone(rows: &[Row]) -> Option<Estimate> {
    let mut normal = Normal::ZERO;
    for row in rows
        .iter()
        .filter(|row| matches!(row.group, Group::Contact(_)))
    {
        normal.add(row, row.left, 1.0);
    }
    normal.symmetric().solve(&[GRAVITY, INVERSE_MASS])
}

/// Share of the variance of the trunk's acceleration along an axis in contact that is explained.
pub fn explained(rows: &[Row], estimate: &Estimate, axis: usize) -> f64 {
    let chosen = || rows.iter().filter(|row| row.group == Group::Contact(axis));
    let count = chosen().count().max(1) as f64;
    let mean = chosen().map(|row| row.left).sum::<f64>() / count;
    let total: f64 = chosen().map(|row| (row.left - mean).powi(2)).sum();
    let rest: f64 = chosen()
        .map(|row| residual(row, estimate, 1.0).powi(2))
        .sum();
    1.0 - rest / total
}
