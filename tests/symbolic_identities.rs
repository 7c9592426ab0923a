//! The table of identities: `tests/fixtures/identities.txt`.

use romc::symbolic::{ExprId, ExprPool};

const TABLE: &str = include_str!("fixtures/identities.txt");

fn parse(pool: &mut ExprPool, text: &str) -> ExprId {
    pool.parse(text, &|_| true)
        .unwrap_or_else(|error| panic!("{text}: {error}"))
}

/// The pairs that stand left and right of `operator`.
fn pairs(operator: &str) -> Vec<(&'static str, &'static str)> {
    let pairs: Vec<_> = TABLE
        .lines()
        .filter(|line| !line.starts_with('#'))
        .filter_map(|line| line.split_once(operator))
        .map(|(a, b)| (a.trim(), b.trim()))
        .collect();
    assert!(
        pairs.len() >= 20,
        "only {} laws with {operator}",
        pairs.len()
    );
    pairs
}

/// What failed, one a line.
fn assert_none(failures: &[String]) {
    assert!(failures.is_empty(), "\n{}\n", failures.join("\n"));
}

#[test]
fn identities_are_proven_and_their_difference_simplifies_to_zero() {
    let mut failures = Vec::new();
    for (left, right) in pairs("==") {
        let mut pool = ExprPool::new();
        let (a, b) = (parse(&mut pool, left), parse(&mut pool, right));
        if !pool.is_equivalent(a, b) {
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
fn non_identities_are_not_proven() {
    let mut failures = Vec::new();
    for (left, right) in pairs("!=") {
        let mut pool = ExprPool::new();
        let (a, b) = (parse(&mut pool, left), parse(&mut pool, right));
        let (simple_a, simple_b) = (pool.simplify(a), pool.simplify(b));
        if pool.is_equivalent(a, b) || simple_a == simple_b {
            failures.push(format!("proven: {left} == {right}"));
        }
    }
    assert_none(&failures);
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
