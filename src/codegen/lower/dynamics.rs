//! The accelerations `ddz = Xi^T Theta(z, dz, u_lat)` of a phase, their Jacobian, and a Runge-Kutta step.

use super::dense::{DenseJacobian, Form, distinct, matrix_vector};
use super::number::Number;
use super::polynomial::Polynomials;
use super::*;

/// Why a program could not be made from a model.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LowerError {
    /// The model lacks a part that the program needs, or has no such phase.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A coefficient is too large once folded with the numbers of its term.
    #[error("phase `{phase}`, output {output}: a folded coefficient is {value}")]
    NonFinite {
        phase: String,
        /// Row of the equations, from 1.
        output: usize,
        /// The resulting coefficient.
        value: f64,
    },
    /// The program breaks one of its promises.
    #[error(transparent)]
    Program(#[from] IrError),
}

/// Where the structural nonzeros of `d ddz / d (z, dz, u_lat)` stand, row-major.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
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

    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether the accelerations are constant.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }
}

/// The program of the accelerations: inputs `z`, `dz`, `u_lat`, output `ddz`, each `latent_dim` long, in scaled units.
///
/// # Errors
/// [`LowerError::Model`] if there is no such phase, [`LowerError::NonFinite`] if a coefficient overflows when folded.
pub fn dynamics(system: &Equations<'_>, phase: usize, form: Form) -> Result<Program> {
    let (program, _) = with_derivatives(system, phase, form, "dynamics", &[])?;
    Ok(program)
}

/// The program of the accelerations and the structural nonzeros of their exact Jacobian by `(z, dz, u_lat)`: outputs
/// `ddz` and `jacobian`, the latter absent if the accelerations are constant.
pub fn dynamics_jacobian(
    system: &Equations<'_>,
    phase: usize,
    form: Form,
) -> Result<(Program, JacobianPattern)> {
    let variables = LatentVariable::all(system.latent_dim());
    let columns: Vec<SymbolId> = variables.map(|variable| system.symbol(variable)).collect();
    with_derivatives(system, phase, form, "dynamics_jacobian", &columns)
}

fn with_derivatives(
    system: &Equations<'_>,
    phase: usize,
    form: Form,
    name: &str,
    columns: &[SymbolId],
) -> Result<(Program, JacobianPattern)> {
    let equations = accelerations(system, phase)?;
    let mut pool = system.pool.clone();
    let mut entries = Vec::new();
    let mut pattern = JacobianPattern::default();
    for (row, equation) in equations.iter().enumerate() {
        for (col, &variable) in columns.iter().enumerate() {
            let derivative = equation.derivative(&mut pool, variable);
            let derivative = finite(system.phase(phase)?, row, derivative)?;
            if !derivative.is_zero() {
                pattern.rows.push(row);
                pattern.cols.push(col);
                entries.push(derivative);
            }
        }
    }
    let (mut builder, mut ddz) = if form.uses_tables(&equations) {
        let dense = DenseJacobian::new(&mut pool, &equations, columns);
        let mut lowering = start(system, &pool, name);
        let mut roots = distinct(&equations);
        roots.extend(dense.expressions());
        lowering.prepare(&roots);
        let mut values = matrix_vector(&mut lowering, &equations);
        let entries = dense.lower(&mut lowering, &equations);
        let places = pattern.places();
        values.extend(places.map(|(row, col)| entries[&(row, columns[col])]));
        (lowering.builder, values)
    } else if let (Form::Automatic, Some(polynomials)) =
        (form, Polynomials::new(&mut pool, &equations, columns))
    {
        let mut lowering = start(system, &pool, name);
        let rows = polynomials.lower(&mut lowering);
        let places = pattern.places().map(|(row, col)| rows[row][1 + col]);
        let values = rows.iter().map(|row| row[0]).take(equations.len());
        (lowering.builder, values.chain(places).collect())
    } else {
        let sums = nested(&mut pool, &equations, columns, entries, &pattern);
        let mut lowering = start(system, &pool, name);
        let values = values(&mut lowering, &sums);
        (lowering.builder, values)
    };
    let jacobian = ddz.split_off(equations.len());
    builder.output("ddz", &ddz);
    if !jacobian.is_empty() {
        builder.output("jacobian", &jacobian);
    }
    Ok((builder.finish()?, pattern))
}

/// Accelerations and Jacobian in nested form: the factor that multiplies a variable in an acceleration is a part of the
/// derivative by that variable.
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
            (row, group)
        });
        let mut sum = demand.nest(pool, &entry);
        sum.shared = shared;
        sums.push(sum);
    }
    sums
}

