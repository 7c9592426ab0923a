//! Equal expressions get equal normal forms, different ones do not.

use crate::{CanonicalForm, CanonicalForms, ExprPool};

/// The form of `a - b` without fractions; decimals are rounded where their text starts with `~`.
fn difference(a: &str, b: &str) -> (CanonicalForm, f64) {
    let mut pool = ExprPool::new();
    let parse = |pool: &mut ExprPool, text: &str| {
        let is_rounded = text.starts_with('~');
        let decimal = |pool: &mut ExprPool, number: &str| match number.contains('.') {
            true => pool.decimal(number, is_rounded),
            false => None,
        };
        let text = text.trim_start_matches('~');
        let parsed = pool.parse_defined(text, &|_| true, &decimal);
        parsed
            .unwrap_or_else(|error| panic!("{text}: {error}"))
            .expr
    };
    let (left, right) = (parse(&mut pool, a), parse(&mut pool, b));
    let mut forms = CanonicalForms::new(&pool, &[left, right]);
    let difference = &forms.of(left) - &forms.of(right);
    let cleared = forms.without_fractions(&difference).expect("small enough");
    (cleared, forms.rounding)
}

#[test]
fn decimals_are_exact_as_they_are_written() {
    for (a, b) in [
        ("0.1*x + 0.2*x", "0.3*x"),
        ("sin(0.1*x + 0.2*x)", "sin(0.3*x)"),
    ] {
        let (form, rounding) = difference(a, b);
        assert!(form.is_zero() && rounding == 0.0, "{a} and {b}: {form:?}");
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

#[test]
fn squares_under_roots_and_fractions_in_arguments_are_recognised() {
    for (a, b) in [
        ("sqrt(1 - sin(x)^2)", "abs(cos(x))"),
        ("sqrt(3*x^2 - 6*x*y + 3*y^2)", "sqrt(3)*abs(x - y)"),
        ("sqrt(1 + cos(2*x))", "sqrt(2)*abs(cos(x))"),
        ("log((x + y)^2)", "2*log(abs(x + y))"),
        ("log(x^2 - 1) - log(x - 1)", "log(x + 1)"),
        ("sqrt(1 + x)*sqrt(2 + x)", "sqrt(2 + 3*x + x^2)"),
        (
            "log(1 + x) + log(y + x) + log(2 - y)",
            "log((1 + x)*(x + y)*(2 - y))",
        ),
        ("log(exp(x) + 1) - log(1 + exp(-x))", "x"),
        ("log(exp(x) + exp(y))", "x + log(1 + exp(y - x))"),
        ("sign(exp(x) - 1)", "sign(1 - exp(-x))"),
        ("abs(x)/x", "sign(x)"),
        ("abs(x + y)/(x + y)", "sign(x + y)"),
        ("abs(x + y)", "(x + y)*sign(x + y)"),
        ("abs(sin(x))", "sin(x)*sign(sin(x))"),
        ("y*abs(x + 1)", "y*sign(1 + x) + x*y*sign(1 + x)"),
        ("abs(1/cos(x))", "1/abs(cos(x))"),
        ("sign(1/cos(x))", "sign(cos(x))"),
        ("1/sqrt(1/(x*y))", "sqrt(x*y)"),
        ("sin((x^2 - 1)/(x - 1))", "sin(x + 1)"),
        ("exp(tan(x)*cos(x))", "exp(sin(x))"),
        ("abs(y/sin(x)^2)", "abs(y)/sin(x)^2"),
        ("sqrt(y/sin(x)^2)", "sqrt(y)/abs(sin(x))"),
        ("sqrt((1 + y)/sin(x)^2)", "sqrt(1 + y)/abs(sin(x))"),
        ("log(1/sin(x))", "-log(sin(x))"),
        ("log(1/(2 + x))", "-log(2 + x)"),
        ("sign(1/sin(x))", "sign(sin(x))"),
        ("sign(y/sin(x)^2)", "sign(y/sin(x)^4)"),
    ] {
        assert!(difference(a, b).0.is_zero(), "{a} and {b}");
    }
    for (a, b) in [
        ("sqrt(1 + sin(x)^2)", "abs(cos(x))"),
        ("sqrt(x^2 - 2*x*y + 2*y^2)", "abs(x - y)"),
        ("abs(x)/x^2", "sign(x)"),
        ("log(x^2 - 1) - log(x - 2)", "log(x + 1)"),
        ("log(exp(x) + 1) - log(2 + exp(-x))", "x"),
        ("abs(x + y)", "(x - y)*sign(x + y)"),
        ("abs(x + y)", "(x + y)*sign(x + y)^2"),
        ("sign(x)/x", "abs(x)"),
        ("abs(y/(1 + sin(x))^2)", "-abs(y)/(1 + sin(x))^2"),
        ("abs(y/sin(x)^2)", "-abs(y)/sin(x)^2"),
        ("sign(y/sin(x)^2)", "sign(-y/sin(x)^4)"),
        ("sign(y/(1 + sin(x))^2)", "-sign(y/(1 + sin(x))^4)"),
        ("exp(log(-1/sin(x)) + y)", "exp(y)/sin(x)"),
        ("sin((x^2 - 1)/(x + 2))", "sin(x + 1)"),
    ] {
        assert!(!difference(a, b).0.may_be_zero(), "{a} and {b}");
    }
}

#[test]
fn rounded_arguments_are_equal_only_if_one_number_rounds_to_all_of_them() {
    let agree = |a, b| difference(a, b).0.may_be_zero();
    assert!(agree("~sin(0.36*x)", "~sin(0.37*x)"));
    assert!(!agree("~2*sin(0.37*x)", "~sin(0.36*x) + sin(0.38*x)"));
}
