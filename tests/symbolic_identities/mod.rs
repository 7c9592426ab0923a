//! The public functions of the algebra, and the table of identities `tests/fixtures/identities.txt`.

mod bounds;
mod expressions;
mod normal_form;
mod parsing;
mod properties;
mod simplify;

use crate::{CanonicalForms, ExprId, ExprPool, Function};

const TABLE: &str = include_str!("../fixtures/identities.txt");

fn parse(pool: &mut ExprPool, text: &str) -> ExprId {
    pool.parse(text, &|_| true)
        .unwrap_or_else(|error| panic!("{text}: {error}"))
}

/// `function` of its own value plus `x`, or of its value alone, nested to this many levels.
fn nested(pool: &mut ExprPool, function: Function, levels: usize, plus_x: bool) -> ExprId {
    let x = pool.symbol("x");
    (0..levels).fold(x, |deep, _| {
        let value = pool.apply(function, deep);
        if plus_x { pool.add(value, x) } else { value }
    })
}

/// The result of `rewrite` for the expression in a text, as text.
fn rewritten(text: &str, rewrite: impl FnOnce(&mut ExprPool, ExprId) -> ExprId) -> String {
    let mut pool = ExprPool::new();
    let expr = parse(&mut pool, text);
    let result = rewrite(&mut pool, expr);
    pool.display(result).to_string()
}

/// Asserts that `rewrite` turns each left text into the right one.
fn assert_rewritten(rewrite: impl Fn(&mut ExprPool, ExprId) -> ExprId, cases: &[(&str, &str)]) {
    for (text, expected) in cases {
        assert_eq!(rewritten(text, &rewrite), *expected, "{text}");
    }
}

/// The texts left and right of `operator`.
fn pairs(operator: &str) -> Vec<(&'static str, &'static str)> {
    let pairs: Vec<_> = TABLE
        .lines()
        .filter(|line| !line.starts_with('#'))
        .filter_map(|line| line.split_once(&format!(" {operator} ")))
        .map(|(a, b)| (a.trim(), b.trim()))
        .collect();
    assert!(
        pairs.len() >= 20,
        "only {} laws with {operator}",
        pairs.len()
    );
    pairs
}

/// Whether equal normal forms prove two expressions equal.
fn is_proven(pool: &ExprPool, a: ExprId, b: ExprId) -> bool {
    let mut forms = CanonicalForms::new(pool, &[a, b]);
    let difference = &forms.of(a) - &forms.of(b);
    let cleared = forms.without_fractions(&difference);
    cleared.is_some_and(|form| form.is_zero())
}

/// The failures, one per line.
fn assert_none(failures: &[String]) {
    assert!(failures.is_empty(), "\n{}\n", failures.join("\n"));
}

#[test]
fn identities_are_proven_and_their_difference_simplifies_to_zero() {
    let mut failures = Vec::new();
    for (left, right) in pairs("==") {
        let mut pool = ExprPool::new();
        let (a, b) = (parse(&mut pool, left), parse(&mut pool, right));
        if !is_proven(&pool, a, b) {
            failures.push(format!("not proven: {left} == {right}"));
        }
        let difference = pool.sub(a, b);
        let simple = pool.simplify(difference);
        if simple != ExprId::ZERO {
            failures.push(format!("{left} - ({right}) gives {}", pool.display(simple)));
        }
    }
    assert_none(&failures);
}

#[test]
fn identities_beyond_simplification_are_proven() {
    let mut failures = Vec::new();
    for (left, right) in pairs("<=>") {
        let mut pool = ExprPool::new();
        let (a, b) = (parse(&mut pool, left), parse(&mut pool, right));
        if !is_proven(&pool, a, b) {
            failures.push(format!("not proven: {left} <=> {right}"));
        }
    }
    assert_none(&failures);
}

#[test]
fn non_identities_are_not_proven() {
    let mut failures = Vec::new();
    for (left, right) in pairs("!=") {
        let mut pool = ExprPool::new();
        let (a, b) = (parse(&mut pool, left), parse(&mut pool, right));
        let (simple_a, simple_b) = (pool.simplify(a), pool.simplify(b));
        if is_proven(&pool, a, b) || simple_a == simple_b {
            failures.push(format!("proven: {left} == {right}"));
        }
    }
    assert_none(&failures);
}

#[test]
fn simplification_keeps_the_values_of_negative_arguments() {
    for (left, right) in [("(x^2)^(1/4)", "x^(1/2)"), ("log(x^2)", "2*log(x)")] {
        let mut pool = ExprPool::new();
        let (a, b) = (parse(&mut pool, left), parse(&mut pool, right));
        assert_ne!(pool.simplify(a), pool.simplify(b), "{left} and {right}");
    }
}

#[test]
fn expressions_simplify_to_their_short_forms() {
    let mut failures = Vec::new();
    for (left, right) in pairs("->") {
        let mut pool = ExprPool::new();
        let expr = parse(&mut pool, left);
        let simple = pool.simplify(expr);
        let text = pool.display(simple).to_string();
        if text != right {
            failures.push(format!("{left} gives {text}, not {right}"));
        }
        if pool.simplify(simple) != simple {
            failures.push(format!("{text} is not stable"));
        }
    }
    assert_none(&failures);
}
