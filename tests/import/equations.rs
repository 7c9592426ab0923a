//! Equations as text.

use std::fmt::Write as _;

use nalgebra::DVector;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use romc::import::equations::{Equation, Sections};
use romc::import::*;
use romc::model::{LibraryChoice, ReducedModel, StandardLibrary};
use romc::symbolic::{ExprId, ExprPool};

use super::store::*;

/// A model's equations in the usual handwritten form.
fn text_of(model: &ReducedModel) -> String {
    let mut text = "# written by a test\n".to_owned();
    for (index, phase) in model.phases().iter().enumerate() {
        let _ = writeln!(text, "[{}]", phase.name);
        for output in 0..model.latent_dim() {
            let _ = write!(text, "ddz{} = 0", output + 1);
            let terms = model.active_terms(index, output).expect("in range");
            for (coefficient, term) in terms {
                let sign = if coefficient < 0.0 { '-' } else { '+' };
                let _ = write!(text, "\n   {sign} {:?}*({})", coefficient.abs(), term.text);
            }
            text.push('\n');
        }
    }
    text
}

fn import(text: &str, options: &ImportOptions) -> Result<Imported, ImportError> {
    let options = ImportOptions {
        library_order: None,
        ..options.clone()
    };
    import_from_bytes("eq.txt", Format::Equations, text.as_bytes(), &options)
}

/// `(coefficient bits, term)` of an output.
fn active(model: &ReducedModel, phase: usize, output: usize) -> Vec<(u64, String)> {
    let mut active: Vec<(u64, String)> = (model.active_terms(phase, output).expect("in range"))
        .into_iter()
        .map(|(coefficient, term)| (coefficient.to_bits(), term.text.clone()))
        .collect();
    active.sort();
    active
}

const PAPER: &str = "
# The two-dimensional model of the paper, equations (25) and (26).
[contact]
ddz1 = 0.36 - 0.16*dz1 - 0.91*dz2 - 0.75*sin(dz1) + 0.11*u1 - 0.05*u2
ddz2 = -0.16 - 0.23*dz1 - 0.75*dz2
       - 0.96*sin(dz2) + 0.14*u2
[flight]
ddz1 = 0.29 - 1.22*dz1 - sin(dz1) + 51.05*u1
ddz2 = 0.42*dz1 + 0.52*sin(dz1)
";

#[test]
fn equations_of_the_paper_give_its_coefficients_and_accelerations() {
    let original = model("models/paper-2d.json");
    let options = ImportOptions {
        name: "paper".to_owned(),
        ..ImportOptions::default()
    };
    let imported = import(PAPER, &options).expect("equations").model;
    let terms: Vec<&str> = imported
        .library()
        .terms()
        .iter()
        .map(|t| t.text.as_str())
        .collect();
    assert_eq!(
        terms,
        ["1", "dz1", "dz2", "sin(dz1)", "sin(dz2)", "u1", "u2"]
    );
    for phase in 0..2 {
        assert_eq!(imported.phases()[phase].feet, original.phases()[phase].feet);
        for output in 0..2 {
            assert_eq!(
                active(&imported, phase, output),
                active(&original, phase, output)
            );
        }
    }
    for seed in 0..200 {
        let at = |k: usize| {
            let value = |i: usize, _| ((seed * 7 + k * 3 + i) as f64 * 0.77).sin() * 3.0;
            DVector::from_fn(2, value)
        };
        for phase in 0..2 {
            let expected = original
                .ddz(phase, &at(0), &at(1), &at(2))
                .expect("evaluates");
            let found = imported
                .ddz(phase, &at(0), &at(1), &at(2))
                .expect("evaluates");
            assert_eq!(found, expected);
        }
    }
}

#[test]
fn equations_with_a_library_give_the_same_model() {
    for path in [
        "models/paper-2d.json",
        "tests/fixtures/models/dense-4.json",
        "tests/fixtures/models/degree-3.json",
        "tests/fixtures/models/every-function.json",
        "tests/fixtures/models/no-flight-inputs.json",
        "tests/fixtures/models/one-dimensional.json",
    ] {
        let original = model(path);
        let imported = import(&text_of(&original), &options_of(&original))
            .unwrap_or_else(|error| panic!("{path}: {error}"));
        assert_same(&imported, &original, &["encoder", "decoder"]);
    }
}

#[test]
fn equations_without_a_library_keep_every_coefficient() {
    for path in ["models/go1-d6.json", "tests/fixtures/models/degree-3.json"] {
        let original = model(path);
        let mut options = options_of(&original);
        options.library = None;
        let imported = import(&text_of(&original), &options)
            .expect("equations")
            .model;
        for phase in 0..original.phases().len() {
            for output in 0..original.latent_dim() {
                assert_eq!(
                    active(&imported, phase, output),
                    active(&original, phase, output),
                    "{path}"
                );
            }
        }
    }
}

