//! Weighted least squares with losses that are not negative. Rows of a group share one residual deviation, estimated
//! with the unknowns; residuals beyond three deviations count less (Huber). Standard errors come from leaving out
//! blocks of 0.1 s in turn and, where there are enough, whole jumps (jackknife).

use super::parameters::{Prior, not_negative};
use super::windows::OVERLAP;
use super::*;

pub(crate) type Estimate = SVector<f64, PARAMETER_DIM>;
type Square = SMatrix<f64, PARAMETER_DIM, PARAMETER_DIM>;

const HUBER: f64 = 3.0; // deviations of a residual from which it counts less
const LEAST_DEVIATION: f64 = 0.005;
const FIRST_WEIGHTS: [f64; 2] = [1.0, 0.3];

#[derive(Debug, Clone, Default)]
pub(crate) struct Iteration {
    pub estimate: Option<Estimate>,
    deviations: Option<[f64; Group::COUNT]>,
}

#[derive(Debug, Clone, Default)]
struct Normal {
    matrix: Square,
    side: Estimate,
}

impl Normal {
    fn add(&mut self, row: &Row, left: f64, weight: f64) {
        let coefficients = row.coefficients.iter().enumerate();
        for (i, a) in coefficients.filter(|(_, a)| **a != 0.0) {
            self.side[i] += weight * a * left;
            for (j, b) in row.coefficients.iter().enumerate().take(i + 1) {
                self.matrix[(i, j)] += weight * a * b;
            }
        }
    }

    fn symmetric(mut self) -> Self {
        self.matrix.fill_upper_triangle_with_lower_triangle();
        self
    }

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

    fn change_by_delay(&self, free: &[usize]) -> Option<Estimate> {
        let others: Vec<usize> = free.iter().copied().filter(|i| *i != DELAY).collect();
        let held = Self {
            matrix: self.matrix,
            side: -self.matrix.column(DELAY).into_owned(),
        };
        let mut change = held.solve(&others)?;
        change[DELAY] = 1.0;
        Some(change)
    }

    /// Solution with no negative loss, and its free unknowns: an active set that starts from all.
    fn solve_not_negative(&self) -> Option<(Estimate, Vec<usize>)> {
        let mut free: Vec<usize> = (0..PARAMETER_DIM).collect();
        let mut estimate = self.solve(&free)?;
        for _ in 0..4 * PARAMETER_DIM {
            let strength = |i: &usize| estimate[*i] * self.matrix[(*i, *i)].sqrt();
            let negative = not_negative().filter(|i| free.contains(i) && estimate[*i] < 0.0);
            let worst = negative.min_by(|a, b| strength(a).total_cmp(&strength(b)));
            if let Some(worst) = worst {
                free.retain(|i| *i != worst);
            } else {
                let slope = self.side - self.matrix * estimate;
                let gain = |i: &usize| slope[*i] / self.matrix[(*i, *i)].sqrt();
                let least = 1e-9 * self.side.amax().max(1.0);
                let held = not_negative().filter(|i| !free.contains(i) && gain(i) > least);
                match held.max_by(|a, b| gain(a).total_cmp(&gain(b))) {
                    Some(unknown) => free.push(unknown),
                    None => break,
                }
            }
            free.sort_unstable();
            estimate = self.solve(&free)?;
        }
        for unknown in not_negative() {
            estimate[unknown] = estimate[unknown].max(0.0);
        }
        Some((estimate, free))
    }
}

pub(crate) fn residual(row: &Row, estimate: &Estimate, mass_kg: f64) -> f64 {
    let pairs = row.coefficients.iter().zip(estimate.iter());
    let products = pairs.map(|(coefficient, value)| coefficient * value);
    left(row, mass_kg) - products.sum::<f64>()
}

fn left(row: &Row, mass_kg: f64) -> f64 {
    match row.group {
        Group::Contact(_) | Group::Flight(_) => row.left,
        Group::Joint(_) => row.left / mass_kg,
    }
}

