//! The encoder's row space. Reconstruction and lift depend on `W_e` only through the space its rows span. The search
//! therefore runs over orthonormal bases `Q` (`state_dim x latent_dim`, `W_e = Q^T`) of the directions of a [`Frame`].
//! [`varimax`] then chooses the basis inside the space: as few coordinates per latent as possible.

use nalgebra::SymmetricEigen;

use super::dataset::scaled;
use super::*;

#[derive(Clone, Debug)]
pub(super) struct Moments {
    pub state: DMatrix<f64>, // covariance
    pub input: DMatrix<f64>, // second moment about zero
}

impl Moments {
    /// Coordinates that move (standard deviation of at least `least_std`, scaled) or are actuated (at least
    /// `least_share` of the input's energy). A joint may rest because a torque holds it (hip abduction): without it the
    /// lift could not return that torque.
    pub(super) fn active_coordinates(&self, least_std: f64, least_share: f64) -> Vec<usize> {
        let least_energy = least_share * self.input.trace();
        let moves = |i: usize| self.state[(i, i)].sqrt() >= least_std;
        let is_active = |&i: &usize| moves(i) || self.input[(i, i)] > least_energy;
        (0..self.state.nrows()).filter(is_active).collect()
    }
}

const ITERATIONS: usize = 2000;

/// Finds the orthonormal basis of least `reconstruction + lift_weight * lift_loss` over the frame's free directions.
/// With the state covariance `C`, the coordinate weights `D` (diagonal) and the input second moment `U`:
/// `reconstruction = (tr DC - tr((Q^T C Q)^-1 Q^T C D C Q)) / n` is the weighted mean square error of the least-squares
/// decoder, `lift_loss = 1 - tr(Q^T U Q) / tr U` is `||u - W_e^T pinv(W_e^T) u||^2 / ||u||^2`. `C` is the covariance
/// given the rows that the frame holds. Descent along the exact gradient on the Stiefel manifold from several starting
/// points; the best is kept.
pub(super) fn find_subspace(
    moments: &Moments,
    frame: &Frame,
    latent_dim: usize,
    options: &EncoderOptions,
    seed: u64,
) -> DMatrix<f64> {
    let objective = Objective::new(moments, frame, options);
    let mut best: Option<(f64, DMatrix<f64>)> = None;
    let count = latent_dim - frame.held.ncols();
    let starts = match count {
        0 => vec![DMatrix::zeros(frame.free.ncols(), 0)],
        _ => starting_points(&objective, count, options.restarts, seed),
    };
    for start in starts {
        let (value, basis) = objective.descend(start);
        if best.as_ref().is_none_or(|(least, _)| value < *least) {
            best = Some((value, basis));
        }
    }
    let (_, reduced) = best.expect("at least one starting point");
    &frame.free * reduced
}

/// The objective restricted to the free directions of a frame.
struct Objective {
    state: DMatrix<f64>, // m x m covariance of the free directions, given the held rows
    state_squared: DMatrix<f64>, // m x m, C_xm^T D C_xm with all coordinates as targets
    input: DMatrix<f64>, // m x m
    total_state: f64,
    held_input: f64, // energy of the input along the held rows
    total_input: f64,
    state_dim: f64,
    lift_weight: f64,
}

impl Objective {
    fn new(moments: &Moments, frame: &Frame, options: &EncoderOptions) -> Self {
        let weights = options.coordinate_weights();
        let (given, held_input) = given_held(moments, frame);
        let columns = &given * &frame.free;
        let weighted = scaled(columns.clone(), &weights);
        Self {
            state: frame.free.tr_mul(&columns),
            state_squared: columns.transpose() * weighted,
            input: frame.free.tr_mul(&(&moments.input * &frame.free)),
            total_state: given.diagonal().dot(&weights),
            held_input,
            total_input: moments.input.trace().max(f64::MIN_POSITIVE),
            state_dim: moments.state.nrows() as f64,
            lift_weight: options.lift_weight,
        }
    }

