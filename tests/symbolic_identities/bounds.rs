//! Intervals that contain the values of expressions.

use std::f64::consts::PI;

use crate::{ExprId, ExprPool, Function, Interval, SymbolId};

use super::parse;

fn bound(text: &str, lo: f64, hi: f64) -> Interval {
    let mut pool = ExprPool::new();
    let expr = parse(&mut pool, text);
    let domain: Vec<(SymbolId, Interval)> = pool
        .symbols_of(expr)
        .into_iter()
        .map(|symbol| (symbol, Interval::new(lo, hi)))
        .collect();
    let slopes = domain
        .iter()
        .map(|(symbol, _)| pool.derivative(expr, *symbol));
    let slopes: Vec<ExprId> = slopes.collect();
    pool.bound_by_slopes(expr, &slopes, &domain)
}

/// Without slopes.
fn bounds(text: &str, range: Interval) -> Interval {
    let mut pool = ExprPool::new();
    let expr = parse(&mut pool, text);
    pool.evaluate_intervals(&[expr], &|_| range)[0]
}

#[test]
fn bound_of_sine_minus_its_argument_is_sharp() {
    let error = bound("sin(x) - x", -0.1, 0.1);
    let exact = 0.1 - 0.1f64.sin();
    assert!(
        error.magnitude() >= exact && error.magnitude() < exact * 1.0001,
        "{error}"
    );
}

#[test]
fn bound_of_monotone_expression_is_its_values_at_the_ends() {
    let range = bound("x^3 + x - 1", -1.0, 2.0);
    assert_eq!((range.lo(), range.hi()), (-3.0, 9.0));
    let range = bound("1/(1 + x) - 2*x", 1.0, 3.0);
    assert_eq!((range.lo(), range.hi()), (-5.75, -1.5));
}

#[test]
fn bound_uses_the_mean_value_form_near_extremes() {
    let range = bound("x - x^2", 0.4, 0.6);
    assert!(
        range.contains(0.25) && range.contains(0.24) && range.width() < 0.05,
        "{range}"
    );
}

#[test]
fn bound_of_jumps_and_partly_undefined_expressions_is_the_natural_one() {
    assert_eq!(bound("sign(x)", -1.0, 1.0), Interval::new(-1.0, 1.0));
    assert_eq!(bound("sqrt(x)", -1.0, 4.0), Interval::new(0.0, 2.0));
    assert_eq!(bound("1/x", -1.0, 1.0), Interval::ENTIRE);
    assert_eq!(bound("x", f64::NEG_INFINITY, 0.0).hi(), 0.0);
}

#[test]
fn bound_of_magnitude_knows_its_kink() {
    assert_eq!(bound("abs(x)", -1.0, 2.0), Interval::new(0.0, 2.0));
    assert!(bound("abs(x) - x", 1.0, 2.0).magnitude() < 1e-12);
}

#[test]
fn bounds_of_polynomial_use_collected_powers() {
    let range = Interval::new(-2.0, 1.0);
    assert_eq!(bounds("x*x", range), Interval::new(0.0, 4.0));
    assert_eq!(bounds("1 + 2*x", range), Interval::new(-3.0, 3.0));
    assert_eq!(bounds("x - x", range), Interval::point(0.0));
}

#[test]
fn bounds_of_fraction_contain_the_exact_value() {
    let third = bounds("1/3", Interval::EMPTY);
    assert!(third.contains(1.0 / 3.0) && third.lo() < third.hi());
    let large = bounds("9007199254740993", Interval::EMPTY);
    assert_eq!(
        large,
        Interval::new(9_007_199_254_740_991.0, 9_007_199_254_740_994.0)
    );
}

#[test]
fn bounds_of_undefined_expression_are_empty() {
    assert!(bounds("log(-1 - x^2)", Interval::new(-1.0, 1.0)).is_empty());
    assert!(bounds("1/0", Interval::ENTIRE).is_empty());
}

