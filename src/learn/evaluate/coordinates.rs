//! Root mean square and R^2 of one number, of the robot's coordinates in SI units, and of torques.

use super::*;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    pub rms: f64,
    /// `1 - sum (y - y_hat)^2 / sum (y - mean y)^2`; `None` when the record does not move.
    pub r2: Option<f64>,
}

#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FitSums {
    pub(super) count: usize,
    residual_square: f64,
    mean: f64,
    deviation_square: f64,
}

impl FitSums {
    /// Adds one pair of a recorded and a predicted value (the mean is updated as by Welford, 1962).
    pub fn add(&mut self, recorded: f64, predicted: f64) {
        self.count += 1;
        self.residual_square += (recorded - predicted).powi(2);
        let from_old_mean = recorded - self.mean;
        self.mean += from_old_mean / self.count as f64;
        self.deviation_square += from_old_mean * (recorded - self.mean);
    }

    /// Adds the pairs of `other`; differences between the means of the two do not count as explained.
    pub(crate) fn merge_keeping_means(&mut self, other: &Self) {
        self.count += other.count;
        self.residual_square += other.residual_square;
        self.deviation_square += other.deviation_square;
    }

    pub(crate) fn jointly(parts: &[Self]) -> Self {
        let mut total = Self::default();
        (parts.iter()).for_each(|part| total.merge_keeping_means(part));
        total
    }

    pub fn fit(&self) -> Option<Fit> {
        (self.count > 0).then(|| Fit {
            rms: (self.residual_square / self.count as f64).sqrt(),
            r2: (self.deviation_square > 0.0)
                .then(|| 1.0 - self.residual_square / self.deviation_square),
        })
    }

    pub(crate) fn r2(&self) -> Option<f64> {
        self.fit()?.r2
    }
}

#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Mean {
    sum: f64,
    count: usize,
}

impl Mean {
    pub(super) fn add(&mut self, value: f64) {
        self.sum += value;
        self.count += 1;
    }

    pub(super) fn get(&self) -> Option<f64> {
        (self.count > 0).then(|| self.sum / self.count as f64)
    }

    pub(super) fn root(&self) -> Option<f64> {
        self.get().map(f64::sqrt)
    }
}

/// Every sample of a rollout's windows, with the first of its window.
fn samples_of_windows(rollout: &Rollout) -> impl Iterator<Item = (usize, usize)> {
    let windows = rollout.windows.iter().map(|window| window.samples.clone());
    windows.flat_map(|samples| samples.clone().map(move |sample| (samples.start, sample)))
}

/// State at a sample if the robot kept its velocity from `start` on.
pub(super) fn coasted(segment: &Segment, start: usize, sample: usize) -> DVector<f64> {
    let elapsed_s = segment.time_s[sample] - segment.time_s[start];
    segment.x.column(start) + segment.dx.column(start) * elapsed_s
}

#[derive(Debug, Clone, PartialEq)]
pub struct CoordinateSums {
    sums: Vec<FitSums>,
    by_phase: Vec<Vec<FitSums>>,
    pub windows: usize,
    pub diverged: usize,
}

impl CoordinateSums {
    pub fn new(model: &ReducedModel) -> Result<Self, ModelError> {
        let state_dim = model.decoder_map()?.output_dim();
        Ok(Self {
            sums: vec![FitSums::default(); state_dim],
            by_phase: vec![vec![FitSums::default(); state_dim]; model.phases().len()],
            windows: 0,
            diverged: 0,
        })
    }

    /// The same with sums for `count` more quantities, see `add_pair`.
    pub(super) fn with_more(mut self, count: usize) -> Self {
        for sums in self.by_phase.iter_mut().chain([&mut self.sums]) {
            sums.resize(sums.len() + count, FitSums::default());
        }
        self
    }

    pub fn add_rollout(
        &mut self,
        model: &ReducedModel,
        segment: &Segment,
        latent: &LatentSegment,
        rollout: &Rollout,
    ) -> Result<(), ModelError> {
        for (sample, window, column) in rollout.predictions() {
            let x = model.decode(&window.z.column(column).into_owned())?;
            self.add(segment, sample, latent.phase[sample], &x);
        }
        self.windows += rollout.windows.len();
        self.diverged += (rollout.windows.iter())
            .filter(|window| window.diverged_at_s.is_some())
            .count();
        Ok(())
    }

