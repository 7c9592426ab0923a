//! Jacobians at points where the rules of differentiation give `0/0`, against limits.

use std::collections::HashMap;

use nalgebra::DMatrix;
use romc::ir::Interpreter;
use romc::lower::{CompiledModel, Form};
use romc::model::{FeetRule, Library, Phase, ReducedModel};

use super::drivers::{Build, Workshop};
use super::functions::{Function, Kind, functions};
use super::kinks::{Kink, columns, kinks, model};
use super::tools;

/// Expressions of one model.
const PER_MODEL: usize = 20;
/// Largest difference of a slope, relative to the larger of one and its magnitude.
const DOUBLE: f64 = 1e-9;
const SINGLE: f64 = 2e-3;
/// The same of many random expressions, some of which have angles of 1e5 rad.
const SINGLE_OF_MANY: f64 = 5e-2;

/// The Jacobians of models that have many expressions each.
struct Case {
    models: Vec<ReducedModel>,
    functions: Vec<Function>,
    points: Vec<Vec<f64>>,
    kinks: Vec<Vec<Kink>>,
}

impl Case {
    fn new() -> Self {
        let mut kinks = kinks().into_iter().peekable();
        let mut case = Case {
            models: Vec::new(),
            functions: Vec::new(),
            points: Vec::new(),
            kinks: Vec::new(),
        };
        while kinks.peek().is_some() {
            let part: Vec<Kink> = kinks.by_ref().take(PER_MODEL).collect();
            let expressions: Vec<&str> = part.iter().map(|kink| kink.expression.as_str()).collect();
            let model = model(
                &format!("kinks{}", case.models.len()),
                PER_MODEL,
                &expressions,
            );
            let points = part.iter().flat_map(|kink| &kink.points);
            let points: Vec<f64> = points.flat_map(|point| point.inputs(PER_MODEL)).collect();
            let n_points = points.len() / (3 * PER_MODEL);
            let all = functions(&model, n_points, Form::Automatic);
            let jacobian = all
                .into_iter()
                .find(|f| matches!(f.kind, Kind::Jacobian(..)));
            case.functions.push(jacobian.expect("a Jacobian"));
            case.models.push(model);
            case.points.push(points);
            case.kinks.push(part);
        }
        case
    }

    /// Compares the entries of a result, found at all points of all models.
    fn check(&self, by: &str, tolerance: f64, found: &[Vec<f64>]) {
        let (mut wrong, mut all) = (Vec::new(), 0);
        for ((function, kinks), found) in self.functions.iter().zip(&self.kinks).zip(found) {
            let Kind::Jacobian(_, pattern) = &function.kind else {
                panic!("{} is no Jacobian", function.name);
            };
            let places = pattern.rows.iter().zip(&pattern.cols).enumerate();
            let places: HashMap<_, _> = places.map(|(k, (row, col))| ((*row, *col), k)).collect();
            let mut results = found.chunks(function.output_len());
            for (row, kink) in kinks.iter().enumerate() {
                for point in &kink.points {
                    let result = &results.next().expect("one result a point")[PER_MODEL..];
                    for (col, expected) in columns(PER_MODEL).into_iter().zip(point.slopes) {
                        let found = places.get(&(row, col)).map_or(0.0, |place| result[*place]);
                        all += 1;
                        let allowed = tolerance * expected.abs().max(1.0);
                        let is_near = (found - expected).abs() <= allowed;
                        if found != expected && !is_near {
                            let at = (point.at, col, found, expected);
                            wrong.push(format!("{} {at:?}", kink.expression));
                        }
                    }
                }
            }
        }
        let few: Vec<&String> = wrong.iter().take(5).collect();
        assert!(
            wrong.is_empty(),
            "{by}: {} of {all} slopes: {few:#?}",
            wrong.len()
        );
        println!("{by}: {all} slopes within {tolerance}");
    }
}

#[test]
fn slopes_at_kinks_are_limits_in_the_interpreter_c_and_rust() {
    let case = Case::new();
    let pairs = case.functions.iter().zip(&case.points);
    let expected: Vec<Vec<f64>> = pairs.map(|(f, points)| f.interpret(points)).collect();
    case.check("interpreter", DOUBLE, &expected);

    let workshop = Workshop::new(&case.models, Form::Automatic);
    let builds = match tools::is_thorough() {
        true => Build::all(),
        false => vec![Build::c(), Build::rust()],
    };
    // It visits states at rest, where all of these have kinks.
    workshop.run_c_selftest(&Build::c(), case.models[0].identifier().as_str());
    if tools::is_thorough() {
        workshop.run_rust_selftest(case.models[0].identifier().as_str());
    }
    for build in builds {
        let found = workshop.run(&build, &case.functions, &case.points);
        case.check(build.name, DOUBLE, &found);
        // Of many expressions some have functions of constants, which C compilers compute themselves.
        if !tools::is_thorough() {
            for (found, expected) in found.iter().flatten().zip(expected.iter().flatten()) {
                let is_same = found.to_bits() == expected.to_bits();
                assert!(
                    is_same || found.is_nan() && expected.is_nan(),
                    "{}",
                    build.name
                );
            }
        }
    }
}