/// Bounds of `x^y`.
fn power(base: Interval, exponent: Interval) -> Interval {
    let mut pool = ExprPool::new();
    let (x, y) = (pool.symbol("x"), pool.symbol("y"));
    let power = pool.pow(x, y);
    let is_base = |symbol| pool.symbol_name(symbol) == "x";
    let range_of = |symbol| if is_base(symbol) { base } else { exponent };
    pool.evaluate_intervals(&[power], &range_of)[0]
}

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
    assert_eq!(bounds("1/x", interval(2.0, 4.0)), interval(0.25, 0.5));
    assert_eq!(bounds("sqrt(x)", interval(4.0, 9.0)), interval(2.0, 3.0));
    assert_eq!(bounds("x^2", interval(-3.0, 2.0)), interval(0.0, 9.0));
    assert_eq!(bounds("x^3", interval(-3.0, 2.0)), interval(-27.0, 8.0));
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
    let third = bounds("1/x", Interval::point(3.0));
    assert!(third.lo() < 1.0 / 3.0 && 1.0 / 3.0 < third.hi());
    assert_eq!(third.hi(), third.lo().next_up().next_up());
}

#[test]
fn overflow_keeps_the_finite_side() {
    let large = Interval::point(1e200);
    assert_eq!(large * large, interval(f64::MAX, f64::INFINITY));
    assert_eq!(-(large * large), interval(f64::NEG_INFINITY, f64::MIN));
    assert_eq!(bounds("x^2", large), interval(f64::MAX, f64::INFINITY));
    let tiny = Interval::point(1e-200) * Interval::point(1e-200);
    assert!(tiny.contains(0.0) && tiny.hi() > 0.0);
    assert_eq!(bounds("x^2", Interval::point(1e-200)).lo(), 0.0);
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
    assert_eq!(bounds("1/x", interval(-1.0, 2.0)), Interval::ENTIRE);
    assert_eq!(
        bounds("1/x", interval(0.0, 2.0)),
        interval(0.5, f64::INFINITY)
    );
    assert_eq!(
        bounds("1/x", interval(-2.0, 0.0)),
        interval(f64::NEG_INFINITY, -0.5)
    );
    assert!(bounds("1/x", Interval::point(0.0)).is_empty());
}

#[test]
fn functions_outside_their_domain_give_what_is_defined() {
    assert_eq!(bounds("sqrt(x)", interval(-1.0, 4.0)), interval(0.0, 2.0));
    assert!(bounds("sqrt(x)", interval(-2.0, -1.0)).is_empty());
    assert!(bounds("log(x)", interval(-2.0, 0.0)).is_empty());
    assert_eq!(
        bounds("log(x)", interval(-2.0, 1.0)).lo(),
        f64::NEG_INFINITY
    );
    assert!((Interval::EMPTY + Interval::point(1.0)).is_empty());
}

#[test]
fn sine_and_cosine_find_their_extremes() {
    assert_eq!(bounds("sin(x)", interval(0.0, 2.0)).hi(), 1.0);
    assert!(bounds("sin(x)", interval(0.0, 1.5)).hi() < 1.0);
    assert_eq!(bounds("sin(x)", interval(4.0, 5.0)).lo(), -1.0);
    assert_eq!(bounds("cos(x)", interval(-0.1, 0.1)).hi(), 1.0);
    assert_eq!(bounds("cos(x)", interval(3.0, 3.3)).lo(), -1.0);
    assert_eq!(
        bounds("sin(x)", interval(-100.0, 100.0)),
        interval(-1.0, 1.0)
    );
    assert_eq!(
        bounds("cos(x)", interval(1e300, 1e300)),
        interval(-1.0, 1.0)
    );
    // The float nearest to pi/2 lies below it, its successor above.
    let below = PI / 2.0;
    assert_eq!(bounds("sin(x)", interval(below, below.next_up())).hi(), 1.0);
}

