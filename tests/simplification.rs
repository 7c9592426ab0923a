//! Simplification. Exact: a table of sums with their simplest forms, and random models. Within a tolerance:
//! certificates.

#[path = "simplification/far_out.rs"]
mod far_out;
mod tools;

use std::fs;
use std::path::Path;
use std::time::Instant;

use nalgebra::DMatrix;
use romc::deploy::{EmitOptions, Target, emit};
use romc::equations::{Equations, PhaseEquations};
use romc::ir::Interpreter;
use romc::lower::{self, Form};
use romc::model::{FeetRule, Library, LibraryChoice, Phase, ReducedModel, StandardLibrary};
use romc::symbolic::{ExprId, ExprPool, Function, Node, Number, SymbolId};
use romc::typeset::PrintOptions;

const LATENT_DIM: usize = 2;

/// A fixed sequence of numbers.
struct Random(u64);

impl Random {
    /// In [0, 1).
    fn unit(&mut self) -> f64 {
        self.0 = (self.0)
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn below(&mut self, n: usize) -> usize {
        (self.unit() * n as f64) as usize
    }
}

/// A model whose first acceleration is the sum, and whose second is zero.
fn model_of(sum: &[(f64, String)]) -> ReducedModel {
    let texts: Vec<String> = sum.iter().map(|(_, text)| text.clone()).collect();
    let library = Library::from_terms(LATENT_DIM, &texts).expect("terms parse");
    let coefficients = sum.iter().map(|&(coefficient, _)| coefficient);
    let column = nalgebra::DVector::from_iterator(sum.len(), coefficients);
    let mut xi = DMatrix::zeros(sum.len(), LATENT_DIM);
    xi.set_column(0, &column);
    ReducedModel::builder("sum", library)
        .phase(Phase {
            name: "contact".into(),
            feet: FeetRule::Any,
            xi,
        })
        .build()
        .expect("a model")
}

/// `0.5 z1 ; -2 sin(z1)` as coefficients and terms.
fn parsed(text: &str) -> Vec<(f64, String)> {
    let summands = text
        .split(';')
        .map(str::trim)
        .filter(|part| !part.is_empty());
    summands
        .map(|summand| {
            let (coefficient, term) = summand.split_once(' ').expect("coefficient and term");
            (
                coefficient.parse().expect("a number"),
                term.trim().to_owned(),
            )
        })
        .collect()
}

fn printed(equations: &Equations<'_>) -> String {
    let terms = equations.phases[0].summands(equations, 0);
    let terms: Vec<String> = terms
        .map(|(c, term)| format!("{c} {}", term.text))
        .collect();
    terms.join(" ; ")
}

/// The right-hand side of `ddz1` in the emitted LaTeX.
fn latex(equations: &Equations<'_>) -> String {
    let options = EmitOptions {
        print: PrintOptions {
            width_em: Some(1000.0),
            ..PrintOptions::default()
        },
        ..EmitOptions::default()
    };
    let files = emit(equations, &[Target::Latex, Target::C], &options).expect("emits");
    let tex = files
        .iter()
        .find(|file| file.path == "sum.tex")
        .expect("equations");
    let line = (tex.contents.lines())
        .find_map(|line| Some(line.split_once(r"\ddot{z}_1 = ")?.1))
        .expect("the first equation");
    let right = line.split_once(r" \\").map_or(line, |(right, _)| right);
    right.trim().to_owned()
}

/// Values of `ddz1` at a point, by the program from which code is emitted.
fn value(equations: &Equations<'_>, point: &[f64]) -> f64 {
    let program = lower::dynamics(equations, 0, Form::default()).expect("lowers");
    let mut ddz = vec![0.0; LATENT_DIM];
    let inputs = [&point[..2], &point[2..4], &point[4..]];
    Interpreter::new(&program).run(&inputs, &mut [&mut ddz]);
    ddz[0]
}

/// A bound of |coefficient * term|, summed over the terms: rounding may change 4 units in its last place. Sums inside
/// terms count by the magnitudes of their parts.
fn size(equations: &Equations<'_>, point: &[f64]) -> f64 {
    let pool = &equations.pool;
    let value_of = |symbol: SymbolId| point[symbol.index()];
    let terms = equations.phases[0].summands(equations, 0);
    terms
        .map(|(c, term)| c.abs() * size_of(pool, term.expr, &value_of))
        .sum()
}

fn size_of(pool: &ExprPool, expr: ExprId, value_of: &dyn Fn(SymbolId) -> f64) -> f64 {
    let value = pool.evaluate(expr, value_of).abs();
    let part = |expr: ExprId| size_of(pool, expr, value_of);
    match pool.node(expr) {
        Node::Number(_) | Node::Symbol(_) => value,
        Node::Sum(terms) => terms.iter().map(|term| part(*term)).sum(),
        Node::Product(factors) => factors.iter().map(|factor| part(*factor)).product(),
        Node::Power(base, exponent) => {
            let exponent = pool.as_number(*exponent).map_or(1.0, Number::to_f64);
            let base_value = pool.evaluate(*base, value_of).abs();
            let relative = part(*base) / base_value;
            value * relative.powf(exponent.abs()) * exponent.abs().max(1.0)
        }
        Node::Apply(function, argument) => match function {
            Function::Sin | Function::Cos | Function::Tanh => 1.0 + part(*argument),
            Function::Tan => value + part(*argument) * (1.0 + value * value),
            Function::Exp => value * (1.0 + part(*argument)),
            Function::Log => {
                let inner = pool.evaluate(*argument, value_of).abs();
                value + part(*argument) / inner
            }
            Function::Sqrt | Function::Abs | Function::Sign => {
                let inner = pool.evaluate(*argument, value_of).abs();
                value * part(*argument) / inner
            }
        },
    }
}

/// Compares both equations at points where the first has a value.
fn check_values(name: &str, learned: &Equations<'_>, simplified: &Equations<'_>, positive: bool) {
    let mut random = Random(7);
    let mut n_compared = 0;
    for _ in 0..40 {
        let point: Vec<f64> = (0..3 * LATENT_DIM)
            .map(|_| match positive {
                true => 0.2 + 1.2 * random.unit(),
                false => 3.0 * random.unit() - 1.5,
            })
            .collect();
        let (expected, found) = (value(learned, &point), value(simplified, &point));
        if !expected.is_finite() {
            continue;
        }
        n_compared += 1;
        let allowed = 4.0 * f64::EPSILON * (size(learned, &point) + size(simplified, &point));
        assert!(
            (found - expected).abs() <= allowed,
            "{name} at {point:?}: {found}, as learned {expected}, allowed {allowed:e}"
        );
    }
    assert!(n_compared >= 10, "{name}: {n_compared} points");
}

#[test]
fn cases_of_the_table_come_out_simplest() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/simplification/cases.txt");
    let table = fs::read_to_string(path).expect("the table is checked in");
    let (mut n_cases, mut wrong) = (0, Vec::new());
    for line in table
        .lines()
        .filter(|line| !line.starts_with('#') && !line.is_empty())
    {
        let columns: Vec<&str> = line.split(" |").map(str::trim).collect();
        let [name, sum, simplest, in_latex] = columns[..] else {
            panic!("{line}: expected four columns");
        };
        n_cases += 1;
        let model = model_of(&parsed(sum));
        let (learned, simplified) = (Equations::as_learned(&model), Equations::of(&model));
        let found = printed(&simplified);
        let sorted = |sum: &str| {
            let mut parts: Vec<String> = sum.split(" ; ").map(str::to_owned).collect();
            parts.sort();
            parts
        };
        if sorted(&found) != sorted(simplest) {
            wrong.push(format!("{name}: {found}, expected {simplest}"));
        }
        let found = latex(&simplified);
        if found != in_latex {
            wrong.push(format!("{name}: {found}, expected {in_latex}"));
        }
        assert_eq!(
            simplified.steps.is_empty(),
            name.starts_with("short-"),
            "{name}"
        );
        check_values(name, &learned, &simplified, true);
        check_values(
            name,
            &learned,
            &simplified,
            sum.contains("log") || sum.contains("sqrt"),
        );
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(n_cases >= 30, "{n_cases} cases");
}

/// The simplest form of a sum, printed.
fn shortest(sum: &str) -> String {
    printed(&Equations::of(&model_of(&parsed(sum))))
}

#[test]
fn shorten_finds_the_simplest_form_of_each_family() {
    let mut wrong = Vec::new();
    for (sum, expected) in [
        ("1 sin(z1)^2 ; 1 cos(z1)^2", "1 1"),
        ("0.37 sin(z1)^2 ; 0.37 cos(z1)^2 ; 2 z2", "0.37 1 ; 2 z2"),
        ("3 sin(z1)^2 ; 2 cos(z1)^2", "1 sin(z1)^2 ; 2 1"),
        ("2 sin(z1)*cos(z1) ; -1 sin(2*z1)", ""),
        (
            "0.7 sin(z1)*cos(z2) ; 0.7 cos(z1)*sin(z2)",
            "0.7 sin(z1 + z2)",
        ),
        ("1 sin(-z1) ; 1 sin(z1)", ""),
        ("1 cos(-z1) ; 1 cos(z1)", "2 cos(z1)"),
        ("1 z1/2 ; 0.5 z1", "1 z1"),
        ("1 (z1^2 - 1)/(z1 - 1)", "1 1 ; 1 z1"),
        ("1 (z1 + 1)^2 ; -1 z1^2 ; -2 z1", "1 1"),
        ("0.1 (z1 + 1)^3 ; -0.1 z1^3 ; -0.3 z1^2 ; -0.3 z1", "0.1 1"),
        ("1 exp(z1)*exp(-z1) ; 2 z1", "1 1 ; 2 z1"),
        ("0.3 log(exp(z1)) ; 0.1 z1", "0.4 z1"),
        ("1.3 exp(2*log(z1))", "1.3 z1^2"),
        ("0.1 z1*z2 ; -0.1 z2*z1", ""),
        ("0.1 sqrt(z1)^2 ; 0.2 z1", "0.3 z1"),
        ("1 sin(z1 + z2) ; 1 sin(z1 - z2)", "2 sin(z1)*cos(z2)"),
        (
            "1 sin(z1)*cos(z2) ; 1 cos(z1)*sin(z2) ; 0.3 sin(z1)*cos(dz1)",
            "1 sin(z1 + z2) ; 0.3 sin(z1)*cos(dz1)",
        ),
        ("1 tan(z1)*cos(z1) ; 1 sin(z1)", "2 sin(z1)"),
        ("1 1 ; 1 tan(z1)^2", "1 1/cos(z1)^2"),
        ("1 1 ; -2 sin(z1)^2", "1 cos(2*z1)"),
        (
            "1 (z1 + 1)^2 ; -1 z1^2 ; -2 z1 ; 0.3 (z1 + 1)^3",
            "1 1 ; 0.3 (z1 + 1)^3",
        ),
        // Equal terms each count once.
        (
            "0.5 1 ; -0.5 cos(2*z1) ; 0.5 1*z2 ; 0.5 z2",
            "1 sin(z1)^2 ; 1 z2",
        ),
    ] {
        let found = shortest(sum);
        if found != expected {
            wrong.push(format!("{sum}: {found}, expected {expected}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn shorten_leaves_what_is_short_already() {
    for sum in [
        "0.36 1 ; -0.16 dz1 ; -0.91 dz2 ; -0.75 sin(dz1)",
        "0.1 z1 ; 0.2 z1*z2 ; 0.3 (1 + z1)^2",
        "1 z1*z2 ; 1 z1*dz1",
        "0.37 sin(z1)*cos(z2) ; 0.21 sin(dz1)*cos(z1)",
        "1 1/3*z1",
        "1 exp(z1) ; 1 tanh(z2) ; 0.5 sqrt(z1^2 + z2^2)",
        // Shorter forms of these overflow or underflow at points where they do not.
        "0.4 log(z1) ; 0.4 log(z2)",
        "1 -exp(z1)/(z2 - exp(z1)) ; 1 exp(z1)/(z2 + exp(z1))",
        "1 1/(z1 - z2) ; -1 1/(z1 + z2)",
        "1 sign(z1)*sign(z2)",
        "1 sqrt(z1)*sqrt(z2)",
    ] {
        assert_eq!(shortest(sum), sum);
    }
}

#[test]
fn steps_state_how_many_terms_became_how_many() {
    let model = model_of(&parsed(
        "1 (z1 + 1)^2 ; -1 z1^2 ; -2 z1 ; 1 sin(-z2) ; 1 sin(z2)",
    ));
    let equations = Equations::of(&model);
    let steps: Vec<String> = equations.steps.iter().map(ToString::to_string).collect();
    assert_eq!(
        steps,
        [
            "contact, ddz1: 3 terms became 1",
            "contact, ddz1: 2 terms cancelled"
        ]
    );
    let kept = equations.to_model().expect("a model");
    assert_eq!(printed(&Equations::as_learned(&kept)), "1 1");
}

/// Terms of all families, with many equal and related ones.
fn random_sum(random: &mut Random) -> Vec<(f64, String)> {
    const ARGUMENTS: [&str; 8] = ["z1", "z2", "dz1", "u1", "-z1", "z1 + z2", "2*z1", "z1 - z2"];
    const FORMS: [&str; 22] = [
        "A",
        "B",
        "1",
        "sin(A)",
        "cos(A)",
        "sin(A)^2",
        "cos(A)^2",
        "sin(A)*cos(B)",
        "cos(A)*sin(B)",
        "sin(A)*sin(B)",
        "cos(A)*cos(B)",
        "(A)*(B)",
        "(A)^2",
        "(A + 1)^2",
        "((A) + (B))^2",
        "(A)/2",
        "tanh(A)",
        "exp(A)*exp(B)",
        "exp(A)",
        "log(exp(A))",
        "abs(A)",
        "(A)*sin(B)^2",
    ];
    const COEFFICIENTS: [f64; 7] = [1.0, -1.0, 2.0, 0.5, 0.1, -0.3, 3.0];
    let n_terms = 2 + random.below(9);
    let learned = random.unit();
    let mut sum: Vec<(f64, String)> = Vec::new();
    while sum.len() < n_terms {
        let [a, b] = [0, 1].map(|_| ARGUMENTS[random.below(ARGUMENTS.len())]);
        let text = FORMS[random.below(FORMS.len())]
            .replace('A', a)
            .replace('B', b);
        let coefficient = match random.below(3) {
            0 => random.unit() - 0.5,
            1 => learned,
            _ => COEFFICIENTS[random.below(COEFFICIENTS.len())],
        };
        let one = Library::from_terms(LATENT_DIM, std::slice::from_ref(&text));
        if one.is_ok() {
            sum.push((coefficient, text));
        }
    }
    sum
}

#[test]
fn random_models_keep_their_values_and_never_get_longer() {
    let mut random = Random(20_261_122);
    let mut n_simplified = 0;
    for number in 0..200 {
        let sum = random_sum(&mut random);
        let model = model_of(&sum);
        let (learned, simplified) = (Equations::as_learned(&model), Equations::of(&model));
        let name = format!("model {number}, {}", printed(&learned));
        // A sum with the coefficient 1 is written as its terms.
        let count = |equations: &Equations<'_>| {
            let summands = equations.phases[0].summands(equations, 0);
            let lengths = summands.map(|(c, term)| match equations.pool.node(term.expr) {
                Node::Sum(terms) if c.abs() == 1.0 => terms.len(),
                _ => 1,
            });
            lengths.sum::<usize>()
        };
        assert!(
            count(&simplified) <= count(&learned),
            "{name}: {}",
            printed(&simplified)
        );
        n_simplified += usize::from(!simplified.steps.is_empty());
        check_values(&name, &learned, &simplified, false);
        let again = simplified.to_model().expect("a model");
        let again = Equations::of(&again);
        assert_eq!(
            printed(&again),
            printed(&simplified),
            "{name}: simplified twice"
        );
    }
    assert!((50..200).contains(&n_simplified), "{n_simplified}");
}

#[test]
fn long_products_of_functions_take_little_time() {
    let series = |of: &str, sign: &str, count: usize| {
        let parts = (1..=count).map(|k| of.replace('A', &format!("z1 + {k}*z2")));
        parts.collect::<Vec<_>>().join(sign)
    };
    for term in [
        series("tan(A)", "*", 9),
        series("tan(A)", " + ", 12),
        series("(1 + sin(A))", "*", 8),
        series("(1 + cos(A))", "*", 12),
        series("tanh(A)", "*", 12),
        series("(1 + exp(A))", "*", 12),
        series("1/(1 + exp(A))", " + ", 12),
        series("(1 + 1/(A))", "*", 12),
        series("(A + u1)^4", "*", 12),
        series("sin(A)^2", "*", 12),
        series("1/(z1 + ", "", 12) + "z2" + &")".repeat(12),
        "(z1 + z2 + dz1 + dz2 + u1 + u2 + 1)^12".to_owned(),
    ] {
        let model = model_of(&[(0.7, term.clone())]);
        let start = Instant::now();
        let equations = Equations::of(&model);
        let seconds = start.elapsed().as_secs_f64();
        // A release build needs as little as for the learned equations, a tenth of a second; test builds share their cores.
        assert!(seconds < 10.0, "{term}: {seconds} s");
        check_values(&term, &Equations::as_learned(&model), &equations, true);
    }
}

#[test]
fn large_models_of_plain_terms_keep_every_bit() {
    let standard = StandardLibrary {
        degree: 3,
        trigonometric: true,
        inputs: true,
    };
    let library = Library::of(8, LibraryChoice::Standard(standard)).expect("a library");
    assert!(matches!(library.choice(), LibraryChoice::Standard(_)));
    let mut random = Random(3);
    let xi = DMatrix::from_fn(library.terms().len(), 8, |_, _| random.unit() - 0.5);
    let n_coefficients = xi.len();
    let model = ReducedModel::builder("large", library)
        .phase(Phase {
            name: "contact".into(),
            feet: FeetRule::Any,
            xi,
        })
        .build()
        .expect("a model");
    let equations = Equations::of(&model);
    assert!(equations.steps.is_empty());
    let counts = equations.phases.iter().map(PhaseEquations::active_count);
    assert_eq!(counts.sum::<usize>(), n_coefficients);
}
