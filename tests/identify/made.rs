//! Recordings simulated with known parameters, which the identification must return.

use std::path::PathBuf;

use nalgebra::{DMatrix, DVector, SVector};

use crate::files::Place;
use crate::identify::equations::Motion;
use crate::identify::equations::{BODY_ROWS, JOINT_ROWS, SampleEquations, joint_unknowns};
use crate::identify::parameters::{
    ARMATURE, CALF, CALF_SECOND, DRY, GRAVITY, INVERSE_MASS, LEG_SIDE, PARAMETER_DIM, THIGH,
    THIGH_SECOND, TRUNK_FORWARD, VISCOUS,
};
use crate::identify::{Identification, IdentifyError, identify};
use crate::recording::clock::{elapsed, timed};
use crate::recording::{Recording, Segment};
use crate::robot::{BODY_Z, ContactFlags, InputRule, JOINT_DIM, Robot, STATE_DIM};

const STEP_S: f64 = 0.002;
const MASS_KG: f64 = 11.0;
const GRAVITY_M_S2: f64 = 9.7;

fn go1() -> &'static Robot {
    crate::robot_file::by_name("go1").unwrap()
}

/// True parameters of the simulated robot, per mass except gravity.
fn truth() -> [f64; PARAMETER_DIM] {
    let mut truth = [0.0; PARAMETER_DIM];
    for (unknown, value) in [
        (INVERSE_MASS, 1.0),
        (VISCOUS, 0.5),
        (VISCOUS + 1, 0.7),
        (VISCOUS + 2, 0.4),
        (DRY, 0.25),
        (DRY + 1, 0.3),
        (DRY + 2, 0.15),
        (ARMATURE, 0.012),
        (ARMATURE + 1, 0.011),
        (ARMATURE + 2, 0.008),
        (TRUNK_FORWARD, 0.1),
        (LEG_SIDE, 0.06),
        (THIGH, 0.07),
        (THIGH_SECOND, 0.011),
        (CALF, 0.03),
        (CALF_SECOND, 0.005),
    ] {
        truth[unknown] = value / MASS_KG;
    }
    truth[GRAVITY] = GRAVITY_M_S2;
    truth
}

fn feet(sample: usize) -> ContactFlags {
    match sample {
        0..280 => [true; 4],
        280..360 => [false, false, true, true],
        360..500 => [false; 4],
        _ => [true; 4],
    }
}

/// A hop that satisfies the equations of the simulated robot; `phase` varies it.
fn hop(phase: f64) -> Segment {
    const N: usize = 700;
    let mut segment = Segment {
        path: PathBuf::from("made.csv"),
        first_row: 2,
        row_stride: 1.0,
        time_s: (0..N).map(|i| STEP_S * i as f64).collect(),
        x: DMatrix::zeros(STATE_DIM, N),
        dx: DMatrix::zeros(STATE_DIM, N),
        ddx: DMatrix::zeros(STATE_DIM, N),
        torque_nm: DMatrix::zeros(JOINT_DIM, N),
        feet: (0..N).map(feet).collect(),
        body_wrench: None,
        is_walk: false,
    };
    for sample in 0..N {
        let t = segment.time_s[sample];
        for row in (0..JOINT_DIM).chain(JOINT_DIM + 3..STATE_DIM) {
            let (middle, reach) = match row {
                0..JOINT_DIM => [(0.0, 0.12), (0.8, 0.3), (-1.5, 0.4)][row % 3],
                _ => (0.0, 0.15),
            };
            let rate = 9.0 + 1.7 * row as f64;
            let angle = rate * t + phase * (1.0 + row as f64);
            segment.x[(row, sample)] = middle + reach * angle.sin();
            segment.dx[(row, sample)] = reach * rate * angle.cos();
        }
    }
    let truth = truth();
    // Directions do not depend on the trunk's position, so in flight they determine its acceleration; on the ground it
    // is free.
    let motion = Motion::of(&segment, go1());
    let equations = SampleEquations::of(&segment, &motion, go1(), GRAVITY_M_S2, 0.0);
    let mut acceleration = DMatrix::zeros(3, N);
    for sample in 0..N {
        for axis in 0..3 {
            let free = (0..PARAMETER_DIM)
                .filter(|i| *i != INVERSE_MASS)
                .map(|i| equations.body[(axis * BODY_ROWS + i, sample)] * truth[i])
                .sum();
            let t = segment.time_s[sample];
            acceleration[(axis, sample)] = match segment.feet[sample].contains(&true) {
                false => free,
                true => 4.0 * (11.0 * t + phase + axis as f64).sin(),
            };
        }
    }
    let body = JOINT_DIM;
    for sample in 1..N {
        for axis in 0..3 {
            let row = body + axis;
            // Central differences return these accelerations.
            segment.dx[(row, sample)] = match sample {
                1 => STEP_S * acceleration[(axis, 0)],
                _ => {
                    segment.dx[(row, sample - 2)] + 2.0 * STEP_S * acceleration[(axis, sample - 1)]
                }
            };
            let mean = (segment.dx[(row, sample)] + segment.dx[(row, sample - 1)]) / 2.0;
            segment.x[(row, sample)] = segment.x[(row, sample - 1)] + STEP_S * mean;
        }
    }
    segment.torque_nm = torques(&segment, &truth);
    segment
}

