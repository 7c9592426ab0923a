//! Random sums of rational and exponential terms, simplified and compared with numbers without overflow. Wherever the
//! learned terms are accurate, the shorter form is too, in double and in single precision.

use std::fs;
use std::process::Command;

use romc::equations::Equations;
use romc::ir::{Interpreter, Program};
use romc::lower::{self, Form};
use romc::symbolic::{ExprPool, Function, Node, SymbolId};
use serde_json::json;

use super::{LATENT_DIM, Random, model_of, parsed, printed, tools};

/// Models in each run, and in thorough runs.
const COUNT: usize = 50;
const COUNT_OF_ALL: usize = 500;
const POINTS: usize = 60;

const FORMS: [&str; 18] = [
    "A/(A + B)",
    "1/(A - B)",
    "1/(A + B)",
    "A/(A + 2)",
    "1/(1 + A)",
    "A*B/(A + B)",
    "(A^2 - B^2)/(A - B)",
    "A^2/(1 + A)",
    "B/(1 + A)^2",
    "A/(1 + B^2)",
    "1/(1 + 1/A)",
    "exp(A)/(exp(A) - B)",
    "exp(A)/(exp(A) + B)",
    "exp(A)/(exp(A) + exp(B))",
    "1/(1 + exp(-A))",
    "B/(1 + exp(A))",
    "exp(A)*exp(-B)",
    "exp(2*A)/(1 + exp(A))^2",
];

/// `mantissa * 2^exponent`, and a bound of its error on the same scale.
#[derive(Clone, Copy, Debug)]
struct Wide {
    mantissa: f64,
    exponent: i64,
    error: f64,
}

impl Wide {
    fn new(mantissa: f64, exponent: i64, error: f64) -> Self {
        let size = mantissa.abs().max(error);
        if size == 0.0 || !size.is_finite() {
            return Self {
                mantissa,
                exponent,
                error,
            };
        }
        let shift = size.log2().floor() as i32;
        let scale = 2_f64.powi(-shift);
        Self {
            mantissa: mantissa * scale,
            exponent: exponent + i64::from(shift),
            error: error * scale + f64::EPSILON * (mantissa * scale).abs(),
        }
    }

    fn of(value: f64) -> Self {
        if value == 0.0 {
            return Self::new(0.0, 0, 0.0);
        }
        let half = value.abs().log2().floor() as i32 / 2;
        let scale = 2_f64.powi(-half);
        Self::new(value * scale * scale, 2 * i64::from(half), 0.0)
    }

    fn times(self, other: Self) -> Self {
        let error = self.mantissa.abs() * other.error
            + other.mantissa.abs() * self.error
            + self.error * other.error;
        let exponent = self.exponent + other.exponent;
        Self::new(self.mantissa * other.mantissa, exponent, error)
    }

    fn plus(self, other: Self) -> Self {
        let (high, low) = match self.exponent >= other.exponent || other.is_zero() {
            true => (self, other),
            false => (other, self),
        };
        if high.is_zero() {
            return low;
        }
        let scale = 2_f64.powi((low.exponent - high.exponent).clamp(-1_074, 0) as i32);
        let error = high.error + low.error * scale + f64::EPSILON * high.mantissa.abs();
        Self::new(high.mantissa + low.mantissa * scale, high.exponent, error)
    }

    fn is_zero(self) -> bool {
        self.mantissa == 0.0 && self.error == 0.0
    }

    fn recip(self) -> Self {
        let left = self.mantissa.abs() - self.error;
        let error = match left > 0.0 {
            true => self.error / (self.mantissa.abs() * left),
            false => f64::INFINITY,
        };
        Self::new(1.0 / self.mantissa, -self.exponent, error)
    }

