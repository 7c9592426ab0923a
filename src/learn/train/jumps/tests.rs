//! Landmarks, prior and deviations of the shipped recordings.

use nalgebra::DMatrix;

use super::*;
use crate::model::{AffineMap, FEATURE_DIM};
use crate::robot::STATE_DIM;
use crate::train::oscillator::go1;

fn training() -> Dataset {
    go1((1..=8).map(|k| format!("train_{k:02}")))
}

fn learned(training: &Dataset) -> (Option<JumpPrior>, Vec<PartScore>) {
    let latent = Latent::of(training, &encoder());
    learn_jumps(EncodedSet::new(training, &latent), &encoder())
}

fn prior_of(training: &Dataset) -> JumpPrior {
    learned(training).0.expect("jumps of one kind")
}

/// An encoder of the body's x and z and the front right thigh and knee.
fn encoder() -> StateMap {
    let rows = [BODY_X, BODY_Z, 1, 2];
    let weights = DMatrix::from_fn(4, STATE_DIM, |i, j| f64::from(rows[i] == j));
    AffineMap::new("encoder", weights, DVector::zeros(4))
        .unwrap()
        .into()
}

#[test]
fn jumps_are_cut_into_crouch_thrust_flight_and_landing() {
    let prior = prior_of(&training());
    let landmarks = &prior.landmarks.parts;
    let names: Vec<&str> = landmarks.iter().map(|part| part.name.as_str()).collect();
    assert_eq!(names, ["crouch", "thrust", "flight", "landing"]);
    assert_eq!(landmarks[2].feet, [false; 4]);
    assert_eq!(prior.landmarks.jumps.len(), 8);
    for (part, landmark) in prior.parts.iter().zip(landmarks) {
        let [least, most] = landmark.duration_range_s;
        assert!(least <= part.duration_s[0] && part.duration_s[0] <= most);
    }
    // Where the flight begins the body rises, where it ends it falls.
    let flight = &prior.parts[2];
    let rate = |node: usize| JumpPart::at(&flight.dz, node, &[1.0, 0.0, 0.0, 0.0])[1];
    assert!(rate(0) > 0.05 && rate(flight.nodes() - 1) < -0.05);
}

#[test]
fn prior_at_the_goal_of_a_jump_is_nearer_to_it_than_the_mean_jump() {
    let training = training();
    let prior = prior_of(&training);
    let latent = Latent::of(&training, &encoder());
    let last = prior.parts.last().unwrap();
    let error = |features: &dyn Fn(usize) -> [f64; FEATURE_DIM]| -> f64 {
        let ends = (0..8).map(|jump| {
            let z = &latent[jump].z;
            let end = JumpPart::at(&last.z, last.nodes() - 1, &features(jump));
            (end[0] - z[(0, z.ncols() - 1)]).powi(2)
        });
        ends.sum()
    };
    let at_goal = error(&|jump| prior.features(prior.landmarks.jumps[jump]));
    let at_mean = error(&|_| [1.0, 0.0, 0.0, 0.0]);
    assert!(at_goal < 0.2 * at_mean, "{at_goal} {at_mean}");
}

#[test]
fn score_of_deviations_falls_when_inputs_belong_to_other_jumps() {
    let score = |training: &Dataset| -> f64 {
        let (_, scores) = learned(training);
        let thrust = scores.iter().find(|score| score.part == "thrust");
        thrust.expect("a thrust").ddz_r2
    };
    let mut training = training();
    let right = score(&training);
    let inputs: Vec<DMatrix<f64>> = training.jumps.iter().map(|jump| jump.u.clone()).collect();
    for (k, jump) in training.jumps.iter_mut().enumerate() {
        let other = &inputs[(k + 3) % inputs.len()];
        let last = other.ncols() - 1;
        jump.u = DMatrix::from_fn(STATE_DIM, jump.u.ncols(), |i, sample| {
            other[(i, sample.min(last))]
        });
    }
    let wrong = score(&training);
    assert!(right > 0.3 && wrong < right - 0.1, "{right} {wrong}");
}
