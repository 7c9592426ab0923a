//! Every fault of a file of tensors, and its message.

use std::path::Path;

use nalgebra::{DMatrix, DVector};
use romc::files::Fault;
use romc::import::*;
use romc::model::{Activation, LibraryChoice, ModelError, Scaling};
use zip::CompressionMethod;

use super::store::*;

/// Encoder 2 x 5, decoder 5 x 2, `degree=1,inputs` (7 terms) in contact.
fn small() -> Vec<Stored> {
    let wave = |rows, columns, k: f64| {
        DMatrix::from_fn(rows, columns, |r, c| ((r * 7 + c * 3) as f64 + k).sin())
    };
    vec![
        plain("encoder.weight", &wave(2, 5, 0.1)),
        list("encoder.bias", &[0.1, 0.2]),
        plain("decoder.weight", &wave(5, 2, 0.2)),
        list("decoder.bias", &[0.0; 5]),
        plain("xi.contact", &wave(7, 2, 0.3)),
    ]
}

fn options() -> ImportOptions {
    ImportOptions {
        name: "small".to_owned(),
        library: Some(LibraryChoice::Standard(
            parse_standard("degree=1,inputs").expect("a shorthand"),
        )),
        scaling: Some(Scaling::uniform(0.1)),
        ..ImportOptions::default()
    }
}

fn run(stored: &[Stored], options: &ImportOptions) -> Result<Imported, ImportError> {
    import_from_bytes(
        "m.safetensors",
        Format::Safetensors,
        &safetensors(stored),
        options,
    )
}

/// The message about a file after a change.
fn message(
    change_file: impl Fn(&mut Vec<Stored>),
    change_options: impl Fn(&mut ImportOptions),
) -> String {
    let (mut stored, mut options) = (small(), options());
    run(&stored, &options).expect("usable before the change");
    change_file(&mut stored);
    change_options(&mut options);
    let error = run(&stored, &options).expect_err("the change makes it unusable");
    romc::artifact::describe(&error)
}

fn tensor_message(name: &str, with: Stored) -> String {
    let replace = |stored: &mut Vec<Stored>| {
        stored.retain(|tensor| tensor.name != name);
        stored.push(with.clone());
    };
    message(replace, |_| {})
}

fn option_message(change: impl Fn(&mut ImportOptions)) -> String {
    message(|_| {}, change)
}

fn remove(name: &'static str) -> impl Fn(&mut Vec<Stored>) {
    move |stored| stored.retain(|tensor| tensor.name != name)
}

#[test]
fn import_tells_wrong_shapes_with_both_layouts() {
    let zeros = |rows, columns| DMatrix::from_element(rows, columns, 0.5);
    assert_eq!(
        tensor_message("encoder.bias", list("encoder.bias", &[0.0; 5])),
        "m.safetensors: `encoder.bias` as encoder.bias: found 5 numbers, expected 2 numbers"
    );
    assert_eq!(
        tensor_message("decoder.weight", plain("decoder.weight", &zeros(6, 2))),
        "m.safetensors: `decoder.weight` as decoder.weight: found 6 x 2, expected 5 x 2 (column \
         vectors) or 2 x 5 (row vectors)"
    );
    assert_eq!(
        tensor_message("xi.contact", plain("xi.contact", &zeros(8, 2))),
        "m.safetensors: `xi.contact` as xi.contact: found 8 x 2, expected 7 x 2 or 2 x 7 (library: \
         degree=1,inputs)"
    );
    let mut cube = list("encoder.weight", &[0.5; 8]);
    cube.shape = vec![2, 2, 2];
    assert_eq!(
        tensor_message("encoder.weight", cube),
        "m.safetensors: `encoder.weight` as encoder.weight: found 2 x 2 x 2, expected d x n (column \
         vectors) or n x d (row vectors), with d at most n"
    );
    let go1 = romc::robot_file::by_name("go1").expect("registered");
    assert_eq!(
        option_message(|options| options.robot = Some(go1)),
        "m.safetensors: `encoder.weight` as encoder.weight: found 2 x 5, expected d x 18 (column \
         vectors) or 18 x d (row vectors), with d at most n"
    );
    assert_eq!(
        option_message(|options| options.weights = Some(WeightVectors::Row)),
        "m.safetensors: `encoder.weight` as encoder.weight: found 2 x 5, expected n x d (--weights \
         row), with d at most n"
    );
    assert_eq!(
        option_message(|options| options.latent_dim = Some(3)),
        "m.safetensors: `encoder.weight` as encoder.weight: found 2 x 5, expected 3 x n (column \
         vectors) or n x 3 (row vectors), with d at most n"
    );
    let mask = plain("mask.contact", &zeros(7, 3));
    assert!(tensor_message("", mask).contains("`mask.contact` as mask.contact: found 7 x 3"));
}

