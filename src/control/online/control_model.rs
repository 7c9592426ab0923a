//! The parameters of one model on one robot that the controller needs in addition to the latent dynamics.

use std::fmt::Debug;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector, SMatrix, SVector};

use super::dense::{Real, greater, smaller};
use super::error::ControlError;
use super::estimate::InputGivenState;
use crate::robot::{ContactFlags, InputRule, JOINT_DIM, Robot, STATE_DIM, joint_loss};

/// Maps, limits and input statistics of a model on its robot, scale factors multiplied in: SI units on its side.
#[derive(Debug, Clone)]
pub struct ControlModel {
    /// The robot, the losses of its joints, and the axes of force and moment.
    pub input_rule: InputRule,
    /// `W_e s_x`, `latent_dim × 18`.
    pub encoder: DMatrix<f64>,
    /// `b_e`, `latent_dim`.
    pub encoder_bias: DVector<f64>,
    /// `W_d / s_x`, `18 × latent_dim`.
    pub decoder: DMatrix<f64>,
    /// `b_d / s_x`, 18.
    pub decoder_bias: DVector<f64>,
    /// `W_eᵀ / s_u`, `18 × latent_dim`.
    pub lift: DMatrix<f64>,
    /// `pinv(W_eᵀ) s_u`, `latent_dim × 18`.
    pub projection: DMatrix<f64>,
    /// The model's phases, in its order.
    pub phases: Vec<ControlPhase>,
    /// The phase that each foot pattern selects, bit `k` of the position for foot `k`.
    pub phase_of_feet: [Option<usize>; 16],
    /// The maps of which the matrices are those at one state, if they are not the same at all.
    pub nonlinear: Option<Arc<dyn NonlinearMaps>>,
}

/// Statistics of the training inputs of one phase.
#[derive(Debug, Clone)]
pub struct ControlPhase {
    /// Name of the phase.
    pub name: String,
    /// Whether it has feet on the ground: another phase, or none, is selected by no foot.
    pub is_grounded: bool,
    /// Mean latent input, `latent_dim`.
    pub latent_mean: DVector<f64>,
    /// Lower Cholesky factor of the latent input's covariance, `latent_dim` square.
    pub latent_root: DMatrix<f64>,
    /// Distribution of the latent input given the latent state, if the model has one.
    pub given_state: Option<InputGivenState>,
    /// Mean torques, N m.
    pub torque_mean: SVector<f64, JOINT_DIM>,
    /// Inverse covariance of the torques, 1/(N m)².
    pub torque_precision: SMatrix<f64, JOINT_DIM, JOINT_DIM>,
}

/// A nonlinear encoder and decoder with their Jacobians, in SI units on the robot's side. The matrices of a
/// [`ControlModel`] are then those at one state, and `ControlModel::tangent_at` gives the plant of another.
pub trait NonlinearMaps: Debug + Send + Sync {
    /// Writes `z = E(s_x x)`.
    fn encode(&self, x: &[f64], z: &mut [f64]);

    /// `x = D(z) / s_x`.
    fn decode(&self, z: &[f64]) -> [f64; STATE_DIM];

    /// `J_E s_x` at `x`, `latent_dim × 18`.
    fn encoder_jacobian(&self, x: &[f64]) -> DMatrix<f64>;

    /// `J_D / s_x` at `z`, `18 × latent_dim`.
    fn decoder_jacobian(&self, z: &[f64]) -> DMatrix<f64>;

    /// Lift `J_Eᵀ / s_u` (`18 × latent_dim`) and projection `pinv(J_Eᵀ) s_u` at `x`; none without full row rank.
    fn inputs(&self, x: &[f64]) -> Option<[DMatrix<f64>; 2]>;

    /// The phases with the statistics of the training inputs projected at `x`; none as for [`NonlinearMaps::inputs`].
    fn phases(&self, x: &[f64]) -> Option<Vec<ControlPhase>>;
}

impl ControlModel {
    pub(crate) fn is_nonlinear(&self) -> bool {
        self.nonlinear.is_some()
    }

