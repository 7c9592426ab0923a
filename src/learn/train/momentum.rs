//! Encoder rows of the robot's momentum, by accelerations in flight or by forces and moments.

use super::body::{ROLL, Y};
use super::frame::joints_of_pairs;
use super::*;

const FLIGHT_WINDOW_S: f64 = 0.05; // over which accelerations are averaged
/// The same with feet on the ground. The first is for jumps, short because slow motions of one stance determine little
/// over long windows; the second is for walks, across changes of feet.
const WINDOW_S: [f64; 2] = [0.02, 0.1];
const STRIDE: usize = 2; // samples between the starts of two of these
const TRIM: usize = 4; // samples left out at both ends of a flight, where feet still slip or already touch
const LEAST_FLIGHTS: usize = 50; // averaged accelerations in flight that identify the centre of mass
const LEAST_SHARE: f64 = 0.05; // of all samples that they begin at
const FLIGHT_RIDGE: f64 = 1e-2; // relative to the mean square of all joints' accelerations
const RIDGE: f64 = 1e-3; // the same with feet on the ground
/// The same of x in walks. Feet resist rolling with a force that follows the legs' motion, and a weak ridge would count it
/// as the legs' momentum. Chosen with another controller and other gaits in sight: validation trots hardly depend on it.
const ROLLING_RIDGE: f64 = 2e-2;
const LOAD_RIDGE: f64 = 1e-5; // on the other columns of the regression, relative to the mean square of each

/// The momentum rows of these body coordinates, as columns: `x + c_x^T q`, `pitch + c_t^T q` and so on over the joints
/// `q`. In flight the centre of mass falls freely and the angular momentum about it is constant: `ddx + c_x^T ddq = 0`,
/// `ddz + c_z^T ddq = -g`, `ddpitch + c_t^T ddq = 0`. The regression of the body's accelerations on those of the joints
/// (ridge) gives `c`, to first order in `q`.
///
/// In walks, and if flights are fewer than [`LEAST_FLIGHTS`] or [`LEAST_SHARE`], the regression uses all samples. There
/// forces and moments on the body change the momentum: `dd(b + c_b^T q) = B [F; M] - k db + a`. Only the equations of
/// `x` and `y` contain their velocity, because rolling feet brake them. The equation of `y` also contains roll, which
/// moves a centre of mass below the body's origin. If forces are in the body's axes, the rows are those of the body
/// alone.
///
/// By symmetry a row in the plane has only sums of left and right joints, and a row that changes sign in a mirror image
/// only differences. This is the regression over the samples and their mirror images.
pub(super) fn momentum_rows(
    training: &Dataset,
    coordinates: &[usize],
    robot: &Robot,
) -> DMatrix<f64> {
    let mut rows = DMatrix::zeros(STATE_DIM, coordinates.len());
    for (mut row, &coordinate) in rows.column_iter_mut().zip(coordinates) {
        row[coordinate] = 1.0;
    }
    let mut flights = Vec::new();
    for jump in &training.jumps {
        flight_windows(training, jump, &mut flights);
    }
    let share = flights.len() as f64 / training.samples(None).max(1) as f64;
    let walks = training.walks();
    let has_loads = training.rule.wrench_frame() != WrenchFrame::Body;
    let flies = flights.len() >= LEAST_FLIGHTS && share >= LEAST_SHARE && !(walks && has_loads);
    if !flies && !has_loads {
        return rows;
    }
    let windows = match flies {
        true => flights,
        false => {
            let window_s = WINDOW_S[usize::from(walks)];
            let each = training.jumps.iter();
            each.flat_map(|jump| all_windows(jump, window_s)).collect()
        }
    };
    if windows.is_empty() {
        return rows;
    }
    let of = |part: fn(&Means) -> &DVector<f64>| {
        let columns = windows.iter().map(|means| part(means).clone());
        DMatrix::from_columns(&columns.collect::<Vec<_>>())
    };
    let accelerations = of(|means| &means.acceleration);
    let others = (!flies).then(|| (of(|means| &means.input), of(|means| &means.velocity)));
    let all: Vec<usize> = (0..JOINT_DIM).collect();
    for (mut row, &coordinate) in rows.column_iter_mut().zip(coordinates) {
        let parity = if is_lateral(coordinate) { -1.0 } else { 1.0 };
        let joints = DMatrix::from_columns(&joints_of_pairs(&all, robot, parity));
        let fall = match coordinate {
            BODY_Z => GRAVITY_M_S2 * training.scaling.state[BODY_Z],
            _ => 0.0,
        };
        let target = accelerations.row(coordinate).transpose().add_scalar(fall);
        let of_joints = joints.tr_mul(&accelerations);
        let Some((inputs, velocities)) = &others else {
            if let Some(part) = joint_weights(of_joints, Vec::new(), &target, FLIGHT_RIDGE) {
                row -= &joints * part.rows(0, joints.ncols());
            }
            continue;
        };
        let mut also: Vec<DVector<f64>> = Vec::new();
        let is_sideways = coordinate == Y;
        if is_sideways {
            also.push(accelerations.row(ROLL).transpose());
        }
        if [BODY_X, Y].contains(&coordinate) {
            also.push(velocities.row(coordinate).transpose());
        }
        also.extend(loads_on(coordinate).map(|load| inputs.row(load).transpose()));
        if !is_lateral(coordinate) {
            also.push(DVector::from_element(target.len(), 1.0));
        }
        let ridge = match coordinate {
            BODY_X if walks => ROLLING_RIDGE,
            _ => RIDGE,
        };
        if let Some(part) = joint_weights(of_joints, also, &target, ridge) {
            row -= &joints * part.rows(0, joints.ncols());
            if is_sideways {
                row[ROLL] -= part[joints.ncols()];
            }
        }
    }
    rows
}

