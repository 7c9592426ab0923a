//! Sums and their shortest forms, as text: `0.7 x | -1 sin(y)` is `0.7*x - sin(y)`.

use super::{Shortener, Summands};
use crate::symbolic::{ExprId, ExprPool};

/// The shortest form of a sum, with the number of summands.
fn shortest(sum: &str) -> String {
    let mut pool = ExprPool::new();
    let summand = |text: &str| {
        let (coefficient, term) = text.split_once(' ').expect("coefficient and term");
        (coefficient.parse().expect("a number"), pool.parsed(term))
    };
    let summands: Summands = sum.split(" | ").map(summand).collect();
    let mut left: Vec<Option<Summands>> = summands
        .iter()
        .map(|&summand| Some(vec![summand]))
        .collect();
    for new in Shortener::new(&mut pool).shorten(&summands) {
        new.replaced.iter().for_each(|&place| left[place] = None);
        left[new.replaced[0]] = Some(new.by);
    }
    let texts = left.into_iter().flatten().flatten();
    let texts: Vec<String> = texts
        .map(|(c, expr)| format!("{c} {}", pool.display(expr)))
        .collect();
    texts.join(" | ")
}

#[test]
fn shorten_finds_the_simplest_form_of_each_family() {
    let mut wrong = Vec::new();
    for (sum, expected) in [
        ("1 sin(x)^2 | 1 cos(x)^2", "1 1"),
        ("0.37 sin(x)^2 | 0.37 cos(x)^2 | 2 y", "0.37 1 | 2 y"),
        ("3 sin(x)^2 | 2 cos(x)^2", "2 1 | 1 sin(x)^2"),
        ("2 sin(x)*cos(x) | -1 sin(2*x)", ""),
        ("0.7 sin(x)*cos(y) | 0.7 cos(x)*sin(y)", "0.7 sin(x + y)"),
        ("1 sin(-x) | 1 sin(x)", ""),
        ("1 cos(-x) | 1 cos(x)", "2 cos(x)"),
        ("1 x/2 | 0.5 x", "1 x"),
        ("1 (x^2 - 1)/(x - 1)", "1 1 | 1 x"),
        ("1 (x + 1)^2 | -1 x^2 | -2 x", "1 1"),
        ("0.1 (x + 1)^3 | -0.1 x^3 | -0.3 x^2 | -0.3 x", "0.1 1"),
        ("1 exp(x)*exp(-x) | 2 x", "1 1 | 2 x"),
        ("0.3 log(exp(x)) | 0.1 x", "0.4 x"),
        ("1.3 exp(2*log(x))", "1.3 x^2"),
        ("0.1 x*y | -0.1 y*x", ""),
        ("0.1 sqrt(x)^2 | 0.2 x", "0.3 x"),
        ("1 sin(x + y) | 1 sin(x - y)", "2 sin(x)*cos(y)"),
        (
            "1 sin(x)*cos(y) | 1 cos(x)*sin(y) | 0.3 sin(x)*cos(z)",
            "1 sin(x + y) | 0.3 sin(x)*cos(z)",
        ),
        ("1 tan(x)*cos(x) | 1 sin(x)", "2 sin(x)"),
        ("1 1 | 1 tan(x)^2", "1 1/cos(x)^2"),
        ("1 1 | -2 sin(x)^2", "1 cos(2*x)"),
        (
            "1 (x + 1)^2 | -1 x^2 | -2 x | 0.3 (x + 1)^3",
            "1 1 | 0.3 (1 + x)^3",
        ),
        // Of equal terms each counts once.
        (
            "0.5 1 | -0.5 cos(2*x) | 0.5 1*y | 0.5 y",
            "1 sin(x)^2 | 1 y",
        ),
    ] {
        let found = shortest(sum);
        if found != expected {
            wrong.push(format!("{sum}: {found}, expected {expected}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn shorten_leaves_what_is_short_already() {
    for sum in [
        "0.36 1 | -0.16 dz1 | -0.91 dz2 | -0.75 sin(dz1)",
        "0.1 x | 0.2 x*y | 0.3 (1 + x)^2",
        "1 x*y | 1 x*z",
        "0.37 sin(x)*cos(y) | 0.21 sin(z)*cos(x)",
        "1 1/3*x",
        "1 exp(x) | 1 tanh(y) | 0.5 sqrt(x^2 + y^2)",
        // Shorter forms of these overflow or underflow where they do not.
        "0.4 log(x) | 0.4 log(y)",
        "1 -exp(x)/(y - exp(x)) | 1 exp(x)/(y + exp(x))",
        "1 1/(x - y) | -1 1/(x + y)",
        "1 sign(x)*sign(y)",
        "1 sqrt(x)*sqrt(y)",
    ] {
        assert_eq!(shortest(sum), sum);
    }
}

#[test]
fn shorten_of_a_long_plain_sum_makes_no_expression() {
    let mut pool = ExprPool::new();
    let summands: Vec<(f64, ExprId)> = (0..20_000)
        .map(|i| {
            let text = format!("x{}*x{}*sin(y{i})", i % 97, i % 89);
            (0.1, pool.parsed(&text))
        })
        .collect();
    let before = pool.n_nodes();
    assert_eq!(Shortener::new(&mut pool).shorten(&summands), []);
    assert_eq!(pool.n_nodes(), before);
}
