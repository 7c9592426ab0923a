//! Evaluation of the shipped models on our own recordings against figures computed another way.

use std::path::Path;

use nalgebra::DVector;
use romc::evaluate::{Assessment, CoordinateSums, Horizon, PointwiseSums};
use romc::lower::CompiledModel;
use romc::model::JumpPart;
use romc::sim::{LatentSegment, Restart, rollout};
use romc::{artifact, recording};

const MODEL: &str = "models/go1-d4.json";
const JUMP: &str = "examples/recordings/go1/test_02.csv.gz";

#[test]
fn latent_segment_agrees_with_the_definition_at_every_sample() {
    let model = artifact::read(Path::new(MODEL)).expect("shipped");
    let segment = &recording::read(Path::new(JUMP)).expect("shipped").segments[0];
    let latent = LatentSegment::encode(&model, segment).expect("encodes");
    let encoder = model.encoder().expect("linear");
    let (s_x, s_u) = (
        model.state_factors().expect("scaled"),
        model.input_factors().expect("scaled"),
    );
    let input = segment
        .input(&model.input_rule().expect("a robot"))
        .expect("regular legs");
    for sample in (0..segment.len()).step_by(37) {
        let column = |m: &nalgebra::DMatrix<f64>| -> DVector<f64> { m.column(sample).into_owned() };
        let z = encoder.weights() * column(&segment.x).component_mul(&s_x) + encoder.bias();
        assert!((&z - latent.z.column(sample)).amax() < 1e-12);
        let ddz = encoder.weights() * column(&segment.ddx).component_mul(&s_x);
        assert!((&ddz - latent.ddz.column(sample)).amax() < 1e-10);
        // u_lat is the least-squares solution of W_e^T u_lat = u: the residual is orthogonal to W_e
        let u = column(&input).component_mul(&s_u);
        let residual = &u
            - encoder
                .weights()
                .tr_mul(&latent.u_lat.column(sample).into_owned());
        assert!((encoder.weights() * residual).amax() < 1e-9 * (1.0 + u.amax()));
        let in_contact = segment.feet[sample].contains(&true);
        assert_eq!(
            model.phases()[latent.phase[sample]].name == "contact",
            in_contact
        );
    }
}

#[test]
fn restarting_at_every_sample_leaves_only_the_decoders_error() {
    let model = artifact::read(Path::new(MODEL)).expect("shipped");
    let segment = &recording::read(Path::new(JUMP)).expect("shipped").segments[0];
    let latent = LatentSegment::encode(&model, segment).expect("encodes");
    let compiled = CompiledModel::new(&model).expect("lowers");
    let restarted = rollout(&compiled, &latent, Restart::Every(0.002));
    let mut sums = CoordinateSums::new(&model).expect("a decoder");
    sums.add_rollout(&model, segment, &latent, &restarted)
        .expect("decodes");
    let mut pointwise = PointwiseSums::new(&model);
    pointwise.add(&model, segment, &latent).expect("evaluates");

    let scaled: f64 = (sums
        .fits()
        .iter()
        .zip(&model.state_factors().expect("scaled")))
    .map(|(fit, factor)| (fit.expect("samples").rms * factor).powi(2))
    .sum();
    let decoder = pointwise.decoder.fit().expect("samples").rms.powi(2);
    assert!(
        (scaled / 18.0 - decoder).abs() < 1e-12,
        "{scaled} {decoder}"
    );
    assert_eq!(sums.diverged, 0);
    assert_eq!(sums.windows, segment.len());
}

#[test]
fn whole_rollouts_of_shipped_models_stay_finite_on_every_test_jump() {
    for name in ["models/go1-d4.json", "models/go1-d6.json"] {
        let model = artifact::read(Path::new(name)).expect("shipped");
        let compiled = CompiledModel::new(&model).expect("lowers");
        for jump in 1..=3 {
            let path = format!("examples/recordings/go1/test_{jump:02}.csv.gz");
            for segment in &recording::read(Path::new(&path)).expect("shipped").segments {
                let latent = LatentSegment::encode(&model, segment).expect("encodes");
                let whole = rollout(&compiled, &latent, Restart::Never);
                assert_eq!(whole.diverged_at_s(), None, "{name} on {path}");
                assert_eq!(whole.windows[0].z.ncols(), segment.len());
            }
        }
    }
}

