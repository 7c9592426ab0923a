//! `romc plan` from the command line: its files and messages, its refusals, and the use of its plan by other commands.

#[path = "command_line/mod.rs"]
mod command_line;
#[path = "plan/planned.rs"]
mod planned;
#[path = "plan/walks.rs"]
mod walks;

use std::fs;
use std::path::Path;

use command_line::{romc, text};
use serde_json::Value;

/// A shipped model for planning.
fn model() -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    root.join("models/go1-d7.json").display().to_string()
}

/// Runs, expects success, returns stdout.
fn done(folder: &Path, arguments: &[&str]) -> String {
    let output = romc(folder, arguments);
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {stderr}");
    text(&output.stdout)
}

/// Runs, expects an error and no file of the name `plan.csv`, returns stderr.
fn failed(folder: &Path, arguments: &[&str]) -> String {
    let output = romc(folder, arguments);
    let stderr = text(&output.stderr);
    assert!(
        [Some(1), Some(2)].contains(&output.status.code()),
        "{stderr}"
    );
    assert!(stderr.contains("error: "), "{stderr}");
    assert!(!stderr.contains("panicked"), "{stderr}");
    assert!(!folder.join("plan.csv").exists(), "{arguments:?}");
    stderr
}

fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("{value} is no number"))
}

#[test]
fn plan_is_a_recording_that_other_commands_take() {
    let folder = tempfile::tempdir().expect("a folder");
    let (folder, model) = (folder.path(), model());
    let goal = ["--distance", "0.28", "--apex", "0.12"];
    let plan = ["plan", &model, "--output", "plan.csv", "--json"];
    let said: Value = serde_json::from_str(&done(folder, &[&plan[..], &goal].concat())).expect("J");
    assert_eq!(said["status"], "trusted", "{said}");
    assert!((number(&said["distance_m"]) - 0.28).abs() < 2e-3, "{said}");
    assert!((number(&said["apex_m"]) - 0.12).abs() < 2e-3, "{said}");
    assert!(number(&said["margins"]["torque_share"]) < 1.0, "{said}");

    let recording = romc::recording::read(&folder.join("plan.csv")).expect("a sound recording");
    let x = &recording.segments[0].x;
    let travelled = x[(12, x.ncols() - 1)] - x[(12, 0)];
    assert!(
        (travelled - number(&said["distance_m"])).abs() < 1e-6,
        "{travelled}"
    );

    let followed: Value =
        serde_json::from_str(&done(folder, &["mpc", &model, "plan.csv", "--json"])).expect("JSON");
    assert_eq!(said["settings"], "plan.settings.toml");
    let torques = |name: &str, settings: &str| {
        fs::copy(folder.join("plan.csv"), folder.join(format!("{name}.csv"))).expect("copied");
        fs::write(folder.join(format!("{name}.settings.toml")), settings).expect("written");
        let (plan, output) = (format!("{name}.csv"), format!("{name}-torques.csv"));
        done(folder, &["mpc", &model, &plan, "--output", &output]);
        let table = fs::read_to_string(folder.join(output)).expect("a table");
        // Without the recording's name and the solver's times.
        let lines = table.lines().map(|line| {
            let fields = line.split(',').enumerate();
            let kept = fields.filter(|(i, _)| ![0, 5].contains(i));
            kept.map(|(_, field)| field.to_owned()).collect::<Vec<_>>()
        });
        lines.collect::<Vec<_>>()
    };
    let own = fs::read_to_string(folder.join("plan.settings.toml")).expect("written");
    assert!(own.contains("input_weight = 8.0 #"), "{own}");
    assert!(own.contains("flight_torque = 1.0 #"), "{own}");
    // The settings file next to a plan is for its controller: without it, commands are different.
    let [with, without] = [torques("with", &own), torques("without", "")];
    assert_ne!(with, without);
    assert_eq!(
        torques(
            "again",
            "input_weight = 8.0\n\
        effectiveness_time_s = 1.0\ndrive_stiffness_nm_rad = 20.0\ndrive_damping_nm_s_rad = 0.8\n"
        ),
        with
    );
    for (settings, expected) in [
        ("weight = 1.0", "found `weight`"),
        ("input_weight = -1.0", "`input_weight` is -1"),
        ("flight_torque = 2.0", "`flight_torque` is 2"),
    ] {
        fs::write(folder.join("with.settings.toml"), settings).expect("written");
        let output = romc(folder, &["mpc", &model, "with.csv"]);
        let stderr = text(&output.stderr);
        assert!(
            stderr.contains("with.settings.toml") && stderr.contains(expected),
            "{stderr}"
        );
        assert_eq!(output.status.code(), Some(1));
    }
    let run = &followed["runs"][0];
    assert_eq!(run["solved"], run["steps"], "{run}");
    assert!(number(&run["lift"]["torque_r2"]["contact"]) > 0.99, "{run}");
    let emitted = done(
        folder,
        &[
            "compile",
            &model,
            "--emit",
            "controller,controller-c",
            "--plan",
            "plan.csv",
            "--out-dir",
            "code",
        ],
    );
    assert!(emitted.contains("controller"), "{emitted}");
    let of_example = folder.join("code/go1_d7-controller/examples/go1_d7_plan.c");
    let source = fs::read_to_string(of_example).expect("the plan of the example");
    let written = source.split([',', '{', '}', '\n', ' ']);
    let written: Vec<f64> = (written.filter(|word| word.contains('e')))
        .flat_map(str::parse)
        .collect();
    let count = x.ncols();
    assert_eq!(written.len(), count * (1 + 3 * 18));
    for (found, expected) in written[count..].iter().zip(x.iter()) {
        let error = (found - expected).abs();
        assert!(error <= 1e-8 * expected.abs(), "{found} {expected}");
    }
    let again = [&plan[..], &goal].concat();
    let output = romc(folder, &again);
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "an output stands there");
    assert!(stderr.contains("plan.csv"), "{stderr}");
}

