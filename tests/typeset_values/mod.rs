//! Printed equations have the model's values: the typeset tree is evaluated as by a reader and compared with the model.

mod names;
mod numbers;
mod texts;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use nalgebra::DVector;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use romc_model::artifact;

use crate::equations::Equations;
use crate::model::{LatentVariable, Library, ReducedModel};
use crate::symbolic::Function;
use crate::typeset::{
    Equation, Math, RobotTypeset, Rounding, Signed, Symbol, SymbolTable, Typeset,
    expression::expression,
};

type Values = BTreeMap<Symbol, f64>;

fn sum(terms: &[Signed], values: &Values) -> f64 {
    let value = |term: &Signed| {
        let size = value_of(&term.math, values);
        if term.negative { -size } else { size }
    };
    terms.iter().map(value).sum()
}

/// The value of a typeset tree by the rules of mathematical notation.
fn value_of(math: &Math, values: &Values) -> f64 {
    let of = |math: &Math| value_of(math, values);
    match math {
        Math::Number(number) => number.value(),
        Math::Symbol(symbol) => values[symbol],
        Math::Sum(terms) => sum(terms, values),
        Math::Product(factors) => {
            for pair in factors.windows(2) {
                // Adjacent digits would be read as one number and signs as subtraction.
                assert!(
                    pair[0] == Math::Dot || !pair[1].starts_with_digit(),
                    "{pair:?}"
                );
                assert!(
                    !matches!(pair[1], Math::Sum(_)),
                    "a sum needs parentheses: {pair:?}"
                );
            }
            assert!(!matches!(factors[0], Math::Sum(_)), "{factors:?}");
            factors
                .iter()
                .filter(|factor| **factor != Math::Dot)
                .map(of)
                .product()
        }
        Math::Dot => panic!("a dot stands only in a product"),
        Math::Fraction(top, bottom) | Math::Slash(top, bottom) => of(top) / of(bottom),
        Math::Power(base, exponent) => {
            let needs_parentheses = matches!(
                **base,
                Math::Sum(_) | Math::Product(_) | Math::Fraction(..) | Math::Power(..)
            );
            assert!(!needs_parentheses, "{base:?}");
            of(base).powf(of(exponent))
        }
        Math::Root(inner, None) => of(inner).sqrt(),
        Math::Root(inner, Some(index)) => of(inner).powf(1.0 / f64::from(*index)),
        Math::Function(name, power, argument) => {
            let argument = of(argument);
            let value = match name {
                Function::Sin => argument.sin(),
                Function::Cos => argument.cos(),
                Function::Tan => argument.tan(),
                Function::Tanh => argument.tanh(),
                Function::Exp => argument.exp(),
                Function::Log => argument.ln(),
                Function::Sign => argument.signum(),
                Function::Sqrt | Function::Abs => panic!("{name:?} has a form of its own"),
            };
            value.powf(power.as_ref().map_or(1.0, |power| of(power)))
        }
        Math::Absolute(inner) => of(inner).abs(),
        Math::Group(inner) => of(inner),
    }
}

fn models() -> Vec<ReducedModel> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut paths = Vec::new();
    for folder in ["models", "tests/fixtures/models"] {
        for entry in fs::read_dir(root.join(folder)).unwrap() {
            let path = entry.unwrap().path();
            if path
                .extension()
                .is_some_and(|extension| extension == "json")
            {
                paths.push(path);
            }
        }
    }
    paths.sort();
    paths
        .iter()
        .map(|path| artifact::read(path).unwrap())
        .collect()
}

/// Values between 0.2 and 1.2, where roots and logarithms exist; `seed` makes vectors different.
fn point(dim: usize, seed: f64) -> DVector<f64> {
    DVector::from_fn(dim, |row, _| {
        0.7 + 0.5 * (3.7 * seed + 1.9 * row as f64).sin()
    })
}

fn latent_values(z: &DVector<f64>, dz: &DVector<f64>, u: &DVector<f64>) -> Values {
    let symbols = SymbolTable::default();
    let values = z.iter().chain(dz).chain(u);
    (LatentVariable::all(z.len()).zip(values))
        .map(|(variable, value)| (symbols.symbol(variable), *value))
        .collect()
}

fn assert_close(equation: &Equation, values: &Values, expected: f64, tolerance: f64) {
    let found = value_of(&equation.right(), values);
    let size: f64 = equation
        .terms
        .iter()
        .map(|term| value_of(&term.math, values).abs())
        .sum();
    let error = (found - expected).abs();
    let left = &equation.left;
    assert!(
        error <= tolerance * size,
        "{left}: {found} for {expected}, size {size}"
    );
}

#[test]
fn printed_equations_in_full_have_the_value_of_the_model() {
    for model in models() {
        let symbols = SymbolTable::default();
        let typeset = Typeset::new(&Equations::as_learned(&model), &symbols, Rounding::Exact);
        for seed in 0..5 {
            let dim = model.latent_dim();
            let at = |offset: f64| point(dim, f64::from(seed) + offset);
            let (z, dz, u) = (at(0.0), at(0.3), at(0.6));
            let values = latent_values(&z, &dz, &u);
            for (phase, system) in typeset.systems.iter().enumerate() {
                let ddz = model.ddz(phase, &z, &dz, &u).unwrap();
                for (equation, expected) in system.equations.iter().zip(ddz.iter()) {
                    assert_close(equation, &values, *expected, 1e-12);
                }
            }
        }
    }
}

