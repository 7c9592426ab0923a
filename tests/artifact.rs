//! The model file: accepted and refused contents, and the text of each refusal.

#[path = "artifact/maps.rs"]
mod maps;
#[path = "artifact/parts.rs"]
mod parts;

use std::fs;
use std::path::{Path, PathBuf};

use romc::artifact::{self, ArtifactError};
use romc::files::{Fault, Overwrite, Place, size};
use romc::model::{ModelError, ReducedModel};
use romc::robot::WrenchFrame;
use serde_json::{Value, json};

fn fixture_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/models")
}

/// All model files of the repository.
fn model_files() -> Vec<PathBuf> {
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
    let mut files: Vec<PathBuf> = [fixture_folder(), shipped]
        .iter()
        .flat_map(|folder| fs::read_dir(folder).expect("the folder is checked in"))
        .map(|entry| entry.expect("the folder can be listed").path())
        .filter(|path| {
            path.extension()
                .is_some_and(|extension| extension == "json")
        })
        .collect();
    files.sort();
    assert!(files.len() >= 8, "{files:?}");
    files
}

fn fixture(name: &str) -> Value {
    let path = fixture_folder().join(name).with_extension("json");
    serde_json::from_slice(&fs::read(path).expect("fixture")).expect("fixture is JSON")
}

fn read_value(value: &Value) -> Result<ReducedModel, ArtifactError> {
    artifact::read_from_bytes("file.json", value.to_string().as_bytes())
}

/// Reads the fixture after a change, which must be refused.
fn refusal(name: &str, change: impl Fn(&mut Value)) -> ArtifactError {
    let mut value = fixture(name);
    change(&mut value);
    let error = read_value(&value).expect_err("the change makes the model unusable");
    assert!(artifact::describe(&error).starts_with("file.json: "));
    error
}

fn model_refusal(name: &str, change: impl Fn(&mut Value)) -> ModelError {
    match refusal(name, change).kind {
        Fault::Unusable(source) => *source,
        other => panic!("{other}"),
    }
}

/// Place, found and expected value of an invalid part.
fn invalid(name: &str, change: impl Fn(&mut Value)) -> [String; 3] {
    parts_of(model_refusal(name, change))
}

fn parts_of(error: ModelError) -> [String; 3] {
    match error {
        ModelError::Invalid {
            place,
            found,
            expected,
        } => [place, found, expected],
        other => panic!("{other}"),
    }
}

/// `(place, message)` of a refused syntax.
fn syntax_refusal(name: &str, change: impl Fn(&mut Value)) -> (String, String) {
    let error = refusal(name, change);
    match error.place {
        Place::Key(place, ..) => (place.to_string(), error.kind.to_string()),
        other => panic!("{other:?}: {}", error.kind),
    }
}

/// The array that a JSON pointer names.
fn array<'a>(value: &'a mut Value, pointer: &str) -> &'a mut Vec<Value> {
    value
        .pointer_mut(pointer)
        .and_then(Value::as_array_mut)
        .unwrap_or_else(|| panic!("{pointer} is an array"))
}

#[test]
fn every_model_file_reads_back_from_its_own_text() {
    for path in model_files() {
        let model = artifact::read(&path).unwrap_or_else(|e| panic!("{}", artifact::describe(&e)));
        let text = artifact::to_text(&model);
        let again = artifact::read_from_bytes("again", text.as_bytes()).expect("own text");
        assert_eq!(again, model, "{}", path.display());
        assert_eq!(artifact::to_text(&again), text);
    }
}

#[test]
fn every_model_file_is_in_the_form_that_write_gives() {
    for path in model_files() {
        let model = artifact::read(&path).unwrap_or_else(|e| panic!("{}", artifact::describe(&e)));
        let text = fs::read_to_string(&path).expect("readable");
        assert!(text == artifact::to_text(&model), "{}", path.display());
    }
}

#[test]
fn written_numbers_read_back_bit_for_bit() {
    let numbers = [
        5e-324,
        f64::MIN_POSITIVE,
        f64::MAX,
        -0.0,
        0.1 + 0.2,
        1.0 / 3.0,
        9007199254740993.0,
        -2.225_073_858_507_201e-308,
        123456.789e-12,
    ];
    for number in numbers {
        let mut value = fixture("one-dimensional");
        value["phases"][0]["xi"][0][0] = json!(number);
        let model = read_value(&value).expect("finite numbers are accepted");
        let text = artifact::to_text(&model);
        let again = artifact::read_from_bytes("again", text.as_bytes()).expect("own text");
        let xi = again.phases()[0].xi[(0, 0)];
        assert_eq!(xi.to_bits(), f64::to_bits(number), "{number:e}");
    }
}

#[test]
fn paper_model_has_the_printed_equations() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/paper-2d.json");
    let model = artifact::read(&path).expect("shipped");
    let printed = |phase: usize, output: usize| -> Vec<(f64, String)> {
        let terms = model.active_terms(phase, output).expect("in range");
        terms
            .into_iter()
            .map(|(coefficient, term)| (coefficient, term.text.clone()))
            .collect()
    };
    let expected = |terms: &[(f64, &str)]| -> Vec<(f64, String)> {
        terms.iter().map(|&(c, t)| (c, t.to_owned())).collect()
    };
    assert_eq!(model.phases()[0].name, "contact");
    assert_eq!(
        printed(0, 0),
        expected(&[
            (0.36, "1"),
            (-0.16, "dz1"),
            (-0.91, "dz2"),
            (-0.75, "sin(dz1)"),
            (0.11, "u1"),
            (-0.05, "u2")
        ])
    );
    assert_eq!(
        printed(0, 1),
        expected(&[
            (-0.16, "1"),
            (-0.23, "dz1"),
            (-0.75, "dz2"),
            (-0.96, "sin(dz2)"),
            (0.14, "u2")
        ])
    );
    assert_eq!(
        printed(1, 0),
        expected(&[
            (0.29, "1"),
            (-1.22, "dz1"),
            (-1.0, "sin(dz1)"),
            (51.05, "u1")
        ])
    );
    assert_eq!(
        printed(1, 1),
        expected(&[(0.42, "dz1"), (0.52, "sin(dz1)")])
    );
}

