//! Of `src/simplify/tables.rs`.

use super::*;

#[test]
fn printed_interval_contains_the_interval() {
    assert_eq!(
        interval_words(Interval::new(-0.00012345678, 0.0)),
        "[-1.235e-4, 0]"
    );
    assert_eq!(
        interval_words(Interval::new(1.00009, 1.00009)),
        "[1.000, 1.001]"
    );
}
