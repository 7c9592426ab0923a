//! Dense models by tables of coefficients: the accelerations are a matrix-vector product over the distinct candidate
//! terms. The columns of their Jacobian are constants for variables that occur only linearly. In the others,
//! derivatives of sines and cosines of variables are tables whose columns are scaled; the rest is a matrix-vector
//! product.

use super::*;

pub(super) fn distinct(equations: &[Combination]) -> Vec<ExprId> {
    let mut seen = BTreeSet::new();
    let items = equations.iter().flat_map(|equation| &equation.items);
    items
        .map(|&(_, expr)| expr)
        .filter(|&expr| seen.insert(expr))
        .collect()
}

/// `y_r = constant_r + sum coefficient weight` for all combinations by one table.
pub(super) fn matrix_vector(
    lowering: &mut ExpressionLowering,
    sums: &[Combination],
) -> Vec<ValueId> {
    let terms = distinct(sums);
    if terms.is_empty() {
        let constants = sums.iter().map(|sum| sum.constant);
        return constants.map(|c| lowering.builder.constant(c)).collect();
    }
    // Weights in the order of their values are runs of arrays, which are copied fast.
    let mut weights: Vec<(ValueId, ExprId)> = terms
        .into_iter()
        .map(|expr| (lowering.value(expr), expr))
        .collect();
    weights.sort();
    let rows = weights.iter().enumerate();
    let row_of: HashMap<ExprId, usize> = rows.map(|(k, &(_, expr))| (expr, k + 1)).collect();
    let cols = sums.len();
    let mut entries = vec![0.0; (weights.len() + 1) * cols];
    for (col, sum) in sums.iter().enumerate() {
        entries[col] = sum.constant;
        for (coefficient, expr) in &sum.items {
            entries[row_of[expr] * cols + col] = *coefficient;
        }
    }
    let table = Table::new(weights.len() + 1, cols, entries);
    let weights = weights.into_iter().map(|(value, _)| value).collect();
    lowering.builder.accumulate(&table, weights)
}

/// Function and variable of a sine or cosine of a variable alone.
fn angle_of(pool: &ExprPool, expr: ExprId) -> Option<(Function, SymbolId)> {
    match pool.node(expr) {
        Node::Apply(function @ (Function::Sin | Function::Cos), argument) => {
            Some((*function, pool.as_symbol(*argument)?))
        }
        _ => None,
    }
}

/// The Jacobian of equations, divided into parts with a form of their own.
pub(super) struct DenseJacobian {
    curved: Vec<SymbolId>,
    linear: Vec<SymbolId>, // variables that occur only linearly
    /// Derivatives by the curved variables, row by row, of all terms but sines and cosines of variables.
    slopes: Vec<Combination>,
}

impl DenseJacobian {
    pub(crate) fn new(
        pool: &mut ExprPool,
        equations: &[Combination],
        columns: &[SymbolId],
    ) -> Self {
        let (mut curved, mut linear) = (BTreeSet::new(), BTreeSet::new());
        for expr in distinct(equations) {
            match pool.as_symbol(expr) {
                Some(symbol) => linear.extend([symbol]),
                None => curved.extend(pool.symbols_of(expr)),
            }
        }
        let of = |is_member: &dyn Fn(&SymbolId) -> bool| -> Vec<SymbolId> {
            columns.iter().copied().filter(is_member).collect()
        };
        let linear = of(&|symbol| linear.contains(symbol) && !curved.contains(symbol));
        let curved = of(&|symbol| curved.contains(symbol));
        let mut slopes = Vec::new();
        for equation in equations {
            let mut rest = equation.clone();
            rest.items
                .retain(|&(_, expr)| angle_of(pool, expr).is_none());
            slopes.extend(curved.iter().map(|&by| rest.derivative(pool, by)));
        }
        Self {
            curved,
            linear,
            slopes,
        }
    }

    pub(crate) fn expressions(&self) -> Vec<ExprId> {
        distinct(&self.slopes)
    }

