//! Large polynomials: values and gradients as sums of vectors, one vector per four equations.
//!
//! With vectors of coefficients `b`, `a`, `c` and the variables `x`, equations of degree 3 are
//! `f = c0 + sum_i x_i h_i + rest`, `h_i = b_i + sum_j a_ij x_j + sum_j x_j p_ij`, `p_ij = sum_k c_ijk x_k`.
//! The derivative by `x_k` is `h_k + sum_i x_i (a_ik + p_ik) + sum_ij x_i x_j c_ijk + rest'`: what the value
//! needs is a part of it, and each coefficient costs one more product. Which two factors of a monomial
//! become `ij` is chosen such that there are few `p`. The rest, sines and inputs for instance, is added term
//! by term.

use std::collections::{BTreeMap, HashMap};

use super::combination::Combination;
use super::cost::Form;
use super::expression::ExpressionLowering;
use crate::ir::{QUAD, Quad, QuadSum, Table, ValueId};
use crate::symbolic::{ExprId, ExprPool, Node, SymbolId};

/// Fewest coefficients of equations and derivatives together for which vectors are worth it.
const FEWEST_TERMS: usize = 240;
/// Coefficients per product of weight and vector that are needed to make up for its zeros.
const LEAST_FILL: f64 = 1.3;
/// Most products that are written out one by one.
const MOST_PRODUCTS: usize = 6000;
/// Highest degree of a monomial that is taken apart.
const HIGHEST_DEGREE: usize = 3;

/// Columns of variables, ascending, each as often as its exponent says.
type Monomial = Vec<usize>;

/// One coefficient per equation.
type Column = Vec<f64>;

/// Sums of vectors that make the equations and their derivatives.
pub(super) struct Gradient {
    vectors: Division,
    /// The equations, [`QUAD`] per vector.
    values: Vec<Quad>,
    /// Derivatives by (column, position among the vectors of equations) that may be nonzero.
    slopes: BTreeMap<(usize, usize), Quad>,
}

impl Gradient {
    /// Divides the equations; nothing if another form is asked for or expected to run faster. `n_terms` is
    /// the number of coefficients of equations and derivatives.
    pub(crate) fn new(
        form: Form,
        pool: &mut ExprPool,
        equations: &[Combination],
        columns: &[SymbolId],
        n_terms: usize,
    ) -> Option<Self> {
        if form != Form::Automatic || n_terms < FEWEST_TERMS {
            return None;
        }
        let terms = Terms::new(pool, equations, columns);
        // Terms whose slopes may be infinite are added before they are differentiated.
        let mut is_steep = |by: &SymbolId| {
            let steep = terms.others.iter();
            steep
                .filter(|(expr, _)| pool.may_be_steep(*expr, *by))
                .count()
                > 1
        };
        if terms.monomials.keys().all(|monomial| monomial.len() < 2)
            || columns.iter().any(&mut is_steep)
        {
            return None;
        }
        let gradient = Division::default().gradient(pool, &terms, columns);
        let sums = gradient.vectors.sums.iter();
        let products: usize = sums.map(|sum| sum.terms.len()).sum();
        let is_filled = n_terms as f64 >= LEAST_FILL * products as f64;
        (is_filled && products <= MOST_PRODUCTS).then_some(gradient)
    }

    /// All expressions that the code needs.
    pub(crate) fn expressions(&self) -> &[ExprId] {
        &self.vectors.weights
    }

    /// The value of each equation, and the derivatives by (equation, column).
    pub fn lower(
        &self,
        lowering: &mut ExpressionLowering,
        n_equations: usize,
    ) -> (Vec<ValueId>, HashMap<(usize, usize), ValueId>) {
        let Division {
            weights,
            rows,
            sums,
            ..
        } = &self.vectors;
        let weights = weights.iter().map(|&weight| lowering.value(weight));
        let weights = weights.collect();
        let table = Table::new(rows.len(), QUAD, rows.concat());
        let sums = lowering.builder.quads(table, weights, sums.clone());
        let mut value = |vector: Quad, lane: usize| match vector {
            Quad::Row(row) => lowering.builder.constant(rows[row][lane]),
            Quad::Sum(sum) => sums[QUAD * sum + lane],
        };
        let ddz = (0..n_equations).map(|row| value(self.values[row / QUAD], row % QUAD));
        let ddz = ddz.collect();
        let mut slopes = HashMap::new();
        for (&(column, block), &vector) in &self.slopes {
            for row in QUAD * block..n_equations.min(QUAD * (block + 1)) {
                slopes.insert((row, column), value(vector, row % QUAD));
            }
        }
        (ddz, slopes)
    }
}

