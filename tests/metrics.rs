//! One definition of every metric: commands that print the same thing print the same number.

use std::path::{Path, PathBuf};
use std::process::Command;

use romc::recording::{self, Recording, write};
use serde_json::Value;

fn recording_path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("examples/recordings/go1")
        .join(format!("{name}.csv.gz"))
}

fn romc(arguments: &[&str]) -> Value {
    let output = Command::new(env!("CARGO_BIN_EXE_romc"))
        .args(arguments)
        .arg("--json")
        .output()
        .expect("romc starts");
    let error = String::from_utf8_lossy(&output.stderr);
    // 1 is a verdict on the model.
    let is_done = matches!(output.status.code(), Some(0 | 1));
    assert!(is_done, "{arguments:?}: {error}");
    serde_json::from_slice(&output.stdout).expect("one JSON object")
}

fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("{value}, expected a number"))
}

#[track_caller]
fn assert_same(one: &Value, other: &Value) {
    let (one, other) = (number(one), number(other));
    assert!(
        (one - other).abs() <= 1e-9 * one.abs(),
        "{one} against {other}"
    );
}

/// A test jump with one sample of torques that no motor gives.
fn jump_with_a_spike(folder: &Path) -> PathBuf {
    let jump = recording::read(&recording_path("test_01")).expect("shipped");
    let mut segment = jump.segments[0].clone();
    segment.torque_nm[(4, 60)] = 900.0;
    let go1 = romc::robot_file::by_name("go1").expect("known");
    assert!(go1.torque_limit_nm()[4] < 450.0);
    let path = folder.join("spike.csv");
    let recording = Recording {
        path: path.clone(),
        segments: vec![segment],
        ignored_columns: Vec::new(),
    };
    write(&path, &recording).expect("a writable folder");
    path
}

#[test]
fn train_simulate_report_and_mpc_print_the_same_number_for_the_same_thing() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let in_folder = |name: &str| folder.path().join(name).display().to_string();
    let (model, page) = (in_folder("model.json"), in_folder("report.html"));
    let recordings = ["train_01", "train_02", "train_03"].map(|name| {
        let path = recording_path(name);
        path.display().to_string()
    });
    let plain = recording_path("test_01").display().to_string();
    let spike = jump_with_a_spike(folder.path()).display().to_string();
    for test in [&plain, &spike] {
        let mut arguments = vec!["train"];
        arguments.extend(recordings.iter().map(String::as_str));
        arguments.extend(["--test", test, "--latent-dim", "4", "--force"]);
        arguments.extend(["--method", "closed-form", "--output", &model]);
        let trained = romc(&arguments);
        let simulated = romc(&["simulate", &model, test]);
        let figures = &simulated["rollouts"];

        assert_same(
            &trained["test"]["decoder_mse"],
            &figures["decoder_mean_square_scaled"],
        );
        let lift = &figures["lift"]["torque_r2"];
        assert_same(&trained["test"]["torque_r2"], &lift["all"]);

        let page_arguments = ["report", &model, test, "--output", &page, "--force"];
        romc(&page_arguments);
        let html = std::fs::read_to_string(&page).expect("a page");
        for (name, value) in [
            ("of the transpose lift, contact", number(&lift["contact"])),
            (
                "combined loss of accuracy and size",
                number(&figures["combined_loss"]),
            ),
        ] {
            let card = html.find(name).expect(name);
            let shown = format!("{value:.4}");
            let start = html[..card].char_indices().rev().nth(200);
            let near = html[start.map_or(0, |(index, _)| index)..]
                .chars()
                .take(420);
            let near: String = near.collect();
            assert!(near.contains(&shown[..5]), "{name}: {shown} in {near}");
        }

        let controlled = romc(&["mpc", &model, test, "--lift", "transpose"]);
        let lift_of_mpc = &controlled["runs"][0]["lift"]["torque_r2"];
        assert_same(&lift["contact"], &lift_of_mpc["contact"]);
        assert_same(&lift["flight"], &lift_of_mpc["flight"]);
    }
}
