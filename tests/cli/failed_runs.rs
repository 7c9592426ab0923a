//! Runs that come to an end without a result: exit code 1, with the answer and its reason.

use std::fs;

use serde_json::Value;

use super::{JUMP, MODEL, folder, path, romc, text};

/// A copy of a shipped model with other coefficients.
fn with_xi(name: &str, at: &str, change: impl Fn(f64) -> f64) {
    let shipped = fs::read_to_string(format!("models/{name}.json")).expect("a shipped model");
    let mut model: Value = serde_json::from_str(&shipped).expect("JSON");
    let phases = model["phases"].as_array_mut().expect("phases");
    let rows = phases
        .iter_mut()
        .flat_map(|phase| phase["xi"].as_array_mut().expect("rows"));
    for value in rows.flat_map(|row| row.as_array_mut().expect("a row")) {
        *value = change(value.as_f64().expect("a number")).into();
    }
    fs::write(at, model.to_string()).expect("writable");
}

#[test]
fn mpc_without_a_plan_in_most_steps_ends_with_one_and_the_reason() {
    let folder = folder();
    let (model, table) = (path(&folder, "broken.json"), path(&folder, "steps.csv"));
    with_xi("go1-d4", &model, |value| 1e12 * value);
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
    assert!(text(&output.stdout).replace("\n  ", " ").contains(reason));
}

#[test]
fn study_without_a_model_ends_with_one_and_lines_that_fit() {
    let folder = folder();
    let study = path(&folder, "study");
    let arguments = ["study", JUMP, "--seeds", "1", "--out-dir", &study];
    let refused = romc(&[&arguments[..], &["--latent-dims", "10"]].concat());
    assert_eq!(refused.status.code(), Some(1));
    let said = text(&refused.stdout);
    assert!(said.contains("no model: d = 10 seed 1: "), "{said}");
    assert!(said.lines().all(|line| line.len() <= 100), "{said}");
    let some = romc(
        &[
            &arguments[..4],
            &["--out-dir", &path(&folder, "some"), "--latent-dims", "2,10"],
        ]
        .concat(),
    );
    assert_eq!(some.status.code(), Some(0), "{}", text(&some.stderr));
}

/// Each command ends with 1 where its own purpose fails, with everything written, and with 0 where another's does.
#[test]
fn exit_codes_follow_the_purpose_of_each_command_and_the_verdict_is_the_same_in_all() {
    let folder = folder();
    let (broken, table, page) = (
        path(&folder, "broken.json"),
        path(&folder, "table.csv"),
        path(&folder, "page.html"),
    );
    with_xi("go1-d4", &broken, |value| -value);
    let without_torques = "models/go1-d2.json";
    // Positions that are decoded wrongly do not enter the lift, so that feedback alone would pass.
    let doubled = path(&folder, "doubled.json");
    let shipped = fs::read_to_string(MODEL).expect("a shipped model");
    let mut model: Value = serde_json::from_str(&shipped).expect("JSON");
    let rows = model["decoder"]["weights"].as_array_mut().expect("rows");
    for value in rows
        .iter_mut()
        .flat_map(|row| row.as_array_mut().expect("a row"))
    {
        *value = (2.0 * value.as_f64().expect("a number")).into();
    }
    fs::write(&doubled, model.to_string()).expect("writable");
    let all: &[&str] = &["0.1 s", "whole motion", "torques", "control"];
    let (predictions, control) = all.split_at(2);
    let mut baselines = Vec::new();
    for (model, codes, fit, failed) in [
        (MODEL, [0, 0, 0], all, &[][..]),
        (without_torques, [0, 1, 0], predictions, control),
        (&broken, [1, 1, 1], &[], all),
        (&doubled, [1, 0, 0], &["torques"], predictions),
    ] {
        let mut verdicts = Vec::new();
        let commands = [("simulate", &table), ("mpc", &table), ("report", &page)];
        for ((command, output), code) in commands.into_iter().zip(codes) {
            let arguments = [
                command, model, JUMP, "--output", output, "--force", "--json",
            ];
            let run = romc(&arguments);
            let error = text(&run.stderr);
            assert_eq!(run.status.code(), Some(code), "{command} {model}: {error}");
            assert!(fs::exists(output).expect("readable"), "{command} {model}");
            fs::remove_file(output).expect("written");
            let answer: Value = serde_json::from_str(&text(&run.stdout)).expect("one JSON value");
            verdicts.push(answer["verdict"].clone());
        }
        for verdict in &verdicts {
            assert_eq!(verdict["fit_for"], serde_json::json!(fit), "{model}");
            assert_eq!(verdict["failed"], serde_json::json!(failed), "{model}");
            let rows = verdict["rows"].as_array().expect("rows");
            for key in ["name", "value", "baseline", "threshold", "passed", "counts"] {
                assert!(rows.iter().all(|row| row.get(key).is_some()), "{key}");
            }
        }
        let predictions = verdicts[0]["rows"].as_array().expect("rows").iter();
        let predictions = predictions.filter(|row| row["unit"] == "m" && row["use"] != "control");
        let of_predictions: Vec<Value> = predictions.map(|row| row["baseline"].clone()).collect();
        baselines.push(of_predictions);
        assert_eq!(verdicts[0], verdicts[1], "{model}");
        assert_eq!(verdicts[0], verdicts[2], "{model}");
    }
    assert_eq!(baselines[0].len(), 4);
    assert_eq!(baselines[0], baselines[2], "a rollout that diverges");
    headlines_say_it(
        &page,
        [
            (MODEL, "Fit for predictions over 0.1 s, "),
            (
                &broken,
                "Do not rely on it here, see the notes. Not fit for ",
            ),
            (
                &doubled,
                "Fit for torques; not fit for predictions over 0.1 s and predictions of the whole motion.",
            ),
        ],
    );
    let run = romc(&["mpc", without_torques, JUMP]);
    let said = text(&run.stdout).replace("\n  ", " ");
    assert!(said.contains("not fit for torques and control"), "{said}");
    assert!(
        said.contains("worse than constant velocity, does not count: error of body.pitch"),
        "{said}"
    );
}

