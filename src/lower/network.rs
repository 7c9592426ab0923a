//! The maps of nonlinear encoders and decoders.
//!
//! A layer's products with its weights go through a table, [`crate::ir::Statement::Accumulate`];
//! activations and their slopes are scalar operations without branches.
//! Velocities run forwards through the layers, lifted inputs backwards; the projection takes the
//! Jacobian row by row and solves with it.

use super::error::LowerError;
use super::solve::pinv_times;
use crate::ir::{Binary, Program, ProgramBuilder, Table, Unary, ValueId};
use crate::model::{Activation, ReducedModel, StateMap};

/// `z = E(s_x x)`.
pub(super) fn encode(model: &ReducedModel) -> Result<Program, LowerError> {
    let factors = model.state_factors()?;
    let mut network = Network::new("encode", model.encoder_map()?);
    let x = network.builder.input("x", factors.len());
    let z = network.forward(&x, factors.as_slice(), None);
    network.finish("z", &z)
}

/// `dz = J_E(s_x x) (s_x dx)`.
pub(super) fn encode_velocity(model: &ReducedModel) -> Result<Program, LowerError> {
    let factors = model.state_factors()?;
    let mut network = Network::new("encode_velocity", model.encoder_map()?);
    let x = network.builder.input("x", factors.len());
    let dx = network.builder.input("dx", factors.len());
    let slopes = network.slopes(&x, factors.as_slice());
    let dz = network.tangent(&dx, factors.as_slice(), &slopes);
    network.finish("dz", &dz)
}

/// `x = D(z) / s_x`.
pub(super) fn decode(model: &ReducedModel) -> Result<Program, LowerError> {
    let factors = model.state_factors()?;
    let mut network = Network::new("decode", model.decoder_map()?);
    let ones = vec![1.0; model.latent_dim()];
    let z = network.builder.input("z", ones.len());
    let scaled = network.forward(&z, &ones, None);
    let x = network.divided(&scaled, factors.as_slice());
    network.finish("x", &x)
}

/// `dx = J_D(z) dz / s_x`.
pub(super) fn decode_velocity(model: &ReducedModel) -> Result<Program, LowerError> {
    let factors = model.state_factors()?;
    let mut network = Network::new("decode_velocity", model.decoder_map()?);
    let ones = vec![1.0; model.latent_dim()];
    let z = network.builder.input("z", ones.len());
    let dz = network.builder.input("dz", ones.len());
    let slopes = network.slopes(&z, &ones);
    let scaled = network.tangent(&dz, &ones, &slopes);
    let dx = network.divided(&scaled, factors.as_slice());
    network.finish("dx", &dx)
}

/// `u_lat = pinv(J_E(s_x x)^T) (s_u u)`.
pub(super) fn project_input(model: &ReducedModel) -> Result<Program, LowerError> {
    let state_factors = model.state_factors()?;
    let input_factors = model.input_factors()?;
    let mut network = Network::new("project_input", model.encoder_map()?);
    let x = network.builder.input("x", state_factors.len());
    let u = network.builder.input("u", input_factors.len());
    let slopes = network.slopes(&x, state_factors.as_slice());
    let rows: Vec<Vec<ValueId>> = (0..model.latent_dim())
        .map(|row| network.jacobian_row(row, &slopes))
        .collect();
    let scaled: Vec<ValueId> = u
        .iter()
        .zip(&input_factors)
        .map(|(&u, &factor)| super::sums::scaled(&mut network.builder, factor, u))
        .collect();
    let u_lat = pinv_times(&mut network.builder, &rows, &scaled);
    network.finish("u_lat", &u_lat)
}

