//! The maps between robot and latent coordinates, with the scaling folded in.
//!
//! [`Map`] has the equations of linear models. With a nonlinear encoder or decoder the weights are the Jacobian at a
//! state, the first input: `x` of the encoder's maps, `z` of the decoder's. A layer's products with its weights go
//! through a table, [`crate::ir::Statement::Accumulate`]; activations and slopes are without branches. Velocities run
//! forwards through the layers, lifted inputs backwards; the projection solves with the rows of the Jacobian.

use super::number::Number;
use super::*;

/// A map between robot coordinates (SI units) and latent ones; the bias is not added to velocities.
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
    /// [`LowerError::Model`] if the model has no scaling, no encoder, or no decoder for the decoding maps.
    pub fn lower(self, model: &ReducedModel) -> Result<Program> {
        let map = match self {
            Self::Encode | Self::EncodeVelocity | Self::ProjectInput | Self::LiftInput => {
                model.encoder_map()?
            }
            Self::Decode | Self::DecodeVelocity => model.decoder_map()?,
        };
        let Some(map) = map.as_affine() else {
            return lower(self, model);
        };
        // The Jacobian of a linear map is constant.
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
    pub(crate) fn of_weights(self, weights: &DMatrix<f64>) -> Result<Program> {
        affine(self, weights, None)
    }
}

/// `output = weights input + bias`.
fn affine(map: Map, weights: &DMatrix<f64>, bias: Option<&DVector<f64>>) -> Result<Program> {
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

pub(super) fn lower(map: Map, model: &ReducedModel) -> Result<Program> {
    let (name, (from, to)) = map.words();
    let (at, factors, layers) = match map {
        Map::Decode | Map::DecodeVelocity => {
            let ones = DVector::from_element(model.latent_dim(), 1.0);
            ("z", ones, model.decoder_map()?)
        }
        Map::Encode | Map::EncodeVelocity | Map::ProjectInput | Map::LiftInput => {
            ("x", model.state_factors()?, model.encoder_map()?)
        }
    };
    let mut builder = ProgramBuilder::new(name);
    let point = builder.input(at, factors.len());
    // The vector that the Jacobian at the point multiplies.
    let given = match map {
        Map::Encode | Map::Decode => Vec::new(),
        Map::EncodeVelocity | Map::DecodeVelocity | Map::ProjectInput => {
            builder.input(from, factors.len())
        }
        Map::LiftInput => builder.input(from, model.latent_dim()),
    };
    let sheet = &Sheet::new(&mut builder);
    let network = Network {
        sheet,
        map: layers,
        factors,
    };
    let [point, given] = [point, given].map(|ids| numbers(sheet, &ids));
    let (y, slopes) = network.forward(&point);
    let result = match map {
        // z = E(s_x x)
        Map::Encode => y,
        // dz = J_E(s_x x) (s_x dx)
        Map::EncodeVelocity => network.tangent(&given, &slopes),
        // x = D(z) / s_x
        Map::Decode => divided(&y, &model.state_factors()?),
        // dx = J_D(z) dz / s_x
        Map::DecodeVelocity => {
            let scaled = network.tangent(&given, &slopes);
            divided(&scaled, &model.state_factors()?)
        }
        // u_lat = pinv(J_E(s_x x)^T) (s_u u)
        Map::ProjectInput => {
            let rows = (0..model.latent_dim()).map(|row| network.jacobian_row(row, &slopes));
            let rows: Vec<Vec<Number>> = rows.collect();
            let factors = model.input_factors()?;
            let scaled = given.iter().zip(&factors).map(|(&u, &s_u)| s_u * u);
            pinv_times(sheet, &rows, &scaled.collect::<Vec<_>>())
        }
        // u = (J_E(s_x x)^T u_lat) / s_u
        Map::LiftInput => {
            let scaled = network.backward(given, &slopes);
            divided(&scaled, &model.input_factors()?)
        }
    };
    let result = ids(&result);
    builder.output(to, &result);
    Ok(builder.finish()?)
}

/// One number per unit of a layer.
type Layer<'b> = Vec<Number<'b>>;

struct Network<'b> {
    sheet: &'b Sheet<'b>,
    map: &'b StateMap,
    /// Factors of the map's inputs, as part of the first layer.
    factors: DVector<f64>,
}

impl<'b> Network<'b> {
    /// The map of `factors * input`, and the slopes of each layer's activation.
    fn forward(&self, input: &[Number<'b>]) -> (Layer<'b>, Vec<Layer<'b>>) {
        let mut y = input.to_vec();
        let mut slopes = Vec::new();
        for (index, layer) in self.map.layers().iter().enumerate() {
            let a = self.product(index, &y, true).into_iter();
            let (values, of_layer) = a.map(|a| activation(layer.activation, a)).unzip();
            y = values;
            slopes.push(of_layer);
        }
        (y, slopes)
    }

    /// `J (factors * direction)`, from the first layer to the last.
    fn tangent(&self, direction: &[Number<'b>], slopes: &[Layer<'b>]) -> Layer<'b> {
        let mut v = direction.to_vec();
        for (index, slopes) in slopes.iter().enumerate() {
            v = times(&self.product(index, &v, false), slopes);
        }
        v
    }

