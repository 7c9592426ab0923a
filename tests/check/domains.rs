//! Domains of the two sides: constants without a value are refused; equal sides with values at different points are
//! equal with a note.

use romc::check::{CheckOptions, Side, Verdict, compare};
use romc::model::{Library, ModelError};
use romc::symbolic::ParseErrorKind;

use super::tools;

struct Random(u64);

impl Random {
    fn below(&mut self, n: u64) -> u64 {
        (self.0) = (self.0)
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % n
    }

    fn of<'t>(&mut self, texts: &[&'t str]) -> &'t str {
        texts[self.below(texts.len() as u64) as usize]
    }
}

/// Number of random members of each kind.
fn count() -> usize {
    if tools::is_thorough() { 500 } else { 50 }
}

/// A fraction in lowest terms, or no value.
type Fraction = Option<(i128, i128)>;

fn fraction(numerator: i128, denominator: i128) -> Fraction {
    let (mut a, mut b) = (numerator.abs(), denominator.abs());
    while b != 0 {
        (a, b) = (b, a % b);
    }
    let a = a.max(1) * denominator.signum();
    (denominator != 0).then(|| (numerator / a, denominator / a))
}

/// A constant of small numbers as text, and its value.
fn constant(random: &mut Random, depth: usize) -> (String, Fraction) {
    if depth == 0 {
        let value = random.below(5) as i128;
        return match random.below(3) {
            0 => (format!("{value}.5"), fraction(2 * value + 1, 2)),
            _ => (value.to_string(), fraction(value, 1)),
        };
    }
    let (left, a) = constant(random, depth - 1);
    let lower = random.below(depth as u64) as usize;
    let (right, b) = constant(random, lower);
    let both = a.zip(b);
    match random.below(5) {
        0 => (
            format!("({left} + {right})"),
            both.and_then(|((a, b), (c, d))| fraction(a * d + c * b, b * d)),
        ),
        1 => (
            format!("({left} - {right})"),
            both.and_then(|((a, b), (c, d))| fraction(a * d - c * b, b * d)),
        ),
        2 => (
            format!("({left}*{right})"),
            both.and_then(|((a, b), (c, d))| fraction(a * c, b * d)),
        ),
        3 => (
            format!("({left}/({right}))"),
            both.and_then(|((a, b), (c, d))| fraction(a * d, b * c)),
        ),
        _ => (format!("({left})^-1"), a.and_then(|(a, b)| fraction(b, a))),
    }
}

/// Whether every way of reading refuses the term because it has no value.
fn is_refused(term: &str) -> bool {
    let library = Library::from_terms(1, &[term.to_owned()]);
    let by_library = matches!(&library, Err(ModelError::Term { source, .. })
        if matches!(source.kind, ParseErrorKind::NoValue(_)));
    let text = format!("ddz1 = {term}");
    let side = Side::from_bytes("a.txt", text.as_bytes(), &CheckOptions::default(), &[]);
    let said = side.err().map(|error| error.to_string());
    let by_check = said.is_some_and(|said| said.contains("has no value"));
    assert_eq!(by_library, by_check, "{term}");
    by_library
}

#[test]
fn random_constants_are_refused_exactly_where_they_have_no_value() {
    let mut random = Random(8);
    let mut n_refused = 0;
    for _ in 0..10 * count() {
        let (text, value) = constant(&mut random, 3);
        let is_above = |least: i128| value.is_some_and(|(top, _)| top >= least);
        let (term, is_defined) = match random.below(7) {
            0 => (text.clone(), value.is_some()),
            1 => (format!("0*{text}*z1"), value.is_some()),
            2 => (format!("z1 + log({text})"), is_above(1)),
            3 => (format!("sqrt({text})^2*z1"), is_above(0)),
            4 => (format!("({text})^(1/3) + z1"), is_above(0)),
            5 => (
                format!("z1/({text})"),
                value.is_some_and(|(top, _)| top != 0),
            ),
            _ => (format!("0*log({text})^2"), is_above(1)),
        };
        assert_eq!(is_refused(&term), !is_defined, "{term}");
        n_refused += usize::from(!is_defined);
    }
    assert!(n_refused > count(), "{n_refused}");
}

#[test]
fn constants_without_a_value_are_refused_by_name() {
    for (term, part) in [
        ("0/0", "0/0"),
        ("z1 + 0*log(0)", "log(0)"),
        ("(z1-z1)/(z1-z1)", "(z1-z1)/(z1-z1)"),
        ("sqrt(-1)^2", "sqrt(-1)"),
        ("1/(0.5-1/2)", "1/(0.5-1/2)"),
        ("0*(1/0)", "1/0"),
        ("z1*0^-1", "0^-1"),
        ("(-8)^(1/3)*z1", "(-8)^(1/3)"),
        ("1/(0.1*3-0.3)", "1/(0.1*3-0.3)"),
        ("1/(sin(1)^2+cos(1)^2-1)", "1/(sin(1)^2+cos(1)^2-1)"),
        ("1/(sqrt(2)*sqrt(3)-sqrt(6))", "1/(sqrt(2)*sqrt(3)-sqrt(6))"),
        ("z1 + 0*sqrt(-1-abs(z1))", "sqrt(-1-abs(z1))"),
        ("(-2-u1^2)^0.5*z1", "(-2-u1^2)^0.5"),
    ] {
        assert!(is_refused(term), "{term}");
        let text = format!("ddz1 = {term}");
        let side = Side::from_bytes("a.txt", text.as_bytes(), &CheckOptions::default(), &[]);
        let said = side.expect_err(term).to_string();
        assert!(said.contains(&format!("`{part}` has no value")), "{said}");
    }
    let options = CheckOptions::default();
    let latex = br"\[\ddot z_1 = z_1 + \frac{0}{0}\]";
    assert!(Side::from_bytes("a.tex", latex, &options, &[]).is_err());
    for term in [
        "0^0*z1",
        "sqrt(0)*z1 + z1",
        "log(1e-300)*z1",
        "1/(0.1*3 - 0.2)*z1",
        "tan(1.5707963267948966)*z1",
        "sqrt(-z1^2)",
        "(-8)^z1",
    ] {
        assert!(!is_refused(term), "{term}");
    }
    for term in ["1e400*z1", "1e-400*z1", "inf*z1", "nan"] {
        assert!(
            Library::from_terms(1, &[term.to_owned()]).is_err(),
            "{term}"
        );
    }
}

