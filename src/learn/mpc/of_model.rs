//! The controller's numbers and programs from a [`ReducedModel`]: the one place where the two meet.

use std::path::PathBuf;
use std::sync::Arc;

use nalgebra::{Cholesky, DMatrix, DVector, SMatrix, SVector};
use thiserror::Error;

use super::*;
use crate::lower::{CompiledModel, LowerError};
use crate::model::{ModelError, ReducedModel};
use crate::recording::RecordingError;
use crate::robot::{JOINT_DIM, RobotError, STATE_DIM};

/// Share of a recording's sampling below which the controller's step is too short for it.
pub const STEP_SLACK: f64 = 0.99;

const VARIANCE_FLOOR: f64 = 1e-6; // share of the mean variance, for directions in which training inputs never moved

#[derive(Debug)]
struct ModelDynamics(CompiledModel);

impl LatentDynamics for ModelDynamics {
    fn accelerate(
        &mut self,
        phase: usize,
        z: &[f64],
        dz: &[f64],
        u: &[f64],
        ddz: &mut [f64],
        entries: &mut [f64],
    ) -> usize {
        self.0.accelerate(phase, z, dz, u, ddz, entries)
    }

    fn row(&self, phase: usize, entry: usize) -> usize {
        self.0.pattern(phase).rows[entry]
    }

    fn column(&self, phase: usize, entry: usize) -> usize {
        self.0.pattern(phase).cols[entry]
    }
}

/// # Errors
/// Those of [`control_model`], [`MpcError::Lower`], and [`MpcError::Control`] for settings or problems refused.
pub fn controller(model: &ReducedModel, settings: MpcSettings) -> Result<Controller, MpcError> {
    let plant = control_model(model)?;
    let dynamics = Box::new(ModelDynamics(CompiledModel::new(model)?));
    Ok(Controller::with_plant(plant, dynamics, settings)?)
}

/// Matrices of a nonlinear model are those at the state decoded from `z = 0` until a reference is set.
///
/// # Errors
/// [`MpcError::Model`] if the model has no encoder, decoder, scaling, robot or input statistics. [`MpcError::StateDim`]
/// if it is not over the robot's 18 coordinates. [`MpcError::Statistics`] if a covariance cannot be factorised.
pub fn control_model(model: &ReducedModel) -> Result<ControlModel, MpcError> {
    if !model.is_linear() {
        let stand = model.decode(&DVector::zeros(model.latent_dim()))?;
        let base = control_model(&model.linearised_at(&stand)?)?;
        return Ok(ControlModel {
            nonlinear: Some(Arc::new(ModelMaps(model.clone()))),
            ..base
        });
    }
    let input_rule = model.input_rule()?;
    let (encoder, decoder) = (model.encoder()?, model.decoder()?);
    if encoder.input_dim() != STATE_DIM {
        return Err(MpcError::StateDim {
            found: encoder.input_dim(),
            expected: STATE_DIM,
        });
    }
    let tangent = model.tangent(&DVector::zeros(STATE_DIM))?;
    let state_factors = model.state_factors()?;
    let plant = ControlModel {
        input_rule,
        encoder_bias: encoder.bias().clone(),
        decoder: model.decoder_jacobian(&DVector::zeros(model.latent_dim()))?,
        decoder_bias: decoder.bias().component_div(&state_factors),
        phases: phases_under(model, &tangent.project)?,
        encoder: tangent.encode,
        lift: tangent.lift,
        projection: tangent.project,
        phase_of_feet: std::array::from_fn(|bits| {
            model.phase_for(std::array::from_fn(|foot| bits >> foot & 1 == 1))
        }),
        nonlinear: None,
    };
    Ok(plant.checked()?)
}

#[derive(Debug)]
struct ModelMaps(ReducedModel);

const CHECKED: &str = "invariant: the plant was made of this model";

impl NonlinearMaps for ModelMaps {
    fn encode(&self, x: &[f64], z: &mut [f64]) {
        let encoded = self.0.encode(&vector(x)).expect(CHECKED);
        z.copy_from_slice(encoded.as_slice());
    }

    fn decode(&self, z: &[f64]) -> [f64; STATE_DIM] {
        let decoded = self.0.decode(&vector(z)).expect(CHECKED);
        std::array::from_fn(|i| decoded[i])
    }

    fn encoder_jacobian(&self, x: &[f64]) -> DMatrix<f64> {
        self.0.encoder_jacobian(&vector(x)).expect(CHECKED)
    }

    fn decoder_jacobian(&self, z: &[f64]) -> DMatrix<f64> {
        self.0.decoder_jacobian(&vector(z)).expect(CHECKED)
    }

    fn inputs(&self, x: &[f64]) -> Option<[DMatrix<f64>; 2]> {
        let tangent = self.0.tangent(&vector(x)).ok()?;
        Some([tangent.lift, tangent.project])
    }

