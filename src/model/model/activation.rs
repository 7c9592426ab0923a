//! Activations of layers, with their exact derivatives.

use std::fmt;

use serde::{Deserialize, Serialize};

/// What a layer applies to each of its units.
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

/// sqrt(2/pi), of [`Activation::GeluTanh`].
pub const GELU_RATE: f64 = 0.797_884_560_802_865_4;
/// Of [`Activation::GeluTanh`].
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

    /// `phi(a)` with its first three derivatives; of elu at zero, where those from the second on jump, the ones of the
    /// negative side.
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
                let (cumulative, density) = (normal_cumulative(a), normal_density(a));
                // Far out the density is zero, and the powers of a before it need not be finite.
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

/// The larger of `a` and zero; NaN of NaN.
fn positive_part(a: f64) -> f64 {
    if a < 0.0 { 0.0 } else { a }
}

fn sigmoid(a: f64) -> f64 {
    1.0 / (1.0 + (-a).exp())
}

fn gelu_tanh(a: f64) -> [f64; 4] {
    // Where tanh is one to the last bit; further out its argument's powers would only overflow.
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

/// `1/sqrt(2 pi)`.
pub const DENSITY_AT_ZERO: f64 = 0.398_942_280_401_432_7;

/// Probability that a normal number is below `a`.
///
/// With `x = |a|/sqrt(2)` and `t = 2/(2 + x)` the tail is `exp(-x^2) t q(2 t - 1) / 2`, where `q` is the Chebyshev
/// interpolation of `exp(x^2) erfc(x) / t`. Its error is below 1e-15 of the tail, and it needs no branch, so that
/// generated code computes the same.
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
    match a > 0.0 {
        true => 1.0 - tail,
        false => tail,
    }
}

fn normal_density(a: f64) -> f64 {
    DENSITY_AT_ZERO * (-0.5 * a * a).exp()
}
