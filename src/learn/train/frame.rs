//! Encoder rows known from physics: momentum of the robot, and feet that stand still.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::dataset::{Dataset, Jump, centred, mean};
use super::latent::input_projection;
use super::options::Coordinates;
use crate::model::complement;
use crate::recording::stretches;
use crate::robot::{
    BODY_X, BODY_Z, FeetRule, GRAVITY_M_S2, JOINT_DIM, LEG_JOINT_DIM, Leg, Robot, STATE_DIM,
};

const PITCH: usize = JOINT_DIM + 4;
/// Body coordinates of the momentum rows: the centre of mass forwards and upwards, and the rotation about it.
const MOMENTUM: [usize; 3] = [BODY_X, BODY_Z, PITCH];
pub(super) const TURN: usize = 2;
/// Latent coordinates from which on the rotation about the centre of mass is a row. With fewer, torques of the legs are
/// lost when there is one.
const TURNING_DIM: usize = 5;
/// Latent coordinates from which on the rows are those of the whole body in its plane: three of momentum, four of legs.
pub(super) const WHOLE_BODY_DIM: usize = 7;
const WINDOW_S: f64 = 0.05; // over which accelerations in flight are averaged
const TRIM: usize = 4; // samples left out at both ends of a flight, where feet still slip or already touch
const LEAST_WINDOWS: usize = 50; // averaged accelerations in flight that identify the centre of mass
const RIDGE: f64 = 1e-2; // relative to the mean square of all joints' accelerations

const SETTLING_S: f64 = 0.05; // after a touchdown, in which feet still slip
const LEAST_STANDING: usize = 100; // samples on standing feet that identify their rows
const ABDUCTION_ROUNDS: usize = 3;
const STANDING_RIDGE: f64 = 1e-3; // of standardised columns
const PAIRS: [[Leg; 2]; 2] = [
    [Leg::FrontRight, Leg::FrontLeft],
    [Leg::RearRight, Leg::RearLeft],
];

/// Rows of an encoder `W_e` before they are chosen, in scaled units.
#[derive(Clone, Debug)]
pub(super) struct Frame {
    pub(super) held: DMatrix<f64>, // rows of every encoder, as columns, 18 x h: momentum, then legs
    pub(super) momentum: usize, // how many of them are of the momentum, in the order of `MOMENTUM`
    pub(super) legs: Vec<LegRow>, // of the others
    pub(super) free: DMatrix<f64>, // orthonormal directions that the other rows combine, 18 x k
}

/// A row `rho` of a pair of legs. With the momentum rows `b` (forwards or upwards) and `t` (turn) the sum
/// `rho + b + arm t` is the position of the pair's feet, constant while they stand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LegRow {
    pub(super) body: usize, // the momentum row that it belongs to
    pub(super) arm: f64,
    pub(super) rest: f64, // mean foot position in stances, less the mean of all samples
}

impl Frame {
    pub(super) fn plain(active: &[usize]) -> Self {
        Self {
            held: DMatrix::zeros(STATE_DIM, 0),
            momentum: 0,
            legs: Vec::new(),
            free: DMatrix::identity(STATE_DIM, STATE_DIM).select_columns(active),
        }
    }

