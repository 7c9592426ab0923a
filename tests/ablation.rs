//! The figures of `romc mpc` become worse when the model is wrong: coefficients zeroed, negated, random, ten times as
//! large, or no inputs.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use nalgebra::DMatrix;
use romc::evaluate::{Assessment, Invariance, Verdict, remarks, verdict_by_default};
use romc::files::Overwrite;
use romc::model::ReducedModel;
use romc::{artifact, recording};
use serde_json::Value;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");
/// The last jump turns little. A constant velocity predicts its pitch better than a model without a coordinate for
/// pitch.
const JUMPS: [&str; 3] = [
    "examples/recordings/go1/test_02.csv.gz",
    "examples/recordings/go1-other/jump_03.csv.gz",
    "examples/recordings/go1-other/jump_04.csv.gz",
];

/// Figures that do not depend on the dynamics: counts, times, the reconstruction of recorded inputs by maps and lift,
/// and the results of baselines. Their names state this.
const OTHERS: [&str; 12] = [
    "steps",
    "solved",
    "softened",
    "failed",
    "limit_violations",
    "friction_violations",
    "implausible_steps",
    "step_us",
    "prepare_us",
    "unplanned_share",
    "lift",
    "baseline",
];

fn shipped(name: &str) -> ReducedModel {
    artifact::read(&Path::new(ROOT).join(format!("models/{name}.json"))).expect("shipped")
}

/// The model with other coefficients; the function gets term, output and value.
fn with_xi(model: &ReducedModel, change: impl Fn(&str, f64) -> f64) -> ReducedModel {
    let terms = model.library().terms();
    let phases = model.phases().iter().cloned().map(|mut phase| {
        phase.xi = DMatrix::from_fn(phase.xi.nrows(), phase.xi.ncols(), |row, col| {
            change(&terms[row].text, phase.xi[(row, col)])
        });
        phase
    });
    let phases = phases.collect();
    let builder = model.clone().into_builder().phases(phases);
    builder.build().expect("a model")
}

/// Normally distributed numbers, by a linear congruential generator.
fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    let mut uniform = move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((state >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    };
    move || (0..12).map(|_| uniform()).sum::<f64>() - 6.0
}

fn ablations(model: &ReducedModel) -> Vec<(&'static str, ReducedModel)> {
    let draws = std::cell::RefCell::new(random(13));
    let inputs: Vec<String> = (1..=model.latent_dim()).map(|k| format!("u{k}")).collect();
    let has_input = |term: &str| inputs.iter().any(|input| term.contains(input.as_str()));
    vec![
        ("zeroed", with_xi(model, |_, _| 0.0)),
        ("negated", with_xi(model, |_, value| -value)),
        ("random", with_xi(model, |_, _| 5.0 * draws.borrow_mut()())),
        ("ten times", with_xi(model, |_, value| 10.0 * value)),
        (
            "without inputs",
            with_xi(
                model,
                |term, value| if has_input(term) { 0.0 } else { value },
            ),
        ),
    ]
}

/// The runs of `romc mpc --json`.
fn runs(model: &Path, jumps: &[&str]) -> Vec<Value> {
    let output = Command::new(env!("CARGO_BIN_EXE_romc"))
        .arg("mpc")
        .arg(model)
        .args(jumps)
        .arg("--json")
        .current_dir(ROOT)
        .output()
        .expect("the binary runs");
    let error = String::from_utf8_lossy(&output.stderr);
    // Exit code 1 is a verdict on the model.
    assert!(matches!(output.status.code(), Some(0 | 1)), "{error}");
    let mut value: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    let Value::Array(runs) = value["runs"].take() else {
        panic!("{value}");
    };
    runs
}

