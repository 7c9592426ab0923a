//! The command line from outside: exit codes, JSON, complete files, errors with their place.

#[path = "cli/bounds.rs"]
mod bounds;
#[path = "cli/failed_runs.rs"]
mod failed_runs;
#[path = "cli/helps.rs"]
mod helps;
#[path = "cli/outputs.rs"]
mod outputs;
mod outside;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use romc::robot::WrenchFrame;
use serde_json::Value;

fn romc(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_romc"))
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .env_remove("COLUMNS") // helps are wrapped at this width
        .output()
        .expect("the binary runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("romc prints UTF-8")
}

/// Runs, expects success, returns stdout.
fn done(arguments: &[&str]) -> String {
    let output = romc(arguments);
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {stderr}");
    text(&output.stdout)
}

/// Runs with `--json`, expects exactly one object.
fn json(arguments: &[&str]) -> Value {
    let mut arguments = arguments.to_vec();
    arguments.push("--json");
    let value: Value =
        serde_json::from_str(&done(&arguments)).expect("one JSON value, nothing else");
    assert!(value.is_object());
    value
}

/// As [`json`], but a bad verdict on the model is allowed: the exit code is 0 or 1.
fn judged(arguments: &[&str]) -> Value {
    let output = romc(&[arguments, &["--json"]].concat());
    let code = output.status.code();
    assert!(
        matches!(code, Some(0 | 1)),
        "{arguments:?}: {}",
        text(&output.stderr)
    );
    serde_json::from_str(&text(&output.stdout)).expect("one JSON value, nothing else")
}

/// Runs, expects exit code 1 and nothing on stdout, returns stderr.
fn failed(arguments: &[&str]) -> String {
    ended_with(1, arguments)
}

/// As [`failed`], for invalid options: exit code 2.
fn refused(arguments: &[&str]) -> String {
    ended_with(2, arguments)
}

fn ended_with(code: i32, arguments: &[&str]) -> String {
    let output = romc(arguments);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}");
    assert_eq!(
        text(&output.stdout),
        "",
        "a failed run prints nothing to stdout"
    );
    let stderr = text(&output.stderr);
    assert!(stderr.starts_with("error: "), "{stderr}");
    assert!(!stderr.contains("panicked"), "{stderr}");
    stderr
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn path(folder: &tempfile::TempDir, name: &str) -> String {
    folder.path().join(name).display().to_string()
}

/// Every file below a folder, with its bytes.
fn contents(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            files.extend(contents(&path));
        } else {
            files.push((path.clone(), fs::read(&path).expect("readable")));
        }
    }
    files.sort();
    files
}

const MODEL: &str = "models/go1-d4.json";
const JUMP: &str = "examples/recordings/go1/test_01.csv.gz";

/// The commands that `romc --help` lists, `help` aside.
fn commands() -> Vec<String> {
    let help = done(&["--help"]);
    let listed = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let names = listed.map_while(|line| line.split_whitespace().next());
    let names: Vec<_> = names
        .filter(|name| *name != "help")
        .map(str::to_owned)
        .collect();
    assert!(names.len() >= 11, "{help}");
    names
}

#[test]
fn help_of_every_command_shows_an_example_that_starts_with_it() {
    for command in commands() {
        let help = done(&[command.as_str(), "--help"]);
        assert!(help.contains("--json"), "{command}");
        assert!(
            help.contains("Example") && help.contains(&format!("\n  romc {command}")),
            "{help}"
        );
    }
}