#[test]
fn rounded_equations_stay_within_the_stated_relative_error() {
    for model in models() {
        let symbols = SymbolTable::default();
        let typeset = Typeset::new(
            &Equations::as_learned(&model),
            &symbols,
            Rounding::default(),
        );
        assert!(typeset.rounding.dropped.is_empty());
        assert!(typeset.rounding.largest_relative <= 0.05);
        let dim = model.latent_dim();
        let (z, dz, u) = (point(dim, 0.0), point(dim, 0.3), point(dim, 0.6));
        let values = latent_values(&z, &dz, &u);
        // `assert_close` uses the size of the printed terms, which itself has an error of up to 5 %.
        let tolerance = 1.06 * typeset.rounding.largest_relative + 1e-12;
        for (phase, system) in typeset.systems.iter().enumerate() {
            let ddz = model.ddz(phase, &z, &dz, &u).unwrap();
            for (equation, expected) in system.equations.iter().zip(ddz.iter()) {
                assert_close(equation, &values, *expected, tolerance);
            }
        }
    }
}

#[test]
fn robot_equations_in_full_are_the_decoded_accelerations() {
    let mut with_robot = 0;
    for model in models() {
        let symbols = SymbolTable::default();
        let robot =
            RobotTypeset::new(&Equations::as_learned(&model), &symbols, Rounding::Exact).unwrap();
        let Some(robot) = robot else { continue };
        with_robot += 1;
        let dim = model.latent_dim();
        let (z, dz, u) = (point(dim, 0.0), point(dim, 0.3), point(dim, 0.6));
        let values = latent_values(&z, &dz, &u);
        for (phase, system) in robot.systems.iter().enumerate() {
            let ddz = model.ddz(phase, &z, &dz, &u).unwrap();
            let ddq = model.decoder_jacobian(&z).unwrap() * ddz;
            assert_eq!(system.equations.len(), ddq.len());
            for (equation, expected) in system.equations.iter().zip(ddq.iter()) {
                assert_close(equation, &values, *expected, 1e-10);
            }
        }
    }
    assert!(with_robot > 0);
}

/// Text of a random term over three kinds of variables, functions and powers.
fn term() -> impl Strategy<Value = String> {
    let leaf = prop_oneof![
        Just("z1".to_owned()),
        Just("dz2".to_owned()),
        Just("u1".to_owned()),
        (1u32..9).prop_map(|number| number.to_string()),
        (1u32..400).prop_map(|number| format!("{}", f64::from(number) / 64.0)),
    ];
    leaf.prop_recursive(4, 24, 2, |inner| {
        let pair = (inner.clone(), inner.clone());
        let functions = ["sin", "cos", "tan", "tanh", "exp", "log", "sqrt", "abs"];
        prop_oneof![
            pair.clone().prop_map(|(a, b)| format!("({a}) + ({b})")),
            pair.clone().prop_map(|(a, b)| format!("({a}) - ({b})")),
            pair.clone().prop_map(|(a, b)| format!("({a})*({b})")),
            pair.clone().prop_map(|(a, b)| format!("({a})/({b})")),
            // A negative base has a value only if rounding keeps the exponent an integer.
            pair.prop_map(|(a, b)| format!("abs({a})^({b})")),
            (inner.clone(), -3i32..5).prop_map(|(a, power)| format!("({a})^({power})")),
            (inner.clone(), 1i32..5, 2i32..5).prop_map(|(a, n, d)| format!("({a})^({n}/{d})")),
            inner.clone().prop_map(|a| format!("-({a})")),
            (inner, 0..functions.len()).prop_map(move |(a, f)| format!("{}({a})", functions[f])),
        ]
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, rng_seed: RngSeed::Fixed(7), ..ProptestConfig::default() })]

    #[test]
    fn typeset_terms_have_the_value_of_the_expression(text in term()) {
        // The library refuses terms that are too large or are constants without a value.
        let library = Library::from_terms(2, std::slice::from_ref(&text));
        prop_assume!(library.is_ok());
        let library = library.unwrap();
        let (z, dz, u) = (point(2, 0.0), point(2, 0.3), point(2, 0.6));
        let expected = library.evaluate(&z, &dz, &u).unwrap()[0];
        prop_assume!(expected.is_finite() && expected.abs() < 1e12);
        let printed = expression(library.pool(), library.terms()[0].expr, &SymbolTable::default(), Rounding::default());
        let found = value_of(&printed.into_math(), &latent_values(&z, &dz, &u));
        // Cancellation inside the term amplifies rounding.
        let error = (found - expected).abs();
        prop_assert!(error <= 1e-6 * expected.abs().max(1.0), "{text}: {found} for {expected}");
    }
}

#[test]
fn factors_in_arguments_have_the_digits_that_are_asked_for() {
    let text = "sin(0.31492584974745974*z1)*z1".to_owned();
    let library = Library::from_terms(1, &[text]).unwrap();
    let (z, zero) = (point(1, 0.0), point(1, 0.3));
    for (rounding, factor) in [
        (Rounding::Significant(3), 0.315),
        (Rounding::Exact, 0.31492584974745974),
        (Rounding::Decimals(2), 0.31492584974745974),
    ] {
        let (pool, term) = (library.pool(), library.terms()[0].expr);
        let printed = expression(pool, term, &SymbolTable::default(), rounding);
        let found = value_of(&printed.into_math(), &latent_values(&z, &zero, &zero));
        assert_eq!(found, (factor * z[0]).sin() * z[0], "{rounding:?}");
    }
}
