//! Candidate terms of equations and of lists, options as text, arrays in memory and headers of NumPy.

use std::fs;

use romc::files::Place;
use romc::import::role::Role;
use romc::import::*;
use romc::model::{FeetRule, LibraryChoice, StandardLibrary};
use romc::robot::PhasePattern;
use zip::CompressionMethod;

use super::store::{Number, Order, Stored, npz, zip};

fn options(terms: &[&str]) -> ImportOptions {
    let terms = terms.iter().map(|term| (*term).to_owned()).collect();
    ImportOptions {
        name: "m".to_owned(),
        library: Some(LibraryChoice::Terms(terms)),
        ..ImportOptions::default()
    }
}

/// Coefficients and terms of `ddz1` in the library's order: `0.5 z1; -2.0 sin(z1)`.
fn separate(text: &str) -> String {
    let text = format!("[contact]\nddz1 = {text}\nddz2 = 0\n");
    let options = ImportOptions {
        name: "m".to_owned(),
        ..ImportOptions::default()
    };
    let imported = import_from_bytes("eq", Format::Equations, text.as_bytes(), &options);
    let model = imported.expect("equations").model;
    let xi = model.phases()[0].xi.column(0);
    let terms = model.library().terms().iter().zip(xi.iter());
    let texts: Vec<String> = terms
        .filter(|(_, coefficient)| **coefficient != 0.0)
        .map(|(term, coefficient)| format!("{coefficient:?} {}", term.text))
        .collect();
    texts.join("; ")
}

#[test]
fn coefficients_are_the_numbers_as_written() {
    assert_eq!(
        separate("u2*3 - 0.1*z1 + 0.36 - sin(dz1)/4 + 1e-320*z2 + 1.7976931348623157e308*u1"),
        "0.36 1; -0.1 z1; 1e-320 z2; -0.25 sin(dz1); 1.7976931348623157e308 u1; 3.0 u2"
    );
}

#[test]
fn products_with_numbers_are_multiplied_out_and_like_terms_added() {
    assert_eq!(
        separate("2*(0.5*z1 - 3*(u1 + 1)) + z1*(1 + dz1) + z1 + (z2 + u2)/2"),
        "-6.0 1; 2.0 z1; 0.5 z2; 1.0 z1*(1 + dz1); -6.0 u1; 0.5 u2"
    );
    assert_eq!(separate("2*(z1 + u1) - 2*z1 - u1*2"), "");
}

#[test]
fn terms_are_sorted_as_in_the_standard_library() {
    let sorted = "z1 z2 dz1 dz2 z1^2 z1*z2 z1*dz1 z1*dz2 z2^2 z2*dz1 z2*dz2 dz1^2 dz1*dz2 dz2^2 z1^3 \
                  z1^2*dz1 sin(z1) sin(z2) sin(dz1) sin(dz2) cos(z1) cos(z2) cos(dz1) cos(dz2) u1*z1 \
                  tanh(z1) u1";
    let sorted: Vec<&str> = sorted.split_whitespace().collect();
    let shuffled: Vec<&str> = sorted.iter().rev().copied().collect();
    let expected = format!("1.0 1; 1.0 {}", sorted.join("; 1.0 "));
    assert_eq!(separate(&format!("{} + 1", shuffled.join(" + "))), expected);
}

/// The terms of a list, over two latent coordinates.
fn listed(terms: &[&str]) -> Result<Vec<String>, ImportError> {
    let values = vec![1.0; 2 * terms.len()];
    let xi = Tensor {
        name: "xi.contact".to_owned(),
        shape: vec![terms.len(), 2],
        values: &values,
        is_column_major: false,
    };
    let options = ImportOptions {
        latent_dim: Some(2),
        xi_layout: Some(XiLayout::TermsByLatent),
        ..options(terms)
    };
    let model = import_tensors("arrays", &[xi], &options)?.model;
    let terms = model.library().terms().iter();
    Ok(terms.map(|term| term.text.clone()).collect())
}

