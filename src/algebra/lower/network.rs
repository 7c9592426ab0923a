//! The maps of nonlinear encoders and decoders.
//!
//! A layer's products with its weights go through a table, [`crate::ir::Statement::Accumulate`];
//! activations and their slopes are scalar operations without branches.
//! Velocities run forwards through the layers, lifted inputs backwards; the projection takes the
//! Jacobian row by row and solves with it.

use nalgebra::DVector;

use super::error::LowerError;
use super::solve::pinv_times;
use super::sums::scaled;
use crate::ir::{Program, ProgramBuilder, Table, Unary, ValueId};
use crate::model::{
    Activation, DENSITY_AT_ZERO, GELU_CUBIC, GELU_RATE, ReducedModel, StateMap, TAIL,
};

/// `z = E(s_x x)`.
pub(super) fn encode(model: &ReducedModel) -> Result<Program, LowerError> {
    let mut network = Network::of_encoder("encode", model)?;
    let x = network.input("x");
    let (z, _) = network.forward(&x);
    network.finish("z", &z)
}

/// `dz = J_E(s_x x) (s_x dx)`.
pub(super) fn encode_velocity(model: &ReducedModel) -> Result<Program, LowerError> {
    let mut network = Network::of_encoder("encode_velocity", model)?;
    let (x, dx) = (network.input("x"), network.input("dx"));
    let (_, slopes) = network.forward(&x);
    let dz = network.tangent(&dx, &slopes);
    network.finish("dz", &dz)
}

/// `x = D(z) / s_x`.
pub(super) fn decode(model: &ReducedModel) -> Result<Program, LowerError> {
    let mut network = Network::of_decoder("decode", model)?;
    let z = network.input("z");
    let (scaled, _) = network.forward(&z);
    let x = network.divided(&scaled, &model.state_factors()?);
    network.finish("x", &x)
}

/// `dx = J_D(z) dz / s_x`.
pub(super) fn decode_velocity(model: &ReducedModel) -> Result<Program, LowerError> {
    let mut network = Network::of_decoder("decode_velocity", model)?;
    let (z, dz) = (network.input("z"), network.input("dz"));
    let (_, slopes) = network.forward(&z);
    let scaled = network.tangent(&dz, &slopes);
    let dx = network.divided(&scaled, &model.state_factors()?);
    network.finish("dx", &dx)
}

/// `u_lat = pinv(J_E(s_x x)^T) (s_u u)`.
pub(super) fn project_input(model: &ReducedModel) -> Result<Program, LowerError> {
    let mut network = Network::of_encoder("project_input", model)?;
    let factors = model.input_factors()?;
    let x = network.input("x");
    let u = network.builder.input("u", factors.len());
    let (_, slopes) = network.forward(&x);
    let rows: Vec<Vec<ValueId>> = (0..model.latent_dim())
        .map(|row| network.jacobian_row(row, &slopes))
        .collect();
    let scaled: Vec<ValueId> = (u.iter().zip(&factors))
        .map(|(&u, &factor)| scaled(&mut network.builder, factor, u))
        .collect();
    let u_lat = pinv_times(&mut network.builder, &rows, &scaled);
    network.finish("u_lat", &u_lat)
}

/// `u = (J_E(s_x x)^T u_lat) / s_u`.
pub(super) fn lift_input(model: &ReducedModel) -> Result<Program, LowerError> {
    let mut network = Network::of_encoder("lift_input", model)?;
    let x = network.input("x");
    let u_lat = network.builder.input("u_lat", model.latent_dim());
    let (_, slopes) = network.forward(&x);
    let last = network.map.layers().len() - 1;
    let seed = network.times_slopes(&u_lat, &slopes[last]);
    let scaled = network.backward(last, seed, &slopes);
    let u = network.divided(&scaled, &model.input_factors()?);
    network.finish("u", &u)
}

/// Slopes of one layer's activation; `None` where it is linear.
type Slopes = Option<Vec<ValueId>>;

/// A program over the layers of one map.
struct Network<'a> {
    builder: ProgramBuilder,
    map: &'a StateMap,
    /// What the map's inputs are multiplied by, as part of the first layer.
    factors: DVector<f64>,
}

impl<'a> Network<'a> {
    fn of_encoder(name: &str, model: &'a ReducedModel) -> Result<Self, LowerError> {
        Ok(Self {
            builder: ProgramBuilder::new(name),
            factors: model.state_factors()?,
            map: model.encoder_map()?,
        })
    }

    fn of_decoder(name: &str, model: &'a ReducedModel) -> Result<Self, LowerError> {
        Ok(Self {
            builder: ProgramBuilder::new(name),
            factors: DVector::from_element(model.latent_dim(), 1.0),
            map: model.decoder_map()?,
        })
    }

    fn input(&mut self, name: &str) -> Vec<ValueId> {
        self.builder.input(name, self.factors.len())
    }

    fn finish(mut self, output: &str, values: &[ValueId]) -> Result<Program, LowerError> {
        self.builder.output(output, values);
        Ok(self.builder.finish()?)
    }

