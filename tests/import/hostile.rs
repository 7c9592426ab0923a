//! The importer never panics, and accepted models are finite.

use nalgebra::DMatrix;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use romc::import::*;
use romc::model::{LibraryChoice, Scaling};
use zip::CompressionMethod;

use super::store::*;

fn options() -> ImportOptions {
    ImportOptions {
        name: "hostile".to_owned(),
        library: Some(LibraryChoice::Standard(
            parse_standard("degree=1,inputs").expect("a shorthand"),
        )),
        scaling: Some(Scaling::uniform(0.1)),
        ..ImportOptions::default()
    }
}

fn stored() -> Vec<Stored> {
    let wave = |rows, columns| DMatrix::from_fn(rows, columns, |r, c| ((r * 7 + c) as f64).sin());
    vec![
        plain("encoder.weight", &wave(2, 5)),
        list("encoder.bias", &[0.1, 0.2]),
        plain("xi_contact", &wave(7, 2)),
    ]
}

fn exercise(format: Format, bytes: &[u8]) {
    if let Ok(imported) = import_from_bytes("hostile", format, bytes, &options()) {
        for phase in imported.model.phases() {
            assert!(phase.xi.iter().all(|value| value.is_finite()));
        }
    }
}

/// Some bytes are changed, then the end is cut off.
fn damaged(bytes: Vec<u8>) -> impl Strategy<Value = Vec<u8>> {
    let length = bytes.len();
    let changes = proptest::collection::vec((0..length, any::<u8>()), 0..6);
    (changes, 0..=length, any::<bool>()).prop_map(move |(changes, end, cut)| {
        let mut bytes = bytes.clone();
        for (position, value) in changes {
            bytes[position] = value;
        }
        if cut {
            bytes.truncate(end);
        }
        bytes
    })
}

const EQUATIONS: &str = "# two phases\n[contact]\nddz1 = 0.5*z1 - 2*(u1 + dz1)\n   + z1^2\n\
                         [flight]\nddz1 = -9.81\n";

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, rng_seed: RngSeed::Fixed(7), ..ProptestConfig::default() })]

    #[test]
    fn damaged_safetensors_never_panic(bytes in damaged(safetensors(&stored()))) {
        exercise(Format::Safetensors, &bytes);
    }

    #[test]
    fn damaged_npz_never_panic(bytes in damaged(npz(&stored(), CompressionMethod::Stored))) {
        exercise(Format::Npz, &bytes);
    }

    #[test]
    fn damaged_compressed_npz_never_panic(bytes in damaged(npz(&stored(), CompressionMethod::Deflated))) {
        exercise(Format::Npz, &bytes);
    }

    #[test]
    fn damaged_equations_never_panic(bytes in damaged(EQUATIONS.as_bytes().to_vec())) {
        exercise(Format::Equations, &bytes);
    }

    #[test]
    fn random_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        for format in [Format::Safetensors, Format::Npz, Format::Equations] {
            exercise(format, &bytes);
        }
    }

    #[test]
    fn random_equations_never_panic(text in "(\\[[a-c]\\]\n|d?d?[zu][0-3]|[-+*/^()=.#\n ]|[0-9]{1,3}|sin|e){0,40}") {
        exercise(Format::Equations, text.as_bytes());
    }

    /// A header may make any claim about the following bytes.
    #[test]
    fn any_npy_header_never_panics(header in "[ -~]{0,80}", length in any::<u16>(), version in 0u8..5) {
        let mut npy = b"\x93NUMPY".to_vec();
        npy.extend([version, 0]);
        npy.extend(length.to_le_bytes());
        npy.extend(header.as_bytes());
        let members = [("xi_contact.npy".to_owned(), npy)];
        exercise(Format::Npz, &zip(&members, CompressionMethod::Stored));
    }
}