#[test]
fn import_tells_square_coefficients_apart_by_option_only() {
    let xi = DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 3.0, 4.0]);
    let mut options = ImportOptions {
        name: "spring".to_owned(),
        library: Some(LibraryChoice::Terms(vec!["z1".to_owned(), "z2".to_owned()])),
        ..ImportOptions::default()
    };
    let stored = [plain("xi_contact", &xi)];
    let error = run(&stored, &options)
        .expect_err("a square does not tell")
        .to_string();
    assert!(error.contains("--xi-layout terms-by-latent"), "{error}");
    for (layout, expected) in [
        (XiLayout::TermsByLatent, xi.clone()),
        (XiLayout::LatentByTerms, xi.transpose()),
    ] {
        options.xi_layout = Some(layout);
        let imported = run(&stored, &options).expect("told how");
        assert_eq!(imported.model.phases()[0].xi, expected);
    }
}

#[test]
fn import_tells_missing_and_doubtful_tensors() {
    let listing = "`decoder.bias` (5 numbers), `decoder.weight` (5 x 2), `encoder.bias` (2 \
                   numbers), `encoder.weight` (2 x 5)";
    assert_eq!(
        message(remove("xi.contact"), |_| {}),
        format!(
            "m.safetensors: found no tensor for xi.PHASE among {listing}, expected \
             a tensor of that name, or --map xi.PHASE=TENSOR"
        )
    );
    assert!(
        message(remove("encoder.weight"), |_| {})
            .contains("found no tensor for encoder.weight among")
    );
    assert_eq!(
        message(remove("xi.contact"), |options| {
            options
                .mapping
                .push("xi.contact=Xi_c".parse().expect("a mapping"));
        }),
        format!("m.safetensors: found no tensor `Xi_c` for xi.contact, expected one of {listing}")
    );
    let second = plain("net.encoder.weight", &DMatrix::from_element(2, 5, 1.0));
    assert_eq!(
        tensor_message("", second),
        "m.safetensors: found `encoder.weight` (2 x 5), `net.encoder.weight` (2 x 5) for \
         encoder.weight, expected one: name it with --map encoder.weight=TENSOR"
    );
    let strange = plain("xi_rear_stance", &DMatrix::zeros(7, 2));
    assert!(tensor_message("", strange).contains("of phase `rear_stance`, expected --phase"));
}

#[test]
fn coefficients_of_a_phase_that_no_option_names_are_not_dropped() {
    let mut stored = small();
    stored.push(plain("xi.flight", &DMatrix::from_element(7, 2, 0.5)));
    stored.push(plain("xi.rear", &DMatrix::from_element(7, 2, 0.2)));
    let with = |rules: &[&str]| ImportOptions {
        phases: rules.iter().map(|r| r.parse().expect("a rule")).collect(),
        ..options()
    };
    let refused = run(&stored, &with(&["contact=any"])).unwrap_err();
    assert!(
        refused.to_string().contains("--phase rear=any"),
        "{refused}"
    );
    let imported = run(&stored, &with(&["rear=0011"])).expect("three phases");
    let names: Vec<&str> = (imported.model.phases().iter().map(|p| p.name.as_str())).collect();
    assert_eq!(names, ["rear", "contact", "flight"]);
    assert_eq!(imported.model.phases()[2].xi[(0, 0)], 0.5);
}

#[test]
fn import_of_a_deeper_network_names_its_layers() {
    let deeper = |stored: &mut Vec<Stored>| {
        stored.retain(|tensor| !tensor.name.starts_with("encoder"));
        stored.push(plain(
            "encoder.0.weight",
            &DMatrix::from_element(64, 5, 0.5),
        ));
        stored.push(list("encoder.0.bias", &[0.0; 64]));
        stored.push(plain(
            "encoder.2.weight",
            &DMatrix::from_element(2, 64, 0.5),
        ));
        stored.push(list("encoder.2.bias", &[0.0; 2]));
    };
    assert_eq!(
        message(deeper, |_| {}),
        "m.safetensors: found `encoder.0.weight` (64 x 5), `encoder.2.weight` (2 x 64), the layers \
         of a deeper encoder, expected one linear layer, or --activation NAME (elu, relu, gelu, silu, \
         softplus, tanh, sigmoid) for the activation between them"
    );
}