    /// `(Q^T C Q)^-1`; directions without variance count as not seen.
    fn inverse_latent_covariance(&self, basis: &DMatrix<f64>) -> DMatrix<f64> {
        if basis.is_empty() {
            return DMatrix::zeros(0, 0);
        }
        let covariance = basis.transpose() * &self.state * basis;
        let floor = 1e-12 * self.total_state.max(f64::MIN_POSITIVE);
        (covariance.pseudo_inverse(floor)).expect("the tolerance is positive")
    }

    fn value(&self, basis: &DMatrix<f64>) -> f64 {
        let seen = basis.transpose() * &self.state_squared * basis;
        let explained = (self.inverse_latent_covariance(basis) * seen).trace();
        let carried = (basis.transpose() * &self.input * basis).trace() + self.held_input;
        let lift_loss = 1.0 - carried / self.total_input;
        (self.total_state - explained) / self.state_dim + self.lift_weight * lift_loss
    }

    fn gradient(&self, basis: &DMatrix<f64>) -> DMatrix<f64> {
        let inverse = self.inverse_latent_covariance(basis);
        let seen = basis.transpose() * &self.state_squared * basis;
        let reconstruction = (&self.state_squared * basis * &inverse
            - &self.state * basis * &inverse * seen * &inverse)
            * (-2.0 / self.state_dim);
        reconstruction - &self.input * basis * (2.0 * self.lift_weight / self.total_input)
    }

    /// Gradient descent with Barzilai-Borwein steps, QR retraction and backtracking.
    fn descend(&self, start: DMatrix<f64>) -> (f64, DMatrix<f64>) {
        let mut basis = start;
        let mut value = self.value(&basis);
        let mut step = 1.0 / self.gradient(&basis).norm().max(f64::MIN_POSITIVE);
        for _ in 0..ITERATIONS {
            let direction = tangent(&basis, &self.gradient(&basis));
            let slope = direction.norm_squared();
            if slope <= f64::MIN_POSITIVE {
                break;
            }
            let accepted = (0..40).find_map(|_| {
                let candidate = orthonormal(&basis - &direction * step);
                let next = self.value(&candidate);
                let falls = next <= value - 1e-4 * step * slope;
                step *= if falls { 1.0 } else { 0.5 };
                falls.then_some((next, candidate))
            });
            let Some((next, candidate)) = accepted else {
                break;
            };
            let moved = &candidate - &basis;
            let turned = tangent(&candidate, &self.gradient(&candidate)) - direction;
            let converged = value - next <= 1e-13 * value.abs();
            (basis, value) = (candidate, next);
            if converged {
                break;
            }
            let curvature = moved.dot(&turned).abs();
            step = match curvature > 0.0 {
                true => moved.norm_squared() / curvature,
                false => 2.0 * step,
            };
        }
        (value, basis)
    }
}

/// The covariance of the state given the rows that a frame holds, and the input's energy along these rows.
fn given_held(moments: &Moments, frame: &Frame) -> (DMatrix<f64>, f64) {
    let held = &frame.held;
    if held.ncols() == 0 {
        return (moments.state.clone(), 0.0);
    }
    let seen = &moments.state * held;
    let inverse = (held.tr_mul(&seen))
        .pseudo_inverse(1e-12 * moments.state.trace().max(f64::MIN_POSITIVE))
        .expect("the tolerance is positive");
    let orthonormal = orthonormal(held.clone());
    let energy = (orthonormal.tr_mul(&(&moments.input * &orthonormal))).trace();
    (&moments.state - &seen * inverse * seen.transpose(), energy)
}

/// The part of `gradient` that is tangent to the Stiefel manifold at `basis`.
fn tangent(basis: &DMatrix<f64>, gradient: &DMatrix<f64>) -> DMatrix<f64> {
    gradient - basis * (basis.transpose() * gradient)
}

fn orthonormal(matrix: DMatrix<f64>) -> DMatrix<f64> {
    matrix.qr().q()
}

/// Leading eigenvectors of blends of state and input energy, then random bases.
fn starting_points(
    objective: &Objective,
    latent_dim: usize,
    restarts: usize,
    seed: u64,
) -> Vec<DMatrix<f64>> {
    let state = &objective.state / objective.total_state.max(f64::MIN_POSITIVE);
    let input = &objective.input / objective.total_input;
    let blend = |share: f64| leading(&state * (1.0 - share) + &input * share, latent_dim);
    let mut random = Random::new(seed);
    let random = (0..restarts).map(|_| random.matrix(state.nrows(), latent_dim, 1.0));
    let blends = [0.0, 0.3, 0.6, 1.0].map(blend).into_iter();
    blends.chain(random.map(orthonormal)).collect()
}

