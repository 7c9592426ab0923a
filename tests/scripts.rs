//! Generated Python, CasADi and MATLAB code against the interpreter, on shipped and random models.

#[path = "scripts/checkers.rs"]
mod checkers;
#[path = "differential/functions.rs"]
mod functions;
#[path = "differential/kinks.rs"]
mod kinks;
#[path = "differential/models.rs"]
mod models;
mod tools;

use checkers::check;
use romc::deploy::Target;
use romc::lower::Form;
use romc::model::ReducedModel;

/// The models, each with the form of its code.
fn all_models() -> Vec<(ReducedModel, Form)> {
    let of = |form: Form| move |model: ReducedModel| (model, form);
    let shipped = models::shipped().into_iter().map(of(Form::Automatic));
    let random = (0..12).map(models::random).map(of(Form::Automatic));
    let tables = (1000..1004).map(models::random).map(of(Form::Tables));
    let nonlinear = (0..3)
        .map(models::random_nonlinear)
        .chain([models::cubic()]);
    let nonlinear = nonlinear.map(of(Form::Automatic));
    shipped
        .chain(random)
        .chain(tables)
        .chain(nonlinear)
        .collect()
}

/// Compares every function of all models.
fn every_function(target: Target) {
    if let Some(left_out) = check(target, all_models()) {
        assert!(left_out.is_empty(), "finite nowhere: {left_out:?}");
    }
}

#[test]
fn numpy_modules_equal_the_interpreter() {
    every_function(Target::Python);
}

#[test]
fn casadi_functions_equal_the_interpreter() {
    every_function(Target::Casadi);
}

#[test]
fn matlab_files_equal_the_interpreter_in_octave() {
    every_function(Target::Matlab);
}

/// The Jacobians of expressions with kinks at these.
fn slopes_at_kinks(target: Target) {
    let kinks = kinks::kinks().into_iter();
    let models = kinks.enumerate().map(|(k, kink)| {
        let points = kink.points.iter().map(|point| point.inputs(1)).collect();
        let model = kinks::model(&format!("kink{k}"), 1, &[&kink.expression]);
        (model, Form::Automatic, points)
    });
    checkers::check_at(target, models.collect());
}

#[test]
fn numpy_slopes_at_kinks_equal_the_interpreter() {
    slopes_at_kinks(Target::Python);
}

#[test]
fn casadi_slopes_at_kinks_equal_the_interpreter() {
    slopes_at_kinks(Target::Casadi);
}

#[test]
fn matlab_slopes_at_kinks_equal_the_interpreter_in_octave() {
    slopes_at_kinks(Target::Matlab);
}
