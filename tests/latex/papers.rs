//! Files that authors include in papers: they fit their columns; tables, units, phases.

use super::*;

/// Classes of papers with the width at which equations are broken.
const PAPERS: [(&str, f64, &str); 3] = [
    ("ieee", 22.0, r"\documentclass[journal]{IEEEtran}"),
    (
        // Columns of 252 pt as in IEEEtran, with smaller letters in tables.
        "columns",
        22.0,
        "\\documentclass[10pt,twocolumn]{article}\n\\usepackage[textwidth=516pt,columnsep=12pt]{geometry}",
    ),
    ("article", 32.0, r"\documentclass[10pt]{article}"),
];

#[test]
fn every_file_fits_papers_of_one_and_two_columns() {
    if !tools::has_latex() || !tools::has_latex_class("IEEEtran") {
        return;
    }
    for (path, model) in shipped_models() {
        let learned = Equations::as_learned(&model);
        let physical = learned.in_physical_units().ok();
        let rounding = match physical {
            Some(_) => Rounding::PHYSICAL,
            None => Rounding::default(),
        };
        let equations = physical.as_ref().unwrap_or(&learned);
        for (name, width, class) in PAPERS {
            let options = PrintOptions {
                width_em: Some(width),
                rounding,
                ..PrintOptions::default()
            };
            let mut files = latex::emit(equations, &options).unwrap();
            // All except the preview and the files of single phases, which have the same labels.
            let stem = model.identifier().as_str();
            let is_input = |path: &str| {
                let end = path.strip_prefix(stem).unwrap();
                !end.starts_with('_') && end != "-preview.tex"
            };
            let inputs = files
                .iter()
                .map(|file| file.path.as_str())
                .filter(|path| is_input(path));
            // Within paragraphs, which are indented by the class.
            let inputs = inputs.map(|path| format!("The model:\n\\input{{{path}}}\nand text.\n\n"));
            let inputs: String = inputs.collect();
            let paper = format!(
                "{class}\n\\usepackage{{amsmath,booktabs,longtable}}\n\\begin{{document}}\n{inputs}\\end{{document}}\n"
            );
            files.push(EmittedFile::new(format!("{name}.tex"), paper));
            println!("{}, {name}", path.display());
            typeset_document(&files, name);
            typeset(&files, stem);
        }
    }
}

#[test]
fn coefficients_are_one_table_unless_it_is_wider_than_the_page() {
    let model = model("go1-d4.json");
    let table = |width_em: f64| {
        let options = PrintOptions {
            width_em: Some(width_em),
            ..PrintOptions::default()
        };
        let files = latex::emit(&Equations::as_learned(&model), &options).unwrap();
        equations(&files, "go1_d4-table.tex")
    };
    for (width_em, environment) in [(60.0, "{table}"), (22.0, "{table}"), (15.0, "{table*}")] {
        let text = table(width_em);
        assert_eq!(text.matches(r"\begin{tabular}").count(), 1, "{text}");
        assert!(text.contains(&format!(r"\begin{environment}")), "{text}");
        assert!(text.contains(r"\label{tab:go1-d4}"), "{text}");
        assert!(!text.contains("tab:go1-d4:1"), "{text}");
    }
    // two of four columns, and at least one column each
    for (width_em, n_parts) in [(7.5, 2), (1.0, 4)] {
        let text = table(width_em);
        assert_eq!(text.matches(r"\begin{tabular}").count(), n_parts, "{text}");
        assert!(
            text.contains("% Labels:\n%   tab:go1-d4\n%   tab:go1-d4:1\n"),
            "{text}"
        );
        let last = format!(r"\label{{tab:go1-d4:{n_parts}}}");
        assert!(text.contains(&last), "{text}");
    }
}

#[test]
fn phases_with_equal_equations_are_printed_once() {
    let model = model("go1-trot-d6.json");
    let files = latex::emit(&Equations::of(&model), &PrintOptions::default()).unwrap();
    let text = equations(&files, "go1_trot_d6.tex");
    assert_eq!(normal_form(&text).len(), 2, "{text}");
    assert!(
        text.contains("\n% Phases fr_rl, fl_rr, all: fr and rl, or fr alone"),
        "{text}"
    );
    let text = equations(&files, "go1_trot_d6-table.tex");
    assert!(
        text.contains(r"\emph{Phases fr\_rl, fl\_rr, all}"),
        "{text}"
    );
    let text = equations(&files, "go1_trot_d6_all.tex");
    assert_eq!(normal_form(&text).len(), 1, "{text}");
}

#[test]
fn robot_accelerations_that_differ_from_the_latent_ones_are_explained() {
    for (name, falls) in [
        ("go1-d2.json", Some("$-10.2$ instead of $-9.81$")),
        ("go1-d7.json", None),
    ] {
        let model = model(name);
        let physical = Equations::of(&model).in_physical_units().unwrap();
        let options = PrintOptions {
            rounding: Rounding::PHYSICAL,
            ..PrintOptions::default()
        };
        let files = latex::emit(&physical, &options).unwrap();
        let text = equations(&files, &format!("{}-robot.tex", model.identifier()));
        assert_eq!(
            text.contains("The decoder causes the difference"),
            falls.is_some(),
            "{text}"
        );
        assert!(falls.is_none_or(|falls| text.contains(falls)), "{text}");
    }
}

#[test]
fn numbers_in_physical_units_have_three_digits_below_each_other() {
    let model = model("go1-d7.json");
    let physical = Equations::of(&model).in_physical_units().unwrap();
    let options = PrintOptions {
        rounding: Rounding::PHYSICAL,
        ..PrintOptions::default()
    };
    let files = latex::emit(&physical, &options).unwrap();
    let text = equations(&files, "go1_d7-table.tex");
    assert!(text.contains(r"$1470\phantom{.0000}$"), "{text}");
    assert!(text.contains(r"$-314\phantom{.0000}$"), "{text}");
    assert!(text.contains(r"$0.0967$"), "{text}");
}

#[test]
fn physical_units_of_a_model_without_robot_are_refused() {
    let model = model("paper-2d.json");
    let error = Equations::of(&model).in_physical_units().err().unwrap();
    let text = error.to_string();
    assert!(text.contains("need an encoder and a decoder"), "{text}");
    assert!(text.contains("leave --units out"), "{text}");
}