    /// The value of each entry that may be nonzero, by (row, variable).
    pub(crate) fn lower(
        &self,
        lowering: &mut ExpressionLowering,
        equations: &[Combination],
    ) -> HashMap<(usize, SymbolId), ValueId> {
        let mut entries = HashMap::new();
        let mut enter = |variables: &[SymbolId], values: Vec<ValueId>| {
            for (k, value) in values.into_iter().enumerate() {
                let (row, col) = (k / variables.len(), k % variables.len());
                entries.insert((row, variables[col]), value);
            }
        };
        if !self.curved.is_empty() {
            enter(&self.curved, self.curved_columns(lowering, equations));
        }
        if !self.linear.is_empty() {
            let pool = lowering.pool;
            let of = |expr| pool.as_symbol(expr);
            let table = coefficients(equations, &self.linear, 1.0, of);
            enter(
                &self.linear,
                lowering.builder.scaled(None, vec![(table, None)]),
            );
        }
        entries
    }

    fn curved_columns(
        &self,
        lowering: &mut ExpressionLowering,
        equations: &[Combination],
    ) -> Vec<ValueId> {
        let (pool, variables) = (lowering.pool, &self.curved);
        // The derivative of a sine is a cosine, that of a cosine a negated sine.
        let mut tables = [(Function::Sin, 1.0), (Function::Cos, -1.0)].map(|(wanted, sign)| {
            let of = |expr| angle_of(pool, expr).and_then(|(f, v)| (f == wanted).then_some(v));
            let table = coefficients(equations, variables, sign, of);
            Some(table).filter(|table| table.entries.iter().any(|&entry| entry != 0.0))
        });
        let is_constant = self.slopes.iter().all(|slope| slope.items.is_empty());
        if tables.iter().all(Option::is_none) {
            return matrix_vector(lowering, &self.slopes);
        }
        let mut groups = Vec::new();
        let mut base = None;
        if !is_constant {
            base = Some(matrix_vector(lowering, &self.slopes));
        } else if self.slopes.iter().any(|slope| slope.constant != 0.0) {
            let constants = self.slopes.iter().map(|slope| slope.constant).collect();
            let table = Table::new(equations.len(), variables.len(), constants);
            groups.push((table, None));
        }
        let angles: Vec<ExprId> = variables.iter().map(|&v| pool.symbol_expr(v)).collect();
        lowering.sines_and_cosines(&angles);
        let pairs = angles.into_iter().map(|angle| lowering.angle(angle));
        let (sines, cosines): (Vec<ValueId>, Vec<ValueId>) = pairs.unzip();
        for (table, weights) in tables.iter_mut().zip([cosines, sines]) {
            groups.extend(table.take().map(|table| (table, Some(weights))));
        }
        lowering.builder.scaled(base, groups)
    }
}

/// Coefficients times a sign of the terms that are `of` a variable, rows x variables.
fn coefficients(
    equations: &[Combination],
    variables: &[SymbolId],
    sign: f64,
    of: impl Fn(ExprId) -> Option<SymbolId>,
) -> Table {
    let columns = variables.iter().enumerate();
    let column: HashMap<SymbolId, usize> = columns.map(|(col, &symbol)| (symbol, col)).collect();
    let mut entries = vec![0.0; equations.len() * variables.len()];
    for (row, equation) in equations.iter().enumerate() {
        for &(coefficient, expr) in &equation.items {
            if let Some(col) = of(expr).and_then(|symbol| column.get(&symbol)) {
                entries[row * variables.len() + col] = sign * coefficient;
            }
        }
    }
    Table::new(equations.len(), variables.len(), entries)
}

/// Form of the code that adds coefficients times candidate terms.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Form {
    /// The form that is expected to run fastest; for Jacobians of large cubic polynomials sums of vectors, one lane for
    /// each of two equations.
    #[default]
    Automatic,
    /// One operation after the other: best for small and for sparse models.
    StraightLine,
    /// Tables of coefficients and loops over them, which compilers vectorise: best for dense models.
    Tables,
}

/// Least number of coefficients for which loops are faster in spite of their overhead.
const FEWEST_COEFFICIENTS: usize = 120;

/// Least share of a table that is not zero. A vectorised loop works on four numbers at once, and straight-line code
/// also has to be fetched and decoded. Therefore even a half-empty table is faster than straight-line code.
const LEAST_FILL: f64 = 0.45;

impl Form {
    pub(super) fn uses_tables(self, equations: &[Combination]) -> bool {
        match self {
            Self::StraightLine => false,
            Self::Tables => true,
            Self::Automatic => {
                let active: usize = equations.iter().map(|e| e.items.len()).sum();
                let entries = equations.len() * distinct(equations).len();
                active >= FEWEST_COEFFICIENTS && active as f64 >= LEAST_FILL * entries as f64
            }
        }
    }
}