    /// The map of `factors * input`, and the slopes of each layer.
    fn forward(&mut self, input: &[ValueId]) -> (Vec<ValueId>, Vec<Slopes>) {
        let mut y = input.to_vec();
        let mut slopes = Vec::new();
        for (index, layer) in self.map.layers().iter().enumerate() {
            let a = self.product(index, &y, true).into_iter();
            let activated: Vec<(ValueId, Option<ValueId>)> = a
                .map(|a| activation(&mut self.builder, layer.activation, a))
                .collect();
            y = activated.iter().map(|pair| pair.0).collect();
            slopes.push(activated.into_iter().map(|pair| pair.1).collect());
        }
        (y, slopes)
    }

    /// `J (factors * direction)`, from the first layer to the last.
    fn tangent(&mut self, direction: &[ValueId], slopes: &[Slopes]) -> Vec<ValueId> {
        let mut v = direction.to_vec();
        for (index, slopes) in slopes.iter().enumerate() {
            let a = self.product(index, &v, false);
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
                Some(slope) => scaled(&mut self.builder, weight, slope),
                None => self.builder.constant(weight),
            });
        }
        if last == 0 {
            return g;
        }
        let seed = self.times_slopes(&g, &slopes[last - 1]);
        self.backward(last - 1, seed, slopes)
    }

    /// `W y` of a layer, of the first `W (factors * y)`; plus its bias if asked.
    fn product(&mut self, index: usize, y: &[ValueId], is_biased: bool) -> Vec<ValueId> {
        let map = &self.map.layers()[index].map;
        let (rows, cols) = map.weights().shape();
        let mut entries = match is_biased {
            true => map.bias().as_slice().to_vec(),
            false => vec![0.0; rows],
        };
        for col in 0..cols {
            let factor = if index == 0 { self.factors[col] } else { 1.0 };
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
                .map(|(&value, &slope)| self.builder.mul(value, slope))
                .collect(),
        }
    }

    fn divided(&mut self, values: &[ValueId], factors: &DVector<f64>) -> Vec<ValueId> {
        (values.iter().zip(factors))
            .map(|(&value, &factor)| {
                let factor = self.builder.constant(factor);
                self.builder.div(value, factor)
            })
            .collect()
    }
}

/// `phi(a)` and, unless it is one everywhere, `phi'(a)`.
///
/// Without branches: `min(a, 0) = (a - |a|)/2` and `max(a, 0) = (a + |a|)/2` are exact in floating
/// point, so that elu has the slope `e = exp(min(a, 0))` and the value `max(a, 0) + (e - 1)`.
fn activation(
    builder: &mut ProgramBuilder,
    activation: Activation,
    a: ValueId,
) -> (ValueId, Option<ValueId>) {
    let mut steps = Steps(builder);
    let (value, slope) = match activation {
        Activation::Linear => return (a, None),
        Activation::Elu => {
            let below = steps.negative_part(a);
            let above = steps.positive_part(a);
            let slope = steps.0.unary(Unary::Exp, below);
            let shifted = steps.minus(slope, 1.0);
            (steps.0.add(above, shifted), slope)
        }
        Activation::Tanh => {
            let value = steps.0.unary(Unary::Tanh, a);
            let square = steps.0.mul(value, value);
            (value, steps.one_minus(square))
        }
        Activation::Sigmoid => steps.sigmoid(a),
        Activation::Relu => {
            let sign = steps.0.unary(Unary::Sign, a);
            (steps.positive_part(a), steps.positive_part(sign))
        }
        Activation::Gelu => steps.gelu(a),
        Activation::GeluTanh => steps.gelu_tanh(a),
        Activation::Silu => {
            let (s, slope) = steps.sigmoid(a);
            let bend = steps.0.mul(a, slope);
            (steps.0.mul(a, s), steps.0.add(s, bend))
        }
        Activation::Softplus => {
            let magnitude = steps.0.unary(Unary::Abs, a);
            let below = steps.0.unary(Unary::Neg, magnitude);
            let e = steps.0.unary(Unary::Exp, below);
            let sum = steps.plus(e, 1.0);
            let log = steps.0.unary(Unary::Log, sum);
            let above = steps.positive_part(a);
            let (s, _) = steps.sigmoid(a);
            (steps.0.add(above, log), s)
        }
    };
    (value, Some(slope))
}

/// The builder, with longer operations by name.
struct Steps<'b>(&'b mut ProgramBuilder);

