//! Values of a program that is being built, as numbers that formulas are written with.

use std::cell::RefCell;
use std::ops::{Add, Div, Mul, Neg, Sub};

use Scalar::{Known, Value};

use super::*;

/// The program, while formulas add to it.
pub(super) type Sheet<'b> = RefCell<&'b mut ProgramBuilder>;

/// A number that is known, or a value of the program. Each operator adds an operation, in the order in which Rust
/// evaluates them, unless its result is known, or is an operand.
#[derive(Clone, Copy)]
pub(super) struct Number<'b> {
    sheet: &'b Sheet<'b>,
    scalar: Scalar,
}

#[derive(Clone, Copy)]
enum Scalar {
    Known(f64),
    Value(ValueId),
}

impl<'b> Number<'b> {
    pub(crate) fn new(sheet: &'b Sheet<'b>, id: ValueId) -> Self {
        let scalar = Value(id);
        Self { sheet, scalar }
    }

    pub(crate) fn known(sheet: &'b Sheet<'b>, value: f64) -> Self {
        let scalar = Known(value);
        Self { sheet, scalar }
    }

    pub(crate) fn constant(self, value: f64) -> Self {
        Self::known(self.sheet, value)
    }

    pub(crate) fn id(self) -> ValueId {
        match self.scalar {
            Known(number) => self.sheet.borrow_mut().constant(number),
            Value(id) => id,
        }
    }

    pub(crate) fn unary(self, op: Unary) -> Self {
        let id = self.id();
        Self::new(self.sheet, self.sheet.borrow_mut().unary(op, id))
    }

    pub(crate) fn abs(self) -> Self {
        self.unary(Unary::Abs)
    }

    fn binary(self, op: Binary, other: Self) -> Self {
        match (op, self.scalar, other.scalar) {
            (Binary::Add, Known(a), Known(b)) => self.constant(a + b),
            (Binary::Sub, Known(a), Known(b)) => self.constant(a - b),
            (Binary::Mul, Known(a), Known(b)) => self.constant(a * b),
            (Binary::Add | Binary::Sub, _, Known(0.0)) => self,
            (Binary::Add, Known(0.0), _) => other,
            (Binary::Sub, Known(0.0), _) => -other,
            (Binary::Mul, Known(0.0), _) | (Binary::Mul, _, Known(0.0)) => self.constant(0.0),
            (Binary::Mul | Binary::Div, _, Known(1.0)) => self,
            (Binary::Mul, Known(1.0), _) => other,
            (Binary::Mul, _, Known(-1.0)) => -self,
            (Binary::Mul, Known(-1.0), _) => -other,
            _ => {
                let (a, b) = (self.id(), other.id());
                Self::new(self.sheet, self.sheet.borrow_mut().binary(op, a, b))
            }
        }
    }
}

pub(super) fn numbers<'b>(sheet: &'b Sheet<'b>, ids: &[ValueId]) -> Vec<Number<'b>> {
    ids.iter().map(|&id| Number::new(sheet, id)).collect()
}

pub(super) fn ids(numbers: &[Number]) -> Vec<ValueId> {
    numbers.iter().map(|number| number.id()).collect()
}

impl Neg for Number<'_> {
    type Output = Self;

    fn neg(self) -> Self {
        match self.scalar {
            Known(number) => self.constant(-number),
            Value(_) => self.unary(Unary::Neg),
        }
    }
}

macro_rules! operators {
    ($($operator:ident $method:ident,)*) => {$(
        impl $operator for Number<'_> {
            type Output = Self;

            fn $method(self, other: Self) -> Self {
                self.binary(Binary::$operator, other)
            }
        }

        impl $operator<f64> for Number<'_> {
            type Output = Self;

            fn $method(self, other: f64) -> Self {
                self.binary(Binary::$operator, self.constant(other))
            }
        }

        impl<'b> $operator<Number<'b>> for f64 {
            type Output = Number<'b>;

            fn $method(self, other: Number<'b>) -> Number<'b> {
                other.constant(self).binary(Binary::$operator, other)
            }
        }
    )*};
}

operators!(Add add, Sub sub, Mul mul, Div div,);