/// Torques of legs in the air from the joints' equations, of legs on the ground the smallest that give the trunk its
/// acceleration.
fn torques(segment: &Segment, truth: &[f64; PARAMETER_DIM]) -> DMatrix<f64> {
    let motion = Motion::of(segment, go1());
    let equations = SampleEquations::of(segment, &motion, go1(), GRAVITY_M_S2, 0.0);
    let mut torques = DMatrix::zeros(JOINT_DIM, segment.len());
    for sample in 0..segment.len() {
        let feet = segment.feet[sample];
        for joint in (0..JOINT_DIM).filter(|joint| !feet[joint / 3]) {
            let unknowns = joint_unknowns(joint % 3).into_iter().enumerate();
            torques[(joint, sample)] = unknowns
                .map(|(row, i)| equations.joints[(joint * JOINT_ROWS + row, sample)] * truth[i])
                .sum::<f64>()
                * MASS_KG;
        }
        if feet.contains(&true) {
            let map = InputRule::published(go1())
                .wrench_map(&segment.joints(sample), [0.0; 3], feet)
                .unwrap();
            let force_map = motion.attitude[sample] * map.fixed_rows::<3>(0);
            let rest = SVector::<f64, 3>::from_fn(|axis, _| {
                let row = axis * BODY_ROWS;
                let known = (0..PARAMETER_DIM).filter(|i| *i != INVERSE_MASS);
                let known: f64 = known
                    .map(|i| equations.body[(row + i, sample)] * truth[i])
                    .sum();
                (equations.body[(row + PARAMETER_DIM, sample)] - known) * MASS_KG
            });
            let gram = force_map * force_map.transpose();
            let least = force_map.transpose() * gram.try_inverse().unwrap() * rest;
            for joint in (0..JOINT_DIM).filter(|joint| feet[joint / 3]) {
                torques[(joint, sample)] = least[joint];
            }
        }
    }
    torques
}

fn recording(segments: Vec<Segment>) -> Recording {
    Recording {
        path: PathBuf::from("made.csv"),
        segments,
        ignored_columns: Vec::new(),
    }
}

fn close(found: f64, expected: f64, relative: f64, what: &str) {
    assert!(
        (found - expected).abs() <= relative * expected,
        "{what}: {found}, not {expected}"
    );
}

fn has_the_truth(found: &Identification) {
    close(found.gravity_m_s2, GRAVITY_M_S2, 0.002, "gravity");
    close(found.mass_kg, MASS_KG, 0.005, "mass");
    let truth = truth();
    let of = |i: usize| truth[i] * MASS_KG;
    for kind in 0..3 {
        let what = ["hx", "hy", "kn"][kind];
        close(
            found.actuators.viscous[kind],
            of(VISCOUS + kind),
            0.03,
            what,
        );
        close(found.actuators.dry[3 + kind], of(DRY + kind), 0.05, what);
        close(
            found.actuators.armature[9 + kind],
            of(ARMATURE + kind),
            0.1,
            what,
        );
    }
    close(found.legs.thigh_kg_m, of(THIGH), 0.02, "thigh");
    close(found.legs.calf_kg_m, of(CALF), 0.02, "calf");
    assert!(found.r2.x > 0.999 && found.r2.z > 0.999, "{:?}", found.r2);
}

#[test]
fn identify_made_hops_return_the_robot_they_were_made_of() {
    let hops = [
        recording(vec![hop(0.0), hop(0.4)]),
        recording(vec![hop(0.9)]),
    ];
    let found = identify(&hops, go1()).unwrap();
    has_the_truth(&found);
    assert!(found.delay_s.abs() < 2e-4, "{}", found.delay_s);
    assert!(found.samples.contact > 900 && found.samples.flight > 250);
}

#[test]
fn identify_early_torques_are_told_by_their_delay() {
    let mut hops = vec![hop(0.0), hop(0.4), hop(0.9)];
    for hop in &mut hops {
        let late = hop.torque_nm.clone();
        for sample in 0..hop.len() {
            hop.torque_nm
                .set_column(sample, &late.column((sample + 6).min(hop.len() - 1)));
        }
    }
    let found = identify(&[recording(hops)], go1()).unwrap();
    close(found.delay_s, 0.012, 0.03, "delay");
    has_the_truth(&found);
}

