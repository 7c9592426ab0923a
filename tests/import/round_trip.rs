//! A model stored in any of the usual ways is the same after its import.

use nalgebra::DMatrix;
use romc::import::role::{Part, Role};
use romc::import::run::{Chosen, Layout};
use romc::import::*;
use romc::model::{LibraryChoice, ReducedModel};
use zip::CompressionMethod;

use super::store::*;

/// A way to store a model.
#[derive(Clone, Copy, Debug)]
struct Way {
    weights: WeightVectors,
    xi: XiLayout,
    number: Number,
    order: Order,
}

fn ways() -> Vec<Way> {
    let mut ways = Vec::new();
    for weights in [WeightVectors::Row, WeightVectors::Column] {
        for xi in [XiLayout::TermsByLatent, XiLayout::LatentByTerms] {
            for number in [Number::F64, Number::BigF64] {
                for order in [Order::C, Order::Fortran] {
                    ways.push(Way {
                        weights,
                        xi,
                        number,
                        order,
                    });
                }
            }
        }
    }
    ways
}

/// The tensors of a model, named by `name_of`.
fn tensors(model: &ReducedModel, way: Way, name_of: impl Fn(&Role) -> String) -> Vec<Stored> {
    let turned = |of: &DMatrix<f64>, turn: bool| if turn { of.transpose() } else { of.clone() };
    let store = |role: Role, of: &DMatrix<f64>| matrix(&name_of(&role), of, way.number, way.order);
    let row = way.weights == WeightVectors::Row;
    let mut stored = Vec::new();
    for (part, map) in [
        (Part::Encoder, model.encoder()),
        (Part::Decoder, model.decoder()),
    ] {
        let Ok(map) = map else { continue };
        stored.push(store(
            Role::Weights(part, None),
            &turned(map.weights(), row),
        ));
        stored.push(list(
            &name_of(&Role::Bias(part, None)),
            map.bias().as_slice(),
        ));
    }
    for (index, phase) in model.phases().iter().enumerate() {
        let turn = way.xi == XiLayout::LatentByTerms;
        stored.push(store(
            Role::Xi(phase.name.clone()),
            &turned(&phase.xi, turn),
        ));
        if let Ok(statistics) = model.input_statistics(index) {
            let mean = Role::InputMean(phase.name.clone());
            stored.push(list(&name_of(&mean), statistics.mean.as_slice()));
            let covariance = Role::InputCovariance(phase.name.clone());
            stored.push(store(covariance, &statistics.covariance));
        }
    }
    stored
}

const MODELS: [&str; 5] = [
    "tests/fixtures/models/robot-degree-2.json",
    "tests/fixtures/models/three-phases.json",
    "tests/fixtures/models/one-dimensional.json",
    "tests/fixtures/import/go1-d6.json",
    "models/paper-2d.json",
];

/// Names of coordinates are known only with the robot.
const NAMES: &[&str] = &["state", "input"];

#[test]
fn import_of_npz_gives_the_same_model_however_it_was_stored() {
    for path in MODELS {
        let original = model(path);
        for (index, way) in ways().into_iter().enumerate() {
            let stored = tensors(&original, way, Role::to_string);
            let method = match index % 2 {
                0 => CompressionMethod::Stored,
                _ => CompressionMethod::Deflated,
            };
            let bytes = npz(&stored, method);
            let options = options_of(&original);
            let imported = import_from_bytes("model.npz", Format::Npz, &bytes, &options)
                .unwrap_or_else(|error| panic!("{path} {way:?}: {error}"));
            assert_same(&imported, &original, NAMES);
            assert_eq!(imported.report.used.len(), stored.len(), "{path} {way:?}");
            assert!(imported.report.unused.is_empty(), "{path} {way:?}");
        }
    }
}

#[test]
fn import_of_safetensors_gives_the_same_model_however_it_was_stored() {
    for path in MODELS {
        let original = model(path);
        let c_order = |way: &Way| way.order == Order::C && way.number == Number::F64;
        for way in ways().into_iter().filter(c_order) {
            let bytes = safetensors(&tensors(&original, way, Role::to_string));
            let options = options_of(&original);
            let imported =
                import_from_bytes("m.safetensors", Format::Safetensors, &bytes, &options)
                    .unwrap_or_else(|error| panic!("{path} {way:?}: {error}"));
            assert_same(&imported, &original, NAMES);
        }
    }
}