#[test]
fn wrong_usage_ends_with_two_and_runs_nothing() {
    let wrong: [&[&str]; 8] = [
        &[],
        &["polish"],
        &["compile", MODEL],
        &["compile", MODEL, "--emit", "fortran", "--out-dir", "x"],
        &["train", JUMP, "--output", "x.json"],
        &["train", JUMP, "--latent-dim", "0", "--output", "x.json"],
        &["simulate", MODEL, JUMP, "--restart-every", "-1"],
        &["mpc", MODEL, JUMP, "--horizon", "0"],
    ];
    for arguments in wrong {
        let output = romc(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert_eq!(text(&output.stdout), "");
    }
}

#[test]
fn demo_makes_equations_code_and_commands_and_tells_how_well_it_does() {
    let folder = folder();
    let out = path(&folder, "demo");
    let value = json(&["demo", "--out-dir", &out]);
    assert_eq!(value["self_test"], "passed");
    for run in value["mpc"]["transpose"].as_array().expect("three jumps") {
        assert_eq!(run["limit_violations"], 0);
        assert_eq!(run["failed"], 0);
        assert!(run["torque_r2"]["contact"].as_f64().expect("a number") > 0.75);
    }
    let whole = &value["rollouts"]["full"]["coordinates"];
    let learned = whole["body.z"]["rms"].as_f64().expect("a number");
    let aslip = value["rollouts"]["baselines"][0]["rms_m"]["full"]["body.z"]
        .as_f64()
        .expect("a number");
    assert!(learned < aslip, "{learned} against {aslip}");
    for name in [
        "go1_d4.tex",
        "go1_d4.c",
        "go1_d4.h",
        "go1_d4/src/lib.rs",
        "commands.csv",
        "report.html",
    ] {
        assert!(Path::new(&out).join(name).is_file(), "{name}");
    }
    let table = done(&["demo", "--out-dir", &out]);
    for part in [
        "ddz2 = -9.53 - 0.475 dz2 + 0.0769 u2",
        "(self-test passed)",
        "verdict: fit for 0.1 s, whole motion, torques, control",
    ] {
        assert!(table.contains(part), "{table}");
    }
    // With a short folder name the table fits a terminal.
    let shown = table.replace(&out, "out/demo");
    let widest = shown.lines().map(|line| line.chars().count()).max();
    assert!(shown.lines().count() <= 45 && widest <= Some(80), "{shown}");
}

#[test]
fn report_is_one_page_without_requests_and_its_figures_are_files() {
    let folder = folder();
    let (page, figures) = (path(&folder, "report.html"), path(&folder, "figures"));
    let value = json(&[
        "report",
        MODEL,
        JUMP,
        "--output",
        &page,
        "--figures",
        &figures,
        "--clock",
        "repaired",
    ]);
    let html = std::fs::read_to_string(&page).expect("a page");
    assert_eq!(value["bytes"], html.len());
    assert!(html.len() < 3_000_000);
    for elsewhere in ["src=", "url(", "@import", "http://", "https://"] {
        assert!(!html.contains(elsewhere), "{elsewhere}");
    }
    for part in [
        "<math",
        "ASLIP (fitted constants)",
        "Copy LaTeX",
        "romc simulate",
        "--clock repaired --restart-every",
        "body.y, body.roll and body.yaw are not modelled",
        "body.yaw, rad (not modelled)",
        "class=\"film\"",
    ] {
        assert!(html.contains(part), "{part}");
    }
    assert!(!html.contains("{\"path\""), "JSON in the page");
    let reasons = value["reasons"].to_string();
    assert!(
        reasons.contains("It was not used in training."),
        "{reasons}"
    );
    let uses = ["0.1 s", "whole motion", "torques", "control"];
    assert_eq!(value["verdict"]["fit_for"], serde_json::json!(uses));
    let first_screen = html.split("<h2 id=\"equations\"").next().expect("a part");
    let rows =
        first_screen.matches("<span class=\"light\" aria-hidden=\"true\">✓</span> passed</td>");
    assert_eq!(rows.count(), 4);
    assert!(
        !first_screen.contains("class=\"why\"></span>"),
        "a metric or baseline without words"
    );
    assert!(first_screen.contains("<figure id=\"overview\">"));
    let headline = value["headline"].as_str().expect("words");
    assert!(headline.starts_with("Fit for predictions over 0.1 s"));
    assert!(html.contains(headline), "{headline}");
    for id in [
        "overview",
        "encoder",
        "motion_1",
        "joints_1",
        "body_1",
        "aslip_1",
        "torques_1",
    ] {
        for kind in ["svg", "pdf", "csv"] {
            let file = Path::new(&figures).join(format!("{id}.{kind}"));
            assert!(file.is_file(), "{}", file.display());
        }
    }
}

#[test]
fn mpc_draws_each_recording_and_replaces_no_foreign_file_unless_forced() {
    let folder = folder();
    let figures = path(&folder, "figures");
    let arguments = ["mpc", MODEL, JUMP, "--figures", &figures];
    let value = json(&arguments);
    let names = [
        "torques_1",
        "latent_inputs_1",
        "latent_tracking_1",
        "solve_times_1",
    ];
    assert_eq!(value["figures"].as_array().map(Vec::len), Some(12));
    for name in names {
        for kind in ["svg", "pdf", "csv"] {
            let file = Path::new(&figures).join(format!("{name}.{kind}"));
            assert!(file.is_file(), "{}", file.display());
        }
    }
    let steps = value["runs"][0]["steps"].as_u64().expect("steps");
    let torques = std::fs::read_to_string(Path::new(&figures).join("torques_1.csv"));
    let torques = torques.expect("a table");
    let commanded = torques.lines().filter(|line| line.contains("commanded"));
    assert_eq!(commanded.count() as u64, 12 * steps);

    let other = path(&folder, "other");
    let foreign = Path::new(&other).join("torques_1.svg");
    std::fs::create_dir(&other).expect("a folder");
    std::fs::write(&foreign, "mine").expect("written");
    let arguments = ["mpc", MODEL, JUMP, "--figures", &other];
    assert_eq!(romc(&arguments).status.code(), Some(1));
    let kept = std::fs::read_to_string(&foreign).expect("still there");
    assert_eq!(kept, "mine");
    done(&["mpc", MODEL, JUMP, "--figures", &other, "--force"]);
}

#[test]
fn manual_has_a_page_for_every_command_and_completions_know_them() {
    let folder = folder();
    let out = path(&folder, "man");
    done(&["manual", "--out-dir", &out]);
    let script = done(&["completions", "bash"]);
    for command in ["train", "compile", "report", "mpc"] {
        let page = Path::new(&out).join(format!("romc-{command}.1"));
        let text = std::fs::read_to_string(page).expect("a page");
        assert!(text.contains(&format!("romc {command}")), "{command}");
        assert!(script.contains(command), "{command}");
    }
}

#[test]
fn compile_of_the_same_model_gives_the_same_bytes() {
    let folder = folder();
    let out = |name: &str| {
        let out = path(&folder, name);
        done(&[
            "compile",
            MODEL,
            "--emit",
            "latex,c,rust,markdown,mathml",
            "--out-dir",
            &out,
        ]);
        let strip = |(file, bytes): (PathBuf, Vec<u8>)| {
            let relative = file.strip_prefix(&out).expect("below").to_path_buf();
            (relative, bytes)
        };
        contents(Path::new(&out))
            .into_iter()
            .map(strip)
            .collect::<Vec<_>>()
    };
    let (first, second) = (out("first"), out("second"));
    assert!(first.len() > 10);
    assert_eq!(first, second);
}

#[test]
fn compile_prints_equations_with_the_names_and_digits_asked_for() {
    let folder = folder();
    let out = path(&folder, "out");
    let compile = |extra: &[&str]| {
        let mut arguments = vec![
            "compile",
            "models/paper-2d.json",
            "--emit",
            "latex",
            "--out-dir",
            &out,
        ];
        arguments.extend(extra);
        done(&arguments);
        fs::read_to_string(folder.path().join("out/paper_2d.tex")).expect("equations")
    };
    assert!(compile(&[]).contains(r"- 0.75\sin(\dot{z}_1) + 0.11u_1"));
    let renamed = compile(&["--rename", "z1=x", "--digits", "1"]);
    assert!(
        renamed.contains(r"\ddot{x} = 0.4 - 0.2\dot{x}"),
        "{renamed}"
    );
    assert!(compile(&["--siunitx"]).contains(r"\num{0.36}"));

    let error = refused(&[
        "compile",
        "models/paper-2d.json",
        "--emit",
        "latex",
        "--out-dir",
        &out,
        "--rename",
        r"z1=\input{x}",
    ]);
    assert!(error.contains("z1="), "{error}");
}

#[test]
fn compile_arranges_equations_as_asked() {
    let folder = folder();
    let arranged = |form: &str| {
        let out = path(&folder, form);
        done(&[
            "compile",
            "models/paper-2d.json",
            "--emit",
            "latex",
            "--form",
            form,
            "--out-dir",
            &out,
        ]);
        fs::read_to_string(folder.path().join(form).join("paper_2d.tex")).expect("equations")
    };
    let (align, cases) = (arranged("align"), arranged("cases"));
    assert!(align.contains("\\begin{align}") && !align.contains("\\left\\{"));
    assert!(!cases.contains("\\begin{align}"));
    assert_ne!(align, cases);
}

#[test]
fn compile_into_a_folder_with_a_foreign_file_is_refused_and_leaves_it() {
    let folder = folder();
    let out = path(&folder, "");
    let own = folder.path().join("paper_2d.c");
    fs::write(&own, "int mine;\n").expect("writable");
    let arguments = [
        "compile",
        "models/paper-2d.json",
        "--emit",
        "c",
        "--out-dir",
        &out,
    ];
    let error = failed(&arguments);
    assert!(
        error.contains("paper_2d.c") && error.contains("--force"),
        "{error}"
    );
    assert_eq!(
        contents(folder.path()),
        [(own.clone(), b"int mine;\n".to_vec())]
    );

    let mut forced = arguments.to_vec();
    forced.push("--force");
    done(&forced);
    assert!(
        fs::read_to_string(own)
            .expect("replaced")
            .contains("Generated by romc")
    );
}

#[test]
fn train_writes_a_model_that_compiles_and_refuses_to_replace_it() {
    let folder = folder();
    let model = path(&folder, "small.json");
    let jump =
        |set: &str, number: usize| format!("examples/recordings/go1/{set}_{number:02}.csv.gz");
    let (training, validation): (Vec<_>, Vec<_>) = (
        (1..=3).map(|number| jump("train", number)).collect(),
        (1..=2).map(|number| jump("validation", number)).collect(),
    );
    let mut arguments = vec!["train"];
    arguments.extend(training.iter().map(String::as_str));
    arguments.push("--validation");
    arguments.extend(validation.iter().map(String::as_str));
    arguments.extend(["--latent-dim", "2", "--output", &model]);
    let value = json(&arguments);
    assert_eq!(value["latent_dim"], 2);
    assert!(
        value["report"]["training"]["decoder_mse"]
            .as_f64()
            .expect("a number")
            < 1e-3
    );
    let written = fs::read(&model).expect("a model");
    assert!(
        text(&written).contains("romc train"),
        "the provenance has the command"
    );

    let error = failed(&arguments);
    assert!(
        error.contains("already exists") && error.contains("--force"),
        "{error}"
    );
    assert_eq!(fs::read(&model).expect("still there"), written);
    arguments.push("--force");
    done(&arguments);
    assert_eq!(
        fs::read(&model).expect("a model"),
        written,
        "training is deterministic"
    );
    done(&[
        "compile",
        &model,
        "--emit",
        "c",
        "--out-dir",
        &path(&folder, "out"),
    ]);
}

#[test]
fn train_takes_what_the_joints_take_off_the_torques_and_says_so() {
    let folder = folder();
    let losses = path(&folder, "losses.toml");
    let model = path(&folder, "net.json");
    // As `romc identify` writes it: other tables are ignored.
    let table =
        "gravity_m_s2 = 9.8\n[actuators]\nviscous = [1.0, 0.6, 0.6]\ndry = [0.2, 0.2, 0.2]\n";
    let whole = format!(
        "{table}armature = [{}]\n[standard_error]\ndry = 1\n",
        ["0.01"; 12].join(", ")
    );
    fs::write(&losses, whole).expect("written");
    let jump = "examples/recordings/go1/train_01.csv.gz";
    let train = [
        "train",
        jump,
        "--latent-dim",
        "2",
        "--actuators",
        &losses,
        "--output",
        &model,
        "--force",
    ];
    done(&train);
    let written = romc::artifact::read(Path::new(&model)).expect("a model");
    let actuators = written.actuators().expect("given");
    assert_eq!((actuators.viscous[3], actuators.armature[11]), (1.0, 0.01));
    assert_eq!(written.wrench_frame(), WrenchFrame::Ground);
    let command = written.provenance()["command"].to_string();
    assert!(
        command.contains(&format!("--actuators {losses} ")),
        "{command}"
    );
    assert!(command.contains("--wrench-frame ground"), "{command}");
    let told = json(&["inspect", &model])["files"][0].clone();
    assert_eq!(told["wrench_frame"], "ground");
    assert_eq!(told["actuators"]["viscous"][1], 0.6);
    let printed = done(&["inspect", &model]);
    assert!(
        printed.contains("world's axes") && printed.contains("viscous, N m s/rad"),
        "{printed}"
    );
    let published = "tests/fixtures/import/go1-d4.json";
    let published = json(&["inspect", published])["files"][0].clone();
    assert_eq!(
        (&published["wrench_frame"], &published["actuators"]),
        (&"body".into(), &Value::Null)
    );

    for (content, expected) in [
        (table.to_owned(), "missing field `armature`"),
        (
            format!("{table}armature = [0.1, 0.1]\n"),
            "found 2 numbers, expected 12, or 3 for hx, hy, kn",
        ),
        (
            format!("{table}armature = [0.1, -0.1, 0.1]\n"),
            "actuators.armature, joint fr.hy: found -0.1",
        ),
    ] {
        fs::write(&losses, content).expect("written");
        let error = failed(&train);
        assert!(
            error.contains("losses.toml") && error.contains(expected),
            "{error}"
        );
    }
    let error = refused(&["train", jump, "--wrench-frame", "hip", "--output", &model]);
    assert!(
        error.contains("found `hip`, expected `ground`, `world` or `body`"),
        "{error}"
    );
}

#[test]
fn refinement_refuses_what_the_model_decides_and_names_it() {
    let folder = folder();
    let output = path(&folder, "refined.json");
    let from = ["train", "--from", MODEL, JUMP, "--output", &output];
    for (flag, value) in [
        ("--latent-dim", "7"),
        ("--validation", JUMP),
        ("--slack", "0.1"),
    ] {
        let error = failed(&[&from[..], &[flag, value]].concat());
        assert!(error.contains(MODEL) && error.contains(flag), "{error}");
    }
    let error = failed(&[&from[..], &["--actuators", "identify"]].concat());
    assert!(error.contains("--actuators identify"), "{error}");
    assert!(!Path::new(&output).exists());
}

#[test]
fn train_takes_settings_from_a_file_and_flags_override_it() {
    let folder = folder();
    let (config, model) = (path(&folder, "train.toml"), path(&folder, "m.json"));
    let with = |settings: &str, more: &[&str]| {
        fs::write(&config, settings).expect("writable");
        let mut arguments = vec!["train", "examples/recordings/go1/train_01.csv.gz"];
        arguments.extend(["--config", &config, "--output", &model, "--force"]);
        arguments.extend(more);
        romc(&arguments)
    };
    let refused = |settings: &str| {
        let output = with(settings, &[]);
        assert_eq!(output.status.code(), Some(1), "{settings}");
        let stderr = text(&output.stderr);
        assert!(stderr.contains("train.toml"), "{stderr}");
        stderr
    };
    assert!(refused("latent-dim = 2\nmethd = \"joint\"\n").contains("`methd`"));
    assert!(refused("latent-dim = 0\n").contains("`latent-dim` is 0"));
    assert!(refused("seed = 3\n").contains("`latent-dim` is missing"));
    assert!(refused("latent-dim = \"two\"\n").contains("line 1"));

    let output = with(
        "latent-dim = 3\nslack = 0.3\nseeds = 2\n",
        &["--latent-dim", "2", "--json"],
    );
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let value: Value = serde_json::from_str(&text(&output.stdout)).expect("one JSON value");
    assert_eq!(value["latent_dim"], 2);
    assert_eq!(value["report"]["seeds"].as_array().map(Vec::len), Some(2));
    assert_eq!(value["report"]["support_overlap"], 1.0);
    let written = text(&fs::read(&model).expect("a model"));
    assert!(
        written.contains("--latent-dim 2") && written.contains("--slack 0.3"),
        "{written}"
    );
}

#[test]
fn train_divides_jumps_by_shares_and_tells_figures_of_the_test_jumps() {
    let folder = folder();
    let model = path(&folder, "split.json");
    let jumps: Vec<String> = (1..=5)
        .map(|number| format!("examples/recordings/go1/train_{number:02}.csv.gz"))
        .collect();
    let mut arguments = vec!["train"];
    arguments.extend(jumps.iter().map(String::as_str));
    arguments.extend(["--latent-dim", "2", "--output", &model, "--split", "3,1,1"]);
    let value = json(&arguments);
    let mut files = Vec::new();
    for (set, expected) in [("training", 3), ("validation", 1), ("test", 1)] {
        let places = value["split"][set].as_array().expect("a list");
        assert_eq!(places.len(), expected, "{set}");
        files.extend(places.iter().map(|place| place["file"].to_string()));
    }
    files.sort();
    files.dedup();
    assert_eq!(files.len(), 5, "every jump is in one set");
    let error = |set: &Value| set["decoder_mse"].as_f64().expect("a number");
    let (tested, trained) = (error(&value["test"]), error(&value["report"]["training"]));
    assert!(
        tested > 0.0 && tested < 1e-3 && tested != trained,
        "{tested}"
    );
    let written = text(&fs::read(&model).expect("a model"));
    assert!(written.contains("--split 3,1,1"), "{written}");

    arguments.extend(["--validation", &jumps[0]]);
    assert_eq!(romc(&arguments).status.code(), Some(2));
}

#[test]
fn train_tells_implausible_samples_and_leaves_them_out_only_when_asked() {
    let folder = folder();
    let (model, spoilt) = (path(&folder, "m.json"), path(&folder, "spoilt.csv"));
    let mut recording = romc::recording::read("examples/recordings/go1/train_01.csv.gz".as_ref())
        .expect("a shipped recording");
    let last = recording.segments[0].len() - 10;
    recording.segments[0].torque_nm[(4, last)] = 900.0;
    recording.path = PathBuf::from(&spoilt);
    romc::recording::write(Path::new(&spoilt), &recording).expect("writable");
    let with = |more: &[&str]| {
        let mut arguments = vec!["train", &spoilt, "examples/recordings/go1/train_02.csv.gz"];
        arguments.extend(["--latent-dim", "2", "--output", &model, "--force", "--json"]);
        arguments.extend(more);
        let output = romc(&arguments);
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{stderr}");
        let value: Value = serde_json::from_str(&text(&output.stdout)).expect("one JSON value");
        (value, stderr)
    };
    let (kept, stderr) = with(&[]);
    assert!(
        stderr.contains("spoilt.csv: 1 implausible") && stderr.contains("fl.hy Torque"),
        "{stderr}"
    );
    assert!(stderr.contains("--leave-out-implausible"), "{stderr}");
    let finding = &kept["recordings"]["implausible"][0];
    assert_eq!(finding["first_row"], last + 2);
    assert_eq!(finding["value"], 900.0);
    assert_eq!(kept["recordings"]["left_out"], 0);

    let (clean, stderr) = with(&["--leave-out-implausible"]);
    // The sample and the nine after it are left out: they are too few to learn from.
    assert_eq!(clean["recordings"]["left_out"], 10);
    assert!(stderr.contains("10 samples are left out"), "{stderr}");
    let torque_r2 = |value: &Value| value["report"]["training"]["torque_r2"].as_f64();
    assert!(torque_r2(&clean) > torque_r2(&kept), "{clean}");
    let written = text(&fs::read(&model).expect("a model"));
    assert!(written.contains("--leave-out-implausible"), "{written}");
}

#[test]
fn train_with_squares_finds_a_model_though_full_libraries_diverge() {
    let folder = folder();
    let model = path(&folder, "squares.json");
    let jumps = |set: &str, count: usize| -> Vec<String> {
        (1..=count)
            .map(|number| format!("examples/recordings/go1/{set}_{number:02}.csv.gz"))
            .collect()
    };
    let (training, validation) = (jumps("train", 14), jumps("validation", 3));
    let figures = |degree: &str| {
        let mut arguments = vec!["train"];
        arguments.extend(training.iter().map(String::as_str));
        arguments.push("--validation");
        arguments.extend(validation.iter().map(String::as_str));
        arguments.extend(["--latent-dim", "4", "--output", &model, "--force"]);
        arguments.extend(["--degree", degree]);
        json(&arguments)["report"].clone()
    };
    let (affine, squares) = (figures("1"), figures("2"));
    let written: Value = serde_json::from_slice(&fs::read(&model).expect("a model")).expect("JSON");
    assert_eq!(written["library"]["degree"], 2);
    let score = |report: &Value| report["choice"]["score"].as_f64().expect("finite");
    assert!(score(&squares) < score(&affine), "{squares}");
    for set in ["training", "validation"] {
        assert!(squares[set]["rollout_x_m"].as_f64().is_some(), "{squares}");
    }
}

#[test]
fn train_switches_of_the_defaults_do_what_they_say() {
    let folder = folder();
    let (config, model) = (path(&folder, "train.toml"), path(&folder, "m.json"));
    let with = |settings: &str, more: &[&str]| {
        fs::write(&config, settings).expect("writable");
        let mut arguments = vec!["train", "examples/recordings/go1/train_01.csv.gz"];
        arguments.extend(["--latent-dim", "2", "--config", &config]);
        arguments.extend(["--output", &model, "--force"]);
        arguments.extend(more);
        let output = romc(&arguments);
        (output.status.code(), text(&output.stderr))
    };
    let written = || -> Value {
        serde_json::from_slice(&fs::read(&model).expect("a model")).expect("one JSON value")
    };
    let encoded = || {
        let model = written();
        let names = model["provenance"]["report"]["encoded"].clone();
        names.as_array().expect("a list").len()
    };
    assert_eq!(with("", &[]).0, Some(0));
    assert!(encoded() < 18, "coordinates that hardly move are masked");
    let settings = "smooth = \"11,2\"\nmask-std = 0\nforce-scaling = 0.01\n";
    let (code, stderr) = with(settings, &["--no-rotation", "--smooth-rows", "all"]);
    assert_eq!(code, Some(0), "{stderr}");
    assert_eq!(encoded(), 18);
    let model = written();
    assert_eq!(model["scaling"]["input"][12], 0.01);
    assert_eq!(model["scaling"]["input"][0], 0.1);
    assert_eq!(model["provenance"]["encoder_options"]["rotate"], false);
    let command = model["provenance"]["command"].to_string();
    for part in [
        "--smooth 11,2",
        "--smooth-rows all",
        "--mask-std 0",
        "--no-rotation",
    ] {
        assert!(command.contains(part), "{part}: {command}");
    }

    for (settings, more, code, named) in [
        ("", &["--smooth", "10,2"][..], 2, "odd window"),
        ("", &["--smooth-rows", "all"], 2, "--smooth"),
        ("", &["--force-scaling", "0"], 2, "force-scaling"),
        ("smooth = \"11\"\n", &[], 1, "11,2"),
        ("moving-average = 0\n", &[], 1, "moving-average"),
        ("", &["--split", "1"], 2, "14,3,3"),
        ("", &["--split", "1,1"], 1, "cannot be divided"),
    ] {
        let (found, stderr) = with(settings, more);
        assert_eq!(found, Some(code), "{settings} {more:?}: {stderr}");
        assert!(stderr.contains(named), "{stderr}");
    }
}

#[test]
fn trained_networks_go_through_every_command() {
    let folder = folder();
    let (config, model) = (path(&folder, "train.toml"), path(&folder, "curved.json"));
    let (jump, test) = (
        "examples/recordings/go1/train_01.csv.gz",
        "examples/recordings/go1/test_01.csv.gz",
    );
    fs::write(&config, "latent-dim = 2\nencoder-layers = [8, 6]\n").expect("writable");
    let with = |more: &[&str]| {
        let mut arguments = vec!["train", jump, "--config", &config, "--output", &model];
        arguments.extend(["--force", "--epochs", "5", "--seeds", "1"]);
        arguments.extend(more);
        romc(&arguments)
    };
    let output = with(&["--decoder-layers", "linear", "--activation", "tanh"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let inspected = json(&["inspect", &model]).to_string();
    assert!(
        inspected.contains("18 -> 8 tanh -> 6 tanh -> 2"),
        "{inspected}"
    );
    assert!(inspected.contains("--method joint") && inspected.contains("--encoder-layers 8,6"));
    assert!(inspected.contains("--decoder-layers linear"), "{inspected}");
    judged(&["simulate", &model, test]);
    done(&[
        "compile",
        &model,
        "--emit",
        "c,rust,latex",
        "--out-dir",
        &path(&folder, "out"),
    ]);
    let figures = judged(&["mpc", &model, test]);
    assert_eq!(figures["runs"][0]["limit_violations"], 0, "{figures}");
    judged(&[
        "report",
        &model,
        test,
        "--output",
        &path(&folder, "report.html"),
    ]);

    for (more, named) in [
        (&["--method", "closed-form"][..], "--method joint"),
        (&["--encoder-layers", "8,1"], "encoder-layers"),
        (
            &["--encoder-layers", "linear", "--activation", "elu"],
            "activation",
        ),
        (&["--decoder-layers", "8;6"], "32,16"),
    ] {
        let output = with(more);
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{stderr}");
        assert!(stderr.contains(named), "{stderr}");
    }
}

#[test]
fn study_means_over_seeds_and_counts_refusals() {
    let folder = folder();
    let (part, whole) = (path(&folder, "part"), path(&folder, "whole"));
    fs::create_dir(&part).expect("a new folder");
    let write = |name: &str, value: Value| {
        fs::write(Path::new(&part).join(name), value.to_string()).expect("written");
    };
    write(
        "study.json",
        serde_json::json!({
            "latent_dims": [2], "seeds": 3, "method": "closed-form", "settings": "",
            "recordings": [], "training": 0, "romc": "0",
        }),
    );
    let trained = |decoder_mse: f64, active: usize| {
        serde_json::json!({ "trained": {
            "decoder_mse": decoder_mse, "active": active, "active_all_phases": active,
            "torque_r2": 0.5, "prediction_x_m": 0.01, "prediction_z_m": 0.02,
        } })
    };
    let refused = serde_json::json!({ "refused": "no \"stable\" model" });
    let outcomes = [trained(1.0, 10), trained(3.0, 20), refused];
    for (seed, outcome) in (1..).zip(outcomes) {
        let id = serde_json::json!({ "latent_dim": 2, "seed": seed });
        let cell = serde_json::json!({ "id": id, "outcome": outcome });
        write(&format!("cell-d02-s0{seed}.json"), cell);
    }
    let merge = ["study", "--merge", &part, "--out-dir", &whole];
    let found = json(&[&merge[..], &["--lambda", "0.5"]].concat());
    let row = &found["summary"]["dimensions"][0];
    assert_eq!((&row["trained"], &row["refused"]), (&2.into(), &1.into()));
    let number = |value: &Value| value.as_f64().expect("a number");
    let spread = &row["decoder_mse"];
    assert_eq!(number(&spread["mean"]), 2.0);
    assert_eq!(number(&spread["std"]), 2.0_f64.sqrt());
    let expected = (2.0 + 10.0_f64.ln() + 6.0 + 20.0_f64.ln()) / 2.0;
    assert!((number(&row["combined_loss"]["mean"]) - expected).abs() < 1e-12);
    let table = fs::read_to_string(Path::new(&whole).join("cells.csv")).expect("a table");
    assert_eq!(table.lines().count(), 4);
    assert!(table.contains("\"no \"\"stable\"\" model\""), "{table}");
    let mut commas = table.lines().map(|line| line.matches(',').count());
    assert!(commas.all(|commas| commas == 9), "{table}");
}

#[test]
fn study_in_parts_and_resumed_equals_the_whole() {
    let folder = folder();
    let out = |name: &str| path(&folder, name);
    let run = |extra: &[&str], out: &str| {
        let jump = |number| format!("examples/recordings/go1/train_{number:02}.csv.gz");
        let jumps: Vec<String> = (1..=3).map(jump).collect();
        let mut arguments = vec!["study"];
        arguments.extend(jumps.iter().map(String::as_str));
        arguments.extend(["--latent-dims", "1..2", "--seeds", "2", "--out-dir", out]);
        arguments.extend(extra);
        romc(&arguments)
    };
    let ok =
        |output: &Output| assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let (whole, first, second) = (out("whole"), out("first"), out("second"));
    ok(&run(&[], &whole));
    let expected = contents(Path::new(&whole));
    assert_eq!(
        expected.len(),
        4 + 4 + 6,
        "four models, the plan, two tables, the list of files, two figures in three forms"
    );

    let part = run(&["--shard", "1/2"], &first);
    ok(&part);
    assert!(text(&part.stdout).contains("not trained yet: d = 1 seed 2; d = 2 seed 2"));
    ok(&run(&["--shard", "2/2"], &second));
    let joined = out("joined");
    done(&["study", "--merge", &first, &second, "--out-dir", &joined]);
    let relative = |files: Vec<(PathBuf, Vec<u8>)>| -> Vec<(PathBuf, Vec<u8>)> {
        let name = |path: PathBuf| PathBuf::from(path.file_name().expect("a file"));
        files
            .into_iter()
            .map(|(path, bytes)| (name(path), bytes))
            .collect()
    };
    assert_eq!(
        relative(contents(Path::new(&joined))),
        relative(expected.clone())
    );

    ok(&run(&[], &first));
    assert_eq!(
        relative(contents(Path::new(&first))),
        relative(expected),
        "resumed"
    );
    let cell = Path::new(&second).join("cell-d01-s01.json");
    fs::write(
        &cell,
        r#"{"id":{"latent_dim":1,"seed":1},"outcome":{"refused":"x"}}"#,
    )
    .unwrap();
    let error = failed(&[
        "study",
        "--merge",
        &first,
        &second,
        "--out-dir",
        &out("both"),
    ]);
    assert!(
        error.contains("are the same training with different results"),
        "{error}"
    );
    for shard in ["0/3", "4/3", "3", "a/b", "1/0", "-1/2"] {
        assert_eq!(
            run(&["--shard", shard], &out("other")).status.code(),
            Some(2),
            "{shard}"
        );
    }
    let many = romc(&["study", "a.csv", "--latent-dims", "1", "--seeds", "10001"]);
    assert_eq!(many.status.code(), Some(2));
    let other = run(&["--method", "joint"], &first);
    assert_eq!(other.status.code(), Some(1));
    assert!(text(&other.stderr).contains("another study (the methods differ)"));
    for wrong in ["0..3", "4..19", "x", "3..2"] {
        assert_eq!(
            romc(&["study", "a.csv", "--latent-dims", wrong])
                .status
                .code(),
            Some(2)
        );
    }
}

#[test]
fn the_command_in_the_provenance_quotes_paths_that_a_shell_would_divide() {
    let folder = folder();
    let (jump, model) = (path(&folder, "a jump.csv.gz"), path(&folder, "m.json"));
    fs::copy("examples/recordings/go1/train_01.csv.gz", &jump).expect("copied");
    done(&[
        "train",
        &jump,
        "--latent-dim",
        "2",
        "--refinements",
        "0",
        "--terms",
        "1;z1;z2;dz1;dz2;u1;u2",
        "--name",
        "two by two",
        "--output",
        &model,
    ]);
    let written = romc::artifact::read(Path::new(&model)).expect("a model");
    let command = written.provenance()["command"].as_str().expect("a command");
    let wanted = format!("romc train '{jump}' --latent-dim 2");
    assert!(command.starts_with(&wanted), "{command}");
    for flag in [" --terms '1;z1;z2;dz1;dz2;u1;u2' ", " --name 'two by two' "] {
        assert!(command.contains(flag), "{command}");
    }
}

#[test]
fn shipped_models_come_from_the_command_in_their_provenance() {
    let folder = folder();
    for name in ["go1-d2", "go1-d4", "go1-d6", "go2-async-d4"] {
        let shipped = format!("models/{name}.json");
        let again = path(&folder, &format!("{name}.json"));
        let model = romc::artifact::read(Path::new(&shipped)).expect("a model");
        let command = model.provenance()["command"].as_str().expect("a command");
        let written = format!(" --output {shipped}");
        let command = command.strip_suffix(&written).expect("the file it made");
        let mut arguments: Vec<&str> = command.split(' ').skip(1).collect();
        arguments.extend(["--output", &again]);
        done(&arguments);
        let [shipped, again] =
            [&shipped, &again].map(|path| romc::artifact::read(Path::new(path)).expect("a model"));
        let weights = |model: &romc::model::ReducedModel| {
            model.encoder().expect("an encoder").weights().clone()
        };
        assert!((weights(&shipped) - weights(&again)).amax() < 1e-6);
        for (shipped, again) in shipped.phases().iter().zip(again.phases()) {
            let scale = shipped.xi.amax();
            assert!(
                (&shipped.xi - &again.xi).amax() < 1e-6 * scale,
                "{}",
                shipped.name
            );
            assert_eq!(shipped.active_count(), again.active_count());
        }
    }
}

#[test]
fn named_coordinates_are_refused_where_they_are_not_learned_and_need_no_joint() {
    let folder = folder();
    let model = path(&folder, "m.json");
    let train = |d: &str, more: &[&str]| {
        let mut arguments = vec![
            "train",
            JUMP,
            "--latent-dim",
            d,
            "--output",
            &model,
            "--force",
        ];
        arguments.extend(more);
        romc(&arguments)
    };
    let named = ["--coordinates", "named"];
    for more in [
        &["--encoder-layers", "8"][..],
        &["--paper", "--method", "joint"],
    ] {
        let refused = train("2", &[&named, more].concat());
        assert_eq!(refused.status.code(), Some(2));
        let error = text(&refused.stderr);
        assert!(
            error.contains("coordinates") && error.contains("named with"),
            "{error}"
        );
    }
    // only the body counts as moving
    let body = ["--mask-std", "10", "--mask-input-share", "1"];
    let trained = train("2", &body);
    assert!(trained.status.success(), "{}", text(&trained.stderr));
    let refused = train("3", &body);
    assert_eq!(refused.status.code(), Some(1));
    assert!(text(&refused.stderr).contains("expected 1 to 2"));
}

#[test]
fn simulate_writes_one_row_a_sample_without_nan() {
    let folder = folder();
    let table = path(&folder, "trajectories.csv");
    let value = json(&["simulate", MODEL, JUMP, "--output", &table]);
    assert_eq!(value["rollouts"]["segments"], 1);
    assert_eq!(value["rollouts"]["full"]["diverged"], 0);
    assert!(value["horizons"].is_null());
    let value = json(&["simulate", MODEL, JUMP, "--verbose"]);
    let flights = &value["horizons"][3];
    assert_eq!(
        (&flights["rollouts"], &flights["diverged"]),
        (&1.into(), &0.into())
    );
    let pitch = &flights["coordinates"]["body.pitch"];
    assert!(
        pitch["rms"].as_f64() > pitch["constant_velocity"].as_f64(),
        "{pitch}"
    );
    let long = romc(&["simulate", MODEL, JUMP, "--verbose"]);
    let long = text(&long.stdout);
    let second_block = long.lines().skip_while(|line| !line.contains("worse than"));
    let worse = (second_block.clone()).find(|line| line.contains("constant velocity, at rest"));
    assert!(worse.is_some(), "{long}");
    assert!(long.starts_with("z1  centre of mass forwards"), "{long}");
    assert!(
        long.lines().all(|line| line.chars().count() <= 100),
        "{long}"
    );
    let rows = fs::read_to_string(&table).expect("a table");
    let recording = romc::recording::read(Path::new(JUMP)).expect("a recording");
    assert_eq!(rows.lines().count(), 1 + recording.sample_count());
    assert!(!rows.contains("NaN") && !rows.contains("inf"));
    assert!(failed(&["simulate", MODEL, JUMP, "--output", &table]).contains("already exists"));
    let nowhere = path(&folder, "no/folder/table.csv");
    let error = failed(&["simulate", MODEL, JUMP, "--output", &nowhere]);
    assert!(error.contains("no folder"), "{error}");
}

#[test]
fn simulate_of_a_latent_only_model_says_what_is_missing() {
    let error = failed(&["simulate", "models/paper-2d.json", JUMP]);
    assert!(
        error.contains("paper-2d") && error.contains("decoder"),
        "{error}"
    );
}

#[test]
fn mpc_commands_stay_inside_the_torque_limits() {
    let folder = folder();
    let table = path(&folder, "commands.csv");
    for (lift, reference) in [("transpose", "recorded"), ("consistent", "none")] {
        let value = json(&[
            "mpc",
            MODEL,
            JUMP,
            "--lift",
            lift,
            "--reference-input",
            reference,
            "--output",
            &table,
            "--force",
        ]);
        assert_eq!(value["runs"][0]["limit_violations"], 0);
        let steps = value["runs"][0]["steps"].as_u64().expect("a count") as usize;
        let rows = fs::read_to_string(&table).expect("a table");
        let header: Vec<&str> = rows.lines().next().expect("a header").split(',').collect();
        let torque = |name: &str| {
            header
                .iter()
                .position(|column| *column == format!("{name} torque"))
        };
        let robot = romc::robot_file::by_name("go1").expect("known");
        let columns: Vec<usize> = romc::robot::Robot::input_names()[..12]
            .iter()
            .map(|name| torque(name).expect("a column a joint"))
            .collect();
        assert_eq!(rows.lines().count(), 1 + steps);
        for row in rows.lines().skip(1) {
            let cells: Vec<&str> = row.split(',').collect();
            for (column, limit) in columns.iter().zip(robot.torque_limit_nm()) {
                let torque: f64 = cells[*column].parse().expect("a number");
                assert!(torque.abs() <= *limit, "{torque} N m beyond {limit} N m");
            }
        }
    }
}

#[test]
fn mpc_limits_how_fast_torques_change_with_either_solver() {
    let folder = folder();
    let largest_change = |more: &[&str]| {
        let table = path(&folder, "commands.csv");
        // With a tight limit on torque rates the controller cannot bring a pushed body back.
        judged(&[&["mpc", MODEL, JUMP, "--output", &table, "--force"], more].concat());
        let rows = fs::read_to_string(&table).expect("a table");
        let header: Vec<&str> = rows.lines().next().expect("a header").split(',').collect();
        let names = &romc::robot::Robot::input_names()[..12];
        let is_lifted = |column: &usize| names.iter().any(|name| *name == header[*column]);
        let columns: Vec<usize> = (0..header.len()).filter(is_lifted).collect();
        assert_eq!(columns.len(), 12);
        let torques: Vec<Vec<f64>> = (rows.lines().skip(1))
            .map(|row| {
                let cells: Vec<&str> = row.split(',').collect();
                let torque = |column: &usize| cells[*column].parse().expect("a number");
                columns.iter().map(torque).collect()
            })
            .collect();
        let changes = torques.windows(2).flat_map(|pair| {
            let pairs = pair[0].iter().zip(&pair[1]);
            pairs.map(|(a, b)| (b - a).abs()).collect::<Vec<_>>()
        });
        changes.fold(0.0, f64::max)
    };
    let free = largest_change(&[]);
    assert!(free > 4.0, "{free} N m in 10 ms");
    for solver in ["clarabel", "riccati"] {
        let limited = largest_change(&["--torque-rate", "100", "--solver", solver]);
        // Rows that others imply to within 2 % are omitted.
        assert!(limited < 1.03, "{solver}: {limited} N m in 10 ms");
    }
}

#[test]
fn inspect_tells_findings_of_a_recording_and_parts_of_a_model() {
    let value = json(&["inspect", MODEL, JUMP]);
    assert_eq!(value["files"][0]["latent_dim"], 4);
    let dominant = &value["files"][0]["dominant_coordinates"][0][0][0];
    assert_eq!(dominant, "body.x");
    assert_eq!(
        value["files"][1]["implausible"]
            .as_array()
            .expect("a list")
            .len(),
        0
    );
    let phases = value["files"][1]["segments"][0]["phases"]
        .as_array()
        .expect("a list");
    assert_eq!(phases.len(), 3, "launch, flight, landing");
    assert!(done(&["inspect", MODEL]).contains("\n  ddz1 = -0.596 dz1 - 0.581 dz2 + 0.0766 u1\n"));
}

#[test]
fn a_learned_coordinate_is_named_by_its_largest_weight_and_by_the_others_in_it() {
    let folder = folder();
    let shipped = fs::read_to_string(MODEL).expect("a shipped model");
    let mut model: Value = serde_json::from_str(&shipped).expect("JSON");
    let (front, rear, x, pitch) = ([2, 5], [8, 11], 12, 16);
    let rows = [
        vec![(x, 0.5)],
        vec![(x, 0.5), (pitch, 0.4)],
        vec![(front[0], 0.2), (front[1], 0.2), (pitch, 0.7)],
        vec![(front[0], 0.1), (rear[0], 0.2), (rear[1], 0.2), (x, 0.1)],
    ];
    for (row, weights) in rows.iter().enumerate() {
        let mut of_row = [0.0; 18];
        weights.iter().for_each(|(i, weight)| of_row[*i] = *weight);
        model["encoder"]["weights"][row] = serde_json::json!(of_row);
    }
    let changed = path(&folder, "changed.json");
    fs::write(&changed, model.to_string()).expect("writable");
    let words = json(&["inspect", &changed])["files"][0]["latent_coordinates"].clone();
    let expected = [
        "body x, times a constant",
        "mainly body x, with other coordinates of the body",
        "mainly pitch, with joints and other coordinates of the body",
        "mainly rear knees, with other joints and the body",
    ];
    assert_eq!(words, serde_json::json!(expected));
}

#[test]
fn inspect_says_what_each_latent_coordinate_is() {
    let words = |model: &str| json(&["inspect", model])["files"][0]["latent_coordinates"].clone();
    let whole = [
        "centre of mass forwards, in 10 m",
        "centre of mass upwards, in 10 m",
        "rotation about the centre of mass, pitch, in 10 rad",
        "front feet forwards from the centre of mass, in 10 m",
        "front feet upwards from the centre of mass, in 10 m",
        "rear feet forwards from the centre of mass, in 10 m",
        "rear feet upwards from the centre of mass, in 10 m",
    ];
    assert_eq!(words("models/go1-d7.json"), serde_json::json!(whole));
    let joints = &words("models/go1-d6.json")[3];
    assert_eq!(joints, "joints of the rear legs, in 10 rad");
    assert!(words("models/paper-2d.json").is_null());
    let printed = done(&["inspect", "models/go1-d7.json"]);
    assert!(
        (whole.iter())
            .all(|words| printed
                .contains(words.trim_end_matches(|c| c != ',').trim_end_matches(','))),
        "{printed}"
    );
}

#[test]
fn inspect_of_an_unknown_robot_lists_the_known_ones() {
    let error = refused(&["inspect", JUMP, "--robot", "go9"]);
    assert!(error.contains("go9") && error.contains("go1"), "{error}");
}

#[test]
fn bad_recordings_end_with_one_and_name_file_row_and_column() {
    let folder = folder();
    let missing = path(&folder, "missing.csv");
    let error = failed(&["simulate", MODEL, &missing]);
    assert!(error.contains("missing.csv"), "{error}");

    let header: Vec<String> = romc::recording::Column::all(true, true)
        .iter()
        .map(|column| column.name())
        .collect();
    let zeros = vec!["0"; header.len()].join(";");
    let mut bad = zeros.replacen('0', "zero", 1);
    bad = format!("{}\n{zeros}\n{bad}\n", header.join(";"));
    let file = folder.path().join("text.csv");
    fs::write(&file, &bad).expect("writable");
    let error = failed(&["mpc", MODEL, &file.display().to_string()]);
    assert!(
        error.contains("text.csv") && error.contains("row 3") && error.contains("Time"),
        "{error}"
    );

    fs::write(&file, "").expect("writable");
    let error = failed(&["inspect", &file.display().to_string()]);
    assert!(
        error.contains("text.csv") && error.contains("empty"),
        "{error}"
    );
}

#[test]
fn bad_models_end_with_one_and_name_tensor_and_expectation() {
    let folder = folder();
    let file = folder.path().join("bad.json");
    let name = file.display().to_string();
    let good = fs::read_to_string("models/paper-2d.json").expect("shipped");
    let cases = [
        (good.replace("romc-model/1", "romc-model/9"), "romc-model/9"),
        (
            good.replacen("\"latent_dim\": 2", "\"latent_dim\": 3", 1),
            "xi",
        ),
        (good.replacen("paper-2d", "while", 1), "while"),
        (
            good.replacen("\"contact\"", "\"x; system(\\\"x\\\")\"", 1),
            "system",
        ),
        (good.replacen("\"contact\"", "\"\\\\input{x}\"", 1), "input"),
        ("{".to_owned(), "bad.json"),
    ];
    for (model, named) in cases {
        assert_ne!(model, good, "{named}: the case changes the model");
        fs::write(&file, model).expect("writable");
        let out = path(&folder, "out");
        let error = failed(&["compile", &name, "--out-dir", &out]);
        assert!(
            error.contains("bad.json") && error.contains(named),
            "{named}: {error}"
        );
        assert!(!Path::new(&out).exists(), "nothing is written");
    }
}

#[test]
fn hardware_jump_trains_simulates_and_gives_torques_inside_the_limits() {
    let Some(recording) = outside::hardware_jump() else {
        return;
    };
    let recording = recording.to_str().expect("a path of characters");
    let folder = folder();
    let model = path(&folder, "hardware.json");
    done(&["train", recording, "--latent-dim", "4", "--output", &model]);
    for model in [MODEL, &model] {
        let value = judged(&["simulate", model, recording]);
        assert_eq!(value["rollouts"]["restarted"]["diverged"], 0);
        let value = judged(&["mpc", model, recording]);
        let run = &value["runs"][0];
        assert_eq!(run["limit_violations"], 0);
        assert!(
            run["torque_r2"]["contact"]
                .as_f64()
                .expect("a number")
                .is_finite()
        );
        assert!(run["torque_rms_nm"].as_f64().expect("a number") > 0.0);
    }
}

#[test]
fn compile_within_zero_tolerance_emits_the_same_bytes() {
    let folder = folder();
    let (plain, zero) = (path(&folder, "plain"), path(&folder, "zero"));
    let targets = "latex,c,rust,markdown,mathml,python,casadi,matlab,controller";
    let emit = ["compile", MODEL, "--emit", targets];
    done(&[&emit[..], &["--out-dir", &plain]].concat());
    let tolerance = ["--tolerance", "0", "--domain", JUMP];
    done(&[&emit[..], &["--out-dir", &zero], &tolerance[..]].concat());
    let relative = |root: &str| -> Vec<(PathBuf, Vec<u8>)> {
        let certificate = Path::new("go1_d4-simplification.md");
        (contents(Path::new(root)).into_iter())
            .map(|(file, bytes)| (file.strip_prefix(root).expect("below").to_owned(), bytes))
            .filter(|(file, _)| file != certificate && file != Path::new(".romc-emitted"))
            .collect()
    };
    assert_eq!(relative(&plain), relative(&zero));
    let certificate = fs::read_to_string(Path::new(&zero).join("go1_d4-simplification.md"));
    let certificate = certificate.expect("the certificate is written");
    assert!(certificate.contains("- changes: 0\n"), "{certificate}");
    // default printing rounds, and the certificate bounds the effect
    assert!(
        certificate.contains("## Error due to rounded printing"),
        "{certificate}"
    );
}

#[test]
fn compile_within_a_tolerance_tells_each_change_and_saves_the_simplified_model() {
    let folder = folder();
    let (out, saved) = (path(&folder, "out"), path(&folder, "short.json"));
    let value = json(&[
        "compile",
        "models/go1-d6.json",
        "--emit",
        "latex,c",
        "--out-dir",
        &out,
        "--tolerance",
        "50%",
        "--domain",
        JUMP,
        "--save-model",
        &saved,
    ]);
    let simplification = &value["simplification"];
    let (mut dropped, mut rounded) = (0, 0);
    for phase in simplification["phases"].as_array().expect("phases") {
        for equation in phase["equations"].as_array().expect("equations") {
            let number = |value: &Value| value.as_f64().expect("a number");
            let bound = &equation["bound"];
            let magnitude = number(&bound[0]).abs().max(number(&bound[1]).abs());
            assert!(magnitude <= number(&equation["allowed"]));
            assert!(number(&equation["measured"]["max"]) <= magnitude * (1.0 + 1e-9) + 1e-12);
            for change in equation["changes"].as_array().expect("changes") {
                dropped += usize::from(change["kind"] != "rounded");
                rounded += usize::from(change["kind"] == "rounded");
            }
        }
    }
    assert!(dropped > 0 && rounded > 20, "{dropped} {rounded}");
    assert!(simplification["rollouts"]["rms_after"]["body.z"]["restarted"].is_number());
    let page =
        fs::read_to_string(Path::new(&out).join("go1_d6-simplification.md")).expect("written");
    assert!(
        page.contains("| contact, ddz1 |") && page.contains("rounded to"),
        "{page}"
    );
    let header = fs::read_to_string(Path::new(&out).join("go1_d6.h")).expect("written");
    assert!(header.contains("/* Simplified within 50% of"), "{header}");
    // the saved model is an ordinary one, and contains its origin
    let model: Value =
        serde_json::from_str(&fs::read_to_string(&saved).expect("written")).expect("JSON");
    let flight = &model["phases"][1];
    assert_eq!(flight["name"], "flight");
    // free fall is not a learned equation
    assert_eq!(flight["xi"][0][1].as_f64(), Some(-0.981));
    let entry = &model["provenance"]["simplification"];
    assert_eq!(
        (entry["tolerance"].as_str(), entry["domain"][0].as_str()),
        (Some("50%"), Some(JUMP))
    );
    let active = simplification["terms"]["after"].as_u64();
    let simulated = judged(&["simulate", &saved, JUMP]);
    assert_eq!(simulated["rollouts"]["active_terms"].as_u64(), active);
    assert_eq!(
        simulated["rollouts"]["full"]["coordinates"]["body.z"]["rms"],
        simplification["rollouts"]["rms_after"]["body.z"]["full"]
    );
}

#[test]
fn simplified_model_may_be_saved_among_the_emitted_files_and_again() {
    let folder = folder();
    let out = path(&folder, "out");
    let saved = format!("{out}/short.json");
    let ranges = "examples/domains/paper-2d.toml";
    let compile = [
        "compile",
        "models/paper-2d.json",
        "--emit",
        "c,c",
        "--out-dir",
        &out,
        "--domain",
        ranges,
        "--save-model",
        &saved,
        "--tolerance",
    ];
    let run = |tolerance: &'static str| [&compile[..], &[tolerance]].concat();
    done(&run("0.01"));
    let first = fs::read(&saved).expect("written");
    done(&run("0.01"));
    let header = Path::new(&out).join("paper_2d.h");
    let emitted = fs::read(&header).expect("written");
    let error = failed(&run("0.02"));
    assert!(error.contains("short.json"), "{error}");
    assert_eq!(fs::read(&saved).expect("kept"), first);
    assert_eq!(fs::read(&header).expect("kept"), emitted);
}

#[test]
fn control_step_shorter_than_the_samples_is_refused() {
    let error = failed(&["mpc", MODEL, JUMP, "--step", "0.001"]);
    assert!(
        error.contains("test_01.csv.gz") && error.contains("2.000 ms"),
        "{error}"
    );
}

#[test]
fn runs_at_the_same_time_into_one_folder_keep_each_others_files() {
    for _ in 0..4 {
        let folder = folder();
        let out = path(&folder, "out");
        let compile = |model: &str| {
            Command::new(env!("CARGO_BIN_EXE_romc"))
                .args([
                    "compile",
                    model,
                    "--emit",
                    "c,rust,latex",
                    "--out-dir",
                    &out,
                ])
                .current_dir(env!("CARGO_MANIFEST_DIR"))
                .output()
                .expect("the binary runs")
        };
        let models = ["models/paper-2d.json", "models/go1-d2.json", MODEL];
        std::thread::scope(|scope| {
            let runs = models.map(|model| scope.spawn(move || compile(model)));
            for run in runs {
                let output = run.join().expect("a run");
                assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
            }
        });
        // romc recognises every file as its own, so each run can be repeated
        for model in models {
            done(&[
                "compile",
                model,
                "--emit",
                "c,rust,latex",
                "--out-dir",
                &out,
            ]);
        }
    }
}

#[test]
fn folder_as_an_output_file_is_refused_before_the_work() {
    let folder = folder();
    let out = path(&folder, "");
    let train = ["train", JUMP, "--latent-dim", "2", "--force", "--output"];
    for output in [out.as_str(), ".."] {
        let error = failed(&[&train[..], &[output]].concat());
        assert!(error.contains("expected the name of a file"), "{error}");
    }
}

#[test]
fn study_leaves_files_of_others_alone() {
    let folder = folder();
    let (out, mine) = (path(&folder, "st"), path(&folder, "st/summary.csv"));
    fs::create_dir(&out).expect("a folder");
    fs::write(&mine, "mine").expect("written");
    let error = failed(&["study", JUMP, "--latent-dims", "1", "--out-dir", &out]);
    assert!(error.contains("summary.csv: not made by romc"), "{error}");
    assert_eq!(fs::read_to_string(&mine).expect("kept"), "mine");
    assert_eq!(contents(Path::new(&out)).len(), 1, "nothing was trained");
}

#[test]
fn sines_of_the_paper_become_linear_over_given_ranges() {
    let folder = folder();
    let (out, paper) = (path(&folder, "out"), "models/paper-2d.json");
    let ranges = "examples/domains/paper-2d.toml";
    let compile = ["compile", paper, "--emit", "latex", "--out-dir", &out];
    done(&[&compile[..], &["--tolerance", "0.01", "--domain", ranges]].concat());
    let equations = fs::read_to_string(Path::new(&out).join("paper_2d.tex")).expect("written");
    assert!(!equations.contains("\\sin"), "{equations}");
    let comment = "% Simplified within 0.01 scaled units per s^2\n";
    assert!(equations.contains(comment), "{equations}");
    let error = failed(&[&compile[..], &["--tolerance", "0.01", "--domain", JUMP]].concat());
    assert!(error.contains("no encoder"), "{error}");
    for (arguments, told) in [
        (&["--tolerance", "1%"][..], "--domain <RECORDING>"),
        (&["--tolerance", "-0.1", "--domain", ranges], "found `-0.1`"),
        (&["--tolerance", "nan", "--domain", ranges], "found `nan`"),
        (&["--margin", "-1", "--domain", ranges], "from 0 to 100"),
        (&["--margin", "0.5", "--domain", ranges], "used unchanged"),
        (
            &["--tolerance", "1%", "--domain", ranges],
            "scaled units per s^2",
        ),
        (&["--significant", "0"], "from 1 to 40"),
        (&["--digits", "41"], "from 0 to 40"),
    ] {
        let output = romc(&[&compile[..], arguments].concat());
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        let error = text(&output.stderr);
        assert!(error.contains(told), "{error}");
    }
}

/// Ends its training on drop, also if a test fails earlier.
#[cfg(unix)]
struct Training(std::process::Child);

#[cfg(unix)]
impl Drop for Training {
    fn drop(&mut self) {
        // The training may have ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Output and exit code of a training that Ctrl-C ends before its last epoch.
///
/// The handler is installed once the recordings are read, later on a slow machine. An earlier signal ends
/// the process; the next attempt then waits longer.
#[cfg(unix)]
fn interrupted_training(model: &Path, extra: &[&str]) -> (Option<i32>, String, String) {
    use std::io::Read as _;
    use std::process::Stdio;
    for seconds in [4, 10, 25, 60] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_romc"));
        command.args([
            "train",
            "examples/recordings/go1/train_01.csv.gz",
            "--latent-dim",
            "2",
        ]);
        command.args(["--epochs", "1000000", "--force"]);
        command.args(extra).arg("--output").arg(model);
        command.current_dir(env!("CARGO_MANIFEST_DIR"));
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut training = Training(command.spawn().expect("the binary runs"));
        std::thread::sleep(std::time::Duration::from_secs(seconds));
        let signal = Command::new("sh") // a shell has `kill` built in, also where no such program is installed
            .args(["-c", &format!("kill -INT {}", training.0.id())])
            .status();
        assert!(
            signal.expect("a shell runs").success(),
            "the training still runs"
        );
        let (mut said, mut wrong) = (String::new(), String::new());
        let stdout = training.0.stdout.as_mut().expect("it is piped");
        stdout.read_to_string(&mut said).expect("UTF-8");
        let stderr = training.0.stderr.as_mut().expect("it is piped");
        stderr.read_to_string(&mut wrong).expect("UTF-8");
        let code = training.0.wait().expect("it ends").code();
        if code.is_some() {
            return (code, said, wrong);
        }
    }
    panic!("no training lived to be interrupted");
}

#[cfg(unix)]
#[test]
fn training_that_is_interrupted_says_so_in_text_json_exit_code_and_provenance() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let model = folder.path().join("cut-short.json");
    let provenance = || {
        let value: Value =
            serde_json::from_slice(&fs::read(&model).expect("a model")).expect("JSON");
        value["provenance"]["interrupted"].clone()
    };
    let (code, said, wrong) = interrupted_training(&model, &["--method", "joint"]);
    assert_eq!(code, Some(130), "{said}{wrong}");
    assert!(said.contains("interrupted by Ctrl-C"), "{said}");
    assert_eq!(provenance(), true);

    fs::remove_file(&model).expect("it was written");
    // The number of epochs alone selects the joint method.
    let (code, said, wrong) = interrupted_training(&model, &["--seeds", "2", "--json"]);
    assert_eq!(code, Some(130), "{said}{wrong}");
    assert!(wrong.contains("note: interrupted"), "{wrong}");
    let said: Value = serde_json::from_str(&said).expect("one JSON object");
    assert_eq!(said["interrupted"], true);
    assert_eq!(provenance(), true);
}

#[test]
fn held_out_jumps_and_repeated_recordings_are_said() {
    let folder = folder();
    let jumps = ["test_01", "test_02", "test_03", "train_01"];
    let jumps = jumps.map(|name| format!("examples/recordings/go1/{name}.csv.gz"));
    let copy = path(&folder, "copy.csv.gz");
    fs::copy(&jumps[3], &copy).expect("copied");
    let model = path(&folder, "split.json");
    let mut arguments = vec!["train"];
    arguments.extend(jumps.iter().map(String::as_str));
    arguments.extend([
        "--latent-dim",
        "2",
        "--refinements",
        "0",
        "--split",
        "2,1,1",
        "--output",
        &model,
    ]);
    let said = done(&arguments);
    let first_of = |set: &str| {
        let line = said.lines().find(|line| line.starts_with(set));
        let line = line.expect("a line for each set");
        let jump = jumps.iter().find(|jump| line.contains(*jump));
        jump.expect("a jump of the set")
    };
    let page = path(&folder, "page.html");
    for (set, expected) in [
        ("test, 1 motion: ", "It was not used in training."),
        ("training, ", "It was used in training"),
    ] {
        let assessed = judged(&[
            "report",
            &model,
            first_of(set),
            "--force",
            "--output",
            &page,
        ]);
        let reasons = assessed["reasons"].to_string();
        assert!(reasons.contains(expected), "{set}{reasons}");
    }

    let other = path(&folder, "other.json");
    let output = romc(&[
        "train",
        &jumps[0],
        &jumps[3],
        "--test",
        &copy,
        "--latent-dim",
        "2",
        "--refinements",
        "0",
        "--output",
        &other,
    ]);
    let notes = text(&output.stderr);
    assert!(notes.contains("which is in the training set"), "{notes}");
    let output = romc(&["identify", &jumps[0], &jumps[0], "--robot", "go1"]);
    let notes = text(&output.stderr);
    assert!(notes.contains("and counts twice"), "{notes}");
}

#[test]
fn endings_merges_and_losses_that_do_not_fit_are_refused() {
    let folder = folder();
    let jump = "examples/recordings/go1/test_01.csv.gz";
    for name in ["a.xyz", "a.csv.gzip", "a"] {
        let to = path(&folder, name);
        let output = romc(&["convert", jump, "--output", &to]);
        assert_eq!(output.status.code(), Some(2), "{name}");
        assert!(text(&output.stderr).contains("expected a name that ends in .csv"));
        assert!(!Path::new(&to).exists());
    }
    let upper = path(&folder, "A.MCAP");
    done(&["convert", jump, "--output", &upper]);
    assert_eq!(&fs::read(&upper).expect("written")[1..5], b"MCAP");

    let output = romc(&["study", "--merge", "one", "two", "--seeds", "7"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        text(&output.stderr).contains("--seeds"),
        "{}",
        text(&output.stderr)
    );

    let losses = path(&folder, "losses.toml");
    done(&["identify", jump, "--robot", "go1", "--output", &losses]);
    let of_another = fs::read_to_string(&losses)
        .expect("written")
        .replace("\"go1\"", "\"go2\"");
    fs::write(&losses, of_another).expect("changed");
    let (model, robot) = (path(&folder, "model.json"), path(&folder, "robot.toml"));
    done(&["robot", "go1", "--output", &robot]);
    let output = romc(&[
        "train",
        jump,
        "--latent-dim",
        "2",
        "--robot",
        &robot,
        "--actuators",
        &losses,
        "--output",
        &model,
    ]);
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(text(&output.stderr).matches("robot go1, ").count(), 1);
    assert!(
        text(&output.stderr).contains("robot: found go2, expected go1"),
        "{}",
        text(&output.stderr)
    );
}

#[test]
fn report_follows_slow_recordings_at_their_own_rate() {
    let folder = folder();
    let slow = path(&folder, "slow.csv");
    let fast = fs::read_to_string({
        let plain = path(&folder, "fast.csv");
        done(&[
            "convert",
            "examples/recordings/go1/test_01.csv.gz",
            "--output",
            &plain,
        ]);
        plain
    });
    let rows: Vec<String> = fast.expect("written").lines().map(str::to_owned).collect();
    let every_tenth = rows
        .iter()
        .enumerate()
        .filter(|(row, _)| row % 10 == 1 || *row == 0);
    let kept: Vec<&str> = every_tenth.map(|(_, line)| line.as_str()).collect();
    fs::write(&slow, kept.join("\n") + "\n").expect("written");
    let page = path(&folder, "page.html");
    let output = romc(&["report", "models/go1-d4.json", &slow, "--output", &page]);
    let notes = text(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{notes}");
    assert!(notes.contains("the controller acts every 20 ms"), "{notes}");
    let output = romc(&["mpc", "models/go1-d4.json", &slow]);
    assert!(
        text(&output.stderr).contains("`romc mpc --step 0.02`"),
        "{}",
        text(&output.stderr)
    );
}
