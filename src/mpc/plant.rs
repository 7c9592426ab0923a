//! The numbers of one model on one robot, in SI units on the robot's side.
//!
//! Everything the controller needs besides the latent dynamics: the affine maps with their scale
//! factors multiplied in, limits, and for each phase the distribution of the training inputs.

use nalgebra::{Cholesky, DMatrix, DVector, SMatrix, SVector};

use super::error::MpcError;
use crate::model::ReducedModel;
use crate::robot::{ContactFlags, JOINT_DIM, Robot, STATE_DIM};

/// Share of the mean variance that is added to every variance, so that a direction in which the
/// training inputs never moved has a finite weight.
const VARIANCE_FLOOR: f64 = 1e-6;

/// Maps, limits and input statistics of a model on its robot.
#[derive(Debug, Clone)]
pub struct Plant {
    robot: &'static Robot,
    latent_dim: usize,
    encoder: DMatrix<f64>,
    encoder_bias: DVector<f64>,
    decoder: DMatrix<f64>,
    decoder_bias: DVector<f64>,
    lift: DMatrix<f64>,
    projection: DMatrix<f64>,
    phases: Vec<PlantPhase>,
    phase_of_feet: [Option<usize>; 16],
}

/// What the training inputs of one phase looked like.
#[derive(Debug, Clone)]
pub struct PlantPhase {
    /// Name of the phase.
    pub name: String,
    /// Whether it has feet on the ground: another phase, or none, is selected by no foot.
    pub is_grounded: bool,
    /// Mean latent input, `latent_dim`.
    pub latent_mean: DVector<f64>,
    /// Lower Cholesky factor of the latent input's covariance, `latent_dim` square.
    pub latent_root: DMatrix<f64>,
    /// Mean torques, N m.
    pub torque_mean: SVector<f64, JOINT_DIM>,
    /// Inverse covariance of the torques, 1/(N m)².
    pub torque_precision: SMatrix<f64, JOINT_DIM, JOINT_DIM>,
}

impl Plant {
    /// Reads off a model what the controller needs.
    ///
    /// # Errors
    /// [`MpcError::Model`] if the model has no encoder, decoder, scaling, robot or input
    /// statistics, [`MpcError::StateDim`] if it is not over the robot's 18 coordinates, and
    /// [`MpcError::Statistics`] if a covariance cannot be factorised.
    pub fn new(model: &ReducedModel) -> Result<Self, MpcError> {
        let robot = model.robot()?;
        let (encoder, decoder) = (model.encoder()?, model.decoder()?);
        if encoder.input_dim() != STATE_DIM {
            return Err(MpcError::StateDim {
                found: encoder.input_dim(),
                expected: STATE_DIM,
            });
        }
        let state_factors = model.state_factors()?;
        let input_factors = model.input_factors()?;
        let scaled_columns = |matrix: &DMatrix<f64>, factors: &DVector<f64>| {
            DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |row, col| {
                matrix[(row, col)] * factors[col]
            })
        };
        let scaled_rows = |matrix: &DMatrix<f64>, factors: &DVector<f64>| {
            DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |row, col| {
                matrix[(row, col)] / factors[row]
            })
        };
        let mut phases = Vec::with_capacity(model.phases().len());
        for phase in 0..model.phases().len() {
            phases.push(PlantPhase::new(model, phase)?);
        }
        Ok(Self {
            robot,
            latent_dim: model.latent_dim(),
            encoder: scaled_columns(encoder.weights(), &state_factors),
            encoder_bias: encoder.bias().clone(),
            decoder: scaled_rows(decoder.weights(), &state_factors),
            decoder_bias: decoder.bias().component_div(&state_factors),
            lift: scaled_rows(&encoder.weights().transpose(), &input_factors),
            projection: scaled_columns(model.input_projection()?, &input_factors),
            phases,
            phase_of_feet: std::array::from_fn(|bits| model.phase_for(pattern(bits))),
        })
    }

    /// The robot.
    pub fn robot(&self) -> &'static Robot {
        self.robot
    }

    /// Number of latent coordinates.
    pub fn latent_dim(&self) -> usize {
        self.latent_dim
    }

    /// All phases, in the model's order.
    pub fn phases(&self) -> &[PlantPhase] {
        &self.phases
    }

    /// The phase that a foot pattern selects, or none.
    pub fn phase_for(&self, feet: ContactFlags) -> Option<usize> {
        let bits = feet
            .iter()
            .enumerate()
            .map(|(foot, &down)| usize::from(down) << foot)
            .sum::<usize>();
        self.phase_of_feet[bits]
    }

    /// `z = W_e s_x x + b_e`; `x` in SI units (18), `z` is overwritten.
    pub fn encode(&self, x: &[f64], z: &mut [f64]) {
        z.copy_from_slice(self.encoder_bias.as_slice());
        add_product(&self.encoder, x, z);
    }

    /// `dz = W_e s_x dx`; `dx` in SI units (18), `dz` is overwritten.
    pub fn encode_velocity(&self, dx: &[f64], dz: &mut [f64]) {
        dz.fill(0.0);
        add_product(&self.encoder, dx, dz);
    }

    /// Joint positions, rad, that the decoder gives for `z`.
    pub fn decode_joints(&self, z: &[f64]) -> [f64; JOINT_DIM] {
        std::array::from_fn(|joint| self.decoder_bias[joint] + row_product(&self.decoder, joint, z))
    }

    /// Joint velocities, rad/s, that the decoder gives for `dz`.
    pub fn decode_joint_velocities(&self, dz: &[f64]) -> [f64; JOINT_DIM] {
        std::array::from_fn(|joint| row_product(&self.decoder, joint, dz))
    }

    /// `u_lat = pinv(W_eᵀ) s_u u`; `u` in SI units (18), `u_lat` is overwritten.
    pub fn project(&self, u: &[f64], u_lat: &mut [f64]) {
        u_lat.fill(0.0);
        add_product(&self.projection, u, u_lat);
    }

    /// `u = W_eᵀ u_lat / s_u` in SI units: 12 torques, force, moment.
    pub fn lift(&self, u_lat: &[f64]) -> [f64; STATE_DIM] {
        std::array::from_fn(|input| row_product(&self.lift, input, u_lat))
    }

    /// The matrix of [`Plant::lift`], `18 × latent_dim`.
    pub fn lift_matrix(&self) -> &DMatrix<f64> {
        &self.lift
    }

    /// The matrix of [`Plant::project`], `latent_dim × 18`.
    pub fn projection_matrix(&self) -> &DMatrix<f64> {
        &self.projection
    }

    /// The matrix of the decoder in SI units, `18 × latent_dim`.
    pub fn decoder_matrix(&self) -> &DMatrix<f64> {
        &self.decoder
    }

    /// The bias of the decoder in SI units, 18.
    pub fn decoder_bias(&self) -> &DVector<f64> {
        &self.decoder_bias
    }

    /// The torques within the robot's limits that are nearest to these; zero for what is not a
    /// number.
    pub fn clamp_torque(&self, torque_nm: [f64; JOINT_DIM]) -> [f64; JOINT_DIM] {
        std::array::from_fn(|joint| {
            let limit = self.robot.torque_limit_nm()[joint];
            if torque_nm[joint].is_nan() {
                0.0
            } else {
                torque_nm[joint].clamp(-limit, limit)
            }
        })
    }

    /// The joint positions within the robot's limits that are nearest to these.
    pub fn clamp_joints(&self, joints_rad: [f64; JOINT_DIM]) -> [f64; JOINT_DIM] {
        std::array::from_fn(|joint| {
            let (lower, upper) = self.robot.joint_limit_rad()[joint];
            joints_rad[joint].clamp(lower, upper)
        })
    }
}

