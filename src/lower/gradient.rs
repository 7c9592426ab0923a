//! Large polynomials: values and gradients by two sparse products of matrix and vector.
//!
//! Each monomial is divided by its last variable `x_k`; the quotients are the weights `w` of
//! `h_rk = sum_w H_rkw w`, so that the polynomial of row `r` is `sum_k h_rk x_k`. Its derivative by `x_k`
//! is `h_rk + sum_w T_rkw w`, where `T` holds what the other variables of each monomial contribute. The
//! weights are shared by all rows and columns, and the rows of a column are added side by side.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::combination::Combination;
use super::cost::{Form, LowerOptions};
use super::expression::ExpressionLowering;
use super::sums::{Term, linear_combination};
use crate::ir::{Binary, QUAD, Table, ValueId};
use crate::symbolic::{ExprId, ExprPool, Node, SymbolId};

/// Fewest terms of equations and derivatives together for which arrays are worth their overhead.
const FEWEST_TERMS: usize = 160;
/// Terms per group of [`QUAD`] rows that are needed to make up for its zeros.
const LEAST_FILL: f64 = 1.3;
/// Highest degree of a monomial that is taken apart.
const HIGHEST_DEGREE: usize = 6;
/// Most groups that are written out one by one.
const MOST_QUADS: usize = 6000;

/// Positions of variables, ascending, each as often as its exponent says.
type Monomial = Vec<usize>;

/// Coefficients of the weights of one entry of the Jacobian.
type Entry = BTreeMap<Monomial, f64>;

/// The polynomial part of the equations and what remains of them.
pub(super) struct Gradient {
    /// Variables of the polynomials, in the order of the Jacobian's columns.
    variables: Vec<SymbolId>,
    /// `H`, row by row, one entry per variable.
    heads: Vec<Vec<Entry>>,
    /// `T`, likewise.
    tails: Vec<Vec<Entry>>,
    /// The equations without their polynomials.
    pub rest: Vec<Combination>,
}

impl Gradient {
    /// Divides the equations; nothing if another form is asked for or expected to run
    /// faster.
    pub fn new(
        options: &LowerOptions,
        pool: &ExprPool,
        equations: &[Combination],
        columns: &[SymbolId],
    ) -> Option<Self> {
        if options.form != Form::Automatic {
            return None;
        }
        let mut used = BTreeSet::new();
        for (_, expr) in equations.iter().flat_map(|equation| &equation.items) {
            if let Some(monomial) = monomial(pool, *expr, columns).filter(|m| m.len() > 1) {
                used.extend(monomial);
            }
        }
        let variables: Vec<SymbolId> = used.into_iter().map(|position| columns[position]).collect();
        let empty = || vec![vec![Entry::new(); variables.len()]; equations.len()];
        let (mut heads, mut tails) = (empty(), empty());
        let mut rest = Vec::new();
        for (row, equation) in equations.iter().enumerate() {
            let mut remaining = equation.clone();
            remaining.items.retain(|&(coefficient, expr)| {
                let Some(monomial) = monomial(pool, expr, &variables) else {
                    return true;
                };
                enter(&mut heads[row], &mut tails[row], &monomial, coefficient);
                false
            });
            rest.push(remaining);
        }
        let gradient = Self {
            variables,
            heads,
            tails,
            rest,
        };
        gradient.is_worth_it(equations).then_some(gradient)
    }

    fn is_worth_it(&self, equations: &[Combination]) -> bool {
        let n_head: usize = self.heads.iter().flatten().map(Entry::len).sum();
        let n_tail: usize = self.tails.iter().flatten().map(Entry::len).sum();
        let n_rest: usize = self.rest.iter().map(|rest| rest.items.len()).sum();
        let n_terms: usize = equations.iter().map(|e| e.items.len()).sum();
        let n_terms = n_terms - n_rest + n_head + n_tail;
        let n_quads = n_quads(&self.heads) + n_quads(&self.tails);
        let is_large = n_terms >= FEWEST_TERMS && n_quads <= MOST_QUADS;
        is_large && n_terms as f64 >= LEAST_FILL * n_quads as f64
    }

    /// All weights, by degree.
    fn weights(&self) -> Vec<Monomial> {
        let entries = self.heads.iter().chain(&self.tails).flatten();
        let distinct: BTreeSet<(usize, &Monomial)> = entries
            .flat_map(|entry| entry.keys().map(|weight| (weight.len(), weight)))
            .filter(|&(degree, _)| degree > 0)
            .collect();
        distinct.into_iter().map(|(_, w)| w.clone()).collect()
    }

