//! Lowered programs: steps, activations, nested sums, singular maps.

#[path = "cubic.rs"]
mod cubic;

use crate::equations::Equations;
use crate::ir::{Binary, Interpreter, ProgramBuilder, Statement, Unary};
use crate::lower::{CompiledModel, Form, Map, dynamics, dynamics_jacobian};
use crate::model::{
    Activation, AffineMap, FeetRule, Layer, Library, Phase, ReducedModel, Scaling, StateMap,
};
use nalgebra::{DMatrix, DVector};

fn model(d: usize, terms: &[&str], phases: &[(&str, FeetRule, &[f64])]) -> ReducedModel {
    let texts: Vec<String> = terms.iter().map(|&term| term.to_owned()).collect();
    let library = Library::from_terms(d, &texts).expect("terms parse");
    let mut builder = ReducedModel::builder("lowered", library);
    for (name, feet, xi) in phases {
        builder = builder.phase(Phase {
            name: (*name).to_owned(),
            feet: feet.clone(),
            xi: DMatrix::from_column_slice(terms.len(), d, xi),
        });
    }
    builder.build().expect("a valid model")
}

#[test]
fn rk4_step_has_fifth_order_local_error_and_a_constant_phase_no_jacobian() {
    let pendulum = model(
        1,
        &["1", "dz1", "sin(z1)", "u1"],
        &[
            ("contact", FeetRule::Any, &[0.0, -0.3, -9.81, 2.0]),
            ("flight", FeetRule::None, &[-9.81, 0.0, 0.0, 0.0]),
        ],
    );
    let mut compiled = CompiledModel::new(&pendulum).expect("lowers");
    let (mut ddz, mut jacobian) = ([0.0], DMatrix::from_element(1, 3, f64::NAN));
    compiled.jacobian(1, &[0.7], &[-1.5], &[0.25], &mut ddz, &mut jacobian);
    assert_eq!((ddz[0], jacobian.as_slice()), (-9.81, [0.0; 3].as_slice()));
    let mut advance = |h: f64, n: usize| {
        let (mut z, mut dz) = ([0.7], [-1.5]);
        for _ in 0..n {
            compiled.rk4_step(0, &mut z, &mut dz, &[0.25], h);
        }
        z[0]
    };
    let reference = advance(1e-4, 2000);
    let coarse = (advance(0.02, 10) - reference).abs();
    let fine = (advance(0.01, 20) - reference).abs();
    assert!(coarse < 1e-6, "{coarse}");
    let order = coarse / fine;
    assert!((10.0..25.0).contains(&order), "{coarse} {fine}");
}

#[test]
fn polynomials_take_fewer_products_than_their_terms_one_by_one() {
    let terms = [
        "1",
        "z1*z2*dz1",
        "z1^2*dz1",
        "z1*dz2^2",
        "z2*dz1*dz2",
        "z1",
        "dz1*dz2",
        "z1*z2*dz2",
        "z1^3",
        "z1*dz1^2",
    ];
    let first = [0.5, 2.0, -3.0, 1.5, -0.25, 4.0, 7.0, 0.0, 0.0, 0.0];
    let second = [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, -6.0, 1.25, -2.5, 0.125];
    let xi = [first, second].concat();
    let model = model(2, &terms, &[("phase", FeetRule::Any, &xi)]);
    let program = dynamics(&Equations::of(&model), 0, Form::StraightLine).expect("lowers");
    let is_product = |s: &&Statement| matches!(s, Statement::Binary(Binary::Mul, ..));
    let products = program.statements.iter().filter(is_product).count();
    // Separately: ten with coefficients, fifteen between variables.
    assert!(products + 4 <= 10 + 15, "{products}");
}

#[test]
fn sums_of_vectors_equal_one_operation_after_the_other() {
    let model = cubic::cubic();
    let inputs = [0.9, 1.3, -0.2].map(|x: f64| (0..5).map(|k| x - 0.4 * f64::from(k)).collect());
    let [found, expected] = [Form::Automatic, Form::StraightLine].map(|form| {
        let (program, _) = dynamics_jacobian(&Equations::of(&model), 0, form).expect("lowers");
        Interpreter::new(&program).results(&inputs).concat()
    });
    assert_eq!(found.len(), expected.len());
    for (a, b) in found.iter().zip(&expected) {
        assert!((a - b).abs() <= 1e-13 * b.abs().max(100.0), "{a} {b}");
    }
}