/// The terms of the equations.
struct Terms {
    constant: Column,
    /// Monomials of degree 1 to [`HIGHEST_DEGREE`].
    monomials: BTreeMap<Monomial, Column>,
    /// All other terms, in order of appearance.
    others: Vec<(ExprId, Column)>,
}

impl Terms {
    fn new(pool: &ExprPool, equations: &[Combination], columns: &[SymbolId]) -> Self {
        let zeros = vec![0.0; equations.len().next_multiple_of(QUAD)];
        let mut terms = Self {
            constant: zeros.clone(),
            monomials: BTreeMap::new(),
            others: Vec::new(),
        };
        for (row, equation) in equations.iter().enumerate() {
            // Not -0, which sums of vectors must not begin with.
            terms.constant[row] = equation.constant + 0.0;
            for &(coefficient, expr) in &equation.items {
                let column = match monomial(pool, expr, columns) {
                    Some(monomial) => terms.monomials.entry(monomial).or_insert(zeros.clone()),
                    None => {
                        let known = terms.others.iter().position(|(other, _)| *other == expr);
                        let at = known.unwrap_or(terms.others.len());
                        if at == terms.others.len() {
                            terms.others.push((expr, zeros.clone()));
                        }
                        &mut terms.others[at].1
                    }
                };
                column[row] = coefficient;
            }
        }
        terms
    }

    /// The monomials by two of their factors, each with the third: for every pair a column per variable. Pairs
    /// that most of the remaining monomials contain come first; those of degree 2 have no third.
    fn pairs(&self) -> BTreeMap<(usize, usize), BTreeMap<usize, &Column>> {
        let degree = |n: usize| self.monomials.keys().filter(move |m| m.len() == n);
        let mut pairs: BTreeMap<_, BTreeMap<_, _>> =
            degree(2).map(|m| ((m[0], m[1]), BTreeMap::new())).collect();
        let mut left: Vec<&Monomial> = degree(3).collect();
        while !left.is_empty() {
            let mut counts: BTreeMap<(usize, usize), usize> = BTreeMap::new();
            for monomial in &left {
                let filled = self.monomials[*monomial]
                    .chunks(QUAD)
                    .filter(is_filled)
                    .count();
                for pair in factors(monomial).into_keys() {
                    *counts.entry(pair).or_default() += filled;
                }
            }
            let most = counts.into_iter().max_by_key(|&(_, count)| count);
            let (pair, _) = most.expect("monomials have factors");
            let thirds = pairs.entry(pair).or_default();
            left.retain(|monomial| match factors(monomial).get(&pair) {
                Some(&third) => {
                    thirds.insert(third, &self.monomials[*monomial]);
                    false
                }
                None => true,
            });
        }
        pairs
    }
}

fn is_filled(vector: &&[f64]) -> bool {
    vector.iter().any(|&entry| entry != 0.0)
}

/// Two factors of a monomial of degree 3, with the third.
fn factors(monomial: &Monomial) -> BTreeMap<(usize, usize), usize> {
    let [i, j, k] = monomial[..] else {
        return BTreeMap::new();
    };
    BTreeMap::from([((i, j), k), ((i, k), j), ((j, k), i)])
}

/// A product of variables, as often each as its exponent says; nothing for anything else.
fn monomial(pool: &ExprPool, expr: ExprId, columns: &[SymbolId]) -> Option<Monomial> {
    let mut factors = Monomial::new();
    for &factor in pool.factors_of(expr) {
        let (base, exponent) = match pool.node(factor) {
            Node::Power(base, exponent) => (*base, pool.as_integer(*exponent)?),
            _ => (factor, 1),
        };
        let symbol = pool.as_symbol(base)?;
        let column = columns.iter().position(|&variable| variable == symbol)?;
        let exponent = usize::try_from(exponent).ok()?;
        if exponent + factors.len() > HIGHEST_DEGREE {
            return None;
        }
        factors.extend(std::iter::repeat_n(column, exponent));
    }
    factors.sort_unstable();
    (!factors.is_empty()).then_some(factors)
}

