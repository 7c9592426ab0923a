//! Encoder rows of the robot's momentum, by accelerations in flight or by forces and moments.

use super::frame::{SETTLING_S, joints_of_pairs};
use super::*;
use crate::robot::FOOT_DIM;

const WINDOW_S: f64 = 0.05; // over which accelerations in flight are averaged
const TRIM: usize = 4; // samples left out at both ends of a flight, where feet still slip or already touch
const LEAST_WINDOWS: usize = 50; // averaged accelerations in flight that identify the centre of mass
const RIDGE: f64 = 1e-2; // relative to the mean square of all joints' accelerations
const LOAD_RIDGE: f64 = 1e-5; // on forces and moments, relative to the mean square of each

/// The momentum rows of these body coordinates, as columns: `x + c_x^T q`, `pitch + c_t^T q` and so on over the joints `q`.
/// In flight the centre of mass falls freely and the angular momentum about it is constant: `ddx + c_x^T ddq = 0`, `ddz +
/// c_z^T ddq = -g`, `ddpitch + c_t^T ddq = 0`. The regression of the body's accelerations on those of the joints (ridge) gives
/// `c`, to first order in `q`. With fewer than [`LEAST_WINDOWS`] of flight it is that of all samples, where forces and
/// moments on the body change the momentum: `dd(b + c_b^T q) = B [F; M] + a`; of the body alone if these are in its axes. By
/// symmetry a row in the plane has sums of left and right joints only, and one that changes sign in a mirror image
/// differences: this is the regression over the samples and their mirror images.
pub(super) fn momentum_rows(
    training: &Dataset,
    coordinates: &[usize],
    robot: &Robot,
) -> DMatrix<f64> {
    let mut rows = DMatrix::zeros(STATE_DIM, coordinates.len());
    for (mut row, &coordinate) in rows.column_iter_mut().zip(coordinates) {
        row[coordinate] = 1.0;
    }
    let mut accelerations = Vec::new();
    for jump in &training.jumps {
        flight_accelerations(training, jump, &mut accelerations);
    }
    let flies = accelerations.len() >= LEAST_WINDOWS;
    if !flies && training.rule.wrench_frame() == WrenchFrame::Body {
        return rows;
    }
    let (samples, inputs) = match flies {
        true => (DMatrix::from_columns(&accelerations), None),
        false => loaded_samples(training),
    };
    let all: Vec<usize> = (0..JOINT_DIM).collect();
    for (mut row, &coordinate) in rows.column_iter_mut().zip(coordinates) {
        let parity = if is_lateral(coordinate) { -1.0 } else { 1.0 };
        let joints = DMatrix::from_columns(&joints_of_pairs(&all, robot, parity));
        let of_joints = joints.tr_mul(&samples);
        let loads = inputs.as_ref().map(|inputs| loads_on(coordinate, inputs));
        let fall = match coordinate {
            BODY_Z => GRAVITY_M_S2 * training.scaling.state[BODY_Z],
            _ => 0.0,
        };
        let target = samples.row(coordinate).transpose().add_scalar(fall);
        if let Some(part) = joint_weights(of_joints, loads, &target) {
            row -= &joints * part;
        }
    }
    rows
}

/// What changes the momentum of a body coordinate, in rows of mean square 1: forces and moments that a mirror changes as
/// it does this coordinate, and in the plane a constant.
fn loads_on(coordinate: usize, inputs: &DMatrix<f64>) -> DMatrix<f64> {
    let lateral = is_lateral(coordinate);
    let own = (JOINT_DIM..STATE_DIM).filter(|&load| is_lateral(load) == lateral);
    let mut loads = inputs.select_rows(&own.collect::<Vec<_>>());
    for mut load in loads.row_iter_mut() {
        let rms = load.norm() / (load.len() as f64).sqrt();
        load /= rms.max(f64::MIN_POSITIVE);
    }
    let constant = usize::from(!lateral);
    let count = loads.nrows();
    loads.resize_vertically(count + constant, 1.0)
}

/// Weights of the joints: ridge regression of `target` on their accelerations (`k x n`) and on loads. None at rest.
fn joint_weights(
    of_joints: DMatrix<f64>,
    loads: Option<DMatrix<f64>>,
    target: &DVector<f64>,
) -> Option<DVector<f64>> {
    let ((k, n), mean_square) = (
        of_joints.shape(),
        of_joints.norm_squared() / of_joints.len() as f64,
    );
    if mean_square <= 0.0 {
        return None;
    }
    let mut regressors = of_joints;
    if let Some(loads) = loads {
        regressors = regressors.resize_vertically(k + loads.nrows(), 0.0);
        regressors.rows_mut(k, loads.nrows()).copy_from(&loads);
    }
    let ridge = DVector::from_fn(regressors.nrows(), |i, _| match i < k {
        true => RIDGE * mean_square,
        false => LOAD_RIDGE,
    });
    let gram = &regressors * regressors.transpose() / n as f64 + DMatrix::from_diagonal(&ridge);
    let factor = gram
        .cholesky()
        .expect("invariant: a Gram matrix plus a ridge");
    let weights = factor.solve(&(regressors * target / n as f64));
    Some(weights.rows(0, k).into_owned())
}

/// Accelerations and inputs of all samples but those just after a touchdown, where a part of the force passes no joint.
fn loaded_samples(training: &Dataset) -> (DMatrix<f64>, Option<DMatrix<f64>>) {
    let (mut accelerations, mut inputs) = (Vec::new(), Vec::new());
    for jump in &training.jumps {
        let mut touched_s = f64::NEG_INFINITY;
        for sample in 0..jump.samples() {
            let touches =
                |foot: usize| jump.feet[sample][foot] && sample > 0 && !jump.feet[sample - 1][foot];
            if (0..FOOT_DIM).any(touches) {
                touched_s = jump.time_s[sample];
            }
            if jump.time_s[sample] - touched_s >= SETTLING_S {
                accelerations.push(jump.ddx.column(sample));
                inputs.push(jump.u.column(sample));
            }
        }
    }
    (
        DMatrix::from_columns(&accelerations),
        Some(DMatrix::from_columns(&inputs)),
    )
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