/// The right-hand sides with folded coefficients, one per latent coordinate.
fn accelerations(system: &Equations<'_>, phase: usize) -> Result<Vec<Combination>> {
    let phase = system.phase(phase)?;
    let equation = |row| {
        let summands = phase.summands(system, row);
        let summands = summands.map(|(coefficient, term)| (coefficient, term.expr));
        finite(phase, row, Combination::collect(&system.pool, summands))
    };
    (0..system.latent_dim()).map(equation).collect()
}

fn finite(phase: &PhaseEquations, row: usize, sum: Combination) -> Result<Combination> {
    let coefficients = sum.items.iter().map(|&(coefficient, _)| coefficient);
    let mut numbers = std::iter::once(sum.constant).chain(coefficients);
    match numbers.find(|value| !value.is_finite()) {
        None => Ok(sum),
        Some(value) => Err(LowerError::NonFinite {
            phase: phase.name.clone(),
            output: row + 1,
            value,
        }),
    }
}

fn start<'a>(system: &Equations<'_>, pool: &'a ExprPool, name: &str) -> ExpressionLowering<'a> {
    let d = system.latent_dim();
    let mut builder = ProgramBuilder::new(name);
    let inputs = ["z", "dz", "u_lat"].map(|name| builder.input(name, d));
    let symbols = LatentVariable::all(d).map(|variable| system.symbol(variable));
    ExpressionLowering::new(pool, builder, symbols.zip(inputs.concat()).collect())
}

/// The values of nested sums; each may share a part of one before it.
fn values(lowering: &mut ExpressionLowering, sums: &[Nested]) -> Vec<ValueId> {
    let roots: Vec<ExprId> = sums.iter().flat_map(Nested::expressions).collect();
    lowering.prepare(&roots);
    let mut singles: Vec<Vec<ValueId>> = Vec::new();
    let mut values = Vec::new();
    for sum in sums {
        let shared = sum.shared.map(|(sum, group)| singles[sum][group]);
        let (value, parts) = lowering.nested(sum, shared);
        values.push(value);
        singles.push(parts);
    }
    values
}

/// The program of one fourth-order Runge-Kutta step of `d/dt (z, dz) = (dz, ddz)` over `h` seconds with constant
/// `u_lat`, in four calls of the accelerations. Inputs are `z`, `dz`, `u_lat`, `h`; outputs are `z`, `dz` after the
/// step.
pub fn rk4_step(system: &Equations<'_>, phase: usize, form: Form) -> Result<Program> {
    let accelerations = dynamics(system, phase, form)?;
    let d = system.latent_dim();
    let mut builder = ProgramBuilder::new("step");
    let inputs = ["z", "dz", "u_lat"].map(|name| builder.input(name, d));
    let h = builder.input("h", 1)[0];
    let sheet = &Sheet::new(&mut builder);
    let [z, dz, u_lat] = inputs.map(|ids| numbers(sheet, &ids));
    let h = Number::new(sheet, h);
    let (half_step, sixth_step) = (0.5 * h, h / 6.0);

    let mut velocities = vec![dz.clone()];
    let mut slopes: Vec<Vec<Number>> = Vec::new();
    let mut at = z.clone();
    for stage in 0..4 {
        let arguments = ids(&[at.as_slice(), &velocities[stage], &u_lat].concat());
        let outputs = sheet.borrow_mut().call(&accelerations, &arguments);
        slopes.push(numbers(sheet, &outputs[0]));
        if stage < 3 {
            let length = if stage == 2 { h } else { half_step };
            at = advance(&z, length, &velocities[stage]);
            velocities.push(advance(&dz, length, &slopes[stage]));
        }
    }
    let z_next = ids(&weighted(&z, sixth_step, &velocities));
    let dz_next = ids(&weighted(&dz, sixth_step, &slopes));
    builder.output("z", &z_next);
    builder.output("dz", &dz_next);
    Ok(builder.finish()?)
}

/// `start + length * slope`.
fn advance<'b>(start: &[Number<'b>], length: Number<'b>, slope: &[Number<'b>]) -> Vec<Number<'b>> {
    let pairs = start.iter().zip(slope);
    pairs
        .map(|(&start, &slope)| start + length * slope)
        .collect()
}

/// `start + sixth_step * ((s_1 + s_4) + 2 (s_2 + s_3))`.
fn weighted<'b>(
    start: &[Number<'b>],
    sixth_step: Number<'b>,
    stages: &[Vec<Number<'b>>],
) -> Vec<Number<'b>> {
    let mean = (0..start.len()).map(|k| {
        let [first, second, third, last] = [0, 1, 2, 3].map(|stage| stages[stage][k]);
        (first + last) + 2.0 * (second + third)
    });
    advance(start, sixth_step, &mean.collect::<Vec<_>>())
}