/// Verdict and note of two right sides.
fn decided(left: &str, right: &str) -> (Verdict, bool) {
    let options = CheckOptions::default();
    let [a, b] = [left, right].map(|text| {
        let text = format!("ddz1 = {text}\nddz2 = u1 + u2");
        Side::from_bytes("a.txt", text.as_bytes(), &options, &[]).expect("reads")
    });
    let comparison = compare(&a, &b, &options);
    let equation = comparison.phases[0].equations[0].clone();
    (equation.verdict, equation.one_sided.is_some())
}

#[test]
fn sides_with_values_at_different_points_are_equal_with_a_note() {
    // Both sides, where A is an argument that is negative somewhere, and whether only one side has a value there.
    const PAIRS: [(&str, &str, bool); 16] = [
        ("((A)^3)^(1/3)", "abs(A)", true),
        ("((A)^3)^(1/3)", "A", true),
        ("sqrt(A)^2", "A", true),
        ("exp(log(A))", "A", true),
        ("(A)^0.3*(A)^0.7", "A", true),
        ("0*log(A) + 1", "1", true),
        ("log(A)", "log(abs(A))", true),
        ("((A)^2)^0.5", "abs(A)", false),
        ("log(exp(A))", "A", false),
        ("log(exp(A) + 1) - log(1 + exp(-(A)))", "A", false),
        ("log(exp(A) + exp(B))", "A + log(1 + exp((B) - (A)))", false),
        (
            "log(exp(2*(A)) + 3*exp(B))",
            "B + log(3 + exp(2*(A) - (B)))",
            false,
        ),
        ("sqrt(exp(A) + 1)", "exp((A)/2)*sqrt(1 + exp(-(A)))", false),
        ("abs(exp(A) - 1)", "exp(A)*abs(1 - exp(-(A)))", false),
        ("0.1*(A)", "0.10000000000000001*(A)", false),
        (
            "sin(0.30000000000000004*(A))",
            "sin(0.300000000000000044408920985*(A))",
            false,
        ),
    ];
    let mut random = Random(9);
    for number in 0..count() {
        let (left, right, is_alone) = PAIRS[number % PAIRS.len()];
        let [a, b] = [0, 1].map(|_| {
            let variable = random.of(&["z1", "z2", "u1", "dz2"]);
            let factor = random.of(&["", "2*", "0.3*", "1/3*", "-", "-0.7*"]);
            match random.below(2) {
                0 => format!("{factor}{variable}"),
                // Undecided: a root of an odd power of a negative variable next to a decimal.
                _ => {
                    let rest = random.of(&["0.1", "u2/5", "z1/4"]);
                    let is_undecided = rest == "0.1" && left.contains("^3)^(1/3)");
                    let rest = if is_undecided { "1/10" } else { rest };
                    format!("{factor}{variable} + {rest}")
                }
            }
        });
        let [left, right] = [left, right].map(|text| text.replace('A', &a).replace('B', &b));
        let (verdict, has_note) = decided(&left, &right);
        assert!(verdict.is_equal(), "{left} and {right}: {verdict:?}");
        assert_eq!(has_note, is_alone, "{left} and {right}");
        let wrong = format!("{right} + 0.001*({a})");
        let (verdict, _) = decided(&left, &wrong);
        assert!(
            matches!(verdict, Verdict::Different(_)),
            "{left} and {wrong}: {verdict:?}"
        );
    }
}

#[test]
fn a_side_without_a_value_somewhere_is_noted() {
    for (left, right) in [
        ("z1/z1", "1"),
        ("z1^2/z1", "z1"),
        ("log(z1)/log(z1)*z1", "z1"),
        ("sqrt(1 - z1)^2", "1 - z1"),
        ("((1 - z1)^3)^(1/3)", "1 - z1"),
        ("sqrt(z1 + 30)^2", "z1 + 30"),
    ] {
        for (left, right) in [(left, right), (right, left)] {
            let (verdict, has_note) = decided(left, right);
            assert!(verdict.is_equal(), "{left} and {right}: {verdict:?}");
            assert!(has_note, "{left} and {right}");
        }
    }
    // An overflow does not count as a missing value.
    for (left, right) in [
        ("exp(800)*exp(-800)*z1", "z1"),
        ("exp(z1 + 800)*exp(-800)", "exp(z1)"),
    ] {
        assert!(!decided(left, right).1, "{left} and {right}");
    }
}

#[test]
fn decimals_near_the_ends_of_the_range_are_numbers() {
    for (left, right) in [
        ("1e305*z1", "2e305*z1"),
        ("1e-305*z1*1e305", "2e-305*z1*1e305"),
        ("1e-307*z1*1e300*1e7", "z1 + 1"),
    ] {
        assert!(decided(left, left).0.is_equal(), "{left}");
        let (verdict, _) = decided(left, right);
        assert!(
            matches!(verdict, Verdict::Different(_)),
            "{left} and {right}: {verdict:?}"
        );
    }
    assert!(decided("1e-305*z1*1e305", "z1").0.is_equal());
}