fn leading(symmetric: DMatrix<f64>, count: usize) -> DMatrix<f64> {
    let eigen = SymmetricEigen::new(symmetric);
    let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a])); // stable
    eigen.eigenvectors.select_columns(&order[..count])
}

/// Orthogonal `T` for which `loadings * T` (`diag(std) Q`) is simplest: planar rotations increase the sum over columns
/// of the variance of the squared entries (Kaiser 1958, The varimax criterion).
pub(super) fn varimax(loadings: &DMatrix<f64>) -> DMatrix<f64> {
    let n_columns = loadings.ncols();
    let n_rows = loadings.nrows() as f64;
    let mut rotated = loadings.clone();
    let mut rotation = DMatrix::identity(n_columns, n_columns);
    for _ in 0..200 {
        let mut largest: f64 = 0.0;
        for a in 0..n_columns {
            for b in a + 1..n_columns {
                let angle = best_angle(&rotated, a, b, n_rows);
                if angle.abs() > 1e-12 {
                    turn(&mut rotated, a, b, angle);
                    turn(&mut rotation, a, b, angle);
                    largest = largest.max(angle.abs());
                }
            }
        }
        if largest <= 1e-12 {
            break;
        }
    }
    rotation
}

/// The order of the columns, and signs that make dominant entries positive. First is the column with the largest weight
/// of the first coordinate of `order_by`, then that of the next (body x as z1 and body z as z2), then the others by
/// weight.
pub(super) fn order_and_sign(
    loadings: &DMatrix<f64>,
    order_by: &[usize],
) -> (Vec<usize>, Vec<f64>) {
    let weight = |column: usize| loadings.column(column).norm_squared();
    let mut left: Vec<usize> = (0..loadings.ncols()).collect();
    let mut order = Vec::with_capacity(left.len());
    for &coordinate in order_by {
        let share = |column: usize| loadings[(coordinate, column)].powi(2) / weight(column);
        let heaviest = (0..left.len()).max_by(|&a, &b| share(left[a]).total_cmp(&share(left[b])));
        if let Some(position) = heaviest.filter(|&position| share(left[position]) > 0.5) {
            order.push(left.remove(position));
        }
    }
    // Stable: equals stay in their order.
    left.sort_by(|&a, &b| weight(b).total_cmp(&weight(a)));
    order.extend(left);
    let columns = order.iter().map(|&column| loadings.column(column));
    let signs = columns
        .map(|column| column[column.iamax()].signum())
        .collect();
    (order, signs)
}

fn best_angle(loadings: &DMatrix<f64>, a: usize, b: usize, n_rows: f64) -> f64 {
    let (mut sum_u, mut sum_v, mut sum_uv, mut sum_difference) = (0.0, 0.0, 0.0, 0.0);
    for row in 0..loadings.nrows() {
        let (x, y) = (loadings[(row, a)], loadings[(row, b)]);
        let (u, v) = (x * x - y * y, 2.0 * x * y);
        sum_u += u;
        sum_v += v;
        sum_uv += 2.0 * u * v;
        sum_difference += u * u - v * v;
    }
    let numerator = sum_uv - 2.0 * sum_u * sum_v / n_rows;
    let denominator = sum_difference - (sum_u * sum_u - sum_v * sum_v) / n_rows;
    match numerator == 0.0 && denominator >= 0.0 {
        true => 0.0,
        false => numerator.atan2(denominator) / 4.0,
    }
}

fn turn(matrix: &mut DMatrix<f64>, a: usize, b: usize, angle: f64) {
    let (sine, cosine) = angle.sin_cos();
    for row in 0..matrix.nrows() {
        let (x, y) = (matrix[(row, a)], matrix[(row, b)]);
        matrix[(row, a)] = cosine * x + sine * y;
        matrix[(row, b)] = cosine * y - sine * x;
    }
}