#[test]
fn import_tells_how_weights_were_stored() {
    let original = model("tests/fixtures/models/robot-degree-2.json");
    for way in ways() {
        let bytes = npz(
            &tensors(&original, way, Role::to_string),
            CompressionMethod::Stored,
        );
        let imported = import_from_bytes("m.npz", Format::Npz, &bytes, &options_of(&original))
            .expect("stored in a usual way");
        let layout_of = |role: &str| {
            let mut used = imported.report.used.iter();
            used.find(|used| used.role == role).map(|used| used.layout)
        };
        let (weights, xi) = (layout_of("decoder.weight"), layout_of("xi.contact"));
        assert_eq!(
            weights == Some(Layout::Row),
            way.weights == WeightVectors::Row
        );
        assert_eq!(
            xi == Some(Layout::LatentByTerms),
            way.xi == XiLayout::LatentByTerms
        );
        assert_eq!(layout_of("encoder.bias"), Some(Layout::Plain));
    }
}

#[test]
fn import_maps_names_that_say_nothing() {
    let original = model("tests/fixtures/models/robot-degree-2.json");
    let mut options = options_of(&original);
    let way = ways()[0];
    let roles = tensors(&original, way, Role::to_string);
    let mut stored = roles.clone();
    for (index, tensor) in stored.iter_mut().enumerate() {
        tensor.name = format!("Variable_{index}/a=b:0");
        options.mapping.push(Mapping {
            role: roles[index].name.parse().expect("named by its role"),
            tensor: tensor.name.clone(),
        });
    }
    let bytes = npz(&stored, CompressionMethod::Stored);
    let imported = import_from_bytes("m.npz", Format::Npz, &bytes, &options).expect("all mapped");
    assert_same(&imported, &original, NAMES);
    assert!(
        imported
            .report
            .used
            .iter()
            .all(|used| used.chosen == Chosen::Mapped)
    );
}

#[test]
fn import_of_names_of_parts_finds_the_phases_itself() {
    let original = model("tests/fixtures/import/go1-d6.json");
    let way = ways()[0];
    let torch = |role: &Role| match role {
        Role::Weights(part, _) => format!("model.{}.0.weight", part.name()),
        Role::Bias(part, _) => format!("model.{}.0.bias", part.name()),
        Role::Xi(phase) => format!("xi_{phase}"),
        other => other.to_string(),
    };
    let mut stored = tensors(&original, way, torch);
    stored.push(list("loss_history", &[3.0, 2.0, 1.0]));
    let mut options = options_of(&original);
    options.phases.clear();
    let bytes = npz(&stored, CompressionMethod::Deflated);
    let imported =
        import_from_bytes("m.npz", Format::Npz, &bytes, &options).expect("names of parts");
    assert_same(&imported, &original, NAMES);
    let report = &imported.report;
    assert!(report.used.iter().all(|used| used.chosen == Chosen::Named));
    assert_eq!(report.unused[0].tensor, "loss_history");
    let notes = [("contact", "any"), ("flight", "none")].map(|(phase, feet)| {
        format!(
            "phase {phase} is selected by feet `{feet}`, as its name suggests (change with --phase)"
        )
    });
    assert_eq!(report.notes, notes);
}

#[test]
fn import_of_single_precision_keeps_its_numbers_exactly() {
    let original = model("tests/fixtures/models/robot-degree-2.json");
    let way = Way {
        number: Number::F32,
        ..ways()[0]
    };
    let mut stored = tensors(&original, way, Role::to_string);
    stored.retain(|tensor| !tensor.name.starts_with("input_"));
    for bytes in [
        (Format::Npz, npz(&stored, CompressionMethod::Stored)),
        (Format::Safetensors, safetensors(&stored)),
    ] {
        let imported = import_from_bytes("m", bytes.0, &bytes.1, &options_of(&original))
            .expect("single precision");
        let found = imported.model.encoder().expect("an encoder").weights();
        let expected = original.encoder().expect("an encoder").weights();
        assert_eq!(*found, expected.map(|value| f64::from(value as f32)));
        assert_eq!(imported.report.used[0].element, "f32");
    }
}