    /// The plant of the maps' tangents at `x` (18, SI units) and `z`; none for affine maps or without full row rank.
    pub(super) fn tangent_at(&self, x: &[f64], z: &[f64]) -> Option<Self> {
        let maps = self.nonlinear.as_ref()?;
        let (encoder, decoder) = (maps.encoder_jacobian(x), maps.decoder_jacobian(z));
        let mut value = vec![0.0; self.latent_dim()];
        maps.encode(x, &mut value);
        let encoder_bias = DVector::from_vec(value) - &encoder * DVector::from_column_slice(x);
        let decoded = DVector::from_column_slice(&maps.decode(z));
        let decoder_bias = decoded - &decoder * DVector::from_column_slice(z);
        let [lift, projection] = maps.inputs(x)?;
        Some(Self {
            encoder,
            encoder_bias,
            decoder,
            decoder_bias,
            lift,
            projection,
            nonlinear: None,
            ..self.clone()
        })
    }

    /// Replaces the phases' statistics by those of the training inputs projected at `x`, if the maps depend on `x` and
    /// have full rank there.
    pub(super) fn take_statistics_at(&mut self, x: &[f64]) {
        if let Some(phases) = self.nonlinear.as_ref().and_then(|maps| maps.phases(x)) {
            self.phases = phases;
        }
    }

    /// How torques become inputs of the model: commands are made by its inverse.
    pub fn input_rule(&self) -> &InputRule {
        &self.input_rule
    }

