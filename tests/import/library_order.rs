//! Orders in which trainers keep the terms of a standard library: coefficients land on the terms that they were
//! learned for, and recordings find the order.

use std::fs;
use std::process::Output;

use nalgebra::{DMatrix, DVector};
use romc::import::*;
use romc::model::{Library, LibraryChoice, LibraryOrder, ReducedModel, StandardLibrary};
use romc::recording;
use romc::sim::LatentSegment;
use serde_json::Value;
use zip::CompressionMethod;

use crate::command_line::{romc, text};
use crate::store::{Stored, list, model, npz, plain};
use crate::tools::is_thorough;
use crate::trained::{input_factors, jump};

/// The terms as a trainer makes them, by the words of the paper and of its training code.
fn terms(order: &str, d: usize, degree: u32, inputs: bool) -> Vec<String> {
    let state: Vec<String> = (["z", "dz"].iter())
        .flat_map(|kind| (1..=d).map(move |i| format!("{kind}{i}")))
        .collect();
    let (z, dz) = state.split_at(d);
    let of = |function: &str, names: &[String]| -> Vec<String> {
        names
            .iter()
            .map(|name| format!("{function}({name})"))
            .collect()
    };
    let mut terms = vec!["1".to_owned()];
    terms.extend(state.clone());
    if degree == 2 {
        for (i, first) in state.iter().enumerate() {
            terms.extend(state[i..].iter().map(|second| format!("{first}*{second}")));
        }
    }
    terms.extend(match order {
        "paper" => [of("sin", z), of("cos", z), of("sin", dz), of("cos", dz)].concat(),
        "romc" => [of("sin", &state), of("cos", &state)].concat(),
        _ => (state.iter())
            .flat_map(|name| [format!("sin({name})"), format!("cos({name})")])
            .collect(),
    });
    terms.extend((1..=d).filter(|_| inputs).map(|i| format!("u{i}")));
    terms
}

fn order_of(name: &str) -> LibraryOrder {
    let mut named = LibraryOrder::NAMED.into_iter();
    named
        .find(|order| order.name() == Some(name))
        .expect("an order")
}

#[test]
fn coefficients_in_any_order_land_on_their_terms() {
    let mut state = 1u64;
    let mut random = move || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    for case in 0..if is_thorough() { 500 } else { 50 } {
        let (d, degree, inputs) = (1 + case % 4, 1 + (case as u32 / 4) % 2, case % 3 > 0);
        let order = ["paper", "interleaved", "romc"][case % 3];
        let texts = terms(order, d, degree, inputs);
        let xi = DMatrix::from_fn(texts.len(), d, |_, _| random());
        let mask = xi.map(|value| f64::from(value > -0.2));
        let turned = |m: &DMatrix<f64>| {
            if case % 2 == 0 {
                m.clone()
            } else {
                m.transpose()
            }
        };
        let stored = [
            plain("Xi", &turned(&xi)),
            plain("coefficient_mask", &turned(&mask)),
        ];
        let options = ImportOptions {
            name: "made".to_owned(),
            library: Some(LibraryChoice::Standard(StandardLibrary {
                degree,
                trigonometric: true,
                inputs,
            })),
            library_order: Some(order_of(order)),
            ..ImportOptions::default()
        };
        let bytes = npz(&stored, CompressionMethod::Stored);
        let found = import_from_bytes("n.npz", Format::Npz, &bytes, &options).expect("imports");
        assert_eq!(found.report.library_order, Some(order));
        let [z, dz, u] = [(); 3].map(|()| DVector::from_fn(d, |_, _| 3.0 * random()));
        let library = Library::from_terms(d, &texts).expect("terms");
        let theta = library.evaluate(&z, &dz, &u).expect("fits");
        let expected = xi.component_mul(&mask).transpose() * theta;
        let ddz = found.model.ddz(0, &z, &dz, &u).expect("fits");
        assert!((ddz - expected).amax() < 1e-12, "case {case}, {order}");
        let is_product = |text: &String| text.contains('*');
        assert_eq!(found.report.terms.len(), texts.len());
        for (found, expected) in found.report.terms.iter().zip(&texts) {
            assert!(
                found == expected || is_product(expected),
                "{found} {expected}"
            );
        }
    }
}

