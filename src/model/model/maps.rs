//! The maps of a model between robot and latent coordinates, and these maps to first order at a state.
//!
//! With the encoder `E` and the decoder `D`, their Jacobians `J_E` at `s_x x` and `J_D` at `z`:
//!
//! - `z = E(s_x x)`, `dz = J_E (s_x dx)`, `ddz = J_E (s_x ddx) + dJ_E/dt (s_x dx)`;
//! - `x = D(z) / s_x`, `dx = J_D dz / s_x`;
//! - `u_lat = pinv(J_E^T) (s_u u)` (project), `u = (J_E^T u_lat) / s_u` (lift).
//!
//! For a linear model the Jacobians are the same at every state. All of `x`, `dx`, `ddx` and `u` are in SI units.
//!
//! Activations of layers, with their exact derivatives.

use super::*;

#[derive(Clone, Debug, PartialEq)]
pub struct Tangent {
    /// `dz = encode dx`: `J_E s_x`, `latent_dim x state_dim`.
    pub encode: DMatrix<f64>,
    /// `u_lat = project u`: `pinv(J_E^T) s_u`, `latent_dim x state_dim`.
    pub project: DMatrix<f64>,
    /// `u = lift u_lat`: `J_E^T / s_u`, `state_dim x latent_dim`, from the power balance under `dz = encode dx`.
    pub lift: DMatrix<f64>,
}

impl ReducedModel {
    pub fn is_linear(&self) -> bool {
        let mut maps = self.parts.encoder.iter().chain(&self.parts.decoder);
        maps.all(|map| map.as_affine().is_some())
    }

    pub fn encoder_map(&self) -> Result<&StateMap> {
        let purpose = "going from robot to latent coordinates";
        self.require(self.parts.encoder.as_ref(), "encoder", purpose)
    }

    pub fn decoder_map(&self) -> Result<&StateMap> {
        let purpose = "going from latent to robot coordinates";
        self.require(self.parts.decoder.as_ref(), "decoder", purpose)
    }

    /// The encoder of a linear model, in scaled units: `W_e` is `latent_dim x state_dim`.
    pub fn encoder(&self) -> Result<&AffineMap> {
        self.affine("encoder", self.encoder_map()?)
    }

    /// The decoder of a linear model, in scaled units: `W_d` is `state_dim x latent_dim`.
    pub fn decoder(&self) -> Result<&AffineMap> {
        self.affine("decoder", self.decoder_map()?)
    }

    pub fn input_projection(&self) -> Result<&DMatrix<f64>> {
        self.encoder()?;
        let projection = self.input_projection.as_ref();
        self.require(projection, "encoder", "projecting inputs")
    }

    /// Encoder linearised about the state `x`, decoder about its latent state; the dynamics stay.
    pub fn linearised_at(&self, x: &DVector<f64>) -> Result<ReducedModel> {
        let scaled = self.scaled_state(x)?;
        let encoder = self.encoder_map()?;
        let z = encoder.apply(&scaled)?;
        let mut builder = self.clone().into_builder();
        if encoder.as_affine().is_none() {
            builder = builder.encoder(tangent("encoder", encoder, &scaled)?);
        }
        if let Some(decoder) = &self.parts.decoder
            && decoder.as_affine().is_none()
        {
            builder = builder.decoder(tangent("decoder", decoder, &z)?);
        }
        builder.build()
    }

    /// `z = E(s_x x)`; linear models: `W_e (s_x x) + b_e`.
    pub fn encode(&self, x: &DVector<f64>) -> Result<DVector<f64>> {
        self.encoder_map()?.apply(&self.scaled_state(x)?)
    }

    /// `x = D(z) / s_x`; linear models: `(W_d z + b_d) / s_x`.
    pub fn decode(&self, z: &DVector<f64>) -> Result<DVector<f64>> {
        let scaled = self.decoder_map()?.apply(z)?;
        Ok(scaled.component_div(&self.state_factors()?))
    }

    /// `ddz = J_E (s_x ddx) + dJ_E/dt (s_x dx)` at the state `x`.
    pub fn encode_acceleration(
        &self,
        x: &DVector<f64>,
        dx: &DVector<f64>,
        ddx: &DVector<f64>,
    ) -> Result<DVector<f64>> {
        let (x, dx) = (self.scaled_state(x)?, self.scaled_state(dx)?);
        let ddx = self.scaled_state(ddx)?;
        let [_, _, ddz] = self.encoder_map()?.apply_rates(&x, &dx, &ddx)?;
        Ok(ddz)
    }

