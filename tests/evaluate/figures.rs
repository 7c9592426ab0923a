//! Figures of evaluations against closed forms: fits, torques, templates, linearisations.

use std::path::Path;

use crate::evaluate::{
    Aslip, AslipSums, Assessment, Baseline, ByContact, Comparison, Fit, FitSums, LAMBDA,
    LinearisedPhase, combined_loss, eigenvalues, is_plausible, linearise_phases,
};
use crate::lower::CompiledModel;
use crate::model::{FeetRule, Library, Phase, ReducedModel};
use crate::recording;
use crate::recording::{Recording, Segment};
use crate::robot::{BODY_Z, InputRule, JOINT_DIM, Leg};
use crate::sim::{LatentSegment, Restart};
use nalgebra::{Complex, DMatrix, DVector, Schur};

fn jump(name: &str) -> Recording {
    let path = format!("examples/recordings/{name}.csv.gz");
    recording::read(Path::new(&path)).expect("a shipped recording")
}

fn sums(pairs: &[(f64, f64)]) -> FitSums {
    let mut sums = FitSums::default();
    pairs.iter().for_each(|&(y, p)| sums.add(y, p));
    sums
}

#[test]
fn exact_prediction_is_perfect_the_mean_explains_nothing_and_a_still_record_has_no_r2() {
    let fit = |rms, r2| Some(Fit { rms, r2 });
    let exact: &[(f64, f64)] = &[(1.0, 1.0), (2.0, 2.0), (4.0, 4.0)];
    for (pairs, expected) in [
        (exact, fit(0.0, Some(1.0))),
        (&[(1.0, 2.0), (3.0, 2.0)], fit(1.0, Some(0.0))),
        (&[(2.0, 2.5)], fit(0.5, None)),
        (&[], None),
    ] {
        assert_eq!(sums(pairs).fit(), expected, "{pairs:?}");
    }
}

#[test]
fn merging_two_coordinates_ignores_the_distance_of_their_means() {
    let mut merged = sums(&[(0.0, 0.0), (2.0, 1.0)]);
    merged.merge_keeping_means(&sums(&[(100.0, 100.0), (102.0, 101.0)]));
    let fit = merged.fit().expect("four pairs");
    // residual squares 1 + 1, deviations 2 + 2 about the means 1 and 101
    assert_eq!(fit.r2, Some(0.5));
    assert_eq!(merged.count, 4);
}

#[test]
fn r2_is_one_for_equal_torques_and_zero_for_the_mean() {
    let recorded = [[1.0; JOINT_DIM], [3.0; JOINT_DIM]];
    let mut equal = Comparison::default();
    let mut mean = Comparison::default();
    for torque in &recorded {
        equal.add([true; 4], torque, torque);
        mean.add([false; 4], &[2.0; JOINT_DIM], torque);
    }
    let r2 = |contact, flight| ByContact { contact, flight };
    assert_eq!(equal.r2(), r2(Some(1.0), None));
    assert_eq!(mean.r2(), r2(None, Some(0.0)));
    assert_eq!((mean.r2_all(), mean.rms()), (Some(0.0), Some(1.0)));
}

#[test]
fn torques_beyond_twice_the_limit_are_not_the_robots() {
    let go1 = romc_model::robot_file::by_name("go1").expect("known");
    let mut torque = *go1.torque_limit_nm();
    torque[3] *= 1.9;
    assert!(is_plausible(go1, &torque));
    torque[3] *= 1.1;
    assert!(!is_plausible(go1, &torque));
    torque[3] = f64::NAN;
    assert!(!is_plausible(go1, &torque));
}

/// A body at rest at `height`, legs bent, without torques; `feet` for all samples.
fn at_rest(height: f64, feet: [bool; 4], count: usize) -> Segment {
    let mut segment = Segment::still("rest", (0..count).map(|k| 0.002 * k as f64).collect());
    segment.x.row_mut(BODY_Z).fill(height);
    for joint in 0..JOINT_DIM {
        segment.x.row_mut(joint).fill([0.0, 0.8, -1.6][joint % 3]);
    }
    segment.feet.fill(feet);
    segment
}

