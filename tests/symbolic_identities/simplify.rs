//! Bounded work and sound results of simplification.

use crate::cost::Costs;
use crate::{ExprPool, Function};

use super::{nested, parse, rewritten};

#[test]
fn simplify_of_hostile_input_is_bounded() {
    for text in [
        "(a + b + c + d + e)^1000",
        "(a + b)^1000*(a - b)^1000",
        "1/((a + 1)^50 + (b + 1)^50) + 1/((c + 1)^50 + (d + 1)^50)",
        "sin(1000*x)^1000*cos(x)^1000",
        "exp(exp(exp(exp(exp(x)))))^1000",
    ] {
        let mut pool = ExprPool::new();
        let expr = parse(&mut pool, text);
        let result = pool.simplify(expr);
        let cost = |expr| Costs::default().of(&pool, expr);
        assert!(cost(result) <= cost(expr), "{text}");
    }
}

#[test]
fn fractions_whose_numbers_outgrow_their_type_keep_their_variable() {
    // The last three tend to their numerator everywhere but at -1, where they are -1.
    for (above, beside, last) in [
        ("1", "1", 100),
        ("1", "9", 60),
        ("0.3", "0.7", 60),
        ("0.3123456789012345", "0.6876543210987655", 60),
        ("0.003", "0.997", 20),
    ] {
        let mut text = "x".to_string();
        for depth in 1..last {
            text = format!("{above}/({text} + {beside})");
            let mut pool = ExprPool::new();
            let expr = parse(&mut pool, &text);
            let result = pool.simplify(expr);
            let n_symbols = pool.symbols_of(result).len();
            assert_eq!(n_symbols, 1, "{above}, {beside} at depth {depth}");
        }
    }
}

#[test]
fn fractions_of_decimals_that_lose_their_variable_without_rounding_become_constants() {
    for text in [
        "0.3/(0.7 + 0.3/(0.7 + x)) - 0.3*(0.7 + x)/(0.79 + 0.7*x)",
        "0.123456789012345678/(1 + 1/(1 + x)) - 0.123456789012345678*(1 + x)/(2 + x)",
    ] {
        assert_eq!(rewritten(text, ExprPool::simplify), "0", "{text}");
    }
}

#[test]
fn simplify_of_deep_nesting_takes_linear_work() {
    let mut pool = ExprPool::new();
    let deep = nested(&mut pool, Function::Tanh, 3_000, true);
    assert_eq!(pool.simplify(deep), deep);
    assert!(
        pool.n_nodes() < 100_000,
        "{} expressions were made",
        pool.n_nodes()
    );
}
