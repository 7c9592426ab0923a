//! Models whose coordinates are those of the whole body in its plane.

use std::path::Path;
use std::sync::LazyLock;

use clap::ValueEnum;
use nalgebra::{DMatrix, DVector};
use romc::artifact;
use romc::evaluate::{Assessment, CoordinateSums, Fit, Horizon};
use romc::lower::CompiledModel;
use romc::model::{LibraryChoice, ReducedModel, StandardLibrary};
use romc::recording::Recording;
use romc::robot::{JOINT_DIM, STATE_DIM};
use romc::sim::{LatentSegment, Restart, rollout};
use romc::train::{RecipePart, TrainOptions};

use super::{jumps, jumps_of, losses_of_the_simulated_go1, train_with};

const PITCH: usize = JOINT_DIM + 4;
pub(super) const FLEXIONS_AND_KNEES: [usize; 8] = [1, 2, 4, 5, 7, 8, 10, 11];

static WHOLE_BODY: LazyLock<ReducedModel> = LazyLock::new(|| {
    let mut options = TrainOptions::new("go1-d7", 7);
    options.actuators = Some(losses_of_the_simulated_go1());
    let trained = train_with(&jumps("train", 14), &jumps("validation", 3), &options);
    trained.expect("trains").model
});

pub(super) fn weights(model: &ReducedModel) -> DMatrix<f64> {
    let encoder = model.encoder_map().expect("trained");
    encoder.as_affine().expect("linear").weights().clone()
}

/// Predictions over 0.1 s, one fit per coordinate.
pub(super) fn fits(model: &ReducedModel, recordings: &[Recording]) -> Vec<Fit> {
    let compiled = CompiledModel::new(model).expect("compiles");
    let mut sums = CoordinateSums::new(model).expect("has a decoder");
    for segment in recordings.iter().flat_map(|recording| &recording.segments) {
        let latent = LatentSegment::encode(model, segment).expect("encodes");
        let predicted = rollout(&compiled, &latent, Restart::Every(0.1));
        sums.add_rollout(model, segment, &latent, &predicted)
            .expect("decodes");
    }
    sums.fits()
        .into_iter()
        .map(|fit| fit.expect("samples"))
        .collect()
}

fn r2(fits: &[Fit], coordinate: usize) -> f64 {
    fits[coordinate].r2.expect("moves")
}

/// The model with a coefficient of its first phase negated.
pub(super) fn negated(model: &ReducedModel, term: &str, latent: usize) -> ReducedModel {
    let mut file: serde_json::Value =
        serde_json::from_str(&artifact::to_text(model)).expect("a model file");
    let terms = model.library().terms();
    let row = terms
        .iter()
        .position(|each| each.text == term)
        .expect("a term");
    let entry = &mut file["phases"][0]["xi"][row][latent];
    let before = entry.as_f64().expect("a number");
    assert_ne!(before, 0.0);
    *entry = (-before).into();
    artifact::read_from_bytes("changed.json", file.to_string().as_bytes()).expect("still a model")
}

#[test]
fn whole_body_predicts_pitch_and_legs_of_other_recorders() {
    let model = &*WHOLE_BODY;
    let other = jumps_of("go1-other", "jump", 8);
    for recordings in [jumps("test", 3), other.clone()] {
        let fits = fits(model, &recordings);
        assert!(r2(&fits, PITCH) > 0.94, "{fits:?}");
        for joint in FLEXIONS_AND_KNEES {
            assert!(r2(&fits, joint) > 0.95, "{joint} {fits:?}");
        }
        assert!(fits[12].rms < 1.2e-3 && fits[14].rms < 1.5e-3, "{fits:?}");
    }
    // Predictions need the moment in the equation of the rotation, and the equations of the legs.
    let against_moment = negated(model, "u3", 2);
    let found = r2(&fits(&against_moment, &other), PITCH);
    assert!(found < 0.8, "{found}");
    let against_legs = negated(model, "dz4", 3);
    let found = r2(&fits(&against_legs, &other), 1);
    assert!(found < 0.9, "{found}");
}

/// The row of the rotation is near that of a rigid-body model of the simulated robot, and feet stand still in jumps not used in
/// training.
#[test]
fn rows_of_the_whole_body_are_those_of_mechanics() {
    let model = &*WHOLE_BODY;
    let weights = weights(model);
    let row = |k: usize| weights.row(k).transpose();
    let turn = row(2);
    // Weights of the mean of a left and a right joint in the angular momentum, by the mass matrix at the mean posture.
    let mechanics = [(1, 0.060), (2, 0.045), (7, 0.116), (8, 0.003)];
    for (joint, expected) in mechanics {
        let found = turn[joint] + turn[joint + 3];
        assert!(
            (found - expected).abs() < 0.03,
            "{joint}: {found} {expected}"
        );
    }
    assert!((turn[PITCH] - 1.0).abs() < 1e-12);
    // With the best arm for these jumps, the foot position is constant in the crouch.
    let feet = [(0, 3), (1, 4), (0, 5), (1, 6)];
    for (body, leg) in feet {
        let (mut resting, mut moving) = (0.0, 0.0);
        for segment in jumps("test", 3)
            .iter()
            .flat_map(|recording| &recording.segments)
        {
            let crouch = (0..segment.len()).take_while(|&sample| segment.feet[sample] == [true; 4]);
            let samples: Vec<DVector<f64>> = crouch
                .map(|sample| segment.x.column(sample).into_owned())
                .collect();
            let values = |of: &DVector<f64>| -> Vec<f64> {
                let all: Vec<f64> = samples.iter().map(|x| of.dot(x)).collect();
                let mean = all.iter().sum::<f64>() / all.len() as f64;
                all.iter().map(|value| value - mean).collect()
            };
            let (place, turned) = (values(&(row(leg) + row(body))), values(&turn));
            let product: f64 = place.iter().zip(&turned).map(|(a, b)| a * b).sum();
            let arm = -product / turned.iter().map(|b| b * b).sum::<f64>();
            let left = place
                .iter()
                .zip(&turned)
                .map(|(a, b)| (a + arm * b).powi(2));
            resting += left.sum::<f64>();
            moving += values(&row(body))
                .iter()
                .map(|value| value * value)
                .sum::<f64>();
        }
        assert!(resting < 0.1 * moving, "{leg}: {resting} {moving}");
    }
}

