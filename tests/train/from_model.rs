//! A trained model refined with other recordings.

use std::path::Path;

use romc::artifact;
use romc::evaluate::{Assessment, Horizon};
use romc::model::ReducedModel;
use romc::recording::Recording;
use romc::train::{Origin, TrainError, refine_from};

use super::whole_body::FLEXIONS_AND_KNEES;
use super::{go1, jumps};

/// The jumps with zero torques in flight, like recordings that omit the torques of a position control moving the legs.
fn without_torques_in_flight(recordings: Vec<Recording>) -> Vec<Recording> {
    let mut recordings = recordings;
    for segment in recordings.iter_mut().flat_map(|of| &mut of.segments) {
        for (sample, feet) in segment.feet.iter().enumerate() {
            if !feet.contains(&true) {
                segment.torque_nm.column_mut(sample).fill(0.0);
            }
        }
    }
    recordings
}

/// Root mean square error of flexions and knees at touchdown, without a restart in flight, of the model and of a
/// constant velocity, rad.
fn legs_at_touchdown(model: &ReducedModel, recordings: &[Recording]) -> [f64; 2] {
    let assessment = Assessment::over(model, recordings, 0.1).expect("of its robot");
    let horizons = Horizon::all(model, &assessment).expect("the same");
    let flights = &horizons.last().expect("flights").predictors;
    [0, 1].map(|of| {
        let fits = flights[of].1.fits();
        let squares = FLEXIONS_AND_KNEES.map(|leg| fits[leg].expect("flights").rms.powi(2));
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    })
}

/// Error of body z over 0.1 s on the test jumps, m.
fn error_m(model: &ReducedModel) -> f64 {
    let recordings = jumps("test", 3);
    let assessment = Assessment::over(model, &recordings, 0.1).expect("of its robot");
    let fit = assessment.fit(&assessment.restarted, "body.z");
    fit.expect("samples").rms
}

/// A robot 15 % heavier than in the model, and gravity in contact 5 % smaller.
#[test]
fn wrong_mass_is_found_again_with_its_standard_errors() {
    let right = artifact::read(Path::new("models/go1-d7.json")).expect("shipped");
    let terms = right.library().terms();
    let term = |text: &str| {
        terms
            .iter()
            .position(|term| term.text == text)
            .expect("a term")
    };
    let (force, one) = (term("u2"), term("1"));
    let mut phases = right.phases().to_vec();
    phases[0].xi[(force, 1)] *= 0.85;
    phases[0].xi[(one, 1)] *= 0.95;
    let wrong = right
        .clone()
        .into_builder()
        .phases(phases)
        .build()
        .expect("sound");
    let training = jumps("train", 5);
    let origin = Origin::default();
    let refined = refine_from(
        &wrong,
        &training,
        go1(),
        wrong.actuators().cloned(),
        &origin,
    );
    let refined = refined.expect("refines");
    let xi = |model: &ReducedModel| model.phases()[0].xi[(force, 1)];
    let [before, after] =
        [&wrong, &refined.model].map(|model| (xi(model) / xi(&right) - 1.0).abs());
    assert!(before > 0.14 && after < 0.05, "{before} {after}");
    let changed = refined.coefficients.iter();
    let mut changed = changed.filter(|of| of.coordinate == 2 && of.term == "u2");
    let changed = changed.next().expect("the force of ddz2");
    assert!(changed.standard_errors > 5.0, "{changed:?}");
    let [wrong_m, refined_m, right_m] = [&wrong, &refined.model, &right].map(error_m);
    assert!(
        wrong_m > 2.5 * right_m && refined_m < 1.1 * right_m,
        "{wrong_m} {refined_m} {right_m}"
    );
    // Free fall is fixed by physics.
    assert_eq!(
        refined.model.phases()[1].xi.column(1),
        right.phases()[1].xi.column(1)
    );
    assert_eq!(refined.model.encoder_map().ok(), right.encoder_map().ok());
}

