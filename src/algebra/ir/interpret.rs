//! Runs programs: the reference for generated code, and what simulation and
//! control run.

use super::program::{
    Binary, Group, LANES, Program, QUAD, Quad, QuadSum, Slopes, Slot, Statement, Table, Unary,
    ValueId,
};
use super::real::Real;

/// Runs one program as often as asked; owns the memory of all its values, so that
/// a run allocates nothing.
///
/// Numbers are `f64` unless another `Real` is named: `Interpreter::<f32>::new(&program)` is the
/// reference for generated code in single precision.
#[derive(Clone, Debug)]
pub struct Interpreter<T = f64> {
    inputs: Vec<Slot>,
    outputs: Vec<Slot>,
    /// Positions among the values of the elements of all inputs.
    loads: Vec<usize>,
    steps: Vec<Step>,
    tables: Vec<Table<T>>,
    callees: Vec<Interpreter<T>>,
    /// The values of the elements of all outputs.
    stores: Vec<ValueId>,
    /// Constants are set once; every other value is computed before it is read.
    values: Vec<T>,
}

/// A statement that computes something, and the position of its first value. Those of one operation are small,
/// as most steps are.
#[derive(Clone, Debug)]
enum Step {
    Unary(Unary, ValueId, usize),
    Binary(Binary, ValueId, ValueId, usize),
    Square(ValueId, usize),
    Select([ValueId; 3], usize),
    Array(Box<Statement>, usize),
}

impl<T: Real> Interpreter<T> {
    /// Prepares a program for runs.
    pub fn new(program: &Program) -> Self {
        let mut values = vec![T::constant(0.0); program.n_values()];
        let (mut loads, mut steps) = (Vec::new(), Vec::new());
        for (position, statement) in program.statements().iter().enumerate() {
            let first = program.values_of(position).start;
            match statement {
                Statement::Constant(constant) => values[first] = T::constant(*constant),
                Statement::Input { .. } => loads.push(first),
                Statement::Unary(op, a) => steps.push(Step::Unary(*op, *a, first)),
                Statement::Binary(Binary::Mul, a, b) if a == b => {
                    steps.push(Step::Square(*a, first));
                }
                Statement::Binary(op, a, b) => steps.push(Step::Binary(*op, *a, *b, first)),
                Statement::Select(operands) => steps.push(Step::Select(*operands, first)),
                array => steps.push(Step::Array(Box::new(array.clone()), first)),
            }
        }
        let len = |slots: &[Slot]| slots.iter().map(|slot| slot.len).sum::<usize>();
        assert_eq!(loads.len(), len(program.inputs()), "one load an element");
        let n_results = program.results().len();
        assert_eq!(n_results, len(program.outputs()), "one result an element");
        let table = |table: &Table| {
            let entries = table.entries.iter().map(|&x| T::constant(x));
            Table::new(table.rows, table.cols, entries.collect())
        };
        Self {
            inputs: program.inputs().to_vec(),
            outputs: program.outputs().to_vec(),
            loads,
            steps,
            tables: program.tables().iter().map(table).collect(),
            callees: program.callees().iter().map(Self::new).collect(),
            stores: program.results().iter().map(|entry| entry.value).collect(),
            values,
        }
    }

    /// Evaluates the program: one slice per input slot in, one per output slot out.
    ///
    /// # Panics
    /// If the number or a length of the slices differs from the program's slots.
    pub fn run(&mut self, inputs: &[&[T]], outputs: &mut [&mut [T]]) {
        assert_eq!(inputs.len(), self.inputs.len(), "one slice an input slot");
        assert_eq!(
            outputs.len(),
            self.outputs.len(),
            "one slice an output slot"
        );
        for (slice, slot) in inputs.iter().zip(&self.inputs) {
            assert_eq!(slice.len(), slot.len, "length of input `{}`", slot.name);
        }
        for (slice, slot) in outputs.iter().zip(&self.outputs) {
            assert_eq!(slice.len(), slot.len, "length of output `{}`", slot.name);
        }
        for (&load, &x) in self.loads.iter().zip(inputs.iter().copied().flatten()) {
            self.values[load] = x;
        }
        self.evaluate();
        let results = outputs.iter_mut().flat_map(|slice| slice.iter_mut());
        for (result, store) in results.zip(&self.stores) {
            *result = self.values[store.index()];
        }
    }

