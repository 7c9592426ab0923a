//! Runs programs: the reference for generated code, and what simulation and
//! control run.

use super::kernel::sin_cos;
use super::program::{Binary, Program, Slot, Statement, Table, Unary, ValueId};

/// Runs one program as often as asked; owns the memory of all its values, so that
/// a run allocates nothing.
#[derive(Clone, Debug)]
pub struct Interpreter {
    inputs: Vec<Slot>,
    outputs: Vec<Slot>,
    /// (slot, index, value) of each input element that the program reads.
    loads: Vec<(usize, usize, usize)>,
    steps: Vec<Step>,
    tables: Vec<Table>,
    callees: Vec<Callee>,
    /// (slot, index, value) of each output element.
    stores: Vec<(usize, usize, usize)>,
    /// Constants are set once; every other value is computed before it is read.
    values: Vec<f64>,
}

/// A statement that computes something, with positions in the values.
#[derive(Clone, Debug)]
enum Step {
    Unary(Unary, usize, usize),
    Binary(Binary, usize, usize, usize),
    SinCos(Box<[usize]>, usize),
    Accumulate(usize, Box<[usize]>, usize),
    ScaleColumns(usize, Box<[(usize, Box<[usize]>)]>, usize),
    Call(usize, Box<[usize]>, usize),
}

/// A program run inside another one.
#[derive(Clone, Debug)]
struct Callee {
    interpreter: Interpreter,
    arguments: Vec<f64>,
    results: Vec<f64>,
}

impl Interpreter {
    /// Prepares a program for runs.
    pub fn new(program: &Program) -> Self {
        let mut values = vec![0.0; program.n_values()];
        let (mut loads, mut steps) = (Vec::new(), Vec::new());
        for (position, statement) in program.statements().iter().enumerate() {
            let first = program.values_of(position).start;
            match statement {
                Statement::Constant(constant) => values[first] = *constant,
                Statement::Input { slot, index } => loads.push((*slot, *index, first)),
                Statement::Unary(op, a) => steps.push(Step::Unary(*op, a.index(), first)),
                Statement::Binary(op, a, b) => {
                    steps.push(Step::Binary(*op, a.index(), b.index(), first));
                }
                Statement::SinCos { arguments } => {
                    steps.push(Step::SinCos(positions(arguments), first));
                }
                Statement::Accumulate { table, weights } => {
                    steps.push(Step::Accumulate(table.index(), positions(weights), first));
                }
                Statement::ScaleColumns { offset, scaled } => {
                    let scaled = scaled
                        .iter()
                        .map(|(table, weights)| (table.index(), positions(weights)))
                        .collect();
                    steps.push(Step::ScaleColumns(offset.index(), scaled, first));
                }
                Statement::Call { callee, arguments } => {
                    steps.push(Step::Call(*callee, positions(arguments), first));
                }
            }
        }
        let stores = program
            .results()
            .iter()
            .map(|entry| (entry.slot, entry.index, entry.value.index()))
            .collect();
        Self {
            inputs: program.inputs().to_vec(),
            outputs: program.outputs().to_vec(),
            loads,
            steps,
            tables: program.tables().to_vec(),
            callees: program.callees().iter().map(Callee::new).collect(),
            stores,
            values,
        }
    }

    /// Evaluates the program: one slice per input slot in, one per output slot out.
    ///
    /// # Panics
    /// If the number or a length of the slices differs from the program's slots.
    pub fn run(&mut self, inputs: &[&[f64]], outputs: &mut [&mut [f64]]) {
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
        for &(slot, index, value) in &self.loads {
            self.values[value] = inputs[slot][index];
        }
        self.evaluate();
        for &(slot, index, value) in &self.stores {
            outputs[slot][index] = self.values[value];
        }
    }

    fn evaluate(&mut self) {
        let values = &mut self.values;
        for step in &self.steps {
            match step {
                Step::Unary(op, a, result) => values[*result] = unary(*op, values[*a]),
                Step::Binary(op, a, b, result) => {
                    values[*result] = binary(*op, values[*a], values[*b]);
                }
                Step::SinCos(arguments, first) => {
                    for (k, &argument) in arguments.iter().enumerate() {
                        let (sine, cosine) = sin_cos(values[argument]);
                        values[first + k] = sine;
                        values[first + arguments.len() + k] = cosine;
                    }
                }
                Step::Accumulate(table, weights, first) => {
                    accumulate(&self.tables[*table], weights, *first, values);
                }
                Step::ScaleColumns(offset, scaled, first) => {
                    scale_columns(&self.tables, *offset, scaled, *first, values);
                }
                Step::Call(callee, arguments, first) => {
                    let callee = &mut self.callees[*callee];
                    for (slot, &argument) in callee.arguments.iter_mut().zip(arguments) {
                        *slot = values[argument];
                    }
                    callee.run();
                    let end = first + callee.results.len();
                    values[*first..end].copy_from_slice(&callee.results);
                }
            }
        }
    }
}

impl Callee {
    fn new(program: &Program) -> Self {
        let len = |slots: &[Slot]| slots.iter().map(|slot| slot.len).sum();
        Self {
            interpreter: Interpreter::new(program),
            arguments: vec![0.0; len(program.inputs())],
            results: vec![0.0; len(program.outputs())],
        }
    }

    /// Runs on `arguments`, which hold all input slots one after the other.
    fn run(&mut self) {
        let inner = &mut self.interpreter;
        let offset = |slots: &[Slot], slot: usize| -> usize {
            slots[..slot].iter().map(|earlier| earlier.len).sum()
        };
        for &(slot, index, value) in &inner.loads {
            inner.values[value] = self.arguments[offset(&inner.inputs, slot) + index];
        }
        inner.evaluate();
        for &(slot, index, value) in &inner.stores {
            self.results[offset(&inner.outputs, slot) + index] = inner.values[value];
        }
    }
}

