//! What an expression is made of.

use std::fmt;

use super::number::Number;

/// A canonical expression of one [`ExprPool`](super::ExprPool).
///
/// Two expressions of a pool are structurally equal exactly if their ids are equal. Children
/// always have smaller ids than their parents. The order of ids is the order of creation and
/// means nothing else: use [`ExprPool::compare`](super::ExprPool::compare) to sort.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ExprId(pub(super) u32);

impl ExprId {
    /// The exact `0`, present in every pool.
    pub const ZERO: ExprId = ExprId(0);
    /// The exact `1`, present in every pool.
    pub const ONE: ExprId = ExprId(1);

    /// Position in the pool, for tables indexed by expression.
    pub(crate) fn index(self) -> usize {
        self.0 as usize
    }
}

/// A named variable of one pool.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SymbolId(pub(super) u32);

impl SymbolId {
    /// Position among the pool's symbols, in order of first mention.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// One level of a canonical expression; see [`ExprPool`](super::ExprPool) for the invariants.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Node {
    /// A constant.
    Number(Number),
    /// A variable.
    Symbol(SymbolId),
    /// Two or more terms `coefficient * rest`, sorted, with distinct rests; never a sum itself.
    Sum(Box<[ExprId]>),
    /// Two or more factors, the numeric one first; never a product itself.
    Product(Box<[ExprId]>),
    /// Base and exponent; the exponent is neither 0 nor 1.
    Power(ExprId, ExprId),
    /// A function of one argument.
    Apply(Function, ExprId),
}

impl Node {
    /// The operands, left to right.
    pub(super) fn operands(&self) -> impl Iterator<Item = ExprId> + '_ {
        let (pair, list): ([Option<ExprId>; 2], &[ExprId]) = match self {
            Node::Number(_) | Node::Symbol(_) => ([None, None], &[]),
            Node::Sum(operands) | Node::Product(operands) => ([None, None], operands),
            Node::Power(base, exponent) => ([Some(*base), Some(*exponent)], &[]),
            Node::Apply(_, argument) => ([Some(*argument), None], &[]),
        };
        pair.into_iter().flatten().chain(list.iter().copied())
    }
}

/// The elementary functions. Arguments are real, in radians where they are angles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(missing_docs, reason = "the names say it")]
pub enum Function {
    Sin,
    Cos,
    Tan,
    Tanh,
    Exp,
    /// Natural logarithm.
    Log,
    /// Non-negative square root.
    Sqrt,
    Abs,
    /// `-1`, `0` or `1`: the derivative of [`Function::Abs`].
    Sign,
}

impl Function {
    /// All functions, in the order in which sums list them.
    pub const ALL: [Function; 9] = [
        Function::Sin,
        Function::Cos,
        Function::Tan,
        Function::Tanh,
        Function::Exp,
        Function::Log,
        Function::Sqrt,
        Function::Abs,
        Function::Sign,
    ];

    /// The name in the term grammar.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Function::Sin => "sin",
            Function::Cos => "cos",
            Function::Tan => "tan",
            Function::Tanh => "tanh",
            Function::Exp => "exp",
            Function::Log => "log",
            Function::Sqrt => "sqrt",
            Function::Abs => "abs",
            Function::Sign => "sign",
        }
    }

    /// The function of that name; `ln` and `sgn` are names of the logarithm and the sign too.
    pub fn by_name(name: &str) -> Option<Function> {
        let name = match name {
            "ln" => "log",
            "sgn" => "sign",
            name => name,
        };
        Function::ALL
            .into_iter()
            .find(|function| function.name() == name)
    }

    /// How the function answers a change of its argument's sign.
    pub(crate) fn parity(self) -> Parity {
        match self {
            Function::Sin | Function::Tan | Function::Tanh | Function::Sign => Parity::Odd,
            Function::Cos | Function::Abs => Parity::Even,
            Function::Exp | Function::Log | Function::Sqrt => Parity::Neither,
        }
    }

    /// The value at `argument`; NaN or infinite where the function has none.
    pub fn evaluate(self, argument: f64) -> f64 {
        match self {
            Function::Sin => argument.sin(),
            Function::Cos => argument.cos(),
            Function::Tan => argument.tan(),
            Function::Tanh => argument.tanh(),
            Function::Exp => argument.exp(),
            Function::Log => argument.ln(),
            Function::Sqrt => argument.sqrt(),
            Function::Abs => argument.abs(),
            // f64::signum gives 1 for zero.
            Function::Sign if argument == 0.0 => 0.0,
            Function::Sign => argument.signum(),
        }
    }
}

impl fmt::Display for Function {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}

/// Symmetry of a function under a change of sign.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Parity {
    /// `f(-x) = f(x)`.
    Even,
    /// `f(-x) = -f(x)`.
    Odd,
    /// Neither.
    Neither,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parity_agrees_with_values() {
        for function in Function::ALL {
            let (plus, minus) = (function.evaluate(0.7), function.evaluate(-0.7));
            match function.parity() {
                Parity::Even => assert_eq!(plus, minus, "{function}"),
                Parity::Odd => assert_eq!(plus, -minus, "{function}"),
                Parity::Neither => assert!(plus != minus && plus != -minus, "{function}"),
            }
        }
    }

    #[test]
    fn sign_of_zero_is_zero() {
        assert_eq!(Function::Sign.evaluate(0.0), 0.0);
        assert_eq!(Function::Sign.evaluate(-0.0), 0.0);
    }
}