#[test]
fn command_asks_for_the_order_and_prints_where_they_differ() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let xi = DMatrix::from_fn(15, 2, |i, j| (i + j) as f64);
    let bytes = npz(&[plain("xi_contact", &xi)], CompressionMethod::Stored);
    fs::write(folder.path().join("net.npz"), bytes).expect("writable");
    let arguments = ["import", "net.npz", "--output", "net.json", "--library"];
    let run = |more: &[&str]| romc(folder.path(), &[&arguments[..], more].concat());
    let asked = run(&["degree=1,trigonometric,inputs"]);
    assert_eq!(asked.status.code(), Some(2));
    let said = text(&asked.stderr);
    for choice in [
        "--library-order paper (sin(z2) in row 7, cos(z1) in row 8)",
        "--library-order interleaved (cos(z1) in row 7, sin(z2) in row 8)",
        "--library-order romc (sin(z2) in row 7, sin(dz1) in row 8)",
    ] {
        assert!(said.contains(choice), "{said}");
    }
    assert!(!folder.path().join("net.json").exists());
    let stated = run(&["degree=1,trigonometric,inputs", "--library-order", "paper"]);
    let said = text(&stated.stdout);
    let words: Vec<&str> = said.split_whitespace().collect();
    let terms = terms("paper", 2, 1, true).join("; ");
    let rows = format!("rows of xi (--library-order paper): {terms}");
    assert!(words.join(" ").contains(&rows), "{said}");
    let listed = run(&["1; z1; z2", "--library-order", "paper", "--force"]);
    assert_eq!(listed.status.code(), Some(2), "{}", text(&listed.stderr));
    // Without sines the orders are one.
    let few = plain("xi_contact", &xi.rows(0, 7).into_owned());
    fs::write(
        folder.path().join("net.npz"),
        npz(&[few], CompressionMethod::Stored),
    )
    .expect("writable");
    let plain = run(&["degree=1,inputs", "--force"]);
    assert!(plain.status.success(), "{}", text(&plain.stderr));
}

/// Maps of go1-d4 and coefficients over a library with sines, fitted to a jump.
fn fitted() -> (ReducedModel, Vec<DMatrix<f64>>) {
    let original = model("tests/fixtures/import/go1-d4.json");
    let jump = recording::read(jump().as_ref()).expect("checked in");
    let latent = LatentSegment::encode(&original, &jump.segments[0]).expect("a jump");
    let library =
        Library::of(4, LibraryChoice::Standard(StandardLibrary::default())).expect("small");
    let xi = (0..original.phases().len()).map(|phase| {
        let samples: Vec<usize> = (0..latent.time_s.len())
            .filter(|&k| latent.phase[k] == phase)
            .collect();
        let column = |k: usize| {
            [
                latent.z.column(k),
                latent.dz.column(k),
                latent.u_lat.column(k),
            ]
        };
        let variables = DMatrix::from_fn(12, samples.len(), |row, k| {
            column(samples[k])[row / 4][row % 4]
        });
        let ddz = DMatrix::from_fn(samples.len(), 4, |k, row| latent.ddz[(row, samples[k])]);
        let theta = library.evaluate_points(&variables).expect("fits");
        theta
            .svd(true, true)
            .solve(&ddz, 1e-6)
            .expect("both sides were asked for")
    });
    let xi = xi.collect();
    (original, xi)
}

/// Imports the maps with coefficients by phase over a shorthand, compared with the jump.
fn compared(original: &ReducedModel, xi: &[DMatrix<f64>], more: &[&str]) -> (Output, Value) {
    let library = ["--library", "degree=1,trigonometric,inputs"];
    compared_with(original, xi, &[&library[..], more].concat())
}

fn compared_with(original: &ReducedModel, xi: &[DMatrix<f64>], more: &[&str]) -> (Output, Value) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (encoder, decoder) = (original.encoder().unwrap(), original.decoder().unwrap());
    let mut tensors: Vec<Stored> = vec![
        plain("encoder.weight", encoder.weights()),
        list("encoder.bias", encoder.bias().as_slice()),
        plain("decoder.weight", decoder.weights()),
        list("decoder.bias", decoder.bias().as_slice()),
    ];
    for (phase, xi) in original.phases().iter().zip(xi) {
        tensors.push(plain(&format!("Xi_{}", phase.name), xi));
    }
    fs::write(
        folder.path().join("net.npz"),
        npz(&tensors, CompressionMethod::Stored),
    )
    .expect("writable");
    let (jump, factors) = (jump(), input_factors(&"joints,body".parse().unwrap()));
    let factors: Vec<String> = (factors.split(','))
        .map(|factor| (10.0 * factor.parse::<f64>().unwrap()).to_string())
        .collect();
    let arguments = [
        &[
            "import",
            "net.npz",
            "--output",
            "net.json",
            "--robot",
            "go1",
            "--scaling",
            "0.1",
        ][..],
        &[
            "--input-scaling",
            &factors.join(","),
            "--inputs-from",
            &jump,
            "--json",
        ],
        more,
    ];
    let done = romc(folder.path(), &arguments.concat());
    let answer = serde_json::from_slice(&done.stdout).unwrap_or_default();
    (done, answer)
}