    /// The weights as expressions, in the order of the tables' rows; `pool` makes the products.
    pub fn expressions(&self, pool: &mut ExprPool) -> Vec<ExprId> {
        let product = |weight: Monomial| {
            let factors = weight.iter().map(|&k| pool.symbol_expr(self.variables[k]));
            let factors: Vec<ExprId> = factors.collect();
            pool.product(&factors)
        };
        self.weights().into_iter().map(product).collect()
    }

    /// The polynomial of each row, and the derivatives that may be nonzero by (row, variable); `weights`
    /// are those of [`Self::expressions`].
    pub fn lower(
        &self,
        lowering: &mut ExpressionLowering,
        weights: &[ExprId],
    ) -> (Vec<Option<ValueId>>, HashMap<(usize, SymbolId), ValueId>) {
        let weights: Vec<ValueId> = weights.iter().map(|&w| lowering.value(w)).collect();
        let rows = self.weights().into_iter().zip(1..).collect();
        let heads = product(lowering, &rows, &self.heads, &weights);
        let tails = product(lowering, &rows, &self.tails, &weights);
        let variables: Vec<ValueId> = self
            .variables
            .iter()
            .map(|&symbol| lowering.value(lowering.pool.symbol_expr(symbol)))
            .collect();
        let builder = &mut lowering.builder;
        let (mut sums, mut slopes) = (Vec::new(), HashMap::new());
        for row in 0..self.rest.len() {
            let mut terms = Vec::new();
            for (k, &symbol) in self.variables.iter().enumerate() {
                let (head, tail) = (heads[row][k], tails[row][k]);
                terms.extend(head.map(|head| Term {
                    coefficient: 1.0,
                    value: builder.binary(Binary::Mul, variables[k], head),
                    late: false,
                }));
                let slope = match (head, tail) {
                    (Some(head), Some(tail)) => Some(builder.binary(Binary::Add, head, tail)),
                    (one, other) => one.or(other),
                };
                slopes.extend(slope.map(|slope| ((row, symbol), slope)));
            }
            sums.push((!terms.is_empty()).then(|| linear_combination(builder, 0.0, &terms)));
        }
        (sums, slopes)
    }
}

/// A product of variables, as often each as its exponent says; nothing for anything else.
fn monomial(pool: &ExprPool, expr: ExprId, variables: &[SymbolId]) -> Option<Monomial> {
    let mut factors = Monomial::new();
    for &factor in pool.factors_of(expr) {
        let (base, exponent) = match pool.node(factor) {
            Node::Power(base, exponent) => (*base, pool.as_number(*exponent)?.as_integer()?),
            _ => (factor, 1),
        };
        let symbol = pool.as_symbol(base)?;
        let position = variables.iter().position(|&variable| variable == symbol)?;
        let exponent = usize::try_from(exponent).ok()?;
        if exponent + factors.len() > HIGHEST_DEGREE {
            return None;
        }
        factors.extend(std::iter::repeat_n(position, exponent));
    }
    factors.sort_unstable();
    (!factors.is_empty()).then_some(factors)
}

/// Enters a coefficient with the head of a monomial's last variable and the tails of all.
fn enter(heads: &mut [Entry], tails: &mut [Entry], monomial: &Monomial, coefficient: f64) {
    let last = monomial[monomial.len() - 1];
    for (position, &k) in monomial.iter().enumerate() {
        if position > 0 && monomial[position - 1] == k {
            continue;
        }
        let exponent = monomial.iter().filter(|&&other| other == k).count();
        let mut weight = monomial.clone();
        weight.remove(position);
        let in_tail = if k == last { exponent - 1 } else { exponent };
        if in_tail > 0 {
            tails[k].insert(weight.clone(), coefficient * in_tail as f64);
        }
        if k == last {
            heads[k].insert(weight, coefficient);
        }
    }
}

/// Number of groups of rows and columns with a coefficient.
fn n_quads(entries: &[Vec<Entry>]) -> usize {
    let quads = entries.chunks(QUAD).map(|rows| {
        let columns = 0..rows[0].len();
        let distinct = columns.map(|k| {
            let weights = rows.iter().flat_map(|row| row[k].keys());
            weights
                .filter(|w| !w.is_empty())
                .collect::<BTreeSet<_>>()
                .len()
        });
        distinct.sum::<usize>()
    });
    quads.sum()
}