/// A model with only an encoder.
fn encoder(weights: DMatrix<f64>, activation: Activation) -> ReducedModel {
    let d = weights.nrows();
    let map = AffineMap::new("encoder", weights, DVector::zeros(d)).expect("fits");
    let encoder = StateMap::new("encoder", vec![Layer { map, activation }]).expect("a chain");
    model(d, &["1"], &[("phase", FeetRule::Any, &vec![0.0; d])])
        .into_builder()
        .encoder(encoder)
        .scaling(Scaling::uniform(1.0))
        .build()
        .expect("a valid model")
}

#[test]
fn lowered_activations_have_the_values_and_slopes_of_the_model() {
    for phi in Activation::ALL {
        let model = encoder(DMatrix::from_element(1, 1, 1.0), phi);
        let run = |map: Map, inputs: &[Vec<f64>]| {
            let program = map.lower(&model).expect("lowers");
            Interpreter::new(&program).results(inputs)[0][0]
        };
        for a in [-30.0, -6.0, -0.7, -1e-9, 0.0, 0.3, 2.5, 9.0, 400.0] {
            let inputs = match phi {
                Activation::Linear => vec![vec![1.0]],
                _ => vec![vec![a], vec![1.0]],
            };
            let found = [
                run(Map::Encode, &[vec![a]]),
                run(Map::EncodeVelocity, &inputs),
            ];
            let at = DVector::from_element(1, a);
            let value = model.encode(&at).expect("fits")[0];
            let slope = model.encoder_jacobian(&at).expect("fits")[(0, 0)];
            for (found, expected) in found.into_iter().zip([value, slope]) {
                let bound = 4e-15 * (1.0 + expected.abs());
                let error = (found - expected).abs();
                assert!(error <= bound, "{phi} at {a}: {found} {expected}");
            }
        }
    }
}

#[test]
fn projection_by_dependent_rows_gives_no_finite_number() {
    let weights = DMatrix::from_row_slice(2, 3, &[1.0, 2.0, 4.0, -2.0, 1.0, 0.5]);
    let model = encoder(weights, Activation::Relu);
    let program = Map::ProjectInput.lower(&model).expect("lowers");
    // The second unit is inactive.
    let inputs = [vec![1.0, 0.0, 0.0], vec![1.0, 0.5, 0.25]];
    let found: Vec<f64> = Interpreter::new(&program).results(&inputs).remove(0);
    assert!(found.iter().all(|value| !value.is_finite()), "{found:?}");
}

#[test]
fn sign_is_zero_at_zero_and_nan_of_nan() {
    let mut builder = ProgramBuilder::new("sign");
    let x = builder.input("x", 5);
    let signs: Vec<_> = x.iter().map(|&x| builder.unary(Unary::Sign, x)).collect();
    builder.output("y", &signs);
    let program = builder.finish().expect("valid");
    let results = Interpreter::new(&program).results(&[vec![-2.0, -0.0, 0.0, 3.0, f64::NAN]]);
    assert_eq!(results[0][..4], [-1.0, 0.0, 0.0, 1.0]);
    assert!(results[0][4].is_nan());
    let results = Interpreter::<f32>::new(&program).results(&[vec![f32::NAN; 5]]);
    assert!(results[0][0].is_nan());
}

#[test]
fn number_that_is_not_finite_is_refused_with_its_statement() {
    let mut builder = ProgramBuilder::new("p");
    let x = builder.input("x", 1)[0];
    let infinite = builder.constant(f64::INFINITY);
    let y = builder.binary(Binary::Add, x, infinite);
    builder.output("y", &[y]);
    let error = builder.finish().expect_err("infinite");
    let expected = "program `p`: statement 1 holds the non-finite constant inf";
    assert_eq!(error.to_string(), expected);
}