/// `u = (J_E(s_x x)^T u_lat) / s_u`.
pub(super) fn lift_input(model: &ReducedModel) -> Result<Program, LowerError> {
    let state_factors = model.state_factors()?;
    let input_factors = model.input_factors()?;
    let mut network = Network::new("lift_input", model.encoder_map()?);
    let x = network.builder.input("x", state_factors.len());
    let u_lat = network.builder.input("u_lat", model.latent_dim());
    let slopes = network.slopes(&x, state_factors.as_slice());
    let last = network.map.layers().len() - 1;
    let seed = network.times_slopes(&u_lat, &slopes[last]);
    let scaled = network.backward(last, seed, &slopes);
    let u = network.divided(&scaled, input_factors.as_slice());
    network.finish("u", &u)
}

/// Slopes of one layer's activation; `None` where it is linear.
type Slopes = Option<Vec<ValueId>>;

/// A program over the layers of one map.
struct Network<'a> {
    builder: ProgramBuilder,
    map: &'a StateMap,
}

impl<'a> Network<'a> {
    fn new(name: &str, map: &'a StateMap) -> Self {
        Self {
            builder: ProgramBuilder::new(name),
            map,
        }
    }

    fn finish(mut self, output: &str, values: &[ValueId]) -> Result<Program, LowerError> {
        self.builder.output(output, values);
        Ok(self.builder.finish()?)
    }

    /// The map of `factors * input`; collects the slopes of each layer when asked.
    fn forward(
        &mut self,
        input: &[ValueId],
        factors: &[f64],
        mut slopes: Option<&mut Vec<Slopes>>,
    ) -> Vec<ValueId> {
        let mut y = input.to_vec();
        for index in 0..self.map.layers().len() {
            let a = self.product(index, &y, factors_of(index, factors), true);
            let activated: Vec<(ValueId, Option<ValueId>)> = a
                .iter()
                .map(|&a| activation(&mut self.builder, self.map.layers()[index].activation, a))
                .collect();
            y = activated.iter().map(|pair| pair.0).collect();
            if let Some(slopes) = slopes.as_deref_mut() {
                slopes.push(activated.into_iter().map(|pair| pair.1).collect());
            }
        }
        y
    }

    fn slopes(&mut self, input: &[ValueId], factors: &[f64]) -> Vec<Slopes> {
        let mut slopes = Vec::new();
        self.forward(input, factors, Some(&mut slopes));
        slopes
    }

    /// `J (factors * direction)`, from the first layer to the last.
    fn tangent(
        &mut self,
        direction: &[ValueId],
        factors: &[f64],
        slopes: &[Slopes],
    ) -> Vec<ValueId> {
        let mut v = direction.to_vec();
        for (index, slopes) in slopes.iter().enumerate() {
            let a = self.product(index, &v, factors_of(index, factors), false);
            v = self.times_slopes(&a, slopes);
        }
        v
    }

    /// `g^T J` for the part of `J` up to layer `last`, whose slopes `g` has already.
    fn backward(&mut self, last: usize, g: Vec<ValueId>, slopes: &[Slopes]) -> Vec<ValueId> {
        let mut g = self.transposed_product(last, &g);
        for index in (0..last).rev() {
            let seed = self.times_slopes(&g, &slopes[index]);
            g = self.transposed_product(index, &seed);
        }
        g
    }

    /// Row `row` of `J`.
    fn jacobian_row(&mut self, row: usize, slopes: &[Slopes]) -> Vec<ValueId> {
        let last = self.map.layers().len() - 1;
        let weights = self.map.layers()[last].map.weights();
        let slope = slopes[last].as_ref().map(|slopes| slopes[row]);
        let mut g: Vec<ValueId> = Vec::with_capacity(weights.ncols());
        for &weight in weights.row(row).iter() {
            g.push(match slope {
                Some(slope) => super::sums::scaled(&mut self.builder, weight, slope),
                None => self.builder.constant(weight),
            });
        }
        if last == 0 {
            return g;
        }
        let seed = self.times_slopes(&g, &slopes[last - 1]);
        self.backward(last - 1, seed, slopes)
    }

