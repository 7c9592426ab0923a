//! The elementary functions, each a row of a table.

use super::*;

/// The elementary functions. Arguments are real, in radians where they are angles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Function {
    Sin,
    Cos,
    Tan,
    Tanh,
    Exp,
    Log,
    Sqrt,
    Abs,
    /// `-1`, `0` or `1`: the derivative of [`Function::Abs`].
    Sign,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Parity {
    /// `f(-x) = f(x)`.
    Even,
    /// `f(-x) = -f(x)`.
    Odd,
    Neither,
}

pub(super) struct Row {
    /// Names in the term grammar; the first is printed.
    names: &'static [&'static str],
    pub(super) parity: Parity,
    is_circular: bool,
    value: fn(f64) -> f64,
    pub(super) image: fn(Interval) -> Interval,
    /// Whether slopes are bounded on an interval of arguments, and no jump lies in it.
    pub(super) is_lipschitz: fn(Interval) -> bool,
    /// `f'(x)`, given `x` and `f(x)`, written with the latter where that saves work.
    pub(super) derivative: fn(&mut ExprPool, ExprId, ExprId) -> ExprId,
}

/// In the order of the enum.
const ROWS: [Row; 9] = [
    Row {
        names: &["sin"],
        parity: Parity::Odd,
        is_circular: true,
        value: f64::sin,
        image: |x| x.oscillation(f64::sin, 0.5),
        is_lipschitz: |_| true,
        derivative: |pool, x, _| pool.apply(Function::Cos, x),
    },
    Row {
        names: &["cos"],
        parity: Parity::Even,
        is_circular: true,
        value: f64::cos,
        image: |x| x.oscillation(f64::cos, 0.0),
        is_lipschitz: |_| true,
        derivative: |pool, x, _| {
            let sine = pool.apply(Function::Sin, x);
            pool.neg(sine)
        },
    },
    Row {
        names: &["tan"],
        parity: Parity::Odd,
        is_circular: true,
        value: f64::tan,
        image: |x| x.branch(f64::tan),
        is_lipschitz: |x| x.branch(f64::tan) != Interval::ENTIRE,
        derivative: |pool, _, value| {
            let square = pool.powi(value, 2);
            pool.add(ExprId::ONE, square)
        },
    },
    Row {
        names: &["tanh"],
        parity: Parity::Odd,
        is_circular: false,
        value: f64::tanh,
        image: |x| {
            x.increasing(f64::tanh)
                .intersection(Interval::new(-1.0, 1.0))
        },
        is_lipschitz: |_| true,
        derivative: |pool, _, value| {
            let square = pool.powi(value, 2);
            pool.sub(ExprId::ONE, square)
        },
    },
    Row {
        names: &["exp"],
        parity: Parity::Neither,
        is_circular: false,
        value: f64::exp,
        image: Interval::exp,
        is_lipschitz: |_| true,
        derivative: |_, _, value| value,
    },
    Row {
        names: &["log", "ln"],
        parity: Parity::Neither,
        is_circular: false,
        value: f64::ln,
        image: Interval::log,
        is_lipschitz: |x| x.lo() > 0.0,
        derivative: |pool, x, _| pool.powi(x, -1),
    },
    Row {
        names: &["sqrt"],
        parity: Parity::Neither,
        is_circular: false,
        value: f64::sqrt,
        image: Interval::sqrt,
        is_lipschitz: |x| x.lo() > 0.0,
        derivative: |pool, _, value| {
            let reciprocal = pool.powi(value, -1);
            pool.scale(Number::HALF, reciprocal)
        },
    },
    Row {
        names: &["abs"],
        parity: Parity::Even,
        is_circular: false,
        value: f64::abs,
        image: Interval::abs,
        is_lipschitz: |_| true,
        derivative: |pool, x, _| pool.apply(Function::Sign, x),
    },
    Row {
        names: &["sign", "sgn"],
        parity: Parity::Odd,
        is_circular: false,
        // f64::signum gives 1 for zero.
        value: |x| if x == 0.0 { 0.0 } else { x.signum() },
        image: Interval::sign,
        is_lipschitz: |x| !x.contains(0.0),
        derivative: |_, _, _| ExprId::ZERO,
    },
];

impl Function {
    /// All functions, in the order in which sums list them.
    pub const ALL: [Function; ROWS.len()] = {
        use Function::*;
        [Sin, Cos, Tan, Tanh, Exp, Log, Sqrt, Abs, Sign]
    };

    pub(super) fn row(self) -> &'static Row {
        &ROWS[self as usize]
    }

    pub fn name(self) -> &'static str {
        self.row().names[0]
    }

    /// The function of that name; `ln` and `sgn` are names of the logarithm and the sign too.
    pub fn by_name(name: &str) -> Option<Function> {
        let mut all = Function::ALL.into_iter();
        all.find(|function| function.row().names.contains(&name))
    }

    /// The value at `argument`; NaN or infinite where the function has none.
    pub fn evaluate(self, argument: f64) -> f64 {
        (self.row().value)(argument)
    }

    /// Whether the argument is an angle.
    pub(crate) fn is_circular(self) -> bool {
        self.row().is_circular
    }

    pub(super) fn derivative(self, pool: &mut ExprPool, argument: ExprId, value: ExprId) -> ExprId {
        (self.row().derivative)(pool, argument, value)
    }

    /// Whether it is zero where its argument is; in floats, nowhere else: none is a multiple of pi.
    pub(super) fn vanishes_at_zero(self) -> bool {
        self.evaluate(0.0) == 0.0
    }
}

impl fmt::Display for Function {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}

impl Function {
    /// The derivative at `argument`, where the function has this value; 0 at a kink.
    pub fn slope(self, argument: f64, value: f64) -> f64 {
        match self {
            Function::Sin => argument.cos(),
            Function::Cos => -argument.sin(),
            Function::Tan => 1.0 + value * value,
            Function::Tanh => 1.0 - value * value,
            Function::Exp => value,
            Function::Log => 1.0 / argument,
            Function::Sqrt => 0.5 / value,
            Function::Abs if argument == 0.0 => 0.0,
            Function::Abs => argument.signum(),
            Function::Sign => 0.0,
        }
    }
}
