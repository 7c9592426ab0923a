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
/// Numbers are `f64` unless another [`Real`] is named: `Interpreter::<f32>::of(&program)` is the
/// reference for generated code in single precision.
#[derive(Clone, Debug)]
pub struct Interpreter<T = f64> {
    inputs: Vec<Slot>,
    outputs: Vec<Slot>,
    /// (slot, index, value) of each input element that the program reads.
    loads: Vec<(usize, usize, usize)>,
    steps: Vec<Step<T>>,
    tables: Vec<Entries<T>>,
    callees: Vec<Callee<T>>,
    /// (slot, index, value) of each output element.
    stores: Vec<(usize, usize, usize)>,
    /// Constants are set once; every other value is computed before it is read.
    values: Vec<T>,
}

/// A constant table in the numbers of the run.
#[derive(Clone, Debug)]
struct Entries<T> {
    cols: usize,
    entries: Box<[T]>,
}

impl<T: Real> Entries<T> {
    fn new(table: &Table) -> Self {
        Self {
            cols: table.cols(),
            entries: table.entries().iter().map(|&x| T::constant(x)).collect(),
        }
    }

    fn row(&self, row: usize) -> &[T] {
        &self.entries[row * self.cols..(row + 1) * self.cols]
    }
}

/// A statement that computes something, with positions in the values.
#[derive(Clone, Debug)]
enum Step<T> {
    Unary(Unary, usize, usize),
    Binary(Binary, usize, usize, usize),
    Square(usize, usize),
    SinCos(Box<[usize]>, usize),
    Accumulate(usize, Box<[Box<[usize]>]>, usize),
    Quads(usize, Box<[QuadSum]>, usize),
    Constants(usize, usize),
    Separable(Box<SeparableStep<T>>, usize),
    Call(usize, Box<[usize]>, usize),
}

/// Sums of functions of one variable each; positions in the values.
#[derive(Clone, Debug)]
struct SeparableStep<T> {
    start: Box<[usize]>,
    base: Option<Box<[usize]>>,
    groups: Vec<Group>,
    /// Number of variables.
    cols: usize,
    /// One product sum a column, reused by every row; zero behind the last.
    columns: Vec<T>,
}

/// A program run inside another one.
#[derive(Clone, Debug)]
struct Callee<T> {
    interpreter: Interpreter<T>,
    arguments: Vec<T>,
    results: Vec<T>,
}

impl Interpreter {
    /// Prepares a program for runs in double precision.
    pub fn new(program: &Program) -> Self {
        Self::of(program)
    }
}

