//! Models as trainers store them: standardised, in another order, under other names. Recordings determine the missing
//! information. `fixtures/import/go1-d4.json` is a model of the published input rule, like every import.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use nalgebra::{DMatrix, DVector};
use romc::artifact;
use romc::import::{Format, ImportOptions, Imported, import_from_bytes};
use romc::model::{Activation, CoordinateOrder, LibraryChoice, ReducedModel};
use zip::CompressionMethod;

use crate::command_line::{romc, text};
use crate::store::{Stored, list, model, npz, options_of, plain, safetensors};

fn mean() -> DVector<f64> {
    DVector::from_fn(18, |k, _| 0.3 * k as f64 - 2.0)
}

fn deviation() -> DVector<f64> {
    DVector::from_fn(18, |k, _| 0.2 + 0.05 * (k % 5) as f64)
}

/// go1-d4 as stored by a trainer that standardises `(x - mean) / deviation` in another order.
fn standardised(original: &ReducedModel, order: &CoordinateOrder) -> Vec<Stored> {
    let scaling = original.scaling().expect("factors");
    let (s_x, s_u) = (scaling.state.expand(18), scaling.input.expand(18));
    let (encoder, decoder) = (original.encoder().unwrap(), original.decoder().unwrap());
    let (mean, deviation) = (mean(), deviation());
    // W s_x x = (W s_x sd) ((x - m) / sd) + W s_x m.
    let rescale = s_x.component_mul(&deviation);
    let weights = encoder.weights() * DMatrix::from_diagonal(&rescale);
    let bias = encoder.bias() + encoder.weights() * s_x.component_mul(&mean);
    let back = DMatrix::from_diagonal(&rescale.map(|v| 1.0 / v));
    let out = &back * decoder.weights();
    let out_bias = &back * (decoder.bias() - s_x.component_mul(&mean));
    let to_file = |v: &DVector<f64>| DVector::from_fn(18, |k, _| v[order.places[k]]);
    let columns = |m: &DMatrix<f64>| {
        let columns: Vec<_> = order
            .places
            .iter()
            .map(|&k| m.column(k).into_owned())
            .collect();
        DMatrix::from_columns(&columns)
    };
    let mut tensors = vec![
        plain("net.encoder.0.weight", &columns(&weights)),
        list("net.encoder.0.bias", bias.as_slice()),
        plain(
            "net.decoder.0.weight",
            &columns(&out.transpose()).transpose(),
        ),
        list("net.decoder.0.bias", to_file(&out_bias).as_slice()),
        list("mean.state", to_file(&mean).as_slice()),
        list("std.state", to_file(&deviation).as_slice()),
        list("std.input", to_file(&s_u.map(|s| 1.0 / s)).as_slice()),
    ];
    for phase in original.phases() {
        let name = format!("net.sindy_coefficients.{}", phase.name);
        tensors.push(plain(&name, &phase.xi));
    }
    tensors
}

fn options(original: &ReducedModel) -> ImportOptions {
    ImportOptions {
        scaling: None,
        ..options_of(original)
    }
}

fn imported(tensors: &[Stored], options: &ImportOptions) -> Imported {
    let bytes = safetensors(tensors);
    import_from_bytes("net.safetensors", Format::Safetensors, &bytes, options).expect("imports")
}

#[test]
fn standardised_model_in_another_order_maps_states_as_the_original() {
    let original = model("tests/fixtures/import/go1-d4.json");
    let order: CoordinateOrder = "body,fl,fr,rl.kn,rl.hy,rl.hx,rr".parse().unwrap();
    let options = ImportOptions {
        order: Some(order.clone()),
        ..options(&original)
    };
    let found = imported(&standardised(&original, &order), &options);
    let notes: Vec<String> = found.report.notes.iter().map(ToString::to_string).collect();
    assert!(
        notes
            .iter()
            .any(|note| note.contains("went into the biases")),
        "{notes:?}"
    );
    assert!(
        notes.iter().any(|note| note.contains("order body,fl,fr")),
        "{notes:?}"
    );
    for seed in 0..20 {
        let x = DVector::from_fn(18, |k, _| ((seed * 18 + k) as f64 * 0.7).sin());
        let (z, expected) = (
            found.model.encode(&x).unwrap(),
            original.encode(&x).unwrap(),
        );
        assert!((&z - &expected).amax() < 1e-12, "{z} {expected}");
        let back = found.model.decode(&z).unwrap();
        assert!((back - original.decode(&expected).unwrap()).amax() < 1e-12);
        let (found, expected) = (found.model.tangent(&x), original.tangent(&x));
        assert!((found.unwrap().encode - expected.unwrap().encode).amax() < 1e-12);
    }
    let factors = found.model.input_factors().unwrap();
    let expected = original.input_factors().unwrap();
    assert!((factors - &expected).amax() < 1e-15 * expected.amax());
}