/// Forces and moments that change the momentum of a body coordinate: the force along the coordinate of a centre of
/// mass; for a rotation the forces and moments with the same mirror symmetry.
pub(super) fn loads_on(coordinate: usize) -> impl Iterator<Item = usize> {
    let is_rotation = coordinate >= ROLL;
    let lateral = is_lateral(coordinate);
    let suits = move |load: &usize| match is_rotation {
        true => is_lateral(*load) == lateral,
        false => *load == coordinate,
    };
    (JOINT_DIM..STATE_DIM).filter(suits)
}

/// Weights of the joints, then of the other regressors `also`: ridge regression of `target` on the joints'
/// accelerations (`k x n`) and on these, with a ridge on the joints relative to their mean square. None at rest.
fn joint_weights(
    of_joints: DMatrix<f64>,
    also: Vec<DVector<f64>>,
    target: &DVector<f64>,
    ridge: f64,
) -> Option<DVector<f64>> {
    let ((k, n), mean_square) = (
        of_joints.shape(),
        of_joints.norm_squared() / of_joints.len() as f64,
    );
    if mean_square <= 0.0 {
        return None;
    }
    let rms = |row: &DVector<f64>| (row.norm() / (n as f64).sqrt()).max(f64::MIN_POSITIVE);
    let scales: Vec<f64> = also.iter().map(rms).collect();
    let mut regressors = of_joints.resize_vertically(k + also.len(), 0.0);
    for (i, (row, scale)) in also.iter().zip(&scales).enumerate() {
        regressors.set_row(k + i, &(row.transpose() / *scale));
    }
    let ridge = DVector::from_fn(regressors.nrows(), |i, _| match i < k {
        true => ridge * mean_square,
        false => LOAD_RIDGE,
    });
    let gram = &regressors * regressors.transpose() / n as f64 + DMatrix::from_diagonal(&ridge);
    let factor = gram
        .cholesky()
        .expect("invariant: a Gram matrix plus a ridge");
    let mut weights = factor.solve(&(regressors * target / n as f64));
    for (i, scale) in scales.iter().enumerate() {
        weights[k + i] /= *scale;
    }
    Some(weights)
}

/// Means over a window: of the accelerations, of the velocities and of the inputs.
struct Means {
    acceleration: DVector<f64>,
    velocity: DVector<f64>,
    input: DVector<f64>,
}

impl Means {
    fn of(jump: &Jump, first: usize, last: usize) -> Self {
        let duration_s = jump.time_s[last] - jump.time_s[first];
        let rate = |of: &DMatrix<f64>| (of.column(last) - of.column(first)) / duration_s;
        let mut input = DVector::zeros(STATE_DIM);
        for sample in first..last {
            let share = (jump.time_s[sample + 1] - jump.time_s[sample]) / duration_s;
            input += (jump.u.column(sample) + jump.u.column(sample + 1)) * (0.5 * share);
        }
        Self {
            acceleration: rate(&jump.dx),
            velocity: rate(&jump.x),
            input,
        }
    }
}

/// The windows of a length in a jump.
fn all_windows(jump: &Jump, window_s: f64) -> Vec<Means> {
    let ends = |first: usize| {
        let end_s = jump.time_s[first] + window_s;
        let last = jump.time_s.partition_point(|&time_s| time_s < end_s);
        (last < jump.samples()).then_some(last)
    };
    let starts = (0..jump.samples()).step_by(STRIDE);
    let windows = starts.filter_map(|first| Some(Means::of(jump, first, ends(first)?)));
    windows.collect()
}

/// Appends the windows of [`FLIGHT_WINDOW_S`] in the flights of a jump.
fn flight_windows(training: &Dataset, jump: &Jump, all: &mut Vec<Means>) {
    for (phase, range) in &jump.spans {
        if training.phases.patterns[*phase].feet != FeetRule::None || range.len() <= 2 * TRIM {
            continue;
        }
        let inside = range.start + TRIM..range.end - TRIM;
        let mut last = inside.start;
        for first in inside.clone() {
            while last < inside.end && jump.time_s[last] - jump.time_s[first] < FLIGHT_WINDOW_S {
                last += 1;
            }
            if last == inside.end {
                break;
            }
            all.push(Means::of(jump, first, last));
        }
    }
}
