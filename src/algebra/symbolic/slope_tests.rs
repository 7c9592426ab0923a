use super::*;

/// The slope of a text by `x` where `x` is 0 (or as given) and other symbols have values.
fn slope_at(text: &str, values: &[(&str, f64)]) -> f64 {
    let mut pool = ExprPool::new();
    let expr = pool.parsed(text);
    let x = pool.symbol_id("x");
    let slope = pool.slope(expr, x);
    let value = |symbol: SymbolId| {
        let name = pool.symbol_name(symbol);
        let known = values.iter().find(|(known, _)| *known == name);
        known.map_or(0.0, |(_, value)| *value)
    };
    pool.evaluate(slope, &value)
}

#[test]
fn slope_has_the_value_that_the_function_has() {
    let (inf, zero) = (f64::INFINITY, 0.0);
    let at_zero = [
        ("x*sqrt(abs(x))", zero),
        ("x*sqrt(x^2 + y^2)", zero),
        ("sign(x)*tanh(abs(x))", 1.0),
        ("abs(x)", 1.0),
        ("-abs(sin(x))", -1.0),
        ("sqrt(x)", inf),
        ("sqrt(-x)", -inf),
        ("-sqrt(abs(x))", -inf),
        ("sqrt(x^2 + y^2)", 1.0),
        ("cos(sqrt(abs(x)))", -0.5),
        ("sqrt(1 - cos(x))", 0.5f64.sqrt()),
        ("sqrt(abs(x))*sqrt(abs(sin(x)))", 1.0),
        ("sqrt(x) - sqrt(2*x)", -inf),
        ("sqrt(x) - sin(sqrt(x))", zero),
        ("abs(x)^0.3*abs(tan(x))^0.7", 1.0),
        ("(x^2 + y^2)^0.75", zero),
        ("(x^2)^0.3*x", zero),
        ("sqrt(abs(x) + abs(y))", inf),
        ("sign(x)*(1 + x)", 1.0),
        ("sign(x)*cos(y)", zero),
        ("tanh(1/x)", zero),
        ("1/(1 + 1/x)", 1.0),
        ("exp(-1/x^2)", zero),
        ("(1 + sqrt(x))*(1 - sqrt(x) + x)", zero),
        ("x*sign(sin(x)*cos(x))", 1.0),
    ];
    for (text, expected) in at_zero {
        let found = slope_at(text, &[]);
        assert!(
            found == expected || (found - expected).abs() < 1e-12,
            "{text}: {found}, {expected}"
        );
    }
}

#[test]
fn slope_follows_exponents_and_other_variables() {
    let cases = [
        ("abs(x)^y", 2.5, 0.0),
        ("abs(x)^y", 1.0, 1.0),
        ("abs(x)^y", 0.5, f64::INFINITY),
        ("x*abs(x)^y", 0.5, 0.0),
        ("sqrt(abs(y*x))", 0.0, 0.0),
        ("sqrt(y*x)", -2.0, f64::NEG_INFINITY),
        ("sqrt(y*x)", 2.0, f64::INFINITY),
        ("sqrt(x^2 + y^2)", 2.0, 0.0),
        ("y*sqrt(abs(x)) + x", 0.0, 1.0),
        ("y*sqrt(abs(x)) + x", -1.0, f64::NEG_INFINITY),
        ("sqrt(abs(x - y))*(x - y)", 0.0, 0.0),
        ("abs(y)^x", 0.0, 0.0),
    ];
    for (text, y, expected) in cases {
        let found = slope_at(text, &[("y", y)]);
        assert_eq!(found, expected, "{text} at y = {y}");
    }
    for (text, expected) in [("sqrt(abs(x - y))*(x - y)", 0.0), ("abs(x - y)", 1.0)] {
        assert_eq!(
            slope_at(text, &[("x", 0.7), ("y", 0.7)]),
            expected,
            "{text}"
        );
    }
    assert_eq!(slope_at("sqrt(1 - x)*(1 - x)", &[("x", 1.0)]), 0.0);
    assert_eq!(slope_at("sqrt(1 - x)", &[("x", 1.0)]), f64::NEG_INFINITY);
}

#[test]
fn slope_of_what_has_none_of_these_points_is_the_derivative() {
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
        let expr = pool.parsed(text);
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
        let expr = pool.parsed(text);
        let slope = pool.slope(expr, x);
        for part in pool.reachable(&[slope]) {
            let value = pool.evaluate(part, &|_| f64::NAN);
            assert!(
                !pool.is_constant(part) || value.is_finite(),
                "{text}: {value}"
            );
        }
    }
    for (at, expected) in [([3.0, 4.0], 0.15), ([0.0, 2.0], 0.0)] {
        let values = [("x", at[0]), ("y", at[1])];
        let found = slope_at("sqrt(x^2 + y^2)/y", &values);
        assert!((found - expected).abs() < 1e-15, "{found} at {at:?}");
    }
}

#[test]
fn slope_with_too_many_cases_is_a_difference_instead_of_no_number() {
    let nested = "sqrt(abs(tan(x)/(1 + abs(abs(x^2 + x^2)^w))) + abs(y))*(1 - cos(x))";
    let found = slope_at(nested, &[("w", 1.0)]);
    assert!(found.abs() < 1e-3, "{found}");
    let nested = "abs(abs(abs(x)^u + sin(y)*x^2)^v - abs(abs(y)^w - x)^u)^w*x";
    let found = slope_at(nested, &[("u", 1.5), ("v", 0.5), ("w", 2.0)]);
    assert!(found.abs() < 1e-3, "{found}");
}

#[test]
fn slope_of_many_kinks_takes_bounded_work() {
    let factors: Vec<String> = (1..12)
        .map(|k| format!("sqrt(1 + sin(x + {k}*y))"))
        .collect();
    let mut pool = ExprPool::new();
    let expr = pool.parsed(&factors.join("*"));
    let x = pool.symbol_id("x");
    let slope = pool.slope(expr, x);
    let n_parts = pool.n_nodes();
    assert!(n_parts < 50_000, "{n_parts} expressions were made");
    let at = |x: f64| {
        let of = |factor: u32| (1.0 + (x + 0.5 * f64::from(factor)).sin()).sqrt();
        (1..12).map(of).product::<f64>()
    };
    let value = |symbol: SymbolId| if symbol == x { 0.3 } else { 0.5 };
    let difference = (at(0.3 + 1e-6) - at(0.3 - 1e-6)) / 2e-6;
    let found = pool.evaluate(slope, &value);
    assert!((found - difference).abs() < 1e-6, "{found}, {difference}");
}
