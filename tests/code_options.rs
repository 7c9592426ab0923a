//! Options of generated code: units at the interface, sines of the C library, C++ as language, arbitrary folder names.

mod command_line;
mod tools;

use std::fs;
use std::path::Path;
use std::process::Command;

use romc::artifact;
use romc::codegen::{Precision, SineCosine, Units};
use romc::deploy::{EmitOptions, Target, emit};
use romc::equations::{Equations, PhysicalError};
use romc::files::EmittedFile;
use romc::lower::Form;
use romc::model::{FeetRule, Library, Phase, ReducedModel};
use romc::typeset::{PrintOptions, Rounding};

/// A model with trigonometric candidate terms.
const WITH_SINES: &str = "models/paper-2d.json";
/// A model with encoder, decoder, scaling and lift.
const WITH_MAPS: &str = "models/go1-d4.json";

fn load(path: &str) -> ReducedModel {
    artifact::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).expect("a shipped model")
}

fn write(folder: &Path, files: &[EmittedFile]) {
    romc::files::write_files(folder, files, romc::files::Overwrite::Refuse).expect("written");
}

/// A model with one term and this coefficient.
fn of_one_term(coefficient: f64, term: &str) -> ReducedModel {
    let library = Library::from_terms(1, &[term.to_owned()]).expect("a term");
    let phase = Phase {
        name: "contact".into(),
        feet: FeetRule::Any,
        xi: nalgebra::DMatrix::from_element(1, 1, coefficient),
    };
    let builder = ReducedModel::builder("one", library).phase(phase);
    builder.build().expect("a model")
}

/// Compiles C files strictly and runs the program; returns its output.
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

/// The C++ compiler of the machine.
fn cpp() -> Option<String> {
    let compiler = std::env::var("CXX").unwrap_or_else(|_| "c++".to_owned());
    tools::answers(Command::new(&compiler).arg("--version")).then_some(compiler)
}

const STRICT_CPP: &str = "-x c++ -O1 -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Werror -I.";

#[test]
fn generated_c_is_cpp_and_passes_its_self_test() {
    let Some(compiler) = cpp() else { return };
    // Sines in lanes, tables with loops over rows, a function of every kind.
    for (path, form, precision, standard) in [
        (WITH_SINES, Form::Automatic, Precision::Double, "-std=c++11"),
        (WITH_SINES, Form::Tables, Precision::Single, "-std=c++20"),
        (
            "tests/fixtures/models/dense-4.json",
            Form::Tables,
            Precision::Double,
            "-std=c++11",
        ),
        (
            "tests/fixtures/models/every-function.json",
            Form::Automatic,
            Precision::Single,
            "-std=c++20",
        ),
    ] {
        let model = load(path);
        let stem = model.identifier().as_str();
        let options = EmitOptions {
            form,
            precision,
            ..EmitOptions::default()
        };
        let folder = tempfile::tempdir().expect("a temporary folder");
        let files = emit(&Equations::of(&model), &[Target::C], &options).expect("emits");
        write(folder.path(), &files);
        run(Command::new(&compiler)
            .current_dir(folder.path())
            .args(STRICT_CPP.split(' '))
            .args([
                standard,
                &format!("{stem}.c"),
                &format!("{stem}_selftest.c"),
            ])
            .args(["-o", "program", "-lm"]));
        let said = run(&mut Command::new(folder.path().join("program")));
        assert!(said.contains("all functions agree"), "{said}");
    }
}

#[test]
fn headers_of_the_controller_in_c_are_cpp() {
    let Some(compiler) = cpp() else { return };
    let model = load("models/go1-d2.json");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let files = emit(
        &Equations::of(&model),
        &[Target::ControllerC],
        &EmitOptions::default(),
    );
    write(folder.path(), &files.expect("emits"));
    let inside = folder.path().join("go1_d2-controller-c");
    let headers = fs::read_dir(&inside)
        .expect("a folder")
        .map(|file| file.expect("a file").path());
    let headers = headers.filter(|path| path.extension().is_some_and(|ending| ending == "h"));
    let name = |path: std::path::PathBuf| {
        path.file_name()
            .expect("a name")
            .to_string_lossy()
            .into_owned()
    };
    let includes: Vec<String> = headers
        .map(|path| format!("#include \"{}\"\n", name(path)))
        .collect();
    assert!(includes.len() >= 3, "{includes:?}");
    fs::write(inside.join("all.cpp"), includes.concat()).expect("written");
    run(Command::new(&compiler)
        .current_dir(&inside)
        .args(STRICT_CPP.split(' '))
        .args(["-fsyntax-only", "all.cpp"]));
}

