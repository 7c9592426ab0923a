//! Of `src/cli/train.rs`.

use std::path::Path;

use super::*;
use crate::recording;

#[test]
fn whole_jump_note_appears_where_standing_still_is_better() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/recordings/go1");
    // moves by 0.140 m forwards and 0.065 m upwards, root mean squares
    let jumps = [recording::read(&folder.join("test_01.csv.gz")).expect("shipped")];
    let note = |x: Option<f64>, z: f64| {
        let metrics = SetMetrics {
            rollout_x_m: x,
            rollout_z_m: Some(z),
            ..SetMetrics::default()
        };
        whole_jump_note(&metrics, "validation", &jumps)
    };
    assert_eq!(note(Some(0.13), 0.06), None);
    let found = note(Some(0.15), 0.07).expect("a note");
    assert!(
        found.contains("validation jumps are 0.1655 m off"),
        "{found}"
    );
    assert!(note(Some(3.0), 4.0).expect("a note").contains("5.000 m"));
    assert!(note(None, 0.0).expect("a note").contains("diverge"));
}
