//! The maps between robot and latent coordinates, with the scaling folded in.
//!
//! Each says what it is for a linear model. With a nonlinear encoder or decoder the weights are the
//! Jacobian at a state, which is then the first input: `x` of the encoder's maps, `z` of the
//! decoder's.

use nalgebra::{DMatrix, DVector};

use super::combination::{Term, linear_combination};
use super::dynamics::LowerError;
use super::network;
use crate::ir::{Program, ProgramBuilder};
use crate::model::ReducedModel;

/// A map between robot coordinates (SI units) and latent ones; velocities take no bias.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Map {
    /// `z = W_e (s_x x) + b_e`
    Encode,
    /// `dz = W_e (s_x dx)`
    EncodeVelocity,
    /// `x = (W_d z + b_d) / s_x`
    Decode,
    /// `dx = (W_d dz) / s_x`
    DecodeVelocity,
    /// `u_lat = pinv(W_e^T) (s_u u)`
    ProjectInput,
    /// `u = (W_e^T u_lat) / s_u`
    LiftInput,
}

impl Map {
    /// All maps.
    pub const ALL: [Self; 6] = [
        Self::Encode,
        Self::EncodeVelocity,
        Self::Decode,
        Self::DecodeVelocity,
        Self::ProjectInput,
        Self::LiftInput,
    ];

    /// Name, input and output of the map's program.
    pub(super) fn words(self) -> (&'static str, (&'static str, &'static str)) {
        match self {
            Self::Encode => ("encode", ("x", "z")),
            Self::EncodeVelocity => ("encode_velocity", ("dx", "dz")),
            Self::Decode => ("decode", ("z", "x")),
            Self::DecodeVelocity => ("decode_velocity", ("dz", "dx")),
            Self::ProjectInput => ("project_input", ("u", "u_lat")),
            Self::LiftInput => ("lift_input", ("u_lat", "u")),
        }
    }

    /// The program of a model's map.
    ///
    /// # Errors
    /// [`LowerError::Model`] if the model has no scaling, encoder or, for the maps that decode, decoder.
    pub fn lower(self, model: &ReducedModel) -> Result<Program, LowerError> {
        let map = match self {
            Self::Encode | Self::EncodeVelocity | Self::ProjectInput | Self::LiftInput => {
                model.encoder_map()?
            }
            Self::Decode | Self::DecodeVelocity => model.decoder_map()?,
        };
        let Some(map) = map.as_affine() else {
            return network::lower(self, model);
        };
        // The Jacobian of a linear map is the same everywhere.
        let at = &DVector::zeros(map.input_dim());
        let (weights, bias) = match self {
            Self::Encode => (model.encoder_jacobian(at)?, Some(map.bias().clone())),
            Self::EncodeVelocity => (model.encoder_jacobian(at)?, None),
            Self::Decode => {
                let bias = map.bias().component_div(&model.state_factors()?);
                (model.decoder_jacobian(at)?, Some(bias))
            }
            Self::DecodeVelocity => (model.decoder_jacobian(at)?, None),
            Self::ProjectInput => (model.tangent(at)?.project, None),
            Self::LiftInput => (model.tangent(at)?.lift, None),
        };
        affine(self, &weights, bias.as_ref())
    }

    /// The same for `output = weights input`, for input maps in other units than the model's.
    ///
    /// # Errors
    /// [`LowerError::Program`] if a weight is not finite.
    pub(crate) fn of_weights(self, weights: &DMatrix<f64>) -> Result<Program, LowerError> {
        affine(self, weights, None)
    }
}

/// `output = weights input + bias`.
fn affine(
    map: Map,
    weights: &DMatrix<f64>,
    bias: Option<&DVector<f64>>,
) -> Result<Program, LowerError> {
    let (name, (from, to)) = map.words();
    let mut builder = ProgramBuilder::new(name);
    let input = builder.input(from, weights.ncols());
    let mut output = Vec::with_capacity(weights.nrows());
    for row in 0..weights.nrows() {
        let terms: Vec<Term> = (0..weights.ncols())
            .filter(|&col| weights[(row, col)] != 0.0)
            .map(|col| Term {
                coefficient: weights[(row, col)],
                value: input[col],
                late: false,
            })
            .collect();
        let constant = bias.map_or(0.0, |bias| bias[row]);
        output.push(linear_combination(&mut builder, constant, &terms));
    }
    builder.output(to, &output);
    Ok(builder.finish()?)
}
