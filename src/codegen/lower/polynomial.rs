//! Large cubic polynomials with their Jacobian: sums of vectors, in which each lane belongs to an equation.
//!
//! A product of up to three factors is a path to its coefficients. The sum of a path is these plus each next factor
//! times the sum of the longer path: `s_ij = a_ij + sum_k x_k a_ijk`, `s_i = a_i + sum_j x_j s_ij`. The sum of the
//! empty path is the value, and `s_k + sum_i x_i s_ik + sum_ij x_i x_j a_ijk` its derivative: two products per
//! coefficient.

use super::*;

/// Fewest coefficients of products of three factors for which vectors are faster in spite of their zeros.
const FEWEST_CUBIC: usize = 120;

/// A coefficient per lane, by the positions of factors, each repeated by its exponent.
type Paths = BTreeMap<Vec<usize>, [f64; LANES]>;

pub(super) struct Polynomials {
    /// The variables of the columns, then all other factors, sines and cosines.
    factors: Vec<ExprId>,
    /// Derivatives of those others that are not zero: factor, column, slope.
    slopes: Vec<(usize, usize, ExprId)>,
    blocks: Vec<Paths>,
}

impl Polynomials {
    /// None if straight-line code is expected to run faster, or if a factor may be infinite: its product with the zero
    /// coefficient of the other lane would be NaN.
    pub(crate) fn new(
        pool: &mut ExprPool,
        equations: &[Combination],
        columns: &[SymbolId],
    ) -> Option<Self> {
        let variables = columns.iter().map(|&symbol| pool.symbol_expr(symbol));
        let mut factors: Vec<ExprId> = variables.collect();
        let mut blocks = Vec::new();
        let mut n_cubic = 0;
        let with_slopes = equations.chunks(LANES).filter(|_| !columns.is_empty());
        for equations in with_slopes {
            let mut rows = Paths::new();
            for (lane, equation) in equations.iter().enumerate() {
                let constant = [(equation.constant, ExprId::ONE)];
                for &(coefficient, expr) in equation.items.iter().chain(&constant) {
                    let path = path(pool, expr, &mut factors);
                    n_cubic += usize::from(path.len() == 3);
                    rows.entry(path).or_default()[lane] = coefficient;
                }
            }
            blocks.push(rows);
        }
        let may_be_infinite = pool.reachable(&factors).into_iter().any(|part| {
            let finite = [Function::Sin, Function::Cos];
            match pool.node(part) {
                Node::Power(_, exponent) => pool.as_integer(*exponent).is_none_or(|n| n < 0),
                Node::Apply(function, _) => !finite.contains(function),
                _ => false,
            }
        });
        if n_cubic < FEWEST_CUBIC || may_be_infinite {
            return None;
        }
        let mut slopes = Vec::new();
        for (position, &factor) in factors.iter().enumerate().skip(columns.len()) {
            for (column, &by) in columns.iter().enumerate() {
                slopes.push((position, column, pool.slope(factor, by)));
            }
        }
        slopes.retain(|&(.., slope)| slope != ExprId::ZERO);
        Some(Self {
            factors,
            slopes,
            blocks: blocks.into_iter().map(ordered).collect(),
        })
    }

    /// Of each equation the value, then its derivatives by all columns.
    pub(crate) fn lower(&self, lowering: &mut ExpressionLowering) -> Vec<Vec<ValueId>> {
        let slopes = self.slopes.iter().map(|slope| slope.2);
        let roots: Vec<ExprId> = slopes.chain(self.factors.iter().copied()).collect();
        lowering.prepare(&roots);
        let x = self.factors.iter().map(|&factor| lowering.value(factor));
        let x: Vec<ValueId> = x.collect();
        let slopes = self.slopes.iter();
        let slopes = slopes.map(|&(factor, by, slope)| (factor, by, lowering.value(slope)));
        let slopes: Vec<(usize, usize, ValueId)> = slopes.collect();
        let mut equations = Vec::new();
        for paths in &self.blocks {
            let vectors = vectors(&mut lowering.builder, paths, &x, &slopes);
            let lane = |lane: usize| vectors.iter().map(|vector| vector[lane]).collect();
            equations.extend((0..LANES).map(lane));
        }
        equations
    }
}

