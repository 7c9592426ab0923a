//! The LaTeX backend with real models and a real LaTeX.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use nalgebra::DMatrix;
use romc::artifact;
use romc::equations::Equations;
use romc::files::EmittedFile;
use romc::model::{FeetRule, Library, Phase, ReducedModel};
use romc::typeset::latex;
use romc::typeset::{Form, NumberStyle, PrintOptions};
use romc::typeset::{Rounding, SymbolTable};

#[path = "latex/papers.rs"]
mod papers;
mod tools;

/// Equations (25) and (26) as printed in the paper, without spaces and with plain parentheses.
const PAPER_CONTACT: &str = concat!(
    r"\begin{cases}",
    r"\ddot{z}_1=0.36-0.16\dot{z}_1-0.91\dot{z}_2-0.75\sin(\dot{z}_1)+0.11u_1-0.05u_2\\",
    r"\ddot{z}_2=-0.16-0.23\dot{z}_1-0.75\dot{z}_2-0.96\sin(\dot{z}_2)+0.14u_2",
    r"\end{cases}",
);
const PAPER_FLIGHT: &str = concat!(
    r"\begin{cases}",
    r"\ddot{z}_1=0.29-1.22\dot{z}_1-1.00\sin(\dot{z}_1)+51.05u_1\\",
    r"\ddot{z}_2=0.42\dot{z}_1+0.52\sin(\dot{z}_1)",
    r"\end{cases}",
);

/// One term of every kind in the library's grammar.
const EVERY_KIND: [&str; 40] = [
    "1",
    "z1",
    "dz2",
    "u1",
    "z10",
    "z1*dz2",
    "z1^2",
    "dz1^3*z2",
    "z1^10",
    "-z1",
    "2*z1",
    "z1/2",
    "0.125*z1*u2",
    "z1/z2",
    "1/z1",
    "3/(4*z1)",
    "1/(1 + z1^2)",
    "(z1 + z2)^2",
    "(z1 - z2)*(z1 + 2)",
    "sqrt(z1)",
    "sqrt(1 + z1^2)^3",
    "z1^(1/3)",
    "z1^(2/3)",
    "z1^0.3",
    "z1^z2",
    "2^z1",
    "sin(z1)",
    "sin(z1)^2*cos(dz1)",
    "sin(z1 + 2*z2)",
    "cos(z1/2)",
    "tan(z1)^3",
    "tanh(100*dz1)",
    "exp(-z1^2)",
    "exp(z1)*u1",
    "log(2 + z1)",
    "abs(dz1)*dz1",
    "abs(z1 - z2/3)",
    "sin(exp(z1)^2)",
    "1/sin(z1)",
    "(z1/z2)^z3",
];

fn model(name: &str) -> ReducedModel {
    artifact::read(
        &Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("models")
            .join(name),
    )
    .unwrap()
}

/// Every valid model file of the repository.
fn shipped_models() -> Vec<(PathBuf, ReducedModel)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut found = Vec::new();
    for folder in ["models", "tests/fixtures/models"] {
        let Ok(entries) = fs::read_dir(root.join(folder)) else {
            continue;
        };
        for entry in entries {
            let path = entry.unwrap().path();
            if path
                .extension()
                .is_some_and(|extension| extension == "json")
            {
                found.push(path);
            }
        }
    }
    found.sort();
    assert!(!found.is_empty(), "no model file found");
    found
        .into_iter()
        .map(|path| (path.clone(), artifact::read(&path).unwrap()))
        .collect()
}

/// A model of ten coordinates with a term of every kind in two equations, dense enough to break
/// lines.
fn every_kind() -> ReducedModel {
    let terms: Vec<String> = EVERY_KIND.iter().map(|term| (*term).to_owned()).collect();
    let library = Library::from_terms(10, &terms).unwrap();
    let mut xi = DMatrix::zeros(EVERY_KIND.len(), 10);
    for row in 0..EVERY_KIND.len() {
        xi[(row, 0)] = 0.125 * (row as f64 - 7.5);
        xi[(row, 9)] = if row % 3 == 0 {
            1e-9 * row as f64
        } else {
            -1.0
        };
    }
    ReducedModel::builder("every-kind", library)
        .phase(Phase {
            name: "rear stance".into(),
            feet: FeetRule::Any,
            xi: xi.clone(),
        })
        .phase(Phase {
            name: "flight".into(),
            feet: FeetRule::None,
            xi: -xi,
        })
        .build()
        .unwrap()
}