fn rms_z(segment: &Segment) -> f64 {
    let robot = romc_model::robot_file::by_name("go1").expect("known");
    let mut sums = AslipSums::default();
    let rollout = Aslip::PUBLISHED
        .rollout(&InputRule::published(robot), segment, Restart::Never)
        .expect("runs");
    sums.add(segment, &rollout);
    sums.z.fit().expect("samples").rms
}

#[test]
fn pendulum_in_flight_falls_freely() {
    let count = 101;
    let expected: f64 = (0..count)
        .map(|k| (0.5 * 9.81 * (0.002 * k as f64).powi(2)).powi(2))
        .sum();
    let expected = (expected / count as f64).sqrt();
    let found = rms_z(&at_rest(1.0, [false; 4], count));
    assert!((found - expected).abs() < 1e-8, "{found} {expected}");
}

#[test]
fn pendulum_in_contact_swings_about_the_springs_equilibrium() {
    // feet hang below the hips at f; the spring's rest is f + l0, its equilibrium g m / k below
    let segment = at_rest(0.3, [true; 4], 201);
    let robot = romc_model::robot_file::by_name("go1").expect("known");
    let foot = 0.3 + robot.foot_from_body(Leg::FrontRight, &[0.0, 0.8, -1.6]).z;
    let Aslip {
        mass_kg,
        stiffness_n_m,
        rest_length_m,
        gravity_m_s2,
    } = Aslip::PUBLISHED;
    let equilibrium = foot + rest_length_m - gravity_m_s2 * mass_kg / stiffness_n_m;
    let rate = (stiffness_n_m / mass_kg).sqrt();
    let residual = |t: f64| (0.3 - equilibrium) * (1.0 - (rate * t).cos());
    let expected: f64 = (0..201).map(|k| residual(0.002 * k as f64).powi(2)).sum();
    let expected = (expected / 201.0).sqrt();
    let found = rms_z(&segment);
    assert!((found - expected).abs() < 1e-7, "{found} {expected}");
}

#[test]
fn fitted_pendulum_explains_short_rollouts_better_than_the_published_one() {
    let recording = jump("go1/test_01");
    let rule = &InputRule::published(romc_model::robot_file::by_name("go1").expect("known"));
    let segments: Vec<&Segment> = recording.segments.iter().collect();
    let mut baselines = Baseline::all(rule, &segments).expect("legs are bent");
    assert_eq!(baselines.len(), 2);
    for baseline in &mut baselines {
        let rollout = baseline.add(rule, segments[0], Restart::Every(0.1));
        rollout.expect("integrates");
    }
    let rms = |b: &Baseline| b.restarted.z.fit().expect("samples").rms;
    assert!(rms(&baselines[1]) < rms(&baselines[0]));
    let fitted = baselines[1].template;
    assert!((8.0..30.0).contains(&fitted.mass_kg), "{fitted:?}");
}

#[test]
fn combined_loss_follows_equation_29() {
    let loss = combined_loss(0.01, 10, LAMBDA).expect("terms");
    assert!((loss - (0.02 + 0.002 * 10f64.ln())).abs() < 1e-15);
    assert_eq!(combined_loss(0.01, 0, LAMBDA), None);
}

#[test]
fn more_latent_coordinates_lose_less_of_the_torques() {
    let jumps = [jump("go1/test_01")];
    let [two, six] = ["go1-d2", "go1-d6"].map(|name| {
        let path = format!("models/{name}.json");
        let model = romc_model::artifact::read(Path::new(&path)).expect("a model");
        let assessment = Assessment::over(&model, &jumps, 0.1).expect("of its robot");
        assessment.lift
    });
    assert!(six.torque.r2().contact > two.torque.r2().contact);
    assert!(six.torque.r2().contact.expect("contact") > 0.9);
    assert!(six.inconsistency().expect("contact") < 1.0);
}

