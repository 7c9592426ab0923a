//! Activations of layers, with their exact derivatives.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::error::ModelError;

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
}

impl Activation {
    /// All activations, in the order in which they are listed.
    pub const ALL: [Activation; 4] = [Self::Linear, Self::Elu, Self::Tanh, Self::Sigmoid];

    /// The name in model files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Elu => "elu",
            Self::Tanh => "tanh",
            Self::Sigmoid => "sigmoid",
        }
    }

    /// `phi(a)`.
    pub fn value(self, a: f64) -> f64 {
        match self {
            Self::Linear => a,
            Self::Elu if a > 0.0 => a,
            Self::Elu => a.exp_m1(),
            Self::Tanh => a.tanh(),
            Self::Sigmoid => sigmoid(a),
        }
    }

    /// `phi'(a)`.
    pub fn slope(self, a: f64) -> f64 {
        match self {
            Self::Linear => 1.0,
            Self::Elu if a > 0.0 => 1.0,
            Self::Elu => a.exp(),
            Self::Tanh => 1.0 - a.tanh() * a.tanh(),
            Self::Sigmoid => sigmoid(a) * (1.0 - sigmoid(a)),
        }
    }

    /// `phi(a)` with its first three derivatives; of elu at zero, where those from the second on jump, the ones of
    /// the negative side.
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
        }
    }

    /// `phi''(a)`; of elu at zero, where it jumps, that of the negative side.
    pub fn curvature(self, a: f64) -> f64 {
        match self {
            Self::Linear => 0.0,
            Self::Elu if a > 0.0 => 0.0,
            Self::Elu => a.exp(),
            Self::Tanh => -2.0 * a.tanh() * (1.0 - a.tanh() * a.tanh()),
            Self::Sigmoid => {
                let s = sigmoid(a);
                s * (1.0 - s) * (1.0 - 2.0 * s)
            }
        }
    }
}

fn sigmoid(a: f64) -> f64 {
    1.0 / (1.0 + (-a).exp())
}

impl fmt::Display for Activation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Activation {
    type Err = ModelError;

    fn from_str(name: &str) -> Result<Self, ModelError> {
        let known = Self::ALL.into_iter().find(|known| known.name() == name);
        known.ok_or_else(|| {
            let name: String = name.chars().take(40).collect();
            let expected = format!("one of {}", Self::ALL.map(Self::name).join(", "));
            ModelError::invalid("activation", format!("{name:?}"), expected)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_and_curvatures_equal_central_differences() {
        let h = 1e-5;
        for phi in Activation::ALL {
            for a in [-3.0, -0.7, -0.02, 0.3, 2.5] {
                let slope = (phi.value(a + h) - phi.value(a - h)) / (2.0 * h);
                assert!((phi.slope(a) - slope).abs() < 1e-9, "{phi} at {a}");
                let curvature = (phi.slope(a + h) - phi.slope(a - h)) / (2.0 * h);
                assert!((phi.curvature(a) - curvature).abs() < 1e-9, "{phi} at {a}");
            }
        }
    }

    #[test]
    fn jet_has_the_value_and_the_derivatives() {
        let h = 1e-5;
        for phi in Activation::ALL {
            for a in [-3.0, -0.7, -0.02, 0.3, 2.5] {
                let [value, slope, curvature, third] = phi.jet(a);
                assert!((value - phi.value(a)).abs() < 1e-15, "{phi} at {a}");
                assert!((slope - phi.slope(a)).abs() < 1e-15, "{phi} at {a}");
                assert!((curvature - phi.curvature(a)).abs() < 1e-15, "{phi} at {a}");
                let difference = (phi.curvature(a + h) - phi.curvature(a - h)) / (2.0 * h);
                assert!((third - difference).abs() < 1e-8, "{phi} at {a}");
            }
            assert!(phi.jet(-0.0)[2] == phi.curvature(0.0));
        }
    }

    #[test]
    fn large_arguments_stay_finite() {
        for phi in Activation::ALL {
            for a in [-800.0, 800.0] {
                assert!(phi.jet(a).iter().all(|v| v.is_finite()), "{phi} at {a}");
                assert!(phi.value(a).is_finite(), "{phi} at {a}");
                assert!(phi.slope(a).is_finite(), "{phi} at {a}");
            }
        }
    }

    #[test]
    fn names_are_read_back_and_others_refused() {
        for phi in Activation::ALL {
            assert_eq!(phi.name().parse(), Ok(phi));
        }
        let refused = "gelu".parse::<Activation>().unwrap_err();
        assert!(refused.to_string().contains("linear, elu, tanh, sigmoid"));
    }
}