/// `sum_w entry_w w` for all entries, by one sparse product; nothing where there are no coefficients.
fn product(
    lowering: &mut ExpressionLowering,
    rows: &HashMap<Monomial, usize>,
    entries: &[Vec<Entry>],
    weights: &[ValueId],
) -> Vec<Vec<Option<ValueId>>> {
    let height = entries.len().next_multiple_of(QUAD);
    let cols = height * entries[0].len();
    let mut table = vec![0.0; (weights.len() + 1) * cols];
    for (row, columns) in entries.iter().enumerate() {
        for (k, entry) in columns.iter().enumerate() {
            for (weight, coefficient) in entry {
                let at = rows.get(weight).copied().unwrap_or(0);
                table[at * cols + k * height + row] = *coefficient;
            }
        }
    }
    let table = lowering
        .builder
        .table(Table::new(weights.len() + 1, cols, table));
    let values = lowering.builder.sparse_product(table, weights);
    let value =
        |row: usize, k: usize, entry: &Entry| (!entry.is_empty()).then(|| values[k * height + row]);
    let in_row = |(row, columns): (usize, &Vec<Entry>)| {
        let columns = columns.iter().enumerate();
        columns.map(|(k, entry)| value(row, k, entry)).collect()
    };
    entries.iter().enumerate().map(in_row).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use crate::equations::Equations;
    use crate::ir::{Interpreter, Program, Statement};
    use crate::lower::{Form, LowerOptions, dynamics_jacobian};
    use crate::model::{FeetRule, Library, Phase, ReducedModel};

    /// Five equations with about every third of all monomials up to degree 3 in four of the coordinates, a
    /// sine and an input.
    fn cubic() -> ReducedModel {
        let variables = ["z1", "z3", "dz2", "dz5"];
        let mut terms: Vec<String> = vec!["1".into(), "sin(dz1)".into(), "u2".into(), "z2".into()];
        for (i, a) in variables.iter().enumerate() {
            terms.push((*a).to_owned());
            for (j, b) in variables.iter().enumerate().skip(i) {
                terms.push(format!("{a}*{b}"));
                terms.extend(variables[j..].iter().map(|c| format!("{a}*{b}*{c}")));
            }
        }
        let n = terms.len();
        let xi = DMatrix::from_fn(n, 5, |term, row| match (7 * term + 3 * row) % 5 {
            0 | 2 | 3 => 0.25 * (term as f64 - 11.0) - row as f64,
            _ => 0.0,
        });
        let library = Library::from_terms(5, &terms).expect("terms parse");
        ReducedModel::builder("cubic", library)
            .phase(Phase {
                name: "phase".to_owned(),
                feet: FeetRule::Any,
                xi,
            })
            .build()
            .expect("a valid model")
    }

    fn lowered(form: Form) -> (Program, Vec<f64>) {
        let model = cubic();
        let system = Equations::of(&model);
        let (program, pattern) =
            dynamics_jacobian(&system, 0, &LowerOptions { form }).expect("lowers");
        let point =
            |shift: f64| -> Vec<f64> { (0..5).map(|k| shift - 0.4 * f64::from(k)).collect() };
        let (mut ddz, mut entries) = (vec![0.0; 5], vec![0.0; pattern.len()]);
        let inputs = [point(0.9), point(1.3), point(-0.2)];
        let inputs = inputs.each_ref().map(Vec::as_slice);
        Interpreter::new(&program).run(&inputs, &mut [&mut ddz, &mut entries]);
        ddz.extend(entries);
        (program, ddz)
    }

    #[test]
    fn sparse_products_equal_one_operation_after_the_other() {
        let (program, found) = lowered(Form::Automatic);
        let (straight, expected) = lowered(Form::StraightLine);
        let is_sparse = |program: &Program| {
            let mut statements = program.statements().iter();
            statements.any(|statement| matches!(statement, Statement::SparseProduct { .. }))
        };
        assert!(is_sparse(&program) && !is_sparse(&straight));
        assert_eq!(found.len(), expected.len());
        for (a, b) in found.iter().zip(&expected) {
            assert!((a - b).abs() <= 1e-13 * b.abs().max(100.0), "{a} {b}");
        }
    }
}