#[test]
fn paper_model_accelerates_as_the_printed_equations_do() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/paper-2d.json");
    let model = artifact::read(&path).expect("shipped");
    let vector = |a: f64, b: f64| nalgebra::DVector::from_column_slice(&[a, b]);
    for k in 0..50 {
        let at = |i: i32| ((7 * k + 13 * i) % 31) as f64 / 8.0 - 2.0;
        let (z1, z2, v1, v2, u1, u2) = (at(0), at(1), at(2), at(3), at(4), at(5));
        let contact = [
            0.36 - 0.16 * v1 - 0.91 * v2 - 0.75 * v1.sin() + 0.11 * u1 - 0.05 * u2,
            -0.16 - 0.23 * v1 - 0.75 * v2 - 0.96 * v2.sin() + 0.14 * u2,
        ];
        let flight = [
            0.29 - 1.22 * v1 - v1.sin() + 51.05 * u1,
            0.42 * v1 + 0.52 * v1.sin(),
        ];
        for (feet, expected) in [([true; 4], contact), ([false; 4], flight)] {
            let phase = model.phase_for(feet).expect("covered");
            let found = model
                .ddz(phase, &vector(z1, z2), &vector(v1, v2), &vector(u1, u2))
                .expect("right lengths");
            for (found, expected) in found.iter().zip(expected) {
                assert!((found - expected).abs() <= 1e-14 * expected.abs().max(10.0));
            }
        }
    }
}

// --- Files that are no model file at all ---------------------------------------------------------

#[test]
fn missing_file_is_refused_with_its_name() {
    let error = artifact::read(Path::new("no/such/model.json")).unwrap_err();
    assert!(matches!(
        error.kind,
        Fault::Io { action, .. } if action.starts_with("read")
    ));
    assert!(artifact::describe(&error).starts_with("no/such/model.json: cannot read"));
}

/// The three-phase fixture with an encoder and a decoder of two layers.
fn with_layers() -> Value {
    let mut value = fixture("three-phases");
    let rows = |rows: usize, cols: usize| -> Vec<Vec<f64>> {
        let entry = |i: usize, j: usize| (1.3 * i as f64 + 0.7 * j as f64 + 0.2).sin();
        (0..rows)
            .map(|i| (0..cols).map(|j| entry(i, j)).collect())
            .collect()
    };
    let d = value["latent_dim"].as_u64().expect("a number") as usize;
    let n = value["state"]["names"].as_array().expect("a list").len();
    value["encoder"] = json!({ "layers": [
        { "weights": rows(20, n), "bias": vec![0.1; 20], "activation": "elu" },
        { "weights": rows(d, 20), "bias": vec![0.0; d] },
    ] });
    value["decoder"] = json!({ "layers": [
        { "weights": rows(5, d), "bias": vec![-0.1; 5], "activation": "tanh" },
        { "weights": rows(n, 5), "bias": vec![0.0; n], "activation": "linear" },
    ] });
    value
}

#[test]
fn layers_are_read_and_written_with_their_activations() {
    let model = read_value(&with_layers()).expect("a sound model");
    let encoder = model.encoder_map().expect("an encoder");
    let d = model.latent_dim();
    assert_eq!(encoder.summary(), format!("5 -> 20 elu -> {d}"));
    let decoder = model.decoder_map().expect("a decoder");
    assert_eq!(decoder.summary(), format!("{d} -> 5 tanh -> 5"));
    let text = artifact::to_text(&model);
    let back = artifact::read_from_bytes("back.json", text.as_bytes()).expect("reads back");
    assert_eq!(back, model);
    assert!(matches!(
        model.encoder(),
        Err(ModelError::Nonlinear {
            part: "encoder",
            ..
        })
    ));
}

#[test]
fn one_linear_layer_is_written_as_the_affine_map_it_is() {
    let plain = fixture("three-phases");
    let mut value = plain.clone();
    value["encoder"] = json!({ "layers": [plain["encoder"].clone()] });
    let model = read_value(&value).expect("a sound model");
    assert_eq!(model, read_value(&plain).expect("a sound model"));
}

