//! Files that NumPy, safetensors and PySINDy wrote (`fixtures/import/make.py`).

use std::fs;
use std::path::{Path, PathBuf};

use nalgebra::{DMatrix, DVector};
use romc::import::run::Layout;
use romc::import::*;
use romc::model::{LibraryChoice, LibraryOrder, Scaling, StandardLibrary};
use serde_json::Value;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/fixtures/import")
        .join(name)
}

fn expected() -> Value {
    let bytes = fs::read(fixture("expected.json")).expect("checked in");
    serde_json::from_slice(&bytes).expect("JSON")
}

fn numbers(value: &Value) -> Vec<f64> {
    let list = value.as_array().expect("a list");
    list.iter().map(|v| v.as_f64().expect("a number")).collect()
}

fn rows(value: &Value) -> DMatrix<f64> {
    let rows: Vec<Vec<f64>> = value
        .as_array()
        .expect("rows")
        .iter()
        .map(numbers)
        .collect();
    DMatrix::from_fn(rows.len(), rows[0].len(), |row, column| rows[row][column])
}

fn options() -> ImportOptions {
    ImportOptions {
        name: "foreign".to_owned(),
        library: Some(LibraryChoice::Standard(StandardLibrary::default())),
        library_order: Some(LibraryOrder::ROMC),
        scaling: Some(Scaling::uniform(0.1)),
        robot: Some(romc::robot_file::by_name("go1").expect("registered")),
        ..ImportOptions::default()
    }
}

fn mappings(texts: &[&str]) -> Vec<Mapping> {
    let mappings = texts.iter().map(|text| text.parse().expect("a mapping"));
    mappings.collect()
}

#[test]
fn file_of_numpy_imports_with_row_vectors_fortran_order_and_mask() {
    let expected = expected();
    let mut options = options();
    options.mapping = mappings(&[
        "encoder.weight=W_e",
        "encoder.bias=b_e",
        "decoder.weight=W_d",
        "decoder.bias=b_d",
    ]);
    let imported = import(&fixture("numpy.npz"), &options).expect("as NumPy wrote it");
    let model = &imported.model;
    let encoder = model.encoder().expect("an encoder");
    assert_eq!(*encoder.weights(), rows(&expected["encoder"]["weights"]));
    let single = &expected["single"];
    assert_eq!(encoder.bias().as_slice(), numbers(&single["encoder_bias"]));
    let decoder = model.decoder().expect("a decoder");
    assert_eq!(*decoder.weights(), rows(&expected["decoder"]["weights"]));
    assert_eq!(decoder.bias().as_slice(), numbers(&single["decoder_bias"]));
    assert_eq!(model.phases()[0].xi, rows(&expected["contact"]));
    assert_eq!(model.phases()[1].xi, rows(&expected["flight"]));
    let layouts: Vec<(&str, Layout)> = (imported.report.used.iter())
        .map(|used| (used.tensor.as_str(), used.layout))
        .collect();
    assert_eq!(
        layouts,
        [
            ("W_e", Layout::Row),
            ("b_e", Layout::Plain),
            ("W_d", Layout::Row),
            ("b_d", Layout::Plain),
            ("xi_contact", Layout::TermsByLatent),
            ("mask_contact", Layout::TermsByLatent),
            ("xi_flight", Layout::LatentByTerms),
        ]
    );
    assert_eq!(imported.report.unused[0].tensor, "epochs");
}

#[test]
fn state_dict_in_safetensors_imports_with_column_vectors() {
    let single = &expected()["single"];
    let mut options = options();
    options.mapping = mappings(&[
        "xi.contact=sindy_coefficients.contact",
        "xi.flight=sindy_coefficients.flight",
    ]);
    let imported = import(&fixture("torch.safetensors"), &options).expect("as PyTorch saves it");
    let model = &imported.model;
    let encoder = model.encoder().expect("an encoder");
    assert_eq!(*encoder.weights(), rows(&single["encoder_weights"]));
    assert_eq!(encoder.bias().as_slice(), numbers(&single["encoder_bias"]));
    assert_eq!(model.phases()[0].xi, rows(&single["contact"]));
    assert_eq!(model.phases()[1].xi, rows(&single["flight"]));
    assert_eq!(imported.report.used[0].layout, Layout::Column);
    assert!(imported.report.unused.is_empty());
    assert_eq!(
        model.state().expect("names of the robot").names[14],
        "body.z"
    );
    let provenance = model.provenance();
    assert_eq!(provenance["imported_from"], "torch.safetensors");
    assert_eq!(
        provenance["tensors"]["encoder.0.weight"]["tensor"],
        "autoencoder.encoder.0.weight"
    );
}

#[test]
fn export_of_pysindy_imports_with_its_predictions() {
    let expected = expected();
    let options = ImportOptions {
        name: "pysindy".to_owned(),
        library: Some(LibraryChoice::Terms(
            read_terms(&fixture("pysindy.terms.json")).expect("a list of terms"),
        )),
        latent_dim: Some(2),
        ..ImportOptions::default()
    };
    let imported = import(&fixture("pysindy.npz"), &options).expect("as the script wrote it");
    let points = rows(&expected["pysindy"]["points"]);
    let ddz = rows(&expected["pysindy"]["ddz"]);
    for sample in 0..points.nrows() {
        let part = |from: usize| DVector::from_fn(2, |k, _| points[(sample, from + k)]);
        let found = imported.model.ddz(0, &part(0), &part(2), &part(4));
        let found = found.expect("evaluates");
        for output in 0..2 {
            let difference = (found[output] - ddz[(sample, output)]).abs();
            assert!(difference < 1e-13, "{sample} {output}: {difference:e}");
        }
    }
}