impl Steps<'_> {
    fn plus(&mut self, a: ValueId, number: f64) -> ValueId {
        let number = self.0.constant(number);
        self.0.add(number, a)
    }

    fn minus(&mut self, a: ValueId, number: f64) -> ValueId {
        let number = self.0.constant(number);
        self.0.sub(a, number)
    }

    fn one_minus(&mut self, a: ValueId) -> ValueId {
        let one = self.0.constant(1.0);
        self.0.sub(one, a)
    }

    fn times(&mut self, number: f64, a: ValueId) -> ValueId {
        let number = self.0.constant(number);
        self.0.mul(number, a)
    }

    fn negative_part(&mut self, a: ValueId) -> ValueId {
        let magnitude = self.0.unary(Unary::Abs, a);
        let twice = self.0.sub(a, magnitude);
        self.times(0.5, twice)
    }

    fn positive_part(&mut self, a: ValueId) -> ValueId {
        let magnitude = self.0.unary(Unary::Abs, a);
        let twice = self.0.add(a, magnitude);
        self.times(0.5, twice)
    }

    /// `1 / (1 + exp(-a))` and its slope.
    fn sigmoid(&mut self, a: ValueId) -> (ValueId, ValueId) {
        let negative = self.0.unary(Unary::Neg, a);
        let e = self.0.unary(Unary::Exp, negative);
        let sum = self.plus(e, 1.0);
        let one = self.0.constant(1.0);
        let value = self.0.div(one, sum);
        let rest = self.one_minus(value);
        (value, self.0.mul(value, rest))
    }

    /// `a Phi(a)` and `Phi(a) + a phi(a)`, as in `model/normal.rs`.
    fn gelu(&mut self, a: ValueId) -> (ValueId, ValueId) {
        let magnitude = self.0.unary(Unary::Abs, a);
        let x = self.times(std::f64::consts::FRAC_1_SQRT_2, magnitude);
        let below = self.plus(x, 2.0);
        let two = self.0.constant(2.0);
        let t = self.0.div(two, below);
        let twice = self.times(2.0, t);
        let w = self.minus(twice, 1.0);
        let twice_w = self.times(2.0, w);
        // Clenshaw's recurrence from its second step, before which both sums are zero.
        let mut last = self.0.constant(0.0);
        let mut next = self.0.constant(TAIL[TAIL.len() - 1]);
        for &coefficient in TAIL[1..TAIL.len() - 1].iter().rev() {
            let product = self.0.mul(twice_w, next);
            let rest = self.0.sub(product, last);
            (next, last) = (self.plus(rest, coefficient), next);
        }
        let product = self.0.mul(w, next);
        let rest = self.0.sub(product, last);
        let q = self.plus(rest, TAIL[0]);
        let square = self.0.mul(a, a);
        let exponent = self.times(-0.5, square);
        let e = self.0.unary(Unary::Exp, exponent);
        let half_t = self.times(0.5, t);
        let share = self.0.mul(half_t, q);
        let tail = self.0.mul(share, e);
        // (1 + sign)/2 - sign tail: the tail below zero, one minus it above, a half at zero.
        let sign = self.0.unary(Unary::Sign, a);
        let above = self.plus(sign, 1.0);
        let above = self.times(0.5, above);
        let signed = self.0.mul(sign, tail);
        let cumulative = self.0.sub(above, signed);
        let density = self.times(DENSITY_AT_ZERO, e);
        let bend = self.0.mul(a, density);
        (self.0.mul(a, cumulative), self.0.add(cumulative, bend))
    }

    /// `a h` with `h = (1 + tanh(r (a + c a^3)))/2`, and `h + a r (1 + 3 c a^2) (1 - tanh^2)/2`.
    fn gelu_tanh(&mut self, a: ValueId) -> (ValueId, ValueId) {
        let square = self.0.mul(a, a);
        let cubic = self.times(GELU_RATE * GELU_CUBIC, square);
        let rate = self.plus(cubic, GELU_RATE);
        let argument = self.0.mul(a, rate);
        let t = self.0.unary(Unary::Tanh, argument);
        let sum = self.plus(t, 1.0);
        let half = self.times(0.5, sum);
        let slope = self.times(3.0, cubic);
        let slope = self.plus(slope, GELU_RATE);
        let t_square = self.0.mul(t, t);
        let rest = self.one_minus(t_square);
        let bend = self.0.mul(slope, rest);
        let half_a = self.times(0.5, a);
        let bend = self.0.mul(half_a, bend);
        (self.0.mul(a, half), self.0.add(half, bend))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::Interpreter;

    #[test]
    fn lowered_activations_have_the_values_and_slopes_of_the_model() {
        for phi in Activation::ALL {
            let mut builder = ProgramBuilder::new("phi");
            let a = builder.input("a", 1);
            let (value, slope) = activation(&mut builder, phi, a[0]);
            let slope = slope.unwrap_or_else(|| builder.constant(1.0));
            builder.output("y", &[value, slope]);
            let program = builder.finish().expect("a program");
            for a in [-30.0, -6.0, -0.7, -1e-9, 0.0, 0.3, 2.5, 9.0, 400.0] {
                let mut found = [0.0; 2];
                Interpreter::new(&program).run(&[&[a]], &mut [&mut found]);
                for (found, expected) in found.into_iter().zip([phi.value(a), phi.slope(a)]) {
                    let bound = 4e-15 * (1.0 + expected.abs());
                    assert!(
                        (found - expected).abs() <= bound,
                        "{phi} at {a}: {found} {expected}"
                    );
                }
            }
        }
    }
}