    /// Refuses a state where the encoder's Jacobian does not have full row rank.
    pub fn tangent(&self, x: &DVector<f64>) -> Result<Tangent> {
        let jacobian = self.encoder_map()?.jacobian(&self.scaled_state(x)?)?;
        let (s_x, s_u) = (self.state_factors()?, self.input_factors()?);
        let projection = match &self.input_projection {
            Some(projection) => projection,
            None => &pinv_of_transpose(&jacobian, "Jacobian of the encoder at this state")?,
        };
        Ok(Tangent {
            // divided by the factors, not multiplied by inverses, which round
            lift: (jacobian.transpose()).map_with_location(|row, _, value| value / s_u[row]),
            project: projection.map_with_location(|_, column, value| value * s_u[column]),
            encode: jacobian.map_with_location(|_, column, value| value * s_x[column]),
        })
    }

    /// `d z / d x = J_E s_x` at the state `x`, `latent_dim x state_dim`; of any rank.
    pub fn encoder_jacobian(&self, x: &DVector<f64>) -> Result<DMatrix<f64>> {
        let jacobian = self.encoder_map()?.jacobian(&self.scaled_state(x)?)?;
        let s_x = self.state_factors()?;
        Ok(jacobian.map_with_location(|_, column, value| value * s_x[column]))
    }

    /// `d x / d z = J_D / s_x` at the latent state `z`, `state_dim x latent_dim`.
    pub fn decoder_jacobian(&self, z: &DVector<f64>) -> Result<DMatrix<f64>> {
        let jacobian = self.decoder_map()?.jacobian(z)?;
        let s_x = self.state_factors()?;
        Ok(jacobian.map_with_location(|row, _, value| value / s_x[row]))
    }

    fn scaled_state(&self, x: &DVector<f64>) -> Result<DVector<f64>> {
        let factors = self.state_factors()?;
        ModelError::check_dimension("robot state", x.len(), factors.len())?;
        Ok(x.component_mul(&factors))
    }

    fn affine<'m>(&self, part: &'static str, map: &'m StateMap) -> Result<&'m AffineMap> {
        map.as_affine().ok_or_else(|| ModelError::Nonlinear {
            model: self.parts.name.clone(),
            part,
            purpose: "one matrix for all states",
        })
    }
}

/// `y -> J(at) y + (map(at) - J(at) at)`.
fn tangent(tensor: &str, map: &StateMap, at: &DVector<f64>) -> Result<AffineMap> {
    let jacobian = map.jacobian(at)?;
    let bias = map.apply(at)? - &jacobian * at;
    AffineMap::new(tensor, jacobian, bias)
}

/// An encoder has full row rank if its smallest singular value is above this share of the largest.
pub(crate) const RANK_TOLERANCE: f64 = 1e-10;

/// `pinv(W_e^T)`, `latent_dim x state_dim`, from the singular values of `W_e = U S V^T`: `pinv(W_e^T) = U S^-1 V^T`.
pub(super) fn pinv_of_transpose(weights: &DMatrix<f64>, matrix: &str) -> Result<DMatrix<f64>> {
    let dim = weights.nrows();
    let deficient = |smallest: f64, largest: f64| {
        let found = format!("singular values from {smallest:e} to {largest:e}");
        let expected =
            format!("full row rank {dim} (smallest above {RANK_TOLERANCE:e} times the largest)");
        ModelError::invalid(matrix, found, expected)
    };
    let largest_entry = weights.amax();
    if largest_entry == 0.0 {
        return Err(deficient(0.0, 0.0));
    }
    // Divided by the largest entry first: no intermediate product overflows.
    let normalised = weights / largest_entry;
    let max_iterations = 1_000 * weights.ncols();
    let svd = nalgebra::SVD::try_new(normalised, true, true, f64::EPSILON, max_iterations)
        .filter(|svd| svd.singular_values.iter().all(|value| value.is_finite()))
        .ok_or_else(|| ModelError::no_decomposition("encoder.weights"))?;
    let smallest = svd.singular_values.min();
    let largest = svd.singular_values.max();
    if smallest <= RANK_TOLERANCE * largest {
        return Err(deficient(smallest * largest_entry, largest * largest_entry));
    }
    let u = svd.u.expect("asked for the left singular vectors");
    let v_t = svd.v_t.expect("asked for the right singular vectors");
    let inverse = svd.singular_values.map(|value| 1.0 / value);
    let projection = u * DMatrix::from_diagonal(&inverse) * v_t / largest_entry;
    let projection = refined(projection, weights);
    check_finite("pinv(encoder.weights^T)", &projection)?;
    Ok(projection)
}

