//! The maps between robot and latent coordinates, with the scaling folded in.
//!
//! Each says what it is for a linear model. With a nonlinear encoder or decoder the weights are the
//! Jacobian at a state, which is then the first input: `x` of the encoder's maps, `z` of the
//! decoder's.

use nalgebra::{DMatrix, DVector};

use super::error::LowerError;
use super::network;
use super::sums::{Term, linear_combination};
use crate::ir::{Program, ProgramBuilder};
use crate::model::{AffineMap, ReducedModel};

/// `z = W_e (s_x x) + b_e`: input `x` (SI units), output `z`.
///
/// # Errors
/// [`LowerError::Model`] if the model has no encoder or scaling.
pub fn encode(model: &ReducedModel) -> Result<Program, LowerError> {
    let Some(encoder) = model.encoder_map()?.as_affine() else {
        return network::encode(model);
    };
    let weights = model.encoder_jacobian(&anywhere(encoder))?;
    let bias = encoder.bias().as_slice();
    affine("encode", ("x", "z"), &weights, Some(bias))
}

/// `dz = W_e (s_x dx)`: input `dx` (SI units), output `dz`; velocities take no bias.
///
/// # Errors
/// As [`encode`].
pub fn encode_velocity(model: &ReducedModel) -> Result<Program, LowerError> {
    let Some(encoder) = model.encoder_map()?.as_affine() else {
        return network::encode_velocity(model);
    };
    let weights = model.encoder_jacobian(&anywhere(encoder))?;
    affine("encode_velocity", ("dx", "dz"), &weights, None)
}

/// `x = (W_d z + b_d) / s_x`: input `z`, output `x` (SI units).
///
/// # Errors
/// [`LowerError::Model`] if the model has no decoder or scaling.
pub fn decode(model: &ReducedModel) -> Result<Program, LowerError> {
    let Some(decoder) = model.decoder_map()?.as_affine() else {
        return network::decode(model);
    };
    let weights = model.decoder_jacobian(&anywhere(decoder))?;
    let bias = decoder.bias().component_div(&model.state_factors()?);
    affine("decode", ("z", "x"), &weights, Some(bias.as_slice()))
}

/// `dx = (W_d dz) / s_x`: input `dz`, output `dx` (SI units); velocities take no bias.
///
/// # Errors
/// As [`decode`].
pub fn decode_velocity(model: &ReducedModel) -> Result<Program, LowerError> {
    let Some(decoder) = model.decoder_map()?.as_affine() else {
        return network::decode_velocity(model);
    };
    let weights = model.decoder_jacobian(&anywhere(decoder))?;
    affine("decode_velocity", ("dz", "dx"), &weights, None)
}

/// `u_lat = pinv(W_e^T) (s_u u)`: input `u` (SI units), output `u_lat`.
///
/// # Errors
/// As [`encode`].
pub fn project_input(model: &ReducedModel) -> Result<Program, LowerError> {
    let Some(encoder) = model.encoder_map()?.as_affine() else {
        return network::project_input(model);
    };
    let weights = model.tangent(&anywhere(encoder))?.project;
    affine("project_input", ("u", "u_lat"), &weights, None)
}

/// `u = (W_e^T u_lat) / s_u`: input `u_lat`, output `u` (SI units).
///
/// # Errors
/// As [`encode`].
pub fn lift_input(model: &ReducedModel) -> Result<Program, LowerError> {
    let Some(encoder) = model.encoder_map()?.as_affine() else {
        return network::lift_input(model);
    };
    let weights = model.tangent(&anywhere(encoder))?.lift;
    affine("lift_input", ("u_lat", "u"), &weights, None)
}

/// `output = weights input` by name, for input maps in other units than the model's.
///
/// # Errors
/// [`LowerError::Program`] if a weight is not finite.
pub fn linear_map(
    name: &str,
    slots: (&str, &str),
    weights: &DMatrix<f64>,
) -> Result<Program, LowerError> {
    affine(name, slots, weights, None)
}

/// A point of a linear map, whose Jacobian is the same at all.
fn anywhere(map: &AffineMap) -> DVector<f64> {
    DVector::zeros(map.input_dim())
}

/// `output = weights input + bias`.
fn affine(
    name: &str,
    (from, to): (&str, &str),
    weights: &DMatrix<f64>,
    bias: Option<&[f64]>,
) -> Result<Program, LowerError> {
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