#[test]
fn slopes_at_kinks_are_no_nan_in_single_precision() {
    let case = Case::new();
    let mut found = Vec::new();
    for (function, points) in case.functions.iter().zip(&case.points) {
        let mut interpreter = Interpreter::<f32>::new(&function.program);
        let mut results = Vec::new();
        for point in points.chunks(3 * PER_MODEL) {
            let parts = point.chunks(PER_MODEL);
            let inputs: Vec<Vec<f32>> = parts
                .map(|part| part.iter().map(|x| *x as f32).collect())
                .collect();
            let outputs = interpreter.results(&inputs).concat();
            results.extend(outputs.into_iter().map(f64::from));
        }
        found.push(results);
    }
    case.check("f32", tools::thorough_or(SINGLE_OF_MANY, SINGLE), &found);
}

/// The slope of a text by z1, where variables that are not given are zero.
fn slope_at(text: &str, values: &[(&str, f64)]) -> f64 {
    let names = ["z1", "z2", "dz1", "dz2", "u1", "u2"];
    let value = |name: &str| values.iter().find(|(known, _)| *known == name);
    let point = names.map(|name| value(name).map_or(0.0, |(_, value)| *value));
    let phase = Phase {
        name: "phase".to_owned(),
        feet: FeetRule::Any,
        xi: DMatrix::from_column_slice(1, 2, &[1.0, 0.0]),
    };
    let library = Library::from_terms(2, &[text.to_owned()]).expect("the term parses");
    let model = ReducedModel::builder("kink", library).phase(phase).build();
    let mut compiled = CompiledModel::new(&model.expect("a model")).expect("lowers");
    let (mut ddz, mut jacobian) = ([f64::NAN; 2], DMatrix::from_element(2, 6, f64::NAN));
    compiled.jacobian(
        0,
        &point[..2],
        &point[2..4],
        &point[4..],
        &mut ddz,
        &mut jacobian,
    );
    jacobian[(0, 0)]
}

#[test]
fn slope_has_the_value_that_the_function_has() {
    let (inf, zero) = (f64::INFINITY, 0.0);
    let at_zero = [
        ("z1*sqrt(abs(z1))", zero),
        ("z1*sqrt(z1^2 + z2^2)", zero),
        ("sign(z1)*tanh(abs(z1))", 1.0),
        ("abs(z1)", 1.0),
        ("-abs(sin(z1))", -1.0),
        ("sqrt(z1)", inf),
        ("sqrt(-z1)", -inf),
        ("-sqrt(abs(z1))", -inf),
        ("sqrt(z1^2 + z2^2)", 1.0),
        ("cos(sqrt(abs(z1)))", -0.5),
        ("sqrt(1 - cos(z1))", 0.5f64.sqrt()),
        ("sqrt(abs(z1))*sqrt(abs(sin(z1)))", 1.0),
        ("sqrt(z1) - sqrt(2*z1)", -inf),
        ("sqrt(z1) - sin(sqrt(z1))", zero),
        ("abs(z1)^0.3*abs(tan(z1))^0.7", 1.0),
        ("(z1^2 + z2^2)^0.75", zero),
        ("(z1^2)^0.3*z1", zero),
        ("sqrt(abs(z1) + abs(z2))", inf),
        ("sign(z1)*(1 + z1)", 1.0),
        ("sign(z1)*cos(z2)", zero),
        ("tanh(1/z1)", zero),
        ("1/(1 + 1/z1)", 1.0),
        ("exp(-1/z1^2)", zero),
        ("(1 + sqrt(z1))*(1 - sqrt(z1) + z1)", zero),
        ("z1*sign(sin(z1)*cos(z1))", 1.0),
    ];
    for (text, expected) in at_zero {
        let found = slope_at(text, &[]);
        assert!(
            found == expected || (found - expected).abs() < 1e-12,
            "{text}: {found}, {expected}"
        );
    }
}

