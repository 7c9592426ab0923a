//! Recorded jumps: the repository's own, and a hardware jump if it is there.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use romc::recording::check::{Implausible, check, without};
use romc::recording::preprocess::prepare;
use romc::recording::{self, PhaseRule, Recording, Stance};
use romc::robot::{InputRule, Robot};

use crate::outside;

fn go1() -> &'static Robot {
    romc::robot_file::by_name("go1").unwrap()
}

fn own_jumps() -> Vec<PathBuf> {
    jumps_in("go1", 10)
}

/// The recordings of a folder, which holds at least so many.
pub fn jumps_in(name: &str, least: usize) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("examples/recordings")
        .join(name);
    let entries = fs::read_dir(&folder).unwrap();
    let mut out: Vec<PathBuf> = entries
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.to_string_lossy().ends_with(".csv.gz"))
        .collect();
    out.sort();
    assert!(
        out.len() >= least,
        "{} holds {} jumps",
        folder.display(),
        out.len()
    );
    out
}

/// The hardware jump, which is not part of the repository.
fn hardware_jump() -> Option<Recording> {
    outside::hardware_jump().map(|path| recording::read(&path).unwrap())
}

#[test]
fn own_jumps_are_one_segment_of_launch_flight_and_landing() {
    for path in own_jumps() {
        let jump = recording::read(&path).unwrap();
        assert_eq!(jump.segments.len(), 1, "{}", path.display());
        assert!(jump.ignored_columns.is_empty());
        let segment = &jump.segments[0];
        assert!((segment.mean_step_s() - 0.002).abs() < 1e-9);
        let spans = PhaseRule::two_phase()
            .with_min_samples(5)
            .spans(segment)
            .unwrap();
        let kinds: Vec<Stance> = spans.iter().map(|span| span.kind).collect();
        let expected = [Stance::Launch, Stance::Flight, Stance::Landing];
        assert_eq!(kinds, expected, "{}", path.display());
        let flight = segment.slice(spans[1].range.clone());
        assert!((0.15..0.40).contains(&flight.duration_s()));
    }
}

#[test]
fn own_jumps_carry_their_weight_while_standing() {
    for path in own_jumps() {
        let jump = recording::read(&path).unwrap();
        let u = jump.segments[0]
            .input(&InputRule::published(go1()))
            .unwrap();
        let weight = 9.81 * go1().mass_kg();
        let lift = u[(14, 0)];
        // The torques carry the body and the thighs, not the feet.
        assert!(
            (0.93..1.02).contains(&(lift / weight)),
            "{}: {lift:.1} N of {weight:.1} N",
            path.display()
        );
        assert!(u[(13, 0)].abs() < 0.05 * weight);
    }
}

#[test]
fn own_jumps_are_plausible_also_with_sensor_noise() {
    let noisy = jumps_in("go1-noisy", 4);
    for path in own_jumps().into_iter().chain(noisy) {
        require_plausible(&path, go1());
    }
}

fn require_plausible(path: &Path, robot: &Robot) {
    let jump = recording::read(path).unwrap();
    let found = check(&jump, robot);
    let text: Vec<String> = found.iter().map(ToString::to_string).collect();
    assert!(found.is_empty(), "{}: {text:#?}", path.display());
}

#[test]
fn asynchronous_jumps_leave_the_ground_front_feet_first() {
    let go2 = romc::robot_file::by_name("go2").unwrap();
    let rule = PhaseRule::three_phase().with_min_samples(5);
    assert_eq!(rule.names(), ["contact", "rear", "flight"]);
    for path in jumps_in("go2-asynchronous", 4) {
        require_plausible(&path, go2);
        let jump = recording::read(&path).unwrap();
        let segment = &jump.segments[0];
        let spans = rule.spans(segment).unwrap();
        let found: Vec<_> = spans.iter().map(|span| (span.phase, span.kind)).collect();
        let expected = [
            (0, Stance::Launch),
            (1, Stance::Launch),
            (2, Stance::Flight),
        ];
        assert_eq!(found, expected, "{}", path.display());
        let lift =
            segment.input(&InputRule::published(go2)).unwrap()[(14, 0)] / (9.81 * go2.mass_kg());
        assert!((0.92..1.02).contains(&lift), "{}: {lift}", path.display());
    }
}

#[test]
fn own_jumps_are_prepared_in_batches_of_100() {
    for path in own_jumps() {
        let jump = recording::read(&path).unwrap();
        let phases = prepare(&jump, &PhaseRule::two_phase().with_min_samples(5)).unwrap();
        assert_eq!(phases.len(), 3);
        for (span, samples) in &phases {
            assert_eq!(samples.len(), span.range.len().div_ceil(100) * 100);
            let ends = |z: f64, at: usize| (z - jump.segments[0].x[(14, at)]).abs();
            assert!(ends(samples.x[(14, 0)], span.range.start) < 1e-12);
            let last = samples.len() - 1;
            assert!(ends(samples.x[(14, last)], span.range.end - 1) < 1e-12);
        }
    }
}

#[test]
fn hardware_jump_is_read_and_divided() {
    let Some(jump) = hardware_jump() else { return };
    let segment = &jump.segments[0];
    assert_eq!((jump.segments.len(), segment.len()), (1, 800));
    let spans = PhaseRule::two_phase().spans(segment).unwrap();
    let ranges: Vec<_> = spans.iter().map(|span| span.range.clone()).collect();
    assert_eq!(ranges, [0..256, 256..378, 378..800]);
    let input = segment.input(&InputRule::published(go1())).unwrap();
    assert_eq!(input.shape(), (18, 800));
    assert_eq!(input.rows(0, 12), segment.torque_nm);
    assert!(input.iter().all(|value| value.is_finite()));
}

#[test]
fn hardware_jump_recorded_accelerations_are_differences() {
    let Some(jump) = hardware_jump() else { return };
    let segment = &jump.segments[0];
    let derived = recording::preprocess::differences(&segment.time_s, &segment.dx);
    assert!((&derived - &segment.ddx).amax() < 1e-9);
}

#[test]
fn hardware_jump_clipped_rate_and_lost_packets_are_found() {
    let Some(jump) = hardware_jump() else { return };
    let found = check(&jump, go1());
    let clipped: Vec<_> = found
        .iter()
        .filter(|finding| finding.kind == Implausible::Clipped)
        .collect();
    assert_eq!(clipped.len(), 1);
    assert_eq!(clipped[0].column, "Body angular Velocity y");
    assert_eq!((clipped[0].first_row, clipped[0].samples.len()), (395, 19));
    let jumped = |f: &&_| {
        matches!(
            f,
            &&recording::check::Finding {
                kind: Implausible::Jump,
                ..
            }
        )
    };
    assert!(found.iter().filter(jumped).count() >= 3);
    assert!(
        found
            .iter()
            .all(|finding| finding.kind != Implausible::Torque)
    );
    let (rest, dropped) = without(&jump, &found).unwrap();
    assert!(dropped > 0 && rest.segments.len() > 1);
}

#[test]
fn reading_a_jump_takes_far_less_than_a_control_second() {
    let path = &own_jumps()[0];
    let best = (0..20)
        .map(|_| {
            let start = Instant::now();
            recording::read(path).unwrap();
            start.elapsed()
        })
        .min()
        .unwrap();
    // Unoptimised builds are several times slower.
    let most = if cfg!(debug_assertions) { 400 } else { 20 };
    assert!(best < Duration::from_millis(most), "{best:?}");
}