#[test]
fn names_of_pysindy_are_products() {
    let (names, expected): (Vec<&str>, Vec<&str>) = [
        ("1", "1"),
        ("z1 z2", "z1*z2"),
        ("z1^2 dz1", "z1^2*dz1"),
        ("sin(1 z1)", "sin(1*z1)"),
        ("z1 sin(2 dz1)  cos(1 z2)", "z1*sin(2*dz1)*cos(1*z2)"),
        ("z1**2", "z1^2"),
        ("1e-3 z1", "1e-3*z1"),
        ("2.5E+2 z1", "2.5E+2*z1"),
        ("z1 - 0.5 * z2", "z1 - 0.5 * z2"),
        ("tanh(z1)*(1 + u1)", "tanh(z1)*(1 + u1)"),
        ("sin (z1) cos (2 z_2)", "sin (z1)*cos (2*z2)"),
    ]
    .into_iter()
    .unzip();
    assert_eq!(listed(&names).expect("terms"), expected);
}

#[test]
fn names_are_counted_from_zero_or_from_one() {
    for (names, expected) in [
        (
            &["x0", "x1 x3", "sin(1 x2)", "u1", "exp(x0)"][..],
            &["z1", "z2*dz2", "sin(1*dz1)", "u2", "exp(z1)"][..],
        ),
        (&["x1", "x2 x4", "u1", "u2"], &["z1", "z2*dz2", "u1", "u2"]),
        (&["x1", "u2"], &["z1", "u2"]),
    ] {
        assert_eq!(listed(names).expect("names in one way"), expected);
    }
    for (names, said) in [
        (&["x1", "x2", "x3"][..], "from 0 or from 1"),
        (&["x0", "x4"], "one too many"),
        (&["x1", "x2", "u0", "u2"], "one too many"),
        (&["x0", "z2"], "x and z in one list"),
    ] {
        let error = listed(names).expect_err(said).to_string();
        assert!(error.contains(said), "{error}");
    }
}

#[test]
fn terms_are_read_from_lines_and_from_json() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("terms");
    let read = |text: &str| {
        fs::write(&path, text).expect("written");
        read_terms(&path)
    };
    for text in [
        "1\n z1 # position\n\nsin(dz1)\n",
        "[\"1\", \"z1\", \"sin(dz1)\"]",
        "{ \"library\": [\"1\", \"z1\", \"sin(dz1)\"], \"phases\": {} }",
    ] {
        assert_eq!(read(text).expect(text), ["1", "z1", "sin(dz1)"]);
    }
    for text in ["", "# only a comment", "[1]", "{}", "[\"1\",", "[[\"1\"]]"] {
        let error = read(text).expect_err(text);
        assert!(matches!(error.place, Place::Character(..)), "{error}");
    }
}

#[test]
fn options_are_read_from_their_texts_or_refused() {
    let degree_2 = StandardLibrary {
        degree: 2,
        trigonometric: true,
        inputs: false,
    };
    let read = parse_standard("degree=2, trigonometric").expect("a shorthand");
    assert_eq!(read, degree_2);
    for text in "|inputs|degree=1,degree=2|degree=-1|degree=1,cosines".split('|') {
        assert!(parse_standard(text).is_err(), "{text}");
    }
    let rear: PhasePattern = "rear=0011, 0001".parse().expect("two patterns");
    assert_eq!(rear.feet.to_string(), "0011,0001");
    let contact: PhasePattern = "contact=any".parse().expect("a rule");
    assert_eq!(contact.feet, FeetRule::Any);
    for text in "|contact|=any|rear=|rear=001|rear=00112|rear=002x".split('|') {
        assert!(text.parse::<PhasePattern>().is_err(), "{text}");
    }
    let mapping: Mapping = "xi.contact=a=b/c:0".parse().expect("a part and a tensor");
    assert_eq!(mapping.role, Role::Xi("contact".to_owned()));
    assert_eq!(mapping.tensor, "a=b/c:0");
    for text in "|encoder.weight|encoder.weight=|=W|encoder=W|xi.=W".split('|') {
        let error = text.parse::<Mapping>().expect_err(text);
        assert!(error.to_string().starts_with("--map: found "), "{error}");
    }
}

fn xi(values: &[f64], is_column_major: bool) -> Tensor<'_> {
    Tensor {
        name: "xi.contact".to_owned(),
        shape: vec![3, 2],
        values,
        is_column_major,
    }
}

