//! Evaluation of Theta by one pass over the distinct subexpressions of all terms.

use std::collections::BTreeMap;

use crate::symbolic::{ExprId, ExprPool, Function, Node, Number, SymbolId, integer_power};

/// The terms of a library as steps, each of which reads the results of earlier ones.
#[derive(Clone, Debug)]
pub struct Tape {
    /// In an order in which every step follows its operands.
    pub steps: Vec<Step>,
    /// The steps that are the terms, in library order.
    pub terms: Vec<usize>,
}

/// One operation; operands are positions of earlier steps.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    Number(f64),
    /// Index into the variables: z, then dz, then u.
    Variable(usize),
    Sum(Vec<usize>),
    Product(Vec<usize>),
    Integer(usize, i32),
    Power(usize, usize),
    /// Followed by the cosine of the same argument, which may be computed with it.
    Sine(usize),
    Cosine(usize),
    Apply(Function, usize),
}

impl Tape {
    /// The steps for `terms`; `symbols` holds the variables in order.
    pub(crate) fn new(pool: &ExprPool, terms: &[ExprId], symbols: &[SymbolId]) -> Self {
        let mut builder = Builder {
            pool,
            symbols,
            seen: BTreeMap::new(),
            sines: BTreeMap::new(),
            steps: Vec::new(),
        };
        let terms = terms.iter().map(|&term| builder.step(term)).collect();
        Self {
            steps: builder.steps,
            terms,
        }
    }

    /// Computes all terms; `values` is scratch space, one entry per step.
    ///
    /// Integer powers are multiplication chains, as everywhere in romc.
    pub(crate) fn run(&self, variables: &[f64], values: &mut [f64], theta: &mut [f64]) {
        for (index, step) in self.steps.iter().enumerate() {
            values[index] = match step {
                Step::Number(value) => *value,
                Step::Variable(variable) => variables[*variable],
                Step::Sum(operands) => operands.iter().map(|&term| values[term]).sum(),
                Step::Product(operands) => operands.iter().map(|&factor| values[factor]).product(),
                Step::Integer(base, exponent) => integer_power(values[*base], (*exponent).into()),
                Step::Power(base, exponent) => values[*base].powf(values[*exponent]),
                Step::Sine(argument) => Function::Sin.evaluate(values[*argument]),
                Step::Cosine(argument) => Function::Cos.evaluate(values[*argument]),
                Step::Apply(function, argument) => function.evaluate(values[*argument]),
            };
        }
        for (value, &step) in theta.iter_mut().zip(&self.terms) {
            *value = values[step];
        }
    }
}

struct Builder<'a> {
    pool: &'a ExprPool,
    symbols: &'a [SymbolId],
    seen: BTreeMap<ExprId, usize>,
    sines: BTreeMap<usize, usize>, // by the step of their argument
    steps: Vec<Step>,
}

impl Builder<'_> {
    fn step(&mut self, expression: ExprId) -> usize {
        if let Some(&known) = self.seen.get(&expression) {
            return known;
        }
        let step = match self.pool.node(expression) {
            Node::Number(number) => Step::Number(number.to_f64()),
            Node::Symbol(symbol) => {
                let known = self.symbols.iter().position(|known| known == symbol);
                Step::Variable(known.expect("terms mention the library's variables only"))
            }
            Node::Sum(parts) => Step::Sum(self.all(parts)),
            Node::Product(parts) => Step::Product(self.all(parts)),
            Node::Power(base, exponent) => {
                let base = self.step(*base);
                let integer = self.pool.as_number(*exponent).and_then(Number::as_integer);
                match integer.and_then(|integer| i32::try_from(integer).ok()) {
                    Some(integer) => Step::Integer(base, integer),
                    None => Step::Power(base, self.step(*exponent)),
                }
            }
            Node::Apply(function @ (Function::Sin | Function::Cos), argument) => {
                let sine = self.sine(*argument);
                let step = sine + usize::from(*function == Function::Cos);
                self.seen.insert(expression, step);
                return step;
            }
            Node::Apply(function, argument) => Step::Apply(*function, self.step(*argument)),
        };
        self.steps.push(step);
        self.seen.insert(expression, self.steps.len() - 1);
        self.steps.len() - 1
    }

    fn all(&mut self, parts: &[ExprId]) -> Vec<usize> {
        parts.iter().map(|&part| self.step(part)).collect()
    }

    /// Sine and cosine of one argument stand next to each other, whichever of them the library has.
    fn sine(&mut self, argument: ExprId) -> usize {
        let argument = self.step(argument);
        *self.sines.entry(argument).or_insert_with(|| {
            let both = [Step::Sine(argument), Step::Cosine(argument)];
            self.steps.extend(both);
            self.steps.len() - 2
        })
    }
}