    fn exp(self) -> Self {
        let (value, error) = (
            self.value(),
            self.error * 2_f64.powi(self.exponent.clamp(-1_000, 1_000) as i32),
        );
        if value.abs() > 1e12 || !error.is_finite() {
            // Far outside the range of floats: zero, or not a number.
            let mantissa = if value < 0.0 { 1.0 } else { f64::INFINITY };
            return Self::new(mantissa, -1_000_000, 0.0);
        }
        let turns = (value / std::f64::consts::LN_2).round();
        let mantissa = turns.mul_add(-std::f64::consts::LN_2, value).exp();
        let error = mantissa * (error + 4.0 * f64::EPSILON * (1.0 + value.abs()));
        Self::new(mantissa, turns as i64, error)
    }

    fn value(self) -> f64 {
        let half = (self.exponent / 2).clamp(-2_000, 2_000) as i32;
        let rest = (self.exponent - i64::from(half)).clamp(-2_000, 2_000) as i32;
        self.mantissa * 2_f64.powi(half) * 2_f64.powi(rest)
    }
}

/// The sum of the learned terms, and the sum of their magnitudes.
fn reference(equations: &Equations<'_>, point: &[f64]) -> (Wide, f64) {
    let pool: &ExprPool = &equations.pool;
    // The effect of the inputs' last digits is allowed.
    let input = |symbol: SymbolId| {
        let exact = Wide::of(point[symbol.index()]);
        Wide::new(exact.mantissa, exact.exponent, f64::EPSILON)
    };
    let (mut sum, mut size) = (Wide::of(0.0), 0.0);
    for (coefficient, term) in equations.phases[0].summands(equations, 0) {
        let values = pool.fold_up(&[term.expr], |pool, expr, child| match pool.node(expr) {
            Node::Number(number) => Wide::of(number.to_f64()),
            Node::Symbol(symbol) => input(*symbol),
            Node::Sum(terms) => (terms.iter()).fold(Wide::of(0.0), |a, b| a.plus(child(*b))),
            Node::Product(factors) => {
                (factors.iter()).fold(Wide::of(1.0), |a, b| a.times(child(*b)))
            }
            Node::Power(base, exponent) => {
                let power = pool.as_integer(*exponent).expect("whole exponents");
                let factors = 0..power.unsigned_abs();
                let product = factors.fold(Wide::of(1.0), |a, _| a.times(child(*base)));
                if power < 0 { product.recip() } else { product }
            }
            Node::Apply(Function::Exp, argument) => child(*argument).exp(),
            Node::Apply(function, _) => panic!("{function}"),
        });
        let summand = Wide::of(coefficient).times(values[0]);
        size += summand.value().abs();
        sum = sum.plus(summand);
    }
    (sum, size)
}

fn double(program: &Program, point: &[f64]) -> f64 {
    let mut ddz = [0.0; LATENT_DIM];
    Interpreter::new(program).run(&[&point[..2], &point[2..4], &point[4..]], &mut [&mut ddz]);
    ddz[0]
}

fn single(program: &Program, point: &[f64]) -> f64 {
    let point: Vec<f32> = point.iter().map(|value| *value as f32).collect();
    let mut ddz = [0.0_f32; LATENT_DIM];
    Interpreter::new(program).run(&[&point[..2], &point[2..4], &point[4..]], &mut [&mut ddz]);
    f64::from(ddz[0])
}

/// A value of a variable: ordinary, where exponentials overflow, or near the limit of the precision.
fn far(random: &mut Random, is_single: bool) -> f64 {
    let (largest, edge) = if is_single {
        (36.0, 88.0)
    } else {
        (300.0, 709.0)
    };
    let size = match random.below(4) {
        0 => 0.3 + 3.0 * random.unit(),
        1 => edge * (0.2 + 1.3 * random.unit()),
        _ => 10_f64.powf(largest * (2.0 * random.unit() - 1.0)),
    };
    let value = if random.below(2) == 0 { size } else { -size };
    if is_single {
        f64::from(value as f32)
    } else {
        value
    }
}