#[test]
fn identify_noise_is_inside_three_standard_errors() {
    let mut hops = vec![hop(0.0), hop(0.4), hop(0.9), hop(1.7)];
    let mut seed = 1_u32;
    let mut noise = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(seed >> 8) / f64::from(1_u32 << 23) - 1.0
    };
    for hop in &mut hops {
        hop.torque_nm.apply(|torque| *torque += 0.4 * noise());
        hop.dx
            .rows_mut(JOINT_DIM, 3)
            .apply(|rate| *rate += 0.004 * noise());
    }
    let found = identify(&[recording(hops)], go1()).unwrap();
    let error = &found.standard_error;
    let truth = truth();
    let mut checks = vec![
        (found.gravity_m_s2, GRAVITY_M_S2, error.gravity_m_s2),
        (found.mass_kg, MASS_KG, error.mass_kg),
        (found.delay_s, 0.0, error.delay_s),
    ];
    for kind in 0..3 {
        let of = |i: usize| truth[i + kind] * MASS_KG;
        let errors = error.viscous_nm_s_rad.to_array();
        checks.push((found.actuators.viscous[kind], of(VISCOUS), errors[kind]));
        checks.push((
            found.actuators.dry[kind],
            of(DRY),
            error.dry_nm.to_array()[kind],
        ));
    }
    for (found, expected, error) in &checks {
        let outside = (found - expected).abs() > 3.0 * error;
        assert!(!outside, "{found} ± {error}, not {expected}");
    }
    assert!(
        error.mass_kg < 0.02 * MASS_KG && error.gravity_m_s2 < 0.1,
        "{error:?}"
    );
}

/// The standard error of gravity from hops with different offsets of gravity.
fn gravity_error(hops: &[Segment], offsets: &[f64]) -> f64 {
    let mut hops = hops.to_vec();
    for (hop, offset) in hops.iter_mut().zip(offsets) {
        for sample in 0..hop.len() {
            hop.dx[(BODY_Z, sample)] += offset * hop.time_s[sample];
        }
    }
    let found = identify(&[recording(hops)], go1()).unwrap();
    found.standard_error.gravity_m_s2
}

#[test]
fn identify_errors_that_a_jump_has_in_common_count_once_a_jump() {
    let offsets = [0.1, -0.2, 0.15, -0.05, 0.1, -0.1];
    let hops = vec![hop(0.0); 6];
    // Standard deviation of the mean of independent numbers.
    let mean = offsets.iter().sum::<f64>() / 6.0;
    let squares = offsets.iter().map(|offset| (offset - mean).powi(2));
    let expected = (squares.sum::<f64>() / (6.0 * 5.0)).sqrt();
    let six = gravity_error(&hops, &offsets);
    assert!((0.8..1.6).contains(&(six / expected)), "{six} {expected}");
    // With fewer jumps only blocks are left out.
    let five = gravity_error(&hops[..5], &offsets);
    assert!(five < 0.8 * six, "{five} {six}");
}

#[test]
fn identify_errors_that_jumps_do_not_have_in_common_count_once_a_block() {
    let mut seed = 1_u32;
    let mut noise = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(seed >> 8) / f64::from(1_u32 << 23) - 1.0
    };
    let mut hops = vec![hop(0.0); 6];
    for hop in &mut hops {
        (hop.dx.rows_mut(JOINT_DIM, 3)).apply(|rate| *rate += 0.004 * noise());
    }
    let blocks = gravity_error(&hops[..5], &[0.0; 5]) * (5.0_f64 / 6.0).sqrt();
    let six = gravity_error(&hops, &[0.0; 6]);
    assert!((0.6..2.0).contains(&(six / blocks)), "{six} {blocks}");
}

#[test]
fn identify_torques_of_the_other_sign_are_refused() {
    let mut made = hop(0.0);
    made.torque_nm.neg_mut();
    let error = identify(&[recording(vec![made])], go1()).unwrap_err();
    let IdentifyError::Mass { inverse, robot, .. } = &error else {
        panic!("{error:?}");
    };
    assert!(*inverse < 0.01 && robot == "go1");
}

#[test]
fn identify_flight_alone_or_a_robot_at_rest_is_an_error_with_what_is_missing() {
    let flight = hop(0.0).slice(360..500);
    let error = identify(&[recording(vec![flight])], go1()).unwrap_err();
    assert!(
        matches!(
            error,
            IdentifyError::Contact {
                found: 0,
                expected: 100,
                ..
            }
        ),
        "{error:?}"
    );
    let mut still = hop(0.0).slice(0..280);
    still.dx.fill(0.0);
    let first = still.x.column(0).into_owned();
    still.x = DMatrix::from_fn(STATE_DIM, still.len(), |i, _| first[i]);
    let error = identify(&[recording(vec![still])], go1()).unwrap_err();
    assert!(
        matches!(error, IdentifyError::Still { found: 0, .. }),
        "{error:?}"
    );
}

