//! The encoder's row space: which directions of the state the latent state sees and the lift can push.
//!
//! Reconstruction and lift depend on `W_e` only through the space its rows span, so the search runs over orthonormal
//! bases `Q` (`state_dim x latent_dim`, `W_e = Q^T`); [`varimax`] then chooses the basis inside the space: the same
//! space, described by as few coordinates a latent as possible.
//!
//! What the encoder's rows are made of: rows that are held, and directions that the other rows combine.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::dataset::{Dataset, Jump, scaled};
use super::metrics::{BODY_X, BODY_Z};
use super::options::{Coordinates, EncoderOptions};
use super::random::Random;
use crate::robot::{FeetRule, GRAVITY_M_S2, JOINT_DIM, Leg, Robot, STATE_DIM};

#[derive(Clone, Debug)]
pub(super) struct Moments {
    /// Covariance of the state, `state_dim x state_dim`.
    pub state: DMatrix<f64>,
    /// Second moment of the input about zero, `state_dim x state_dim`.
    pub input: DMatrix<f64>,
}

impl Moments {
    /// Coordinates that the encoder may look at: they move (standard deviation of at least `least_std`, scaled), or
    /// they are actuated (at least `least_share` of the input's energy).
    ///
    /// A coordinate that neither moves nor is actuated would only bring noise into the latent space. One that rests
    /// because a torque holds it (hip abduction) must stay, else the lift cannot return that torque.
    pub(super) fn active_coordinates(&self, least_std: f64, least_share: f64) -> Vec<usize> {
        let energy = self.input.trace();
        (0..self.state.nrows())
            .filter(|&i| {
                self.state[(i, i)].sqrt() >= least_std || self.input[(i, i)] > least_share * energy
            })
            .collect()
    }
}

const ITERATIONS: usize = 2000;

/// Finds the row space of least `reconstruction + lift_weight * lift_loss`: an orthonormal basis, in which the rows of
/// resting coordinates are zero. The frame must have as many directions as the space has dimensions.
///
/// With the state covariance `C`, the coordinate weights `D` (diagonal), the input second moment `U` and an orthonormal
/// basis `Q` of the active coordinates: `reconstruction = (tr DC - tr((Q^T C Q)^-1 Q^T C D C Q)) / n` is the weighted
/// mean square error of the least-squares decoder and `lift_loss = 1 - tr(Q^T U Q) / tr U` is `||u - W_e^T pinv(W_e^T)
/// u||^2 / ||u||^2`. Rows that the frame holds are taken as seen: `C` is then the covariance given them. The basis
/// returned is that of the other rows. Descent along the exact gradient on the Stiefel manifold from several starting
/// points, some of which are random; the best is kept.
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
        covariance
            .pseudo_inverse(floor)
            .expect("the tolerance is positive")
    }

    fn reconstruction(&self, basis: &DMatrix<f64>) -> f64 {
        let seen = basis.transpose() * &self.state_squared * basis;
        (self.total_state - (self.inverse_latent_covariance(basis) * seen).trace()) / self.state_dim
    }

    fn lift_loss(&self, basis: &DMatrix<f64>) -> f64 {
        let carried = (basis.transpose() * &self.input * basis).trace() + self.held_input;
        1.0 - carried / self.total_input
    }

    fn value(&self, basis: &DMatrix<f64>) -> f64 {
        self.reconstruction(basis) + self.lift_weight * self.lift_loss(basis)
    }

    /// Gradient of [`Self::value`] with respect to an orthonormal `Q`.
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
            step = if curvature > 0.0 {
                moved.norm_squared() / curvature
            } else {
                2.0 * step
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
    let mut starts: Vec<DMatrix<f64>> = [0.0, 0.3, 0.6, 1.0]
        .iter()
        .map(|share| leading(&state * (1.0 - share) + &input * *share, latent_dim))
        .collect();
    let mut random = Random::new(seed);
    for _ in 0..restarts {
        let start = random.matrix(objective.state.nrows(), latent_dim, 1.0);
        starts.push(orthonormal(start));
    }
    starts
}