#[test]
fn import_of_layers_with_and_without_numbers_is_refused() {
    let second = plain("encoder.2.weight", &DMatrix::from_element(2, 5, 0.5));
    assert_eq!(
        tensor_message("", second),
        "m.safetensors: found `encoder.weight` (2 x 5), `encoder.2.weight` (2 x 5), the layers of a \
         deeper encoder, expected numbers for all of them, or one with --map encoder.weight=TENSOR"
    );
}

#[test]
fn import_takes_all_weights_of_a_map_from_mappings_or_all_from_names() {
    let mut stored = small();
    stored.push(plain(
        "other",
        &DMatrix::from_fn(2, 5, |r, c| ((r + 2 * c * c) as f64).cos()),
    ));
    let mut options = options();
    options.mapping = vec!["encoder.weight=other".parse().expect("a mapping")];
    let imported = run(&stored, &options).expect("a mapping takes the place of a name");
    let encoder = imported.model.encoder().expect("an encoder");
    assert_eq!(encoder.weights()[(0, 1)], 2f64.cos());
    assert_eq!(encoder.bias().as_slice(), [0.1, 0.2]);
    assert_eq!(imported.report.unused[0].tensor, "encoder.weight");
}

fn wave(rows: usize, cols: usize, seed: f64) -> DMatrix<f64> {
    DMatrix::from_fn(rows, cols, |i, j| {
        (seed + 1.3 * i as f64 + 0.7 * j as f64 + 0.4 * (i * j) as f64).sin()
    })
}

/// Tensors of an encoder 5 -> 4 -> 2 and a decoder 2 -> 3 -> 5, as PyTorch's Sequential names them.
fn deeper(stored: &mut Vec<Stored>, is_row: bool) {
    stored.retain(|tensor| !tensor.name.contains("coder"));
    for (name, rows, cols) in [
        ("net.encoder.0", 4, 5),
        ("net.encoder.2", 2, 4),
        ("net.decoder.0", 3, 2),
        ("net.decoder.10", 5, 3),
    ] {
        let weights = wave(rows, cols, 0.3);
        let weights = if is_row { weights.transpose() } else { weights };
        stored.push(plain(&format!("{name}.weight"), &weights));
        let bias: Vec<f64> = (0..rows).map(|i| 0.1 * i as f64 - 0.2).collect();
        stored.push(list(&format!("{name}.bias"), &bias));
    }
}

#[test]
fn import_of_layers_with_an_activation_makes_the_network_they_are() {
    let mut options = options();
    options.activation = Some(Activation::Elu);
    for is_row in [false, true] {
        let mut stored = small();
        deeper(&mut stored, is_row);
        let imported = run(&stored, &options).expect("a chain of layers");
        let encoder = imported.model.encoder_map().expect("an encoder");
        assert_eq!(encoder.summary(), "5 -> 4 elu -> 2");
        let decoder = imported.model.decoder_map().expect("a decoder");
        assert_eq!(decoder.summary(), "2 -> 3 elu -> 5");

        let x = DVector::from_row_slice(&[3.0, -4.0, 1.0, 7.0, -2.0]);
        let bias = |rows: usize| DVector::from_fn(rows, |i, _| 0.1 * i as f64 - 0.2);
        let hidden = wave(4, 5, 0.3) * &x * 0.1 + bias(4);
        let hidden = hidden.map(|a| if a > 0.0 { a } else { a.exp() - 1.0 });
        let expected = wave(2, 4, 0.3) * hidden + bias(2);
        let found = imported.model.encode(&x).expect("fits");
        assert!((found - expected).amax() < 1e-14);
    }
}

