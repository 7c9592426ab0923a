//! Names that trainers give to tensors: each tensor is used, named as unused, or refused.

use nalgebra::{DMatrix, DVector};
use romc::import::role::Role;
use romc::import::*;
use romc::model::{Activation, LibraryChoice, Scaling};
use zip::CompressionMethod;

use super::store::{Stored, list, npz, plain};

fn wave(rows: usize, columns: usize, seed: f64) -> DMatrix<f64> {
    DMatrix::from_fn(rows, columns, |i, j| {
        (seed + 1.3 * i as f64 + 0.7 * (j * j) as f64).sin()
    })
}

fn options(library: &str) -> ImportOptions {
    let terms = library.split("; ").map(str::to_owned);
    ImportOptions {
        name: "net".to_owned(),
        library: Some(LibraryChoice::Terms(terms.collect())),
        scaling: Some(Scaling::uniform(0.1)),
        ..ImportOptions::default()
    }
}

/// Coefficients alone.
fn latent(library: &str) -> ImportOptions {
    ImportOptions {
        scaling: None,
        ..options(library)
    }
}

fn run(stored: &[Stored], options: &ImportOptions) -> Result<Imported, ImportError> {
    let bytes = npz(stored, CompressionMethod::Stored);
    import_from_bytes("net.npz", Format::Npz, &bytes, options)
}

fn refusal(stored: &[Stored], options: &ImportOptions) -> String {
    run(stored, options).expect_err("refused").to_string()
}

const TERMS: &str = "z1; z2; dz1; u2";

#[test]
fn variables_of_keras_by_their_paths_are_an_autoencoder() {
    let bias = |rows: usize| DVector::from_fn(rows, |i, _| 0.1 * i as f64 - 0.2);
    let layers = [
        ("model/encoder/dense", 5, 4),
        ("model/encoder/dense_1", 4, 2),
        ("model/decoder/dense_2", 2, 4),
        ("model/decoder/dense_3", 4, 5),
    ];
    let mut stored = vec![plain("xi_contact", &wave(4, 2, 0.2))];
    for (name, inputs, outputs) in layers {
        stored.push(plain(
            &format!("{name}/kernel"),
            &wave(inputs, outputs, 0.3),
        ));
        stored.push(list(&format!("{name}/bias"), bias(outputs).as_slice()));
    }
    stored.push(plain("model/encoder/dense/kernel/Adam", &wave(5, 4, 0.9)));
    let options = ImportOptions {
        activation: Some(Activation::Tanh),
        ..options(TERMS)
    };
    let found = run(&stored, &options).expect("a chain of layers");
    let unused: Vec<&str> = found
        .report
        .unused
        .iter()
        .map(|t| t.tensor.as_str())
        .collect();
    assert_eq!(unused, ["model/encoder/dense/kernel/Adam"]);
    let x = DVector::from_row_slice(&[3.0, -4.0, 1.0, 7.0, -2.0]);
    let hidden = (wave(5, 4, 0.3).transpose() * &x * 0.1 + bias(4)).map(f64::tanh);
    let expected = wave(4, 2, 0.3).transpose() * hidden + bias(2);
    assert!((found.model.encode(&x).expect("fits") - expected).amax() < 1e-14);
}

#[test]
fn kernel_of_the_decoder_is_no_encoder() {
    // `v.name` of every Keras layer: the last one's arrays are the file's.
    let stored = [
        plain("kernel", &wave(2, 5, 0.1)),
        plain("xi", &wave(4, 2, 0.2)),
    ];
    let mapped = |text: &str| ImportOptions {
        mapping: vec![text.parse().expect("a mapping")],
        ..options(TERMS)
    };
    let said = refusal(&stored, &mapped("encoder.weight=kernel"));
    assert!(
        said.contains("found 2 x 5, expected n x d (row vectors, as Keras"),
        "{said}"
    );
    let found = run(&stored, &mapped("decoder.weight=kernel")).expect("a decoder");
    assert_eq!(
        found.model.decoder().expect("linear").weights()[(1, 0)],
        wave(2, 5, 0.1)[(0, 1)]
    );
}

#[test]
fn masks_switch_the_coefficients_of_their_phase_off() {
    let xi = wave(4, 2, 0.3);
    let mask = DMatrix::from_fn(4, 2, |i, j| f64::from((i + j) % 2 == 0));
    let off = xi.component_mul(&mask);
    for name in [
        "coefficient_mask",
        "mask",
        "xi_mask",
        "xi.contact.mask",
        "net/contact/sparsity_mask",
        "Mask_contact",
    ] {
        let found = run(
            &[plain("xi_contact", &xi), plain(name, &mask)],
            &latent(TERMS),
        );
        assert_eq!(found.expect(name).model.phases()[0].xi, off, "{name}");
    }
    let phases = [plain("contact.xi", &xi), plain("flight.xi", &xi)];
    let both = [
        plain("coefficient_mask.contact", &mask),
        plain("flight_mask", &mask.map(|on| 1.0 - on)),
    ];
    let found = run(&[&phases[..], &both].concat(), &latent(TERMS)).expect("a mask for each");
    assert_eq!(found.model.phases()[0].xi, off);
    assert_eq!(found.model.phases()[1].xi, &xi - off);
    let one = [&phases[..], &[plain("coefficient_mask", &mask)]].concat();
    assert_eq!(
        refusal(&one, &latent(TERMS)),
        "net.npz: found `coefficient_mask` (4 x 2) for none of the phases contact, flight, expected --map \
         mask.PHASE=coefficient_mask, or a file without it"
    );
    let strange = [plain("xi_contact", &xi), plain("mask.rear", &mask)];
    assert!(
        refusal(&strange, &latent(TERMS))
            .contains("`mask.rear` (4 x 2) for none of the phases contact")
    );
}

