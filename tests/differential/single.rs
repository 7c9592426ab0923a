//! Generated code in single precision has the interpreter's bits.

use romc::codegen::Precision;
use romc::ir::Interpreter;
use romc::lower::Form;
use romc::model::ReducedModel;

use super::drivers::{Build, Workshop};
use super::functions::{Function, Random, functions as functions_of};
use super::tools::thorough_or;
use super::{models, n_models_a_program};

/// Magnitudes of the points, in turn.
const MAGNITUDES: [f64; 2] = [1.0, 10.0];

/// Points with coordinates that single precision represents exactly, up to the magnitudes in turn.
fn points(function: &Function, random: &mut Random) -> Vec<f64> {
    let mut points = Vec::new();
    for point in 0..function.n_points {
        let magnitude = MAGNITUDES[point % 2];
        for slot in &function.program.inputs {
            for _ in 0..slot.len {
                let x = match slot.name.as_str() {
                    "h" => random.between(1e-4, 0.999e-2),
                    _ => random.between(-magnitude, magnitude),
                };
                points.push(f64::from(x as f32));
            }
        }
    }
    points
}

/// The interpreter's results at the points in single precision.
fn interpret_single(function: &Function, points: &[f64]) -> Vec<f64> {
    let mut interpreter = Interpreter::<f32>::new(&function.program);
    let mut results = Vec::new();
    for point in points.chunks(function.input_len()) {
        let point: Vec<f32> = point.iter().map(|&x| x as f32).collect();
        let mut rest = point.as_slice();
        let mut inputs = Vec::new();
        for slot in &function.program.inputs {
            let (these, others) = rest.split_at(slot.len);
            inputs.push(these);
            rest = others;
        }
        let slots = function.program.outputs.iter();
        let mut outputs: Vec<Vec<f32>> = slots.map(|slot| vec![f32::NAN; slot.len]).collect();
        let mut written: Vec<&mut [f32]> = outputs.iter_mut().map(Vec::as_mut_slice).collect();
        interpreter.run(&inputs, &mut written);
        results.extend(outputs.into_iter().flatten().map(f64::from));
    }
    results
}

/// Fused operations round less often: the difference is at most 16 times the interpreter's error, or 1e-4 of one plus
/// the largest result of the point.
fn assert_near(function: &Function, points: &[f64], found: &[f64], single: &[f64]) {
    let exact = function.interpret(points);
    let n = function.output_len().max(1);
    let results = found.chunks(n).zip(single.chunks(n)).zip(exact.chunks(n));
    for ((found, single), exact) in results {
        let errors = single.iter().zip(exact).map(|(s, x)| (s - x).abs());
        let error = errors.filter(|error| error.is_finite()).fold(0.0, f64::max);
        let largest = exact
            .iter()
            .filter(|x| x.is_finite())
            .fold(0.0, |m: f64, x| m.max(x.abs()));
        let allowed = (16.0 * error).max(1e-4 * (1.0 + largest));
        for (found, exact) in found.iter().zip(exact) {
            let off = (found - exact).abs();
            assert!(
                off <= allowed || !off.is_finite(),
                "{}_{}: {found}, expected {exact} within {allowed:e}",
                function.model,
                function.name
            );
        }
    }
}

fn check(models: &[ReducedModel], form: Form, n_points: usize) {
    let functions: Vec<Function> = models
        .iter()
        .flat_map(|model| functions_of(model, n_points, form))
        .collect();
    let workshop = Workshop::in_precision(models, form, Precision::Single);
    let mut random = Random(23);
    let points: Vec<Vec<f64>> = functions
        .iter()
        .map(|function| points(function, &mut random))
        .collect();
    let strict = ["-O1", "-ffp-contract=off", "-Wdouble-promotion"];
    let fused = ["-O2", "-march=native", "-ffp-contract=fast"];
    let mut builds = vec![Build::c_with("C", &strict), Build::rust()];
    builds.extend(thorough_or(Some(Build::c_with("C, fused", &fused)), None));
    let runs = builds
        .iter()
        .map(|build| (build.name, workshop.run(build, &functions, &points)));
    for (by, found) in &runs.collect::<Vec<_>>() {
        for ((function, points), found) in functions.iter().zip(&points).zip(found) {
            let expected = interpret_single(function, points);
            if *by == "C, fused" {
                assert_near(function, points, found, &expected);
                continue;
            }
            for (found, expected) in found.iter().zip(&expected) {
                assert!(
                    found.to_bits() == expected.to_bits() || (found.is_nan() && expected.is_nan()),
                    "{by}: {}_{}: found {found:e}, interpreter {expected:e}",
                    function.model,
                    function.name
                );
            }
        }
    }
}

#[test]
fn single_precision_of_shipped_models_equals_the_interpreter() {
    check(&models::shipped(), Form::Automatic, thorough_or(500, 100));
}

#[test]
fn single_precision_of_random_models_equals_the_interpreter() {
    let random = (0..n_models_a_program() / 2).map(models::random);
    let nonlinear = (0..2).map(models::random_nonlinear);
    let cubic = [models::cubic()];
    let models: Vec<ReducedModel> = random.chain(nonlinear).chain(cubic).collect();
    check(&models, Form::Automatic, 50);
}

#[test]
fn single_precision_with_tables_equals_the_interpreter() {
    let random = (1000..1000 + n_models_a_program() / 4).map(models::random);
    let models: Vec<ReducedModel> = random.collect();
    check(&models, Form::Tables, 50);
}

#[test]
fn selftests_in_single_precision_pass() {
    let models = models::shipped();
    let form = Form::default();
    let workshop = Workshop::in_precision(&models, form, Precision::Single);
    for model in models
        .iter()
        .skip(thorough_or(0, 1))
        .step_by(thorough_or(1, 3))
    {
        workshop.run_c_selftest(&Build::c_plain(), model.identifier().as_str());
    }
    for model in models.iter().filter(|model| model.latent_dim() <= 2) {
        workshop.run_rust_selftest(model.identifier().as_str());
    }
}