#[test]
fn slope_follows_exponents_and_other_variables() {
    let cases = [
        ("abs(z1)^z2", 2.5, 0.0),
        ("abs(z1)^z2", 1.0, 1.0),
        ("abs(z1)^z2", 0.5, f64::INFINITY),
        ("z1*abs(z1)^z2", 0.5, 0.0),
        ("sqrt(abs(z2*z1))", 0.0, 0.0),
        ("sqrt(z2*z1)", -2.0, f64::NEG_INFINITY),
        ("sqrt(z2*z1)", 2.0, f64::INFINITY),
        ("sqrt(z1^2 + z2^2)", 2.0, 0.0),
        ("z2*sqrt(abs(z1)) + z1", 0.0, 1.0),
        ("z2*sqrt(abs(z1)) + z1", -1.0, f64::NEG_INFINITY),
        ("sqrt(abs(z1 - z2))*(z1 - z2)", 0.0, 0.0),
        ("abs(z2)^z1", 0.0, 0.0),
    ];
    for (text, y, expected) in cases {
        let found = slope_at(text, &[("z2", y)]);
        assert_eq!(found, expected, "{text} at z2 = {y}");
    }
    for (text, expected) in [("sqrt(abs(z1 - z2))*(z1 - z2)", 0.0), ("abs(z1 - z2)", 1.0)] {
        assert_eq!(
            slope_at(text, &[("z1", 0.7), ("z2", 0.7)]),
            expected,
            "{text}"
        );
    }
    for (at, expected) in [([3.0, 4.0], 0.15), ([0.0, 2.0], 0.0)] {
        let values = [("z1", at[0]), ("z2", at[1])];
        let found = slope_at("sqrt(z1^2 + z2^2)/z2", &values);
        assert!((found - expected).abs() < 1e-15, "{found} at {at:?}");
    }
    assert_eq!(slope_at("sqrt(1 - z1)*(1 - z1)", &[("z1", 1.0)]), 0.0);
    assert_eq!(slope_at("sqrt(1 - z1)", &[("z1", 1.0)]), f64::NEG_INFINITY);
}

#[test]
fn slope_with_too_many_cases_is_a_difference_instead_of_no_number() {
    let nested = "sqrt(abs(tan(z1)/(1 + abs(abs(z1^2 + z1^2)^u1))) + abs(z2))*(1 - cos(z1))";
    let found = slope_at(nested, &[("u1", 1.0)]);
    assert!(found.abs() < 1e-3, "{found}");
    let nested = "abs(abs(abs(z1)^dz1 + sin(z2)*z1^2)^dz2 - abs(abs(z2)^u1 - z1)^dz1)^u1*z1";
    let found = slope_at(nested, &[("dz1", 1.5), ("dz2", 0.5), ("u1", 2.0)]);
    assert!(found.abs() < 1e-3, "{found}");
}

#[test]
fn infinite_slopes_of_two_terms_cancel() {
    let terms = ["sqrt(z1)", "sqrt(sin(z1))"].map(str::to_owned);
    let phase = Phase {
        name: "phase".to_owned(),
        feet: FeetRule::Any,
        xi: DMatrix::from_column_slice(2, 1, &[1.5, -1.5]),
    };
    let library = Library::from_terms(1, &terms).expect("terms parse");
    let model = ReducedModel::builder("roots", library).phase(phase).build();
    let mut compiled = CompiledModel::new(&model.expect("a model")).expect("lowers");
    let (mut ddz, mut jacobian) = ([f64::NAN], DMatrix::from_element(1, 3, f64::NAN));
    compiled.jacobian(0, &[0.0], &[0.0], &[0.0], &mut ddz, &mut jacobian);
    assert_eq!((ddz[0], jacobian[(0, 0)]), (0.0, 0.0));
}

/// The distance of two floats in units of the last place.
fn ulps(a: f64, b: f64) -> u64 {
    a.to_bits().abs_diff(b.to_bits())
}

#[test]
fn sign_of_nan_is_nan_and_powers_of_ten_are_near() {
    let model = model("special", 2, &["sign(z1) + abs(z1)", "10^z2"]);
    let all = functions(&model, 1, Form::Automatic);
    let dynamics = all.into_iter().find(|f| f.kind == Kind::Dynamics(0));
    let mut dynamics = dynamics.expect("accelerations");
    let exponents = (-300..=300).step_by(7);
    let exact: Vec<f64> = exponents
        .clone()
        .map(|k| format!("1e{k}").parse().expect("a number"))
        .collect();
    let points = exponents.map(|k| [f64::NAN, f64::from(k), 0.0, 0.0, 0.0, 0.0]);
    let points: Vec<f64> = points.flatten().collect();
    dynamics.n_points = exact.len();
    let workshop = Workshop::new(&[model], Form::Automatic);
    let (functions, points) = ([dynamics], [points]);
    let mut found = vec![functions[0].interpret(&points[0])];
    for build in [Build::c(), Build::rust()] {
        found.extend(workshop.run(&build, &functions, &points));
    }
    for (found, exact) in found.iter().flat_map(|found| found.chunks(2).zip(&exact)) {
        assert!(found[0].is_nan(), "{found:?}");
        assert!(ulps(found[1], *exact) <= 2, "{found:?} {exact}");
    }
    let pairs = found[1..].iter().flatten().zip(found[0].iter().cycle());
    for (found, interpreted) in pairs.filter(|(_, interpreted)| !interpreted.is_nan()) {
        assert_eq!(found.to_bits(), interpreted.to_bits());
    }
}
