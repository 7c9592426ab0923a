//! Code as typed statements, before a dialect spells it.

use super::fours::Fours;
use super::ident::Ident;
use super::lanes::Row;
use crate::ir::{Binary, Table, Unary};

/// A subscript `offset + sum_i stride_i * name_i`.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Index {
    /// Strides and the variables that they multiply.
    pub terms: Vec<(usize, Ident)>,
    /// What is added.
    pub offset: usize,
}

impl Index {
    /// A constant subscript.
    pub(crate) fn fixed(offset: usize) -> Self {
        Self {
            terms: Vec::new(),
            offset,
        }
    }

    /// A loop variable.
    pub(crate) fn variable(name: &Ident) -> Self {
        Self::fixed(0).plus(1, name)
    }

    /// With `stride * name` added.
    pub(crate) fn plus(mut self, stride: usize, name: &Ident) -> Self {
        self.terms.push((stride, name.clone()));
        self
    }

    /// With a constant added.
    pub(crate) fn shifted(mut self, by: usize) -> Self {
        self.offset += by;
        self
    }

    /// With another subscript added.
    pub(crate) fn sum(mut self, other: &Self) -> Self {
        self.terms.extend_from_slice(&other.terms);
        self.shifted(other.offset)
    }
}

/// An expression.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Expr {
    /// A finite number.
    Literal(f64),
    /// A scalar variable.
    Name(Ident),
    /// `array[index]`
    Element(Ident, Index),
    /// `table[row][col]`
    Entry(Ident, Index, Index),
    /// `-a` or `f(a)`
    Unary(Unary, Box<Expr>),
    /// `a op b`
    Infix(Binary, Box<Expr>, Box<Expr>),
    /// The second where the first is zero, else the third.
    Select(Box<[Expr; 3]>),
}

impl Expr {
    /// `a op b`
    pub(crate) fn infix(op: Binary, a: Expr, b: Expr) -> Self {
        Self::Infix(op, Box::new(a), Box::new(b))
    }
}

/// `len` elements of an array from `offset` on, handed to a function.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Span {
    pub array: Ident,
    /// First element.
    pub offset: usize,
    /// Number of elements.
    pub len: usize,
    /// Length of the whole array.
    pub of: usize,
    /// Whether the array is a parameter of the function rather than a local array.
    pub is_parameter: bool,
}

impl Span {
    /// Whether the span is the whole array.
    pub(crate) fn is_whole(&self) -> bool {
        self.offset == 0 && self.len == self.of
    }
}

/// A statement.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Stmt {
    /// A named scalar that never changes.
    Let(Ident, Expr),
    /// A named array that never changes.
    LetArray(Ident, Vec<Expr>),
    /// An array whose elements are assigned later; in languages without lanes they are zero before.
    Declare(Ident, usize),
    /// `target = value`
    Assign(Expr, Expr),
    /// `target += value`
    AddAssign(Expr, Expr),
    /// A loop of the variable from 0 to below the count.
    For(Ident, usize, Vec<Stmt>),
    /// Sine and cosine of one argument by the kernel's core, which notes arguments beyond
    /// its limit for the whole block of lanes.
    SinCosLane {
        argument: Expr,
        /// New scalar for the sine.
        sine: Ident,
        /// New scalar for the cosine.
        cosine: Ident,
        /// Whether sine and cosine are read.
        is_used: [bool; 2],
    },
    /// A call of another generated function or, without a name, of the sine-and-cosine kernel.
    Call {
        callee: Option<Ident>,
        /// What it reads; of the kernel the angles.
        read: Vec<Span>,
        /// What it writes; of the kernel sines and cosines.
        written: Vec<Span>,
    },
    /// The columns of one row; languages with lanes run them side by side.
    Row(Box<Row>),
    /// Sums of vectors of four numbers.
    Fours(Box<Fours>),
}

/// What a parameter of a generated function is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// An array that is read.
    Input,
    /// An array that is written.
    Output,
    /// An array that is read, then written.
    InOut,
    /// A scalar that is read.
    Scalar,
}

/// A parameter of a generated function, in a language or, with a text for a name, in any.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter<N = Ident> {
    pub name: N,
    /// Number of elements; an output may have none.
    pub len: usize,
    /// What it is for.
    pub role: Role,
}

/// A constant matrix with static storage.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ConstTable {
    pub name: Ident,
    pub values: Table,
    /// Whether rows are read in lanes.
    pub is_in_lanes: bool,
    /// Whether entries are read by their subscripts.
    pub is_entered: bool,
}

/// A generated function.
#[derive(Clone, Debug, PartialEq)]
pub struct Function {
    pub name: Ident,
    pub docs: Vec<String>,
    pub parameters: Vec<Parameter>,
    /// Parameters that the body does not mention.
    pub unused: Vec<Ident>,
    /// Arrays that are assigned in lanes.
    pub in_lanes: Vec<Ident>,
    /// What it does.
    pub body: Vec<Stmt>,
}