impl PlantPhase {
    fn new(model: &ReducedModel, phase: usize) -> Result<Self, MpcError> {
        let name = model.phases()[phase].name.clone();
        let latent = model.latent_input_statistics(phase)?;
        let input = model.input_statistics(phase)?;
        let unusable = || MpcError::Statistics {
            phase: name.clone(),
        };
        let latent_root = Cholesky::new(with_floor(latent.covariance))
            .ok_or_else(unusable)?
            .unpack();
        let torque_covariance = with_floor(
            input
                .covariance
                .view((0, 0), (JOINT_DIM, JOINT_DIM))
                .into_owned(),
        );
        let torque_precision = Cholesky::new(torque_covariance)
            .ok_or_else(unusable)?
            .inverse();
        Ok(Self {
            is_grounded: model.phase_for([false; 4]) != Some(phase),
            torque_mean: SVector::from_fn(|joint, _| input.mean[joint]),
            torque_precision: SMatrix::from_fn(|row, col| torque_precision[(row, col)]),
            latent_mean: latent.mean,
            latent_root,
            name,
        })
    }
}

fn with_floor(mut covariance: DMatrix<f64>) -> DMatrix<f64> {
    let dim = covariance.nrows();
    let mean_variance = covariance.trace() / dim as f64;
    let floor = if mean_variance > 0.0 {
        VARIANCE_FLOOR * mean_variance
    } else {
        VARIANCE_FLOOR
    };
    for index in 0..dim {
        covariance[(index, index)] += floor;
    }
    covariance
}

fn pattern(bits: usize) -> ContactFlags {
    std::array::from_fn(|foot| bits >> foot & 1 == 1)
}

/// `out += M v`, without allocating.
pub(super) fn add_product(matrix: &DMatrix<f64>, vector: &[f64], out: &mut [f64]) {
    for (col, factor) in vector.iter().enumerate() {
        for (out, entry) in out.iter_mut().zip(matrix.column(col).iter()) {
            *out += entry * factor;
        }
    }
}

/// Row `row` of `M v`.
fn row_product(matrix: &DMatrix<f64>, row: usize, vector: &[f64]) -> f64 {
    vector
        .iter()
        .enumerate()
        .map(|(col, factor)| matrix[(row, col)] * factor)
        .sum()
}
