//! Equations (25) and (26) as people type them.

use std::fs;
use std::path::Path;

use romc::artifact;
use romc::check::{CheckOptions, Side, Verdict, compare};
use romc::import::{Format, ImportOptions, import_from_bytes};
use romc::robot::PhasePattern;

const PAPERS: [&str; 5] = [
    "cases.tex",
    "align.tex",
    "siunitx.tex",
    "macros.tex",
    "notes.md",
];

fn paper(name: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/papers");
    fs::read_to_string(folder.join(name)).expect("a fixture")
}

fn published() -> romc::model::ReducedModel {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/paper-2d.json");
    artifact::read(&path).expect("the shipped model")
}

#[test]
fn five_styles_of_the_papers_equations_are_read_as_the_same_model() {
    let options = CheckOptions {
        exact: true,
        ..CheckOptions::default()
    };
    let model = published();
    for name in PAPERS {
        let text = paper(name);
        let side = Side::from_bytes(name, text.as_bytes(), &options, &[]);
        let side = side.unwrap_or_else(|error| panic!("{error}"));
        let comparison = compare(&Side::of_model("paper-2d.json", &model), &side, &options);
        let names: Vec<&str> = comparison
            .phases
            .iter()
            .map(|phase| phase.name.as_str())
            .collect();
        assert_eq!(names, ["contact", "flight"], "{name}");
        for verdict in comparison.verdicts() {
            assert_eq!(*verdict, Verdict::Equal, "{name}");
        }
    }
}

#[test]
fn papers_are_imported_as_the_shipped_model() {
    let model = published();
    for name in PAPERS {
        let text = paper(name);
        let rule = |phase: &str, feet: &str| {
            format!("{phase}={feet}")
                .parse::<PhasePattern>()
                .expect("a rule")
        };
        let options = ImportOptions {
            name: "paper".into(),
            phases: vec![rule("contact", "any"), rule("flight", "none")],
            ..ImportOptions::default()
        };
        let imported = import_from_bytes(name, Format::Latex, text.as_bytes(), &options);
        let imported = imported.unwrap_or_else(|error| panic!("{error}")).model;
        for phase in 0..2 {
            assert_eq!(imported.phases()[phase].feet, model.phases()[phase].feet);
            for output in 0..2 {
                let terms = |model: &romc::model::ReducedModel| -> Vec<(String, u64)> {
                    let terms = model
                        .active_terms(phase, output)
                        .expect("in range")
                        .into_iter();
                    terms
                        .map(|(c, term)| (term.text.clone(), c.to_bits()))
                        .collect()
                };
                assert_eq!(terms(&imported), terms(&model), "{name}");
            }
        }
    }
}