    /// Adds residuals of the constant velocity at the start of each window of `rollout`, whether or not that diverges.
    pub(super) fn add_constant_velocity(
        &mut self,
        segment: &Segment,
        latent: &LatentSegment,
        rollout: &Rollout,
    ) {
        for (start, sample) in samples_of_windows(rollout) {
            let x = coasted(segment, start, sample);
            self.add(segment, sample, latent.phase[sample], &x);
        }
        self.windows += rollout.windows.len();
    }

    /// The same for latent coordinates with the velocity at the start of each window, decoded: maps without dynamics.
    pub(super) fn add_constant_latent_velocity(
        &mut self,
        model: &ReducedModel,
        segment: &Segment,
        latent: &LatentSegment,
        rollout: &Rollout,
    ) -> Result<(), ModelError> {
        for (start, sample) in samples_of_windows(rollout) {
            let passed_s = latent.time_s[sample] - latent.time_s[start];
            let z = latent.z.column(start) + latent.dz.column(start) * passed_s;
            self.add(segment, sample, latent.phase[sample], &model.decode(&z)?);
        }
        self.windows += rollout.windows.len();
        Ok(())
    }

    pub(super) fn add(&mut self, segment: &Segment, sample: usize, phase: usize, x: &DVector<f64>) {
        for (row, y_hat) in x.iter().enumerate() {
            self.add_one(segment, sample, phase, (row, *y_hat));
        }
    }

    /// Adds residuals of the encoded state decoded again, sample by sample.
    pub(super) fn add_decoded(
        &mut self,
        model: &ReducedModel,
        segment: &Segment,
        latent: &LatentSegment,
    ) -> Result<(), ModelError> {
        for (sample, z) in latent.z.column_iter().enumerate() {
            let x = model.decode(&z.into_owned())?;
            self.add(segment, sample, latent.phase[sample], &x);
        }
        Ok(())
    }

    pub(super) fn add_one(
        &mut self,
        segment: &Segment,
        sample: usize,
        phase: usize,
        (row, y_hat): (usize, f64),
    ) {
        self.add_pair(phase, row, [segment.x[(row, sample)], y_hat]);
    }

    /// Adds a recorded and a predicted value of one quantity.
    pub(super) fn add_pair(&mut self, phase: usize, row: usize, [recorded, predicted]: [f64; 2]) {
        self.sums[row].add(recorded, predicted);
        self.by_phase[phase][row].add(recorded, predicted);
    }

    pub fn fits(&self) -> Vec<Option<Fit>> {
        self.sums.iter().map(FitSums::fit).collect()
    }

    pub fn phase_fits(&self, phase: usize) -> Vec<Option<Fit>> {
        self.by_phase[phase].iter().map(FitSums::fit).collect()
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct PointwiseSums {
    /// Residuals of `decode(encode(x))`, all coordinates in scaled units (equation 16).
    pub decoder: FitSums,
    /// Residuals of predicted latent accelerations (equation 17), one a phase.
    pub acceleration: Vec<FitSums>,
}

impl PointwiseSums {
    pub fn new(model: &ReducedModel) -> Self {
        Self {
            decoder: FitSums::default(),
            acceleration: vec![FitSums::default(); model.phases().len()],
        }
    }

    pub fn add(
        &mut self,
        model: &ReducedModel,
        segment: &Segment,
        latent: &LatentSegment,
    ) -> Result<(), ModelError> {
        let factors = model.state_factors()?;
        let mut accelerations =
            vec![vec![FitSums::default(); model.latent_dim()]; self.acceleration.len()];
        for sample in 0..latent.time_s.len() {
            let column = |matrix: &nalgebra::DMatrix<f64>| matrix.column(sample).into_owned();
            let (x, z) = (column(&segment.x), column(&latent.z));
            let scaled = x.component_mul(&factors);
            let decoded = model.decode(&z)?.component_mul(&factors);
            for (&y, &y_hat) in scaled.iter().zip(&decoded) {
                self.decoder.add(y, y_hat);
            }
            let phase = latent.phase[sample];
            let ddz = model.ddz(phase, &z, &column(&latent.dz), &column(&latent.u_lat))?;
            for (output, sums) in accelerations[phase].iter_mut().enumerate() {
                sums.add(latent.ddz[(output, sample)], ddz[output]);
            }
        }
        for (total, outputs) in self.acceleration.iter_mut().zip(&accelerations) {
            (outputs.iter()).for_each(|sums| total.merge_keeping_means(sums));
        }
        Ok(())
    }
}

const IMPLAUSIBLE: f64 = 2.0;

/// Whether recorded torques can be the robot's; samples with others count in no figure of torques.
pub(crate) fn is_plausible(robot: &Robot, torque_nm: &[f64; JOINT_DIM]) -> bool {
    !exceeds(torque_nm, robot.torque_limit_nm(), IMPLAUSIBLE)
}

pub(super) fn exceeds(torques: &[f64; JOINT_DIM], limits: &[f64; JOINT_DIM], factor: f64) -> bool {
    let mut pairs = torques.iter().zip(limits);
    pairs.any(|(torque, limit)| torque.is_nan() || torque.abs() > factor * limit)
}

/// A figure for samples with and without ground contact; none where there were too few.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct ByContact {
    pub contact: Option<f64>,
    pub flight: Option<f64>,
}

type JointSums = [FitSums; JOINT_DIM];

#[derive(Debug, Clone, Default, PartialEq)]
pub struct Comparison {
    contact: JointSums,
    flight: JointSums,
    all: JointSums,
}

impl Comparison {
    pub(crate) fn add(
        &mut self,
        feet: ContactFlags,
        predicted: &[f64; JOINT_DIM],
        recorded: &[f64; JOINT_DIM],
    ) {
        let of_phase = match feet.contains(&true) {
            true => &mut self.contact,
            false => &mut self.flight,
        };
        for sums in [of_phase, &mut self.all] {
            for ((sums, recorded), predicted) in sums.iter_mut().zip(recorded).zip(predicted) {
                sums.add(*recorded, *predicted);
            }
        }
    }

