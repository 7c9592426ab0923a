//! Runs programs: the reference for generated code, and the evaluator of simulation and control.
//!
//! Sine and cosine are computed together, without branches. The argument is reduced by the nearest multiple of pi/2,
//! held as three parts (Cody and Waite). Two minimax polynomials give sine and cosine of the remainder, and the low two
//! bits of the multiple exchange and negate them. The polynomials minimise the relative error over +-pi/4 and were
//! found by a Remez exchange with coefficients rounded one after the other. Their error is 2^-57.9 (sine) and 2^-63.9
//! (cosine), in single precision 2^-27.9 and 2^-33. Beyond `LIMIT`, at infinities and NaN: the standard library.
//!
//! C and Rust emit the same operations in this order, with these constants. The parts of pi/2 (40, 40 and 53 bits; in
//! single precision 17, 17 and 24) are truncated, not rounded. The first two times a multiple up to 2^13, 2^7 are
//! therefore exact, and a positive tail keeps the sign of zero. Adding `ROUND`, 1.5 times 2^52 or 2^23, rounds to an
//! integer, which the low bits then hold. `SIN` is (r - sin r) / r^3 in powers of r^2, `COS` is (cos r - 1 + r^2/2) /
//! r^4.

use super::operation::{Binary, Real, Unary, alternating};
use super::program::{LANES, Program, Slot, Statement, Table, ValueId, Vector};

/// Runs one program as often as asked; owns the memory of all its values, so that a run allocates nothing. Numbers are
/// `f64` unless another `Real` is named: `Interpreter::<f32>` is the reference for code in single precision.
#[derive(Clone, Debug)]
pub struct Interpreter<T = f64> {
    inputs: Vec<usize>, // lengths of the slots
    outputs: Vec<usize>,
    loads: Vec<usize>, // positions of the elements of all inputs among the values
    steps: Vec<Step>,
    tables: Vec<Table<T>>,
    callees: Vec<Interpreter<T>>,
    stores: Vec<ValueId>,
    values: Vec<T>, // constants are set once; every other value is computed before it is read
}

/// A statement that computes something, and the position of its first value; small for single operations, as most are.
#[derive(Clone, Debug)]
enum Step {
    Unary(Unary, ValueId, usize),
    Binary(Binary, ValueId, ValueId, usize),
    Square(ValueId, usize),
    Select([ValueId; 3], usize),
    Array(Box<Statement>, usize),
}

