//! Equal expressions get equal forms, different ones do not.

use super::*;
use crate::symbolic::{ExprPool, SymbolId};

/// The form of `a - b` without fractions; decimals are rounded where their text starts with `~`.
fn difference(a: &str, b: &str) -> (CanonicalForm, f64) {
    let mut pool = ExprPool::new();
    let parse = |pool: &mut ExprPool, text: &str| {
        let mark = if text.starts_with('~') { '~' } else { '#' };
        let named = |number: &str| number.contains('.').then(|| format!("{mark}{number}"));
        let parsed = pool.parse_with_literals(text.trim_start_matches('~'), &|_| true, &named);
        parsed.unwrap_or_else(|error| panic!("{text}: {error}"))
    };
    let (left, right) = (parse(&mut pool, a), parse(&mut pool, b));
    let literal = |symbol: SymbolId| {
        let name = pool.symbol_name(symbol);
        let rounded = name.strip_prefix('~').map(|digits| (digits, true));
        let (digits, is_rounded) =
            rounded.or(name.strip_prefix('#').map(|digits| (digits, false)))?;
        Literal::parse(digits, is_rounded)
    };
    let mut forms = CanonicalForms::new(&pool, &[left, right], &literal);
    let difference = forms.of(left).minus(&forms.of(right));
    let cleared = forms.without_fractions(&difference).expect("small enough");
    (cleared, forms.rounding())
}

#[test]
fn equal_expressions_have_the_difference_zero() {
    for (a, b) in [
        ("sin(x)^2 + cos(x)^2", "1"),
        ("3*sin(x)^2 + 2*cos(x)^2", "2 + sin(x)^2"),
        ("2*sin(x)*cos(x)", "sin(2*x)"),
        ("sin(x)*cos(y) + cos(x)*sin(y)", "sin(x + y)"),
        ("cos(3*x)", "4*cos(x)^3 - 3*cos(x)"),
        ("sin(x + 0.5)*sin(x - 0.5)", "(cos(1) - cos(2*x))/2"),
        ("sin(-x*y)", "-sin(x*y)"),
        ("cos(x - y)", "cos(y - x)"),
        ("tan(x)", "sin(x)/cos(x)"),
        ("1 + tan(x)^2", "1/cos(x)^2"),
        ("tanh(2*x)", "2*tanh(x)/(1 + tanh(x)^2)"),
        ("tanh(x)", "(exp(x) - exp(-x))/(exp(x) + exp(-x))"),
        ("exp(x)*exp(y)", "exp(x + y)"),
        ("exp(x + log(y))", "y*exp(x)"),
        ("exp(2*log(x))", "x^2"),
        ("log(x*y) + log(x)", "2*log(x) + log(y)"),
        ("log(4*x^2)", "2*log(2) + 2*log(abs(x))"),
        ("log(exp(x)*sqrt(y))", "x + log(y)/2"),
        ("log(6) - log(2)", "log(3)"),
        ("2^x*2^(y/2)", "exp(log(2)*(x + y/2))"),
        ("sqrt(x)*sqrt(y)", "sqrt(x*y)*sqrt(x)/sqrt(x)"),
        ("sqrt(2)*sqrt(3)", "sqrt(6)"),
        ("sqrt(8*x)", "2*sqrt(2)*sqrt(x)"),
        ("sqrt(x^2*y)", "abs(x)*sqrt(y)"),
        ("(x + 1)^(1/2)*(x + 1)^(3/2)", "(1 + x)^2"),
        ("sqrt(0.25*x)", "x^0.5/2"),
        ("x^(1/3)*x^(2/3)", "x"),
        ("abs(x*y)", "abs(x)*abs(y)"),
        ("abs(x)^3", "abs(x)*x^2"),
        ("abs(2 - 2*x)", "2*abs(x - 1)"),
        ("abs(x)*sign(x)", "x"),
        ("sign(x*y^3)", "sign(x)*sign(y)"),
        ("abs(x) + log(x)", "x + log(x)"),
        ("(x^2 - 1)/(x - 1)", "x + 1"),
        ("1/x + 1/y", "(x + y)/(x*y)"),
        ("1/(1 + 1/x)", "x/(1 + x)"),
        ("(x + y)^4 - (x - y)^4", "8*x^3*y + 8*x*y^3"),
        ("0.1*x + 0.2*x", "0.3*x"),
        ("(x/3)*3", "x"),
        ("sin(0.1*x + 0.2*x)", "sin(0.3*x)"),
        ("exp(sin(x)^2)*exp(cos(x)^2)", "exp(1)"),
        ("sin(sin(x)^2 + cos(x)^2 + y)", "sin(1 + y)"),
    ] {
        let (form, rounding) = difference(a, b);
        assert!(form.is_zero(), "{a} and {b}: {form:?}");
        assert_eq!(rounding, 0.0);
    }
}

#[test]
fn different_expressions_have_another_difference() {
    for (a, b) in [
        ("sin(x)^2 + cos(x)^2", "1.0000001"),
        ("sin(x)", "-sin(x)"),
        ("sqrt(x^2)", "x"),
        ("abs(x)", "x"),
        ("log(x^2)", "2*log(y)"),
        ("tanh(x)", "tan(x)"),
        ("1/(1 + x)", "1 - x"),
        ("exp(x + 1)", "exp(x)"),
        ("sign(x)^2", "1"),
        ("sqrt(x*y)*sqrt(x*y)/y", "-x"),
        ("cos(2*x)", "1 - sin(x)^2"),
    ] {
        assert!(!difference(a, b).0.may_be_zero(), "{a} and {b}");
    }
}

#[test]
fn rounded_decimals_agree_within_half_a_unit_of_their_last_digit() {
    let agree = |a, b| difference(a, b).0.may_be_zero();
    assert!(agree("0.3612*x - 51.046", "~0.36*x - 51.05"));
    assert!(!agree("0.3652*x", "~0.36*x"));
    assert!(agree("0.35*x*y + 0.24*x", "~x*(0.3*y + 0.2) + 0.0*x"));
    assert!(agree(
        "sin(0.3612*x) + exp(-1.21*y)",
        "~sin(0.36*x) + exp(-1.2*y)"
    ));
    assert!(!agree("sin(0.3612*x)", "~sin(0.35*x)"));
    assert!(agree("x/(1.204 + y)", "~x/(1.2 + y)"));
    assert!(agree("x/0.333", "~x/0.33"));
    let (form, rounding) = difference("sin(0.3612*x)", "~sin(0.36*x)");
    assert!(
        form.is_zero() && (rounding - 0.0012).abs() < 1e-15,
        "{rounding}"
    );
    assert!(!difference("0.3612*x", "~0.36*x").0.is_zero());
}

#[test]
fn large_powers_stay_whole_and_equal_to_themselves() {
    assert!(
        difference("(x + y + z)^900 + sin(x)", "sin(x) + (z + x + y)^900")
            .0
            .is_zero()
    );
    assert!(!difference("(x + y + z)^900", "(x + y)^900").0.may_be_zero());
}