#[test]
fn printed_command_builds_the_self_test_in_a_folder_of_any_name() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/paper-2d.json");
    let model = root.to_str().expect("UTF-8");
    for name in ["my out; exit 3", "it's $(exit 3)", "-o", "."] {
        let out = format!("--out-dir={name}");
        let done = command_line::romc(folder.path(), &["compile", model, "--emit", "c", &out]);
        let said = command_line::text(&done.stdout);
        assert!(
            done.status.success(),
            "{}",
            command_line::text(&done.stderr)
        );
        let line = said
            .lines()
            .find(|line| line.starts_with("  cc "))
            .expect("a command");
        let ran = run(Command::new("sh")
            .current_dir(folder.path())
            .args(["-c", line]));
        assert!(ran.contains("all functions agree"), "{line}: {ran}");
    }
}

/// Texts of a file have no effect in emitted files: not on comments, on pages, or on the order of displayed text.
#[test]
fn texts_of_a_model_file_are_seen_in_every_emitted_file() {
    use Target::{
        C, Casadi, Controller, ControllerC, Latex, Markdown, Mathml, Matlab, Python, Rust,
    };
    let hostile = "a \u{202e}b\u{2066} \u{200b}\u{feff}*/ ??/ \u{e0041}<script> \\input{x}";
    let model = load("models/go1-d2.json");
    let model = model
        .into_builder()
        .description(hostile)
        .build()
        .expect("a model");
    let targets = [
        Latex,
        C,
        Rust,
        Markdown,
        Mathml,
        Python,
        Casadi,
        Matlab,
        Controller,
        ControllerC,
    ];
    let files = emit(&Equations::of(&model), &targets, &EmitOptions::default()).expect("emits");
    let with_text = files
        .iter()
        .filter(|file| file.contents.contains("[U+202E]"))
        .count();
    assert_eq!(with_text, 3, "pages and preview have the description");
    for file in &files {
        let acts = |c: char| hostile.contains(c) && romc::files::is_invisible(c);
        let found = file
            .contents
            .find(acts)
            .map(|at| &file.contents[at..at + 12]);
        assert!(
            found.is_none() && !file.contents.contains("<script>"),
            "{}: {found:?}",
            file.path
        );
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

/// Robot accelerations of all phases at pseudo-random states and inputs in SI units, by generated C: encode,
/// project, evaluate and decode.
fn robot_accelerations(model: &ReducedModel, equations: &Equations<'_>) -> Vec<f64> {
    let name = model.identifier().as_str();
    let upper = name.to_uppercase();
    let files = emit(equations, &[Target::C], &EmitOptions::default()).expect("emits");
    let folder = tempfile::tempdir().expect("a temporary folder");
    write(folder.path(), &files);
    let sources = [&format!("{name}.c"), &format!("{name}_selftest.c")];
    run_c(folder.path(), &sources.map(String::as_str));
    let phases: String = (0..model.phases().len())
        .map(|phase| {
            let phase = model.phase_identifier(phase).as_str();
            format!(
                "{name}_{phase}_dynamics(z, dz, u_lat, ddz);\n{name}_decode_velocity(ddz, ddx);\n\
                 for (int i = 0; i < N; ++i) printf(\"%.17g\\n\", ddx[i]);\n"
            )
        })
        .collect();
    let main = format!(
        "#include <stdint.h>\n#include <stdio.h>\n#include \"{name}.h\"\n\
         enum {{ N = {upper}_STATE_DIM, D = {upper}_LATENT_DIM }};\n\
         static uint32_t seed = 1;\n\
         static double next(double scale) {{\n\
         seed = seed * 1664525u + 1013904223u;\nreturn scale * ((double)seed / 2147483648.0 - 1.0);\n}}\n\
         int main(void) {{\ndouble x[N], dx[N], u[N], z[D], dz[D], u_lat[D], ddz[D], ddx[N];\n\
         for (int k = 0; k < 200; ++k) {{\n\
         for (int i = 0; i < N; ++i) {{ x[i] = next(1.0); dx[i] = next(5.0); u[i] = next(30.0); }}\n\
         {name}_encode(x, z);\n{name}_encode_velocity(dx, dz);\n{name}_project_input(u, u_lat);\n\
         {phases}}}\nreturn 0;\n}}\n"
    );
    fs::write(folder.path().join("main.c"), main).expect("written");
    let printed = run_c(folder.path(), &["main.c", &format!("{name}.c")]);
    let numbers = printed.lines().map(|line| line.parse().expect("a number"));
    numbers.collect()
}

#[test]
fn physical_units_give_the_accelerations_of_scaled_ones_for_all_shipped_models() {
    for path in ["go1-d2", "go1-d4", "go1-d6", "go2-async-d4"] {
        let model = load(&format!("models/{path}.json"));
        let scaled = Equations::of(&model);
        let physical = scaled.in_physical_units().expect("has units");
        let (scaled, physical) = (
            robot_accelerations(&model, &scaled),
            robot_accelerations(&model, &physical),
        );
        assert_eq!(scaled.len(), physical.len());
        // All accelerations of a sample are decoded from one sum, whose rounding error they share.
        for (scaled, physical) in scaled.chunks(18).zip(physical.chunks(18)) {
            let largest = scaled.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            assert!(largest > 0.0 && largest.is_finite());
            for (a, b) in scaled.iter().zip(physical) {
                assert!((a - b).abs() <= 1e-12 * largest, "{path}: {a:e} and {b:e}");
            }
        }
    }
}

#[test]
fn physical_units_need_maps_and_names_of_units() {
    let model = load(WITH_SINES);
    let physical = Equations::of(&model).in_physical_units();
    let error = physical.err().expect("a latent model has no units");
    assert!(matches!(error, PhysicalError::LatentOnly { .. }), "{error}");

    let model = load(WITH_MAPS);
    let mut state = model.state().expect("named").clone();
    state.units[0] = "deg".to_owned();
    let in_degrees = model.clone().into_builder().state(state).build();
    let unknown = in_degrees.expect("a model").clone();
    let equations = Equations::of(&unknown)
        .in_physical_units()
        .expect("without a ruling unit");
    let units = equations.latent_units().expect("physical");
    assert!(units.position.iter().all(|unit| unit.to_string() == "1"));
}

#[test]
fn physical_latex_has_the_units_of_a_mass_and_of_times() {
    let model = load(WITH_MAPS);
    let physical = Equations::of(&model)
        .in_physical_units()
        .expect("has units");
    let options = EmitOptions::default();
    let files = emit(
        &physical,
        &[Target::Latex, Target::Markdown, Target::C],
        &options,
    )
    .expect("emits");
    let file = |name: &str| {
        let file = files.iter().find(|file| file.path == name);
        file.expect("emitted").contents.as_str()
    };
    assert!(file("go1_d4-table.tex").contains(r"\mathrm{m/s^{2}}"));
    assert!(file("go1_d4-nomenclature.tex").contains(r"$\mathrm{N}$"));
    assert!(file("go1_d4.md").contains(r"\mathrm{m/s^{2}}"));
    for unit in ["m/s^2", "1/kg", "rad/(kg m^2)", "rad/(m s^2)"] {
        assert!(file("go1_d4.h").contains(unit), "{unit}");
    }
    assert!(!file("go1_d4.h").contains("scaled"));
}

#[test]
fn controllers_of_physical_equations_are_those_of_scaled_ones() {
    for name in ["go1-d4", "go2-async-d4"] {
        let model = load(&format!("models/{name}.json"));
        let scaled = Equations::of(&model);
        let physical = scaled.in_physical_units().expect("has units");
        assert!(physical.latent_units().is_some());
        for target in [Target::Controller, Target::ControllerC] {
            let [of_scaled, of_physical] = [&scaled, &physical].map(|equations| {
                emit(equations, &[target], &EmitOptions::default()).expect("emits")
            });
            assert!(
                !of_scaled.is_empty() && of_scaled == of_physical,
                "{name}: {target:?}"
            );
        }
    }
}

#[test]
fn controller_refuses_a_phase_with_the_name_of_its_functions() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/go1-d2.json");
    let text = fs::read_to_string(path).expect("shipped");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("renamed.json");
    fs::write(&path, text.replace("\"contact\"", "\"controller\"")).expect("written");
    let renamed = romc::artifact::read(&path).expect("a model");
    let refused = emit(
        &Equations::of(&renamed),
        &[Target::ControllerC],
        &EmitOptions::default(),
    );
    let message = refused.expect_err("two functions of one name").to_string();
    assert!(message.contains("phase `controller`"), "{message}");
}

#[test]
fn constants_of_single_precision_are_computed_in_double() {
    let in_c = |coefficient: f64, term: &str, precision: Precision| {
        let model = of_one_term(coefficient, term);
        let options = EmitOptions {
            precision,
            ..EmitOptions::default()
        };
        let files = emit(&Equations::of(&model), &[Target::C], &options);
        files.map(|files| {
            let source = files.iter().find(|file| file.path.ends_with("one.c"));
            source.expect("a source file").contents.clone()
        })
    };
    for (coefficient, term, spelled) in [
        (1e-30, "exp(100)*z1", "2688117"),
        (3.0, "z1*log(1e-300)", "-2072.32"),
        (0.5, "sin(sqrt(exp(160)*1e-60)*z1)", "55406"),
    ] {
        let source = in_c(coefficient, term, Precision::Single).expect("fits");
        assert!(
            !source.contains("expf") && !source.contains("logf"),
            "{source}"
        );
        assert!(source.contains(spelled), "{term}: {source}");
        let source = in_c(coefficient, term, Precision::Double).expect("fits");
        assert!(
            source.contains("exp(") || source.contains("log("),
            "{source}"
        );
    }
    for (coefficient, term) in [(1.0, "exp(100)*z1"), (1e39, "z1"), (1e300, "z1^2")] {
        let refused = in_c(coefficient, term, Precision::Single).expect_err("too large");
        let said = refused.to_string();
        assert!(
            said.contains("single-precision") && said.contains("--precision f64"),
            "{said}"
        );
    }
}

#[test]
fn digits_that_would_round_beyond_floats_are_not_left_out() {
    for (coefficient, digits, text) in [
        (1.6e308, 1, "1.6"),
        (f64::MAX, 2, "1.797"),
        (-1.79e308, 1, "1.79"),
    ] {
        let options = EmitOptions {
            print: PrintOptions {
                rounding: Rounding::Significant(digits),
                ..PrintOptions::default()
            },
            ..EmitOptions::default()
        };
        let model = of_one_term(coefficient, "z1");
        let files = emit(
            &Equations::of(&model),
            &[Target::Latex, Target::Markdown],
            &options,
        );
        for file in files.expect("emits") {
            assert!(
                !file.contents.contains("inf") || file.path.ends_with(".bib"),
                "{}",
                file.contents
            );
            assert!(
                !file.path.ends_with("one.tex") || file.contents.contains(text),
                "{}",
                file.contents
            );
        }
    }
}

#[test]
fn literals_read_back_to_the_nearest_number_and_are_no_integers() {
    for value in [
        0.36,
        -0.0,
        5e-324,
        1e16,
        123_456_789.0,
        0.1 + 0.2,
        1e-44,
        16_777_217.0,
    ] {
        let [double, single] = [Precision::Double, Precision::Single].map(|of| of.digits(value));
        assert_eq!(double.parse().map(f64::to_bits), Ok(value.to_bits()));
        let nearest = (value as f32).to_bits();
        assert_eq!(single.parse().map(f32::to_bits), Ok(nearest));
        assert!(
            [double, single]
                .iter()
                .all(|text| text.contains(['.', 'e']))
        );
    }
}

#[test]
fn tidy_text_has_single_blank_lines_and_one_newline_at_its_end_and_comments_break_at_spaces() {
    for (text, tidied) in [
        ("", ""),
        ("\n \n", ""),
        ("a", "a\n"),
        ("\n\na  \n\n \nb\n\n", "a\n\nb\n"),
    ] {
        assert_eq!(romc::codegen::tidy(text), tidied, "{text:?}");
    }
    assert_eq!(
        romc::codegen::wrapped("one two three", 9, " "),
        ["one two", "  three"]
    );
}

#[test]
fn every_target_says_what_the_latent_coordinates_are() {
    let model = load("models/go1-d7.json");
    let scaled = Equations::of(&model);
    let physical = scaled.in_physical_units().expect("has units");
    for (equations, words) in [
        (
            &scaled,
            "rotation about the centre of mass, pitch, in 10 rad",
        ),
        (
            &scaled,
            "rear feet upwards from the centre of mass, in 10 m",
        ),
        (&physical, "centre of mass forwards, m"),
        (
            &physical,
            "rear feet upwards from the centre of mass, times a constant, rad",
        ),
    ] {
        for target in [Target::C, Target::Rust, Target::Markdown, Target::Mathml]
            .into_iter()
            .chain([Target::Python, Target::Casadi, Target::Matlab])
        {
            let files = emit(equations, &[target], &EmitOptions::default()).expect("emits");
            let has_words = files.iter().any(|file| file.contents.contains(words));
            assert!(has_words, "{target:?}: {words}");
        }
    }
    for (target, suffix) in [
        (Target::Latex, "-nomenclature.tex"),
        (Target::Controller, "include/go1_d7_controller.h"),
        (Target::Controller, "README.md"),
        (Target::ControllerC, "controller-c/go1_d7_controller.h"),
        (Target::ControllerC, "controller-c/README.md"),
    ] {
        let files = emit(&scaled, &[target], &EmitOptions::default()).expect("emits");
        let file = files.iter().find(|file| file.path.ends_with(suffix));
        let text = &file.expect("is emitted").contents;
        assert!(text.contains("centre of mass upwards, in 10 m"), "{suffix}");
    }
}
