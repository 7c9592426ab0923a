//! Runs that come to an end without a result: exit code 1, with the answer and its reason.

use std::fs;

use serde_json::Value;

use super::{JUMP, MODEL, folder, path, romc, text};

/// A model whose every step overflows: coefficients 1e12 times as large.
fn overflowing(at: &str) {
    let shipped = fs::read_to_string(MODEL).expect("the shipped model");
    let mut model: Value = serde_json::from_str(&shipped).expect("JSON");
    let phases = model["phases"].as_array_mut().expect("phases");
    let rows = phases
        .iter_mut()
        .flat_map(|phase| phase["xi"].as_array_mut().expect("rows"));
    for value in rows.flat_map(|row| row.as_array_mut().expect("a row")) {
        *value = (1e12 * value.as_f64().expect("a number")).into();
    }
    fs::write(at, model.to_string()).expect("writable");
}

#[test]
fn mpc_without_a_plan_in_most_steps_ends_with_one_and_the_reason() {
    let folder = folder();
    let (model, table) = (path(&folder, "broken.json"), path(&folder, "steps.csv"));
    overflowing(&model);
    let arguments = ["mpc", &model, JUMP, "--output", &table];
    let output = romc(&[&arguments[..], &["--json"]].concat());
    assert_eq!(output.status.code(), Some(1));
    let answer: Value = serde_json::from_str(&text(&output.stdout)).expect("one JSON value");
    let reason = answer["failed"][0].as_str().expect("a reason");
    assert!(
        reason.contains("131 of 131 control steps have no plan"),
        "{reason}"
    );
    assert_eq!(answer["runs"][0]["failed"], 131);
    assert!(fs::exists(&table).expect("readable"), "the steps say more");

    let output = romc(&[&arguments[..], &["--force"]].concat());
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stdout).contains(reason));
}