fn headlines_say_it(page: &str, models: [(&str, &str); 3]) {
    for (model, words) in models {
        let run = romc(&["report", model, JUMP, "--output", page, "--force", "--json"]);
        let answer: Value = serde_json::from_str(&text(&run.stdout)).expect("one JSON value");
        let headline = answer["headline"].as_str().expect("words");
        assert!(headline.starts_with(words), "{headline}");
        assert!(headline.ends_with('.'), "{headline}");
    }
}

/// Points of the polylines of a class in a drawing.
fn points(drawing: &str, class: &str) -> Vec<[f64; 2]> {
    let start = format!("<polyline class=\"{class}\" points=\"");
    let lines = drawing.split(&start).skip(1);
    let lines = lines.map(|rest| rest.split('"').next().expect("points"));
    let numbers = lines.flat_map(|line| line.split([' ', ',']));
    let numbers: Vec<f64> = numbers
        .map(|text| text.parse().expect("a number"))
        .collect();
    numbers.chunks(2).map(|pair| [pair[0], pair[1]]).collect()
}

#[test]
fn every_line_of_a_runaway_prediction_stays_inside_the_frame() {
    let folder = folder();
    let (broken, page, figures) = (
        path(&folder, "broken.json"),
        path(&folder, "page.html"),
        path(&folder, "figures"),
    );
    with_xi("go1-d4", &broken, |value| -value);
    romc(&[
        "report",
        &broken,
        JUMP,
        "--output",
        &page,
        "--figures",
        &figures,
    ]);
    let html = fs::read_to_string(&page).expect("written");
    for words in ["<strong>0 of 4 passed.</strong>", "model: diverges at "] {
        assert!(html.contains(words), "{words}");
    }
    assert!(!html.contains("000 mm"), "a length that nobody reads");
    let read = |name: &str| fs::read_to_string(format!("{figures}/{name}")).expect("drawn");
    let body = read("body_1.csv");
    let full = body
        .lines()
        .filter(|line| line.contains("model, whole motion"));
    let values = full.filter_map(|line| line.rsplit(',').next()?.parse::<f64>().ok());
    let farthest = values.fold(0.0, |most, value| value.abs().max(most));
    assert!(farthest > 10.0, "it runs away: {farthest}");
    for (name, classes) in [
        ("body_1.svg", ["recorded", "full"]),
        ("torques_1.svg", ["recorded", "limit"]),
    ] {
        let drawing = read(name);
        let number = |name: &str| -> f64 {
            let rest = drawing.split(&format!(" {name}=\"")).nth(1).expect(name);
            rest.split("pt\"").next().expect(name).parse().expect(name)
        };
        let size = [number("width"), number("height")];
        for class in classes {
            let points = points(&drawing, class);
            assert!(points.len() > 10, "{name} {class}");
            for point in points {
                let inside = (0..2).all(|axis| (0.0..=size[axis]).contains(&point[axis]));
                assert!(inside, "{name} {class}: {point:?} in {size:?}");
            }
        }
    }
}