#[test]
fn tangent_over_a_pole_is_everything() {
    assert_eq!(bounds("tan(x)", interval(1.0, 2.0)), Interval::ENTIRE);
    assert!(bounds("tan(x)", interval(-1.0, 1.0)).width() < 3.2);
    assert!(bounds("tan(x)", interval(2.0, 4.0)).contains(3f64.tan()));
}

#[test]
fn power_of_negative_base_contains_the_integer_exponents() {
    let odd = power(interval(-2.0, -1.0), interval(1.5, 3.5));
    assert!(odd.contains(4.0) && odd.contains(-8.0));
    assert!(power(interval(-2.0, -1.0), Interval::point(0.5)).is_empty());
    assert!(power(Interval::point(0.0), interval(0.0, 1.0)).contains(1.0));
    assert!(power(interval(-2.0, 4.0), Interval::point(0.5)).contains(2.0));
    assert!(power(interval(-2.0, 4.0), Interval::point(0.5)).lo() >= 0.0);
}

#[test]
fn images_contain_sampled_values() {
    let texts = ["x^5", "x^-2", "x^0.3"].map(str::to_owned).into_iter();
    let calls = Function::ALL.map(|function| format!("{function}(x)"));
    let texts: Vec<String> = texts.chain(calls).collect();
    let ranges = [
        (-7.0, 7.0),
        (0.3, 0.31),
        (-2.0, 0.5),
        (1.0, 9.0),
        (0.0, 3.2),
        (-1e-9, 1e-9),
    ];
    for text in texts {
        let mut pool = ExprPool::new();
        let expr = parse(&mut pool, &text);
        for (lo, hi) in ranges {
            let range = interval(lo, hi);
            let image = bounds(&text, range);
            for x in samples(range) {
                let y = pool.evaluate(expr, &|_| x);
                assert!(
                    !y.is_finite() || image.contains(y),
                    "{text}: {x} in {range} to {y}, {image}"
                );
            }
        }
    }
}

#[test]
fn slope_without_kinks_is_the_derivative() {
    let mut pool = ExprPool::new();
    let x = pool.symbol_id("x");
    for text in [
        "x^2*y",
        "y/(1 + x)",
        "sin(x)/x",
        "x*abs(x)",
        "x^1.5",
        "exp(x)/(exp(x) - y)",
        "log(x)*y",
    ] {
        let expr = parse(&mut pool, text);
        assert_eq!(pool.slope(expr, x), pool.derivative(expr, x), "{text}");
    }
}

#[test]
fn slope_of_what_has_no_value_in_a_case_has_no_divisor_zero() {
    let mut pool = ExprPool::new();
    let x = pool.symbol_id("x");
    for text in [
        "sqrt(x^2 + y^2)/y",
        "sqrt(x^2 + y^2)/x",
        "sqrt(abs(x*y))*log(y)",
        "abs(exp(y) - 1)^(-0.5)*sqrt(abs(y*x))",
        "abs(y)^x/(y*(1 - y))",
    ] {
        let expr = parse(&mut pool, text);
        let slope = pool.slope(expr, x);
        for part in pool.reachable(&[slope]) {
            let value = pool.evaluate(part, &|_| f64::NAN);
            assert!(
                !pool.is_constant(part) || value.is_finite(),
                "{text}: {value}"
            );
        }
    }
}

#[test]
fn slope_of_many_kinks_takes_bounded_work() {
    let factors = (1..12).map(|k| format!("sqrt(1 + sin(x + {k}*y))"));
    let mut pool = ExprPool::new();
    let expr = parse(&mut pool, &factors.collect::<Vec<_>>().join("*"));
    let x = pool.symbol_id("x");
    pool.slope(expr, x);
    let n_parts = pool.n_nodes();
    assert!(n_parts < 50_000, "{n_parts} expressions were made");
}
