//! The log of a controller in C, and `romc report --log` of it.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use romc::codegen::Precision;
use romc::recording::{Column, ControllerLog, LogColumn};

use crate::emitted::Emitted;
use crate::programs::{root, shipped, succeed};

/// The log that `log.c` writes: 50 rows of 91 steps, the last 31 with measurements that go wrong.
fn log_of_a_fall() -> (tempfile::TempDir, String) {
    let emitted = Emitted::new(&shipped("go1-d2"), Precision::Double);
    let of_model = |macro_, file| format!("-D{macro_}=\"{}_{file}.h\"", emitted.name);
    let flags = [
        of_model("LOG_HEADER", "log"),
        of_model("JUMP_HEADER", "jump"),
    ];
    let source = root().join("tests/controller_c/log.c");
    let flags = flags.each_ref().map(String::as_str);
    let program = emitted.program("cc", &flags, source.to_str().expect("UTF-8"));
    let text = Emitted::output(&mut Command::new(program));
    (emitted.scratch, text)
}

fn report(log: &Path, more: &[&str]) -> Output {
    let page = log.with_extension("html");
    let mut command = Command::new(env!("CARGO_BIN_EXE_romc"));
    command.arg("report").arg("--log").arg(log).args(more);
    let output = command.arg("--output").arg(page).arg("--force").output();
    output.expect("it runs")
}

#[test]
fn log_in_c_keeps_the_last_steps_and_the_report_names_their_statuses() {
    let (folder, text) = log_of_a_fall();
    let path = folder.path().join("fall.csv");
    fs::write(&path, &text).expect("written");
    let log = ControllerLog::read(&path).expect("a log");
    let values = |column| log.values(LogColumn::Sample(column));
    // Steps 41 to 89 of 10 ms, and one without a measurement.
    assert_eq!(log.len(), 50);
    let times = values(Column::Time);
    let is_step = |(step, time): (usize, &f64)| (time - 0.01 * (step + 41) as f64).abs() < 1e-9;
    assert!(times.iter().enumerate().all(is_step), "{times:?}");
    assert!(values(Column::Velocity(12))[19].is_nan());
    assert_eq!(values(Column::Position(12))[20], f64::INFINITY);
    let last: Vec<f64> = (0..18).map(|i| values(Column::Position(i))[49]).collect();
    assert!(last.iter().all(|x| x.is_nan()), "{last:?}");

    let output = report(&path, &["--json"]);
    assert!(output.status.success(), "{output:?}");
    let facts: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let codes = log.values(LogColumn::Status);
    let first = codes
        .iter()
        .position(|code| *code >= 20.0)
        .expect("a fault");
    assert_eq!(facts["fault"]["code"], codes[first] as i64);
    assert_eq!(facts["fault"]["first_row"], first + 2);
    assert_eq!(facts["steps"], 50);
    let statuses = facts["statuses"].as_array().expect("statuses");
    let steps: u64 = statuses.iter().filter_map(|of| of["steps"].as_u64()).sum();
    assert_eq!(steps, 50);
    let html = fs::read_to_string(path.with_extension("html")).expect("a page");
    for elsewhere in ["src=", "url(", "@import", "http://", "https://", "NaN"] {
        assert!(!html.contains(elsewhere), "{elsewhere}");
    }
    for status in ["solved", "not finite", "measurement jump", "tilt"] {
        let named = format!(">{status}</text>");
        assert!(html.contains(&named), "{status} is not in the strip");
        assert!(statuses.iter().any(|of| of["status"] == status), "{status}");
    }
    let headline = facts["headline"].as_str().expect("words");
    assert!(headline.starts_with("Last step, at 0.9 s: tilt: roll or pitch far"));
}

#[test]
fn log_of_the_example_is_a_recording_in_both_precisions() {
    for precision in [Precision::Double, Precision::Single] {
        let emitted = Emitted::new(&shipped("go1-d2"), precision);
        let example = emitted.program("cc", &[], &format!("{}_example.c", emitted.name));
        let path = emitted.scratch.path().join("log.csv");
        succeed(Command::new(example).arg(&path));
        let recording = romc::recording::read(&path).expect("a recording");
        let log = ControllerLog::read(&path).expect("a log");
        let [segment] = &recording.segments[..] else {
            panic!("{} segments", recording.segments.len());
        };
        let heights = log.values(LogColumn::Sample(Column::Position(14)));
        assert!(segment.x.row(14).iter().eq(heights), "other heights");
        assert_eq!(recording.ignored_columns.len(), 2 + 2 + 12);
        let desired = log.values(LogColumn::Desired(0));
        assert!(desired.iter().all(|angle| angle.abs() < 1.0), "{desired:?}");
    }
}

#[test]
fn report_on_what_is_no_log_names_file_line_found_and_expected() {
    let (folder, text) = log_of_a_fall();
    let path = folder.path().join("broken.csv");
    let line = |number: usize| text.lines().nth(number - 1).expect("a line");
    let cut = line(3).rsplit_once(',').expect("cells").0;
    let cases = [
        (String::new(), "found an empty file, expected the header"),
        (format!("{}\n", line(1)), "row 1: found a header alone"),
        (
            text.replacen("status", "state", 1),
            "found `state`, expected `status`",
        ),
        (
            text.replacen("Time", "x;y", 1),
            "found `x;y`, expected `Time`",
        ),
        (
            text.replacen(line(3), cut, 1),
            "found 68 cells, expected 69",
        ),
        (
            text.replacen(line(3), &format!("x{}", line(3)), 1),
            "row 3, column `Time`: found `x0.42`",
        ),
        (
            text.replacen(",1,1,1,1,0,", ",1,2,1,1,0,", 1),
            "found `2`, expected 0 or 1",
        ),
        (
            text.replacen(",1,1,1,1,0,", ",1,1,1,1,0.5,", 1),
            "found `0.5`, expected a whole number",
        ),
    ];
    for (text, expected) in cases {
        fs::write(&path, text).expect("written");
        let output = report(&path, &[]);
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success(), "{expected}");
        assert!(error.contains("broken.csv"), "{error}");
        assert!(error.contains(expected), "`{expected}` is not in: {error}");
    }
}