/// One Newton step on `P W_e^T = I` squares the residual of the iterative SVD, which can be 1e-10.
fn refined(projection: DMatrix<f64>, weights: &DMatrix<f64>) -> DMatrix<f64> {
    const NEGLIGIBLE: f64 = 1e-13;
    let dim = projection.nrows();
    let residual = DMatrix::identity(dim, dim) - &projection * weights.transpose();
    if residual.amax() <= NEGLIGIBLE {
        return projection;
    }
    let step = &residual * &projection;
    projection + step
}

/// The projector onto the orthogonal complement of the columns. Zero columns are ignored; without other columns it is
/// `I`.
pub fn complement(columns: &DMatrix<f64>) -> DMatrix<f64> {
    let d = columns.nrows();
    let mut projector = DMatrix::identity(d, d);
    for column in columns.column_iter() {
        let direction = &projector * column;
        let square = direction.norm_squared();
        if square > f64::EPSILON * column.norm_squared() {
            projector -= &direction * direction.transpose() / square;
        }
    }
    projector
}

/// Activation function of the units of a layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, clap::ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Activation {
    /// a
    #[default]
    #[value(skip)]
    Linear,
    /// a, below zero exp(a) - 1
    Elu,
    /// Hyperbolic tangent
    Tanh,
    /// 1 / (1 + exp(-a))
    Sigmoid,
    /// max(a, 0); its slope at zero is 0
    Relu,
    /// a Phi(a) with the normal distribution Phi, as torch.nn.GELU()
    Gelu,
    /// a (1 + tanh(sqrt(2/pi) (a + 0.044715 a^3))) / 2
    GeluTanh,
    /// a / (1 + exp(-a)), also named swish
    Silu,
    /// log(1 + exp(a))
    Softplus,
}

pub const GELU_RATE: f64 = 0.797_884_560_802_865_4;
pub const GELU_CUBIC: f64 = 0.044_715;

impl Activation {
    pub const ALL: [Activation; 9] = [
        Self::Linear,
        Self::Elu,
        Self::Tanh,
        Self::Sigmoid,
        Self::Relu,
        Self::Gelu,
        Self::GeluTanh,
        Self::Silu,
        Self::Softplus,
    ];

    pub(crate) fn name(self) -> &'static str {
        const NAMES: [&str; 9] = [
            "linear",
            "elu",
            "tanh",
            "sigmoid",
            "relu",
            "gelu",
            "gelu-tanh",
            "silu",
            "softplus",
        ];
        NAMES[self as usize]
    }

    pub(crate) fn value(self, a: f64) -> f64 {
        self.jet(a)[0]
    }

    pub(crate) fn slope(self, a: f64) -> f64 {
        self.derivative(a, 1)
    }

    /// `phi''(a)`; of elu at zero, where it jumps, that of the negative side.
    pub(crate) fn curvature(self, a: f64) -> f64 {
        self.derivative(a, 2)
    }

    fn derivative(self, a: f64, order: usize) -> f64 {
        match self {
            Self::Elu if a <= 0.0 => a.exp(),
            _ => self.jet(a)[order],
        }
    }

    /// `phi(a)` with its first three derivatives; of elu at zero those of the negative side.
    pub fn jet(self, a: f64) -> [f64; 4] {
        match self {
            Self::Linear => [a, 1.0, 0.0, 0.0],
            Self::Elu if a > 0.0 => [a, 1.0, 0.0, 0.0],
            Self::Elu => {
                let below = a.exp_m1();
                let slope = below + 1.0;
                [below, slope, slope, slope]
            }
            Self::Tanh => {
                let t = a.tanh();
                let slope = 1.0 - t * t;
                [t, slope, -2.0 * t * slope, slope * (6.0 * t * t - 2.0)]
            }
            Self::Sigmoid => {
                let s = sigmoid(a);
                let slope = s * (1.0 - s);
                let third = slope * (1.0 - 6.0 * slope);
                [s, slope, slope * (1.0 - 2.0 * s), third]
            }
            Self::Relu if a.is_nan() => [a; 4],
            Self::Relu => [positive_part(a), f64::from(u8::from(a > 0.0)), 0.0, 0.0],
            Self::Gelu => {
                let density = DENSITY_AT_ZERO * (-0.5 * a * a).exp();
                let cumulative = normal_cumulative(a);
                // For large `|a|` the density is zero, and the powers of a before it need not be finite.
                let far = |factor: f64| {
                    if density == 0.0 {
                        0.0
                    } else {
                        density * factor
                    }
                };
                let slope = cumulative + far(a);
                [
                    a * cumulative,
                    slope,
                    far(2.0 - a * a),
                    far(a * (a * a - 4.0)),
                ]
            }
            Self::GeluTanh => gelu_tanh(a),
            Self::Silu => {
                let [s, first, second, third] = Self::Sigmoid.jet(a);
                [
                    a * s,
                    s + a * first,
                    2.0 * first + a * second,
                    3.0 * second + a * third,
                ]
            }
            Self::Softplus => {
                let [s, first, second, _] = Self::Sigmoid.jet(a);
                let value = positive_part(a) + (1.0 + (-a.abs()).exp()).ln();
                [value, s, first, second]
            }
        }
    }
}