fn random_sum(random: &mut Random) -> Vec<(f64, String)> {
    const VARIABLES: [&str; 3] = ["z1", "z2", "u1"];
    let pair = [random.below(3), random.below(2)];
    let [a, b] = [VARIABLES[pair[0]], VARIABLES[(pair[0] + 1 + pair[1]) % 3]];
    let summand = |random: &mut Random| {
        let [a, b] = if random.below(4) == 0 { [b, a] } else { [a, b] };
        let form = FORMS[random.below(FORMS.len())];
        let coefficient = [1.0, 1.0, -1.0, 0.5, 0.3][random.below(5)];
        (coefficient, form.replace('A', a).replace('B', b))
    };
    (0..2 + random.below(3)).map(|_| summand(random)).collect()
}

struct Compared {
    name: String,
    sum: Vec<(f64, String)>,
    point: Vec<f64>,
    learned: f64,
    simplified: f64,
}

/// Random models at random points; in single precision if `is_single`.
fn compared(count: usize, is_single: bool) -> (Vec<Compared>, usize) {
    let mut random = Random(if is_single { 11 } else { 5 });
    let (mut all, mut n_simplified) = (Vec::new(), 0);
    for number in 0..count {
        let sum = random_sum(&mut random);
        let model = model_of(&sum);
        let learned = Equations::as_learned(&model);
        let simplified = Equations::of(&model);
        n_simplified += usize::from(!simplified.steps.is_empty());
        let program = |equations| lower::dynamics(equations, 0, Form::default()).expect("lowers");
        let programs = [program(&learned), program(&simplified)];
        for _ in 0..POINTS {
            let point: Vec<f64> = (0..6).map(|_| far(&mut random, is_single)).collect();
            let run = if is_single { single } else { double };
            let [a, b] = [&programs[0], &programs[1]].map(|program| run(program, &point));
            let (exact, size) = reference(&learned, &point);
            let (value, evaluation) = (exact.value(), if is_single { 1e-4 } else { 1e-10 });
            let is_known = exact.error <= 0.1 * evaluation * exact.mantissa.abs();
            let smallest = if is_single { 1e-36 } else { 1e-300 };
            let is_ordinary = value.abs() > smallest && value.is_finite() && size.is_finite();
            let is_accurate = (a - value).abs() <= evaluation * value.abs();
            if !(is_known && is_ordinary && is_accurate) {
                continue;
            }
            let name = format!(
                "{number}: {} as {}",
                printed(&learned),
                printed(&simplified)
            );
            let allowed = 30.0 * evaluation * value.abs() + 1e-2 * evaluation * size;
            assert!(
                (b - value).abs() <= allowed,
                "{name} at {point:?}: {b:e}, as learned {a:e}, exactly {value:e}"
            );
            all.push(Compared {
                name,
                sum: sum.clone(),
                point,
                learned: a,
                simplified: b,
            });
        }
    }
    (all, n_simplified)
}

#[test]
fn shorter_forms_are_accurate_where_the_learned_terms_are() {
    for is_single in [false, true] {
        let (all, n_simplified) = compared(COUNT, is_single);
        assert!(all.len() > 10 * COUNT, "{} points", all.len());
        assert!(n_simplified > COUNT / 5, "{n_simplified} simplified");
    }
}