#[test]
fn deviation_of_zero_is_refused_with_its_index() {
    let original = model("tests/fixtures/import/go1-d4.json");
    let order: CoordinateOrder = "joints,body".parse().unwrap();
    let mut tensors = standardised(&original, &order);
    let mut still = deviation();
    still[14] = 0.0;
    tensors[5] = list("std.state", still.as_slice());
    let bytes = safetensors(&tensors);
    let error = import_from_bytes("n", Format::Safetensors, &bytes, &options(&original));
    let error = error.unwrap_err().to_string();
    assert!(
        error.contains("`std.state`[14]") && error.contains("found 0"),
        "{error}"
    );
}

#[test]
fn factors_of_states_alone_ask_for_those_of_the_inputs() {
    let original = model("tests/fixtures/import/go1-d4.json");
    let order: CoordinateOrder = "joints,body".parse().unwrap();
    let mut tensors = standardised(&original, &order);
    tensors.retain(|tensor| tensor.name != "std.input");
    let bytes = safetensors(&tensors);
    let error = import_from_bytes("n", Format::Safetensors, &bytes, &options(&original));
    let error = error.unwrap_err().to_string();
    assert!(error.contains("--input-scaling"), "{error}");
}

#[test]
fn factors_beside_deviations_are_refused() {
    let original = model("tests/fixtures/import/go1-d4.json");
    let order: CoordinateOrder = "joints,body".parse().unwrap();
    let bytes = safetensors(&standardised(&original, &order));
    let options = ImportOptions {
        scaling: Some(romc::model::Scaling::uniform(0.1)),
        ..options(&original)
    };
    let error = import_from_bytes("n", Format::Safetensors, &bytes, &options);
    let error = error.unwrap_err().to_string();
    assert!(
        error.contains("--scaling: found factors here and in tensors"),
        "{error}"
    );
}

#[test]
fn activations_of_trainers_are_taken() {
    let original = model("tests/fixtures/import/go1-d4.json");
    let xi = &original.phases()[0].xi;
    let weights =
        |rows, columns| DMatrix::from_fn(rows, columns, |i, j| ((i * 7 + j * 3) as f64).sin());
    let tensors = [
        plain("encoder.0.weight", &weights(9, 18)),
        plain("encoder.2.weight", &weights(4, 9)),
        plain("decoder.0.weight", &weights(9, 4)),
        plain("decoder.2.weight", &weights(18, 9)),
        plain("xi.contact", xi),
        plain("xi.flight", xi),
    ];
    for activation in Activation::ALL
        .into_iter()
        .filter(|phi| *phi != Activation::Linear)
    {
        let options = ImportOptions {
            activation: Some(activation),
            ..options_of(&original)
        };
        let found = imported(&tensors, &options).model;
        let text = artifact::to_text(&found);
        assert_eq!(
            artifact::read_from_bytes("m", text.as_bytes()).unwrap(),
            found
        );
        let layers = found.encoder_map().unwrap().layers();
        assert_eq!(layers[0].activation, activation);
    }
}

#[test]
fn terms_as_pysindy_names_them_are_read_and_equal_ones_are_one_in_equations() {
    let terms = ["1", "x0", "x1", "u0", "x0 x1", "sin(1 x0)", "1*x0", "x0^2"];
    let xi = [0.5, -2.0, 0.25, 3.0, 0.125, 1.5, -4.0, 2.0];
    let options = ImportOptions {
        name: "hopper".to_owned(),
        library: Some(LibraryChoice::Terms(terms.map(str::to_owned).to_vec())),
        latent_dim: Some(1),
        ..ImportOptions::default()
    };
    let bytes = npz(&[list("Xi", &xi)], CompressionMethod::Stored);
    let found = import_from_bytes("n.npz", Format::Npz, &bytes, &options)
        .unwrap()
        .model;
    assert_eq!(found.phases()[0].name, "always");
    assert!(found.phases()[0].feet.is_always());
    let one = |v: f64| DVector::from_element(1, v);
    let (z, dz, u): (f64, f64, f64) = (0.3, -0.7, 1.1);
    let ddz = found.ddz(0, &one(z), &one(dz), &one(u)).unwrap()[0];
    let expected =
        0.5 - 6.0 * z + 0.25 * dz + 3.0 * u + 0.125 * z * dz + 1.5 * z.sin() + 2.0 * z * z;
    assert!((ddz - expected).abs() < 1e-14, "{ddz} {expected}");
    let equations = romc::equations::Equations::of(&found);
    let n_terms = equations.phases[0].ddz[0].len();
    assert_eq!(n_terms, 7, "z1 and 1*z1 are one term");
}