    /// The robot.
    pub fn robot(&self) -> &'static Robot {
        self.input_rule.robot()
    }

    /// Number of latent coordinates.
    pub fn latent_dim(&self) -> usize {
        self.encoder.nrows()
    }

    /// All phases, in the model's order.
    pub fn phases(&self) -> &[ControlPhase] {
        &self.phases
    }

    /// The phase that a foot pattern selects, or none.
    pub fn phase_for(&self, feet: ContactFlags) -> Option<usize> {
        let bits = feet.iter().enumerate();
        let bits = bits.map(|(foot, &down)| usize::from(down) << foot);
        self.phase_of_feet[bits.sum::<usize>()]
    }

    /// `z = W_e s_x x + b_e`, or the nonlinear encoder's; `x` in SI units (18), `z` is overwritten.
    pub fn encode(&self, x: &[f64], z: &mut [f64]) {
        if let Some(maps) = &self.nonlinear {
            return maps.encode(x, z);
        }
        z.copy_from_slice(self.encoder_bias.as_slice());
        add_product(&self.encoder, x, z);
    }

    /// `dz = J_E s_x dx` with the encoder's Jacobian at `x`; SI units (18), `dz` is overwritten.
    pub(crate) fn encode_velocity(&self, x: &[f64], dx: &[f64], dz: &mut [f64]) {
        dz.fill(0.0);
        match &self.nonlinear {
            None => add_product(&self.encoder, dx, dz),
            Some(maps) => add_product(&maps.encoder_jacobian(x), dx, dz),
        }
    }

    /// The robot's state, rad and m, of latent positions.
    fn decode(&self, z: &[f64]) -> [f64; STATE_DIM] {
        if let Some(maps) = &self.nonlinear {
            return maps.decode(z);
        }
        std::array::from_fn(|i| self.decoder_bias[i] + row_product(&self.decoder, i, z))
    }

    pub(crate) fn decode_joints(&self, z: &[f64]) -> [f64; JOINT_DIM] {
        let x = self.decode(z);
        std::array::from_fn(|joint| x[joint])
    }

    /// Joint velocities, rad/s, for `dz` with the decoder's Jacobian at `z`.
    pub fn decode_joint_velocities(&self, z: &[f64], dz: &[f64]) -> [f64; JOINT_DIM] {
        let dx = self.decode_velocities(z, dz);
        std::array::from_fn(|joint| dx[joint])
    }

    /// Velocities of the robot's coordinates, rad/s and m/s.
    fn decode_velocities(&self, z: &[f64], dz: &[f64]) -> [f64; STATE_DIM] {
        let local = self.nonlinear.as_ref().map(|maps| maps.decoder_jacobian(z));
        let decoder = local.as_ref().unwrap_or(&self.decoder);
        std::array::from_fn(|i| row_product(decoder, i, dz))
    }

    /// The feet that are on the ground in a phase, in one of its patterns at least.
    pub fn feet_of_phase(&self, phase: usize) -> ContactFlags {
        let own =
            (0..self.phase_of_feet.len()).filter(|bits| self.phase_of_feet[*bits] == Some(phase));
        let bits = own.fold(0, |all, bits| all | bits);
        std::array::from_fn(|foot| bits >> foot & 1 == 1)
    }

    /// The part of the motors' torques that does not enter the input, N m, over a time `step_s` of a phase. `start` and
    /// `end` are latent states `(z, dz)`. The part has two summands, by the rule of the inputs:
    /// - the losses of the joints, at most the torque limit, at the mean decoded velocities and with their difference
    ///   as acceleration;
    /// - the torques that carry and move the links of legs with their `feet` on the ground, at the middle state.
    ///
    /// Zero without actuators.
    pub fn planned_losses(
        &self,
        (phase, feet): (usize, ContactFlags),
        [start, end]: [&[f64]; 2],
        step_s: f64,
    ) -> [f64; JOINT_DIM] {
        if self.input_rule.actuators().is_none() {
            return [0.0; JOINT_DIM];
        }
        let [before, after] = [start, end].map(|state| {
            let (z, dz) = state.split_at(self.latent_dim());
            self.decode_velocities(z, dz)
        });
        let middle = (0..self.latent_dim()).map(|i| 0.5 * (start[i] + end[i]));
        let x = self.decode(&middle.collect::<Vec<f64>>());
        self.losses_between((phase, feet), &x, [&before, &after], step_s)
    }

    /// The same at a state of the robot, between two of its rates.
    pub(super) fn losses_between(
        &self,
        (phase, feet): (usize, ContactFlags),
        x: &[f64; STATE_DIM],
        [before, after]: [&[f64; STATE_DIM]; 2],
        step_s: f64,
    ) -> [f64; JOINT_DIM] {
        let Some(actuators) = self.input_rule.actuators() else {
            return [0.0; JOINT_DIM];
        };
        let is_grounded = self.phases[phase].is_grounded;
        let limit = self.robot().torque_limit_nm();
        let armature = if self.input_rule.inertia_is_loss(is_grounded) {
            actuators.armature
        } else {
            [0.0; JOINT_DIM]
        };
        let of = |joint: usize| [actuators.viscous, actuators.dry, armature].map(|of| of[joint]);
        let mut losses =
            std::array::from_fn(|i| planned_loss(&of(i), before[i], after[i], step_s, limit[i]));
        if is_grounded && self.input_rule.legs().is_some() {
            let dx = std::array::from_fn(|i| 0.5 * (before[i] + after[i]));
            let ddx = std::array::from_fn(|i| (after[i] - before[i]) / step_s);
            let own = self.input_rule.leg_torques([x, &dx, &ddx], feet);
            losses
                .iter_mut()
                .zip(own)
                .for_each(|(loss, own)| *loss += own);
        }
        losses
    }

    /// `u_lat = pinv(J_Eᵀ) s_u u` with the encoder's Jacobian at `x` if it is nonlinear and has full row rank there,
    /// else with the plant's own; SI units (18), `u_lat` is overwritten.
    pub fn project(&self, x: &[f64], u: &[f64], u_lat: &mut [f64]) {
        u_lat.fill(0.0);
        let local = self.nonlinear.as_ref().and_then(|maps| maps.inputs(x));
        let projection = local.as_ref().map_or(&self.projection, |[_, local]| local);
        add_product(projection, u, u_lat);
    }

    /// `u = W_eᵀ u_lat / s_u` in SI units: 12 torques, force, moment.
    pub fn lift(&self, u_lat: &[f64]) -> [f64; STATE_DIM] {
        std::array::from_fn(|input| row_product(&self.lift, input, u_lat))
    }

    /// The nearest torques within the robot's limits; zero for NaN.
    pub fn clamp_torque(&self, torque_nm: [f64; JOINT_DIM]) -> [f64; JOINT_DIM] {
        let limits = self.robot().torque_limit_nm();
        std::array::from_fn(|joint| clamped_torque(torque_nm[joint], limits[joint]))
    }

    /// Lower and upper limits of the joints, rad.
    pub fn joint_limits(&self) -> [[f64; JOINT_DIM]; 2] {
        let limits = self.robot().joint_limit_rad();
        [limits.map(|limit| limit.0), limits.map(|limit| limit.1)]
    }
}

