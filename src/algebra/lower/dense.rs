//! Dense models: tables of coefficients instead of one operation a coefficient.
//!
//! The accelerations are a matrix-vector product over the distinct candidate terms. For the
//! Jacobian the terms are divided: variables, sines and cosines of variables each touch one
//! column and go through [`Statement::Separable`](crate::ir::Statement), which shares
//! each table between sum and slope; the derivatives of all other terms are another
//! matrix-vector product over the flattened Jacobian; variables that occur only
//! linearly have constant columns, which the separable loops share as well where there are any.

use std::collections::{BTreeSet, HashMap};

use super::combination::Combination;
use super::expression::ExpressionLowering;
use crate::ir::{Group, LANES, Slopes, Table, ValueId};
use crate::symbolic::{ExprId, ExprPool, Function, Node, SymbolId};

/// Fewest weights for which a loop of their own is worth it.
const SHORTEST_RUN: usize = 4;

/// The distinct candidate terms that equations use.
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
    // Weights in the order of their values are runs of arrays, which loops read in place.
    let mut weights: Vec<(ValueId, ExprId)> = distinct(sums)
        .into_iter()
        .map(|expr| (lowering.value(expr), expr))
        .collect();
    weights.sort();
    let sections = sections(lowering, &mut weights);
    let row_of: HashMap<ExprId, usize> = weights
        .iter()
        .enumerate()
        .map(|(position, &(_, expr))| (expr, position + 1))
        .collect();
    let cols = sums.len();
    let mut entries = vec![0.0; (weights.len() + 1) * cols];
    for (col, sum) in sums.iter().enumerate() {
        entries[col] = sum.constant;
        for (coefficient, expr) in &sum.items {
            entries[row_of[expr] * cols + col] = *coefficient;
        }
    }
    let table = Table::new(weights.len() + 1, cols, entries);
    lowering.builder.accumulate(table, sections)
}

/// [`matrix_vector`] whose table has no columns for combinations that are zero.
fn matrix_vector_without_zeros(
    lowering: &mut ExpressionLowering,
    sums: &[Combination],
) -> Vec<ValueId> {
    let rest = sums.iter().filter(|sum| !sum.is_zero());
    let rest: Vec<Combination> = rest.cloned().collect();
    if rest.len() == sums.len() {
        return matrix_vector(lowering, sums);
    }
    let zero = lowering.builder.constant(0.0);
    let values = (!rest.is_empty()).then(|| matrix_vector(lowering, &rest));
    let mut values = values.into_iter().flatten();
    let value = |sum: &Combination| match sum.is_zero() {
        true => zero,
        false => values.next().expect("one value a sum"),
    };
    sums.iter().map(value).collect()
}

/// Divides sorted weights into runs that loops read in place; what is scattered goes to the
/// end, as one section.
fn sections(
    lowering: &ExpressionLowering,
    weights: &mut Vec<(ValueId, ExprId)>,
) -> Vec<Vec<ValueId>> {
    let adjacent =
        |a: &(ValueId, ExprId), b: &(ValueId, ExprId)| lowering.builder.are_adjacent(a.0, b.0);
    let (mut runs, mut scattered) = (Vec::new(), Vec::new());
    for run in weights.chunk_by(adjacent) {
        if run.len() >= SHORTEST_RUN {
            runs.push(run.to_vec());
        } else {
            scattered.extend_from_slice(run);
        }
    }
    if !scattered.is_empty() {
        runs.push(scattered);
    }
    *weights = runs.concat();
    let values = |run: Vec<(ValueId, ExprId)>| run.into_iter().map(|(value, _)| value).collect();
    runs.into_iter().map(values).collect()
}

/// A candidate term that touches one column of the Jacobian.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Kind {
    Variable,
    Sine,
    Cosine,
}

/// What a candidate term is, and of which variable; nothing for all other terms.
fn kind(pool: &ExprPool, expr: ExprId) -> Option<(Kind, SymbolId)> {
    match pool.node(expr) {
        Node::Symbol(symbol) => Some((Kind::Variable, *symbol)),
        Node::Apply(Function::Sin, argument) => Some((Kind::Sine, pool.as_symbol(*argument)?)),
        Node::Apply(Function::Cos, argument) => Some((Kind::Cosine, pool.as_symbol(*argument)?)),
        Node::Number(_) | Node::Sum(_) | Node::Product(_) | Node::Power(..) | Node::Apply(..) => {
            None
        }
    }
}

