//! Expressions, arrays and functions of generated code, before a dialect spells them.

use super::ident::Ident;
use crate::ir::{Binary, Unary};

/// A subscript `offset + sum_i stride_i * name_i`.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Index {
    /// Strides and the variables that they multiply.
    pub terms: Vec<(usize, Ident)>,
    pub offset: usize,
}

impl Index {
    pub(crate) fn fixed(offset: usize) -> Self {
        Self {
            terms: Vec::new(),
            offset,
        }
    }

    pub(crate) fn variable(name: &Ident) -> Self {
        Self::fixed(0).plus(1, name)
    }

    pub(crate) fn plus(mut self, stride: usize, name: &Ident) -> Self {
        self.terms.push((stride, name.clone()));
        self
    }

    pub(crate) fn shifted(mut self, by: usize) -> Self {
        self.offset += by;
        self
    }
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Expr {
    Literal(f64),
    Name(Ident),
    /// `array[index]`
    Element(Ident, Index),
    /// `table[row][col]`
    Entry(Ident, Index, Index),
    /// `-a` or `f(a)`
    Unary(Unary, Box<Expr>),
    Infix(Binary, Box<Expr>, Box<Expr>),
    /// The second where the first is zero, else the third.
    Select(Box<[Expr; 3]>),
}

impl Expr {
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
    pub len: usize,
    /// Length of the whole array.
    pub of: usize,
    /// Whether the array is a parameter of the function rather than a local array.
    pub is_parameter: bool,
}

impl Span {
    pub(crate) fn whole(array: &Ident, len: usize, is_parameter: bool) -> Self {
        Self {
            array: array.clone(),
            offset: 0,
            len,
            of: len,
            is_parameter,
        }
    }

    pub(crate) fn element(&self, index: &Index) -> Expr {
        Expr::Element(self.array.clone(), index.clone().shifted(self.offset))
    }

    pub(crate) fn is_whole(&self) -> bool {
        self.offset == 0 && self.len == self.of
    }
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

/// A generated function.
#[derive(Clone, Debug, PartialEq)]
pub struct Function {
    pub name: Ident,
    pub docs: Vec<String>,
    pub parameters: Vec<Parameter>,
    /// Parameters that the body does not mention.
    pub unused: Vec<Ident>,
    /// Its statements, each line with its end.
    pub body: String,
}

impl Function {
    /// The function behind its head, with a mention of each parameter that nothing reads; ends without
    /// a newline.
    pub(crate) fn definition(&self, head: &str, mention: impl Fn(&Ident) -> String) -> String {
        let unused = self.unused.iter();
        let unused: String = unused
            .map(|name| format!("    {}\n", mention(name)))
            .collect();
        format!("{head} {{\n{unused}{}}}", self.body)
    }
}
