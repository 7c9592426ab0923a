//! Texts of candidate terms: accepted texts, and reports of faults.

use crate::{ExprPool, ParseError, ParseErrorKind};

fn is_latent(name: &str) -> bool {
    matches!(name, "z1" | "z2" | "dz1" | "dz2" | "u1")
}

fn value(text: &str) -> f64 {
    let mut pool = ExprPool::new();
    let expr = pool
        .parse(text, &is_latent)
        .unwrap_or_else(|error| panic!("{text}: {error}"));
    let two = pool.symbol_id("z1");
    pool.evaluate(expr, &|symbol| if symbol == two { 2.0 } else { 3.0 })
}

fn error(text: &str) -> ParseError {
    let mut pool = ExprPool::new();
    match pool.parse(text, &is_latent) {
        Ok(expr) => panic!("{text} was read as {}", pool.display(expr)),
        Err(error) => error,
    }
}

#[test]
fn operators_bind_as_in_mathematics() {
    assert_eq!(value("1 + 2*3"), 7.0);
    assert_eq!(value("-z1^2"), -4.0);
    assert_eq!(value("(-z1)^2"), 4.0);
    assert_eq!(value("2^3^2"), 512.0);
    assert_eq!(value("8/2/2"), 2.0);
    assert_eq!(value("8/(2*2)"), 2.0);
    assert_eq!(value("8 - 2 - 2"), 4.0);
    assert_eq!(value("z1^-1"), 0.5);
    assert_eq!(value("2*-z1"), -4.0);
    assert_eq!(value("--z1 + +z1"), 4.0);
    assert_eq!(value("2^-z1^2"), 0.0625);
    assert_eq!(value("z1*z2/z1"), 3.0);
}

#[test]
fn numbers_read_in_all_spellings() {
    for text in ["0.36", ".36", "36e-2", "3.6E-1", "0.036e+1"] {
        assert_eq!(value(text), 0.36, "{text}");
    }
    assert_eq!(value("2."), 2.0);
}

#[test]
fn functions_apply_to_their_argument_alone() {
    assert_eq!(value("sqrt(z1 + z1)*3"), 6.0);
    assert_eq!(value("sin(z1)^2"), 2f64.sin().powi(2));
    assert_eq!(value("abs(-(z1))"), 2.0);
    assert_eq!(
        value("exp(tanh(log(tan(cos(z1)^2))))"),
        2f64.cos().powi(2).tan().ln().tanh().exp()
    );
}

#[test]
fn other_spellings_of_operators_and_functions_are_read() {
    for (text, plain) in [
        ("z1**2 \u{2212} u1×z1", "z1^2 - u1*z1"),
        ("2·ln(z1)⋅sgn (z2)", "2*log(z1)*sign(z2)"),
    ] {
        let mut pool = ExprPool::new();
        let expected = pool.parse(plain, &|_| true);
        assert_eq!(pool.parse(text, &|_| true), expected, "{text}");
    }
    assert_eq!(
        error("z1·ż1").to_string(),
        "character 4: found `ż`, expected a velocity such as `dz1`"
    );
}

#[test]
fn faults_have_their_place_and_what_was_found() {
    let found = |found: &str, expected| ParseErrorKind::Unexpected {
        found: found.to_owned(),
        expected,
    };
    let operand = |token| found(token, "a number, a name, `(` or a sign");
    for (text, position, kind) in [
        // Code and TeX are refused because of their characters.
        ("x; system(\"x\")", 2, ParseErrorKind::Character(';')),
        ("\\input{x}", 1, ParseErrorKind::Character('\\')),
        ("z1 /* c */ \u{0}", 12, ParseErrorKind::Character('\u{0}')),
        ("z1 = 2", 4, ParseErrorKind::Character('=')),
        ("z1 # note", 4, ParseErrorKind::Character('#')),
        ("z1\u{202e}", 3, ParseErrorKind::Character('\u{202e}')),
        // Names and functions are distinguished.
        ("z1  + z9", 7, ParseErrorKind::UnknownName("z9".into())),
        ("z_1", 1, ParseErrorKind::UnknownName("z_1".into())),
        (
            "system(z1)",
            1,
            ParseErrorKind::UnknownFunction("system".into()),
        ),
        ("sin + 1", 5, found("`+`", "`(` after a function")),
        // Numbers are finite; an exponent without digits is a name.
        ("1e999", 1, ParseErrorKind::Number("1e999".into())),
        ("z1 + .", 6, ParseErrorKind::Number(".".into())),
        ("2e", 2, found("`e`", "an operator or the end")),
        ("2e+", 2, found("`e`", "an operator or the end")),
        ("é", 1, ParseErrorKind::Character('é')),
        // Misplaced tokens.
        ("", 1, operand("end of text")),
        ("z1 +", 5, operand("end of text")),
        ("z1 * / z2", 6, operand("`/`")),
        ("()", 2, operand("`)`")),
        ("2 z1", 3, found("`z1`", "an operator or the end")),
        ("z1)", 3, found("`)`", "an operator or the end")),
        ("(z1", 4, found("end of text", "an operator or `)`")),
        ("sin(z1 z2)", 8, found("`z2`", "an operator or `)`")),
    ] {
        assert_eq!(error(text), ParseError { position, kind }, "{text}");
    }
    assert_eq!(
        error("x; system(\"x\")").to_string(),
        "character 2: found `;`, expected numbers, names, functions and + - * / ^ ( )"
    );
}

#[test]
fn hostile_nesting_and_length_are_refused_without_recursion() {
    for (open, close) in [("(", ")"), ("sin(", ")"), ("z1^", "")] {
        let text = format!("{}z1{}", open.repeat(5_000), close.repeat(5_000));
        assert!(
            matches!(error(&text).kind, ParseErrorKind::TooDeep(200)),
            "{open}"
        );
    }
    let text = "-".repeat(60_000) + "z1";
    assert_eq!(value(&text), 2.0);
    let text = "z1 + ".repeat(20_000) + "z1";
    assert_eq!(
        error(&text).kind,
        ParseErrorKind::TooLong {
            found: 100_002,
            limit: 65_536
        }
    );
}

#[test]
fn huge_exponents_are_refused_also_when_nested() {
    for text in ["z1^1001", "(z1^1000)^1000", "(z1*z2^500)^-3", "z1^1e300"] {
        let kind = error(text).kind;
        assert!(
            matches!(kind, ParseErrorKind::Exponent { limit: 1_000, .. }),
            "{text}: {kind}"
        );
    }
}

#[test]
fn long_sums_are_read_in_near_linear_time() {
    let mut pool = ExprPool::new();
    let text: Vec<String> = (0..5_000).map(|i| format!("0.5*x{i}")).collect();
    let text = text.join(" + ");
    let expr = pool
        .parse(&text, &|_| true)
        .expect("text is within its limits");
    assert_eq!(pool.terms_of(expr).len(), 5_000);
    assert!(
        pool.n_nodes() < 17_000,
        "partial sums were kept: {}",
        pool.n_nodes()
    );
}