#[test]
fn import_of_square_weights_follows_the_option() {
    let square = DMatrix::from_fn(2, 2, |row, column| (1 + 3 * row + column * column) as f64);
    let xi = DMatrix::from_fn(5, 2, |row, column| (row + column) as f64);
    let stored = [
        plain("encoder.weight", &square),
        plain("decoder.weight", &square),
        plain("xi.contact", &xi),
    ];
    let bytes = safetensors(&stored);
    let mut options = ImportOptions {
        name: "square".to_owned(),
        library: Some(LibraryChoice::Standard(
            parse_standard("degree=1").expect("a shorthand"),
        )),
        phases: vec!["contact=any".parse().expect("a rule")],
        scaling: Some(romc::model::Scaling::uniform(1.0)),
        ..ImportOptions::default()
    };
    let run = |options: &ImportOptions| {
        import_from_bytes("m.safetensors", Format::Safetensors, &bytes, options)
    };
    let error = run(&options).expect_err("a square does not tell");
    assert!(error.to_string().contains("--weights column"), "{error}");
    for (weights, expected) in [
        (WeightVectors::Column, square.clone()),
        (WeightVectors::Row, square.transpose()),
    ] {
        options.weights = Some(weights);
        let imported = run(&options).expect("told how");
        let encoder = imported.model.encoder().expect("an encoder");
        assert_eq!(*encoder.weights(), expected);
        let note = "the encoder has no bias: zero".to_owned();
        assert!(imported.report.notes.contains(&note));
    }
}

#[test]
fn import_applies_masks_of_coefficients() {
    let xi = DMatrix::from_row_slice(3, 1, &[0.5, -0.25, 2.0]);
    let mask = DMatrix::from_row_slice(3, 1, &[1.0, 0.0, 1.0]);
    for number in [Number::Bool, Number::F32, Number::F64] {
        let stored = [
            plain("xi_contact", &xi),
            matrix("mask.contact", &mask, number, Order::C),
        ];
        let options = ImportOptions {
            name: "masked".to_owned(),
            library: Some(LibraryChoice::Terms(vec![
                "z1".to_owned(),
                "dz1".to_owned(),
                "u1".to_owned(),
            ])),
            ..ImportOptions::default()
        };
        for (format, bytes) in [
            (Format::Safetensors, safetensors(&stored)),
            (Format::Npz, npz(&stored, CompressionMethod::Stored)),
        ] {
            let imported = import_from_bytes("m", format, &bytes, &options).expect("a mask");
            assert_eq!(imported.model.phases()[0].xi.as_slice(), [0.5, 0.0, 2.0]);
            let note = "the mask of phase contact switched 1 coefficients off".to_owned();
            assert!(imported.report.notes.contains(&note));
        }
    }
}

#[test]
fn import_takes_scale_factors_from_tensors() {
    let original = model("tests/fixtures/models/robot-degree-2.json");
    let mut stored = tensors(&original, ways()[0], Role::to_string);
    let scaling = original.scaling().expect("a scaling");
    stored.push(list("s_x", scaling.state.expand(18).as_slice()));
    stored.push(list("s_u", scaling.input.expand(18).as_slice()));
    let mut options = options_of(&original);
    options.scaling = None;
    options.mapping = vec![
        "scaling.state=s_x".parse().expect("a mapping"),
        "scaling.input=s_u".parse().expect("a mapping"),
    ];
    let bytes = npz(&stored, CompressionMethod::Stored);
    let imported = import_from_bytes("m.npz", Format::Npz, &bytes, &options).expect("factors");
    assert_same(&imported, &original, NAMES);

    // Tensors named like the parts need no option, and exclude options with other factors.
    for tensor in &mut stored {
        match tensor.name.as_str() {
            "s_x" => tensor.name = "scaling.state".to_owned(),
            "s_u" => tensor.name = "scaling.input".to_owned(),
            _ => {}
        }
    }
    options.mapping.clear();
    let bytes = npz(&stored, CompressionMethod::Stored);
    let run = |options: &ImportOptions| import_from_bytes("m.npz", Format::Npz, &bytes, options);
    assert_same(&run(&options).expect("factors"), &original, NAMES);
    options.scaling = Some(romc::model::Scaling::uniform(0.5));
    let refused = run(&options).expect_err("factors twice").to_string();
    assert_eq!(
        refused,
        "--scaling: found factors here and in tensors, expected one of the two"
    );
}
