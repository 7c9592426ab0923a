//! Of `src/learn/train/knowledge.rs`.

use super::*;
use crate::model::{Library, LibraryChoice, StandardLibrary};
use crate::train::features::FeatureValues;
use crate::train::random::Random;

const D: usize = 7;

fn features() -> Features {
    let affine = StandardLibrary {
        degree: 1,
        trigonometric: false,
        inputs: true,
    };
    Features::new(&Library::of(D, LibraryChoice::Standard(affine)).expect("a library"))
}

/// With any equations of the momentum, feet follow the prior: a damped spring upwards, damping only forwards.
#[test]
fn feet_of_the_equations_of_a_stance_return_to_rest() {
    let features = features();
    let mut random = Random::new(3);
    for (body, stiffness) in [(0, 0.0), (1, STANDING_STIFFNESS_PER_S2)] {
        let row = LegRow {
            body,
            arm: -0.3,
            rest: 0.04,
        };
        let standing = Standing::of(row, 4, &features).expect("all terms");
        let mut xi = random.matrix(features.library_dim(), D, 1.0);
        xi.set_column(4, &standing.still(&xi));
        let variables = random.matrix(1, 3 * D, 1.0);
        let theta = features.evaluate(&variables, &mut FeatureValues::default());
        let ddz = theta * xi;
        let feet = |at: &dyn Fn(usize) -> f64| at(4) + at(body) + row.arm * at(TURN);
        let place = feet(&|k| variables[(0, k)]) - row.rest;
        let speed = feet(&|k| variables[(0, D + k)]);
        let expected = -STANDING_DAMPING_PER_S * speed - stiffness * place;
        let found = feet(&|k| ddz[(0, k)]);
        assert!((found - expected).abs() < 1e-9, "{found} {expected}");
    }
}

#[test]
fn equations_of_a_stance_need_their_terms() {
    let terms: Vec<String> = ["1", "z5", "dz5", "z2", "dz2", "dz3"]
        .map(str::to_owned)
        .to_vec();
    let row = LegRow {
        body: 1,
        arm: 0.1,
        rest: 0.0,
    };
    let features =
        |terms: &[String]| Features::new(&Library::from_terms(D, terms).expect("a library"));
    assert_eq!(Standing::of(row, 4, &features(&terms)), None);
    let all = [&terms[..], &["z3".to_owned()]].concat();
    assert!(Standing::of(row, 4, &features(&all)).is_some());
    // Forwards the floor is the same everywhere, and no position counts.
    let speeds: Vec<String> = ["dz1", "dz3", "dz5"].map(str::to_owned).to_vec();
    let row = LegRow { body: 0, ..row };
    assert!(Standing::of(row, 4, &features(&speeds)).is_some());
}

#[test]
fn terms_that_a_mirror_contradicts_are_not_free() {
    let terms: Vec<String> = ["1", "z1", "z2", "z1*z2", "z2^2"]
        .map(str::to_owned)
        .to_vec();
    let features = Features::new(&Library::from_terms(2, &terms).expect("a library"));
    let knowledge = Knowledge::nothing(5, 2).with_parity(&features, &[1.0, -1.0]);
    let free = |k: usize| -> Vec<&str> {
        let free = (0..5).filter(|&term| knowledge.free[(term, k)]);
        free.map(|term| &terms[term][..]).collect()
    };
    // Of a square alone it is not known which of its variable's powers it has.
    assert_eq!(free(0), ["1", "z1", "z2^2"]);
    assert_eq!(free(1), ["z2", "z1*z2", "z2^2"]);
}