#[test]
fn equations_of_one_phase_need_no_section() {
    let options = ImportOptions {
        name: "one".to_owned(),
        phases: vec!["stance=1111,0011".parse().expect("a rule")],
        ..ImportOptions::default()
    };
    let imported = import("ddz1 = u1 - 2*z1\n", &options).expect("one phase");
    assert_eq!(imported.model.phases()[0].name, "stance");
    let read = &imported.report.equations[0];
    assert_eq!((read.line, read.terms), (1, 2));
    let without = ImportOptions {
        phases: Vec::new(),
        ..options
    };
    let error = import("ddz1 = u1 - 2*z1\n", &without).expect_err("of which phase?");
    assert_eq!(error.place, romc::files::Place::Character(1, 1));
}

#[test]
fn equations_follow_the_order_of_the_phases_given() {
    let options = ImportOptions {
        name: "order".to_owned(),
        phases: ["rear=0011", "contact=any", "flight=none"]
            .map(|text| text.parse().expect("a rule"))
            .to_vec(),
        ..ImportOptions::default()
    };
    let text = "[flight]\nddz1 = -1\n[contact]\nddz1 = u1\n[rear]\nddz1 = 2*u1\n";
    let imported = import(text, &options).expect("three phases").model;
    let names: Vec<&str> = imported.phases().iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["rear", "contact", "flight"]);
    assert_eq!(imported.phase_for([false, false, true, true]), Some(0));
    // An omitted phase has its usual rule and comes last.
    let fewer = ImportOptions {
        phases: options.phases[..1].to_vec(),
        ..options
    };
    let imported = import(text, &fewer).expect("three phases").model;
    assert_eq!(imported.phases()[0].name, "rear");
    assert_eq!(imported.phases().len(), 3);
    assert_eq!(
        imported
            .phase_for([true; 4])
            .map(|k| &imported.phases()[k].name[..]),
        Some("contact")
    );
}

#[test]
fn equations_that_do_not_fit_the_options_are_refused() {
    let base = ImportOptions {
        name: "m".to_owned(),
        ..ImportOptions::default()
    };
    let refusal =
        |text: &str, options: ImportOptions| import(text, &options).expect_err(text).to_string();
    let message = refusal("[stance]\nddz1 = 1\n", base.clone());
    assert_eq!(
        message,
        "eq.txt: found equations (line 1) of phase `stance`, expected --phase stance=any (or \
         none, always, or patterns such as 0011 in the order fr fl rr rl)"
    );
    let library = LibraryChoice::Standard(StandardLibrary::default());
    let given = ImportOptions {
        library: Some(library),
        ..base.clone()
    };
    assert_eq!(
        refusal("[contact]\n\nddz1 = z1 + 2*tanh(z1)\n", given),
        "eq.txt:3:1: found the term `tanh(z1)` in ddz1, expected the terms of --library only"
    );
    let latent = ImportOptions {
        latent_dim: Some(2),
        ..base.clone()
    };
    assert!(refusal("[contact]\nddz1 = z1\n", latent).starts_with("--latent-dim: found 2"));
    let mapped = ImportOptions {
        mapping: vec!["xi.contact=Xi".parse().expect("a mapping")],
        ..base.clone()
    };
    assert!(refusal("[contact]\nddz1 = z1\n", mapped).starts_with("--map: found a file of"));
    let more = ImportOptions {
        phases: vec![
            "contact=any".parse().expect("a rule"),
            "flight=none".parse().expect("a rule"),
        ],
        ..base.clone()
    };
    assert!(refusal("[contact]\nddz1 = z1\n", more).starts_with("--phase: found flight"));
    let huge = "[contact]\nddz1 = 1e200*(1e200*(z1 + u1) + 1)\n";
    assert!(
        refusal(huge, base.clone()).contains("eq.txt:2:1: found a coefficient of ddz1 beyond"),
        "{}",
        refusal(huge, base.clone())
    );
    let nothing = import("[contact]\nddz1 = z1 - z1\n", &base).expect("zeros");
    assert_eq!(nothing.model.phases()[0].xi.amax(), 0.0);
}

fn read(text: &[u8]) -> Result<Sections, ImportError> {
    read_equations("eq", Format::Equations, text, &SymbolNames::default(), &[])
}

/// Place of a fault and the text found there.
fn refusal(text: &[u8]) -> String {
    let error = read(text).expect_err("a fault").to_string();
    let found = error.split(", expected ").next();
    found.expect("what was found").to_owned()
}

