//! What the encoder's rows are made of: rows that are held, and directions that the other rows combine.

use nalgebra::{DMatrix, DVector};

use super::dataset::{Dataset, Jump};
use super::metrics::{BODY_X, BODY_Z};
use super::options::Coordinates;
use crate::robot::{FeetRule, GRAVITY_M_S2, JOINT_DIM, Leg, Robot, STATE_DIM};

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
