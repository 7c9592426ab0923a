//! All targets, emitted, compiled and run for models at the limits of accepted input.

#[path = "differential/agreement.rs"]
#[allow(dead_code, reason = "the comparisons of tests/differential.rs")]
mod agreement;
#[path = "scripts/checkers.rs"]
mod checkers;
#[path = "differential/driver_text.rs"]
#[allow(dead_code, reason = "the drivers of tests/differential.rs")]
mod driver_text;
#[path = "differential/drivers.rs"]
#[allow(dead_code, reason = "self-tests alone are run here")]
mod drivers;
#[path = "differential/functions.rs"]
mod functions;
#[path = "matrix/models.rs"]
mod models;
#[path = "differential/terms.rs"]
#[allow(dead_code, reason = "the terms of tests/differential.rs")]
mod terms;
mod tools;

use std::path::Path;
use std::process::Command;

use drivers::{Build, Workshop};
use romc::artifact;
use romc::check::{CheckOptions, Side, Verdict, compare};
use romc::codegen::Precision;
use romc::deploy::{EmitError, EmitOptions, Target, emit};
use romc::equations::Equations;
use romc::files::{EmittedFile, Overwrite, write_files};
use romc::lower::Form;
use romc::model::ReducedModel;

/// Functions without a point at which all results are finite.
const FINITE_NOWHERE: [&str; 4] = [
    "undefined_contact_dynamics",
    "undefined_contact_dynamics_jacobian",
    "undefined_contact_step",
    "huge_contact_step",
];

fn succeed(command: &mut Command) -> String {
    let output = command
        .output()
        .unwrap_or_else(|error| panic!("{command:?}: {error}"));
    let said = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let (out, err) = (said(&output.stdout), said(&output.stderr));
    assert!(output.status.success(), "{command:?}\n{out}{err}");
    assert!(!err.contains("warning"), "{command:?}\n{err}");
    out
}

#[test]
fn self_tests_of_c_and_rust_compile_and_pass_in_both_precisions() {
    for precision in [Precision::Double, Precision::Single] {
        for (number, model) in models::all().into_iter().enumerate() {
            // Coefficients above the largest f32 are refused.
            if precision == Precision::Single && model.name() == "huge" {
                continue;
            }
            let name = model.identifier().to_string();
            let one = std::slice::from_ref(&model);
            let workshop = Workshop::in_precision(one, Form::default(), precision);
            workshop.run_c_selftest(&Build::c(), &name);
            // A crate compiles for seconds.
            if tools::is_thorough() || (precision == Precision::Double && number % 3 == 0) {
                workshop.run_rust_selftest(&name);
            }
        }
    }
}

#[test]
fn a_function_that_is_finite_nowhere_is_named_by_its_self_tests() {
    let model = models::all()
        .into_iter()
        .find(|model| model.name() == "undefined");
    let model = model.expect("the model");
    let targets = [Target::C, Target::Rust];
    let files = emit(&Equations::of(&model), &targets, &EmitOptions::default()).expect("emits");
    let text = |path: &str| {
        let file = files.iter().find(|file| file.path == path);
        &file.unwrap_or_else(|| panic!("{path} is missing")).contents
    };
    let c = text("undefined_selftest.c");
    assert!(c.contains("contact_dynamics: no point was found"), "{c}");
    assert!(c.contains("{NAN}") && !c.contains("{NaN}"), "{c}");
    let rust = text("undefined/tests/selftest.rs");
    let name = "fn contact_dynamics_which_is_finite_at_no_point_agrees_with_reference_vectors";
    assert!(rust.contains(name), "{rust}");
}

#[test]
fn self_tests_meet_roots_and_logarithms_where_they_are_finite() {
    let model = models::all()
        .into_iter()
        .find(|model| model.name() == "roots");
    let options = EmitOptions::default();
    let model = model.expect("the model");
    let files = emit(&Equations::of(&model), &[Target::C], &options).expect("emits");
    let selftest = files.iter().find(|file| file.path == "roots_selftest.c");
    let text = &selftest.expect("a self-test").contents;
    for array in text.split("static const").skip(1) {
        let array = array.split("};").next().unwrap_or_default();
        let is_undefined = |row: &&str| row.contains("NAN") || row.contains("INFINITY");
        // Two points are zero, where a logarithm or a negative power has no value.
        let undefined = array.split('{').filter(is_undefined).count();
        assert!(undefined <= 2 && array.split('{').count() > 6, "{array}");
    }
}

#[test]
fn python_casadi_and_matlab_equal_the_interpreter() {
    for target in [Target::Python, Target::Casadi, Target::Matlab] {
        let models = models::all().into_iter();
        let models: Vec<_> = models.map(|model| (model, Form::Automatic)).collect();
        if let Some(left_out) = checkers::check(target, models) {
            assert_eq!(left_out, FINITE_NOWHERE);
        }
    }
}