pub fn jump() -> String {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    root.join("examples/recordings/go1/validation_01.csv.gz")
        .display()
        .to_string()
}

/// Imports tensors of go1-d4 and compares them with a jump.
fn compared(tensors: &[Stored], more: &[&str]) -> (Output, tempfile::TempDir) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("net.safetensors"), safetensors(tensors)).expect("writable");
    let jump = jump();
    let arguments = [
        &[
            "import",
            "net.safetensors",
            "--library",
            "degree=1,inputs",
            "--robot",
            "go1",
        ][..],
        &["--output", "net.json", "--inputs-from", &jump],
        more,
    ];
    (romc(folder.path(), &arguments.concat()), folder)
}

fn said(output: &Output) -> String {
    text(&[&output.stdout[..], &output.stderr[..]].concat())
}

fn own_order() -> CoordinateOrder {
    "joints,body".parse().unwrap()
}

/// go1-d4 over `x - mean` in SI units (all its states have the factor 0.1) in another order.
fn in_si(mean: &DVector<f64>, order: &CoordinateOrder) -> Vec<Stored> {
    let original = model("tests/fixtures/import/go1-d4.json");
    let (encoder, decoder) = (original.encoder().unwrap(), original.decoder().unwrap());
    let weights = encoder.weights() * 0.1;
    let places = || order.places.iter();
    let columns: Vec<_> = places().map(|&k| weights.column(k).into_owned()).collect();
    let out = decoder.weights() * 10.0;
    let rows: Vec<_> = places().map(|&k| out.row(k).into_owned()).collect();
    let out_bias = decoder.bias() * 10.0 - mean;
    let out_bias: Vec<f64> = places().map(|&k| out_bias[k]).collect();
    let mut tensors = vec![
        plain("encoder.weight", &DMatrix::from_columns(&columns)),
        list(
            "encoder.bias",
            (encoder.bias() + &weights * mean).as_slice(),
        ),
        plain("decoder.weight", &DMatrix::from_rows(&rows)),
        list("decoder.bias", &out_bias),
    ];
    for phase in original.phases() {
        tensors.push(plain(&format!("xi.{}", phase.name), &phase.xi));
    }
    tensors
}

/// The factors of go1-d4's inputs for encoder weights in SI units, in an order.
pub fn input_factors(order: &CoordinateOrder) -> String {
    let factors = model("tests/fixtures/import/go1-d4.json")
        .input_factors()
        .unwrap()
        * 0.1;
    let factors = order.places.map(|k| factors[k].to_string());
    factors.join(",")
}

#[test]
fn wrong_scaling_is_refused_with_the_factor_that_fits() {
    let tensors = in_si(&DVector::zeros(18), &own_order());
    let factors = input_factors(&own_order());
    let (wrong, folder) = compared(
        &tensors,
        &["--scaling", "0.01", "--input-scaling", &factors],
    );
    assert_eq!(wrong.status.code(), Some(1));
    let text = said(&wrong);
    assert!(
        text.contains("expected --scaling 1;") && text.contains("--unchecked"),
        "{text}"
    );
    assert!(!folder.path().join("net.json").exists());
    let (all_the_same, folder) = compared(&tensors, &["--scaling", "0.01", "--unchecked"]);
    assert!(all_the_same.status.success(), "{}", said(&all_the_same));
    assert!(said(&all_the_same).contains("warning: decode(encode(x)) misses"));
    assert!(folder.path().join("net.json").exists());
}