fn positions(values: &[ValueId]) -> Box<[usize]> {
    values.iter().map(|value| value.index()).collect()
}

fn unary(op: Unary, a: f64) -> f64 {
    match op {
        Unary::Neg => -a,
        Unary::Sqrt => a.sqrt(),
        Unary::Abs => a.abs(),
        Unary::Sign => f64::from(i8::from(a > 0.0) - i8::from(a < 0.0)),
        Unary::Tan => a.tan(),
        Unary::Tanh => a.tanh(),
        Unary::Exp => a.exp(),
        Unary::Log => a.ln(),
    }
}

fn binary(op: Binary, a: f64, b: f64) -> f64 {
    match op {
        Binary::Add => a + b,
        Binary::Sub => a - b,
        Binary::Mul => a * b,
        Binary::Div => a / b,
    }
}

fn accumulate(table: &Table, weights: &[usize], first: usize, values: &mut [f64]) {
    let cols = table.cols();
    values[first..first + cols].copy_from_slice(table.row(0));
    let blocks = weights.len() / 4;
    for block in 0..blocks {
        let w: [f64; 4] = std::array::from_fn(|k| values[weights[4 * block + k]]);
        let rows: [&[f64]; 4] = std::array::from_fn(|k| table.row(1 + 4 * block + k));
        for (j, y) in values[first..first + cols].iter_mut().enumerate() {
            let front = rows[0][j] * w[0] + rows[1][j] * w[1];
            let back = rows[2][j] * w[2] + rows[3][j] * w[3];
            *y += front + back;
        }
    }
    for (k, &weight) in weights.iter().enumerate().skip(4 * blocks) {
        let w = values[weight];
        let row = table.row(1 + k);
        for (y, t) in values[first..first + cols].iter_mut().zip(row) {
            *y += t * w;
        }
    }
}

fn scale_columns(
    tables: &[Table],
    offset: usize,
    scaled: &[(usize, Box<[usize]>)],
    first: usize,
    values: &mut [f64],
) {
    let (rows, cols) = (tables[offset].rows(), tables[offset].cols());
    for r in 0..rows {
        for i in 0..cols {
            let mut sum = tables[offset].row(r)[i];
            for (table, weights) in scaled {
                sum += tables[*table].row(r)[i] * values[weights[i]];
            }
            values[first + r * cols + i] = sum;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::ProgramBuilder;
    use super::*;

    /// y = W^T [1; x] by table, for six weights: one block of four and two rows more.
    fn table_program() -> (Program, Vec<f64>) {
        let entries: Vec<f64> = (0..21).map(|k| f64::from(k) * 0.37 - 3.1).collect();
        let mut builder = ProgramBuilder::new("table");
        let x = builder.input("x", 6);
        let table = builder.table(Table::new(7, 3, entries.clone()));
        let y = builder.accumulate(table, &x);
        builder.output("y", &y);
        (builder.finish().expect("valid program"), entries)
    }

    #[test]
    fn accumulate_equals_matrix_vector_product() {
        let (program, entries) = table_program();
        let x = [0.5, -1.25, 2.0, 3.5, -0.75, 1.5];
        let mut y = [0.0; 3];
        Interpreter::new(&program).run(&[&x], &mut [&mut y]);
        for j in 0..3 {
            let expected: f64 =
                entries[j] + (0..6).map(|i| entries[3 * (i + 1) + j] * x[i]).sum::<f64>();
            assert!(
                (y[j] - expected).abs() < 1e-13,
                "{} against {expected}",
                y[j]
            );
        }
    }

    #[test]
    fn call_evaluates_callee_each_time_with_its_own_arguments() {
        let (inner, _) = table_program();
        let mut builder = ProgramBuilder::new("twice");
        let x = builder.input("x", 6);
        let once = builder.call(&inner, &x).remove(0);
        let again = builder.call(&inner, &[x[3], x[4], x[5], once[0], once[1], once[2]]);
        builder.output("y", &again[0]);
        let program = builder.finish().expect("valid program");

        let x = [0.5, -1.25, 2.0, 3.5, -0.75, 1.5];
        let (mut first, mut expected, mut found) = ([0.0; 3], [0.0; 3], [0.0; 3]);
        let mut single = Interpreter::new(&inner);
        single.run(&[&x], &mut [&mut first]);
        single.run(
            &[&[x[3], x[4], x[5], first[0], first[1], first[2]]],
            &mut [&mut expected],
        );
        Interpreter::new(&program).run(&[&x], &mut [&mut found]);
        assert_eq!(found, expected);
    }

    #[test]
    fn scale_columns_scales_each_column_of_each_table() {
        let mut builder = ProgramBuilder::new("scale");
        let w = builder.input("w", 2);
        let offset = builder.table(Table::new(2, 2, vec![1.0, 2.0, 3.0, 4.0]));
        let table = builder.table(Table::new(2, 2, vec![10.0, 20.0, 30.0, 40.0]));
        let y = builder.scale_columns(offset, vec![(table, w)]);
        builder.output("y", &y);
        let program = builder.finish().expect("valid program");
        let mut y = [0.0; 4];
        Interpreter::new(&program).run(&[&[0.5, -1.0]], &mut [&mut y]);
        assert_eq!(y, [6.0, -18.0, 18.0, -36.0]);
    }

    #[test]
    fn sign_is_zero_at_zero_and_for_nan() {
        assert_eq!(
            [-2.0, -0.0, 0.0, 3.0, f64::NAN].map(|a| unary(Unary::Sign, a)),
            [-1.0, 0.0, 0.0, 1.0, 0.0]
        );
    }
}
