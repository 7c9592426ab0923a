//! The accelerations `ddz = Xi^T Theta(z, dz, u_lat)` of a phase and their Jacobian.

use std::collections::HashMap;

use super::combination::Combination;
use super::cost::Form;
use super::dense::{DenseJacobian, distinct, matrix_vector};
use super::error::LowerError;
use super::expression::ExpressionLowering;
use super::nested::{Demand, Nested, Shared};
use crate::equations::Equations;
use crate::ir::{Program, ProgramBuilder, ValueId};
use crate::model::LatentVariable;
use crate::symbolic::{ExprId, ExprPool, SymbolId};

/// Where the structural nonzeros of `d ddz / d (z, dz, u_lat)` stand, row-major.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JacobianPattern {
    /// Row of each entry: the component of ddz.
    pub rows: Vec<usize>,
    /// Column of each entry: z in the first `latent_dim`, then dz, then u_lat.
    pub cols: Vec<usize>,
}

impl JacobianPattern {
    pub(super) fn places(&self) -> impl Iterator<Item = (usize, usize)> {
        self.rows.iter().copied().zip(self.cols.iter().copied())
    }

    /// Number of entries.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether the accelerations are constant.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }
}

/// The program of the accelerations: inputs `z`, `dz`, `u_lat`, output `ddz`, each
/// `latent_dim` long, in scaled units.
///
/// # Errors
/// [`LowerError::Model`] if there is no such phase, [`LowerError::NonFinite`] if a
/// coefficient overflows when folded.
pub fn dynamics(system: &Equations<'_>, phase: usize, form: Form) -> Result<Program, LowerError> {
    let (program, _) = with_derivatives(system, phase, form, "dynamics", &[])?;
    Ok(program)
}

/// The program of the accelerations and the structural nonzeros of their exact Jacobian
/// by `(z, dz, u_lat)`: outputs `ddz` and `jacobian`, the latter absent if the
/// accelerations are constant.
///
/// # Errors
/// As [`dynamics`].
pub fn dynamics_jacobian(
    system: &Equations<'_>,
    phase: usize,
    form: Form,
) -> Result<(Program, JacobianPattern), LowerError> {
    let variables = LatentVariable::all(system.latent_dim());
    let columns: Vec<SymbolId> = variables.map(|variable| system.symbol(variable)).collect();
    with_derivatives(system, phase, form, "dynamics_jacobian", &columns)
}

/// The program of the accelerations and of their derivatives by some variables.
fn with_derivatives(
    system: &Equations<'_>,
    phase: usize,
    form: Form,
    name: &str,
    columns: &[SymbolId],
) -> Result<(Program, JacobianPattern), LowerError> {
    let equations = accelerations(system, phase)?;
    let mut pool = system.pool().clone();
    let mut entries = Vec::new();
    let mut pattern = JacobianPattern {
        rows: Vec::new(),
        cols: Vec::new(),
    };
    for (row, equation) in equations.iter().enumerate() {
        for (col, &variable) in columns.iter().enumerate() {
            let derivative = equation.derivative(&mut pool, variable);
            check_finite(system, phase, row, &derivative)?;
            if !derivative.is_zero() {
                pattern.rows.push(row);
                pattern.cols.push(col);
                entries.push(derivative);
            }
        }
    }
    let (mut builder, ddz, jacobian) = if form.uses_tables(&equations) {
        let dense = DenseJacobian::new(&mut pool, &equations, columns);
        let mut lowering = start(system, &pool, name);
        let mut roots = distinct(&equations);
        roots.extend(dense.expressions());
        lowering.prepare(&roots);
        let ddz = matrix_vector(&mut lowering, &equations);
        let entries = dense.lower(&mut lowering, &equations);
        let places = pattern.places();
        let jacobian = places.map(|(row, col)| entries[&(row, columns[col])]);
        let jacobian = jacobian.collect();
        (lowering.builder, ddz, jacobian)
    } else {
        let sums = nested(&mut pool, &equations, columns, entries, &pattern);
        let mut lowering = start(system, &pool, name);
        let mut ddz = values(&mut lowering, &sums);
        let jacobian = ddz.split_off(equations.len());
        (lowering.builder, ddz, jacobian)
    };
    builder.output("ddz", &ddz);
    if !jacobian.is_empty() {
        builder.output("jacobian", &jacobian);
    }
    Ok((builder.finish()?, pattern))
}

/// Accelerations, then the entries of the pattern, in nested form: what a variable was taken
/// out of in an acceleration is a part of its derivative by that variable.
fn nested(
    pool: &mut ExprPool,
    equations: &[Combination],
    columns: &[SymbolId],
    entries: Vec<Combination>,
    pattern: &JacobianPattern,
) -> Vec<Nested> {
    let demand = Demand::new(pool, equations.iter().chain(&entries));
    let nest = |equation| demand.nest(pool, equation);
    let mut sums: Vec<Nested> = equations.iter().map(nest).collect();
    for ((row, col), mut entry) in pattern.places().zip(entries) {
        let variable = pool.symbol_expr(columns[col]);
        let shared = sums[row].part_of(variable, &entry).map(|group| {
            let known = &sums[row].groups[group].single.items;
            entry.items.retain(|item| !known.contains(item));
            Shared { sum: row, group }
        });
        let mut sum = demand.nest(pool, &entry);
        sum.shared = shared;
        sums.push(sum);
    }
    sums
}

/// The right-hand sides with folded coefficients, one a latent coordinate.
fn accelerations(system: &Equations<'_>, phase: usize) -> Result<Vec<Combination>, LowerError> {
    let phase_equations = system.phase(phase)?;
    (0..system.latent_dim())
        .map(|row| {
            let summands = phase_equations
                .summands(system, row)
                .map(|(coefficient, term)| (coefficient, term.expr()));
            let equation = Combination::collect(system.pool(), summands);
            check_finite(system, phase, row, &equation)?;
            Ok(equation)
        })
        .collect()
}

fn check_finite(
    system: &Equations<'_>,
    phase: usize,
    row: usize,
    combination: &Combination,
) -> Result<(), LowerError> {
    match combination.non_finite() {
        None => Ok(()),
        Some(value) => Err(LowerError::NonFinite {
            phase: system.phase(phase)?.name.clone(),
            output: row + 1,
            value,
        }),
    }
}

/// A lowering whose program has the inputs `z`, `dz` and `u_lat`.
fn start<'a>(system: &Equations<'_>, pool: &'a ExprPool, name: &str) -> ExpressionLowering<'a> {
    let d = system.latent_dim();
    let mut builder = ProgramBuilder::new(name);
    let inputs = [
        builder.input("z", d),
        builder.input("dz", d),
        builder.input("u_lat", d),
    ];
    let variables: HashMap<SymbolId, ValueId> = LatentVariable::all(d)
        .zip(inputs.into_iter().flatten())
        .map(|(variable, value)| (system.symbol(variable), value))
        .collect();
    ExpressionLowering::new(pool, builder, variables)
}

/// The values of nested sums; each may share a part of one before it.
fn values(lowering: &mut ExpressionLowering, sums: &[Nested]) -> Vec<ValueId> {
    let roots: Vec<ExprId> = sums.iter().flat_map(Nested::expressions).collect();
    lowering.prepare(&roots);
    let mut singles: Vec<Vec<ValueId>> = Vec::new();
    let mut values = Vec::new();
    for sum in sums {
        let shared = sum.shared.map(|part| singles[part.sum][part.group]);
        let (value, parts) = lowering.nested(sum, shared);
        values.push(value);
        singles.push(parts);
    }
    values
}
