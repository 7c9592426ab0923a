//! Faults found by attack and by use, each reproduced from the command line.

#[path = "faults/files.rs"]
mod files;

use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Output};

use flate2::Compression;
use flate2::write::GzEncoder;
use nalgebra::DMatrix;
use romc::equations::Equations;
use romc::ir::Interpreter;
use romc::lower::{Form, dynamics_jacobian};
use romc::model::{FeetRule, Library, Phase, ReducedModel};
use serde_json::Value;

const MODEL: &str = "models/paper-2d.json";
const JUMP: &str = "examples/recordings/go1/test_01.csv.gz";

fn romc(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_romc"))
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("the binary runs")
}

fn done(arguments: &[&str]) -> String {
    let output = romc(arguments);
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {error}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Expects an exit code; returns the error.
fn fails(code: i32, arguments: &[&str]) -> String {
    let output = romc(arguments);
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {error}");
    error
}

fn shipped(name: &str) -> Value {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("models/{name}.json"));
    serde_json::from_slice(&fs::read(path).expect("a shipped model")).expect("JSON")
}

/// A model of some terms, each with a coefficient of 1.5 in the first equation, as a file.
fn with_terms(folder: &Path, name: &str, terms: &[&str]) -> String {
    let rows: Vec<Vec<f64>> = terms.iter().map(|_| vec![1.5]).collect();
    let model = serde_json::json!({
        "schema": "romc-model/1",
        "name": name,
        "latent_dim": 1,
        "library": terms,
        "phases": [{ "name": "contact", "feet": "any", "xi": rows }],
    });
    let path = folder.join("model.json");
    fs::write(&path, model.to_string()).expect("written");
    path.display().to_string()
}

#[test]
fn a_file_of_the_users_own_is_kept_though_its_name_was_emitted() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("u");
    let emit = [
        "compile",
        MODEL,
        "--emit",
        "c",
        "--out-dir",
        out.to_str().expect("UTF-8"),
    ];
    done(&emit);
    for (name, own) in [
        ("paper_2d.c", "my own work"),
        ("CMakeLists.txt", "my cmake"),
    ] {
        let path = out.join(name);
        let emitted = fs::read(&path).expect("emitted");
        fs::write(&path, own).expect("written");
        let error = fails(1, &emit);
        assert!(
            error.contains(&format!("{name}: changed since romc made it")),
            "{error}"
        );
        assert_eq!(fs::read_to_string(&path).expect("kept"), own);
        fs::write(&path, emitted).expect("written");
    }
    done(&emit);
}

#[test]
fn files_of_an_earlier_emission_are_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().to_str().expect("UTF-8");
    done(&["compile", MODEL, "--emit", "c", "--out-dir", out]);
    let again = done(&["compile", MODEL, "--emit", "markdown", "--out-dir", out]);
    assert!(
        again.contains("of earlier runs, not written now"),
        "{again}"
    );
    let again = done(&[
        "compile",
        MODEL,
        "--emit",
        "markdown",
        "--out-dir",
        out,
        "--json",
    ]);
    let again: Value = serde_json::from_str(&again).expect("JSON");
    let earlier = again["earlier_files"].as_array().expect("a list");
    assert!(
        earlier
            .iter()
            .any(|file| file.as_str().is_some_and(|f| f.ends_with("paper_2d.c")))
    );
}

#[cfg(unix)]
#[test]
fn links_planted_under_names_of_parts_lead_nowhere_and_left_parts_are_removed() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    fs::write(at("victim"), "precious").expect("written");
    fs::write(at("eq.txt"), "ddz1 = -z1 + u1\n").expect("written");
    fs::write(at(".q.json.0123456789abcdef.part"), "half").expect("written");
    for process in 1..3000 {
        let part = at(&format!(".q.json.{process}.part"));
        std::os::unix::fs::symlink(at("victim"), part).expect("a link");
    }
    let [equations, model] = ["eq.txt", "q.json"].map(|name| at(name).display().to_string());
    done(&[
        "import",
        &equations,
        "--phase",
        "contact=any",
        "--output",
        &model,
    ]);
    assert_eq!(fs::read_to_string(at("victim")).expect("kept"), "precious");
    assert!(at("q.json").symlink_metadata().expect("written").is_file());
    assert!(!at(".q.json.0123456789abcdef.part").exists());
}