    /// With [`Coordinates::Named`] and two or more latent coordinates, the first two rows are the centre of mass. With
    /// five or more the third is the rotation about it, with seven or more the next four are foot positions relative to
    /// it. The others combine mirror-symmetric sums of `active` coordinates: neither `y`, roll and yaw, nor left and
    /// right; nor pitch where a row contains it.
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
        let (body, count): (&[usize], usize) = match latent_dim {
            0 | 1 => (&[BODY_X, BODY_Z, PITCH], 0),
            2..TURNING_DIM => (&[PITCH], 2),
            _ => (&[], MOMENTUM.len()),
        };
        let momentum = momentum_rows(training, count, robot);
        let joints = mirrored_joints(active, robot);
        let mut held: Vec<DVector<f64>> =
            momentum.column_iter().map(|row| row.into_owned()).collect();
        let mut legs = Vec::new();
        if latent_dim >= WHOLE_BODY_DIM {
            for (row, leg) in leg_rows(training, &momentum, robot) {
                held.push(row);
                legs.push(leg);
            }
        }
        let single = body.iter().filter(|i| active.contains(i)).map(|&i| unit(i));
        let free: Vec<_> = single.chain(joints).collect();
        let free = DMatrix::from_fn(STATE_DIM, free.len(), |row, k| free[k][row]);
        Self {
            free: without(free, &held[count..]),
            held: DMatrix::from_fn(STATE_DIM, held.len(), |row, k| held[k][row]),
            momentum: count,
            legs,
        }
    }

    /// How many of `latent_dim` coordinates predictions of whole jumps are judged by: of the whole body the first two, the
    /// centre of mass. Errors of rotation and legs there grow with the least difference at take-off.
    pub(super) fn judged_over_jumps(&self, latent_dim: usize) -> usize {
        if self.legs.is_empty() {
            latent_dim
        } else {
            TURN
        }
    }

    /// How many momentum rows have their own equations for deviations from the mean jump: all, if the rotation is one.
    /// Without it their equations miss what the pitch does, and regressions find some of that.
    pub(super) fn known_in_deviations(&self) -> usize {
        if self.momentum > TURN {
            self.momentum
        } else {
            0
        }
    }

    pub(super) fn dim(&self) -> usize {
        self.held.ncols() + self.free.ncols()
    }

    /// The `latent_dim - h` free directions nearest to the space that the columns of `basis` span.
    pub(super) fn nearest(&self, basis: &DMatrix<f64>, latent_dim: usize) -> DMatrix<f64> {
        let count = latent_dim - self.held.ncols();
        if count == 0 {
            return DMatrix::zeros(STATE_DIM, 0);
        }
        let inside = self.free.tr_mul(basis).svd(true, false);
        let left = inside.u.expect("invariant: asked for");
        let mut order: Vec<usize> = (0..left.ncols()).collect();
        order.sort_by(|&a, &b| inside.singular_values[b].total_cmp(&inside.singular_values[a]));
        &self.free * left.select_columns(&order[..count])
    }
}

/// Orthonormal basis of the span of `free` orthogonal to the projections of `rows` onto it.
fn without(free: DMatrix<f64>, rows: &[DVector<f64>]) -> DMatrix<f64> {
    if rows.is_empty() || free.ncols() == 0 {
        return free;
    }
    let inside = rows.iter().map(|row| free.tr_mul(row));
    let inside = DMatrix::from_columns(&inside.collect::<Vec<_>>());
    let eigen = complement(&inside).symmetric_eigen();
    let outside = (0..free.ncols()).filter(|&i| eigen.eigenvalues[i] > 0.5);
    free * eigen
        .eigenvectors
        .select_columns(&outside.collect::<Vec<_>>())
}

/// Directions of left and right joints that a mirror leaves alone, of the pairs with a joint among `active`.
fn mirrored_joints(active: &[usize], robot: &Robot) -> Vec<DVector<f64>> {
    let joints = PAIRS
        .into_iter()
        .flat_map(|legs| (0..LEG_JOINT_DIM).map(move |joint| (legs, joint)));
    let is_active = |&(legs, joint): &([Leg; 2], usize)| {
        legs.iter()
            .any(|&leg| active.contains(&joint_of(leg, joint)))
    };
    let direction = |(legs, joint)| mirrored(legs, joint, robot) * std::f64::consts::SQRT_2;
    joints.filter(is_active).map(direction).collect()
}

/// The mean of a joint of two legs that mirror each other.
fn mirrored([right, left]: [Leg; 2], joint: usize, robot: &Robot) -> DVector<f64> {
    let [right, left] = [joint_of(right, joint), joint_of(left, joint)];
    (unit(right) + unit(left) * robot.mirror_sign(left)) * 0.5
}