#[test]
fn import_of_layers_that_are_no_chain_or_of_one_layer_is_refused() {
    let broken = |stored: &mut Vec<Stored>| {
        deeper(stored, false);
        stored.retain(|tensor| tensor.name != "net.encoder.2.weight");
        stored.push(plain("net.encoder.2.weight", &wave(2, 3, 0.3)));
    };
    let elu = |options: &mut ImportOptions| options.activation = Some(Activation::Elu);
    let text = message(broken, elu);
    assert!(
        text.contains("each with the outputs of the previous one as inputs")
            && text.contains("(2 x 3)"),
        "{text}"
    );
    let text = message(|_| {}, elu);
    assert!(text.starts_with("--activation: found elu"), "{text}");
}

#[test]
fn import_tells_what_is_not_said_about_tensors() {
    assert_eq!(
        option_message(|options| options.library = None),
        "m.safetensors: found no candidate terms for `xi.contact` (7 x 2), expected --library \
         degree=N[,trigonometric][,inputs] or --library FILE with the list of terms; for this shape \
         perhaps --library degree=1,inputs"
    );
    assert_eq!(
        option_message(|options| options.scaling = None),
        "m.safetensors: found an encoder without scale factors, expected --scaling FACTOR (scaled \
         value = factor times SI value: 0.1 for the published models, 1 for SI units)"
    );
    assert_eq!(
        option_message(|options| {
            options.mapping = vec![
                "xi.contact=xi.contact".parse().expect("a mapping"),
                "xi.contact=encoder.bias".parse().expect("a mapping"),
            ];
        }),
        "--map: found both `xi.contact` and `encoder.bias` for xi.contact, expected one tensor"
    );
    assert_eq!(
        option_message(|options| {
            options.phases = vec!["contact=any".parse().expect("a rule")];
            options.mapping = vec!["xi.rear=xi.contact".parse().expect("a mapping")];
        }),
        "m.safetensors: found the coefficients `xi.contact` (7 x 2) of phase `rear`, expected \
         --phase rear=any (or none, always, or patterns such as 0011 in the order fr fl rr rl)"
    );
}

#[test]
fn import_tells_numbers_that_a_model_cannot_take() {
    let mut broken = small().remove(0);
    broken.bytes[8 * 7..8 * 8].copy_from_slice(&f64::NAN.to_le_bytes());
    assert_eq!(
        tensor_message("encoder.weight", broken),
        "m.safetensors: `encoder.weight`[1, 2] as encoder.weight: found NaN, expected a finite number"
    );
    let flags = matrix(
        "encoder.weight",
        &DMatrix::from_element(2, 5, 1.0),
        Number::Bool,
        Order::C,
    );
    assert_eq!(
        tensor_message("encoder.weight", flags),
        "m.safetensors: `encoder.weight` as encoder.weight: found numbers of type bool, expected f32 \
         or f64"
    );
    let mask = plain("mask_contact", &DMatrix::from_element(7, 2, 0.5));
    assert_eq!(
        tensor_message("", mask),
        "m.safetensors: `mask_contact`[0, 0] as mask.contact: found 0.5, expected 0 or 1"
    );
    let flat = plain("encoder.weight", &DMatrix::from_element(2, 5, 1.0));
    let error = tensor_message("encoder.weight", flat);
    assert!(
        error.starts_with("m.safetensors: not a usable model: `encoder.weights`: found singular"),
        "{error}"
    );
    let rule = |options: &mut ImportOptions| {
        options.name = "1".to_owned();
    };
    assert!(option_message(rule).starts_with("m.safetensors: not a usable model: model name"));
}

#[test]
fn import_tells_integers_and_objects_by_type() {
    let stored = small();
    for (descr, size) in [("<i8", 8), ("|O", 8), ("<f2", 2), ("<c16", 16)] {
        let mut members: Vec<(String, Vec<u8>)> = (stored.iter())
            .map(|tensor| (format!("{}.npy", tensor.name), npy(tensor)))
            .collect();
        members[4].1 = npy_with(descr, Order::C, &[7, 2], &vec![0; 14 * size]);
        let bytes = zip(&members, CompressionMethod::Stored);
        let error = import_from_bytes("m.npz", Format::Npz, &bytes, &options()).expect_err(descr);
        assert_eq!(
            error.to_string(),
            format!(
                "m.npz: `xi.contact` as xi.contact: found numbers of type {descr:?}, expected f32 \
                 or f64"
            )
        );
    }
}

