//! Of `src/learn/train/growth.rs`.

use super::*;

#[test]
fn where_nothing_may_change_what_depends_on_the_state_is_scaled_down() {
    // Terms 1, z, dz, u of one coordinate; the rows of `slopes` are their derivatives by z and dz.
    let slopes = DMatrix::from_row_slice(4, 2, &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
    let mut growth = Growth {
        bound_per_s: 1.0,
        slopes: vec![slopes],
        sequence: vec![(0, 0.2)],
    };
    let driven = vec![DMatrix::from_column_slice(4, 1, &[0.5, -2.0, 50.0, 3.0])];
    let mut xi = driven.clone();
    assert!(!growth.admits(&xi));
    growth.hold(&mut xi, |all| all.iter().map(|g| g * 0.0).collect());
    assert!(growth.admits(&xi));
    assert_eq!((xi[0][0], xi[0][3]), (0.5, 3.0)); // the constant and the input
    growth.bound_per_s = f64::INFINITY;
    xi.clone_from(&driven);
    growth.hold(&mut xi, |all| all.to_vec());
    assert!(growth.admits(&xi) && xi == driven);
}