#[test]
fn numbers_outside_their_ranges_are_refused_on_the_command_line_and_in_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name).display().to_string();
    let out = at("study");
    for seeds in ["4294967295", "18446744073709551615", "0"] {
        let study = [
            "study",
            JUMP,
            "--latent-dims",
            "1",
            "--seeds",
            seeds,
            "--out-dir",
            &out,
        ];
        let error = fails(2, &study);
        assert!(error.contains("a whole number from 1 to 1e4"), "{error}");
        assert!(!Path::new(&out).exists());
    }
    for step in ["1e9", "1e308", "0", "NaN"] {
        let error = fails(2, &["mpc", "models/go1-d4.json", JUMP, "--step", step]);
        assert!(error.contains("a number from 1e-4 to 1"), "{error}");
    }
    let train = [
        "train",
        JUMP,
        "--latent-dim",
        "2",
        "--output",
        &at("m.json"),
    ];
    for scale in ["1e-200", "1e-160", "1e9", "-0.1", "inf"] {
        let flag = format!("--state-scaling={scale}");
        let error = fails(2, &[&train[..], &[flag.as_str()]].concat());
        assert!(error.contains("a number from 1e-6 to 1e4"), "{error}");
        let config = at("train.toml");
        fs::write(&config, format!("state-scaling = {scale}\n")).expect("written");
        let error = fails(1, &[&train[..], &["--config", &config]].concat());
        let place = error.contains("train.toml") && error.contains("state-scaling");
        assert!(place || scale == "inf", "{error}");
    }
}

#[test]
fn a_step_that_no_recording_holds_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let jump = Path::new(env!("CARGO_MANIFEST_DIR")).join(JUMP);
    let recording = romc::recording::read(&jump).expect("a sound recording");
    let mut text = Vec::new();
    let options = romc::recording::WriteOptions::default();
    romc::recording::write_to(&mut text, &recording, None, &options).expect("memory");
    let text = String::from_utf8(text).expect("UTF-8");
    for (rows, step) in [(101, "0.5"), (3, "0.01")] {
        let short: Vec<&str> = text.lines().take(rows).collect();
        let path = folder.path().join("short.csv").display().to_string();
        fs::write(&path, short.join("\n")).expect("written");
        let error = fails(1, &["mpc", "models/go1-d4.json", &path, "--step", step]);
        assert!(error.contains("s without a gap"), "{error}");
    }
}

#[test]
fn settings_that_the_closed_form_would_ignore_are_refused_beside_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let model = folder.path().join("m.json").display().to_string();
    let train = ["train", JUMP, "--latent-dim", "2", "--output", &model];
    let closed = ["--method", "closed-form"];
    let settings: [&[&str]; 3] = [&["--paper"], &["--bptt-weight", "100"], &["--epochs", "9"]];
    for setting in settings {
        let error = fails(2, &[&train[..], &closed, setting].concat());
        let name = setting[0].trim_start_matches('-');
        assert!(
            error.contains(&format!("{name} is set for the closed form")),
            "{error}"
        );
    }
    let lone = fails(2, &[&train[..], &["--bptt-window", "4"]].concat());
    assert!(
        lone.contains("bptt-window is set for a loss without weight"),
        "{lone}"
    );
    assert!(!Path::new(&model).exists());
}

#[test]
fn the_derivative_of_a_power_of_a_product_has_a_value_where_the_product_is_zero() {
    for power in [
        "(z1*z2)^1.5",
        "(z1*z2)^2.5",
        "(z1*z2)^3.5",
        "sqrt((z1*z2)^3)",
        "sqrt(2*z1^3*z2^3)",
        "sqrt(z1^2*z2^4)",
        "((1 - u1)*z2)^1.5*z1",
        "(z1*sin(z2))^2.5",
    ] {
        let terms = [power.to_owned(), "u1".to_owned()];
        let library = Library::from_terms(2, &terms).expect("two terms");
        let xi = DMatrix::from_element(2, 2, 1.0);
        let phase = Phase {
            name: "contact".to_owned(),
            feet: FeetRule::Any,
            xi,
        };
        let model = ReducedModel::builder("m", library).phase(phase).build();
        let model = model.expect("a valid model");
        let equations = Equations::of(&model);
        let lowered = dynamics_jacobian(&equations, 0, Form::default());
        let (program, _) = lowered.expect("lowers");
        let lens = program.outputs.iter().map(|slot| slot.len);
        let mut outputs: Vec<Vec<f64>> = lens.map(|len| vec![f64::NAN; len]).collect();
        let mut written: Vec<&mut [f64]> = outputs.iter_mut().map(Vec::as_mut_slice).collect();
        let zero = [0.0; 2];
        Interpreter::new(&program).run(&[&zero, &zero, &[0.5, 0.25]], &mut written);
        assert!(
            outputs.iter().flatten().all(|value| value.is_finite()),
            "{power}: {outputs:?}"
        );
    }
}

