//! Options of generated code: units at the interface, sines of the library.

use std::fs;
use std::path::Path;
use std::process::Command;

use romc::artifact;
use romc::codegen::{Precision, SineCosine, Units};
use romc::deploy::{EmitOptions, Target, emit};
use romc::equations::Equations;
use romc::files::EmittedFile;
use romc::model::ReducedModel;

/// Trigonometric candidate terms in its dynamics.
const WITH_SINES: &str = "models/paper-2d.json";
/// Encoder, decoder, scaling and lift.
const WITH_MAPS: &str = "models/go1-d4.json";

fn load(path: &str) -> ReducedModel {
    artifact::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).expect("a shipped model")
}

fn write(folder: &Path, files: &[EmittedFile]) {
    romc::files::write_files(folder, files, romc::files::Overwrite::Refuse).expect("written");
}

/// Compiles C files strictly and runs the program; its output.
fn run_c(folder: &Path, sources: &[&str]) -> String {
    let program = folder.join("program");
    let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".to_owned());
    let strict = "-std=c99 -O2 -Wall -Wextra -Wconversion -Wshadow -pedantic -Werror -I.";
    run(Command::new(compiler)
        .current_dir(folder)
        .args(strict.split(' '))
        .args(sources)
        .arg("-o")
        .arg(&program)
        .arg("-lm"));
    run(&mut Command::new(program))
}

fn run(command: &mut Command) -> String {
    let output = command.output().expect("the program starts");
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    let complained = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}: {said}{complained}");
    said
}

#[test]
fn library_sines_pass_the_self_tests_in_both_precisions() {
    let model = load(WITH_SINES);
    let stem = model.identifier().as_str();
    for precision in [Precision::Double, Precision::Single] {
        let options = EmitOptions {
            precision,
            sines: SineCosine::Library,
            ..EmitOptions::default()
        };
        let folder = tempfile::tempdir().expect("a temporary folder");
        let files =
            emit(&Equations::of(&model), &[Target::C, Target::Rust], &options).expect("emits");
        write(folder.path(), &files);
        run_c(
            folder.path(),
            &[&format!("{stem}.c"), &format!("{stem}_selftest.c")],
        );
        run(Command::new(env!("CARGO"))
            .current_dir(folder.path().join(stem))
            .args(["test", "--offline", "--quiet", "--test", "selftest"]));
    }
}

#[test]
fn library_sines_leave_the_kernel_out() {
    let model = load(WITH_SINES);
    let source = |sines| {
        let options = EmitOptions {
            sines,
            ..EmitOptions::default()
        };
        let files = emit(&Equations::of(&model), &[Target::C], &options).expect("emits");
        let is_source = |file: &&EmittedFile| file.path.ends_with("paper_2d.c");
        let file = files.iter().find(is_source).expect("a C file");
        file.contents.clone()
    };
    let (inline, library) = (source(SineCosine::Inline), source(SineCosine::Library));
    assert!(library.contains("sines[i] = sin(x[i]);"));
    assert!(library.len() + 1000 < inline.len());
}

/// `encode` and `lift_input` of generated C at fixed arguments.
fn encoded_and_lifted(units: Units, x: &[f64], u_lat: &[f64]) -> Vec<f64> {
    let model = load(WITH_MAPS);
    let options = EmitOptions {
        units,
        ..EmitOptions::default()
    };
    let folder = tempfile::tempdir().expect("a temporary folder");
    write(
        folder.path(),
        &emit(&Equations::of(&model), &[Target::C], &options).expect("emits"),
    );
    let list = |values: &[f64]| {
        let texts: Vec<String> = values.iter().map(|v| format!("{v:?}")).collect();
        texts.join(", ")
    };
    let main = format!(
        "#include <stdio.h>\n#include \"go1_d4.h\"\nint main(void) {{\n\
         double x[] = {{{}}}, u_lat[] = {{{}}}, z[4], u[18];\n\
         go1_d4_encode(x, z);\ngo1_d4_lift_input(u_lat, u);\n\
         for (int i = 0; i < 4; ++i) printf(\"%.17g\\n\", z[i]);\n\
         for (int i = 0; i < 18; ++i) printf(\"%.17g\\n\", u[i]);\nreturn 0;\n}}\n",
        list(x),
        list(u_lat)
    );
    fs::write(folder.path().join("main.c"), main).expect("written");
    let printed = run_c(folder.path(), &["main.c", "go1_d4.c"]);
    let numbers = printed.lines().map(|line| line.parse().expect("a number"));
    numbers.collect()
}

#[test]
fn scaled_units_take_and_give_what_the_model_was_learned_with() {
    let model = load(WITH_MAPS);
    let encoder = model.encoder().expect("an affine encoder");
    let scaling = model.scaling().expect("scaling");
    let x: Vec<f64> = (0..18).map(|i| 0.1 * f64::from(i) - 0.7).collect();
    let u_lat = [0.5, -1.25, 2.0, 0.25];

    let scaled = encoded_and_lifted(Units::Scaled, &x, &u_lat);
    let z = encoder.weights() * nalgebra::DVector::from_column_slice(&x) + encoder.bias();
    let u = encoder.weights().transpose() * nalgebra::DVector::from_column_slice(&u_lat);
    for (found, expected) in scaled.iter().zip(z.iter().chain(u.iter())) {
        assert!((found - expected).abs() <= 1e-14 * (1.0 + expected.abs()));
    }

    let (by_state, by_input) = (scaling.state.expand(18), scaling.input.expand(18));
    let si: Vec<f64> = x.iter().enumerate().map(|(i, x)| x / by_state[i]).collect();
    let in_si = encoded_and_lifted(Units::Si, &si, &u_lat);
    for (i, (found, scaled)) in in_si.iter().zip(&scaled).enumerate() {
        let expected = if i < 4 {
            *scaled
        } else {
            scaled / by_input[i - 4]
        };
        assert!((found - expected).abs() <= 1e-13 * (1.0 + expected.abs()));
    }
}