#[test]
fn recordings_without_information_are_refused_with_the_reasons() {
    let model = artifact::read(Path::new("models/go1-d7.json")).expect("shipped");
    let jump = jumps("train", 1).remove(0);
    // A stance of 0.1 s.
    let short = Recording {
        segments: vec![jump.segments[0].slice(0..51)],
        ..jump
    };
    let origin = Origin::default();
    let error = refine_from(&model, &[short], go1(), model.actuators().cloned(), &origin);
    let Err(TrainError::NothingToRefine { reasons }) = error else {
        panic!("{error:?}");
    };
    assert!(
        reasons.contains("ddz1 in contact: too few samples"),
        "{reasons}"
    );
    assert!(
        reasons.contains("ddz7 in flight: too few samples"),
        "{reasons}"
    );
}

/// If recorded torques are twice the motors' torques, all terms of an equation are halved.
#[test]
fn equation_that_counts_twice_is_multiplied_by_about_half() {
    let right = artifact::read(Path::new("models/go1-d7.json")).expect("shipped");
    let mut phases = right.phases().to_vec();
    let doubled = phases[0].xi.column(2) * 2.0;
    phases[0].xi.set_column(2, &doubled);
    let wrong = right.clone().into_builder().phases(phases).build();
    let wrong = wrong.expect("sound");
    let origin = Origin::default();
    let losses = wrong.actuators().cloned();
    let refined = refine_from(&wrong, &jumps("train", 1), go1(), losses, &origin);
    let refined = refined.expect("refines");
    let shares = &refined.multiplied;
    let share = shares
        .iter()
        .find_map(|of| of.strip_prefix("ddz3 in contact: "));
    let share: f64 = share.expect("multiplied").parse().expect("a number");
    assert!((share - 0.5).abs() < 0.15, "{shares:?}");
    let changed = refined.coefficients.iter().filter(|of| of.coordinate == 3);
    for of in changed.filter(|of| of.phase == "contact") {
        assert!((of.after / of.before - share).abs() < 0.01, "{of:?}");
        assert!(of.standard_errors > 3.0, "{of:?}");
    }
}

/// Legs whose torques in flight are not recorded follow a joint control, which the refinement identifies.
#[test]
fn joint_control_that_torques_do_not_show_is_found_in_flights() {
    let model = artifact::read(Path::new("models/go1-d7.json")).expect("shipped");
    let [training, test] =
        [("train", 4), ("test", 3)].map(|(set, n)| without_torques_in_flight(jumps(set, n)));
    let origin = Origin::default();
    let losses = model.actuators().cloned();
    let refined = refine_from(&model, &training, go1(), losses.clone(), &origin);
    let refined = refined.expect("refines");
    let added = |term: &str| {
        let mut changed = refined.coefficients.iter();
        let own = changed.find(|of| of.phase == "flight" && of.term == term);
        own.map_or(0.0, |of| of.after)
    };
    let rate = -0.5 * added("dz7");
    assert!(rate > 1.0, "{:?}", refined.coefficients);
    for leg in 4..=7 {
        assert_eq!(added(&format!("dz{leg}")), -2.0 * rate);
        let stiffness = added(&format!("z{leg}"));
        assert!((stiffness + rate * rate).abs() < 1e-9 * rate * rate);
    }
    let [before, constant_velocity] = legs_at_touchdown(&model, &test);
    let [after, _] = legs_at_touchdown(&refined.model, &test);
    assert!(
        after < 0.5 * before && after < 0.5 * constant_velocity,
        "{before} {after} {constant_velocity}"
    );
    // Without the identified rate the legs coast.
    let mut phases = refined.model.phases().to_vec();
    for term in model
        .library()
        .terms()
        .iter()
        .zip(0..)
        .filter(|(t, _)| t.text.contains('z'))
    {
        phases[1].xi.row_mut(term.1).fill(0.0);
    }
    let coasting = refined.model.clone().into_builder().phases(phases).build();
    let [coasting, _] = legs_at_touchdown(&coasting.expect("sound"), &test);
    assert!(coasting > 2.0 * after, "{coasting} {after}");
    // If recorded torques move the legs, no control is identified.
    let complete = refine_from(&model, &jumps("train", 4), go1(), losses, &origin);
    let changed = complete.map_or(Vec::new(), |of| of.coefficients);
    assert!(
        !changed
            .iter()
            .any(|of| of.phase == "flight" && of.before == 0.0),
        "{changed:?}"
    );
}
