//! Factors of a normal form that are not taken apart, and the primes of constants.

use num_bigint::{BigInt, BigUint};
use num_integer::Integer;
use num_traits::ToPrimitive;

use super::coefficient::Rational;
use super::polynomial::CanonicalForm;
use crate::node::{ExprId, SymbolId};

#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) enum Atom {
    Symbol(SymbolId),
    /// A sum whose leading coefficient has size one and is not negative, to negative powers only.
    Sum(CanonicalForm),
    /// `form^(1/index)`, to powers below the index.
    Root(CanonicalForm, u32),
    Log(CanonicalForm),
    Abs(CanonicalForm),
    Sign(CanonicalForm),
    Tan(CanonicalForm),
    Tanh(CanonicalForm),
    /// An expression that is too large to take apart, or has no value.
    Opaque(ExprId),
}

const LARGEST_DIVISOR: u64 = 2_000;

/// A positive number as a product of primes to integer powers. What is left after small divisors
/// counts as a prime.
pub(super) fn prime_powers(value: &Rational) -> Vec<(CanonicalForm, i32)> {
    let form = |prime: BigUint| CanonicalForm::constant(Rational::from(BigInt::from(prime)).into());
    let mut powers = Vec::new();
    for (part, sign) in [(value.numer(), 1), (value.denom(), -1)] {
        let mut rest = part.magnitude().clone();
        for divisor in (2..=LARGEST_DIVISOR).filter(|d| *d == 2 || d % 2 == 1) {
            if rest == BigUint::from(1_u8) {
                break;
            }
            if rest.to_u64().is_some_and(|rest| divisor * divisor > rest) {
                break;
            }
            let divisor = BigUint::from(divisor);
            let mut count = 0;
            loop {
                let (quotient, remainder) = rest.div_rem(&divisor);
                if remainder != BigUint::ZERO {
                    break;
                }
                rest = quotient;
                count += sign;
            }
            if count != 0 {
                powers.push((form(divisor), count));
            }
        }
        if rest != BigUint::from(1_u8) {
            powers.push((form(rest), sign));
        }
    }
    powers
}