    /// `g^T J` of the first layers, those whose slopes are given.
    fn backward(&self, mut g: Layer<'b>, slopes: &[Layer<'b>]) -> Layer<'b> {
        for (index, slopes) in slopes.iter().enumerate().rev() {
            g = self.transposed_product(index, &times(&g, slopes));
        }
        g
    }

    fn jacobian_row(&self, row: usize, slopes: &[Layer<'b>]) -> Layer<'b> {
        let last = slopes.len() - 1;
        let weights = self.map.layers()[last].map.weights().row(row);
        let g = weights.iter().map(|&weight| weight * slopes[last][row]);
        self.backward(g.collect(), &slopes[..last])
    }

    /// `W y` of a layer, of the first `W (factors * y)`; plus its bias if asked.
    fn product(&self, index: usize, y: &[Number<'b>], is_biased: bool) -> Layer<'b> {
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
        self.accumulated(Table::new(cols + 1, rows, entries), y)
    }

    /// `W^T g` of a layer.
    fn transposed_product(&self, index: usize, g: &[Number<'b>]) -> Layer<'b> {
        let weights = self.map.layers()[index].map.weights();
        let (rows, cols) = weights.shape();
        let mut entries = vec![0.0; cols];
        for row in weights.row_iter() {
            entries.extend(row.iter());
        }
        self.accumulated(Table::new(rows + 1, cols, entries), g)
    }

    fn accumulated(&self, table: Table, weights: &[Number<'b>]) -> Layer<'b> {
        let sums = self.sheet.borrow_mut().accumulate(&table, ids(weights));
        numbers(self.sheet, &sums)
    }
}

fn times<'b>(values: &[Number<'b>], slopes: &[Number<'b>]) -> Layer<'b> {
    let pairs = values.iter().zip(slopes);
    pairs.map(|(&value, &slope)| value * slope).collect()
}

fn divided<'b>(values: &[Number<'b>], factors: &DVector<f64>) -> Layer<'b> {
    let pairs = values.iter().zip(factors);
    pairs.map(|(&value, &factor)| value / factor).collect()
}

/// `phi(a)` and `phi'(a)` without branches: `min(a, 0) = (a - |a|)/2` and `max(a, 0) = (a + |a|)/2` are exact in
/// floating point, so elu has the slope `e = exp(min(a, 0))` and the value `max(a, 0) + (e - 1)`.
fn activation(activation: Activation, a: Number) -> (Number, Number) {
    match activation {
        Activation::Linear => (a, a.constant(1.0)),
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
    }
}

fn positive_part(a: Number) -> Number {
    0.5 * (a + a.abs())
}

/// `1 / (1 + exp(-a))` and its slope.
fn sigmoid(a: Number) -> (Number, Number) {
    let value = 1.0 / (1.0 + (-a).unary(Unary::Exp));
    (value, value * (1.0 - value))
}

/// `a Phi(a)` and `Phi(a) + a phi(a)`.
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

/// `pinv(J^T) w = (J J^T)^-1 J w` for the `d x n` matrix with these rows, `d <= n`: the normal equations by Cholesky,
/// `J J^T = L L^T`, unrolled as d is small. The error grows with the square of J's condition number. If J has not full
/// row rank a pivot is zero or negative, and the result infinite or NaN.
pub(super) fn pinv_times<'b>(
    sheet: &'b Sheet<'b>,
    rows: &[Vec<Number<'b>>],
    w: &[Number<'b>],
) -> Layer<'b> {
    // Two chains: the sums of one do not wait for those of the other.
    let dot = |a: &[Number<'b>], b: &[Number<'b>]| {
        let mut sums = [Number::known(sheet, 0.0); 2];
        for (k, (&a, &b)) in a.iter().zip(b).enumerate() {
            sums[k % 2] = sums[k % 2] + a * b;
        }
        sums[0] + sums[1]
    };
    let d = rows.len();
    let mut lower: Vec<Vec<Number>> = Vec::with_capacity(d);
    let mut pivots: Vec<Number> = Vec::with_capacity(d);
    // L y = J w, along with the factorisation.
    let mut y: Vec<Number> = Vec::with_capacity(d);
    for i in 0..d {
        let mut row: Vec<Number> = Vec::with_capacity(i);
        for j in 0..i {
            let entry = minus_products(dot(&rows[i], &rows[j]), &row, &lower[j]);
            row.push(entry / pivots[j]);
        }
        let square = minus_products(dot(&rows[i], &rows[i]), &row, &row);
        let pivot = square.unary(Unary::Sqrt);
        let right = minus_products(dot(&rows[i], w), &row, &y);
        y.push(right / pivot);
        pivots.push(pivot);
        lower.push(row);
    }
    // L^T u = y, from the last unknown to the first.
    let mut solution = y;
    for i in (0..d).rev() {
        let column: Vec<Number> = (i + 1..d).map(|k| lower[k][i]).collect();
        let right = minus_products(solution[i], &column, &solution[i + 1..]);
        solution[i] = right / pivots[i];
    }
    solution
}

/// `start - a . b`.
fn minus_products<'b>(start: Number<'b>, a: &[Number<'b>], b: &[Number<'b>]) -> Number<'b> {
    let pairs = a.iter().zip(b);
    pairs.fold(start, |sum, (&a, &b)| sum - a * b)
}