/// The one phase of a model with these terms, linearised at the mean of two samples of all coordinates.
fn linearised(terms: &[(&str, f64)], samples: [f64; 2]) -> Option<LinearisedPhase> {
    let names: Vec<String> = terms.iter().map(|(term, _)| (*term).to_owned()).collect();
    let library = Library::from_terms(1, &names).expect("terms parse");
    let xi = terms.iter().map(|(_, coefficient)| *coefficient);
    let model = ReducedModel::builder("hopper", library)
        .phase(Phase {
            name: "contact".to_owned(),
            feet: FeetRule::Any,
            xi: DMatrix::from_iterator(terms.len(), 1, xi),
        })
        .build()
        .expect("valid");
    let compiled = CompiledModel::new(&model).expect("compiles");
    let row = DMatrix::from_row_slice(1, 2, &samples);
    let segment = LatentSegment {
        time_s: vec![0.0, 0.002],
        z: row.clone(),
        dz: row.clone(),
        ddz: row.clone(),
        u_lat: row,
        phase: vec![0, 0],
    };
    let found = linearise_phases(&compiled, &[&segment]);
    assert_eq!(found.len(), 1);
    found.into_iter().next().flatten()
}

#[test]
fn a_phase_whose_gain_is_not_finite_at_its_mean_has_no_linearisation() {
    let found = linearised(&[("dz1", -2.0), ("log(u1)", 3.0)], [0.0; 2]);
    assert_eq!(found, None);
}

#[test]
fn damped_oscillator_has_its_textbook_eigenvalues_and_gain() {
    let terms = [("z1", -40.0), ("dz1", -2.0), ("u1", 3.0)];
    let phase = linearised(&terms, [0.1, 0.2]).expect("two samples");
    // s^2 + 2 s + 40 = 0
    assert!((phase.growth_rate().expect("one pair") + 1.0).abs() < 1e-12);
    assert!((phase.eigenvalues[0].im - 39f64.sqrt()).abs() < 1e-9);
    assert_eq!(phase.input_singular_values, [3.0]);
    assert_eq!(phase.input_condition(), Some(1.0));
    assert_eq!(phase.input_effective_rank(), 1);
}

/// `A - s I` is all but singular for each `s` that is found, the `s` add up to the trace, and the plain iteration
/// does not always end.
#[test]
fn eigenvalues_of_stiff_and_sparse_dynamics_are_found() {
    let mut random = 1u64;
    let mut next = || {
        random = random
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (random >> 11) as f64 / (1u64 << 53) as f64
    };
    let mut hung = 0;
    for d in 2..=8 {
        for _ in 0..300 {
            let jacobian = DMatrix::from_fn(d, 2 * d, |_, _| match next() < 0.3 {
                true => (next() - 0.7) * 10f64.powf(5.0 * next()),
                false => 0.0,
            });
            let mut matrix = DMatrix::zeros(2 * d, 2 * d);
            matrix.view_mut((0, d), (d, d)).fill_with_identity();
            matrix.rows_mut(d, d).copy_from(&jacobian);
            let plain = Schur::try_new(matrix.clone(), f64::EPSILON, 1000);
            hung += usize::from(plain.is_none());
            let found = eigenvalues(matrix.clone()).expect("finite");
            let sum: Complex<f64> = found.iter().sum();
            let trace = matrix.trace();
            let size = found.iter().map(|value| value.norm()).fold(1.0, f64::max);
            assert!((sum.re - trace).abs() < 1e-9 * size && sum.im.abs() < 1e-9 * size);
            let complex = matrix.map(Complex::from);
            let size = matrix.norm();
            for value in found {
                let shifted = &complex - DMatrix::identity(2 * d, 2 * d) * value;
                let any = DVector::from_fn(2 * d, |i, _| Complex::from(1.0 + (i as f64).sin()));
                let solved = shifted.lu().solve(&any);
                let grown = solved.map_or(f64::MAX, |solved| solved.norm() / any.norm());
                // A pivot near 0 overflows to a number that is none.
                let singular = grown.is_nan() || grown >= 1e6 / size;
                assert!(singular, "{value} of {matrix}");
            }
        }
    }
    assert!(
        hung > 0,
        "the plain iteration finds them all: larger shares are needed no more"
    );
}
