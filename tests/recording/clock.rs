//! Clocks: rebuilt where joints and body agree that they are wrong, and never for one bad coordinate.

use std::path::Path;

use crate::recording::clock::{Timed, elapsed, timed};
use crate::recording::{Segment, read};

fn jump() -> Segment {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/recordings/go1/test_01.csv.gz");
    read(&path).expect("a shipped jump").segments.swap_remove(0)
}

fn spoiled(spoil: impl Fn(&mut Segment)) -> Timed {
    let mut segment = jump();
    spoil(&mut segment);
    timed(&segment).expect("a jump")
}

fn scale(segment: &mut Segment, rows: impl IntoIterator<Item = usize>, factor: f64) {
    for row in rows {
        segment.dx.row_mut(row).scale_mut(factor);
    }
}

#[test]
fn slow_clock_is_rebuilt_also_beside_a_bad_joint() {
    for bad in [false, true] {
        let timed = spoiled(|segment| {
            segment.time_s.iter_mut().for_each(|time| *time /= 1.2);
            if bad {
                scale(segment, [2], 57.3);
            }
        });
        let ratio = timed.mended.elapsed_ratio.expect("rebuilt");
        assert!((ratio - 1.2).abs() < 0.02, "{ratio}");
    }
}

#[test]
fn one_bad_coordinate_or_kind_of_coordinates_changes_no_clock() {
    let is_rebuilt = |timed: Timed| timed.mended.elapsed_ratio.is_some();
    assert!((elapsed(&jump()).1 - 1.0).abs() < 0.02);
    assert!(!is_rebuilt(spoiled(|_| {})));
    assert!(!is_rebuilt(spoiled(|segment| scale(segment, [2], 57.3))));
    assert!(!is_rebuilt(spoiled(|segment| scale(segment, [11], -1.0))));
    assert!(!is_rebuilt(spoiled(|segment| segment
        .x
        .row_mut(5)
        .fill(-1.5))));
    assert!(!is_rebuilt(spoiled(|segment| scale(segment, 0..12, 1.4))));
    assert!(!is_rebuilt(spoiled(|segment| scale(segment, 12..15, 1.6))));
}