/// The nearest torque within a limit; zero for NaN.
pub(super) fn clamped_torque(torque: Real, limit: Real) -> Real {
    if torque >= -limit {
        if torque > limit { limit } else { torque }
    } else if torque < 0.0 {
        -limit
    } else {
        0.0
    }
}

/// The nearest position within the limits; the lower limit for NaN.
pub(super) fn clamped_joint(position: Real, lower: Real, upper: Real) -> Real {
    smaller(greater(position, lower), upper)
}

/// Loss of a joint, N m, over a time between two velocities: at their mean, with their difference as acceleration. At
/// most the limit.
fn planned_loss(of: &[Real; 3], before: Real, after: Real, step_s: Real, limit: Real) -> Real {
    let dq = 0.5 * (before + after);
    let ddq = (after - before) / step_s;
    clamped_torque(joint_loss(of, dq, ddq), limit)
}

/// The largest violation of a limit by joint positions, in half ranges, or `largest` if that is more.
pub(super) fn violation(q: &[Real], lower: &[Real], upper: &[Real], mut largest: Real) -> Real {
    for i in 0..12 {
        let outside = greater(q[i] - upper[i], lower[i] - q[i]);
        largest = greater(outside / (0.5 * (upper[i] - lower[i])), largest);
    }
    largest
}

/// `out += M v`, without allocating.
pub(super) fn add_product(matrix: &DMatrix<f64>, vector: &[f64], out: &mut [f64]) {
    for (col, factor) in vector.iter().enumerate() {
        for (out, entry) in out.iter_mut().zip(matrix.column(col).iter()) {
            *out += entry * factor;
        }
    }
}

fn row_product(matrix: &DMatrix<f64>, row: usize, vector: &[f64]) -> f64 {
    let terms = vector.iter().enumerate();
    terms.map(|(col, factor)| matrix[(row, col)] * factor).sum()
}

impl ControlModel {
    /// The same, or [`ControlError::Shape`] if a map or a phase's statistics do not fit the encoder's number of rows.
    pub fn checked(self) -> Result<Self, ControlError> {
        let d = self.encoder.nrows();
        let mut shapes = vec![
            ("encoder", self.encoder.shape(), (d, STATE_DIM)),
            ("encoder bias", self.encoder_bias.shape(), (d, 1)),
            ("decoder", self.decoder.shape(), (STATE_DIM, d)),
            ("decoder bias", self.decoder_bias.shape(), (STATE_DIM, 1)),
            ("lift", self.lift.shape(), (STATE_DIM, d)),
            ("projection", self.projection.shape(), (d, STATE_DIM)),
        ];
        for phase in &self.phases {
            shapes.push(("latent mean", phase.latent_mean.shape(), (d, 1)));
            shapes.push(("latent root", phase.latent_root.shape(), (d, d)));
            if let Some(given) = &phase.given_state {
                let (covariance, error) = (&given.covariance, &given.acceleration_error);
                shapes.push(("input given state", given.mean.shape(), (d, 1 + 2 * d)));
                shapes.push(("its covariance", covariance.shape(), (d, d)));
                shapes.push(("acceleration error", error.shape(), (d, d)));
            }
        }
        for phase in self.phase_of_feet.into_iter().flatten() {
            let known = self.phases.len().min(phase + 1);
            shapes.push(("phases", (known, 1), (phase + 1, 1)));
        }
        let mut shapes = shapes.into_iter();
        match shapes.find(|(_, found, expected)| found != expected) {
            None => Ok(self),
            Some((name, found, expected)) => Err(ControlError::Shape {
                name,
                found,
                expected,
            }),
        }
    }
}