/// The positions of an expression's factors, ascending; those that are new are added.
fn path(pool: &ExprPool, expr: ExprId, factors: &mut Vec<ExprId>) -> Vec<usize> {
    let parts = pool.repeated_factors(expr, 3);
    let parts = parts.filter(|parts| parts.len() <= 3);
    let mut path = Vec::new();
    for part in parts.unwrap_or_else(|| vec![expr]) {
        let known = factors.iter().position(|&factor| factor == part);
        if part != ExprId::ONE {
            path.push(known.unwrap_or(factors.len()));
            factors.extend(known.is_none().then_some(part));
        }
    }
    path.sort_unstable();
    path
}

/// The same products with the beginnings of all paths: of three factors first the two that most of the others have.
fn ordered(products: Paths) -> Paths {
    let (mut paths, left): (Paths, Paths) = products.into_iter().partition(|(p, _)| p.len() < 3);
    let ways = left.into_iter().map(|(path, row)| {
        let [i, j, k] = [path[0], path[1], path[2]];
        let mut ways = vec![[i, j, k], [i, k, j], [j, k, i]];
        ways.dedup();
        (ways, row)
    });
    let mut left: Vec<_> = ways.collect();
    while !left.is_empty() {
        let mut counts: BTreeMap<[usize; 2], usize> = BTreeMap::new();
        for &[i, j, _] in left.iter().flat_map(|(ways, _)| ways) {
            *counts.entry([i, j]).or_default() += 1;
        }
        let most = counts.into_iter().max_by_key(|&(_, count)| count);
        left.retain(|(ways, row)| {
            let begins = |way: &&[usize; 3]| most.is_some_and(|(pair, _)| way[..2] == pair);
            let way = ways.iter().find(begins);
            way.map(|way| paths.insert(way.to_vec(), *row)).is_none()
        });
    }
    for path in paths.keys().cloned().collect::<Vec<_>>() {
        for end in 1..path.len() {
            paths.entry(path[..end].to_vec()).or_default();
        }
    }
    paths
}

/// The values of a block of equations, then their derivatives by all factors `x`, those by columns in full.
fn vectors(
    builder: &mut ProgramBuilder,
    paths: &Paths,
    x: &[ValueId],
    slopes: &[(usize, usize, ValueId)],
) -> Vec<Vector> {
    let zero = [builder.constant(0.0); LANES];
    let mut vectors = vec![zero; 1 + x.len()];
    let mut terms: HashMap<&[usize], Vec<_>> = HashMap::new();
    let mut of_slopes = vec![Vec::new(); x.len()];
    for (path, row) in paths.iter().rev() {
        // Values and slopes begin with a number, so that a sum of zeros is positive with and without its zeros.
        let start = (path.len() < 2 || *row != [0.0; LANES])
            .then(|| row.map(|number| builder.constant(number)));
        let terms_of_path = terms.remove(path.as_slice()).unwrap_or_default();
        let vector = builder.lanes(start, terms_of_path);
        let Some((&last, before)) = path.split_last() else {
            vectors[0] = vector;
            break;
        };
        terms.entry(before).or_default().push((vector, x[last]));
        let factors = before.iter().map(|&factor| x[factor]);
        match factors.reduce(|a, b| builder.mul(a, b)) {
            None => vectors[1 + last] = vector,
            Some(weight) => of_slopes[last].push((vector, weight)),
        }
    }
    for k in (0..x.len()).rev() {
        let vector = builder.lanes(Some(vectors[1 + k]), std::mem::take(&mut of_slopes[k]));
        vectors[1 + k] = vector;
        for &(_, column, slope) in slopes.iter().filter(|s| s.0 == k && vector != zero) {
            of_slopes[column].push((vector, slope));
        }
    }
    vectors
}