#[test]
fn printed_equations_have_single_dots_and_powers_that_read_one_way() {
    let folder = tempfile::tempdir().expect("a folder");
    let terms = [
        "3*4^z1",
        "10*2^dz1",
        "cos(z1)^1.5",
        "exp(z1)^2*u1",
        "tanh(z1)^dz1",
    ];
    let model = with_terms(folder.path(), "dots", &terms);
    let out = folder.path().join("out").display().to_string();
    done(&[
        "compile",
        &model,
        "--emit",
        "latex",
        "--as-learned",
        "--out-dir",
        &out,
    ]);
    let tex = fs::read_to_string(Path::new(&out).join("dots.tex")).expect("emitted");
    let plain: String = tex.split_whitespace().collect();
    assert!(plain.contains(r"\cdot3\cdot4^{z_1}"), "{tex}");
    assert!(!plain.contains(r"\cdot\cdot"), "{tex}");
    assert!(!plain.contains(r"\cos(z_1)^"), "{tex}");
    assert!(!plain.contains(r"\exp(z_1)^"), "{tex}");
    assert!(!plain.contains(r"\tanh(z_1)^{\dot"), "{tex}");
    done(&["check", &model, &format!("{out}/dots.tex")]);
}

#[test]
fn names_that_end_in_an_underscore_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["a_", "a-", "a.", "a "] {
        let model = with_terms(folder.path(), name, &["z1"]);
        let error = fails(1, &["inspect", &model]);
        assert!(error.contains("ends with an underscore"), "{error}");
    }
    // A training rejects the name of its output before it begins.
    let output = folder.path().join("a_.json").display().to_string();
    let error = fails(
        1,
        &["train", JUMP, "--latent-dim", "2", "--output", &output],
    );
    assert!(error.contains("ends with an underscore"), "{error}");
}

#[test]
fn escapes_of_a_file_do_not_reach_the_terminal() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut unknown = shipped("paper-2d");
    unknown["\u{1b}[31mfield\u{202e}"] = 1.into();
    let mut robot = shipped("go1-d4");
    robot["robot"] = "go1\u{1b}]0;title\u{7}".into();
    for (name, model) in [("unknown", unknown), ("robot", robot)] {
        let path = folder.path().join(format!("{name}.json"));
        fs::write(&path, model.to_string()).expect("written");
        for json in [&[][..], &["--json"]] {
            let path = path.display().to_string();
            let output = romc(&[&["inspect", path.as_str()], json].concat());
            let said = [output.stdout, output.stderr].concat();
            let said = String::from_utf8(said).expect("UTF-8");
            let acts = |c: char| (c.is_control() && c != '\n') || c == '\u{202e}';
            assert!(said.contains("\\u{1b}") && !said.contains(acts), "{said:?}");
        }
    }
}

#[test]
fn escapes_of_arguments_do_not_reach_the_terminal() {
    let acting = "\u{1b}[31mX\u{1b}]0;t\u{7}\u{202e}";
    let file = format!("{acting}.toml");
    let name = format!("z1={acting}");
    let out = tempfile::tempdir().expect("a folder");
    let out = out.path().to_str().expect("UTF-8");
    for arguments in [
        ["study", JUMP, "--latent-dims", acting, "--out-dir", out].as_slice(),
        &["compile", MODEL, "--emit", acting, "--out-dir", out],
        &[
            "compile",
            MODEL,
            "--emit",
            "latex",
            "--rename",
            &name,
            "--out-dir",
            out,
        ],
        &["robot", acting],
        &["robot", &file],
        &["inspect", acting],
        &[acting],
    ] {
        let output = romc(arguments);
        let said = [output.stdout, output.stderr].concat();
        let said = String::from_utf8(said).expect("UTF-8");
        let acts = |c: char| (c.is_control() && c != '\n') || c == '\u{202e}';
        assert!(
            said.contains("\\u{202e}") && !said.contains(acts),
            "{arguments:?}: {said:?}"
        );
    }
}

#[test]
fn a_bomb_of_blank_lines_is_refused_early() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("bomb.csv.gz");
    let jump = Path::new(env!("CARGO_MANIFEST_DIR")).join(JUMP);
    let recording = romc::recording::read(&jump).expect("a sound recording");
    let options = romc::recording::WriteOptions::default();
    let mut text = Vec::new();
    romc::recording::write_to(&mut text, &recording, None, &options).expect("memory");
    let rows = text.iter().filter(|byte| **byte == b'\n').count();
    for (start, place) in [(&text[..], rows + 10_001), (&b"\n"[..], 10_001)] {
        let file = fs::File::create(&path).expect("a file");
        let mut packed = GzEncoder::new(file, Compression::fast());
        packed.write_all(start).expect("written");
        for _ in 0..50 {
            packed.write_all(&[b'\n'; 1 << 20]).expect("written");
        }
        packed.finish().expect("written");
        let error = fails(1, &["inspect", path.to_str().expect("UTF-8")]);
        let expected = format!("row {place}: found more than 10000 empty lines");
        assert!(error.contains(&expected), "{error}");
        // Read with a map of columns, or for making one, the text is the same.
        let log = path.to_str().expect("UTF-8");
        let map = "docs/maps/a1-raw.toml";
        for arguments in [
            ["inspect", "--guess", log].as_slice(),
            &["inspect", log, "--columns", map],
        ] {
            let error = fails(1, arguments);
            assert!(
                error.contains(&expected) || error.contains("joint_act.txt"),
                "{error}"
            );
        }
    }
}