/// Weights, vectors and sums, as they are added.
#[derive(Default)]
struct Division {
    weights: Vec<ExprId>,
    weight_of: HashMap<ExprId, usize>,
    /// The constant vectors.
    rows: Vec<[f64; QUAD]>,
    row_of: HashMap<[u64; QUAD], usize>,
    sums: Vec<QuadSum>,
}

impl Division {
    fn gradient(mut self, pool: &mut ExprPool, terms: &Terms, columns: &[SymbolId]) -> Gradient {
        let variables = columns.iter().map(|&symbol| pool.symbol_expr(symbol));
        let x: Vec<usize> = variables.map(|expr| self.weight(expr)).collect();
        let pairs = terms.pairs();
        let n_blocks = terms.constant.len() / QUAD;
        // What others wait for comes first: the products of pairs, then the heads, then the values.
        let mut inner = BTreeMap::new();
        for (&(i, j), thirds) in &pairs {
            for block in 0..n_blocks {
                let thirds = thirds.iter().map(|(&k, &column)| (x[k], column));
                let thirds = self.scaled(thirds, block);
                let start = self.monomial(terms, &[i, j], block);
                inner.insert((i, j, block), self.sum(start, thirds));
            }
        }
        let mut heads = BTreeMap::new();
        for i in 0..columns.len() {
            for block in 0..n_blocks {
                let products = pairs.keys().filter(|pair| pair.0 == i);
                let products = products.filter_map(|&(_, j)| Some((x[j], inner[&(i, j, block)]?)));
                let products = products.collect();
                let start = self.monomial(terms, &[i], block);
                heads.insert((i, block), self.sum(start, products));
            }
        }
        let mut values = Vec::new();
        for block in 0..n_blocks {
            let products = x.iter().enumerate();
            let products = products.filter_map(|(i, &x)| Some((x, heads[&(i, block)]?)));
            let mut products: Vec<(usize, Quad)> = products.collect();
            let others = terms.others.iter();
            let others: Vec<_> = others.map(|(expr, c)| (self.weight(*expr), c)).collect();
            products.extend(self.scaled(others, block));
            let start = self.row(&terms.constant, block);
            let value = self.sum(start, products);
            values.push(value.unwrap_or_else(|| self.constant([0.0; QUAD])));
        }
        let mut slopes = BTreeMap::new();
        for k in 0..columns.len() {
            let tails = self.tails(pool, terms, &pairs, columns, k);
            for block in 0..n_blocks {
                let first = pairs.keys().filter(|pair| pair.1 == k);
                let first = first.filter_map(|&(i, _)| Some((x[i], inner[&(i, k, block)]?)));
                let mut products: Vec<(usize, Quad)> = first.collect();
                let tails = tails.iter().map(|(weight, column)| (*weight, column));
                products.extend(self.scaled(tails, block));
                let slope = self.sum(heads[&(k, block)], products);
                slopes.extend(slope.map(|slope| ((k, block), slope)));
            }
        }
        Gradient {
            vectors: self,
            values,
            slopes,
        }
    }

    /// What constant vectors contribute to the derivative by a variable, besides the heads: by the products
    /// of pairs whose third it is, and by terms that are no monomials.
    fn tails(
        &mut self,
        pool: &mut ExprPool,
        terms: &Terms,
        pairs: &BTreeMap<(usize, usize), BTreeMap<usize, &Column>>,
        columns: &[SymbolId],
        k: usize,
    ) -> Vec<(usize, Column)> {
        let mut tails = Vec::new();
        for (&(i, j), thirds) in pairs {
            if let Some(&column) = thirds.get(&k) {
                let factors = [i, j].map(|i| pool.symbol_expr(columns[i]));
                let product = pool.product(&factors);
                tails.push((self.weight(product), column.clone()));
            }
        }
        for (expr, column) in &terms.others {
            let derivative = pool.slope(*expr, columns[k]);
            for (number, expr) in pool.terms_of(derivative) {
                let scaled = column.iter().map(|entry| number.to_f64() * entry + 0.0);
                tails.push((self.weight(expr), scaled.collect()));
            }
        }
        tails
    }