#[test]
fn an_order_that_does_not_fit_is_refused_without_another_reason() {
    let tensors = in_si(&DVector::zeros(18), &own_order());
    let factors = input_factors(&own_order());
    let options = [
        "--scaling",
        "1",
        "--input-scaling",
        &factors,
        "--order",
        "hx,hy,kn,body",
    ];
    let (wrong, _folder) = compared(&tensors, &options);
    assert_eq!(wrong.status.code(), Some(1), "{}", said(&wrong));
    let text = said(&wrong);
    assert!(
        text.contains("misses the recordings by") && !text.contains("mean.state"),
        "{text}"
    );
}

#[test]
fn wrench_frame_is_that_of_the_trainer() {
    let tensors = in_si(&DVector::zeros(18), &own_order());
    let factors = input_factors(&own_order());
    let options = ["--scaling", "1", "--input-scaling", &factors];
    let frame_of = |more: &[&str]| {
        let (done, folder) = compared(&tensors, &[&options[..], more].concat());
        assert!(done.status.success(), "{}", said(&done));
        let model = artifact::read(&folder.path().join("net.json")).unwrap();
        (model.wrench_frame().name(), said(&done))
    };
    let (frame, text) = frame_of(&[]);
    assert!(
        frame == "body" && text.contains("along the body's axes"),
        "{text}"
    );
    let (frame, text) = frame_of(&["--wrench-frame", "world"]);
    assert!(frame == "world" && !text.contains("body's axes"), "{text}");
}

#[test]
fn another_order_is_refused_with_the_order_that_fits() {
    let order: CoordinateOrder = "body,fl,fr,rl,rr".parse().unwrap();
    let tensors = in_si(&DVector::zeros(18), &order);
    let factors = input_factors(&order);
    let options = ["--scaling", "1", "--input-scaling", &factors];
    let (wrong, _folder) = compared(&tensors, &options);
    assert_eq!(wrong.status.code(), Some(1), "{}", said(&wrong));
    assert!(
        said(&wrong).contains("expected --order body,f"),
        "{}",
        said(&wrong)
    );
    let (right, folder) = compared(
        &tensors,
        &[&options[..], &["--order", "body,fl,fr,rl,rr"]].concat(),
    );
    assert!(right.status.success(), "{}", said(&right));
    let found = artifact::read(&folder.path().join("net.json")).unwrap();
    let original = model("tests/fixtures/import/go1-d4.json");
    let (x, u) = (
        DVector::from_fn(18, |k, _| (k as f64 * 0.7).sin()),
        DVector::from_fn(18, |k, _| 10.0 * (k as f64 * 1.3).cos()),
    );
    let (of_found, expected) = (found.tangent(&x).unwrap(), original.tangent(&x).unwrap());
    assert!((of_found.encode - expected.encode).amax() < 1e-14);
    assert!((of_found.project * &u - expected.project * &u).amax() < 1e-10);
}

#[test]
fn wrong_factors_of_inputs_are_refused_with_the_factor_that_fits() {
    let tensors = in_si(&DVector::zeros(18), &own_order());
    let original = model("tests/fixtures/import/go1-d4.json")
        .input_factors()
        .unwrap();
    let factors: Vec<String> = original.iter().map(|f| (10.0 * f).to_string()).collect();
    let options = ["--scaling", "1", "--input-scaling", &factors.join(",")];
    let (wrong, _folder) = compared(&tensors, &options);
    assert_eq!(wrong.status.code(), Some(1), "{}", said(&wrong));
    let text = said(&wrong);
    assert!(
        text.contains("with the inputs times 0.01") && text.contains("--input-scaling"),
        "{text}"
    );
}

#[test]
fn mean_that_is_not_in_the_file_is_named() {
    let recording = romc::recording::read(Path::new(&jump())).expect("checked in");
    let x = &recording.segments[0].x;
    let mean = x.column_mean();
    let mut tensors = in_si(&mean, &own_order());
    let factors = input_factors(&own_order());
    let options = ["--scaling", "1", "--input-scaling", &factors];
    let (wrong, _folder) = compared(&tensors, &options);
    assert_eq!(wrong.status.code(), Some(1), "{}", said(&wrong));
    assert!(
        said(&wrong).contains("expected a tensor mean.state"),
        "{}",
        said(&wrong)
    );
    tensors.push(list("mean.state", mean.as_slice()));
    let (right, _folder) = compared(&tensors, &options);
    assert!(right.status.success(), "{}", said(&right));
}