#[test]
fn options_of_maps_are_refused_without_one_and_the_tensors_left_are_named() {
    let stored = [
        plain("enc.W", &wave(2, 18, 0.1)),
        list("enc.b", &[0.0; 2]),
        plain("xi_contact", &wave(4, 2, 0.2)),
    ];
    let go1 = romc::robot_file::by_name("go1").expect("registered");
    let with_robot = ImportOptions {
        robot: Some(go1),
        ..latent(TERMS)
    };
    for (option, options) in [("--scaling", options(TERMS)), ("--robot", with_robot)] {
        assert_eq!(
            refusal(&stored, &options),
            format!(
                "net.npz: found {option}, but no tensor for encoder.weight or decoder.weight; left are \
                 `enc.W` (2 x 18), `enc.b` (2 numbers), expected --map encoder.weight=TENSOR and so on, or \
                 no {option}"
            )
        );
    }
    let found = run(&stored, &latent(TERMS)).expect("equations alone, as asked for");
    assert_eq!(found.report.unused.len(), 2);
}

#[test]
fn a_layers_number_may_end_the_name_of_its_tensors() {
    // As the code of Champion et al. names them.
    let mut stored = vec![plain("sindy_coefficients", &wave(4, 2, 0.2))];
    for (name, widths) in [("encoder", [5, 4, 2]), ("decoder", [2, 4, 5])] {
        for layer in 0..2 {
            let (inputs, outputs) = (widths[layer], widths[layer + 1]);
            let seed = 0.3 + layer as f64;
            stored.push(plain(
                &format!("{name}_W{layer}"),
                &wave(inputs, outputs, seed),
            ));
            stored.push(list(&format!("{name}_b{layer}"), &vec![0.1; outputs]));
        }
    }
    let options = ImportOptions {
        activation: Some(Activation::Sigmoid),
        phases: vec!["always=always".parse().expect("a rule")],
        ..options(TERMS)
    };
    let found = run(&stored, &options).expect("a chain of layers");
    assert!(found.report.unused.is_empty());
    let x = DVector::from_row_slice(&[3.0, -4.0, 1.0, 7.0, -2.0]);
    let hidden = wave(5, 4, 0.3).transpose() * &x * 0.1 + DVector::from_element(4, 0.1);
    let hidden = hidden.map(|a| 1.0 / (1.0 + (-a).exp()));
    let expected = wave(4, 2, 1.3).transpose() * hidden + DVector::from_element(2, 0.1);
    assert!((found.model.encode(&x).expect("fits") - expected).amax() < 1e-14);
}

#[test]
fn unused_tensors_that_are_a_missing_map_or_a_mask_are_refused() {
    let mut stored = vec![
        plain("decoder.weight", &wave(5, 2, 0.1)),
        plain("xi_contact", &wave(4, 2, 0.2)),
    ];
    run(&stored, &options(TERMS)).expect("a decoder alone");
    stored.push(plain("Adam/encode.weight/m", &wave(2, 5, 0.3)));
    run(&stored, &options(TERMS)).expect("what an optimiser keeps is no map");
    stored.push(plain("encode.weight", &wave(2, 5, 0.3)));
    assert_eq!(
        refusal(&stored, &options(TERMS)),
        "net.npz: found no encoder, and `encode.weight` (2 x 5) unused, which has its shape, expected --map \
         encoder.weight=encode.weight, or a file without it"
    );
    stored.truncate(2);
    let flags = DMatrix::from_fn(2, 4, |i, j| f64::from(u8::from(i == j)));
    stored.push(plain("support", &flags));
    assert_eq!(
        refusal(&stored, &options(TERMS)),
        "net.npz: found `support` (2 x 4) unused, zeros and ones in the shape of xi.contact, expected --map \
         mask.contact=support (0 switches a coefficient off), or a file without it"
    );
    stored[2] = plain("support", &DMatrix::from_element(2, 4, 1.0));
    run(&stored, &options(TERMS)).expect("ones alone switch nothing off");
    stored[2] = plain("coefficient_masks", &flags);
    let found = run(&stored, &options(TERMS)).expect("a mask by its name");
    let kept = found.model.phases()[0].xi.iter().filter(|v| **v != 0.0);
    assert_eq!(kept.count(), 2);
}