/// All numbers of a value by their paths, except those of [`OTHERS`].
fn figures(value: &Value, path: &str, out: &mut BTreeMap<String, f64>) {
    match value {
        Value::Number(number) => {
            out.insert(path.to_owned(), number.as_f64().expect("a number"));
        }
        Value::Object(entries) => {
            let own = entries
                .iter()
                .filter(|(key, _)| !OTHERS.contains(&key.as_str()));
            own.for_each(|(key, value)| figures(value, &format!("{path}/{key}"), out));
        }
        Value::Array(values) => {
            let indexed = values.iter().enumerate();
            indexed.for_each(|(index, value)| figures(value, &format!("{path}/{index}"), out));
        }
        Value::Null | Value::Bool(_) | Value::String(_) => {}
    }
}

#[test]
fn every_figure_of_mpc_differs_for_a_wrong_model_and_the_run_says_that_it_failed() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for name in ["go1-d4", "go1-d6"] {
        let model = shipped(name);
        let right = runs(&Path::new(ROOT).join(format!("models/{name}.json")), &JUMPS);
        for run in &right {
            assert_eq!(run["failure"], Value::Null, "{name}: {run}");
        }
        for (what, wrong) in ablations(&model) {
            let path = folder.path().join("wrong.json");
            artifact::write(&path, &wrong, Overwrite::Replace).expect("writable");
            for (right, wrong) in right.iter().zip(runs(&path, &JUMPS)) {
                let [mut expected, mut found] = [BTreeMap::new(), BTreeMap::new()];
                figures(right, "", &mut expected);
                figures(&wrong, "", &mut found);
                assert!(expected.len() >= 10, "{expected:?}");
                for (key, value) in &expected {
                    let differs = found.get(key).is_none_or(|other| other != value);
                    assert!(differs, "{name} {what}: {key} is {value} all the same");
                }
                assert!(wrong["failure"].is_string(), "{name} {what}: {wrong}");
            }
        }
    }
}

#[test]
fn models_that_carry_torques_have_not_failed_along_right_recordings() {
    let of = |folder: &str, names: &str, count: usize| -> Vec<String> {
        let name = |i| format!("examples/recordings/{folder}/{names}_0{i}.csv.gz");
        (1..=count).map(name).collect()
    };
    let go1 = [
        of("go1", "test", 3),
        of("go1-other", "jump", 8),
        of("go1-noisy", "train", 4),
    ];
    let (go1, go2) = (go1.concat(), of("go2-asynchronous", "test", 2));
    for (name, jumps) in [("go1-d4", &go1), ("go1-d6", &go1), ("go2-async-d4", &go2)] {
        let model = Path::new(ROOT).join(format!("models/{name}.json"));
        let paths: Vec<&str> = jumps.iter().map(String::as_str).collect();
        for (run, jump) in runs(&model, &paths).iter().zip(jumps) {
            assert_eq!(run["failure"], Value::Null, "{name} along {jump}");
        }
    }
}

/// Whether known physics was held fixed when the model was learned.
fn knows_physics(model: &ReducedModel) -> bool {
    let command = model.provenance().get("command").and_then(Value::as_str);
    command.is_some_and(|command| command.contains("--coordinates named"))
}

#[test]
fn shipped_models_with_named_coordinates_keep_known_physics() {
    for name in ["go1-d2", "go1-d4", "go1-d6", "go2-async-d4"] {
        let model = shipped(name);
        let invariance = Invariance::of(&model)
            .expect("of full rank")
            .expect("complete");
        if !knows_physics(&model) {
            continue;
        }
        for phase in &invariance.phases {
            let shifts = [phase.shift_x, phase.shift_y];
            assert!(
                shifts.iter().all(|shift| *shift < 1e-9),
                "{name}: {phase:?}"
            );
            assert!(phase.mirror_asymmetry < 1e-9, "{name}: {phase:?}");
        }
        let gravity = invariance.gravity_m_s2.expect("flight and body z");
        let off = gravity - romc::robot::GRAVITY_M_S2;
        assert!(off.abs() < 1e-9, "{name}: {gravity}");
        let mass = invariance.mass_kg.expect("contact and body z");
        assert!((5.0..30.0).contains(&mass), "{name}: {mass} kg");
    }
}