impl<T: Real> Interpreter<T> {
    /// Prepares a program for runs on a kind of numbers.
    pub fn of(program: &Program) -> Self {
        let mut values = vec![T::constant(0.0); program.n_values()];
        let (mut loads, mut steps) = (Vec::new(), Vec::new());
        for (position, statement) in program.statements().iter().enumerate() {
            let first = program.values_of(position).start;
            match statement {
                Statement::Constant(constant) => values[first] = T::constant(*constant),
                Statement::Input { slot, index } => loads.push((*slot, *index, first)),
                Statement::Unary(op, a) => steps.push(Step::Unary(*op, a.index(), first)),
                Statement::Binary(Binary::Mul, a, b) if a == b => {
                    steps.push(Step::Square(a.index(), first));
                }
                Statement::Binary(op, a, b) => {
                    steps.push(Step::Binary(*op, a.index(), b.index(), first));
                }
                Statement::SinCos { arguments } => {
                    steps.push(Step::SinCos(positions(arguments), first));
                }
                Statement::Accumulate { table, sections } => {
                    let sections = sections.iter().map(|section| positions(section)).collect();
                    steps.push(Step::Accumulate(table.index(), sections, first));
                }
                Statement::Quads {
                    table,
                    weights,
                    sums,
                } => {
                    // Weights by their positions in the values.
                    let mut sums = sums.clone();
                    for term in sums.iter_mut().flat_map(|sum| &mut sum.terms) {
                        term.0 = weights[term.0].index();
                    }
                    steps.push(Step::Quads(table.index(), sums.into(), first));
                }
                Statement::Constants { table } => {
                    steps.push(Step::Constants(table.index(), first));
                }
                Statement::Separable {
                    start,
                    base,
                    groups,
                    cols,
                } => {
                    let step = SeparableStep {
                        start: positions(start),
                        base: base.as_deref().map(positions),
                        groups: groups.clone(),
                        cols: *cols,
                        columns: vec![T::constant(0.0); cols.next_multiple_of(LANES)],
                    };
                    steps.push(Step::Separable(Box::new(step), first));
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
            tables: program.tables().iter().map(Entries::new).collect(),
            callees: program.callees().iter().map(Callee::new).collect(),
            stores,
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
        for step in &mut self.steps {
            match step {
                Step::Unary(op, a, result) => values[*result] = T::unary(*op, values[*a]),
                Step::Binary(op, a, b, result) => {
                    values[*result] = binary(*op, values[*a], values[*b]);
                }
                Step::Square(a, result) => values[*result] = values[*a].square(),
                Step::SinCos(arguments, first) => {
                    for (k, &argument) in arguments.iter().enumerate() {
                        let (sine, cosine) = values[argument].sin_cos();
                        values[*first + k] = sine;
                        values[*first + arguments.len() + k] = cosine;
                    }
                }
                Step::Accumulate(table, sections, first) => {
                    accumulate(&self.tables[*table], sections, *first, values);
                }
                Step::Quads(table, sums, first) => {
                    quads(&self.tables[*table], sums, *first, values);
                }
                Step::Constants(table, first) => {
                    let entries = &self.tables[*table].entries;
                    values[*first..*first + entries.len()].copy_from_slice(entries);
                }
                Step::Separable(step, first) => step.run(&self.tables, *first, values),
                Step::Call(callee, arguments, first) => {
                    let callee = &mut self.callees[*callee];
                    for (slot, &argument) in callee.arguments.iter_mut().zip(&*arguments) {
                        *slot = values[argument];
                    }
                    callee.run();
                    let end = *first + callee.results.len();
                    values[*first..end].copy_from_slice(&callee.results);
                }
            }
        }
    }
}

impl<T: Real> Callee<T> {
    fn new(program: &Program) -> Self {
        let len = |slots: &[Slot]| slots.iter().map(|slot| slot.len).sum();
        Self {
            interpreter: Interpreter::of(program),
            arguments: vec![T::constant(0.0); len(program.inputs())],
            results: vec![T::constant(0.0); len(program.outputs())],
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

fn binary<T: Real>(op: Binary, a: T, b: T) -> T {
    match op {
        Binary::Add => a + b,
        Binary::Sub => a - b,
        Binary::Mul => a * b,
        Binary::Div => a / b,
    }
}

/// The sums' terms have positions of weights in the values.
fn quads<T: Real>(table: &Entries<T>, sums: &[QuadSum], first: usize, values: &mut [T]) {
    let vector = |quad: Quad, values: &[T]| -> [T; QUAD] {
        std::array::from_fn(|l| match quad {
            Quad::Row(row) => table.row(row)[l],
            Quad::Sum(sum) => values[first + QUAD * sum + l],
        })
    };
    for (position, sum) in sums.iter().enumerate() {
        let mut y = vector(sum.start, values);
        for &(weight, quad) in &sum.terms {
            let (w, v) = (values[weight], vector(quad, values));
            for (y, v) in y.iter_mut().zip(v) {
                *y = *y + v * w;
            }
        }
        values[first + QUAD * position..][..QUAD].copy_from_slice(&y);
    }
}

fn accumulate<T: Real>(
    table: &Entries<T>,
    sections: &[Box<[usize]>],
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
            let w: [T; 4] = std::array::from_fn(|k| values[block[k]]);
            let rows: [&[T]; 4] = std::array::from_fn(|k| table.row(row + k));
            for (j, y) in values[first..first + cols].iter_mut().enumerate() {
                let front = rows[0][j] * w[0] + rows[1][j] * w[1];
                let back = rows[2][j] * w[2] + rows[3][j] * w[3];
                *y = *y + (front + back);
            }
            row += 4;
        }
        for &weight in rest {
            let w = values[weight];
            for (y, t) in values[first..first + cols].iter_mut().zip(table.row(row)) {
                *y = *y + *t * w;
            }
            row += 1;
        }
    }
}

impl<T: Real> SeparableStep<T> {
    fn run(&mut self, tables: &[Entries<T>], first: usize, values: &mut [T]) {
        let (rows, cols) = (self.start.len(), self.cols);
        let width = self.base.as_ref().map_or(0, |base| base.len() / rows);
        for r in 0..rows {
            for i in 0..cols {
                let mut sum: Option<T> = None;
                let base = self.base.as_ref().filter(|_| i < width);
                let mut slope = base.map(|base| values[base[r * width + i]]);
                for group in self.groups.iter().filter(|group| i < group.values.len()) {
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
                self.columns[i] = sum.unwrap_or(T::constant(0.0));
                values[first + rows + r * cols + i] = slope.unwrap_or(T::constant(0.0));
            }
            values[first + r] = lane_sum(values[self.start[r]], &self.columns);
        }
    }
}

/// `start` plus all columns, associated as [`Statement::Separable`] says.
fn lane_sum<T: Real>(start: T, columns: &[T]) -> T {
    let p: [T; LANES] = std::array::from_fn(|l| {
        let lane = columns[l..].iter().step_by(LANES).copied();
        lane.reduce(|p, q| p + q).unwrap_or(T::constant(0.0))
    });
    start + (((p[0] + p[4]) + (p[2] + p[6])) + ((p[1] + p[5]) + (p[3] + p[7])))
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
        let y = builder.accumulate(table, vec![x]);
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
            let found = y[j];
            assert!((found - expected).abs() < 1e-13, "{found}, {expected}");
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
        let (mut y, mut slopes) = ([0.0; 2], [0.0; 10]);
        Interpreter::new(&program).run(&[&x], &mut [&mut y, &mut slopes]);
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
    fn sign_is_zero_at_zero_and_for_nan() {
        assert_eq!(
            [-2.0, -0.0, 0.0, 3.0, f64::NAN].map(|a| f64::unary(Unary::Sign, a)),
            [-1.0, 0.0, 0.0, 1.0, 0.0]
        );
    }
}