#[test]
fn an_encoder_without_rank_is_named_where_invariance_is_asked_of_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut model = shipped("go1-d4");
    let weights = model["encoder"]["weights"].take();
    let identity: Vec<[f64; 4]> = (0..4)
        .map(|i| std::array::from_fn(|j| f64::from(i == j)))
        .collect();
    // Units that are never active at rest.
    model["encoder"] = serde_json::json!({ "layers": [
        { "weights": weights, "bias": [-1e3, -1e3, -1e3, -1e3], "activation": "relu" },
        { "weights": identity, "bias": [0, 0, 0, 0] },
    ] });
    model["schema"] = "romc-model/2".into();
    for part in ["landmarks", "prior"] {
        model.as_object_mut().expect("an object").remove(part);
    }
    let path = folder.path().join("model.json").display().to_string();
    fs::write(&path, model.to_string()).expect("written");
    let output = romc(&["inspect", &path, "--json"]);
    let note = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{note}");
    assert!(
        note.contains("known physics cannot be checked: Jacobian of the encoder"),
        "{note}"
    );
    let told: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert!(told["models"][0]["invariance"].is_null() || told["invariance"].is_null());
    // A latent-only model has no invariance; that is not an error.
    let output = romc(&["inspect", MODEL]);
    assert!(
        output.stderr.is_empty(),
        "{:?}",
        String::from_utf8_lossy(&output.stderr)
    );
}

/// A model in other units has the same rollouts: coordinates of a millionth, and of a million.
#[test]
fn rollouts_do_not_depend_on_the_scale_of_the_coordinates() {
    let folder = tempfile::tempdir().expect("a folder");
    let figures = |factor: f64| {
        let mut model = shipped("go1-d4");
        let scaled = |value: &Value, by: f64| -> Value {
            let row = value.as_array().expect("numbers").iter();
            row.map(|number| Value::from(by * number.as_f64().expect("a number")))
                .collect()
        };
        model["encoder"]["bias"] = scaled(&model["encoder"]["bias"], factor);
        model["decoder"]["bias"] = scaled(&model["decoder"]["bias"], factor);
        let state = model["scaling"]["state"].as_f64().expect("one factor");
        model["scaling"]["state"] = (factor * state).into();
        // The rows of Xi are 1, z, dz, u: only the first and last change with the unit.
        let d = 4;
        for phase in model["phases"].as_array_mut().expect("phases") {
            for (row, values) in phase["xi"]
                .as_array_mut()
                .expect("Xi")
                .iter_mut()
                .enumerate()
            {
                if row == 0 || row > 2 * d {
                    *values = scaled(values, factor);
                }
            }
        }
        let path = folder.path().join("scaled.json").display().to_string();
        fs::write(&path, model.to_string()).expect("written");
        let told: Value =
            serde_json::from_str(&done(&["simulate", &path, JUMP, "--json"])).expect("JSON");
        let mut numbers = Vec::new();
        collect(&told["rollouts"], &mut numbers);
        numbers
    };
    let plain = figures(1.0);
    assert!(plain.len() > 50, "{}", plain.len());
    for factor in [2.0_f64.powi(-20), 2.0_f64.powi(-60), 2.0_f64.powi(20)] {
        let scaled = figures(factor);
        assert_eq!(scaled.len(), plain.len());
        for (found, expected) in scaled.iter().zip(&plain) {
            // Quantities in scaled units change with the units.
            let same = (found - expected).abs() <= 1e-6 * expected.abs().max(1e-6);
            let in_units = (found - factor * expected).abs() <= 1e-6 * (factor * expected).abs();
            let squared = factor * factor * expected;
            let in_squares = (found - squared).abs() <= 1e-6 * squared.abs();
            assert!(
                same || in_units || in_squares,
                "{factor}: {found} {expected}"
            );
        }
    }
}

/// All numbers below a value.
fn collect(value: &Value, numbers: &mut Vec<f64>) {
    match value {
        Value::Number(number) => numbers.push(number.as_f64().expect("a number")),
        Value::Array(values) => values.iter().for_each(|value| collect(value, numbers)),
        // The combined loss adds a loss in scaled units and a dimensionless loss.
        Value::Object(entries) => (entries.iter())
            .filter(|(name, _)| *name != "combined_loss")
            .for_each(|(_, value)| collect(value, numbers)),
        Value::Null | Value::Bool(_) | Value::String(_) => {}
    }
}