/// Derivatives of each equation by each variable.
fn slopes(
    pool: &mut ExprPool,
    equations: &[Combination],
    variables: &[SymbolId],
) -> Vec<Vec<Combination>> {
    let mut row = |equation: &Combination| {
        let by = |&symbol| equation.derivative(pool, symbol);
        variables.iter().map(by).collect()
    };
    equations.iter().map(&mut row).collect()
}

/// Rows up to the last column in which any is not zero, with zeros up to a multiple of [`LANES`].
fn padded(mut rows: Vec<Vec<Combination>>) -> Vec<Vec<Combination>> {
    let last = |row: &Vec<Combination>| row.iter().rposition(|slope| !slope.is_zero());
    let used = (rows.iter().filter_map(last).max()).map_or(0, |last| last + 1);
    for row in &mut rows {
        row.truncate(used);
        row.resize(used.next_multiple_of(LANES), Combination::default());
    }
    rows
}

/// How the equations divide; `columns` are the variables in the order of the Jacobian.
pub(super) struct DenseJacobian {
    /// Variables whose columns of the Jacobian vary.
    curved: Vec<SymbolId>,
    /// Variables that occur only linearly.
    linear: Vec<SymbolId>,
    /// All of these variables, in the order of the Jacobian.
    used: Vec<SymbolId>,
    /// Whether sines or cosines of variables occur.
    has_angles: bool,
    /// What is not in a separable group, one combination a row.
    rest: Vec<Combination>,
    /// Derivatives of `rest`, row by row: with angles one a used variable up to the last of which there
    /// are any, and zeros up to a multiple of [`LANES`]; otherwise one a curved variable.
    rest_slopes: Vec<Combination>,
}

impl DenseJacobian {
    /// Divides the equations; `pool` takes the derivatives.
    pub(crate) fn new(
        pool: &mut ExprPool,
        equations: &[Combination],
        columns: &[SymbolId],
    ) -> Self {
        let mut curved_set = BTreeSet::new();
        let mut has_angles = false;
        for expr in distinct(equations) {
            match kind(pool, expr) {
                Some((Kind::Variable, _)) => {}
                Some((Kind::Sine | Kind::Cosine, symbol)) => {
                    has_angles = true;
                    curved_set.insert(symbol);
                }
                None => curved_set.extend(pool.symbols_of(expr)),
            }
        }
        let is_linear = |symbol: &SymbolId| {
            let used = |&(_, expr): &(f64, ExprId)| pool.as_symbol(expr) == Some(*symbol);
            !curved_set.contains(symbol) && equations.iter().any(|e| e.items.iter().any(used))
        };
        let columns = columns.iter().copied();
        let linear: Vec<SymbolId> = columns.clone().filter(is_linear).collect();
        let is_curved = |symbol: &SymbolId| curved_set.contains(symbol);
        let curved: Vec<SymbolId> = columns.clone().filter(is_curved).collect();
        let is_used = |symbol: &SymbolId| curved.contains(symbol) || linear.contains(symbol);
        let used: Vec<SymbolId> = columns.filter(is_used).collect();
        // With angles, linear terms share the angles' loop.
        let in_group = |expr| match kind(pool, expr) {
            Some((Kind::Variable, symbol)) => has_angles && used.contains(&symbol),
            Some((Kind::Sine | Kind::Cosine, _)) => true,
            None => false,
        };
        let mut rest = equations.to_vec();
        for equation in &mut rest {
            equation.items.retain(|&(_, expr)| !in_group(expr));
        }
        let rest_slopes = match has_angles {
            true => padded(slopes(pool, &rest, &used)),
            false => slopes(pool, &rest, &curved),
        };
        Self {
            curved,
            linear,
            used,
            has_angles,
            rest,
            rest_slopes: rest_slopes.concat(),
        }
    }

    /// All expressions that the code needs besides the equations.
    pub(crate) fn expressions(&self) -> Vec<ExprId> {
        distinct(&self.rest_slopes)
    }

