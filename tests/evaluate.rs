//! Evaluation of the shipped models on our own recordings against figures computed another way.

use std::path::Path;

use nalgebra::DVector;
use romc::evaluate::{CoordinateSums, PointwiseSums};
use romc::lower::CompiledModel;
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