#[test]
fn plan_ends_at_the_sum_of_its_durations_with_the_steps_of_the_model() {
    let folder = tempfile::tempdir().expect("a folder");
    let model = model().replace("go1-d7", "go2-async-d4");
    for (distance, output) in [("0.28", "a.csv"), ("0.3", "b.csv"), ("0.33", "c.csv")] {
        let goal = ["--distance", distance, "--apex", "0.12", "--force"];
        let plan = ["plan", &model, "--output", output, "--json"];
        let said = done(folder.path(), &[&plan[..], &goal].concat());
        let said: Value = serde_json::from_str(&said).expect("JSON");
        let durations = said["durations_s"].as_object().expect("one per part");
        let planned_s: f64 = durations.values().map(number).sum();
        let recording = romc::recording::read(&folder.path().join(output)).expect("sound");
        let segment = &recording.segments[0];
        let end_s = segment.time_s[segment.len() - 1];
        assert!((end_s - planned_s).abs() < 1e-9, "{end_s} {planned_s}");
        assert!((segment.mean_step_s() - 0.002).abs() < 3e-6, "{output}");
    }
    // The joint PD of a Go2, which is heavier than a Go1, is stiffer.
    let settings = fs::read_to_string(folder.path().join("a.settings.toml")).expect("written");
    let line = settings
        .lines()
        .find(|line| line.starts_with("drive_stiffness_nm_rad"));
    let gain = line.and_then(|line| line.split(' ').nth(2)?.parse::<f64>().ok());
    assert!(
        gain.is_some_and(|gain| gain > 24.0 && gain < 27.0),
        "{settings}"
    );
}

#[test]
fn absurd_goals_end_with_the_reason_and_without_a_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let model = model();
    for (distance, apex, reason) in [
        ("0", "0.12", "distance: found 0"),
        ("-0.3", "0.12", "distance: found -0.3"),
        ("5", "0.12", "distance: found 5"),
        ("nan", "0.12", "'nan' for '--distance"),
        ("0.3", "inf", "'inf' for '--apex"),
        ("0.3", "-0.1", "apex: found -0.1"),
        ("0.3", "0.01", "apex: found 0.01"),
    ] {
        let goal = [format!("--distance={distance}"), format!("--apex={apex}")];
        let arguments = ["plan", &model, &goal[0], &goal[1], "--output", "plan.csv"];
        let stderr = failed(folder.path(), &arguments);
        assert!(stderr.contains(reason), "{distance}, {apex}: {stderr}");
    }
}

#[test]
fn goal_beyond_the_recordings_is_planned_with_a_warning() {
    let folder = tempfile::tempdir().expect("a folder");
    let model = model();
    let goal = ["--distance", "0.45", "--apex", "0.12"];
    let arguments = [&["plan", &model, "--output", "plan.csv"][..], &goal].concat();
    let output = romc(folder.path(), &arguments);
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{stderr}");
    assert!(
        stderr.contains("beyond the recorded jumps by"),
        "no warning: {stderr}"
    );
}

#[test]
fn figures_and_settings_of_a_plan() {
    let folder = tempfile::tempdir().expect("a folder");
    let (folder, model) = (folder.path(), model());
    let goal = ["--distance", "0.28", "--apex", "0.12"];
    let plan = ["plan", &model, "--output", "plan.csv"];
    fs::write(folder.join("bad.toml"), "no_such_weight = 1\n").expect("written");
    let bad = [&plan[..], &goal, &["--settings", "bad.toml"]].concat();
    let stderr = failed(folder, &bad);
    assert!(
        stderr.contains("bad.toml") && stderr.contains("no_such_weight"),
        "{stderr}"
    );
    fs::create_dir(folder.join("mine")).expect("a folder");
    fs::write(folder.join("mine/plan_path.svg"), "mine").expect("written");
    let stderr = failed(folder, &[&plan[..], &goal, &["--figures", "mine"]].concat());
    assert!(stderr.contains("plan_path.svg"), "{stderr}");
    let figures = [&plan[..], &goal, &["--figures", "figures"]].concat();
    done(folder, &figures);
    let files = fs::read_dir(folder.join("figures")).expect("figures");
    let endings: Vec<String> = files
        .filter_map(|file| Some(file.ok()?.path().extension()?.to_str()?.to_owned()))
        .collect();
    for ending in ["svg", "pdf"] {
        assert!(endings.iter().any(|found| found == ending), "{endings:?}");
    }
}

#[test]
fn a_model_without_jumps_or_robot_says_what_it_lacks() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let paper = root.join("models/paper-2d.json").display().to_string();
    let arguments = [
        "plan",
        &paper,
        "--distance=0.3",
        "--apex=0.12",
        "--output=plan.csv",
    ];
    let stderr = failed(folder.path(), &arguments);
    assert!(
        stderr.contains("prior") || stderr.contains("robot"),
        "{stderr}"
    );
}
