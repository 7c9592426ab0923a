//! Encoder rows known from physics: momentum of the robot, and feet that stand still.

use super::body::PITCH;
use super::momentum::momentum_rows;
use super::pairing::paired_joints;
use super::recipe::RecipePart;
use super::*;
use crate::model::complement;
use crate::recording::stretches;
use crate::robot::{LEG_JOINT_DIM, Leg};

pub(super) const TURN: usize = 2; // the row of pitch, where there is one
/// Rows of the legs: feet forwards and upwards, of the front pair and of the rear pair.
const LEG_ROWS: usize = 4;

pub(super) const SETTLING_S: f64 = 0.05; // after a touchdown, in which feet still slip
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
    pub(super) body: Vec<usize>,   // body coordinates of the first of them, those of the momentum
    pub(super) legs: Vec<LegRow>,  // of the others
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
            body: Vec::new(),
            legs: Vec::new(),
            free: DMatrix::identity(STATE_DIM, STATE_DIM).select_columns(active),
        }
    }

    /// With [`Coordinates::Named`] the first rows are the momentum of the coordinates in `body`. If pitch is among them
    /// and there are at least four more rows, the next four are foot positions relative to the centre of mass, except
    /// for walks. The other rows combine `active` coordinates.
    ///
    /// In the plane these are mirror-symmetric sums of joints, and pitch if it has no row. With a row that changes sign
    /// in a mirror image they are the sums of the legs that move alike ([`paired_joints`]) if these are enough.
    /// Otherwise they are all joints, and all body coordinates without a row.
    pub(super) fn new(
        training: &Dataset,
        active: &[usize],
        latent_dim: usize,
        (coordinates, body): (Coordinates, &BodyRows),
        options: &RegressionOptions,
        robot: &Robot,
    ) -> Self {
        if coordinates == Coordinates::Free {
            return Self::plain(active);
        }
        let spatial = body.is_spatial();
        let rows = body.coordinates.clone();
        let momentum = match options.has(RecipePart::MomentumWeights) {
            true => momentum_rows(training, &rows, robot),
            false => DMatrix::identity(STATE_DIM, STATE_DIM).select_columns(&rows),
        };
        let mut held: Vec<DVector<f64>> =
            momentum.column_iter().map(|row| row.into_owned()).collect();
        let mut legs = Vec::new();
        let stands = options.has(RecipePart::LegRows) && !training.walks();
        if stands && has_leg_rows(body, latent_dim) {
            for (row, leg) in leg_rows(training, &momentum, options, robot) {
                held.push(row);
                legs.push(leg);
            }
        }
        let others: &[usize] = match (rows.is_empty(), spatial) {
            (true, _) => &[BODY_X, BODY_Z, PITCH],
            (false, false) => &[PITCH],
            (false, true) => &[PITCH, BODY_X + 1, BODY_X + 3, BODY_X + 5],
        };
        let others = others
            .iter()
            .filter(|i| !rows.contains(i) && active.contains(i));
        let mut free: Vec<_> = others.map(|&i| unit(i)).collect();
        let paired = match spatial {
            true => paired_joints(training, active),
            false => None,
        };
        match paired.filter(|paired| rows.len() + legs.len() + paired.len() >= latent_dim) {
            Some(paired) => free.extend(paired),
            None => {
                free.extend(joints_of_pairs(active, robot, 1.0));
                if spatial {
                    free.extend(joints_of_pairs(active, robot, -1.0));
                }
            }
        }
        let free = DMatrix::from_fn(STATE_DIM, free.len(), |row, k| free[k][row]);
        Self {
            free: without(free, &held[rows.len()..]),
            held: DMatrix::from_fn(STATE_DIM, held.len(), |row, k| held[k][row]),
            body: rows,
            legs,
        }
    }

    /// Number of latent coordinates, of `latent_dim`, by which predictions of whole jumps are judged. For the whole
    /// body it is the first two, the centre of mass, because errors of rotation and legs grow with small differences at
    /// take-off.
    pub(super) fn judged_over_jumps(&self, latent_dim: usize) -> usize {
        if self.legs.is_empty() && !self.is_spatial() {
            latent_dim
        } else {
            TURN
        }
    }

    /// Number of momentum rows with their own equations for deviations from the mean jump: all if the rotation is one
    /// of them. Without it their equations lack the effect of pitch, of which regressions find a part.
    pub(super) fn known_in_deviations(&self) -> usize {
        if self.body.contains(&PITCH) {
            self.body.len()
        } else {
            0
        }
    }

    /// Whether a momentum row changes sign in a mirror image.
    pub(super) fn is_spatial(&self) -> bool {
        self.body.iter().copied().any(is_lateral)
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

/// The mirror image of state rows in columns, `18 x n`.
fn image(rows: &DMatrix<f64>, robot: &Robot) -> DMatrix<f64> {
    let from = |i: usize| robot.mirrored(i);
    DMatrix::from_fn(rows.nrows(), rows.ncols(), |i, k| {
        let (from, sign) = from(i);
        rows[(from, k)] * sign
    })
}

/// A basis of the span of orthonormal columns in two parts: symmetric rows, which a mirror leaves unchanged, and
/// antisymmetric rows, whose sign it changes. It spans the columns only as far as the mirror maps their span to itself.
pub(super) fn symmetry_classes(basis: &DMatrix<f64>, robot: &Robot) -> [DMatrix<f64>; 2] {
    let eigen = basis.tr_mul(&image(basis, robot)).symmetric_eigen();
    [1.0, -1.0].map(|parity| {
        let own = (0..basis.ncols()).filter(|&k| (eigen.eigenvalues[k] > 0.0) == (parity > 0.0));
        let rows = basis * (eigen.eigenvectors).select_columns(&own.collect::<Vec<_>>());
        let mut pure = (&rows + image(&rows, robot) * parity) * 0.5;
        for mut row in pure.column_iter_mut() {
            row.normalize_mut();
        }
        pure
    })
}

/// 1 for each row of an encoder that a mirror leaves alone, -1 for others.
pub(super) fn parities(weights: &DMatrix<f64>, robot: &Robot) -> Vec<f64> {
    let rows = weights.transpose();
    let images = image(&rows, robot);
    let each = rows.column_iter().zip(images.column_iter());
    each.map(|(row, image)| row.dot(&image).signum()).collect()
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

/// Whether the rows of the legs are among those that are held, as far as the recordings identify them.
pub(super) fn has_leg_rows(body: &BodyRows, latent_dim: usize) -> bool {
    body.coordinates.contains(&PITCH) && latent_dim >= body.coordinates.len() + LEG_ROWS
}

/// Orthonormal directions of the pairs of a left and a right joint with one among `active`. With `parity` 1 a mirror
/// leaves them unchanged, with -1 it changes their sign.
pub(super) fn joints_of_pairs(active: &[usize], robot: &Robot, parity: f64) -> Vec<DVector<f64>> {
    let joints = PAIRS
        .into_iter()
        .flat_map(|legs| (0..LEG_JOINT_DIM).map(move |joint| (legs, joint)));
    let is_active = |&(legs, joint): &([Leg; 2], usize)| {
        legs.iter()
            .any(|&leg| active.contains(&joint_of(leg, joint)))
    };
    let direction = |(legs, joint)| mirrored(legs, joint, robot, parity) * std::f64::consts::SQRT_2;
    joints.filter(is_active).map(direction).collect()
}

/// The mean (`parity` 1) of a joint of two legs that mirror each other, or half their difference (-1).
fn mirrored([right, left]: [Leg; 2], joint: usize, robot: &Robot, parity: f64) -> DVector<f64> {
    let [right, left] = [joint_of(right, joint), joint_of(left, joint)];
    (unit(right) + unit(left) * (parity * robot.mirror_sign(left))) * 0.5
}

pub(super) fn joint_of(leg: Leg, joint: usize) -> usize {
    LEG_JOINT_DIM * leg.index() + joint
}

/// Rows of the legs as columns, forwards and upwards of the front pair, then of the rear pair; none if a pair has fewer
/// than [`LEAST_STANDING`] samples of stance. While a pair stands, `x + arm pitch + w^T q` over its flexions and knees
/// `q` is constant, and so is the same sum with `z`. Ridge regression of the deviations from the mean of each stance
/// gives `arm` and `w`. A row is this sum less the momentum rows, with weights of the abductions.
fn leg_rows(
    training: &Dataset,
    momentum: &DMatrix<f64>,
    options: &RegressionOptions,
    robot: &Robot,
) -> Vec<(DVector<f64>, LegRow)> {
    let settling_s = match options.has(RecipePart::Settling) {
        true => SETTLING_S,
        false => 0.0,
    };
    let mut rows = Vec::new();
    for legs in PAIRS {
        let [_, flexion, knee] = std::array::from_fn(|joint| mirrored(legs, joint, robot, 1.0));
        let stances = stances(training, legs, settling_s);
        if stances.iter().map(|(_, range)| range.len()).sum::<usize>() < LEAST_STANDING {
            return Vec::new();
        }
        let moving = DMatrix::from_columns(&[unit(PITCH), flexion.clone(), knee.clone()]);
        let deviations = deviations(training, &stances);
        for (body, row) in [BODY_X, BODY_Z].into_iter().enumerate() {
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
    if options.has(RecipePart::Abductions) {
        add_abductions(training, momentum, &mut rows, robot);
    }
    rows
}

/// Spans in which both feet of a pair are down, without `settling_s` after a touchdown.
fn stances(training: &Dataset, legs: [Leg; 2], settling_s: f64) -> Vec<(usize, Range<usize>)> {
    let mut all = Vec::new();
    for (index, jump) in training.jumps.iter().enumerate() {
        let stands = |sample: usize| legs.iter().all(|leg| jump.feet[sample][leg.index()]);
        let spans = stretches(0..jump.samples(), |a, b| stands(a) == stands(b)).into_iter();
        for span in spans.filter(|span| stands(span.start)) {
            let settled_s = match span.start {
                0 => f64::NEG_INFINITY,
                touchdown => jump.time_s[touchdown] + settling_s,
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

/// Sets the weights of the abductions in each pair's rows, with which the lift `W_e^T u_lat` returns their torques
/// best. The weights come from a regression on `u_lat = pinv(W_e^T) u`, which depends on them: it is repeated
/// [`ABDUCTION_ROUNDS`] times.
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
            let abduction = mirrored(PAIRS[pair], 0, robot, 1.0);
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

pub(super) fn unit(index: usize) -> DVector<f64> {
    DVector::from_fn(STATE_DIM, |i, _| if i == index { 1.0 } else { 0.0 })
}

#[cfg(test)]
#[path = "../../../tests/units/learn_train_frame.rs"]
mod tests;
