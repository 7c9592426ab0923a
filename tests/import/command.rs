//! `romc import` from outside: exit codes, output, files.

use std::fs;
use std::path::Path;

use romc::artifact;
use romc::recording;
use zip::CompressionMethod;

use crate::command_line::{romc, text};
use crate::store::{list, model, npz, plain};

const EQUATIONS: &str = "[contact]\nddz1 = 0.5 - 2*z1 + u1\n[flight]\nddz1 = -1\n";

#[test]
fn command_writes_a_model_and_tells_what_it_read() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("hopper.txt"), EQUATIONS).expect("writable");
    let arguments = ["import", "hopper.txt", "--output", "hopper.json"];
    let first = romc(folder.path(), &arguments);
    assert!(first.status.success(), "{}", text(&first.stderr));
    let said = text(&first.stdout);
    assert!(
        said.contains("note: phase flight is selected by feet `none`"),
        "{said}"
    );
    assert!(said.contains("hopper.json: model `hopper`\n"), "{said}");
    assert!(said.contains("Equations only: use `compile`"), "{said}");
    let model = artifact::read(&folder.path().join("hopper.json")).expect("a model file");
    assert_eq!(model.phases()[0].xi.as_slice(), [0.5, -2.0, 1.0]);

    let again = romc(folder.path(), &arguments);
    assert_eq!(again.status.code(), Some(1));
    assert!(
        text(&again.stderr).contains("--force"),
        "{}",
        text(&again.stderr)
    );
    let forced = romc(
        folder.path(),
        &[&arguments[..], &["--force", "--json"]].concat(),
    );
    assert!(forced.status.success());
    let answer: serde_json::Value = serde_json::from_slice(&forced.stdout).expect("one object");
    assert_eq!(answer["command"], "import");
    assert_eq!(answer["report"]["equations"][0]["terms"], 3);
}

#[test]
fn command_that_fails_leaves_no_file() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("bad.txt"), "[contact]\nddz1 = 2*zz\n").expect("writable");
    let failed = romc(
        folder.path(),
        &["import", "bad.txt", "--output", "bad.json"],
    );
    assert_eq!(failed.status.code(), Some(1));
    assert!(failed.stdout.is_empty());
    let said = text(&failed.stderr);
    assert!(said.contains("bad.txt:2:10: found `zz`"), "{said}");
    let left = fs::read_dir(folder.path()).expect("readable").count();
    assert_eq!(left, 1, "only the file to import");
}

#[test]
fn command_with_wrong_usage_ends_with_two() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for wrong in [
        ["--map", "foo=bar"],
        ["--phase", "contact"],
        ["--library", "degree=x"],
    ] {
        let arguments = [&["import", "a.npz", "--output", "a.json"][..], &wrong].concat();
        assert_eq!(
            romc(folder.path(), &arguments).status.code(),
            Some(2),
            "{wrong:?}"
        );
    }
}

/// Writes the arrays of go1-d4 without the input statistics, and returns the options that import them.
fn go1_arrays(folder: &Path) -> Vec<String> {
    let model = model("models/go1-d4.json");
    let (encoder, decoder) = (model.encoder(), model.decoder());
    let (encoder, decoder) = (encoder.expect("linear"), decoder.expect("linear"));
    let mut tensors = vec![
        plain("encoder.weight", encoder.weights()),
        list("encoder.bias", encoder.bias().as_slice()),
        plain("decoder.weight", decoder.weights()),
        list("decoder.bias", decoder.bias().as_slice()),
    ];
    for phase in model.phases() {
        tensors.push(plain(&format!("xi_{}", phase.name), &phase.xi));
    }
    let bytes = npz(&tensors, CompressionMethod::Stored);
    fs::write(folder.join("net.npz"), bytes).expect("writable");
    let scaling = model.scaling().expect("scaling");
    let factors = |factors: &romc::model::ScaleFactors| {
        let factors: Vec<String> = factors.expand(18).iter().map(f64::to_string).collect();
        factors.join(",")
    };
    [
        "import",
        "net.npz",
        "--library",
        "degree=1,inputs",
        "--robot",
        "go1",
        "--scaling",
        &factors(&scaling.state),
        "--input-scaling",
        &factors(&scaling.input),
        "--output",
        "net.json",
    ]
    .map(str::to_owned)
    .to_vec()
}

#[test]
fn command_takes_input_statistics_from_recordings() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let jump =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/recordings/go1/validation_01.csv.gz");
    let mut arguments = go1_arrays(folder.path());
    arguments.extend(["--inputs-from".to_owned(), jump.display().to_string()]);
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = romc(folder.path(), &arguments);
    assert!(done.status.success(), "{}", text(&done.stderr));
    assert!(!text(&done.stdout).contains("No input statistics"));

    let imported = artifact::read(&folder.path().join("net.json")).expect("a model file");
    let segment = &recording::read(&jump).expect("checked in").segments[0];
    let flight = (0..imported.phases().len())
        .find(|&phase| imported.phases()[phase].name == "flight")
        .expect("go1 flies");
    // In flight there is no force, and the mean joint torques are those of the file.
    let statistics = imported.input_statistics(flight).expect("given");
    let airborne = (0..segment.len()).filter(|&k| segment.feet[k] == [false; 4]);
    let torques: Vec<f64> = airborne.map(|k| segment.torque_nm[(4, k)]).collect();
    let mean = torques.iter().sum::<f64>() / torques.len() as f64;
    let variance = torques.iter().map(|t| (t - mean).powi(2)).sum::<f64>() / torques.len() as f64;
    assert!((statistics.mean[4] - mean).abs() < 1e-12 * (1.0 + mean.abs()));
    assert!((statistics.covariance[(4, 4)] - variance).abs() < 1e-12 * (1.0 + variance));
    assert!(
        statistics
            .mean
            .rows(12, 6)
            .iter()
            .all(|force| *force == 0.0)
    );
}

#[test]
fn report_of_a_model_without_input_statistics_leaves_the_controller_out() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let arguments = go1_arrays(folder.path());
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = romc(folder.path(), &arguments);
    assert!(done.status.success(), "{}", text(&done.stderr));
    assert!(text(&done.stdout).contains("--inputs-from"));

    let jump = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/recordings/go1/test_01.csv.gz");
    let jump = jump.display().to_string();
    let report = romc(
        folder.path(),
        &["report", "net.json", &jump, "--output", "page.html"],
    );
    // The verdict of a model without a controller does not matter here.
    assert!(
        matches!(report.status.code(), Some(0 | 1)),
        "{}",
        text(&report.stderr)
    );
    let page = fs::read_to_string(folder.path().join("page.html")).expect("a page");
    assert!(page.contains("The controller did not run"));
    assert!(page.contains("<h2 id=\"aslip\">Compared with the "));

    let controlled = romc(folder.path(), &["mpc", "net.json", &jump]);
    assert_eq!(controlled.status.code(), Some(1));
    let said = text(&controlled.stderr);
    assert!(
        said.contains("input_statistics") && said.contains("--inputs-from"),
        "{said}"
    );
}