fn leading(symmetric: DMatrix<f64>, count: usize) -> DMatrix<f64> {
    let eigen = SymmetricEigen::new(symmetric);
    let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a])); // stable
    eigen.eigenvectors.select_columns(&order[..count])
}

/// Orthogonal `latent_dim x latent_dim` matrix `T` for which `loadings * T` is simplest in the varimax sense.
///
/// `loadings` is `state_dim x latent_dim` (here `diag(std) Q`); the sum over columns of the variance of the squared
/// entries is increased by planar rotations until none moves a pair by more than `1e-12` rad (Kaiser 1958, The varimax
/// criterion for analytic rotation in factor analysis, without row normalisation).
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

/// Columns reordered by decreasing weight on the coordinates in `order_by`, each with a positive dominant entry.
///
/// The first coordinate of `order_by` takes the column that weighs it most, then the next one, so that a reader meets
/// body x as z1 and body z as z2 whenever the space holds them.
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
    let signs = columns.map(|column| column[column.iamax()].signum());
    let signs = signs.collect();
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
    if numerator == 0.0 && denominator >= 0.0 {
        0.0
    } else {
        numerator.atan2(denominator) / 4.0
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

/// Pitch of the body among the 18 coordinates.
const PITCH: usize = 16;
/// Time over which accelerations in flight are averaged, in s.
const WINDOW_S: f64 = 0.05;
/// Samples left out at both ends of a flight, where feet still slip or already touch.
const TRIM: usize = 4;
/// Fewest averaged accelerations in flight that tell the centre of mass.
const LEAST_WINDOWS: usize = 50;
/// Ridge, relative to the mean square of all joints' accelerations: joints that move together share what they do, and
/// one that hardly moves, whose part would be made of noise, has hardly any.
const RIDGE: f64 = 1e-2;

/// Rows of an encoder `W_e` before they are chosen, in scaled units.
#[derive(Clone, Debug)]
pub(super) struct Frame {
    /// Rows that every encoder has, as columns, `18 x h`.
    pub held: DMatrix<f64>,
    /// Orthonormal directions that the other rows combine, `18 x k`.
    pub free: DMatrix<f64>,
}

impl Frame {
    /// No row held, and the coordinates `active` to combine.
    pub(super) fn plain(active: &[usize]) -> Self {
        Self {
            held: DMatrix::zeros(STATE_DIM, 0),
            free: DMatrix::identity(STATE_DIM, STATE_DIM).select_columns(active),
        }
    }

    /// The frame of the options.
    ///
    /// With [`Coordinates::Named`] and two latent coordinates or more, the first two rows are the centre of mass
    /// forwards and upwards (see `centre_of_mass`) and the others combine the sums of `active` coordinates left and
    /// right that a mirror leaves alone: such an encoder knows nothing of `y`, roll and yaw, nor of left and right.
    pub(super) fn new(
        training: &Dataset,
        active: &[usize],
        latent_dim: usize,
        coordinates: Coordinates,
        robot: &Robot,
    ) -> Self {
        if coordinates == Coordinates::Free {
            return Self::plain(active);
        }
        let (body, held): (&[usize], _) = match latent_dim {
            0 | 1 => (&[BODY_X, BODY_Z], DMatrix::zeros(STATE_DIM, 0)),
            _ => (&[], centre_of_mass(training, robot)),
        };
        let single = body.iter().chain(&[PITCH]).filter(|i| active.contains(i));
        let mut free: Vec<DVector<f64>> = single.map(|&i| unit(i)).collect();
        free.extend(mirrored_joints(active, robot));
        Self {
            held,
            free: match free.is_empty() {
                true => DMatrix::zeros(STATE_DIM, 0),
                false => DMatrix::from_columns(&free),
            },
        }
    }

    pub(super) fn dim(&self) -> usize {
        self.held.ncols() + self.free.ncols()
    }

    /// The held rows and the `latent_dim - h` directions of the free space nearest to the space that the columns of
    /// `basis` span.
    pub(super) fn nearest(&self, basis: &DMatrix<f64>, latent_dim: usize) -> DMatrix<f64> {
        let inside = self.free.tr_mul(basis).svd(true, false);
        let left = inside.u.expect("invariant: asked for");
        let count = latent_dim - self.held.ncols();
        let mut order: Vec<usize> = (0..left.ncols()).collect();
        order.sort_by(|&a, &b| inside.singular_values[b].total_cmp(&inside.singular_values[a]));
        &self.free * left.select_columns(&order[..count])
    }
}

/// Directions of left and right joints that a mirror leaves alone, of the pairs with a joint among `active`: abductions
/// mostly turn the other way on the other side.
fn mirrored_joints(active: &[usize], robot: &Robot) -> Vec<DVector<f64>> {
    let pairs = [
        (Leg::FrontRight, Leg::FrontLeft),
        (Leg::RearRight, Leg::RearLeft),
    ];
    let joints_of_leg = JOINT_DIM / Leg::ALL.len();
    let mut directions = Vec::new();
    for (right, left) in pairs {
        for joint in 0..joints_of_leg {
            let [a, b] = [right, left].map(|leg| joints_of_leg * leg.index() + joint);
            if active.contains(&a) || active.contains(&b) {
                let sign = robot.mirror_sign(b);
                directions.push((unit(a) + unit(b) * sign) * std::f64::consts::FRAC_1_SQRT_2);
            }
        }
    }
    directions
}

/// Rows of the centre of mass forwards and upwards, as columns, `18 x 2`: `x + c_x^T q` and `z + c_z^T q` over the
/// joints `q`, of the body alone where the recordings have no flight.
///
/// Nothing pushes the robot in flight, so its centre of mass falls freely: `ddx + c_x^T ddq = 0` and `ddz + c_z^T ddq =
/// -g`. The regression of the body's accelerations on those of the joints (mirrored, ridge) over all flights therefore
/// tells the part `c` that the legs have in the centre of mass, to first order in `q`.
fn centre_of_mass(training: &Dataset, robot: &Robot) -> DMatrix<f64> {
    let all: Vec<usize> = (0..JOINT_DIM).collect();
    let joints = DMatrix::from_columns(&mirrored_joints(&all, robot));
    let mut body = DMatrix::from_columns(&[unit(BODY_X), unit(BODY_Z)]);
    let mut accelerations = Vec::new();
    for jump in &training.jumps {
        flight_accelerations(training, jump, &mut accelerations);
    }
    if accelerations.len() < LEAST_WINDOWS {
        return body;
    }
    let samples = DMatrix::from_columns(&accelerations);
    let (of_joints, n) = (joints.tr_mul(&samples), samples.ncols() as f64);
    let mean_square = of_joints.norm_squared() / of_joints.len() as f64;
    if mean_square <= 0.0 {
        return body;
    }
    let gram = &of_joints * of_joints.transpose() / n
        + DMatrix::identity(joints.ncols(), joints.ncols()) * (RIDGE * mean_square);
    let factor = gram
        .cholesky()
        .expect("invariant: a Gram matrix plus a ridge");
    let falling = GRAVITY_M_S2 * training.scaling.state[BODY_Z];
    for (column, (row, fall)) in [(BODY_X, 0.0), (BODY_Z, falling)].into_iter().enumerate() {
        let target = samples.row(row).transpose().add_scalar(fall);
        let part = factor.solve(&(&of_joints * target / n));
        let moved = body.column(column) - &joints * part;
        body.set_column(column, &moved);
    }
    body
}

/// Appends the accelerations over every window in the flights of a jump, scaled units.
fn flight_accelerations(training: &Dataset, jump: &Jump, all: &mut Vec<DVector<f64>>) {
    for (phase, range) in &jump.spans {
        if training.phases.patterns[*phase].feet != FeetRule::None || range.len() <= 2 * TRIM {
            continue;
        }
        let inside = range.start + TRIM..range.end - TRIM;
        let mut last = inside.start;
        for first in inside.clone() {
            while last < inside.end && jump.time_s[last] - jump.time_s[first] < WINDOW_S {
                last += 1;
            }
            if last == inside.end {
                break;
            }
            let duration = jump.time_s[last] - jump.time_s[first];
            all.push((jump.dx.column(last) - jump.dx.column(first)) / duration);
        }
    }
}

fn unit(index: usize) -> DVector<f64> {
    DVector::from_fn(STATE_DIM, |i, _| if i == index { 1.0 } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::STATE_DIM;
    use crate::train::dataset::centred;

    fn moments() -> Moments {
        let mut random = Random::new(3);
        let mixed = random.matrix(STATE_DIM, 3, 1.0) * random.matrix(3, 400, 1.0);
        let x = mixed + random.matrix(STATE_DIM, 400, 0.01);
        let u = random.matrix(STATE_DIM, 400, 1.0);
        of_samples(&x, &u)
    }

    fn of_samples(x: &DMatrix<f64>, u: &DMatrix<f64>) -> Moments {
        let n = x.ncols() as f64;
        let deviations = centred(x, &x.column_mean());
        Moments {
            state: &deviations * deviations.transpose() / n,
            input: u * u.transpose() / n,
        }
    }

    fn options(lift_weight: f64, body_weight: f64) -> EncoderOptions {
        EncoderOptions {
            lift_weight,
            body_weight,
            restarts: 3,
            ..EncoderOptions::default()
        }
    }

    fn all() -> Frame {
        Frame::plain(&Vec::from_iter(0..STATE_DIM))
    }

    #[test]
    fn gradient_agrees_with_finite_differences() {
        let objective = Objective::new(
            &moments(),
            &Frame::plain(&[0, 1, 2, 12, 14]),
            &options(0.3, 3.0),
        );
        let basis = orthonormal(Random::new(5).matrix(5, 2, 1.0));
        let gradient = tangent(&basis, &objective.gradient(&basis));
        let direction = tangent(&basis, &Random::new(6).matrix(5, 2, 1.0));
        // The value depends on the space only, so any orthonormal basis of the moved space will do.
        let at = |step: f64| objective.value(&orthonormal(&basis + &direction * step));
        let difference = (at(1e-5) - at(-1e-5)) / 2e-5;
        assert!((difference - gradient.dot(&direction)).abs() < 1e-7 * difference.abs().max(1.0));
    }

    #[test]
    fn without_lift_and_weights_the_space_is_that_of_the_principal_components() {
        let moments = moments();
        let options = options(0.0, 1.0);
        let found = find_subspace(&moments, &all(), 3, &options, 1);
        let found = Objective::new(&moments, &all(), &options).reconstruction(&found);
        let mut eigenvalues = SymmetricEigen::new(moments.state).eigenvalues;
        eigenvalues.as_mut_slice().sort_by(f64::total_cmp);
        let least = eigenvalues.rows(0, STATE_DIM - 3).sum() / STATE_DIM as f64;
        let close = (found - least).abs() < 1e-9 * least.max(1e-3);
        assert!(close, "{found} {least}");
    }

    #[test]
    fn resting_coordinate_is_active_only_if_it_is_actuated() {
        let x = DMatrix::from_fn(3, 50, |i, j| if i == 0 { (j as f64).sin() } else { 0.0 });
        let u = DMatrix::from_fn(3, 50, |i, _| if i == 1 { 2.0 } else { 0.0 });
        assert_eq!(of_samples(&x, &u).active_coordinates(0.1, 0.01), [0, 1]);
    }

    #[test]
    fn varimax_undoes_a_rotation_of_a_simple_structure() {
        let simple =
            DMatrix::from_row_slice(5, 2, &[1.0, 0.0, 0.9, 0.0, 0.0, 1.2, 0.0, 0.8, 0.0, 0.5]);
        let mut mixed = simple.clone();
        turn(&mut mixed, 0, 1, 0.4);
        let found = &mixed * varimax(&mixed);
        for row in 0..5 {
            assert!(
                found[(row, 0)].abs().min(found[(row, 1)].abs()) < 1e-9,
                "{found}"
            );
        }
    }
}