#[test]
fn invariance_finds_a_model_that_depends_on_the_place() {
    let model = shipped("go1-d4");
    let at = |change: f64| {
        let shifted = with_xi(&model, |term, value| match term {
            "z1" => value + change,
            _ => value,
        });
        let invariance = Invariance::of(&shifted)
            .expect("of full rank")
            .expect("complete");
        invariance
            .phases
            .iter()
            .map(|phase| phase.shift_x)
            .sum::<f64>()
    };
    assert!((at(1.0) - at(0.0)).abs() > 1e-3);
}

/// Each jump alone, as a user may have one. Accelerations ten times as large explain none of them.
#[test]
fn shipped_models_have_no_remark_on_a_right_jump_and_wrong_ones_do() {
    let mut wrong_noticed = 0;
    for name in ["go1-d4", "go1-d6"] {
        let model = shipped(name);
        let wrong = with_xi(&model, |_, xi| 10.0 * xi);
        for jump in 1..=8 {
            let path = format!("examples/recordings/go1-other/jump_{jump:02}.csv.gz");
            let recording = [recording::read(&Path::new(ROOT).join(&path)).expect("shipped")];
            let found = remarks(&model, &recording).expect("encodes");
            assert!(found.is_empty(), "{name} on {path}: {found:?}");
            wrong_noticed += remarks(&wrong, &recording).expect("encodes").len();
        }
    }
    assert_eq!(wrong_noticed, 16);
}