/// Errors of the robots that need no model, over 0.2 s and at the touchdown, computed here from the recording alone; and a
/// model without gravity in flight, whose error at the touchdown is that of its fall.
#[test]
fn horizons_are_those_of_the_recording() {
    let model = artifact::read(Path::new(MODEL)).expect("shipped");
    let recordings = [recording::read(Path::new(JUMP)).expect("shipped")];
    let segment = &recordings[0].segments[0];
    let horizons = |model| {
        let assessment = Assessment::over(model, &recordings, 0.1).expect("of its robot");
        Horizon::all(model, &assessment).expect("the same")
    };
    let own = horizons(&model);
    let names: Vec<&str> = own.iter().map(|of| &of.name[..]).collect();
    assert_eq!(names, ["0.1 s", "0.2 s", "0.3 s", "take-off to touchdown"]);
    assert_eq!(
        own[0]
            .predictors
            .iter()
            .map(|(name, _)| *name)
            .collect::<Vec<_>>(),
        [
            "model",
            "constant velocity",
            "at rest",
            "mean training jump",
            "rigid body"
        ]
    );
    let rms = |horizon: usize, predictor: usize, coordinate: usize| {
        let fits = own[horizon].predictors[predictor].1.fits();
        fits[coordinate].expect("samples").rms
    };
    let [mut constant, mut rest] = [0.0; 2];
    for sample in 0..segment.len() {
        let start = sample - sample % 100; // 0.2 s at 500 Hz
        let (from, to) = (segment.x.column(start), segment.x.column(sample));
        let moved = to[14] - from[14];
        let elapsed_s = segment.time_s[sample] - segment.time_s[start];
        rest += moved * moved;
        constant += (moved - elapsed_s * segment.dx[(14, start)]).powi(2);
    }
    let count = segment.len() as f64;
    assert!((rms(1, 1, 14) - (constant / count).sqrt()).abs() < 1e-12);
    assert!((rms(1, 2, 14) - (rest / count).sqrt()).abs() < 1e-12);

    let in_air = |sample: &usize| !segment.feet[*sample].contains(&true);
    // Feet that lose the ground for a few samples do not fly.
    let flies = |sample: &usize| (*sample..*sample + 50).all(|later| in_air(&later));
    let take_off = (0..segment.len() - 50).find(flies).expect("a flight");
    let touchdown = (take_off..segment.len())
        .find(|sample| !in_air(sample))
        .expect("a landing");
    let moved_by = |row: usize| segment.x[(row, touchdown)] - segment.x[(row, take_off)];
    assert!((rms(3, 2, 16) - moved_by(16).abs()).abs() < 1e-12);
    // In flight nothing turns a rigid body or pushes it forwards, until the step that ends with the touchdown.
    let elapsed_s = segment.time_s[touchdown] - segment.time_s[take_off];
    for row in [12, 16] {
        assert!((rms(3, 4, row) - rms(3, 1, row)).abs() < 1e-4);
    }
    let drop =
        moved_by(14) - elapsed_s * segment.dx[(14, take_off)] + 0.5 * 9.81 * elapsed_s.powi(2);
    assert!((rms(3, 4, 14) - drop.abs()).abs() < 1e-4);
    // The mean jump is that of the goal in the middle of the training's.
    let prior = model.jump_prior().expect("trained on jumps");
    let features = prior.features(prior.ranges().map(|range| range.mean));
    let at = |part: usize, share: f64| {
        let of = &prior.parts[part];
        let node = share * (of.nodes() - 1) as f64;
        let [left, right] = [node.floor(), node.ceil()].map(|node| {
            let z = JumpPart::at(&of.z, node as usize, &features);
            model.decode(&z).expect("a latent state")[12]
        });
        left + (right - left) * node.fract()
    };
    let flight_s = prior.parts[2].duration(&features);
    let landed = match elapsed_s <= flight_s {
        true => at(2, elapsed_s / flight_s),
        false => at(
            3,
            (elapsed_s - flight_s) / prior.parts[3].duration(&features),
        ),
    };
    let missed = moved_by(12) - (landed - at(2, 0.0));
    assert!((rms(3, 3, 12) - missed.abs()).abs() < 1e-9, "{missed}");
    // The shipped model falls as the robot does; without gravity it misses the ground by its fall.
    assert!(rms(3, 0, 14) < 5e-3, "{}", rms(3, 0, 14));
    let mut file: serde_json::Value =
        serde_json::from_str(&artifact::to_text(&model)).expect("a model file");
    file["phases"][1]["xi"][0][1] = 0.0.into();
    let text = file.to_string();
    let afloat = artifact::read_from_bytes("afloat.json", text.as_bytes()).expect("a model");
    let missed = horizons(&afloat)[3].predictors[0].1.fits()[14]
        .expect("a flight")
        .rms;
    let fall = 0.5 * 9.81 * elapsed_s * elapsed_s;
    assert!((missed - fall).abs() < 0.02 * fall, "{missed} {fall}");
}
