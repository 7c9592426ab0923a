//! Walks: one set of equations of the body, legs by phase, phases that are mirror images, growth over a stride.

use super::*;
use romc::evaluate::Horizon;
use romc::model::ReducedModel;
use romc::recording::{PhaseRule, Segment, stride_s};
use romc::robot::{BODY_X, BODY_Z, JOINT_DIM, STATE_DIM};
use romc::train::{BodyEquations, BodyRows};

fn trots(set: &str, count: usize) -> Vec<Recording> {
    jumps_of("go1-trot", set, count)
}

fn walker(latent_dim: usize, count: usize) -> ReducedModel {
    let mut options = TrainOptions::new("walker", latent_dim);
    options.phases = PhaseRule::trot().with_min_samples(options.phases.min_samples);
    options.set_body(BodyRows::all());
    options.regression.body_equations = BodyEquations::AllPhases;
    options.actuators = artifact::read(Path::new("models/go1-trot-d6.json"))
        .expect("shipped")
        .input_rule()
        .expect("a robot")
        .actuators()
        .cloned();
    let trained = train_with(&trots("train", count), &trots("validation", 3), &options);
    trained.expect("trains").model
}

/// Errors after 0.1 s, restarted, of body coordinates (m, rad): the model's, and those of a constant velocity.
fn errors(model: &ReducedModel, recordings: &[Recording]) -> Vec<[f64; 2]> {
    let assessment = Assessment::over(model, recordings, 0.1).expect("a robot");
    let horizons = Horizon::all(model, &assessment).expect("simulates");
    let of = |name: &str| {
        let predictor = horizons[0]
            .predictors
            .iter()
            .find(|(known, _)| *known == name);
        predictor.expect("a predictor").1.fits()
    };
    let [own, constant] = ["model", "constant velocity"].map(of);
    let rows = JOINT_DIM..18;
    rows.map(|row| [&own, &constant].map(|fits| fits[row].expect("moves").rms))
        .collect()
}

#[test]
fn trots_are_predicted_and_no_longer_when_an_equation_is_negated() {
    let model = walker(12, 12);
    let test = trots("test", 3);
    let found = errors(&model, &test);
    let most = [1.0e-3, 0.5e-3, 1.3e-3, 9e-3, 6e-3, 4e-3];
    for ((own, most), coordinate) in found.iter().zip(most).zip(0..) {
        assert!(
            own[0] < most && own[0] < 0.6 * own[1],
            "{coordinate}: {found:?}"
        );
    }
    let mut builder = model.clone().into_builder();
    let mut phases = model.phases().to_vec();
    phases
        .iter_mut()
        .for_each(|phase| phase.xi.column_mut(1).neg_mut());
    builder = builder.phases(phases);
    let broken = errors(&builder.build().expect("sound"), &test);
    assert!(
        broken[BODY_Z - BODY_X][0] > 5.0 * found[BODY_Z - BODY_X][0],
        "{broken:?}"
    );
}

/// The centre of mass and the rotation about it, after 0.1 s and over a stride; they depend on the equations, and the
/// legs' decoder does not matter.
#[test]
fn centre_of_mass_of_unseen_trots_is_predicted() {
    let model = artifact::read(Path::new("models/go1-trot-d12.json")).expect("shipped");
    let test = trots("test", 3);
    let centre = |model: &ReducedModel, predictor: usize| -> [Vec<f64>; 2] {
        let assessment = Assessment::over(model, &test, 0.1).expect("a robot");
        let horizons = Horizon::all(model, &assessment).expect("simulates");
        assert_eq!(horizons[0].mass_centre.len(), 6);
        [0, 3].map(|horizon| {
            let fits = horizons[horizon].predictors[predictor].1.fits();
            let fits = fits[STATE_DIM..].iter();
            fits.map(|fit| fit.expect("moves").rms).collect()
        })
    };
    let [soon, stride] = centre(&model, 0);
    let [coasting, _] = centre(&model, 1);
    let most = [0.7e-3, 0.3e-3, 0.8e-3, 5e-3, 4e-3, 3e-3];
    for (k, most) in most.into_iter().enumerate() {
        assert!(soon[k] < most && soon[k] < coasting[k], "{k}: {soon:?}");
    }
    for (k, most) in [3.5e-3, 2e-3, 3.5e-3].into_iter().enumerate() {
        assert!(stride[k] < most, "{k}: {stride:?}");
    }
    let mut phases = model.phases().to_vec();
    for phase in &mut phases {
        phase.xi.columns_range_mut(0..6).fill(0.0);
    }
    let broken = model.into_builder().phases(phases).build();
    let [without, _] = centre(&broken.expect("sound"), 0);
    for k in 0..6 {
        // Without equations the velocity stays, as for the baseline.
        assert!(
            (without[k] / coasting[k] - 1.0).abs() < 1e-3,
            "{k}: {without:?}"
        );
    }
}