fn positive_part(a: f64) -> f64 {
    if a < 0.0 { 0.0 } else { a }
}

fn sigmoid(a: f64) -> f64 {
    1.0 / (1.0 + (-a).exp())
}

fn gelu_tanh(a: f64) -> [f64; 4] {
    // Here tanh is one to the last bit; for larger arguments the powers would only overflow.
    if a.abs() > 10.0 {
        return match a > 0.0 {
            true => [a, 1.0, 0.0, 0.0],
            false => [0.0; 4],
        };
    }
    let cubic = GELU_RATE * GELU_CUBIC;
    let argument = [
        GELU_RATE * (a + GELU_CUBIC * a * a * a),
        GELU_RATE + 3.0 * cubic * a * a,
        6.0 * cubic * a,
        6.0 * cubic,
    ];
    let t = argument[0].tanh();
    let rest = 1.0 - t * t;
    let first = rest * argument[1];
    let bend = argument[2] - 2.0 * t * argument[1] * argument[1];
    let second = rest * bend;
    let bend_rate =
        argument[3] - 2.0 * first * argument[1] * argument[1] - 4.0 * t * argument[1] * argument[2];
    let third = rest * bend_rate - 2.0 * t * first * bend;
    [
        0.5 * a * (1.0 + t),
        0.5 * (1.0 + t) + 0.5 * a * first,
        first + 0.5 * a * second,
        1.5 * second + 0.5 * a * third,
    ]
}

impl fmt::Display for Activation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Chebyshev coefficients of `q`: those of its interpolation at 22 nodes.
pub const TAIL: [f64; 22] = [
    0.577_033_738_616_469_7,
    0.355_436_921_270_498_5,
    0.065_095_158_828_786_53,
    0.003_671_142_395_836_639,
    -0.001_112_844_743_352_632_5,
    -0.000_160_758_299_153_780_8,
    3.278_031_574_173_137e-5,
    5.442_441_645_505_016e-6,
    -1.515_466_555_317_148e-6,
    -1.429_760_818_116_992_8e-7,
    8.234_608_827_419_559e-8,
    -1.296_284_685_226_087e-9,
    -4.154_721_631_038_787e-9,
    6.347_058_278_707_451e-10,
    1.432_082_272_628_723_2e-10,
    -6.160_390_194_238_038e-11,
    2.061_215_387_926_281e-12,
    3.571_498_198_656_854_2e-12,
    -8.586_782_010_887_115e-13,
    -6.139_287_883_339_875e-14,
    7.441_508_714_836_163e-14,
    -1.446_797_769_320_091_7e-14,
];

pub const DENSITY_AT_ZERO: f64 = 0.398_942_280_401_432_7;

/// With `x = |a|/sqrt(2)` and `t = 2/(2 + x)` the tail is `exp(-x^2) t q(2 t - 1) / 2`, where `q` interpolates
/// `exp(x^2) erfc(x) / t` to 1e-15 without a branch, so that generated code computes the same.
fn normal_cumulative(a: f64) -> f64 {
    let t = 2.0 / (2.0 + a.abs() * std::f64::consts::FRAC_1_SQRT_2);
    let w = 2.0 * t - 1.0;
    // Clenshaw's recurrence.
    let (mut next, mut last) = (0.0, 0.0);
    for coefficient in TAIL[1..].iter().rev() {
        (next, last) = (2.0 * w * next - last + coefficient, next);
    }
    let q = w * next - last + TAIL[0];
    let tail = 0.5 * t * q * (-0.5 * a * a).exp();
    if a > 0.0 { 1.0 - tail } else { tail }
}