#[test]
fn equations_of_the_whole_body_obey_what_is_known() {
    let model = &*WHOLE_BODY;
    let texts: Vec<&str> = model
        .library()
        .terms()
        .iter()
        .map(|term| &term.text[..])
        .collect();
    assert_eq!(texts.len(), 1 + 3 * 7, "{texts:?}");
    let term = |name: &str| texts.iter().position(|text| *text == name).expect("a term");
    let [contact, flight] = [0, 1].map(|phase| &model.phases()[phase].xi);
    // Nothing rotates the body in flight; its legs depend on their own inputs.
    assert_eq!(flight.column(2).amax(), 0.0);
    for (index, text) in texts.iter().enumerate() {
        let own = *text == "1" || ["u4", "u5", "u6", "u7"].contains(text);
        for leg in 3..7 {
            assert_eq!(flight[(index, leg)] != 0.0, own, "{text} of z{}", leg + 1);
        }
        // On the ground its rotation depends on velocities, force and moment, not on positions.
        let moves = text.starts_with("dz")
            || text.contains("u1")
            || text.contains("u2")
            || text.contains("u3");
        assert_eq!(contact[(index, 2)] != 0.0, *text == "1" || moves, "{text}");
    }
    assert!(
        contact[(term("u3"), 2)] > 0.0,
        "a moment rotates the body in its direction"
    );
    // A library that is given has no additional terms.
    let mut options = TrainOptions::new("affine", 7);
    options.library = Some(LibraryChoice::Standard(StandardLibrary {
        degree: 1,
        trigonometric: false,
        inputs: true,
    }));
    let affine = train_with(&jumps("train", 4), &jumps("validation", 1), &options).expect("trains");
    assert_eq!(affine.model.library().terms().len(), 1 + 3 * 7);
    let out_of_plane = [JOINT_DIM + 1, JOINT_DIM + 3, STATE_DIM - 1];
    assert_eq!(
        weights(&affine.model).select_columns(&out_of_plane).amax(),
        0.0
    );
}

/// Errors at the touchdown after flights without a restart: pitch and a knee, of the model and of a robot at rest.
fn at_touchdown(model: &ReducedModel) -> [[f64; 2]; 2] {
    let recordings = jumps("test", 3);
    let assessment = Assessment::over(model, &recordings, 0.1).expect("of its robot");
    let horizons = Horizon::all(model, &assessment).expect("the same");
    let predictors = &horizons[3].predictors;
    assert_eq!([predictors[0].0, predictors[2].0], ["model", "at rest"]);
    [PITCH, 5].map(|coordinate| {
        [0, 2].map(|of| predictors[of].1.fits()[coordinate].expect("flights").rms)
    })
}

#[test]
fn legs_and_rotation_hold_from_take_off_to_touchdown() {
    let [pitch, knee] = at_touchdown(&WHOLE_BODY);
    assert!(pitch[0] < 0.015 && pitch[1] > 0.03, "{pitch:?}");
    assert!(knee[0] < 0.06 && knee[1] > 0.15, "{knee:?}");
    // With the legs' equations of flights zeroed they do not.
    let mut phases = WHOLE_BODY.phases().to_vec();
    for leg in 3..7 {
        phases[1].xi.column_mut(leg).fill(0.0);
    }
    let still = WHOLE_BODY.clone().into_builder().phases(phases).build();
    let [_, knee] = at_touchdown(&still.expect("sound"));
    assert!(knee[0] > 0.15, "{knee:?}");
}

#[test]
fn parts_that_are_left_out_are_not_in_the_model() {
    let mut options = TrainOptions::new("without", 7);
    options.regression.refinements = 0;
    let (training, validation) = (jumps("train", 4), jumps("validation", 1));
    let mut zeros = |leave_out: &[RecipePart]| {
        options.regression.leave_out = leave_out.to_vec();
        let trained = train_with(&training, &validation, &options).expect("trains");
        let (of_state, flight) = (weights(&trained.model), &trained.model.phases()[1].xi);
        let abductions = of_state.column(0).amax();
        let of_joints = of_state.view((2, 0), (1, JOINT_DIM)).amax();
        let of_legs = flight.view((1, 3), (2 * 7, 4)).amax(); // on positions and velocities
        [abductions, of_joints, of_legs].map(|largest| largest == 0.0)
    };
    assert_eq!(zeros(&[]), [false, false, true]);
    let parts = [
        RecipePart::MomentumWeights,
        RecipePart::Abductions,
        RecipePart::FlightLegs,
    ];
    assert_eq!(zeros(&parts), [true, true, false]);
}

#[test]
fn every_part_has_a_row_in_the_table_of_its_effect() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let files = [
        "benches/learning/whole_body.py",
        "docs/evaluation/training-choices.md",
    ];
    let texts = files.map(|file| std::fs::read_to_string(root.join(file)).expect("a text"));
    for part in RecipePart::value_variants() {
        let part = part.to_possible_value().expect("none is hidden");
        let flag = format!("--leave-out {}", part.get_name());
        let has_row = |text: &String| text.contains(&flag);
        assert!(texts.iter().all(has_row), "{flag}");
    }
}
