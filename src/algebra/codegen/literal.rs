//! Numbers in generated code.

use std::fmt;

use super::precision::Precision;

/// A finite number, spelled with the fewest digits that read back to the same bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Literal(f64);

impl Literal {
    /// Zero.
    pub const ZERO: Literal = Literal(0.0);

    /// The literal of a number; `None` if it is infinite or not a number.
    pub fn new(value: f64) -> Option<Self> {
        value.is_finite().then_some(Self(value))
    }

    /// The number with the fewest digits that read back to the nearest number of a precision.
    pub fn digits(self, precision: Precision) -> String {
        match precision {
            Precision::Double => self.to_string(),
            Precision::Single => format!("{:?}", self.0 as f32),
        }
    }

    /// Whether the literal begins with a minus.
    pub fn is_negative(self) -> bool {
        self.0.is_sign_negative()
    }
}

impl fmt::Display for Literal {
    /// Always with a point or an exponent, so that it is no integer in any target.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}", self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn literals_read_back_to_the_same_bits_and_in_single_precision_to_the_nearest_number() {
        for value in [
            0.36,
            -0.0,
            1e-300,
            5e-324,
            1e16,
            123_456_789.0,
            0.1 + 0.2,
            1e-44,
            16_777_217.0,
        ] {
            let literal = Literal::new(value).expect("finite");
            let texts = [Precision::Double, Precision::Single].map(|of| literal.digits(of));
            let (double, single): (f64, f32) = (
                texts[0].parse().expect("a number"),
                texts[1].parse().expect("a number"),
            );
            assert_eq!(double.to_bits(), value.to_bits(), "{texts:?}");
            assert_eq!(single.to_bits(), (value as f32).to_bits(), "{texts:?}");
            let has_point = |text: &String| text.contains(['.', 'e']);
            assert!(
                texts.iter().all(has_point),
                "{texts:?} would be integers in C"
            );
        }
    }

    #[test]
    fn literal_of_non_finite_number_is_refused() {
        assert_eq!(Literal::new(f64::NAN), None);
        assert_eq!(Literal::new(f64::NEG_INFINITY), None);
    }
}