/// Coefficients whose rows are in another order than romc's.
fn in_order(xi: &[DMatrix<f64>], texts: &[String]) -> Vec<DMatrix<f64>> {
    let own = terms("romc", 4, 1, true);
    let rows: Vec<usize> = (texts.iter())
        .map(|text| own.iter().position(|own| own == text).expect("a term"))
        .collect();
    let sorted = |xi: &DMatrix<f64>| DMatrix::from_fn(xi.nrows(), 4, |i, j| xi[(rows[i], j)]);
    xi.iter().map(sorted).collect()
}

#[test]
fn recordings_decide_the_order_and_refuse_another() {
    let (original, xi) = fitted();
    for order in ["paper", "interleaved", "romc"] {
        let stored = in_order(&xi, &terms(order, 4, 1, true));
        let (done, answer) = compared(&original, &stored, &[]);
        assert!(done.status.success(), "{order}: {}", text(&done.stderr));
        assert_eq!(answer["report"]["library_order"], order);
        let r2 = &answer["check"]["library_order_r2"];
        assert!(r2[order].as_f64().unwrap() > 0.9, "{r2}");
    }
    let stored = in_order(&xi, &terms("paper", 4, 1, true));
    let (wrong, _) = compared(&original, &stored, &["--library-order", "romc"]);
    assert_eq!(wrong.status.code(), Some(1));
    let said = text(&wrong.stderr);
    assert!(
        said.contains("in another order: expected --library-order paper;"),
        "{said}"
    );
    let (right, _) = compared(&original, &stored, &["--library-order", "paper"]);
    assert!(right.status.success(), "{}", text(&right.stderr));
}

#[test]
fn order_without_a_name_is_refused_with_the_terms_in_it() {
    let (original, xi) = fitted();
    let mut texts = terms("paper", 4, 1, true);
    let inputs = texts.split_off(25);
    texts = [inputs, texts].concat();
    let stored = in_order(&xi, &texts);
    let (wrong, _) = compared(&original, &stored, &["--library-order", "paper"]);
    assert_eq!(wrong.status.code(), Some(1));
    let (said, list) = (text(&wrong.stderr), texts.join("; "));
    assert!(
        said.contains(&format!("expected --library \"{list}\"")),
        "{said}"
    );
}

#[test]
fn list_in_another_order_than_the_coefficients_is_refused_with_the_one_that_fits() {
    let (original, xi) = fitted();
    let stored = in_order(&xi, &terms("paper", 4, 1, true));
    let list = |order: &str| terms(order, 4, 1, true).join("; ");
    let (wrong, _) = compared_with(&original, &stored, &["--library", &list("romc")]);
    assert_eq!(wrong.status.code(), Some(1), "{}", text(&wrong.stderr));
    let said = text(&wrong.stderr);
    assert!(
        said.contains(&format!("expected --library \"{}\"", list("paper"))),
        "{said}"
    );
    let (right, _) = compared_with(&original, &stored, &["--library", &list("paper")]);
    assert!(right.status.success(), "{}", text(&right.stderr));
}

#[test]
fn exchanged_phases_are_refused_with_the_mapping_that_exchanges_them() {
    let (original, xi) = fitted();
    let mut stored = in_order(&xi, &terms("paper", 4, 1, true));
    stored.reverse();
    for order in [&[][..], &["--library-order", "paper"]] {
        let (wrong, _) = compared(&original, &stored, order);
        assert_eq!(wrong.status.code(), Some(1), "{}", text(&wrong.stderr));
        let said = text(&wrong.stderr);
        let mapping = [
            "--map",
            "xi.contact=Xi_flight",
            "--map",
            "xi.flight=Xi_contact",
        ];
        assert!(said.contains("contact and flight exchanged"), "{said}");
        assert!(said.contains(&mapping.join(" ")), "{said}");
        let (right, answer) = compared(&original, &stored, &mapping);
        assert!(right.status.success(), "{}", text(&right.stderr));
        assert_eq!(answer["report"]["library_order"], "paper");
    }
}

#[test]
fn coefficients_that_have_not_converged_are_called_so() {
    let (original, xi) = fitted();
    // The training starts at ones.
    let ones: Vec<DMatrix<f64>> = xi.iter().map(|xi| xi.map(|_| 1.0)).collect();
    let (done, answer) = compared(&original, &ones, &["--library-order", "paper"]);
    assert!(done.status.success(), "{}", text(&done.stderr));
    let fault = answer["check"]["fault"].as_str().expect("a warning");
    assert!(
        fault.contains("the training has not converged") && fault.contains("same terms reach 0.9"),
        "{fault}"
    );
    // Half the way is on no other order's.
    let mut state = 3u64;
    let noisy = xi.iter().map(|xi| {
        xi.map(|value| {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1);
            value * (state >> 32) as f64 / (1u64 << 32) as f64
        })
    });
    let noisy: Vec<DMatrix<f64>> = noisy.collect();
    let (open, _) = compared(&original, &noisy, &[]);
    assert_eq!(open.status.code(), Some(2), "{}", text(&open.stderr));
}