impl Iteration {
    /// Solves once, then computes the deviations of the new residuals. `None` if singular even with the priors.
    pub(crate) fn step(&mut self, rows: &[Row], priors: &[Prior], mass_kg: f64) -> Option<()> {
        let normal = self.normal(rows, priors, mass_kg);
        let (estimate, _) = normal.solve_not_negative()?;
        self.estimate = Some(estimate);
        let mut sums = [(0.0, 0.0); Group::COUNT];
        for row in rows.iter().filter(|row| row.moving) {
            let group = row.group.index();
            let residual = residual(row, &estimate, mass_kg);
            let share = (self.deviations).map_or(1.0, |all| huber(residual / all[group]));
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

    /// Variances: the largest of the `groupings`, and that of the delay. Unknowns at zero have that of free ones.
    pub(crate) fn variances(
        &self,
        rows: &[Row],
        groupings: &[Vec<usize>],
        priors: &[Prior],
        mass_kg: f64,
        delay_deviation_s: f64,
    ) -> Option<Estimate> {
        let whole = self.normal(rows, priors, mass_kg);
        let (_, bounded) = whole.solve_not_negative()?;
        let parts = |grouping: &Vec<usize>| {
            let count = grouping.iter().max().map_or(0, |last| last + 1);
            let all = self.normals(rows, mass_kg, |row| grouping[row.block], count);
            all.filter(|part| part.matrix.trace() > 0.0).collect()
        };
        let parts: Vec<Vec<Normal>> = groupings.iter().map(parts).collect();
        let over = |free: &[usize]| {
            let mut largest = Estimate::zeros();
            for parts in &parts {
                largest = largest.sup(&spread(&whole, parts, free)?);
            }
            let by_delay = whole.change_by_delay(free)? * (delay_deviation_s / mass_kg);
            Some(largest + by_delay.component_mul(&by_delay))
        };
        let mut variances = over(&bounded)?;
        if bounded.len() < PARAMETER_DIM {
            let free = over(&Vec::from_iter(0..PARAMETER_DIM))?;
            for at_zero in (0..PARAMETER_DIM).filter(|i| !bounded.contains(i)) {
                variances[at_zero] = free[at_zero];
            }
        }
        Some(variances)
    }

    fn normals(
        &self,
        rows: &[Row],
        mass_kg: f64,
        group: impl Fn(&Row) -> usize,
        count: usize,
    ) -> impl Iterator<Item = Normal> {
        let mut normals = vec![Normal::default(); count];
        for row in rows.iter().filter(|row| row.moving) {
            normals[group(row)].add(row, left(row, mass_kg), self.weight(row, mass_kg));
        }
        normals.into_iter().map(Normal::symmetric)
    }

    fn normal(&self, rows: &[Row], priors: &[Prior], mass_kg: f64) -> Normal {
        let mut normal = (self.normals(rows, mass_kg, |_| 0, 1).next()).expect("one group");
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

fn huber(residual: f64) -> f64 {
    HUBER / residual.abs().max(HUBER)
}

/// Jackknife variances; groups may differ in size (MacKinnon, Nielsen and Webb, J. Econometrics 232, 2023, CV3).
fn spread(whole: &Normal, parts: &[Normal], free: &[usize]) -> Option<Estimate> {
    let center = whole.solve(free)?;
    let mut sum = Estimate::zeros();
    for part in parts {
        let without = Normal {
            matrix: whole.matrix - part.matrix,
            side: whole.side - part.side,
        };
        let change = without.solve(free)? - center;
        sum += change.component_mul(&change);
    }
    let count = parts.len().max(1) as f64;
    Some(sum * ((count - 1.0) / count))
}

pub(crate) fn force_alone(rows: &[Row]) -> Option<Estimate> {
    let mut normal = Normal::default();
    let is_contact = |row: &&Row| matches!(row.group, Group::Contact(_));
    for row in rows.iter().filter(is_contact) {
        normal.add(row, row.left, 1.0);
    }
    normal.symmetric().solve(&[GRAVITY, INVERSE_MASS])
}

pub(crate) fn explained(rows: &[Row], estimate: &Estimate, axis: usize) -> f64 {
    let chosen = || rows.iter().filter(|row| row.group == Group::Contact(axis));
    let count = chosen().count().max(1) as f64;
    let mean = chosen().map(|row| row.left).sum::<f64>() / count;
    let total: f64 = chosen().map(|row| (row.left - mean).powi(2)).sum();
    let rest = chosen().map(|row| residual(row, estimate, 1.0).powi(2));
    1.0 - rest.sum::<f64>() / total
}