    /// `W (factors * y)` of a layer, plus its bias if asked.
    fn product(
        &mut self,
        index: usize,
        y: &[ValueId],
        factors: Option<&[f64]>,
        is_biased: bool,
    ) -> Vec<ValueId> {
        let map = &self.map.layers()[index].map;
        let (rows, cols) = map.weights().shape();
        let mut entries = match is_biased {
            true => map.bias().as_slice().to_vec(),
            false => vec![0.0; rows],
        };
        for col in 0..cols {
            let factor = factors.map_or(1.0, |factors| factors[col]);
            entries.extend(map.weights().column(col).iter().map(|w| w * factor));
        }
        let table = self.builder.table(Table::new(cols + 1, rows, entries));
        self.builder.accumulate(table, vec![y.to_vec()])
    }

    /// `W^T g` of a layer.
    fn transposed_product(&mut self, index: usize, g: &[ValueId]) -> Vec<ValueId> {
        let weights = self.map.layers()[index].map.weights();
        let (rows, cols) = weights.shape();
        let mut entries = vec![0.0; cols];
        for row in weights.row_iter() {
            entries.extend(row.iter());
        }
        let table = self.builder.table(Table::new(rows + 1, cols, entries));
        self.builder.accumulate(table, vec![g.to_vec()])
    }

    fn times_slopes(&mut self, values: &[ValueId], slopes: &Slopes) -> Vec<ValueId> {
        match slopes {
            None => values.to_vec(),
            Some(slopes) => values
                .iter()
                .zip(slopes)
                .map(|(&value, &slope)| self.builder.binary(Binary::Mul, value, slope))
                .collect(),
        }
    }

    fn divided(&mut self, values: &[ValueId], factors: &[f64]) -> Vec<ValueId> {
        values
            .iter()
            .zip(factors)
            .map(|(&value, &factor)| {
                let factor = self.builder.constant(factor);
                self.builder.binary(Binary::Div, value, factor)
            })
            .collect()
    }
}

/// The scale factors belong to the first layer only.
fn factors_of(index: usize, factors: &[f64]) -> Option<&[f64]> {
    (index == 0).then_some(factors)
}

/// `phi(a)` and, unless it is one everywhere, `phi'(a)`.
///
/// elu without a branch: with `min(a, 0) = (a - |a|)/2`, exact in floating point, its slope is
/// `e = exp(min(a, 0))` and its value `max(a, 0) + (e - 1)`.
fn activation(
    builder: &mut ProgramBuilder,
    activation: Activation,
    a: ValueId,
) -> (ValueId, Option<ValueId>) {
    let one = builder.constant(1.0);
    match activation {
        Activation::Linear => (a, None),
        Activation::Elu => {
            let magnitude = builder.unary(Unary::Abs, a);
            let half = builder.constant(0.5);
            let below = builder.binary(Binary::Sub, a, magnitude);
            let below = builder.binary(Binary::Mul, half, below);
            let above = builder.binary(Binary::Add, a, magnitude);
            let above = builder.binary(Binary::Mul, half, above);
            let slope = builder.unary(Unary::Exp, below);
            let shifted = builder.binary(Binary::Sub, slope, one);
            (builder.binary(Binary::Add, above, shifted), Some(slope))
        }
        Activation::Tanh => {
            let value = builder.unary(Unary::Tanh, a);
            let square = builder.binary(Binary::Mul, value, value);
            (value, Some(builder.binary(Binary::Sub, one, square)))
        }
        Activation::Sigmoid => {
            let negative = builder.unary(Unary::Neg, a);
            let e = builder.unary(Unary::Exp, negative);
            let sum = builder.binary(Binary::Add, one, e);
            let value = builder.binary(Binary::Div, one, sum);
            let rest = builder.binary(Binary::Sub, one, value);
            (value, Some(builder.binary(Binary::Mul, value, rest)))
        }
    }
}
