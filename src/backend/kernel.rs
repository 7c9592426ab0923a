//! The constants of the sine-and-cosine kernel as text.

use super::literal::Literal;
use crate::ir::kernel;

/// Spelled constants, in the order in which kernels use them.
#[derive(Clone, Debug)]
pub struct KernelText {
    /// Largest magnitude of an argument.
    pub limit: String,
    /// 2/pi.
    pub two_over_pi: String,
    /// What rounds to an integer when added.
    pub round: String,
    /// pi/2 in three parts.
    pub pi_2: Vec<String>,
    /// Coefficients of the sine.
    pub sin: Vec<String>,
    /// Coefficients of the cosine.
    pub cos: Vec<String>,
}

impl KernelText {
    /// The constants in double precision.
    pub fn new() -> Self {
        let text = |value: f64| {
            Literal::new(value)
                .expect("the kernel's constants are finite")
                .to_string()
        };
        let signed = |values: &[f64]| -> Vec<String> {
            values
                .iter()
                .map(|&value| {
                    if value < 0.0 {
                        format!("({})", text(value))
                    } else {
                        text(value)
                    }
                })
                .collect()
        };
        Self {
            limit: text(kernel::LIMIT),
            two_over_pi: text(kernel::TWO_OVER_PI),
            round: text(kernel::ROUND),
            pi_2: signed(&kernel::PI_2),
            sin: signed(&kernel::SIN),
            cos: signed(&kernel::COS),
        }
    }
}
