use std::f64::consts::PI as PI_FLOAT;

use super::*;

fn interval(lo: f64, hi: f64) -> Interval {
    Interval::new(lo, hi)
}

/// Points of an interval, its ends among them.
fn samples(range: Interval) -> impl Iterator<Item = f64> {
    (0..=400).map(move |i| {
        let share = f64::from(i) / 400.0;
        (range.lo() * (1.0 - share) + range.hi() * share).clamp(range.lo(), range.hi())
    })
}

#[test]
fn exact_operations_are_not_widened() {
    assert_eq!(
        interval(1.0, 2.0) + interval(0.5, 0.25 + 0.5),
        interval(1.5, 2.75)
    );
    assert_eq!(
        interval(-1.0, 2.0) * interval(3.0, 4.0),
        interval(-4.0, 8.0)
    );
    assert_eq!(interval(2.0, 4.0).recip(), interval(0.25, 0.5));
    assert_eq!(interval(4.0, 9.0).sqrt(), interval(2.0, 3.0));
    assert_eq!(interval(-3.0, 2.0).powi(2), interval(0.0, 9.0));
    assert_eq!(interval(-3.0, 2.0).powi(3), interval(-27.0, 8.0));
}

#[test]
fn inexact_operations_are_widened_to_the_outside() {
    let tenth = Interval::point(0.1);
    let sum = tenth + Interval::point(0.2);
    assert!(sum.lo() < sum.hi());
    // 0.1 and 0.2 as stored add to 0.30000000000000001665..., between these floats.
    assert_eq!(sum, interval(0.3, 0.3f64.next_up()));
    let square = tenth * tenth;
    assert!(square.lo() < square.hi() && square.hi() == square.lo().next_up());
    let third = Interval::point(3.0).recip();
    assert!(third.lo() < 1.0 / 3.0 && 1.0 / 3.0 < third.hi());
    assert_eq!(third.hi(), third.lo().next_up().next_up());
}

#[test]
fn overflow_keeps_the_finite_side() {
    let large = Interval::point(1e200);
    assert_eq!(large * large, interval(f64::MAX, f64::INFINITY));
    assert_eq!(-(large * large), interval(f64::NEG_INFINITY, f64::MIN));
    assert_eq!(large.powi(2), interval(f64::MAX, f64::INFINITY));
    let tiny = Interval::point(1e-200) * Interval::point(1e-200);
    assert!(tiny.contains(0.0) && tiny.hi() > 0.0);
    assert_eq!(Interval::point(1e-200).powi(2).lo(), 0.0);
    assert_eq!(
        Interval::point(0.0) * Interval::ENTIRE,
        Interval::point(0.0)
    );
    let infinite = Interval::point(f64::INFINITY);
    assert_eq!(infinite - infinite, Interval::ENTIRE);
    assert_eq!(
        Interval::point(1e308) + Interval::point(1e308),
        interval(f64::MAX, f64::INFINITY)
    );
}

#[test]
fn reciprocal_of_interval_around_zero_is_everything() {
    assert_eq!(interval(-1.0, 2.0).recip(), Interval::ENTIRE);
    assert_eq!(interval(0.0, 2.0).recip(), interval(0.5, f64::INFINITY));
    assert_eq!(
        interval(-2.0, 0.0).recip(),
        interval(f64::NEG_INFINITY, -0.5)
    );
    assert!(Interval::point(0.0).recip().is_empty());
}

#[test]
fn functions_outside_their_domain_give_what_is_defined() {
    assert_eq!(interval(-1.0, 4.0).sqrt(), interval(0.0, 2.0));
    assert!(interval(-2.0, -1.0).sqrt().is_empty());
    assert!(interval(-2.0, 0.0).log().is_empty());
    assert_eq!(interval(-2.0, 1.0).log().lo(), f64::NEG_INFINITY);
    assert!((Interval::EMPTY + Interval::point(1.0)).is_empty());
}

#[test]
fn sine_and_cosine_find_their_extremes() {
    assert_eq!(interval(0.0, 2.0).sin().hi(), 1.0);
    assert!(interval(0.0, 1.5).sin().hi() < 1.0);
    assert_eq!(interval(4.0, 5.0).sin().lo(), -1.0);
    assert_eq!(interval(-0.1, 0.1).cos().hi(), 1.0);
    assert_eq!(interval(3.0, 3.3).cos().lo(), -1.0);
    assert_eq!(interval(-100.0, 100.0).sin(), interval(-1.0, 1.0));
    assert_eq!(interval(1e300, 1e300).cos(), interval(-1.0, 1.0));
    // The float nearest to pi/2 lies below it, its successor above.
    let below = PI_FLOAT / 2.0;
    assert_eq!(interval(below, below.next_up()).sin().hi(), 1.0);
}

#[test]
fn tangent_over_a_pole_is_everything() {
    assert_eq!(interval(1.0, 2.0).tan(), Interval::ENTIRE);
    assert!(interval(-1.0, 1.0).tan().width() < 3.2);
    assert!(interval(2.0, 4.0).tan().contains(3f64.tan()));
}

#[test]
fn power_of_negative_base_contains_the_integer_exponents() {
    let power = interval(-2.0, -1.0).pow(interval(1.5, 3.5));
    assert!(power.contains(4.0) && power.contains(-8.0));
    assert!(interval(-2.0, -1.0).pow(Interval::point(0.5)).is_empty());
    assert!(Interval::point(0.0).pow(interval(0.0, 1.0)).contains(1.0));
    assert!(interval(-2.0, 4.0).pow(Interval::point(0.5)).contains(2.0));
    assert!(interval(-2.0, 4.0).pow(Interval::point(0.5)).lo() >= 0.0);
}

#[test]
fn images_contain_sampled_values() {
    type Pair = (fn(Interval) -> Interval, fn(f64) -> f64);
    let functions: [Pair; 9] = [
        (Interval::sin, f64::sin),
        (Interval::cos, f64::cos),
        (Interval::tan, f64::tan),
        (Interval::tanh, f64::tanh),
        (Interval::exp, f64::exp),
        (Interval::abs, f64::abs),
        (|x| x.powi(5), |x| x.powi(5)),
        (|x| x.powi(-2), |x| x.powi(-2)),
        (|x| x.pow(Interval::point(0.3)), |x| x.powf(0.3)),
    ];
    let ranges = [
        (-7.0, 7.0),
        (0.3, 0.31),
        (-2.0, 0.5),
        (1.0, 9.0),
        (0.0, 3.2),
        (-1e-9, 1e-9),
    ];
    for (index, (image, function)) in functions.into_iter().enumerate() {
        for (lo, hi) in ranges {
            let range = interval(lo, hi);
            let image = image(range);
            for x in samples(range) {
                let y = function(x);
                assert!(
                    !y.is_finite() || image.contains(y),
                    "{index}: {x} in {range} to {y}, {image}"
                );
            }
        }
    }
}