/// `ddz1 = coefficient * term`, as a picture of one term.
fn one_term(term: &str, coefficient: f64) -> String {
    let library = Library::from_terms(10, &[term.to_owned()]).unwrap();
    let mut xi = DMatrix::zeros(1, 10);
    xi[(0, 0)] = coefficient;
    let model = ReducedModel::builder("one", library)
        .phase(Phase {
            name: "contact".into(),
            feet: FeetRule::Any,
            xi,
        })
        .build()
        .unwrap();
    let options = PrintOptions {
        rounding: Rounding::Exact,
        ..PrintOptions::default()
    };
    let files = latex::emit(&Equations::as_learned(&model), &options).unwrap();
    let line = files[0]
        .contents
        .lines()
        .find(|line| line.contains(r"\ddot{z}_1 = "))
        .unwrap();
    let (_, right) = line.split_once(" = ").unwrap();
    let (right, _) = right.split_once(r" \\").unwrap();
    right.to_owned()
}

fn equations(files: &[EmittedFile], name: &str) -> String {
    let file = files.iter().find(|file| file.path == name);
    file.unwrap_or_else(|| panic!("{name} was not made"))
        .contents
        .clone()
}

/// The `cases` environments of a file without spaces, comments and delimiter sizes.
fn normal_form(text: &str) -> Vec<String> {
    let code: String = text.lines().filter(|line| !line.starts_with('%')).collect();
    let code = code
        .replace(r"\left", "")
        .replace(r"\right", "")
        .replace(' ', "");
    let mut systems = Vec::new();
    let mut rest = code.as_str();
    while let Some(start) = rest.find(r"\begin{cases}") {
        let end = start + rest[start..].find(r"\end{cases}").unwrap() + r"\end{cases}".len();
        systems.push(rest[start..end].to_owned());
        rest = &rest[end..];
    }
    systems
}

#[test]
fn paper_model_prints_equations_25_and_26_as_published() {
    let files = latex::emit(
        &Equations::of(&model("paper-2d.json")),
        &PrintOptions::default(),
    )
    .unwrap();
    let text = equations(&files, "paper_2d.tex");
    assert_eq!(normal_form(&text), [PAPER_CONTACT, PAPER_FLIGHT]);
    assert!(
        text.contains("No coefficient is changed by rounding."),
        "{text}"
    );
}

#[test]
fn every_shipped_model_prints_each_active_term_once() {
    for (path, model) in shipped_models() {
        let options = PrintOptions {
            form: Form::Cases,
            ..PrintOptions::default()
        };
        let files = latex::emit(&Equations::as_learned(&model), &options).unwrap();
        for (place, phase) in model.phases().iter().enumerate() {
            let name = format!(
                "{}_{}.tex",
                model.identifier(),
                model.phase_identifier(place)
            );
            let systems = normal_form(&equations(&files, &name));
            let [system] = systems.as_slice() else {
                panic!("{}: {} systems in {name}", path.display(), systems.len());
            };
            assert_eq!(
                system.matches(r"\ddot").count(),
                model.latent_dim(),
                "{}",
                path.display()
            );
            let zero_rows = (0..model.latent_dim())
                .filter(|output| phase.xi.column(*output).iter().all(|value| *value == 0.0))
                .count();
            let printed_zeros = system.matches("=0\\").count();
            assert_eq!(printed_zeros, zero_rows, "{}", path.display());
        }
    }
}