#[test]
fn tensors_of_an_encoder_that_are_no_linear_layer_are_refused() {
    let mut stored = vec![
        plain("net.encoder.0.weight", &wave(2, 5, 0.1)),
        plain("net.encoder.1.running_mean", &wave(2, 1, 0.1)),
        plain("xi_contact", &wave(4, 2, 0.2)),
    ];
    let said = refusal(&stored, &options(TERMS));
    assert!(
        said.contains("`net.encoder.1.running_mean` (2 x 1) in the encoder"),
        "{said}"
    );
    stored[1].name = "mean_input".to_owned();
    assert!(refusal(&stored, &options(TERMS)).contains("u_lat has no mean"));
    stored[1].name = "optimizer.net.encoder.0.weight".to_owned();
    assert_eq!(
        run(&stored, &options(TERMS))
            .expect("a linear layer")
            .report
            .unused
            .len(),
        1
    );
}

#[test]
fn maps_that_do_not_belong_together_are_noted() {
    let encoder = wave(2, 5, 0.1);
    let mut stored = vec![
        plain("encoder", &encoder),
        plain(
            "decoder",
            &encoder.clone().pseudo_inverse(1e-9).expect("full rank"),
        ),
        plain("xi_contact", &wave(4, 2, 0.2)),
    ];
    let has_note = |stored: &[Stored]| {
        let report = run(stored, &options(TERMS)).expect("two maps").report;
        report
            .notes
            .iter()
            .any(|note| note.starts_with("encode(decode(z)) differs from z by "))
    };
    assert!(!has_note(&stored));
    let turned = -encoder.pseudo_inverse(1e-9).expect("full rank");
    stored[1] = plain("decoder", &turned);
    assert!(has_note(&stored));
}

#[test]
fn names_that_count_from_one_keep_their_places() {
    let xi = wave(4, 1, 0.4);
    let of = |library: &str| run(&[plain("xi_contact", &xi)], &latent(library));
    let terms = |library: &str| of(library).expect(library).report.terms.join("; ");
    assert_eq!(terms("1; x1; x2; u1"), "1; z1; dz1; u1");
    assert_eq!(terms("1; x0; x1; u0"), "1; z1; dz1; u1");
    let said = of("1; x1; x1^2; x1^3")
        .expect_err("x1 may be z1 or dz1")
        .to_string();
    assert!(
        said.starts_with("--library: found names x without x0 and x2"),
        "{said}"
    );
}

#[test]
fn two_arrays_of_one_name_are_refused() {
    let stored = [
        plain("xi_contact", &wave(4, 1, 0.1)),
        plain("xi_contacu", &wave(4, 1, 0.2)),
    ];
    let mut bytes = npz(&stored, CompressionMethod::Stored);
    for at in 0..bytes.len() - 10 {
        if bytes[at..].starts_with(b"xi_contacu") {
            bytes[at + 9] = b't';
        }
    }
    let error = import_from_bytes("n.npz", Format::Npz, &bytes, &latent("1; z1; dz1; u1"));
    let said = error.expect_err("one of two").to_string();
    assert!(said.contains("two arrays of one name"), "{said}");
}

#[test]
fn role_text_reads_back() {
    let names = "encoder.weight decoder.bias encoder.0.weight decoder.12.bias xi.contact \
                 mask.rear_stance input_mean.contact input_covariance.contact scaling.state \
                 scaling.input mean.state std.state std.input";
    for text in names.split_whitespace() {
        let role: Role = text.parse().expect("the name of a part");
        assert_eq!(role.to_string(), text);
        assert_eq!(Role::of_name(&text.replace('.', "_")), Some(role));
    }
}

#[test]
fn names_are_those_of_parts_alone_or_behind_modules() {
    let named = |name| Role::of_name(name).map(|role| role.to_string());
    for (name, expected) in [
        ("module.encoder.weight", Some("encoder.weight")),
        ("net/decoder.2.bias", Some("decoder.2.bias")),
        ("model.xi.rear.stance", Some("xi.rear.stance")),
        ("autoencoder.sindy_coefficients.contact", Some("xi.contact")),
        ("Xi", Some("xi.always")),
        ("net.sindy_coefficients", Some("xi.always")),
        ("normalizer.mean_state", Some("mean.state")),
        ("mean.input", None),
        ("W_e", None),
        ("encoder.weight.mean", None),
        ("encoder.running_mean", None),
        ("myencoder.weight", None),
        ("encoder/kernel:0", Some("encoder.weight")),
        (
            "autoencoder/encoder/dense_1/kernel",
            Some("encoder.1.weight"),
        ),
        ("encoder/dense/bias", Some("encoder.0.bias")),
        ("encoder/kernel/Adam_1", None),
        (
            "encoder/layer-2/kernel/.ATTRIBUTES/VARIABLE_VALUE",
            Some("encoder.2.weight"),
        ),
        (
            "net.decoder.layers.4.linear.weight",
            Some("decoder.4.weight"),
        ),
        ("net.Decoder", Some("decoder.weight")),
        ("Xi_contact", Some("xi.contact")),
        ("coefficient_mask", Some("mask.always")),
        ("xi_mask", Some("mask.always")),
        ("flight.sparsity_mask", Some("mask.always")),
        ("xi.", None),
        ("", None),
    ] {
        assert_eq!(named(name).as_deref(), expected, "{name}");
    }
}