fn parsed(equation: &Equation, pool: &mut ExprPool) -> ExprId {
    pool.parse(&equation.text(), &|_| true)
        .expect("it was read")
}

#[test]
fn sections_and_continued_lines_are_read() {
    let text = "# made by hand\r\n[contact]\r\nddz2 = z1\nddz1 = 1 -\n   dz2 # more\n[ flight ]\n\
                ddz1 = 0\nddz2=u1\n";
    let read = read(text.as_bytes()).expect("two phases");
    assert_eq!(read.latent_dim, 2);
    let names: Vec<_> = read.sections.iter().map(|s| s.phase.as_deref()).collect();
    assert_eq!(names, [Some("contact"), Some("flight")]);
    let mut pool = ExprPool::new();
    let first = &read.sections[0].equations[0];
    assert_eq!((first.output, first.line), (0, 4));
    let expr = parsed(first, &mut pool);
    assert_eq!(pool.display(expr).to_string(), "1 - dz2");
}

#[test]
fn names_with_underscores_and_other_spellings_are_read() {
    let text = "ddz_1 = 2*z_1**2 − 3·dz_1\n  + ln(z_1)*sgn (u_1) + pi";
    let read = read(text.as_bytes()).expect("an equation");
    let mut pool = ExprPool::new();
    let found = parsed(&read.sections[0].equations[0], &mut pool);
    let plain = "2*z1^2 - 3*dz1 + log(z1)*sign(u1) + 3.141592653589793";
    assert_eq!(Ok(found), pool.parse(plain, &|_| true));
}

#[test]
fn faults_are_reported_with_line_and_column() {
    for (text, line, column, found) in [
        ("", 1, 1, "the end of the text"),
        ("z1 + 2", 1, 1, "`z1 + 2`"),
        ("ddz1 = z1 + z2", 1, 13, "`z2`"),
        ("  dz1 = z1", 1, 3, "`dz1`"),
        ("ddz1 = z1 +\n   é*z1", 2, 4, "`é`"),
        ("ddz1 = sin z1", 1, 12, "`z1`"),
        ("ddz1 = sinh(z1)", 1, 8, "`sinh`"),
        ("ddz1 = z1 +", 1, 12, "end of text"),
        ("ddz1 = z1\n + \n", 2, 3, "end of text"),
        ("ddz1 = 1e999", 1, 8, "`1e999`"),
        ("[contact\nddz1 = 1", 1, 1, "`[contact`"),
        ("[]\nddz1 = 1", 1, 1, "`[]`"),
        ("[a]\nddz1 = 1\n[a]", 3, 1, "`[a]` again, as in line 1"),
        ("ddz1 = 1\n[a]\nddz1 = 1", 1, 1, "an equation"),
        ("ddz1 = 1\nddz1 = 2", 2, 1, "`ddz1` again, as in line 1"),
        ("[a]\nddz2 = 1", 1, 1, "phase `[a]` without ddz1"),
        ("[a]\nddz1 = 1\n[b]\n", 3, 1, "phase `[b]` without ddz1"),
        ("ddz_1 = z_1 + dz_1 + q", 1, 22, "`q`"),
        ("ddz1 = z1²", 1, 10, "`²`"),
        ("ddz1 = z1^2000", 1, 15, "the exponent 2000"),
    ] {
        let expected = format!("eq:{line}:{column}: found {found}");
        assert_eq!(refusal(text.as_bytes()), expected, "{text}");
    }
    let found = refusal(b"ddz1 = 1\nddz2 = \xff");
    assert_eq!(found, "eq:2:8: found bytes that are no text");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, rng_seed: RngSeed::Fixed(7), ..ProptestConfig::default() })]

    /// Coefficients are imported with all their bits.
    #[test]
    fn coefficients_of_equations_arrive_bit_for_bit(values in proptest::collection::vec(any::<f64>(), 7)) {
        let finite = |value: &f64| value.is_finite() && *value != 0.0;
        prop_assume!(values.iter().all(finite));
        let terms = ["1", "z1", "dz1", "z1*dz1", "sin(z1)", "exp(-dz1^2)", "u1"];
        let sum: Vec<String> = terms.iter().zip(&values)
            .map(|(term, value)| format!("({value:e})*{term}"))
            .collect();
        let text = format!("[contact]\nddz1 = {}\n", sum.join(" + "));
        let options = ImportOptions { name: "m".to_owned(), ..ImportOptions::default() };
        let imported = import(&text, &options).expect("finite coefficients");
        let found = imported.model.phases()[0].xi.as_slice();
        prop_assert_eq!(found.len(), values.len());
        for (found, expected) in found.iter().zip(&values) {
            prop_assert_eq!(found.to_bits(), expected.to_bits());
        }
    }
}