#[test]
fn arrays_of_either_order_make_the_same_model() {
    fn import(tensor: Tensor<'_>) -> Result<Imported, ImportError> {
        import_tensors("arrays", &[tensor], &options(&["1", "z1", "dz2"]))
    }
    let rows = import(xi(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], false)).expect("a model");
    let columns = import(xi(&[1.0, 3.0, 5.0, 2.0, 4.0, 6.0], true)).expect("a model");
    let coefficients = |imported: &Imported| imported.model.phases()[0].xi.clone();
    assert_eq!(coefficients(&rows), coefficients(&columns));
    assert_eq!(coefficients(&rows)[(1, 0)], 3.0);
    let digest = |imported: &Imported| imported.model.provenance()["sha256"].clone();
    assert_ne!(digest(&rows), digest(&columns));
    for (is_column_major, place) in [(true, "[1, 1]"), (false, "[2, 0]")] {
        let values = [0.0, 1.0, 2.0, 3.0, f64::NAN, 5.0];
        let error = import(xi(&values, is_column_major)).expect_err("not finite");
        let expected = format!("arrays: `xi.contact`{place} as xi.contact: found NaN");
        assert!(error.to_string().starts_with(&expected), "{error}");
    }
    let error = import(xi(&[1.0], false)).expect_err("too few numbers");
    let found = "found 1 numbers, expected 6 (3 x 2)";
    assert!(error.to_string().contains(found), "{error}");
}

/// Imports an array of NumPy with this dictionary in its header, of `version`.
fn with_header(version: u8, dictionary: &str, numbers: &[u8]) -> Result<Imported, ImportError> {
    let mut bytes = b"\x93NUMPY".to_vec();
    bytes.extend([version, 0]);
    match version {
        1 => bytes.extend((dictionary.len() as u16).to_le_bytes()),
        _ => bytes.extend((dictionary.len() as u32).to_le_bytes()),
    }
    bytes.extend(dictionary.as_bytes());
    bytes.extend(numbers);
    let file = zip(
        &[("xi.contact.npy".to_owned(), bytes)],
        CompressionMethod::Stored,
    );
    import_from_bytes("m.npz", Format::Npz, &file, &options(&["z1", "u1"]))
}

#[test]
fn headers_of_numpy_are_read_or_refused() {
    let numbers = |bytes: fn(f64) -> Vec<u8>| [bytes(0.25), bytes(3.0)].concat();
    let little = numbers(|v| v.to_le_bytes().to_vec());
    let big = numbers(|v| (v as f32).to_be_bytes().to_vec());
    for (version, dictionary, bytes) in [
        (
            1,
            "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 1), }   \n",
            &little,
        ),
        (
            2,
            "{'shape': (2L,), 'fortran_order': True, 'descr': '>f4'}",
            &big,
        ),
    ] {
        let model = with_header(version, dictionary, bytes)
            .expect(dictionary)
            .model;
        assert_eq!(model.phases()[0].xi.as_slice(), [0.25, 3.0]);
    }
    let refusal = |version, dictionary| {
        let error = with_header(version, dictionary, &little).expect_err(dictionary);
        error.to_string()
    };
    let structure =
        "{'descr': [('a', '<f8'), ('b', '<f4', (2,))], 'fortran_order': False, 'shape': (2,)}";
    let found = "`xi.contact` as xi.contact: found numbers of type a structure";
    assert!(refusal(1, structure).contains(found));
    for dictionary in [
        "",
        "{}",
        "{'descr': '<f8', 'shape': (1,)}",
        "{'descr': '<f8', 'fortran_order': 0, 'shape': (1,)}",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (1,,)}",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (-1,)}",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (99999999999999999999,)}",
        "{'descr': f8, 'fortran_order': False, 'shape': (1,)}",
    ] {
        let error = refusal(1, dictionary);
        assert!(
            error.contains("found a header that cannot be read"),
            "{error}"
        );
    }
    assert!(refusal(9, "{}").contains("found version 9"));
}

/// Numbers keep their values and places for every order of bytes and of indices.
#[test]
fn numbers_follow_the_order_of_bytes_and_of_indices() {
    let values = [0.5f64, -2.0];
    let stored = |number, bytes: Vec<u8>| Stored {
        name: "xi.contact".to_owned(),
        shape: vec![2, 1],
        bytes,
        number,
        order: Order::Fortran,
    };
    let bytes = |of: fn(f64) -> Vec<u8>| values.iter().flat_map(|v| of(*v)).collect();
    for tensor in [
        stored(Number::F32, bytes(|v| (v as f32).to_le_bytes().to_vec())),
        stored(Number::BigF64, bytes(|v| v.to_be_bytes().to_vec())),
    ] {
        let file = npz(&[tensor], CompressionMethod::Deflated);
        let imported = import_from_bytes("m.npz", Format::Npz, &file, &options(&["z1", "u1"]));
        assert_eq!(
            imported.expect("a model").model.phases()[0].xi.as_slice(),
            values
        );
    }
}