    /// The position of a weight.
    fn weight(&mut self, expr: ExprId) -> usize {
        *self.weight_of.entry(expr).or_insert_with(|| {
            self.weights.push(expr);
            self.weights.len() - 1
        })
    }

    /// A block of a column as a constant vector, unless it is zero.
    fn row(&mut self, column: &[f64], block: usize) -> Option<Quad> {
        let row: [f64; QUAD] = std::array::from_fn(|l| column[QUAD * block + l]);
        row.iter()
            .any(|&entry| entry != 0.0)
            .then(|| self.constant(row))
    }

    /// A block of a monomial's coefficients, unless it is zero.
    fn monomial(&mut self, terms: &Terms, factors: &[usize], block: usize) -> Option<Quad> {
        self.row(terms.monomials.get(factors)?, block)
    }

    fn constant(&mut self, row: [f64; QUAD]) -> Quad {
        let position = *self.row_of.entry(row.map(f64::to_bits)).or_insert_with(|| {
            self.rows.push(row);
            self.rows.len() - 1
        });
        Quad::Row(position)
    }

    /// Products of weights and the blocks of columns that are not zero.
    fn scaled<'a>(
        &mut self,
        columns: impl IntoIterator<Item = (usize, &'a Column)>,
        block: usize,
    ) -> Vec<(usize, Quad)> {
        let product =
            |(weight, column): (usize, &'a Column)| Some((weight, self.row(column, block)?));
        columns.into_iter().filter_map(product).collect()
    }

    /// A sum with its terms in the order of the weights; its start if there are none.
    fn sum(&mut self, start: Option<Quad>, mut terms: Vec<(usize, Quad)>) -> Option<Quad> {
        if terms.is_empty() {
            return start;
        }
        terms.sort_by_key(|&(weight, _)| weight);
        let start = start.unwrap_or_else(|| self.constant([0.0; QUAD]));
        self.sums.push(QuadSum { start, terms });
        Some(Quad::Sum(self.sums.len() - 1))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use crate::equations::Equations;
    use crate::ir::{Interpreter, Program, Statement};
    use crate::lower::{Form, dynamics_jacobian};
    use crate::model::{FeetRule, Library, Phase, ReducedModel};

    /// Five equations with about every third of all monomials up to degree 3 in four of the coordinates, a
    /// product of four, a sine and an input.
    fn cubic() -> ReducedModel {
        let variables = ["z1", "z3", "dz2", "dz5"];
        let mut terms: Vec<String> = ["1", "sin(dz1)", "u2", "z2", "z1*z3*dz2*dz2", "z1*cos(z4)"]
            .map(str::to_owned)
            .into();
        for (i, a) in variables.iter().enumerate() {
            terms.push((*a).to_owned());
            for (j, b) in variables.iter().enumerate().skip(i) {
                terms.push(format!("{a}*{b}"));
                terms.extend(variables[j..].iter().map(|c| format!("{a}*{b}*{c}")));
            }
        }
        let n = terms.len();
        let xi = DMatrix::from_fn(n, 5, |term, row| match (7 * term + 3 * row) % 5 {
            0 | 2 | 3 => 0.25 * (term as f64 - 11.5) - row as f64,
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
        let (program, pattern) = dynamics_jacobian(&system, 0, form).expect("lowers");
        let point =
            |shift: f64| -> Vec<f64> { (0..5).map(|k| shift - 0.4 * f64::from(k)).collect() };
        let inputs = [point(0.9), point(1.3), point(-0.2)];
        let results = Interpreter::new(&program).results(&inputs);
        assert_eq!(results[1].len(), pattern.len());
        (program, results.concat())
    }

    #[test]
    fn sums_of_vectors_equal_one_operation_after_the_other() {
        let (program, found) = lowered(Form::Automatic);
        let (straight, expected) = lowered(Form::StraightLine);
        let has_vectors = |program: &Program| {
            let mut statements = program.statements().iter();
            statements.any(|statement| matches!(statement, Statement::Quads { .. }))
        };
        assert!(has_vectors(&program) && !has_vectors(&straight));
        assert_eq!(found.len(), expected.len());
        for (a, b) in found.iter().zip(&expected) {
            assert!((a - b).abs() <= 1e-13 * b.abs().max(100.0), "{a} {b}");
        }
    }
}