#[test]
fn custom_terms_print_with_correct_fractions_powers_and_parentheses() {
    for (term, expected) in [
        ("1", "0.5"),
        ("z10", "0.5z_{10}"),
        ("-z1", "-0.5z_1"),
        ("dz2*z1", r"0.5z_1\dot{z}_2"),
        ("z1^2*u1", "0.5z_1^2u_1"),
        ("z1^10", "0.5z_1^{10}"),
        ("2*z1", r"0.5 \cdot 2z_1"),
        ("z1/2", r"0.5\frac{z_1}{2}"),
        ("1/z1", r"\frac{0.5}{z_1}"),
        ("z1/(z2*dz1)", r"0.5\frac{z_1}{z_2\dot{z}_1}"),
        ("1/(1 + z1^2)", r"\frac{0.5}{1 + z_1^2}"),
        ("z1 - z2", "0.5(z_1 - z_2)"),
        ("(z1 - z2)^2", "0.5(z_1 - z_2)^2"),
        ("u1*(1 + z1)", "0.5u_1(1 + z_1)"),
        ("sqrt(z1)", r"0.5\sqrt{z_1}"),
        ("z1^(3/2)", "0.5z_1^{3/2}"),
        ("z1^(1/3)", r"0.5z_1^{1/3}"),
        ("z1^(1/4)", r"0.5\sqrt[4]{z_1}"),
        ("2^z1", r"0.5 \cdot 2^{z_1}"),
        ("(z1*z2)^z3", "0.5(z_1z_2)^{z_3}"),
        ("sin(dz1)", r"0.5\sin(\dot{z}_1)"),
        ("sin(z1)^2", r"0.5\sin^2(z_1)"),
        ("1/sin(z1)", r"\frac{0.5}{\sin(z_1)}"),
        ("cos(z1/2)", r"0.5\cos\left(\frac{z_1}{2}\right)"),
        ("exp(-z1)", r"0.5\exp(-z_1)"),
        ("log(z1)", r"0.5\ln(z_1)"),
        ("abs(dz1)*dz1", r"0.5\dot{z}_1\lvert \dot{z}_1 \rvert"),
        ("cos(z1)*sin(z2)*z3", r"0.5z_3\sin(z_2)\cos(z_1)"),
    ] {
        assert_eq!(one_term(term, 0.5), expected, "{term}");
    }
    assert_eq!(one_term("z1", 1.0), "z_1");
    assert_eq!(one_term("z1 + z2", -1.0), "-(z_1 + z_2)");
    assert_eq!(one_term("-z1", -2e-12), r"2 \times 10^{-12}z_1");
}

#[test]
fn rounding_to_zero_is_told_with_the_term() {
    let library = Library::from_terms(1, &["z1".into(), "u1".into()]).unwrap();
    let model = ReducedModel::builder("small", library)
        .phase(Phase {
            name: "contact".into(),
            feet: FeetRule::Any,
            xi: DMatrix::from_column_slice(2, 1, &[0.754, 0.0049]),
        })
        .build()
        .unwrap();
    let fixed = PrintOptions {
        rounding: Rounding::Decimals(2),
        ..PrintOptions::default()
    };
    let text = equations(
        &latex::emit(&Equations::of(&model), &fixed).unwrap(),
        "small.tex",
    );
    assert!(text.contains(r"\ddot{z}_1 = 0.75z_1"), "{text}");
    assert!(
        text.contains("The largest rounding error is 0.0049, of the term 0.0049 u1 of ddz1"),
        "{text}"
    );
    assert!(text.contains("1 of 2 terms round to zero"), "{text}");
    assert!(
        text.contains("left out: contact, ddz1: 4.9e-3 * u1"),
        "{text}"
    );
    let default = latex::emit(&Equations::of(&model), &PrintOptions::default()).unwrap();
    let text = equations(&default, "small.tex");
    assert!(text.contains(r"\ddot{z}_1 = 0.75z_1 + 0.005u_1"), "{text}");
    assert!(!text.contains("left out"), "{text}");
}

