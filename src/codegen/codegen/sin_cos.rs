//! The constants of the sine-and-cosine kernel as text.

use super::dialect::Dialect;
use super::options::Precision;
use crate::ir::{sin_cos, sin_cos_f32};

/// Spelled constants, in the order in which kernels use them.
#[derive(Clone, Debug)]
pub(crate) struct KernelText {
    pub limit: String,
    pub two_over_pi: String,
    pub round: String,
    pub pi_2: Vec<String>,
    pub sin: Vec<String>,
    pub cos: Vec<String>,
    /// From bit 1 of a number to its sign.
    pub to_sign: usize,
}

impl KernelText {
    pub(crate) fn new(precision: Precision, dialect: &dyn Dialect) -> Self {
        let wide = |values: [f32; 3]| values.map(f64::from);
        let (single, lists) = match precision {
            Precision::Double => {
                use sin_cos::{COS, LIMIT, PI_2, ROUND, SIN, TWO_OVER_PI};
                let lists = [PI_2.to_vec(), SIN.to_vec(), COS.to_vec()];
                ([LIMIT, TWO_OVER_PI, ROUND], lists)
            }
            Precision::Single => {
                use sin_cos_f32::{COS, LIMIT, PI_2, ROUND, SIN, TWO_OVER_PI};
                let lists = [PI_2, SIN, COS].map(|values| wide(values).to_vec());
                (wide([LIMIT, TWO_OVER_PI, ROUND]), lists)
            }
        };
        let signed = |value: f64| match value < 0.0 {
            true => format!("({})", dialect.literal(value)),
            false => dialect.literal(value),
        };
        let [pi_2, sin, cos] = lists.map(|values| values.into_iter().map(signed).collect());
        let [limit, two_over_pi, round] = single.map(|value| dialect.literal(value));
        Self {
            limit,
            two_over_pi,
            round,
            pi_2,
            sin,
            cos,
            to_sign: precision.bits() - 2,
        }
    }
}