#[test]
fn rows_of_the_body_are_named() {
    let model = artifact::read(Path::new("models/go1-trot-d6.json")).expect("shipped");
    let words = model.latent_words();
    let quantities: Vec<&str> = words.iter().map(|of| &of.quantity[..]).collect();
    assert_eq!(quantities[0], "centre of mass forwards");
    assert_eq!(quantities[3], "centre of mass to the left");
    assert_eq!(words[3].unit, "in 10 m");
    assert!(
        quantities.iter().all(|of| !of.contains("together")),
        "{quantities:?}"
    );
}

/// Leg pairs are each other's image: so are the equations of their phases, to the last bit. The body has one set.
#[test]
fn phases_that_are_mirror_images_have_mirrored_equations() {
    let model = walker(12, 6);
    let [first, second] = [0, 1].map(|phase| &model.phases()[phase].xi);
    assert_eq!(first.columns(0, 6), second.columns(0, 6));
    assert_ne!(first, second);
    assert_eq!(first.abs(), second.abs());
    let changed = first.iter().zip(second).filter(|(a, b)| a != b).count();
    assert!(changed > 20, "{changed}");
}

#[test]
fn strides_are_those_of_trots_alone() {
    let with = |recordings: &[Recording]| {
        let mut options = TrainOptions::new("strides", 6);
        options.set_body(BodyRows::all());
        let trained = train_with(recordings, &[], &options).expect("trains");
        trained.model.stride_prior().is_ok()
    };
    assert!(with(&trots("train", 12)));
    assert!(!with(&jumps_of("go1-gaits", "pronk", 3)));
    assert!(!with(&jumps("train", 6)));
}

/// Jumps with one set of equations keep the rows of their feet.
#[test]
fn rows_of_feet_are_those_of_jumps() {
    let mut options = TrainOptions::new("feet", 7);
    options.regression.body_equations = BodyEquations::AllPhases;
    let trained = train_with(&jumps("train", 6), &jumps("validation", 1), &options);
    let words = trained.expect("trains").model.latent_words();
    let feet = words
        .iter()
        .filter(|of| of.quantity.contains("feet"))
        .count();
    assert_eq!(feet, 4, "{words:?}");
}

#[test]
fn motions_that_turn_are_cut_into_pieces_along_their_heading() {
    let recordings = trots("train", 12);
    let yaw = |segment: &Segment| segment.x.row(17).into_owned();
    let turning = recordings.iter().map(|recording| &recording.segments[0]);
    let turning: Vec<_> = turning.filter(|of| yaw(of).amax() > 0.5).collect();
    assert!(turning.len() >= 3);
    for segment in turning {
        let pieces = segment.by_heading();
        assert!(pieces.len() > 1);
        assert_eq!(
            pieces.iter().map(|piece| piece.len()).sum::<usize>(),
            segment.len()
        );
        let mut sample = 0;
        for piece in &pieces {
            let own = yaw(piece);
            assert!(own[0] == 0.0 && own.amax() < 0.4, "{own}");
            // Speeds and heights are those of the motion.
            let speed = |of: &Segment, k: usize| of.dx[(BODY_X, k)].hypot(of.dx[(BODY_X + 1, k)]);
            assert!((speed(piece, 5) - speed(segment, sample + 5)).abs() < 1e-12);
            assert_eq!(piece.x[(BODY_Z, 5)], segment.x[(BODY_Z, sample + 5)]);
            sample += piece.len();
        }
    }
    let jump = &jumps("train", 1)[0].segments[0];
    assert_eq!(jump.by_heading()[0].as_ref(), jump);
}

#[test]
fn stride_is_that_of_the_gait_and_deviations_grow_over_it() {
    let motions = trots("test", 3);
    let segments = || motions.iter().flat_map(|recording| &recording.segments);
    let stride = stride_s(segments()).expect("a walk");
    assert!((0.3..0.46).contains(&stride), "{stride}"); // 2.2 to 3.2 Hz
    assert_eq!(
        stride_s(jumps("train", 3).iter().flat_map(|of| &of.segments)),
        None
    );
    let model = artifact::read(Path::new("models/go1-trot-d12.json")).expect("shipped");
    let of = |recordings: &[Recording]| {
        let assessment = Assessment::over(&model, recordings, 0.1).expect("a robot");
        assessment.stride
    };
    let growth = of(&motions).expect("strides");
    let total: f64 = growth.phases.iter().map(|(_, time_s)| time_s).sum();
    assert!((0.7..1.3).contains(&(total / stride)), "{growth:?}");
    let factor = growth.largest_multiplier.expect("finite");
    assert!((1.0..4.0).contains(&factor), "{growth:?}");
}