#[test]
fn reported_sums_keep_their_values_far_out() {
    for (sum, points) in [
        (
            "1 exp(z1)/(exp(z1) - u1) ; 1 exp(z1)/(exp(z1) + u1)",
            [[360.0, 0.0, 1.0], [45.0, 0.0, 1.0], [700.0, 0.0, -3.0]],
        ),
        (
            "1 1/(z1 - z2) ; -1 1/(z1 + z2)",
            [
                [1e155, 3e154, 0.0],
                [1e-160, 3e-161, 0.0],
                [1e30, 2e29, 0.0],
            ],
        ),
        (
            "1 z1/(z1 + z2) ; 1 z2/(z2 + u1)",
            [
                [1e155, 1e156, 1e154],
                [1e-160, 3e-161, 1e-161],
                [1e30, 2e29, 1e28],
            ],
        ),
        (
            "2 z1*log(u1)/(z1*log(u1) - cos(z1^2)) ; 1 z1*log(u1)/(z1*log(u1) + cos(z1^2))",
            [[1e154, 0.0, 1e5], [1.7e19, 0.0, 1e19], [1e19, 0.0, 83.0]],
        ),
        (
            "1 tanh(z2)*exp(u1)*z1 ; 2 tanh(z2)/(exp(u1)*z1) ; 3 tanh(z2)",
            [[6e19, 1.0, -89.0], [1e10, 1.0, -715.0], [1e-10, 1.0, 715.0]],
        ),
    ] {
        let model = model_of(&parsed(sum));
        let [learned, simplified] = [Equations::as_learned(&model), Equations::of(&model)]
            .map(|equations| lower::dynamics(&equations, 0, Form::default()).expect("lowers"));
        for [z1, z2, u1] in points {
            let point = [z1, z2, 0.0, 0.0, u1, 0.0];
            for run in [double, single] {
                let [a, b] = [&learned, &simplified].map(|program| run(program, &point));
                assert!(
                    !a.is_finite() || (a - b).abs() <= 1e-5 * a.abs(),
                    "{sum} at {point:?}: {b}, as learned {a}"
                );
            }
        }
    }
}

#[test]
fn jacobians_of_shorter_forms_are_numbers_where_those_of_the_learned_terms_are() {
    for (sum, is_single, point) in [
        (
            "2 exp(-z1)/(exp(-z1) - exp(z2)) ; 1 exp(-z1)/(exp(-z1) + exp(z2))",
            true,
            [101.1, 1.0, 10.6],
        ),
        (
            "3 exp(-z1)/(exp(-z1) - abs(z1*u1)) ; 3 exp(-z1)/(exp(-z1) + abs(z1*u1))",
            true,
            [137.2, 0.5, 178.4],
        ),
    ] {
        let model = model_of(&parsed(sum));
        for equations in [Equations::as_learned(&model), Equations::of(&model)] {
            let (program, _) =
                lower::dynamics_jacobian(&equations, 0, Form::default()).expect("lowers");
            let inputs = [[point[0], point[1]], [0.0; 2], [point[2], 0.0]];
            let found: Vec<f64> = match is_single {
                false => Interpreter::<f64>::new(&program)
                    .results(&inputs.map(Vec::from))
                    .concat(),
                true => {
                    let inputs = inputs.map(|part| part.map(|value| value as f32).to_vec());
                    let found = Interpreter::<f32>::new(&program).results(&inputs).concat();
                    found.into_iter().map(f64::from).collect()
                }
            };
            let are_numbers = found.iter().all(|value| value.is_finite());
            assert!(
                are_numbers,
                "{} at {point:?}: {found:?}",
                printed(&equations)
            );
        }
    }
}

/// The same with many more models, compared with mpmath.
#[test]
fn shorter_forms_are_accurate_by_mpmath() {
    if !tools::is_thorough() {
        return;
    }
    let python = || Command::new(std::env::var("ROMC_PYTHON").unwrap_or("python3".to_owned()));
    if !tools::answers(python().args(["-c", "import mpmath"])) {
        return;
    }
    let (all, _) = compared(COUNT_OF_ALL, false);
    let lines: Vec<String> = (all.iter().step_by(7))
        .map(|of| {
            let [z1, z2, u1] = [of.point[0], of.point[1], of.point[4]];
            let line = json!({
                "name": of.name, "sum": of.sum, "at": {"z1": z1, "z2": z2, "u1": u1},
                "learned": of.learned, "simplified": of.simplified,
            });
            line.to_string()
        })
        .collect();
    let folder = tempfile::tempdir().expect("a folder");
    let cases = folder.path().join("cases.jsonl");
    fs::write(&cases, lines.join("\n")).expect("written");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/scripts/far_out.py");
    let output = python().arg(script).arg(&cases).output().expect("runs");
    assert!(
        output.status.success(),
        "{}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
}
