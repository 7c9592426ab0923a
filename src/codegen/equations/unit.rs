//! Physical units as products of powers of metre, radian, kilogram and second.

use std::fmt;
use std::ops::{Div, Mul};

/// A unit: exponents of m, rad, kg and s. The default is the unit 1.
///
/// Radians are kept apart from 1, so that angles and lengths can be told from pure numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Unit([i8; 4]);

const SYMBOLS: [&str; 4] = ["m", "rad", "kg", "s"];
const METRE: Unit = Unit([1, 0, 0, 0]);
const RADIAN: Unit = Unit([0, 1, 0, 0]);
const SECOND: Unit = Unit([0, 0, 0, 1]);
const NEWTON: Unit = Unit([1, 0, 1, -2]);
const NEWTON_METRE: Unit = Unit([2, 0, 1, -2]);

impl Unit {
    /// The unit of a position or generalised force that a model file names, if it is one of
    /// `m`, `rad`, `N`, `N m`.
    pub(crate) fn from_name(name: &str) -> Option<Self> {
        match name {
            "m" => Some(METRE),
            "rad" => Some(RADIAN),
            "N" => Some(NEWTON),
            "N m" => Some(NEWTON_METRE),
            _ => None,
        }
    }

    /// The unit of the generalised force that does work along a position: N for m, N m for rad.
    pub(crate) fn dual(self) -> Option<Self> {
        match self {
            METRE => Some(NEWTON),
            RADIAN => Some(NEWTON_METRE),
            _ => None,
        }
    }

    pub(crate) fn per_second(self) -> Self {
        self / SECOND
    }

    pub(crate) fn power(self, exponent: i8) -> Self {
        Self(self.0.map(|own| own.saturating_mul(exponent)))
    }

    /// The unit with this text between factors, and powers above 1 in this spelling.
    pub(crate) fn spelled(self, between: &str, power: impl Fn(i8) -> String) -> String {
        let product = |factors: &[(&str, i8)]| {
            let factors = factors.iter().map(|&(symbol, exponent)| match exponent {
                1 => symbol.to_owned(),
                _ => format!("{symbol}{}", power(exponent)),
            });
            factors.collect::<Vec<_>>().join(between)
        };
        let [above, below] = self.fraction();
        let above = match above.is_empty() {
            true => "1".to_owned(),
            false => product(&above),
        };
        match below.len() {
            0 => above,
            1 => format!("{above}/{}", product(&below)),
            _ => format!("{above}/({})", product(&below)),
        }
    }

    /// Numerator and denominator as lists of symbol and positive power.
    fn fraction(self) -> [Vec<(&'static str, i8)>; 2] {
        match self {
            NEWTON => [vec![("N", 1)], Vec::new()],
            NEWTON_METRE => [vec![("N", 1), ("m", 1)], Vec::new()],
            Self(exponents) => [1, -1].map(|sign| {
                let order = [2, 0, 1, 3].map(|at| (SYMBOLS[at], exponents[at] * sign));
                order.into_iter().filter(|&(_, power)| power > 0).collect()
            }),
        }
    }
}

impl Mul for Unit {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        Self(std::array::from_fn(|at| {
            self.0[at].saturating_add(other.0[at])
        }))
    }
}

impl Div for Unit {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        self * other.power(-1)
    }
}

/// `1`, `m/s^2`, `1/kg`, `rad/(kg m^2)`.
impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.spelled(" ", |power| format!("^{power}")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gain_of_a_force_on_an_acceleration_is_one_over_a_mass() {
        let [metre, radian] = ["m", "rad"].map(|name| Unit::from_name(name).expect("known"));
        let [force, moment] = [metre, radian].map(|unit| unit.dual().expect("known"));
        assert_eq!([force, moment].map(|unit| unit.to_string()), ["N", "N m"]);
        let [linear, angular] = [metre, radian].map(|unit| unit.per_second().per_second());
        for (unit, text) in [
            (linear, "m/s^2"),
            (linear / force, "1/kg"),
            (angular / moment, "rad/(kg m^2)"),
            (linear / radian, "m/(rad s^2)"),
            (linear / linear, "1"),
        ] {
            assert_eq!(unit.to_string(), text);
        }
        assert_eq!((Unit::from_name("deg"), force.dual()), (None, None));
    }
}