#[test]
fn import_tells_damaged_containers() {
    let error = |format, bytes: &[u8]| {
        import_from_bytes("m", format, bytes, &options())
            .expect_err("damaged")
            .to_string()
    };
    assert!(error(Format::Safetensors, b"").starts_with("m: not a usable safetensors file: "));
    assert!(error(Format::Npz, b"no zip").starts_with("m: not a usable npz file: "));
    let whole = npz(&small(), CompressionMethod::Stored);
    assert!(error(Format::Npz, &whole[..whole.len() / 2]).starts_with("m: not a usable npz file"));
    assert_eq!(
        error(Format::Npz, &zip(&[], CompressionMethod::Stored)),
        "m: found no tensor for xi.PHASE among no tensors at all, expected a tensor of \
         that name, or --map xi.PHASE=TENSOR"
    );
    let short = |bytes: usize| {
        let members: Vec<(String, Vec<u8>)> = (small().iter())
            .map(|tensor| {
                let mut npy = npy(tensor);
                if tensor.name == "xi.contact" {
                    npy.resize(128 + bytes, 0);
                }
                (format!("{}.npy", tensor.name), npy)
            })
            .collect();
        error(Format::Npz, &zip(&members, CompressionMethod::Deflated))
    };
    let expected = "expected as many bytes as its shape and type need";
    assert_eq!(
        short(100),
        format!("m: `xi.contact`: found 100 bytes, {expected}")
    );
    assert_eq!(
        short(113),
        format!("m: `xi.contact`: found more than 112 bytes, {expected}")
    );
    let text = zip(
        &[("xi.npy".to_owned(), b"hello, world".to_vec())],
        CompressionMethod::Stored,
    );
    assert_eq!(
        error(Format::Npz, &text),
        "m: `xi`: found another kind of file, expected an array that starts with \\x93NUMPY"
    );
}

#[test]
fn import_of_a_small_file_that_unpacks_to_much_is_refused_early() {
    let shape = [1usize << 40, 2];
    let bomb = npy_with("<f8", Order::C, &shape, &vec![0; 1 << 20]);
    let mut members: Vec<(String, Vec<u8>)> = (small().iter())
        .map(|tensor| (format!("{}.npy", tensor.name), npy(tensor)))
        .collect();
    members[4].1 = bomb;
    let bytes = zip(&members, CompressionMethod::Deflated);
    let mut wide = options();
    wide.library = Some(LibraryChoice::Terms(vec!["z1".to_owned(); 3]));
    let error = import_from_bytes("m.npz", Format::Npz, &bytes, &wide).expect_err("too large");
    let found = "as xi.contact: found 1099511627776 x 2, expected 3 x 2";
    assert!(error.to_string().contains(found), "{error}");
    members[2].1 = npy_with("<f8", Order::C, &[1 << 40, 2], &[0; 64]);
    members[0].1 = npy_with("<f8", Order::C, &[2, 1 << 40], &[0; 64]);
    let bytes = zip(&members, CompressionMethod::Deflated);
    let error = import_from_bytes("m.npz", Format::Npz, &bytes, &wide).expect_err("too large");
    let place = "m.npz: `encoder.weight` as encoder.weight: found more than 4194304 numbers";
    assert!(error.to_string().starts_with(place), "{error}");
}

#[test]
fn import_of_unknown_endings_and_absent_files_is_refused() {
    let error = import(Path::new("weights.pth"), &options()).expect_err("a pickle");
    assert!(
        error.to_string().contains("safetensors.torch.save_file"),
        "{error}"
    );
    let error = import(Path::new("/nowhere/m.npz"), &options()).expect_err("no such file");
    assert!(matches!(error.kind, Fault::Io { .. }));
    assert_eq!(error.to_string(), "/nowhere/m.npz: cannot read the file");
}

#[test]
fn import_reports_model_faults_as_they_are() {
    let mut covered = options();
    covered.phases = vec![
        "contact=any".parse().expect("a rule"),
        "rear=0011".parse().expect("a rule"),
    ];
    let mut stored = small();
    stored.push(plain("xi.rear", &DMatrix::from_element(7, 2, 0.5)));
    match run(&stored, &covered)
        .expect_err("the second phase is never reached")
        .kind
    {
        Fault::Unusable(source) => {
            assert!(matches!(
                *source,
                ModelError::UnreachablePhase { phase: 1, .. }
            ));
        }
        other => panic!("{other}"),
    }
}
