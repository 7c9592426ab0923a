//! Fast evaluation of Theta, one pass over the distinct subexpressions of all terms.

use crate::symbolic::{ExprId, ExprPool, Function, Node, Number, SymbolId};

/// The terms of a library as steps, each of which reads the results of earlier ones.
///
/// Integer powers are multiplication chains, as everywhere in romc.
#[derive(Clone, Debug)]
pub(super) struct Tape {
    steps: Vec<Step>,
    /// Which steps are the terms, in library order.
    terms: Vec<usize>,
}

#[derive(Clone, Debug)]
enum Step {
    Constant(f64),
    /// Index into the variables: z, then dz, then u.
    Variable(usize),
    Sum(Box<[usize]>),
    Product(Box<[usize]>),
    PowerInteger(usize, i64),
    Power(usize, usize),
    Apply(Function, usize),
}

impl Tape {
    /// The steps for `terms`; `symbols` holds the variables in order.
    pub(super) fn new(pool: &ExprPool, terms: &[ExprId], symbols: &[SymbolId]) -> Self {
        let order = pool.reachable(terms);
        let place = |expr: &ExprId| {
            order
                .binary_search(expr)
                .expect("operands are reachable from what uses them")
        };
        let steps = order.iter().map(|&expr| match pool.node(expr) {
            Node::Number(number) => Step::Constant(number.to_f64()),
            Node::Symbol(symbol) => Step::Variable(
                symbols
                    .iter()
                    .position(|known| known == symbol)
                    .expect("terms mention the library's variables only"),
            ),
            Node::Sum(operands) => Step::Sum(operands.iter().map(place).collect()),
            Node::Product(operands) => Step::Product(operands.iter().map(place).collect()),
            Node::Power(base, exponent) => {
                match pool.as_number(*exponent).and_then(Number::as_integer) {
                    Some(integer) => Step::PowerInteger(place(base), integer),
                    None => Step::Power(place(base), place(exponent)),
                }
            }
            Node::Apply(function, argument) => Step::Apply(*function, place(argument)),
        });
        Self {
            steps: steps.collect(),
            terms: terms.iter().map(place).collect(),
        }
    }

    /// Number of values that [`Tape::run`] keeps between steps.
    pub(super) fn step_count(&self) -> usize {
        self.steps.len()
    }

    /// Computes all terms; `values` is scratch space of at least [`Tape::step_count`].
    pub(super) fn run(&self, variables: &[f64], values: &mut [f64], theta: &mut [f64]) {
        for (index, step) in self.steps.iter().enumerate() {
            values[index] = match step {
                Step::Constant(value) => *value,
                Step::Variable(variable) => variables[*variable],
                Step::Sum(operands) => operands.iter().map(|&operand| values[operand]).sum(),
                Step::Product(operands) => {
                    operands.iter().map(|&operand| values[operand]).product()
                }
                Step::PowerInteger(base, exponent) => power(values[*base], *exponent),
                Step::Power(base, exponent) => values[*base].powf(values[*exponent]),
                Step::Apply(function, argument) => function.evaluate(values[*argument]),
            };
        }
        for (value, &step) in theta.iter_mut().zip(&self.terms) {
            *value = values[step];
        }
    }
}

/// `base ^ exponent` by repeated squaring.
fn power(base: f64, exponent: i64) -> f64 {
    let mut result = 1.0;
    let mut square = base;
    let mut rest = exponent.unsigned_abs();
    while rest > 0 {
        if rest % 2 == 1 {
            result *= square;
        }
        square *= square;
        rest /= 2;
    }
    if exponent < 0 { 1.0 / result } else { result }
}