#[test]
fn latex_markdown_and_mathml_say_what_the_model_says() {
    let check = CheckOptions::default();
    for model in models::all() {
        let targets = [Target::Latex, Target::Markdown, Target::Mathml];
        let files = emit(&Equations::of(&model), &targets, &EmitOptions::default());
        let files = files.unwrap_or_else(|error| panic!("{}: {error}", model.name()));
        let json = artifact::to_text(&model);
        let own = Side::from_bytes("model.json", json.as_bytes(), &check, &[]).expect("a model");
        let name = model.identifier().as_str();
        for path in [format!("{name}.tex"), format!("{name}.md")] {
            let file = files
                .iter()
                .find(|file| file.path == path)
                .expect("emitted");
            let side = Side::from_bytes(&path, file.contents.as_bytes(), &check, &[]);
            let side = side.unwrap_or_else(|error| panic!("{path}: {error}"));
            let comparison = compare(&own, &side, &check);
            // Sums above the largest number cannot be compared.
            let is_undecided =
                (comparison.verdicts()).all(|verdict| matches!(verdict, Verdict::Undecided(..)));
            let same = comparison.is_equal() || (name == "huge" && is_undecided);
            assert!(same, "{path}: {comparison:?}");
        }
        let page = files
            .iter()
            .find(|file| file.path.ends_with(".html"))
            .expect("a page");
        assert_eq!(
            page.contents.matches("<math").count(),
            page.contents.matches("</math").count()
        );
        typeset(&files, name);
    }
}

/// The preview through pdflatex; without it skipped with a message, unless required.
fn typeset(files: &[EmittedFile], name: &str) {
    if !tools::has_latex() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    write_files(folder.path(), files, Overwrite::Refuse).expect("written");
    let preview = files
        .iter()
        .find(|file| file.contents.contains("\\documentclass"));
    let mut command = Command::new("pdflatex");
    command.args(["-interaction=nonstopmode", "-halt-on-error"]);
    command
        .arg(&preview.expect("a preview").path)
        .current_dir(folder.path());
    let output = command.output().expect("pdflatex starts");
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{name}: {said}");
}

/// The files of a controller; `None` for a model without a robot, which is rightly refused.
fn controller(
    model: &ReducedModel,
    target: Target,
    precision: Precision,
) -> Option<Vec<EmittedFile>> {
    let options = EmitOptions {
        precision,
        ..EmitOptions::default()
    };
    let emitted = emit(&Equations::of(model), &[target], &options);
    if models::has_controller(model) {
        return Some(emitted.unwrap_or_else(|error| panic!("{}: {error}", model.name())));
    }
    let refused = matches!(emitted, Err(EmitError::Control(_)));
    assert!(refused, "{} {target:?}", model.name());
    None
}

/// A C compiler for which every warning is an error.
fn strict_cc() -> Command {
    let mut cc = Command::new(std::env::var("CC").unwrap_or_else(|_| "cc".to_owned()));
    cc.args(["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror"]);
    cc
}

/// Output of an example: torques, each a number.
fn says_torques(name: &str, said: &str) {
    assert!(said.contains("N m"), "{name}: {said}");
    assert!(
        !said.contains("nan") && !said.contains("inf"),
        "{name}: {said}"
    );
}

#[test]
fn controllers_compile_and_command_finite_torques() {
    let scratch = Path::new(env!("CARGO_TARGET_TMPDIR"));
    // tests/controller.rs compiles the same dependencies there.
    let target = scratch.join("controller-target");
    let mut built = 0;
    for model in models::all() {
        let Some(files) = controller(&model, Target::Controller, Precision::Double) else {
            continue;
        };
        built += 1;
        if built > 1 && !tools::is_thorough() {
            continue;
        }
        let name = model.identifier().as_str();
        let folder = scratch.join("matrix");
        write_files(&folder, &files, Overwrite::Replace).expect("written");
        let folder = folder.join(format!("{name}-controller"));
        let mut cargo = Command::new(env!("CARGO"));
        // Dependencies as in tests/controller.rs; this crate with the fastest compilation.
        let level = format!("profile.release.package.{name}-controller.opt-level=0");
        cargo
            .args(["build", "--release", "--config", &level])
            .env("CARGO_PROFILE_RELEASE_OPT_LEVEL", "1")
            .env("CARGO_PROFILE_RELEASE_LTO", "off")
            .env("CARGO_TARGET_DIR", &target);
        succeed(cargo.current_dir(&folder));
        let program = target.join(format!("{name}_matrix"));
        let mut cc = strict_cc();
        cc.arg("-I").arg(folder.join("include"));
        cc.arg(folder.join("examples/example.c"));
        cc.arg(target.join(format!("release/lib{name}_controller.a")));
        cc.args(["-lm", "-lpthread", "-ldl", "-lrt", "-o"])
            .arg(&program);
        succeed(&mut cc);
        says_torques(name, &succeed(&mut Command::new(&program)));
    }
}

#[test]
fn controllers_in_c_compile_pass_their_self_tests_and_jump() {
    for precision in [Precision::Double, Precision::Single] {
        for (number, model) in models::all().into_iter().enumerate() {
            let Some(files) = controller(&model, Target::ControllerC, precision) else {
                continue;
            };
            // Each model in one precision, or in both precisions.
            if !tools::is_thorough() && (number % 2 == 0) != (precision == Precision::Double) {
                continue;
            }
            let name = model.identifier().as_str();
            let scratch = tempfile::tempdir().expect("a folder");
            write_files(scratch.path(), &files, Overwrite::Refuse).expect("written");
            let folder = scratch.path().join(format!("{name}-controller-c"));
            for main in ["selftest", "controller_selftest", "example"] {
                let mut cc = strict_cc();
                cc.args(["-O1", "-ffp-contract=off", "-o", main]);
                cc.args([format!("{name}.c"), format!("{name}_{main}.c")]);
                if main != "selftest" {
                    cc.arg(format!("{name}_controller.c"));
                }
                succeed(cc.arg("-lm").current_dir(&folder));
                let said = succeed(&mut Command::new(folder.join(main)));
                if main == "example" {
                    says_torques(name, &said);
                }
            }
        }
    }
}
