//! Values of a program that is being built, as numbers that formulas are written with.

use std::cell::RefCell;
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::sums::scaled;
use crate::ir::{Binary, ProgramBuilder, Unary, ValueId};

/// The program, while formulas add to it.
pub(super) type Sheet<'b> = RefCell<&'b mut ProgramBuilder>;

/// A value of the program; each operator adds an operation, in the order in which Rust evaluates them.
#[derive(Clone, Copy)]
pub(super) struct Number<'b> {
    pub id: ValueId,
    sheet: &'b Sheet<'b>,
}

impl<'b> Number<'b> {
    pub(crate) fn new(sheet: &'b Sheet<'b>, id: ValueId) -> Self {
        Self { id, sheet }
    }

    pub(crate) fn known(sheet: &'b Sheet<'b>, value: f64) -> Self {
        Self::new(sheet, sheet.borrow_mut().constant(value))
    }

    /// A constant of the same program.
    pub(crate) fn constant(self, value: f64) -> Self {
        Self::known(self.sheet, value)
    }

    /// `coefficient * self` without needless operations.
    pub(crate) fn scaled(self, coefficient: f64) -> Self {
        let id = scaled(&mut self.sheet.borrow_mut(), coefficient, self.id);
        Self::new(self.sheet, id)
    }

    pub(crate) fn unary(self, op: Unary) -> Self {
        Self::new(self.sheet, self.sheet.borrow_mut().unary(op, self.id))
    }

    pub(crate) fn abs(self) -> Self {
        self.unary(Unary::Abs)
    }

    fn binary(self, op: Binary, other: Self) -> Self {
        let id = self.sheet.borrow_mut().binary(op, self.id, other.id);
        Self::new(self.sheet, id)
    }
}

pub(super) fn numbers<'b>(sheet: &'b Sheet<'b>, ids: &[ValueId]) -> Vec<Number<'b>> {
    ids.iter().map(|&id| Number::new(sheet, id)).collect()
}

pub(super) fn ids(numbers: &[Number]) -> Vec<ValueId> {
    numbers.iter().map(|number| number.id).collect()
}

impl Neg for Number<'_> {
    type Output = Self;

    fn neg(self) -> Self {
        self.unary(Unary::Neg)
    }
}

/// Operators between numbers, and between a number and a constant.
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