#[test]
fn identify_without_flight_says_so() {
    let contact = [hop(0.0), hop(0.4), hop(0.9)].map(|hop| hop.slice(0..280));
    let found = identify(&[recording(contact.to_vec())], go1()).unwrap();
    assert_eq!(found.samples.flight, 0);
    assert!(
        found.notes.iter().any(|note| note.starts_with("no flight")),
        "{:?}",
        found.notes
    );
    close(found.mass_kg, MASS_KG, 0.05, "mass");
}

#[test]
fn timed_lost_samples_are_found_and_a_true_clock_stays() {
    let made = hop(0.0);
    let same = timed(&made).unwrap();
    assert!(same.mended.elapsed_ratio.is_none() && same.segment == made);
    assert!((elapsed(&made).1 - 1.0).abs() < 0.01);
    // Every eighth sample is lost, and the logger's count continues.
    let kept: Vec<usize> = (0..made.len()).filter(|sample| sample % 8 != 3).collect();
    let lost = Segment {
        time_s: (0..kept.len()).map(|i| STEP_S * i as f64).collect(),
        x: made.x.select_columns(&kept),
        dx: made.dx.select_columns(&kept),
        ddx: made.ddx.select_columns(&kept),
        torque_nm: made.torque_nm.select_columns(&kept),
        feet: kept.iter().map(|sample| made.feet[*sample]).collect(),
        ..made.clone()
    };
    let mended = timed(&lost).unwrap();
    let ratio = mended.mended.elapsed_ratio.expect("rebuilt");
    close(ratio, 8.0 / 7.0, 0.01, "ratio");
    close(
        mended.segment.duration_s(),
        made.duration_s(),
        0.01,
        "duration",
    );
    let again = mended.segment.dx.column(500);
    let place = (mended.segment.time_s[500] / STEP_S).round() as usize;
    let change: DVector<f64> = (made.dx.column(place) - again).into_owned();
    assert!(change.amax() < 0.3, "{change}");
}

#[test]
fn file_keeps_the_identification_to_six_digits() {
    let found = identify(&[recording(vec![hop(0.0), hop(0.4)])], go1()).unwrap();
    let text = found.to_toml();
    let read = Identification::from_toml("a.toml", &text).unwrap();
    close(read.mass_kg, found.mass_kg, 1e-5, "mass");
    assert_eq!(read.samples, found.samples);
    assert_eq!(read.to_toml(), {
        let mut without_notes = found.clone();
        without_notes.notes.clear();
        without_notes.to_toml()
    });
    for (name, joint) in [("viscous", 1), ("dry", 5), ("armature", 11)] {
        let table: toml::Table = toml::from_str(&text).unwrap();
        let values = table["actuators"][name].as_array().unwrap();
        assert_eq!(values.len(), JOINT_DIM);
        let expected = match name {
            "viscous" => found.actuators.viscous[joint],
            "dry" => found.actuators.dry[joint],
            _ => found.actuators.armature[joint],
        };
        close(values[joint].as_float().unwrap(), expected, 1e-5, name);
    }
}

#[test]
fn file_faults_have_their_place() {
    let found = identify(&[recording(vec![hop(0.0), hop(0.4)])], go1()).unwrap();
    let text = found.to_toml();
    let fault = |text: &str| match Identification::from_toml("a.toml", text).unwrap_err() {
        IdentifyError::File(located) => located,
        other => panic!("{other:?}"),
    };
    let mass = text
        .lines()
        .find(|line| line.starts_with("mass_kg"))
        .unwrap();
    let located = fault(&text.replacen(mass, "mass_kg = -2.0", 1));
    assert_eq!(
        located.to_string(),
        "a.toml: mass_kg: found -2, expected a finite number above 0"
    );
    let line = text
        .lines()
        .position(|line| line.starts_with("dry = "))
        .unwrap();
    let dry = text.lines().nth(line).unwrap();
    let located = fault(&text.replacen(dry, "dry = [1.0, 2.0]", 1));
    assert!(
        matches!(located.place, Place::Character(found, _) if found == line + 1),
        "{located}"
    );
    let located = fault(&text.replacen(dry, &dry.replacen("= [", "= [-", 1), 1));
    assert!(located.to_string().contains("found -"), "{located}");
    assert!(
        located.to_string().contains("actuators.dry, joint fr.hx"),
        "{located}"
    );
}