#[test]
fn layers_that_are_wrong_are_refused_at_their_place() {
    let changed = |change: &dyn Fn(&mut Value)| {
        let mut value = with_layers();
        change(&mut value);
        read_value(&value).expect_err("refused").to_string()
    };
    let message = changed(&|v| v["encoder"]["layers"][0]["activation"] = json!("selu"));
    assert!(
        message.starts_with("file.json: at `encoder.layers[0].activation`, line 1, "),
        "{message}"
    );
    let found = "unknown variant `selu`, expected one of `linear`, `elu`, `tanh`";
    assert!(message.contains(found), "{message}");
    let message = changed(&|v| v["encoder"]["weights"] = json!([[1.0]]));
    assert!(
        message.contains("`layers` together with `weights`"),
        "{message}"
    );
    let message = changed(&|v| {
        array(v, "/decoder/layers/1/weights/3").pop();
    });
    assert!(
        message.contains("at `decoder.layers[1].weights`")
            && message.contains("found 4 numbers in row [3], expected 5 as in the first"),
        "{message}"
    );
    let message = changed(&|v| v["encoder"]["layers"] = json!([]));
    assert!(message.contains("file.json"), "{message}");
    let message = changed(&|v| v["encoder"]["layers"][1]["gain"] = json!(1));
    assert!(message.contains("gain"), "{message}");
    let narrow = read_value(&{
        let mut value = with_layers();
        value["encoder"]["layers"][0]["weights"] = json!([[0.5, 0.25, 0.1, -0.5, 1.0]]);
        value["encoder"]["layers"][0]["bias"] = json!([0.0]);
        for row in array(&mut value, "/encoder/layers/1/weights") {
            *row = json!([1.0]);
        }
        value
    });
    match narrow.map_err(|error| error.kind) {
        Err(Fault::Unusable(source)) => {
            let [place, found, _] = parts_of(*source);
            assert_eq!(
                (place.as_str(), found.as_str()),
                ("`encoder.layers[0]`", "1 units")
            );
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn empty_truncated_and_foreign_files_are_refused_with_line_and_column() {
    let whole = fixture("three-phases").to_string();
    for (bytes, expected) in [
        ("", "EOF"),
        (&whole[..whole.len() / 2], "EOF"),
        ("\u{1f}\u{8b}", "expected value"),
        ("[1, 2]", "found an array"),
        (&format!("{whole} x"), "trailing characters"),
    ] {
        let error = artifact::read_from_bytes("f", bytes.as_bytes()).expect_err("refused");
        assert!(matches!(error.place, Place::Key(_, ..=1, _)), "{error}");
        let message = error.kind.to_string();
        assert!(message.contains(expected), "{message}");
        assert!(!message.contains(" at line "), "{message}");
    }
}

#[test]
fn deeply_nested_file_is_refused() {
    let nested = "[".repeat(100_000);
    let error = artifact::read_from_bytes("f", nested.as_bytes()).unwrap_err();
    assert!(matches!(error.place, Place::Key(..)));
    let balanced = "[".repeat(1_000) + &"]".repeat(1_000);
    let inside = format!("{{\"schema\": \"romc-model/1\", \"provenance\": {{\"x\": {balanced}}}}}");
    let error = artifact::read_from_bytes("f", inside.as_bytes()).unwrap_err();
    assert!(artifact::describe(&error).contains("recursion limit"));
}

/// Damages the fixtures in many ways; every file that can still be read must be a sound model.
#[test]
fn damaged_files_are_refused_or_sound_but_never_panic() {
    let mut state = 0x9e37_79b9_7f4a_7c15u64;
    let mut random = |below: usize| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    let fragments: [&[u8]; 12] = [
        b"1e999", b"-", b"null", b"[", b"]", b"{}", b"\"\"", b"^", b"(", b"0", b"1e308", b"\xff",
    ];
    let mut accepted = 0;
    for name in [
        "every-function",
        "three-phases",
        "one-dimensional",
        "degree-3",
    ] {
        let whole = fixture(name).to_string().into_bytes();
        for _ in 0..3_000 {
            let mut bytes = whole.clone();
            for _ in 0..=random(3) {
                let at = random(bytes.len());
                match random(4) {
                    0 => bytes[at] = (random(256)) as u8,
                    1 => drop(bytes.drain(at..bytes.len().min(at + 1 + random(8)))),
                    2 => {
                        let fragment = fragments[random(fragments.len())];
                        bytes.splice(at..at, fragment.iter().copied());
                    }
                    _ => {
                        let from = random(bytes.len());
                        bytes.swap(at, from);
                    }
                }
            }
            if let Ok(model) = artifact::read_from_bytes("damaged", &bytes) {
                accepted += 1;
                let text = artifact::to_text(&model);
                let again = artifact::read_from_bytes("again", text.as_bytes()).expect("own text");
                assert_eq!(again, model);
            }
        }
    }
    // Changed digits leave sound models, so both outcomes occur.
    assert!((100..11_900).contains(&accepted), "{accepted}");
}

#[test]
fn file_beyond_the_size_bound_is_refused() {
    let bytes = vec![b' '; size::Format::Model.most_bytes() as usize + 1];
    let error = artifact::read_from_bytes("f", &bytes).unwrap_err();
    assert!(
        error
            .to_string()
            .starts_with("f: found more than 33554432 bytes")
    );
}

#[test]
fn unknown_or_missing_schema_is_refused_before_anything_else() {
    for (schema, found) in [
        (json!("romc-model/4"), "\"romc-model/4\""),
        (json!(1), "1"),
        (Value::Null, "none"),
    ] {
        let error = refusal("three-phases", |value| {
            value["schema"] = schema.clone();
            value["key_of_the_future"] = json!(true);
        });
        let expected = format!(
            "file.json: `schema`: found {found}, expected \"romc-model/1\", \"romc-model/2\" or \"romc-model/3\""
        );
        assert_eq!(error.to_string(), expected);
    }
}

#[test]
fn actuators_and_frame_are_read_and_written_with_the_second_schema() {
    let model = read_value(&fixture("net-torques")).expect("a fixture");
    let actuators = model.actuators().expect("the file has them");
    assert_eq!((actuators.viscous[3], actuators.dry[5]), (0.9, 0.3));
    assert_eq!(model.wrench_frame(), WrenchFrame::World);
    let rule = model.input_rule().expect("a robot");
    assert_eq!(rule.robot().name, "go2");
    assert!(artifact::to_text(&model).contains("\"schema\": \"romc-model/2\""));
    // Without losses the file has the first schema, so old files stay the same byte for byte.
    let plain = model.clone().into_builder().actuators(None);
    let plain = plain.wrench_frame(WrenchFrame::Body).build();
    let text = artifact::to_text(&plain.expect("sound"));
    assert!(text.contains("\"schema\": \"romc-model/1\"") && !text.contains("actuators"));
    // The frame alone also needs the second schema.
    let turned = model.into_builder().actuators(None).build().expect("sound");
    let text = artifact::to_text(&turned);
    assert!(text.contains("romc-model/2") && text.contains("\"wrench_frame\": \"world\""));
    let mut published = fixture("net-torques");
    published["wrench_frame"] = json!("body");
    let published = read_value(&published).expect("the default, spelled out");
    assert_eq!(published.wrench_frame(), WrenchFrame::Body);
}

#[test]
fn actuators_and_frame_that_are_wrong_are_refused_at_their_place() {
    let (place, message) = syntax_refusal("net-torques", |value| {
        value["wrench_frame"] = json!("hips");
    });
    assert_eq!(place, "wrench_frame");
    assert!(
        message.contains("\"hips\", expected \"body\", \"world\" or \"ground\""),
        "{message}"
    );
    let (place, message) = syntax_refusal("net-torques", |value| {
        array(value, "/actuators/dry").pop();
    });
    assert!(place.starts_with("actuators.dry"), "{place}");
    assert!(message.contains("array of length 12"), "{message}");
    let (place, _) = syntax_refusal("net-torques", |value| value["actuators"] = Value::Null);
    assert_eq!(place, "actuators");
    let (place, message) = syntax_refusal("net-torques", |value| {
        value["actuators"]["stiction"] = json!([1.0]);
    });
    assert!(
        place.ends_with("stiction") && message.contains("unknown field"),
        "{place} {message}"
    );
    let error = model_refusal("net-torques", |value| {
        value["actuators"]["armature"][7] = json!(-0.01);
    });
    assert_eq!(
        error.to_string(),
        "`actuators.armature`[7], joint rr.hy: found -0.01, expected a number of at least 0"
    );
    let without_robot = |key: &'static str| {
        model_refusal("net-torques", |value| {
            let file = value.as_object_mut().expect("an object");
            file.remove("robot");
            file.remove(key);
        })
    };
    for (gone, part) in [("wrench_frame", "actuators"), ("actuators", "wrench_frame")] {
        let needs = "robot";
        assert_eq!(without_robot(gone), ModelError::Incomplete { part, needs });
    }
    for key in ["actuators", "wrench_frame"] {
        let error = refusal("net-torques", |value| {
            value["schema"] = json!("romc-model/1");
            let other = if key == "actuators" {
                "wrench_frame"
            } else {
                "actuators"
            };
            value.as_object_mut().expect("an object").remove(other);
        });
        let expected = format!(
            "file.json: `{key}`: found in a file of \"romc-model/1\", expected only from \"romc-model/2\" on"
        );
        assert_eq!(error.to_string(), expected);
    }
}

#[test]
fn unknown_keys_are_refused_at_every_level() {
    for pointer in [
        "",
        "/state",
        "/scaling",
        "/encoder",
        "/decoder",
        "/library",
        "/phases/0",
        "/input_statistics/contact",
    ] {
        let (place, message) = syntax_refusal("robot-degree-2", |value| {
            value.pointer_mut(pointer).expect("there")["extra"] = json!(1);
        });
        assert!(message.contains("unknown field `extra`"), "{message}");
        assert!(place.ends_with("extra"), "{pointer}: {place}");
    }
}

#[test]
fn missing_and_duplicate_keys_are_refused() {
    let (_, message) = syntax_refusal("three-phases", |value| {
        value.as_object_mut().unwrap().remove("phases");
    });
    assert!(message.contains("missing field `phases`"));
    let text = fixture("three-phases").to_string();
    let doubled = text.replacen('{', "{\"name\": \"other\",", 1);
    let error = artifact::read_from_bytes("f", doubled.as_bytes()).expect_err("refused");
    let message = error.to_string();
    assert!(message.contains("duplicate field `name`"), "{message}");
}

// --- Numbers -------------------------------------------------------------------------------------

#[test]
fn numbers_that_are_not_finite_are_refused_at_their_place() {
    let text = fixture("one-dimensional").to_string();
    for bad in [
        "NaN", "Infinity", "1e999", "-1e999", "null", "\"0.5\"", "true",
    ] {
        for (tensor, good, place) in [
            ("\"xi\":[[", "0.5", "phases[0].xi[0][0]"),
            (
                "\"encoder\":{\"weights\":[[",
                "0.5",
                "encoder.weights[0][0]",
            ),
            ("\"scaling\":{\"state\":", "0.1", "scaling.state"),
        ] {
            let with = |number: &str| format!("{tensor}{number}");
            let changed = text.replace(&with(good), &with(bad));
            assert_ne!(changed, text, "{tensor} is in the fixture");
            match artifact::read_from_bytes("f", changed.as_bytes()).map_err(|error| error.place) {
                Err(Place::Key(found, ..)) => assert_eq!(&*found, place, "{bad}"),
                other => panic!("{bad} in {tensor}: {other:?}"),
            }
        }
    }
}

#[test]
fn scale_factors_that_are_zero_negative_or_tiny_are_refused() {
    for factor in [0.0, -0.1, 1e-310] {
        let [place, found, _] = invalid("robot-degree-2", |value| {
            value["scaling"]["input"][7] = json!(factor);
        });
        assert_eq!(
            (place, found),
            ("`scaling.input`[7]".to_owned(), factor.to_string())
        );
    }
    let [place, ..] = invalid("three-phases", |value| value["scaling"]["state"] = json!(0));
    assert_eq!(place, "`scaling.state`[0]");
}

#[test]
fn sample_time_that_is_not_a_short_positive_time_is_refused() {
    for time in [0.0, -0.002, 1.5] {
        let [place, found, _] = invalid("robot-degree-2", |value| {
            value["sample_time_s"] = json!(time)
        });
        assert_eq!(
            (place, found),
            ("`sample_time_s`".to_owned(), time.to_string())
        );
    }
}

#[test]
fn latent_dim_of_zero_or_beyond_bound_is_refused() {
    for latent_dim in [0usize, 65, 1 << 40] {
        let [place, found, _] =
            invalid("degree-3", |value| value["latent_dim"] = json!(latent_dim));
        assert_eq!(
            (place, found),
            ("`latent_dim`".into(), latent_dim.to_string())
        );
    }
    let (place, _) = syntax_refusal("degree-3", |value| value["latent_dim"] = json!(-1));
    assert_eq!(place, "latent_dim");
}

// --- Shapes --------------------------------------------------------------------------------------

#[test]
fn each_tensor_with_one_row_too_few_or_many_is_refused() {
    for (pointer, tensor, expected) in [
        ("/encoder/weights", "encoder.weights", (3, 18)),
        ("/encoder/bias", "encoder.bias", (3, 1)),
        ("/decoder/weights", "decoder.weights", (18, 3)),
        ("/decoder/bias", "decoder.bias", (18, 1)),
        ("/phases/0/xi", "phases[0].xi", (43, 3)),
        ("/phases/1/xi", "phases[1].xi", (43, 3)),
        ("/scaling/state", "scaling.state", (18, 1)),
        ("/scaling/input", "scaling.input", (18, 1)),
        ("/state/units", "state.units", (18, 1)),
        ("/input/names", "input.names", (18, 1)),
        ("/input/units", "input.units", (18, 1)),
        (
            "/input_statistics/flight/covariance",
            "input_statistics.flight.covariance",
            (18, 18),
        ),
    ] {
        for grow in [false, true] {
            let [place, found, wanted] = invalid("robot-degree-2", |value| {
                let rows = array(value, pointer);
                let last = rows.pop().expect("not empty");
                if grow {
                    rows.push(last.clone());
                    rows.push(last);
                }
            });
            let rows: usize = if grow { expected.0 + 1 } else { expected.0 - 1 };
            let of = |rows, columns| format!("{rows} x {columns}");
            let suffix = " (rows x columns)";
            let names_itself = place == format!("`{tensor}`")
                && found == of(rows, expected.1)
                && wanted == of(expected.0, expected.1) + suffix;
            // A bias is compared with its weights first: the message may name either.
            let names_bias = tensor.ends_with(".weights")
                && place == format!("`{}`", tensor.replace("weights", "bias"))
                && wanted == of(rows, 1) + suffix;
            assert!(names_itself || names_bias, "{place}: {found}, {wanted}");
        }
    }
}

#[test]
fn state_names_off_by_one_are_refused() {
    for grow in [false, true] {
        let [place, _, expected] = invalid("robot-degree-2", |value| {
            for key in ["/state/names", "/state/units"] {
                let texts = array(value, key);
                let last = texts.pop().expect("not empty");
                if grow {
                    texts.push(last.clone());
                    texts.push(last);
                }
            }
        });
        assert_eq!(place, "`state.names`");
        assert_eq!(expected, "18 x 1 (rows x columns)");
    }
}

#[test]
fn each_matrix_with_one_column_too_few_or_many_is_refused_with_its_row() {
    for (pointer, tensor, expected) in [
        ("/encoder/weights", "encoder.weights", 18),
        ("/decoder/weights", "decoder.weights", 3),
        ("/phases/0/xi", "phases[0].xi", 3),
        ("/phases/1/xi", "phases[1].xi", 3),
        (
            "/input_statistics/contact/covariance",
            "input_statistics.contact.covariance",
            18,
        ),
    ] {
        for grow in [false, true] {
            let refused = syntax_refusal("robot-degree-2", |value| {
                let row = array(value, &format!("{pointer}/2"));
                let last = row.pop().expect("not empty");
                if grow {
                    row.push(last.clone());
                    row.push(last);
                }
            });
            let found = if grow { expected + 1 } else { expected - 1 };
            let message =
                format!("found {found} numbers in row [2], expected {expected} as in the first");
            assert_eq!(refused, (tensor.to_owned(), message));
        }
    }
}

#[test]
fn encoder_with_one_column_less_in_all_rows_is_refused_for_a_known_robot() {
    let error = refusal("robot-degree-2", |value| {
        for row in array(value, "/encoder/weights") {
            row.as_array_mut().expect("row").pop();
        }
    });
    assert_eq!(
        artifact::describe(&error),
        "file.json: not a usable model: `encoder.weights`: found 3 x 17, expected 3 x 18 (rows x columns)"
    );
}

#[test]
fn mean_off_by_one_is_refused() {
    let error = refusal("robot-degree-2", |value| {
        array(value, "/input_statistics/contact/mean").pop();
    });
    assert!(artifact::describe(&error).contains("input_statistics.contact"));
}

#[test]
fn library_longer_or_shorter_by_one_than_xi_is_refused() {
    for grow in [false, true] {
        let parts = invalid("three-phases", |value| {
            let terms = array(value, "/library");
            if grow {
                terms.push(json!("z1^2"));
            } else {
                terms.pop();
            }
        });
        let rows = if grow { 10 } else { 8 };
        let expected = format!("{rows} x 2 (rows x columns)");
        assert_eq!(parts, ["`phases[0].xi`", "9 x 2", expected.as_str()]);
    }
}

// --- Rank and covariance -------------------------------------------------------------------------

#[test]
fn encoder_with_dependent_rows_is_refused() {
    let sum_of_others = model_refusal("robot-degree-2", |value| {
        let rows = array(value, "/encoder/weights");
        let sum: Vec<f64> = (0..18)
            .map(|i| rows[0][i].as_f64().unwrap() - 2.0 * rows[1][i].as_f64().unwrap())
            .collect();
        rows[2] = json!(sum);
    });
    let zero = model_refusal("robot-degree-2", |value| {
        for row in array(value, "/encoder/weights") {
            *row = json!(vec![0.0; 18]);
        }
    });
    for error in [sum_of_others, zero] {
        let [_, found, expected] = parts_of(error);
        let ends = found
            .strip_prefix("singular values from ")
            .expect("two of them");
        let (smallest, largest) = ends.split_once(" to ").expect("two of them");
        let [smallest, largest] =
            [smallest, largest].map(|end| end.parse::<f64>().expect("a number"));
        assert!(expected.starts_with("full row rank 3 "), "{expected}");
        assert!(smallest <= 1e-10 * largest);
    }
}

#[test]
fn encoder_with_more_rows_than_columns_is_refused() {
    let error = model_refusal("one-dimensional", |value| {
        value["encoder"]["weights"] = json!([[1.0], [2.0]]);
        value["encoder"]["bias"] = json!([0.0, 0.0]);
        value["decoder"] = json!({ "weights": [[1.0, 2.0]], "bias": [0.0] });
        value["latent_dim"] = json!(2);
        value["phases"][0]["xi"] = json!(vec![[0.0, 1.0]; 15]);
    });
    assert_eq!(
        error.to_string(),
        "`state`: found 1 robot coordinates, expected 2 (one per latent coordinate) to 256"
    );
}

#[test]
fn encoder_with_huge_or_tiny_entries_keeps_its_rank() {
    for factor in [1e150, 1e-150] {
        let mut value = fixture("robot-degree-2");
        for row in array(&mut value, "/encoder/weights") {
            for number in row.as_array_mut().expect("row") {
                *number = json!(number.as_f64().unwrap() * factor);
            }
        }
        assert!(read_value(&value).is_ok(), "{factor:e}");
    }
}

#[test]
fn covariance_that_is_not_symmetric_or_positive_is_refused() {
    let [place, ..] = invalid("robot-degree-2", |value| {
        let cell = &mut value["input_statistics"]["contact"]["covariance"][5][2];
        *cell = json!(cell.as_f64().unwrap() + 0.5);
    });
    assert_eq!(place, "`input_statistics.contact.covariance`[5][2]");
    let [_, found, _] = invalid("robot-degree-2", |value| {
        value["input_statistics"]["flight"]["covariance"][4][4] = json!(-3.0);
    });
    let eigenvalue = found.strip_prefix("the eigenvalue ").expect("a number");
    assert!(eigenvalue.parse::<f64>().expect("a number") <= -3.0);
}

#[test]
fn statistics_of_an_unknown_or_repeated_phase_are_refused() {
    let [place, found, _] = invalid("robot-degree-2", |value| {
        let entry = value["input_statistics"]["contact"].clone();
        value["input_statistics"]["stance"] = entry;
    });
    assert_eq!([place, found], ["`input_statistics`", "\"stance\""]);
    let text = fixture("robot-degree-2").to_string();
    let (statistics, contact) = (
        "\"input_statistics\":{",
        "\"contact\":{\"mean\":[],\"covariance\":[]},",
    );
    let doubled = text.replace(statistics, &format!("{statistics}{contact}"));
    assert_ne!(doubled, text);
    let error = artifact::read_from_bytes("f", doubled.as_bytes()).expect_err("refused");
    let message = error.to_string();
    assert!(message.contains("duplicate key \"contact\""), "{message}");
}

#[test]
fn statistics_without_robot_coordinates_are_refused() {
    let error = model_refusal("degree-3", |value| {
        value["input_statistics"] = json!({ "contact": { "mean": [0.0], "covariance": [[1.0]] } });
    });
    assert!(matches!(
        error,
        ModelError::Incomplete {
            part: "input_statistics",
            ..
        }
    ));
}

#[test]
fn encoder_without_scaling_is_refused() {
    let error = model_refusal("three-phases", |value| {
        value.as_object_mut().unwrap().remove("scaling");
    });
    assert_eq!(
        error,
        ModelError::Incomplete {
            part: "encoder",
            needs: "scaling"
        }
    );
}

// --- Library -------------------------------------------------------------------------------------

#[test]
fn library_terms_that_do_not_parse_are_refused_with_index_and_text() {
    for text in [
        "z1 +",
        "z3",
        "dz0",
        "foo(z1)",
        "sin z1",
        "z1; z2",
        "x; system(\"x\")",
        "\\input{x}",
        "sinh(z1)",
        "",
    ] {
        match model_refusal("three-phases", |value| value["library"][3] = json!(text)) {
            ModelError::Term { index, text: t, .. } => {
                assert_eq!((index, t.as_str()), (3, text));
            }
            other => panic!("{text}: {other:?}"),
        }
    }
}

#[test]
fn library_terms_nested_beyond_any_use_are_refused_or_read_without_a_panic() {
    for text in [
        "(".repeat(500) + "z1" + &")".repeat(499),
        "(".repeat(490) + "z1" + &")".repeat(490),
        "-".repeat(999) + "z1",
        "z1^".repeat(330) + "2",
        "sin(".repeat(190) + "z1" + &")".repeat(190),
        "(".repeat(150) + "z1" + &"^9)".repeat(150),
        "z1^999999999999999999999".to_owned(),
        "1e308*1e308*z1".to_owned(),
        "z1/0".to_owned(),
        "log(0)*z1".to_owned(),
        "0^-1".to_owned(),
    ] {
        let mut value = fixture("three-phases");
        value["library"][3] = json!(text);
        if let Err(error) = read_value(&value) {
            assert!(
                artifact::describe(&error).contains("`library`[3]"),
                "{text}"
            );
        }
    }
}

#[test]
fn library_with_equal_terms_is_kept_as_given() {
    let mut value = fixture("three-phases");
    value["library"][6] = json!("dz2*z1");
    let model = read_value(&value).expect("equal terms are summed in print");
    let texts: Vec<&str> = (model.library().terms().iter())
        .map(|term| term.text.as_str())
        .collect();
    assert_eq!(texts[5..7], ["z1*dz2", "dz2*z1"]);
}

#[test]
fn library_shorthand_beyond_bounds_is_refused_before_it_is_made() {
    let [place, found, _] = invalid("degree-3", |value| {
        value["library"]["degree"] = json!(1_000_000)
    });
    assert_eq!(
        (place.as_str(), found.as_str()),
        ("`library.degree`", "1000000")
    );
    let [place, found, _] = invalid("degree-3", |value| {
        value["latent_dim"] = json!(64);
        value["library"]["degree"] = json!(8);
    });
    assert_eq!(place, "`library`");
    assert!(found.ends_with(" terms"), "{found}");
}

// --- Names and phases ----------------------------------------------------------------------------

#[test]
fn names_that_are_keywords_or_smuggle_are_refused() {
    for name in [
        "while",
        "namespace",
        "fn",
        "math",
        "",
        "x; system(\"x\")",
        "\\input{x}",
        "a\u{0}b",
        "a\nb",
        "*/ int x; /*",
        "%s",
        "../../etc/passwd",
        "zwei\u{e4}",
        "2d",
        &"n".repeat(100),
    ] {
        for pointer in ["/name", "/phases/1/name"] {
            let error = model_refusal("degree-3", |value| {
                *value.pointer_mut(pointer).expect("there") = json!(name);
            });
            assert!(
                matches!(error, ModelError::Name { .. }),
                "{name:?}: {error}"
            );
            assert!(!error.to_string().contains(['\n', '\u{0}']), "{error}");
        }
    }
}

#[test]
fn refused_name_tells_the_character_and_its_place() {
    let error = model_refusal("degree-3", |value| value["name"] = json!("ab\\input{x}"));
    match error {
        ModelError::Name { what, source, .. } => {
            assert_eq!(what, "model name");
            assert!(source.to_string().starts_with("found '\\\\' at byte 2"));
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn phase_names_that_collide_as_identifiers_are_refused() {
    for (first, second) in [
        ("contact", "contact"),
        ("rear-stance", "rear stance"),
        ("contact", "Contact"),
    ] {
        let [place, found, expected] = invalid("degree-3", |value| {
            value["phases"][0]["name"] = json!(first);
            value["phases"][1]["name"] = json!(second);
        });
        assert_eq!(place, "phases[1].name");
        assert!(found.starts_with(&format!("{second:?}")), "{found}");
        assert!(expected.ends_with("phases[0]"), "{expected}");
    }
}

#[test]
fn phase_that_no_foot_pattern_selects_is_refused() {
    for feet in [json!("any"), json!([]), json!([[1, 0, 0, 0]])] {
        let error = model_refusal("degree-3", |value| {
            value["phases"][1]["feet"] = feet.clone()
        });
        assert!(matches!(
            error,
            ModelError::UnreachablePhase { phase: 1, .. }
        ));
    }
}

#[test]
fn feet_in_another_spelling_are_refused() {
    for feet in [
        json!("all"),
        json!([[1, 1, 1]]),
        json!([[1, 1, 1, 2]]),
        json!([[1, 1, 1, 1, 1]]),
        json!(4),
    ] {
        let (place, _) = syntax_refusal("degree-3", |value| {
            value["phases"][0]["feet"] = feet.clone();
        });
        assert!(place.starts_with("phases[0].feet"), "{place}");
    }
    let [place, ..] = invalid("three-phases", |value| {
        value["phases"][1]["feet"] = json!([[0, 0, 1, 1], [0, 0, 1, 1]]);
    });
    assert_eq!(place, "phases[1].feet[1]");
}

#[test]
fn model_without_phases_is_refused() {
    let [_, found, _] = invalid("degree-3", |value| value["phases"] = json!([]));
    assert_eq!(found, "0 phases");
}

#[test]
fn signal_names_and_units_that_smuggle_or_repeat_are_refused() {
    for (pointer, text) in [
        ("/state/names/1", "x; system(\"x\")"),
        ("/state/names/1", ""),
        ("/state/names/1", "a,b"),
        ("/state/units/0", "*/ int x; /*"),
        ("/state/units/0", "m // x"),
        ("/state/units/0", "\\input{x}"),
        ("/state/units/0", "m\n"),
    ] {
        let [place, _, expected] = invalid("three-phases", |value| {
            *value.pointer_mut(pointer).expect("there") = json!(text);
        });
        let list = if pointer.contains("names") {
            "`state.names`[1]"
        } else {
            "`state.units`[0]"
        };
        assert_eq!(place, list, "{text:?}");
        assert!(expected.starts_with("1 to 64 characters"), "{expected}");
    }
    let [place, found, _] = invalid("three-phases", |value| {
        value["state"]["names"][4] = json!("b")
    });
    assert_eq!(
        [place, found],
        ["`state.names`[4]", "\"b\" as in [1] already"]
    );
}

#[test]
fn unknown_robot_and_foreign_coordinates_are_refused() {
    let error = model_refusal("robot-degree-2", |value| value["robot"] = json!("rex"));
    assert!(matches!(error, ModelError::Robot(_)), "{error}");
    let [place, ..] = invalid("robot-degree-2", |value| {
        array(value, "/state/names").swap(3, 6);
    });
    assert_eq!(place, "`state.names`[3]");
}

#[test]
fn description_with_control_characters_is_refused() {
    for text in ["a\u{7}b".to_owned(), "x".repeat(20_000)] {
        let [place, ..] = invalid("degree-3", |value| value["description"] = json!(text));
        assert_eq!(place, "`description`");
    }
}

// --- Latent-only models --------------------------------------------------------------------------

#[test]
fn latent_only_model_says_what_it_lacks() {
    let model = read_value(&fixture("degree-3")).expect("fixture");
    let x = nalgebra::DVector::zeros(18);
    let z = nalgebra::DVector::zeros(2);
    for error in [
        model.encode(&x).unwrap_err(),
        model.tangent(&x).unwrap_err(),
        model.encoder_jacobian(&x).unwrap_err(),
        model.decode(&z).unwrap_err(),
        model.decoder_jacobian(&z).unwrap_err(),
        model.robot().unwrap_err(),
        model.sample_time_s().unwrap_err(),
        model.input_statistics(0).unwrap_err(),
    ] {
        assert!(matches!(error, ModelError::Missing { .. }), "{error}");
        assert!(error.to_string().starts_with("model degree-3 has no `"));
    }
    assert_eq!(model.state_dim(), None);
}

// --- Writing -------------------------------------------------------------------------------------

#[test]
fn written_file_is_whole_and_leaves_nothing_beside_it() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("model.json");
    let model = read_value(&fixture("robot-degree-2")).expect("fixture");
    artifact::write(&path, &model, Overwrite::Refuse).expect("written");
    assert_eq!(artifact::read(&path).expect("readable"), model);
    assert_eq!(fs::read_dir(folder.path()).expect("folder").count(), 1);
    // The digest is that of the written bytes. It does not depend on the layout of the file that was read.
    let compact = read_value(&serde_json::from_slice(&fs::read(&path).unwrap()).unwrap());
    let digest = artifact::digest(&compact.expect("same model"));
    assert_eq!(digest, artifact::digest(&model));
    assert_eq!(digest.to_string().len(), 64);
    assert!(digest.to_string().starts_with(&digest.short()));
}

#[test]
fn different_file_is_replaced_only_when_asked() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("model.json");
    fs::write(&path, "notes").expect("written");
    let model = read_value(&fixture("degree-3")).expect("fixture");
    let error = artifact::write(&path, &model, Overwrite::Refuse).unwrap_err();
    let text = "a file of this name is there already";
    assert_eq!(error.kind.to_string(), text);
    assert_eq!(fs::read_to_string(&path).expect("readable"), "notes");
    artifact::write(&path, &model, Overwrite::Replace).expect("replaced");
    artifact::write(&path, &model, Overwrite::Refuse).expect("the same bytes are no conflict");
    assert_eq!(artifact::read(&path).expect("readable"), model);
}

#[test]
fn file_in_a_missing_folder_is_refused_and_leaves_nothing() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("no/model.json");
    let model = read_value(&fixture("degree-3")).expect("fixture");
    let error = artifact::write(&path, &model, Overwrite::Refuse).unwrap_err();
    assert!(matches!(
        error.kind,
        Fault::Io { action, .. } if action.starts_with("write")
    ));
    assert_eq!(fs::read_dir(folder.path()).expect("folder").count(), 0);
}

/// The text of the first fixture with this provenance.
fn with_provenance(provenance: &Value) -> Result<String, ArtifactError> {
    let mut value = fixture("one-dimensional");
    value["provenance"] = provenance.clone();
    read_value(&value).map(|model| artifact::to_text(&model))
}

#[test]
fn text_has_one_row_of_a_matrix_per_line_and_fills_lines_with_words() {
    let text = with_provenance(
        &json!({ "name": "m", "weights": [[1.0, -0.5], [2.5e-7, 3.0]], "bias": [0.0] }),
    );
    let expected = "\n  \"provenance\": {\n    \"name\": \"m\",\n    \"weights\": [\n      [1.0, -0.5],\n      \
                    [2.5e-7, 3.0]\n    ],\n    \"bias\": [0.0]\n  }\n}\n";
    let text = text.expect("any JSON");
    assert!(text.ends_with(expected), "{text}");
    let word = "x".repeat(38);
    let text = with_provenance(&json!({ "w": [word, word, word] })).expect("any JSON");
    let expected =
        format!("\"w\": [\n      \"{word}\", \"{word}\",\n      \"{word}\"\n    ]\n  }}\n}}\n");
    assert!(text.ends_with(&expected), "{text}");
}

#[test]
fn provenance_reads_back_equal_and_too_many_values_are_refused() {
    let provenance = json!({
        "empty": {}, "none": [], "nested": [[], [{ "a": [null, true] }]], "b": -2,
        "text": "quote \" and \u{1} and \\", "words": ["a".repeat(60), "b".repeat(60)],
        "number": [1e300, -0.0, 5e-324, 12345678901234567u64, u64::MAX],
    });
    let text = with_provenance(&provenance).expect("any JSON");
    let again: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(again["provenance"], provenance);
    // The object and its list count as values as well.
    assert!(with_provenance(&json!({ "v": vec![0; 99_998] })).is_ok());
    let error = with_provenance(&json!({ "v": vec![0; 99_999] })).expect_err("too many");
    assert!(
        error.to_string().contains("more than 100000 values"),
        "{error}"
    );
    let error = with_provenance(&json!([]))
        .expect_err("an array")
        .to_string();
    assert!(error.contains("found [], expected an object"), "{error}");
}