#[test]
fn rounded_factors_in_arguments_are_printed_and_told() {
    let library = Library::from_terms(1, &["sin(1.00012345678901*z1)".into()]).unwrap();
    let model = ReducedModel::builder("small", library)
        .phase(Phase {
            name: "contact".into(),
            feet: FeetRule::Any,
            xi: DMatrix::from_element(1, 1, 2.0),
        })
        .build()
        .unwrap();
    let told = "Factors in arguments of functions have as many digits";
    for (rounding, factor, is_told) in [
        (Rounding::Significant(3), "1.00", true),
        (Rounding::Exact, "1.00012345678901", false),
    ] {
        let options = PrintOptions {
            rounding,
            ..PrintOptions::default()
        };
        let files = latex::emit(&Equations::of(&model), &options).unwrap();
        let text = equations(&files, "small.tex");
        assert!(text.contains(&format!(r"\sin({factor}z_1)")), "{text}");
        assert_eq!(text.contains(told), is_told, "{text}");
    }
}

#[test]
fn coefficient_of_one_is_left_out_only_when_it_is_exactly_one() {
    for (coefficient, expected) in [(1.0, "z_1"), (1.0000001, "1.00z_1"), (-1.0, "-z_1")] {
        let library = Library::from_terms(1, &["z1".into()]).unwrap();
        let model = ReducedModel::builder("one", library)
            .phase(Phase {
                name: "contact".into(),
                feet: FeetRule::Any,
                xi: DMatrix::from_element(1, 1, coefficient),
            })
            .build()
            .unwrap();
        let options = PrintOptions {
            rounding: Rounding::Significant(3),
            ..PrintOptions::default()
        };
        let text = equations(
            &latex::emit(&Equations::as_learned(&model), &options).unwrap(),
            "one.tex",
        );
        let expected = format!("\\ddot{{z}}_1 = {expected}\n");
        assert!(text.contains(&expected), "{text}");
    }
}

#[test]
fn hostile_description_reaches_the_document_only_escaped() {
    let library = Library::from_terms(1, &["z1".into()]).unwrap();
    let hostile = r"100% \input{/etc/passwd} $x$ ^^5cinput #1 ~ a_b & c}";
    let model = ReducedModel::builder("m", library)
        .description(hostile)
        .phase(Phase {
            name: "contact".into(),
            feet: FeetRule::Any,
            xi: DMatrix::from_element(1, 1, 1.0),
        })
        .build()
        .unwrap();
    let files = latex::emit(&Equations::as_learned(&model), &PrintOptions::default()).unwrap();
    let text = equations(&files, "m-preview.tex");
    assert!(
        text.contains(r"100\% \textbackslash{}input\{/etc/passwd\} \$x\$"),
        "{text}"
    );
    assert_eq!(text.matches(r"\input{").count(), 3, "{text}");
    typeset(&files, "m");
}

#[test]
fn shipped_models_compile_to_pdf() {
    for (path, model) in shipped_models() {
        let files = latex::emit(&Equations::as_learned(&model), &PrintOptions::default()).unwrap();
        println!("{}", path.display());
        typeset(&files, model.identifier().as_str());
    }
}

#[test]
fn every_kind_of_term_compiles_to_pdf_in_each_form() {
    let model = every_kind();
    let symbols = SymbolTable::parse(&["z1=x", "z2=theta", "u1=F_lin,x", "z3=roll"], 10).unwrap();
    for (form, numbers) in [
        (Form::Cases, NumberStyle::Plain),
        (Form::Align, NumberStyle::Siunitx),
        (Form::Automatic, NumberStyle::Siunitx),
    ] {
        let options = PrintOptions {
            form,
            numbers,
            symbols: symbols.clone(),
            ..PrintOptions::default()
        };
        typeset(
            &latex::emit(&Equations::as_learned(&model), &options).unwrap(),
            "every_kind",
        );
    }
}