fn joint_of(leg: Leg, joint: usize) -> usize {
    LEG_JOINT_DIM * leg.index() + joint
}

/// The first `count` momentum rows, as columns, `18 x count`: `x + c_x^T q`, `z + c_z^T q` and `pitch + c_t^T q` over
/// the joints `q`, of the body alone where the recordings have no flight. In flight the centre of mass falls freely and
/// the angular momentum about it is constant: `ddx + c_x^T ddq = 0`, `ddz + c_z^T ddq = -g`, `ddpitch + c_t^T ddq = 0`. The
/// regression of the body's accelerations on those of the joints (mirrored, ridge) gives `c`, to first order in `q`.
fn momentum_rows(training: &Dataset, count: usize, robot: &Robot) -> DMatrix<f64> {
    let all: Vec<usize> = (0..JOINT_DIM).collect();
    let joints = DMatrix::from_columns(&mirrored_joints(&all, robot));
    let mut body = DMatrix::from_fn(STATE_DIM, count, |row, k| {
        f64::from(u8::from(row == MOMENTUM[k]))
    });
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
    for (mut column, row) in body.column_iter_mut().zip(MOMENTUM) {
        let fall = if row == BODY_Z {
            GRAVITY_M_S2 * training.scaling.state[BODY_Z]
        } else {
            0.0
        };
        let target = samples.row(row).transpose().add_scalar(fall);
        let part = factor.solve(&(&of_joints * target / n));
        column -= &joints * part;
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

/// Rows of the legs as columns, forwards and upwards of the front pair, then of the rear pair; none if a pair has fewer
/// than [`LEAST_STANDING`] samples of stance. While a pair stands, `x + arm pitch + w^T q` over its flexions and knees
/// `q` is constant, and so is the same sum with `z`. Ridge regression of the deviations from the mean of each stance
/// gives `arm` and `w`. A row is this sum less the momentum rows, and with weights of the abductions by
/// [`add_abductions`].
fn leg_rows(
    training: &Dataset,
    momentum: &DMatrix<f64>,
    robot: &Robot,
) -> Vec<(DVector<f64>, LegRow)> {
    let mut rows = Vec::new();
    for legs in PAIRS {
        let [_, flexion, knee] = std::array::from_fn(|joint| mirrored(legs, joint, robot));
        let stances = stances(training, legs);
        if stances.iter().map(|(_, range)| range.len()).sum::<usize>() < LEAST_STANDING {
            return Vec::new();
        }
        let moving = DMatrix::from_columns(&[unit(PITCH), flexion.clone(), knee.clone()]);
        let deviations = deviations(training, &stances);
        for (body, &row) in MOMENTUM[..2].iter().enumerate() {
            let weights = standardised_fit(
                &moving.tr_mul(&deviations),
                &deviations.row(row).transpose(),
            );
            let (arm, of_flexion, of_knee) = (-weights[0], -weights[1], -weights[2]);
            let feet = unit(row) + unit(PITCH) * arm + &flexion * of_flexion + &knee * of_knee;
            let rest = mean_over(training, &stances, &feet);
            rows.push((
                feet - momentum.column(body) - momentum.column(TURN) * arm,
                LegRow { body, arm, rest },
            ));
        }
    }
    add_abductions(training, momentum, &mut rows, robot);
    rows
}

/// Spans in which both feet of a pair are down, without [`SETTLING_S`] after a touchdown.
fn stances(training: &Dataset, legs: [Leg; 2]) -> Vec<(usize, Range<usize>)> {
    let mut all = Vec::new();
    for (index, jump) in training.jumps.iter().enumerate() {
        let stands = |sample: usize| legs.iter().all(|leg| jump.feet[sample][leg.index()]);
        let spans = stretches(0..jump.samples(), |a, b| stands(a) == stands(b)).into_iter();
        for span in spans.filter(|span| stands(span.start)) {
            let settled_s = match span.start {
                0 => f64::NEG_INFINITY,
                touchdown => jump.time_s[touchdown] + SETTLING_S,
            };
            let settled = (span.clone()).find(|&sample| jump.time_s[sample] >= settled_s);
            all.extend(settled.map(|settled| (index, settled..span.end)));
        }
    }
    all
}

/// States less their means in each stance, side by side.
fn deviations(training: &Dataset, stances: &[(usize, Range<usize>)]) -> DMatrix<f64> {
    let count = stances.iter().map(|(_, range)| range.len()).sum();
    let mut all = DMatrix::zeros(STATE_DIM, count);
    let mut at = 0;
    for (jump, range) in stances {
        let states = training.jumps[*jump]
            .x
            .columns_range(range.clone())
            .into_owned();
        let own = centred(&states, &mean(&states));
        all.columns_mut(at, own.ncols()).copy_from(&own);
        at += own.ncols();
    }
    all
}

/// Mean of a row over the stances, less its mean over all samples.
fn mean_over(training: &Dataset, stances: &[(usize, Range<usize>)], row: &DVector<f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for (jump, range) in stances {
        let states = training.jumps[*jump].x.columns_range(range.clone());
        sum += row.tr_mul(&states).sum();
        count += range.len() as f64;
    }
    sum / count - row.dot(&mean(&training.states(None)))
}

/// Gives each pair's rows the weights of its abductions with which the lift `W_e^T u_lat` returns their torques best, by
/// regression on `u_lat = pinv(W_e^T) u`, which depends on these weights in turn: [`ABDUCTION_ROUNDS`] times.
fn add_abductions(
    training: &Dataset,
    momentum: &DMatrix<f64>,
    rows: &mut [(DVector<f64>, LegRow)],
    robot: &Robot,
) {
    let inputs = training.inputs(None);
    for _ in 0..ABDUCTION_ROUNDS {
        let legs = rows.iter().map(|(row, _)| row.clone());
        let momentum = momentum.column_iter().map(|row| row.into_owned());
        let columns: Vec<DVector<f64>> = momentum.chain(legs).collect();
        let first = columns.len() - rows.len();
        let weights = DMatrix::from_columns(&columns).transpose();
        let u_lat = input_projection(&weights) * &inputs;
        let missed = &inputs - weights.tr_mul(&u_lat);
        for (pair, rows) in rows.chunks_mut(2).enumerate() {
            let abduction = mirrored(PAIRS[pair], 0, robot);
            let torque = missed.tr_mul(&abduction) / abduction.norm_squared();
            let own = u_lat.rows(first + 2 * pair, 2).into_owned();
            let changes = standardised_fit(&own, &torque);
            for ((row, _), change) in rows.iter_mut().zip(&changes) {
                *row += &abduction * *change;
            }
        }
    }
}

/// Weights `w` that minimise `|w^T regressors - target|^2` (`k x n`, `n`) with a ridge on standardised rows.
fn standardised_fit(regressors: &DMatrix<f64>, target: &DVector<f64>) -> DVector<f64> {
    let scales = DVector::from_iterator(
        regressors.nrows(),
        regressors
            .row_iter()
            .map(|row| row.norm().max(f64::MIN_POSITIVE)),
    );
    let mut rows = regressors.clone();
    rows.row_iter_mut()
        .zip(&scales)
        .for_each(|(mut row, scale)| row /= *scale);
    let gram =
        &rows * rows.transpose() + DMatrix::identity(rows.nrows(), rows.nrows()) * STANDING_RIDGE;
    let factor = gram
        .cholesky()
        .expect("invariant: a Gram matrix plus a ridge");
    factor.solve(&(rows * target)).component_div(&scales)
}

fn unit(index: usize) -> DVector<f64> {
    DVector::from_fn(STATE_DIM, |i, _| if i == index { 1.0 } else { 0.0 })
}