    /// Over all joints, `1 − Σ_k Σ_j (τ_kj − τ̂_kj)² / Σ_k Σ_j (τ̂_kj − mean_j)²` with `τ̂` recorded.
    pub fn r2(&self) -> ByContact {
        ByContact {
            contact: FitSums::jointly(&self.contact).r2(),
            flight: FitSums::jointly(&self.flight).r2(),
        }
    }

    pub fn r2_all(&self) -> Option<f64> {
        FitSums::jointly(&self.all).r2()
    }

    pub(crate) fn rms(&self) -> Option<f64> {
        FitSums::jointly(&self.all).fit().map(|fit| fit.rms)
    }
}

const SMALL_FORCE_N: f64 = 1.0;

/// `u_lat = pinv(W_e^T) s_u u`, `u_lift = W_e^T u_lat / s_u` per sample, joint losses added to the lifted torques.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LiftSums {
    pub torque: Comparison,
    inconsistency: Mean,
}

impl LiftSums {
    /// Adds every sample of a segment whose torques can be the robot's.
    pub(super) fn add(&mut self, model: &ReducedModel, segment: &Segment) -> Result<(), SimError> {
        let robot = model.robot()?;
        let rule = model.input_rule()?;
        let input = segment.input(&rule)?;
        let losses = segment.losses(&rule);
        for sample in 0..segment.len() {
            if !is_plausible(robot, &segment.torque(sample)) {
                continue;
            }
            // Torques within the motors' limits.
            let torque = std::array::from_fn(|i| input[(i, sample)] + losses[(i, sample)]);
            let x = segment.x.column(sample).into_owned();
            let tangent = model.tangent(&x)?;
            let lifted = tangent.lift * (tangent.project * input.column(sample));
            let feet = segment.feet[sample];
            let of_joints = std::array::from_fn(|joint| lifted[joint] + losses[(joint, sample)]);
            self.torque.add(feet, &of_joints, &torque);
            if feet.contains(&true) {
                let torque = std::array::from_fn(|joint| lifted[joint]);
                let force = lifted.rows(JOINT_DIM, 6).into_owned();
                if let Ok(produced) = rule.input_wrench(&segment.state(sample), &torque, feet)
                    && force.norm() > SMALL_FORCE_N
                {
                    let off = (&force - produced).norm() / force.norm();
                    self.inconsistency.add(off);
                }
            }
        }
        Ok(())
    }

    /// Mean of `|F_lift - G tau_lift| / |F_lift|` over samples with a foot down.
    pub fn inconsistency(&self) -> Option<f64> {
        self.inconsistency.get()
    }
}

/// The published weight of complexity in the combined loss (29).
pub const LAMBDA: f64 = 0.001;

/// `L_mod = 2 E_dec + 2 lambda ln |Xi|` (equation 29); none for a model without terms.
pub fn combined_loss(decoder_mean_square: f64, active_terms: usize, lambda: f64) -> Option<f64> {
    let logarithm = (active_terms > 0).then(|| (active_terms as f64).ln())?;
    Some(2.0 * decoder_mean_square + 2.0 * lambda * logarithm)
}
