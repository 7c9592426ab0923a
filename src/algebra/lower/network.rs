//! The maps of nonlinear encoders and decoders.
//!
//! A layer's products with its weights go through a table, [`crate::ir::Statement::Accumulate`];
//! activations and their slopes are scalar operations without branches.
//! Velocities run forwards through the layers, lifted inputs backwards; the projection takes the
//! Jacobian row by row and solves with it.

use nalgebra::DVector;

use super::error::LowerError;
use super::maps::Map;
use super::number::{Number, Sheet};
use super::solve::pinv_times;
use super::sums::scaled;
use crate::ir::{Program, ProgramBuilder, Table, Unary, ValueId};
use crate::model::{
    Activation, DENSITY_AT_ZERO, GELU_CUBIC, GELU_RATE, ReducedModel, StateMap, TAIL,
};

/// The program of a map over layers.
pub(super) fn lower(map: Map, model: &ReducedModel) -> Result<Program, LowerError> {
    let (name, (from, to)) = map.words();
    let mut network = match map {
        Map::Decode | Map::DecodeVelocity => Network {
            builder: ProgramBuilder::new(name),
            factors: DVector::from_element(model.latent_dim(), 1.0),
            map: model.decoder_map()?,
        },
        Map::Encode | Map::EncodeVelocity | Map::ProjectInput | Map::LiftInput => Network {
            builder: ProgramBuilder::new(name),
            factors: model.state_factors()?,
            map: model.encoder_map()?,
        },
    };
    let result = match map {
        // z = E(s_x x)
        Map::Encode => {
            let x = network.input(from);
            network.forward(&x).0
        }
        // dz = J_E(s_x x) (s_x dx)
        Map::EncodeVelocity => {
            let (x, dx) = (network.input("x"), network.input(from));
            let (_, slopes) = network.forward(&x);
            network.tangent(&dx, &slopes)
        }
        // x = D(z) / s_x
        Map::Decode => {
            let z = network.input(from);
            let (scaled, _) = network.forward(&z);
            network.divided(&scaled, &model.state_factors()?)
        }
        // dx = J_D(z) dz / s_x
        Map::DecodeVelocity => {
            let (z, dz) = (network.input("z"), network.input(from));
            let (_, slopes) = network.forward(&z);
            let scaled = network.tangent(&dz, &slopes);
            network.divided(&scaled, &model.state_factors()?)
        }
        // u_lat = pinv(J_E(s_x x)^T) (s_u u)
        Map::ProjectInput => {
            let factors = model.input_factors()?;
            let x = network.input("x");
            let u = network.builder.input(from, factors.len());
            let (_, slopes) = network.forward(&x);
            let rows: Vec<Vec<ValueId>> = (0..model.latent_dim())
                .map(|row| network.jacobian_row(row, &slopes))
                .collect();
            let scaled: Vec<ValueId> = (u.iter().zip(&factors))
                .map(|(&u, &factor)| scaled(&mut network.builder, factor, u))
                .collect();
            pinv_times(&mut network.builder, &rows, &scaled)
        }
        // u = (J_E(s_x x)^T u_lat) / s_u
        Map::LiftInput => {
            let x = network.input("x");
            let u_lat = network.builder.input(from, model.latent_dim());
            let (_, slopes) = network.forward(&x);
            let last = network.map.layers().len() - 1;
            let seed = network.times_slopes(&u_lat, &slopes[last]);
            let scaled = network.backward(last, seed, &slopes);
            network.divided(&scaled, &model.input_factors()?)
        }
    };
    network.builder.output(to, &result);
    Ok(network.builder.finish()?)
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

impl Network<'_> {
    fn input(&mut self, name: &str) -> Vec<ValueId> {
        self.builder.input(name, self.factors.len())
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
    let sheet = Sheet::new(builder);
    let a = Number::new(&sheet, a);
    let (value, slope) = match activation {
        Activation::Linear => return (a.id, None),
        Activation::Elu => {
            let below = 0.5 * (a - a.abs());
            let above = positive_part(a);
            let slope = below.unary(Unary::Exp);
            (above + (slope - 1.0), slope)
        }
        Activation::Tanh => {
            let value = a.unary(Unary::Tanh);
            (value, 1.0 - value * value)
        }
        Activation::Sigmoid => sigmoid(a),
        Activation::Relu => {
            let sign = a.unary(Unary::Sign);
            (positive_part(a), positive_part(sign))
        }
        Activation::Gelu => gelu(a),
        Activation::GeluTanh => gelu_tanh(a),
        Activation::Silu => {
            let (s, slope) = sigmoid(a);
            let bend = a * slope;
            (a * s, s + bend)
        }
        Activation::Softplus => {
            let log = (1.0 + (-a.abs()).unary(Unary::Exp)).unary(Unary::Log);
            let above = positive_part(a);
            let (s, _) = sigmoid(a);
            (above + log, s)
        }
    };
    (value.id, Some(slope.id))
}

fn positive_part(a: Number) -> Number {
    0.5 * (a + a.abs())
}

/// `1 / (1 + exp(-a))` and its slope.
fn sigmoid(a: Number) -> (Number, Number) {
    let value = 1.0 / (1.0 + (-a).unary(Unary::Exp));
    (value, value * (1.0 - value))
}

/// `a Phi(a)` and `Phi(a) + a phi(a)`, as in `model/normal.rs`.
fn gelu(a: Number) -> (Number, Number) {
    let x = std::f64::consts::FRAC_1_SQRT_2 * a.abs();
    let t = 2.0 / (2.0 + x);
    let w = 2.0 * t - 1.0;
    let twice_w = 2.0 * w;
    // Clenshaw's recurrence from its second step, before which both sums are zero.
    let mut last = a.constant(0.0);
    let mut next = a.constant(TAIL[TAIL.len() - 1]);
    for &coefficient in TAIL[1..TAIL.len() - 1].iter().rev() {
        (next, last) = (coefficient + (twice_w * next - last), next);
    }
    let q = TAIL[0] + (w * next - last);
    let e = (-0.5 * (a * a)).unary(Unary::Exp);
    let tail = 0.5 * t * q * e;
    // (1 + sign)/2 - sign tail: the tail below zero, one minus it above, a half at zero.
    let sign = a.unary(Unary::Sign);
    let cumulative = 0.5 * (1.0 + sign) - sign * tail;
    let bend = a * (DENSITY_AT_ZERO * e);
    (a * cumulative, cumulative + bend)
}

/// `a h` with `h = (1 + tanh(r (a + c a^3)))/2`, and `h + a r (1 + 3 c a^2) (1 - tanh^2)/2`.
fn gelu_tanh(a: Number) -> (Number, Number) {
    let cubic = GELU_RATE * GELU_CUBIC * (a * a);
    let t = (a * (GELU_RATE + cubic)).unary(Unary::Tanh);
    let half = 0.5 * (1.0 + t);
    let bend = (GELU_RATE + 3.0 * cubic) * (1.0 - t * t);
    let bend = 0.5 * a * bend;
    (a * half, half + bend)
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