    /// The accelerations, and the value of each entry that may be nonzero by (row, variable).
    pub fn lower(
        &self,
        lowering: &mut ExpressionLowering,
        equations: &[Combination],
    ) -> (Vec<ValueId>, HashMap<(usize, SymbolId), ValueId>) {
        let ddz = matrix_vector(lowering, &self.rest);
        let has_rest_slopes = self.rest_slopes.iter().any(|slope| !slope.is_zero());
        let mut entries = HashMap::new();
        let mut enter = |variables: &[SymbolId], values: &[ValueId]| {
            for (row, values) in values.chunks(variables.len().max(1)).enumerate() {
                let row = variables.iter().map(|&symbol| (row, symbol));
                entries.extend(row.zip(values.iter().copied()));
            }
        };
        if self.has_angles {
            // The loops add to an entry for every row and variable.
            let base = has_rest_slopes.then(|| matrix_vector(lowering, &self.rest_slopes));
            let groups = self.groups(lowering, equations);
            let builder = &mut lowering.builder;
            let (ddz, slopes) = builder.separable(ddz, base, groups, self.used.len());
            enter(&self.used, &slopes);
            return (ddz, entries);
        }
        if !self.curved.is_empty() {
            let slopes = matrix_vector_without_zeros(lowering, &self.rest_slopes);
            enter(&self.curved, &slopes);
        }
        enter(&self.linear, &self.linear_slopes(lowering, equations));
        (ddz, entries)
    }

    /// Coefficients of the terms of one kind, rows x variables.
    fn coefficients(
        pool: &ExprPool,
        equations: &[Combination],
        variables: &[SymbolId],
        of: Kind,
    ) -> Vec<Vec<f64>> {
        let columns = variables.iter().enumerate();
        let column: HashMap<_, _> = columns.map(|(col, &s)| ((of, s), col)).collect();
        let row = |equation: &Combination| {
            let mut row = vec![0.0; variables.len()];
            for &(coefficient, expr) in &equation.items {
                if let Some(&col) = kind(pool, expr).and_then(|kind| column.get(&kind)) {
                    row[col] = coefficient;
                }
            }
            row
        };
        equations.iter().map(row).collect()
    }

    fn groups(&self, lowering: &mut ExpressionLowering, equations: &[Combination]) -> Vec<Group> {
        let zero = lowering.builder.constant(0.0);
        let variables: Vec<ExprId> = self
            .used
            .iter()
            .map(|&symbol| lowering.pool.symbol_expr(symbol))
            .collect();
        let values: Vec<ValueId> = variables.iter().map(|&v| lowering.value(v)).collect();
        let variables = self.used.iter().zip(variables);
        let is_curved = |(symbol, _): &(&SymbolId, ExprId)| self.curved.contains(symbol);
        let angles: Vec<ExprId> = variables
            .clone()
            .filter(is_curved)
            .map(|(_, v)| v)
            .collect();
        lowering.sines_and_cosines(&angles);
        let angle = |variable: (&SymbolId, ExprId)| match is_curved(&variable) {
            true => lowering.angle(variable.1),
            false => (zero, zero),
        };
        let (sines, cosines): (Vec<_>, Vec<_>) = variables.map(angle).unzip();
        let width = self.used.len().next_multiple_of(LANES);
        let mut is_first = true;
        let mut group = |of: Kind, values: &[ValueId], slopes: Slopes<&[ValueId]>| {
            let mut rows = Self::coefficients(lowering.pool, equations, &self.used, of);
            let last = rows
                .iter()
                .filter_map(|row| row.iter().rposition(|&x| x != 0.0));
            let last = last.max()?;
            // One group has a part in every column.
            let cols = match std::mem::take(&mut is_first) {
                true => width,
                false => (last + 1).next_multiple_of(LANES),
            };
            let filled = |values: &[ValueId]| {
                let mut values = values.to_vec();
                values.resize(cols, zero);
                values
            };
            for row in &mut rows {
                row.resize(cols, 0.0);
            }
            Some(Group {
                table: lowering
                    .builder
                    .table(Table::new(rows.len(), cols, rows.concat())),
                values: filled(values),
                slopes: slopes.map(|values| filled(values)),
            })
        };
        [
            group(Kind::Variable, &values, Slopes::One),
            group(Kind::Sine, &sines, Slopes::Plus(cosines.as_slice())),
            group(Kind::Cosine, &cosines, Slopes::Minus(sines.as_slice())),
        ]
        .into_iter()
        .flatten()
        .collect()
    }

    fn linear_slopes(
        &self,
        lowering: &mut ExpressionLowering,
        equations: &[Combination],
    ) -> Vec<ValueId> {
        if self.linear.is_empty() {
            return Vec::new();
        }
        let rows = Self::coefficients(lowering.pool, equations, &self.linear, Kind::Variable);
        let table = Table::new(rows.len(), self.linear.len(), rows.concat());
        lowering.builder.constants(table)
    }
}