#[test]
fn whole_numbers_are_exact_unless_the_model_is_rounded_itself() {
    let text = |xi: &[f64], rounding: Rounding| {
        let library =
            Library::from_terms(1, &["1".into(), "z1".into(), "sin(dz1)".into()]).unwrap();
        let model = ReducedModel::builder("whole", library)
            .phase(Phase {
                name: "contact".into(),
                feet: FeetRule::Any,
                xi: DMatrix::from_column_slice(3, 1, xi),
            })
            .build()
            .unwrap();
        let options = PrintOptions {
            rounding,
            ..PrintOptions::default()
        };
        let files = latex::emit(&Equations::as_learned(&model), &options).unwrap();
        let text = equations(&files, "whole.tex");
        let start = text.find(r"\ddot{z}_1").unwrap();
        text[start..].lines().next().unwrap().to_owned()
    };
    let default = Rounding::default();
    let learned = text(&[0.123456, 2.0, -1.0], default);
    assert_eq!(learned, r"\ddot{z}_1 = 0.12 + 2z_1 - \sin(\dot{z}_1)");
    // as printed in a paper: two decimals throughout, so 1.00 is a rounded coefficient
    let printed = text(&[0.29, -1.22, -1.0], default);
    assert_eq!(
        printed,
        r"\ddot{z}_1 = 0.29 - 1.22z_1 - 1.00\sin(\dot{z}_1)"
    );
    let asked = text(&[0.123456, 2.0, -1.0], Rounding::Decimals(2));
    assert_eq!(asked, r"\ddot{z}_1 = 0.12 + 2.00z_1 - 1.00\sin(\dot{z}_1)");
    assert_eq!(text(&[1.0, 2.0, 0.0], default), r"\ddot{z}_1 = 1 + 2z_1");
}

#[test]
fn emission_is_identical_from_run_to_run() {
    let options = PrintOptions::default();
    assert_eq!(
        latex::emit(&Equations::as_learned(&every_kind()), &options).unwrap(),
        latex::emit(&Equations::as_learned(&every_kind()), &options).unwrap()
    );
}

/// Runs pdflatex on the preview; fails on errors and overfull lines; without LaTeX see [`tools::has_latex`]. With
/// ROMC_KEEP_PDF=DIR the PDF is kept.
fn typeset(files: &[EmittedFile], stem: &str) {
    typeset_document(files, &format!("{stem}-preview"));
}

/// The same for the document `NAME.tex`.
fn typeset_document(files: &[EmittedFile], name: &str) {
    if !tools::has_latex() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    for file in files {
        fs::write(folder.path().join(&file.path), &file.contents).unwrap();
    }
    let preview = format!("{name}.tex");
    // Twice: longtable and labels are final in the second run.
    for _ in 0..2 {
        let run = Command::new("pdflatex")
            .args([
                "-interaction=nonstopmode",
                "-halt-on-error",
                "-no-shell-escape",
                &preview,
            ])
            .current_dir(folder.path())
            .output()
            .unwrap();
        let log = String::from_utf8_lossy(&run.stdout);
        assert!(run.status.success(), "{preview}:\n{log}");
    }
    let log = fs::read(folder.path().join(format!("{name}.log"))).unwrap();
    let log = String::from_utf8_lossy(&log);
    // Small excess widths are invisible.
    for line in log.lines().filter(|line| line.starts_with("Overfull")) {
        let points = line
            .split('(')
            .nth(1)
            .and_then(|rest| rest.split("pt").next());
        let points: Option<f64> = points.and_then(|points| points.parse().ok());
        assert!(
            points.is_some_and(|points| points < 1.0),
            "{preview}: {line}"
        );
    }
    for fault in ["undefined", "multiply defined", "Missing character"] {
        assert!(!log.contains(fault), "{preview}: {fault}\n{log}");
    }
    if let Ok(keep) = std::env::var("ROMC_KEEP_PDF") {
        fs::create_dir_all(&keep).unwrap();
        let number = fs::read_dir(&keep).unwrap().count();
        let pdf = folder.path().join(format!("{name}.pdf"));
        fs::copy(pdf, Path::new(&keep).join(format!("{name}-{number}.pdf"))).unwrap();
    }
}