    fn phases(&self, x: &[f64]) -> Option<Vec<ControlPhase>> {
        phases_under(&self.0, &self.inputs(x)?[1]).ok()
    }
}

fn vector(values: &[f64]) -> DVector<f64> {
    DVector::from_column_slice(values)
}

fn phases_under(
    model: &ReducedModel,
    projection: &DMatrix<f64>,
) -> Result<Vec<ControlPhase>, MpcError> {
    let phases = 0..model.phases().len();
    let phases = phases.map(|phase| phase_under(model, phase, projection));
    phases.collect()
}

fn phase_under(
    model: &ReducedModel,
    phase: usize,
    projection: &DMatrix<f64>,
) -> Result<ControlPhase, MpcError> {
    let name = model.phases()[phase].name.clone();
    let input = model.input_statistics(phase)?;
    let (latent_mean, latent_covariance) = input.projected(projection);
    let unusable = || MpcError::Statistics {
        phase: name.clone(),
    };
    let factor = |covariance| Cholesky::new(with_floor(covariance)).ok_or_else(unusable);
    let latent_root = factor(latent_covariance)?.unpack();
    let torques = input.covariance.view((0, 0), (JOINT_DIM, JOINT_DIM));
    let torque_precision = factor(torques.into_owned())?.inverse();
    Ok(ControlPhase {
        is_grounded: model.phase_for([false; 4]) != Some(phase),
        torque_mean: SVector::from_fn(|joint, _| input.mean[joint]),
        torque_precision: SMatrix::from_fn(|row, col| torque_precision[(row, col)]),
        latent_mean,
        latent_root,
        given_state: input.given_state.as_ref().map(|given| InputGivenState {
            mean: given.mean.clone(),
            covariance: given.covariance.clone(),
            acceleration_error: given.acceleration_error.clone(),
        }),
        name,
    })
}

fn with_floor(mut covariance: DMatrix<f64>) -> DMatrix<f64> {
    let dim = covariance.nrows();
    let mean_variance = Some(covariance.trace() / dim as f64);
    let size = mean_variance.filter(|mean| *mean > 0.0).unwrap_or(1.0);
    (0..dim).for_each(|index| covariance[(index, index)] += VARIANCE_FLOOR * size);
    covariance
}

pub const LIFTS: [(&str, &str, Lift); 2] = [
    (
        "transpose",
        "`u = W_e^T u_lat`, as in the paper",
        Lift::Transpose,
    ),
    (
        "consistent",
        "Torques with ground forces that reproduce the latent input",
        Lift::Consistent,
    ),
];

pub const SOLVERS: [(&str, &str, Solver); 2] = [
    (
        "clarabel",
        "General interior-point solver",
        Solver::Clarabel,
    ),
    (
        "riccati",
        "Structured solver with gains prepared in advance",
        Solver::Riccati,
    ),
];

/// Words of a setting of the controller, in the order of their numbers; none for a setting that is a number.
pub fn words_of_setting(name: &str) -> Vec<&'static str> {
    match name {
        "lift" => LIFTS.map(|(word, ..)| word).to_vec(),
        "solver" => SOLVERS.map(|(word, ..)| word).to_vec(),
        "linearisation" => vec!["reference", "last_plan"],
        "legs" => vec!["decoded", "reference"],
        "after_end" => vec!["hold", "damp", "stop"],
        _ => Vec::new(),
    }
}

/// Why a controller could not be built or given a reference; commands carry a [`Status`](super::Status).
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MpcError {
    #[error("the model cannot be used for control")]
    Model(#[from] ModelError),
    #[error("the model's dynamics cannot be compiled")]
    Lower(#[from] LowerError),
    #[error("the model's strides cannot be walked")]
    Strides(#[from] RobotError),
    #[error("the recording cannot be used for control")]
    Recording(#[from] RecordingError),
    #[error("the model's encoder expects {found} coordinates, the robot has {expected}")]
    StateDim { found: usize, expected: usize },
    #[error("input statistics of phase `{phase}`: the covariance cannot be factorised")]
    Statistics { phase: String },
    #[error("{}: a sample every {:.3} ms; found a step of {} s, expected at least as long (`romc mpc --step {}`)", path.display(), recorded_s * 1e3, found_s, (recorded_s * 1e4).ceil() / 1e4)]
    Step {
        path: PathBuf,
        found_s: f64,
        recorded_s: f64,
    },
    #[error("{}: {longest_s:.3} s without a gap, found a step of {found_s:.3e} s, expected a shorter one or a longer recording", path.display())]
    NoStep {
        path: PathBuf,
        found_s: f64,
        longest_s: f64,
    },
    #[error(transparent)]
    Control(#[from] ControlError),
}
