//! Of `src/learn/train/mirror.rs`.

use super::*;
use crate::recording::PhasePattern;

const PARITY: [f64; 2] = [1.0, -1.0];

fn mirror(terms: &[&str]) -> Mirror {
    let terms: Vec<String> = terms.iter().map(|term| term.to_string()).collect();
    let features = Features::new(&Library::from_terms(2, &terms).expect("a library"));
    Mirror::of(&PhaseRule::trot(), &features, &PARITY)
}

/// `fr_rl` and `fl_rr` are each other's image, `all` and `flight` their own.
#[test]
fn equations_of_an_image_have_the_signs_of_terms_and_coordinates() {
    let mirror = mirror(&["1", "z1", "z2", "z1*z2"]);
    let own: Vec<bool> = (0..4).map(|phase| mirror.is_own_image(phase)).collect();
    assert_eq!(own, [false, false, true, true]);
    let mut xi = vec![DMatrix::from_element(4, 2, 0.1); 4];
    xi[1].fill(7.0);
    mirror.copy(&mut xi);
    let signs = [1.0, 1.0, -1.0, -1.0];
    assert_eq!(xi[1].column(0), DVector::from_row_slice(&signs) * 0.1);
    assert_eq!(xi[1].column(1), DVector::from_row_slice(&signs) * -0.1);
    assert!(
        [0, 2, 3]
            .iter()
            .all(|phase| xi[*phase].iter().all(|value| *value == 0.1))
    );
}

#[test]
fn terms_without_a_sign_leave_equations_alone_but_phases_have_their_images() {
    let mirror = mirror(&["z1", "sin(z2)"]);
    assert!(mirror.is_own_image(3) && !mirror.is_own_image(0));
    let mut xi = vec![DMatrix::from_element(2, 2, 0.1); 4];
    xi[1].fill(7.0);
    let before = xi.clone();
    mirror.copy(&mut xi);
    assert_eq!(xi, before);
}

/// The image of right feet alone is part of the other phase, whose images are of both.
#[test]
fn phases_whose_image_is_no_phase_have_none() {
    let patterns = ["right=1010", "any=any"].map(|text| text.parse::<PhasePattern>().expect(text));
    let features = Features::new(&Library::from_terms(2, &["1".to_owned()]).expect("a library"));
    let mirror = Mirror::of(&PhaseRule::new(patterns.to_vec()), &features, &PARITY);
    assert!(!mirror.is_own_image(0) && !mirror.is_own_image(1));
}