    /// The same for arrays, one an input slot; returns one an output slot.
    ///
    /// # Panics
    /// As [`Self::run`].
    pub fn results(&mut self, inputs: &[Vec<T>]) -> Vec<Vec<T>> {
        let slots = self.outputs.iter();
        let mut outputs: Vec<_> = slots.map(|slot| vec![T::constant(0.0); slot.len]).collect();
        let read: Vec<&[T]> = inputs.iter().map(Vec::as_slice).collect();
        let mut written: Vec<&mut [T]> = outputs.iter_mut().map(Vec::as_mut_slice).collect();
        self.run(&read, &mut written);
        outputs
    }

    fn evaluate(&mut self) {
        let values = &mut self.values;
        for step in &self.steps {
            match *step {
                Step::Unary(op, a, result) => values[result] = T::unary(op, values[a.index()]),
                Step::Square(a, result) => values[result] = values[a.index()].square(),
                Step::Binary(op, a, b, result) => {
                    let (a, b) = (values[a.index()], values[b.index()]);
                    values[result] = match op {
                        Binary::Add => a + b,
                        Binary::Sub => a - b,
                        Binary::Mul => a * b,
                        Binary::Div => a / b,
                        Binary::Pow => a.power(b),
                    };
                }
                Step::Select(operands, result) => {
                    let [test, zero, other] = operands.map(|operand| values[operand.index()]);
                    values[result] = T::select(test, zero, other);
                }
                Step::Array(ref statement, first) => {
                    array(statement, first, &self.tables, &mut self.callees, values);
                }
            }
        }
    }
}

fn array<T: Real>(
    statement: &Statement,
    first: usize,
    tables: &[Table<T>],
    callees: &mut [Interpreter<T>],
    values: &mut [T],
) {
    match statement {
        // No arrays.
        Statement::Constant(_)
        | Statement::Input { .. }
        | Statement::Unary(..)
        | Statement::Binary(..)
        | Statement::Select(_) => {}
        Statement::SinCos { arguments } => {
            for (k, argument) in arguments.iter().enumerate() {
                let (sine, cosine) = values[argument.index()].sin_cos();
                values[first + k] = sine;
                values[first + arguments.len() + k] = cosine;
            }
        }
        Statement::Accumulate { table, sections } => {
            accumulate(&tables[table.index()], sections, first, values);
        }
        Statement::Quads {
            table,
            weights,
            sums,
        } => quads(&tables[table.index()], weights, sums, first, values),
        Statement::Constants { table } => {
            let entries = tables[table.index()].entries();
            values[first..first + entries.len()].copy_from_slice(entries);
        }
        Statement::Separable {
            start,
            base,
            groups,
            cols,
        } => separable(tables, start, base.as_deref(), groups, *cols, first, values),
        Statement::Call { callee, arguments } => {
            let callee = &mut callees[*callee];
            for (&load, argument) in callee.loads.iter().zip(arguments) {
                callee.values[load] = values[argument.index()];
            }
            callee.evaluate();
            for (k, store) in callee.stores.iter().enumerate() {
                values[first + k] = callee.values[store.index()];
            }
        }
    }
}

fn quads<T: Real>(
    table: &Table<T>,
    weights: &[ValueId],
    sums: &[QuadSum],
    first: usize,
    values: &mut [T],
) {
    let vector = |quad: Quad, values: &[T]| -> [T; QUAD] {
        std::array::from_fn(|l| match quad {
            Quad::Row(row) => table.row(row)[l],
            Quad::Sum(sum) => values[first + QUAD * sum + l],
        })
    };
    for (position, sum) in sums.iter().enumerate() {
        let mut y = vector(sum.start, values);
        for &(weight, quad) in &sum.terms {
            let (w, v) = (values[weights[weight].index()], vector(quad, values));
            for (y, v) in y.iter_mut().zip(v) {
                *y = *y + v * w;
            }
        }
        values[first + QUAD * position..][..QUAD].copy_from_slice(&y);
    }
}