impl<T: Real> Interpreter<T> {
    pub fn new(program: &Program) -> Self {
        let mut values = vec![T::constant(0.0); program.n_values()];
        let (mut loads, mut steps) = (Vec::new(), Vec::new());
        for (position, statement) in program.statements.iter().enumerate() {
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
        let lengths = |slots: &[Slot]| slots.iter().map(|slot| slot.len).collect();
        let table = |table: &Table| {
            let entries = table.entries.iter().map(|&x| T::constant(x));
            Table::new(table.rows, table.cols, entries.collect())
        };
        Self {
            inputs: lengths(&program.inputs),
            outputs: lengths(&program.outputs),
            loads,
            steps,
            tables: program.tables.iter().map(table).collect(),
            callees: program.callees.iter().map(Self::new).collect(),
            stores: program.results.iter().map(|entry| entry.value).collect(),
            values,
        }
    }

    /// Evaluates the program: one slice per input slot in, one per output slot out.
    ///
    /// # Panics
    /// If the number or a length of the slices differs from the program's slots.
    pub fn run(&mut self, inputs: &[&[T]], outputs: &mut [&mut [T]]) {
        let lengths = inputs.iter().map(|slice| slice.len());
        assert!(lengths.eq(self.inputs.iter().copied()), "lengths of inputs");
        let lengths = outputs.iter().map(|slice| slice.len());
        assert!(
            lengths.eq(self.outputs.iter().copied()),
            "lengths of outputs"
        );
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
    pub fn results(&mut self, inputs: &[Vec<T>]) -> Vec<Vec<T>> {
        let lengths = self.outputs.iter();
        let mut outputs: Vec<_> = lengths.map(|&len| vec![T::constant(0.0); len]).collect();
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
                Step::Square(a, result) => values[result] = values[a.index()] * values[a.index()],
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
                    let is_zero = test == T::constant(0.0);
                    values[result] = if is_zero { zero } else { other };
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
        Statement::Accumulate { table, weights } => {
            accumulate(&tables[*table], weights, first, values);
        }
        Statement::Scaled { base, groups } => {
            let cols = tables[groups[0].0].cols;
            for k in 0..tables[groups[0].0].entries.len() {
                let mut sum = base.as_ref().map(|base| values[base[k].index()]);
                for (table, weights) in groups {
                    let entry = tables[*table].entries[k];
                    let weight = weights.as_ref().map(|weights| weights[k % cols]);
                    let term = weight.map_or(entry, |weight| entry * values[weight.index()]);
                    sum = Some(sum.map_or(term, |sum| sum + term));
                }
                values[first + k] = sum.expect("at least one group");
            }
        }
        Statement::Lanes { start, terms } => {
            for lane in 0..LANES {
                let number = |vector: &Vector| values[vector[lane].index()];
                let products = terms.iter();
                let products = products.map(|(v, weight)| Some(number(v) * values[weight.index()]));
                let sum = alternating(start.as_ref().map(number), products, |a, b| a + b);
                values[first + lane] = sum.expect("at least one term");
            }
        }
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

fn accumulate<T: Real>(table: &Table<T>, weights: &[ValueId], first: usize, values: &mut [T]) {
    let cols = table.cols;
    values[first..first + cols].copy_from_slice(table.row(0));
    let blocks = weights.chunks_exact(4);
    let rest = blocks.remainder();
    let mut row = 1;
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

/// A kernel for one kind of number: constants, polynomial in `t = r^2`, tail of the remainder (`lost`: by rounding it).
macro_rules! kernel {
    (
        $float:ident, limit: $limit:expr, round: $round:expr, to_sign: $to_sign:expr, pi_2: $pi_2:expr,
        n: $n:expr, sin: $sin:expr, cos: $cos:expr, polynomial: $polynomial:expr, tail: $tail:expr,
    ) => {
        /// Largest magnitude that the reduction supports, in rad.
        pub const LIMIT: $float = $limit;
        const TWO_OVER_PI: $float = std::$float::consts::FRAC_2_PI;
        const ROUND: $float = $round;
        const PI_2: [$float; 3] = $pi_2;
        const SIN: [$float; $n] = $sin;
        const COS: [$float; $n] = $cos;

        /// The limit, 2/pi and the number that rounds; parts of pi/2, coefficients of sine and of cosine.
        pub(crate) fn constants() -> [Vec<f64>; 4] {
            let lists: [&[$float]; 4] = [&[LIMIT, TWO_OVER_PI, ROUND], &PI_2, &SIN, &COS];
            lists.map(|list| list.iter().map(|&constant| f64::from(constant)).collect())
        }

        /// Sine and cosine of `x` rad. Beyond the limit, and for infinities and NaN, the standard library's functions.
        #[inline]
        pub fn sin_cos(x: $float) -> ($float, $float) {
            if x.abs() <= LIMIT {
                reduced_sin_cos(x)
            } else {
                (x.sin(), x.cos())
            }
        }

        /// Sine and cosine of `x` rad with `|x|` up to [`LIMIT`]; without a branch, so that loops over it vectorise.
        #[inline(always)]
        pub fn reduced_sin_cos(x: $float) -> ($float, $float) {
            let shifted = x * TWO_OVER_PI + ROUND;
            let quadrant = shifted.to_bits();
            let multiple = shifted - ROUND;
            let high = x - multiple * PI_2[0];
            let low = multiple * PI_2[1];
            let r = high - low;
            let tail = $tail(multiple * PI_2[2], (high - r) - low);
            let t = r * r;
            let t2 = t * t;
            let (p, q) = ($polynomial(SIN, t, t2), $polynomial(COS, t, t2));
            let half = 0.5 * t;
            let near = 1.0 - half;
            let sine = (r - ((r * t) * p + tail)).to_bits();
            let cosine = (near + (((1.0 - near) - half) + (t2 * q + r * tail))).to_bits();
            let exchange = (sine ^ cosine) & (quadrant & 1).wrapping_neg();
            (
                $float::from_bits((sine ^ exchange) ^ ((quadrant & 2) << $to_sign)),
                $float::from_bits(
                    (cosine ^ exchange) ^ ((quadrant.wrapping_add(1) & 2) << $to_sign),
                ),
            )
        }
    };
}

/// Within 1.6 ulp: the remainder is rounded to half its last place, which counts up to 0.87 of the sine's, the last sum
/// adds 0.5, the products before it 0.2.
pub(crate) mod double {
    kernel! {
        f64, limit: 8192.0, round: 6_755_399_441_055_744.0, to_sign: 62,
        pi_2: [1.570_796_326_794_152_3, 7.443547480480255e-13, 6.36831716351095e-25],
        n: 6,
        sin: [
            0.166_666_666_666_666_3, -0.008_333_333_333_321_84, 0.000_198_412_698_293_588_23,
            -2.755_731_353_885_304_7e-6, 2.505_073_450_137_862_6e-8, -1.589_544_451_671_563_3e-10,
        ],
        cos: [
            0.041_666_666_666_666_595, -0.001_388_888_888_887_334, 2.480_158_728_899_962_3e-5,
            -2.755_731_421_606_139e-7, 2.087_570_523_162_879e-9, -1.135_873_928_367_384_2e-11,
        ],
        polynomial: |c: [f64; 6], t: f64, t2: f64| {
            (c[0] + c[1] * t) + t2 * ((c[2] + c[3] * t) + t2 * (c[4] + c[5] * t))
        },
        tail: |tail: f64, _lost: f64| tail,
    }
}

/// Within 0.94 ulp over all numbers up to the limit. No operation is wider than 32 bits, so processors without double
/// precision lose nothing.
pub(crate) mod single {
    kernel! {
        f32, limit: 128.0, round: 12_582_912.0, to_sign: 30,
        pi_2: [1.570_785_5, 1.080_427_3e-5, 6.0771e-11],
        n: 3,
        sin: [0.166_666_55, -0.008_332_187, 0.000_195_178_97],
        cos: [0.041_666_646, -0.001_388_731, 2.443_232_7e-5],
        polynomial: |c: [f32; 3], t: f32, t2: f32| (c[0] + c[1] * t) + t2 * c[2],
        tail: |tail: f32, lost: f32| tail - lost,
    }
}
