//! Of `src/data/identify/windows.rs`.

use super::*;

fn windows(blocks: &[usize]) -> Windows {
    let mut windows = Windows::default();
    for (segment, count) in blocks.iter().enumerate() {
        for _ in 0..*count {
            windows.rows.push(Row {
                coefficients: [0.0; PARAMETER_DIM],
                left: 0.0,
                group: Group::Contact(0),
                block: windows.blocks.len(),
                moving: true,
            });
            windows.blocks.push(segment);
        }
    }
    windows.segments = blocks.len();
    windows
}

#[test]
fn jumps_of_which_one_has_more_than_a_third_of_the_equations_are_not_left_out() {
    let mut uneven = windows(&[3, 2, 1, 1, 1, 1]);
    assert_eq!(uneven.groupings().len(), 2);
    uneven.rows[4].moving = false;
    assert_eq!(uneven.groupings().len(), 1);
}