fn accumulate<T: Real>(
    table: &Table<T>,
    sections: &[Vec<ValueId>],
    first: usize,
    values: &mut [T],
) {
    let cols = table.cols;
    values[first..first + cols].copy_from_slice(table.row(0));
    let mut row = 1;
    for weights in sections {
        let blocks = weights.chunks_exact(4);
        let rest = blocks.remainder();
        for block in blocks {
            let w: [T; 4] = std::array::from_fn(|k| values[block[k].index()]);
            let rows: [&[T]; 4] = std::array::from_fn(|k| table.row(row + k));
            for (j, y) in values[first..first + cols].iter_mut().enumerate() {
                let front = rows[0][j] * w[0] + rows[1][j] * w[1];
                let back = rows[2][j] * w[2] + rows[3][j] * w[3];
                *y = *y + (front + back);
            }
            row += 4;
        }
        for weight in rest {
            let w = values[weight.index()];
            for (y, t) in values[first..first + cols].iter_mut().zip(table.row(row)) {
                *y = *y + *t * w;
            }
            row += 1;
        }
    }
}

/// Associated as [`Statement::Separable`] says.
fn separable<T: Real>(
    tables: &[Table<T>],
    start: &[ValueId],
    base: Option<&[ValueId]>,
    groups: &[Group],
    cols: usize,
    first: usize,
    values: &mut [T],
) {
    let (rows, zero) = (start.len(), T::constant(0.0));
    let width = base.map_or(0, |base| base.len() / rows);
    for r in 0..rows {
        let mut p = [zero; LANES];
        for i in 0..cols.next_multiple_of(LANES) {
            let mut sum: Option<T> = None;
            let base = base.filter(|_| i < width);
            let mut slope = base.map(|base| values[base[r * width + i].index()]);
            // Zeros fill the lanes behind the last column.
            let groups = groups
                .iter()
                .filter(|group| i < cols.min(group.values.len()));
            for group in groups {
                let t = tables[group.table.index()].row(r)[i];
                let times = |factors: &[ValueId]| t * values[factors[i].index()];
                let product = times(&group.values);
                sum = Some(sum.map_or(product, |sum| sum + product));
                slope = Some(match (&group.slopes, slope) {
                    (Slopes::One, None) => t,
                    (Slopes::One, Some(slope)) => slope + t,
                    (Slopes::Plus(slopes), None) => times(slopes),
                    (Slopes::Plus(slopes), Some(slope)) => slope + times(slopes),
                    (Slopes::Minus(slopes), None) => -times(slopes),
                    (Slopes::Minus(slopes), Some(slope)) => slope - times(slopes),
                });
            }
            let sum = sum.unwrap_or(zero);
            p[i % LANES] = if i < LANES { sum } else { p[i % LANES] + sum };
            if i < cols {
                values[first + rows + r * cols + i] = slope.unwrap_or(zero);
            }
        }
        let total = ((p[0] + p[4]) + (p[2] + p[6])) + ((p[1] + p[5]) + (p[3] + p[7]));
        values[first + r] = values[start[r].index()] + total;
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ProgramBuilder, Unary};
    use super::*;

    /// y = W^T [1; x] by table, for six weights: one block of four and two rows more.
    fn table_program() -> (Program, Vec<f64>) {
        let entries: Vec<f64> = (0..21).map(|k| f64::from(k) * 0.37 - 3.1).collect();
        let mut builder = ProgramBuilder::new("table");
        let x = builder.input("x", 6);
        let y = builder.accumulate(Table::new(7, 3, entries.clone()), vec![x]);
        builder.output("y", &y);
        (builder.finish().expect("valid program"), entries)
    }

    const X: [f64; 6] = [0.5, -1.25, 2.0, 3.5, -0.75, 1.5];

    #[test]
    fn accumulate_equals_matrix_vector_product() {
        let (program, entries) = table_program();
        let y = Interpreter::new(&program).results(&[X.to_vec()]).remove(0);
        for (j, found) in y.into_iter().enumerate() {
            let expected: f64 =
                entries[j] + (0..6).map(|i| entries[3 * (i + 1) + j] * X[i]).sum::<f64>();
            assert!((found - expected).abs() < 1e-13, "{found}, {expected}");
        }
    }

    #[test]
    fn call_evaluates_callee_each_time_with_its_own_arguments() {
        let (inner, _) = table_program();
        let mut builder = ProgramBuilder::new("twice");
        let x = builder.input("x", 6);
        let once = builder.call(&inner, &x).remove(0);
        let again = builder.call(&inner, &[&x[3..], &once].concat());
        builder.output("y", &again[0]);
        let program = builder.finish().expect("valid program");

        let mut single = Interpreter::new(&inner);
        let first = single.results(&[X.to_vec()]).remove(0);
        let expected = single.results(&[[&X[3..], &first].concat()]);
        let found = Interpreter::new(&program).results(&[X.to_vec()]);
        assert_eq!(found, expected);
    }

    #[test]
    fn separable_gives_sums_and_slopes_of_each_row() {
        let mut builder = ProgramBuilder::new("separable");
        let x = builder.input("x", 5);
        let one = builder.constant(1.0);
        let (sines, cosines) = builder.sin_cos(&x);
        let row = |row: u8, shift: f64| (0..5).map(move |k| f64::from(5 * row + k) - shift);
        let tables: [_; 3] = [1.5, -2.0, 7.25].map(|shift| {
            let rows = (0..2).flat_map(|r| row(r, shift).chain([0.0; 3]));
            builder.table(Table::new(2, LANES, rows.collect()))
        });
        let zero = builder.constant(0.0);
        let padded = |values: &[ValueId]| [values, &[zero; 3]].concat();
        let group = |table, values: &[ValueId], slopes| Group {
            table,
            values: padded(values),
            slopes,
        };
        let groups = vec![
            group(tables[0], &x, Slopes::One),
            group(tables[1], &sines, Slopes::Plus(padded(&cosines))),
            group(tables[2], &cosines, Slopes::Minus(padded(&sines))),
        ];
        let (sums, slopes) = builder.separable(vec![one, one], None, groups, 5);
        builder.output("y", &sums);
        builder.output("slopes", &slopes);
        let program = builder.finish().expect("valid program");

        let x: [f64; 5] = [0.3, -1.2, 2.0, 0.7, -0.4];
        let results = Interpreter::new(&program).results(&[x.to_vec()]);
        let (y, slopes) = (&results[0], &results[1]);
        for r in 0..2 {
            let mut expected = 1.0;
            for i in 0..5 {
                let k = (5 * r + i) as f64;
                let (a, b, c) = (k - 1.5, k + 2.0, k - 7.25);
                expected += a * x[i] + b * x[i].sin() + c * x[i].cos();
                let slope = a + b * x[i].cos() - c * x[i].sin();
                assert!((slopes[5 * r + i] - slope).abs() < 1e-13);
            }
            assert!((y[r] - expected).abs() < 1e-13, "{} {expected}", y[r]);
        }
    }

    #[test]
    fn sign_is_zero_at_zero_and_nan_of_nan() {
        assert_eq!(
            [-2.0, -0.0, 0.0, 3.0].map(|a| f64::unary(Unary::Sign, a)),
            [-1.0, 0.0, 0.0, 1.0]
        );
        assert!(f64::unary(Unary::Sign, f64::NAN).is_nan());
        assert!(f32::unary(Unary::Sign, f32::NAN).is_nan());
    }
}