/// Copies with the right terms and wrong dynamics.
fn broken(model: &ReducedModel) -> [(&'static str, ReducedModel); 4] {
    let phases = |change: &dyn Fn(usize) -> DMatrix<f64>| {
        let phases = model.phases().iter().cloned().enumerate();
        let phases = phases.map(|(index, phase)| romc::model::Phase {
            xi: change(index),
            ..phase
        });
        let builder = model.clone().into_builder().phases(phases.collect());
        builder.build().expect("a model")
    };
    let xi = |index: usize| &model.phases()[index % model.phases().len()].xi;
    let columns = |xi: &DMatrix<f64>| {
        DMatrix::from_fn(xi.nrows(), xi.ncols(), |row, col| {
            xi[(row, (col + 1) % xi.ncols())]
        })
    };
    [
        ("negated", phases(&|index| -xi(index))),
        ("zeroed", phases(&|index| xi(index) * 0.0)),
        ("columns shuffled", phases(&|index| columns(xi(index)))),
        (
            "phases exchanged",
            phases(&|index| xi(index + model.phases().len() - 1).clone()),
        ),
    ]
}

fn verdict_on(model: &ReducedModel, paths: &[&str]) -> Verdict {
    let read = |path: &&str| recording::read(&Path::new(ROOT).join(path)).expect("shipped");
    let recordings: Vec<_> = paths.iter().map(read).collect();
    let assessment = Assessment::over(model, &recordings, 0.1).expect("encodes");
    let (verdict, unmeasured) = verdict_by_default(model, &recordings, &assessment, |_, _| {});
    assert!(unmeasured.is_none(), "{unmeasured:?}");
    verdict
}

/// A model that turns the wrong way in contact predicts the pitch worse than a constant velocity.
#[test]
fn pitch_that_is_wrong_makes_the_verdict_fail() {
    let model = shipped("go1-d7");
    let mut phases = model.phases().to_vec();
    phases[0].xi.column_mut(2).neg_mut();
    let wrong = model
        .into_builder()
        .phases(phases)
        .build()
        .expect("a model");
    let verdict = verdict_on(&wrong, &["examples/recordings/go1/test_02.csv.gz"]);
    let row = verdict
        .rows
        .iter()
        .find(|row| row.name.contains("body.pitch"));
    let row = row.expect("a row");
    assert_eq!((row.counts, row.passed), (true, Some(false)), "{row:?}");
    assert_eq!(verdict.failed[0], "0.1 s");
}

/// The threshold depends on constant velocity; a pendulum with the recorded forces can be better than a model that passes.
#[test]
fn best_baseline_of_a_row_is_the_best_of_all_and_a_better_one_is_reported() {
    let of_body_z = |model, jump| {
        let verdict = verdict_on(&shipped(model), &[jump]);
        let of = "error of body.z over 0.1 s";
        let row = verdict.rows.into_iter().find(|row| row.name == of);
        row.expect("a row")
    };
    let beaten = of_body_z(
        "go2-async-d4",
        "examples/recordings/go2-asynchronous/test_01.csv.gz",
    );
    let better = of_body_z("go1-d4", "examples/recordings/go1/test_02.csv.gz");
    for row in [&beaten, &better] {
        assert_eq!(row.passed, Some(true), "{row:?}");
        assert!(
            row.best_baseline_name != row.baseline_name && row.best_baseline < row.baseline,
            "{row:?}"
        );
    }
    assert!(
        beaten.is_beaten() && !better.is_beaten(),
        "{beaten:?} {better:?}"
    );
}

#[test]
fn every_row_that_praises_the_dynamics_falls_with_them() {
    let go1 = "examples/recordings/go1/test_02.csv.gz";
    let go2 = "examples/recordings/go2-asynchronous/test_01.csv.gz";
    let trot = "examples/recordings/go1-trot/test_02.csv.gz";
    let all = &["0.1 s", "whole motion", "torques", "control"][..];
    for (name, jump, fit) in [
        ("go1-d2", go1, &all[..2]),
        ("go1-d4", go1, all),
        ("go1-d6", go1, all),
        ("go1-d7", go1, all),
        ("go2-async-d4", go2, all),
        (
            "go1-trot-d6",
            trot,
            &["0.1 s", "a stride", "torques", "control"],
        ),
    ] {
        let model = shipped(name);
        let right = verdict_on(&model, &[jump]);
        assert_eq!(right.fit_for, fit, "{name}: {right:?}");
        // Three of the four phases of the trot have equal equations.
        let is_walk = fit.contains(&"a stride");
        let broken = broken(&model).into_iter();
        for (what, wrong) in broken.filter(|(what, _)| !(is_walk && *what == "phases exchanged")) {
            let wrong = verdict_on(&wrong, &[jump]);
            assert!(wrong.fit_for.is_empty(), "{name} {what}: {wrong:?}");
            assert!(right.fit_for.iter().all(|of| wrong.failed.contains(of)));
            for (right, wrong) in right.rows.iter().zip(&wrong.rows) {
                assert_eq!(right.name, wrong.name);
                let praises = right.counts && right.passed == Some(true);
                let falls = !praises || wrong.passed != Some(true);
                assert!(falls, "{name} {what}: {}", wrong.words());
            }
        }
    }
}

#[test]
fn shipped_models_are_fit_for_everything_on_jumps_of_their_robot() {
    let of = |folder: &str, names: &str, count: usize| -> Vec<String> {
        let name = |i| format!("examples/recordings/{folder}/{names}_0{i}.csv.gz");
        (1..=count).map(name).collect()
    };
    for jumps in [of("go1", "test", 3), of("go1-other", "jump", 8)] {
        let paths: Vec<&str> = jumps.iter().map(String::as_str).collect();
        for name in ["go1-d4", "go1-d6", "go1-d7"] {
            let verdict = verdict_on(&shipped(name), &paths);
            assert_eq!(verdict.fit_for.len(), 4, "{name}: {verdict:?}");
            // Pitch counts only for a model with a coordinate for it.
            let row = |of: &str| {
                let named = verdict.rows.iter().find(|row| row.name.contains(of));
                let row = named.expect("of every model");
                (row.counts, row.passed)
            };
            assert_eq!(
                row("body.pitch"),
                (name != "go1-d4", Some(name != "go1-d4"))
            );
            assert_eq!(row("the legs").1, Some(true));
            assert!(row("the legs").0 || name == "go1-d4", "{name}");
        }
        let verdict = verdict_on(&shipped("go1-d2"), &paths);
        assert_eq!(verdict.fit_for, ["0.1 s", "whole motion"], "{verdict:?}");
        assert_eq!(verdict.failed, ["torques", "control"], "{verdict:?}");
    }
}
