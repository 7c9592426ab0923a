//! Of `src/learn/train/seeds.rs`.

use std::sync::atomic::AtomicBool;

use nalgebra::DVector;

use super::*;
use crate::model::{AffineMap, LibraryChoice, StandardLibrary};
use crate::train::metrics::SetMetrics;
use crate::train::progress::Progress;
use crate::train::task::Maps;

fn outcome(score: f64, coefficient: f64) -> Outcome {
    let report = SeedReport {
        seed: 1,
        score,
        losses: None,
        active: 1,
        dominant: Vec::new(),
        judged: SetMetrics::default(),
    };
    let weights = DMatrix::identity(2, 2);
    let map = AffineMap::new("map", weights.clone(), DVector::zeros(2)).expect("finite");
    let maps = Maps {
        decoder: map.clone().into(),
        encoder: map.into(),
        weights,
        training: Vec::new(),
        validation: Vec::new(),
    };
    let fitted = Fitted {
        maps,
        xi: vec![DMatrix::from_element(7, 2, coefficient)],
        choice: None,
        score: 0.0,
    };
    Ok((report, fitted))
}

#[test]
fn seeds_without_a_model_are_left_out_and_the_first_reason_is_kept() {
    let (cancel, mut listener) = (AtomicBool::new(false), |_: Progress| ());
    let mut monitor = Monitor::new(&mut listener, &cancel);
    let mut seeds = Seeds::default();
    let outcomes = [
        outcome(3.0, 1.0),
        Err(TrainError::NoStableModel { candidates: 9 }),
        outcome(-1.0, f64::NAN),
        outcome(-f64::NAN, 1.0),
        outcome(2.0, 1.0),
    ];
    for (seed, outcome) in outcomes.into_iter().enumerate() {
        (seeds.add(seed as u64, outcome, &mut monitor)).expect("a fault of one seed");
    }
    let scores: Vec<f64> = (seeds.finished.iter())
        .map(|(report, _)| report.score)
        .collect();
    assert_eq!(scores, [3.0, f64::INFINITY, 2.0]);
    let failure = seeds.failure.as_ref();
    assert!(matches!(
        failure,
        Some(TrainError::NoStableModel { candidates: 9 })
    ));
    let fault = seeds.add(5, Err(TrainError::Cancelled), &mut monitor);
    assert!(matches!(fault, Err(TrainError::Cancelled)));
}

#[test]
fn exchanged_coordinates_overlap_fully_and_other_terms_do_not() {
    let standard = StandardLibrary {
        degree: 2,
        trigonometric: false,
        inputs: true,
    };
    let library = Library::of(2, LibraryChoice::Standard(standard)).expect("small library");
    let with = |active: [(&str, usize); 3]| {
        let row = |text| library.terms().iter().position(|term| term.text == text);
        let mut xi = DMatrix::zeros(library.terms().len(), 2);
        for (text, column) in active {
            xi[(row(text).expect(text), column)] = 1.0;
        }
        [xi]
    };
    let straight = DMatrix::from_row_slice(2, 3, &[1.0, 0.1, 0.0, 0.0, 1.0, 0.0]);
    let exchanged = DMatrix::from_row_slice(2, 3, &[0.0, -1.0, 0.0, 1.0, 0.2, 0.0]);
    let first = with([("z1", 0), ("u2", 1), ("dz1^2", 1)]);
    let same = with([("z2", 1), ("u1", 0), ("dz2^2", 0)]);
    let half = with([("z1", 0), ("u2", 0), ("dz1^2", 1)]);
    let overlap = |runs: &[Run<'_>]| support_overlap(&library, runs, &DMatrix::identity(3, 3));
    let first: Run<'_> = (&straight, &first);
    assert_eq!(overlap(&[first, (&exchanged, &same)]), Some(1.0));
    assert_eq!(overlap(&[first, (&straight, &half)]), Some(0.5));
    assert_eq!(overlap(&[first]), None);
}
