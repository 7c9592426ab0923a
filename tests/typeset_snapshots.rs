//! The emitted LaTeX, Markdown and MathML of the shipped models, as text.

use std::path::Path;

use romc::artifact;
use romc::equations::Equations;
use romc::model::ReducedModel;
use romc::typeset::latex;
use romc::typeset::markdown;
use romc::typeset::mathml;
use romc::typeset::{NumberStyle, PrintOptions};
use romc::typeset::{Rounding, SymbolTable};

fn model(path: &str) -> ReducedModel {
    artifact::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).unwrap()
}

/// Version numbers change without the layout changing.
fn without_version(text: &str) -> String {
    text.replace(concat!("romc ", env!("CARGO_PKG_VERSION")), "romc VERSION")
}

#[test]
fn latex_of_the_paper_model_is_stable() {
    for file in latex::emit(
        &Equations::of(&model("models/paper-2d.json")),
        &PrintOptions::default(),
    )
    .unwrap()
    {
        insta::assert_snapshot!(
            format!("latex__{}", file.path),
            without_version(&file.contents)
        );
    }
}

#[test]
fn latex_of_a_model_with_robot_is_stable() {
    let model = model("tests/fixtures/models/robot-degree-2.json");
    let options = PrintOptions {
        rounding: Rounding::Significant(3),
        numbers: NumberStyle::Siunitx,
        width_em: Some(22.0),
        symbols: SymbolTable::parse(&["z1=x", "z2=theta", "u1=F_x"], 3).unwrap(),
        digest: Some("0123456789abcdef".to_owned()),
        ..PrintOptions::default()
    };
    for file in latex::emit(&Equations::of(&model), &options).unwrap() {
        insta::assert_snapshot!(
            format!("latex__{}", file.path),
            without_version(&file.contents)
        );
    }
}

#[test]
fn latex_in_physical_units_is_stable() {
    let model = model("models/go1-trot-d6.json");
    let physical = Equations::of(&model).in_physical_units().unwrap();
    let options = PrintOptions {
        rounding: Rounding::PHYSICAL,
        width_em: Some(22.0),
        ..PrintOptions::default()
    };
    for file in latex::emit(&physical, &options).unwrap() {
        // All phases; those of one phase are parts of them.
        if !file.path.starts_with("go1_trot_d6_") {
            insta::assert_snapshot!(
                format!("latex__physical__{}", file.path),
                without_version(&file.contents)
            );
        }
    }
}

#[test]
fn latex_of_every_function_is_stable() {
    let model = model("tests/fixtures/models/every-function.json");
    let files = latex::emit(&Equations::as_learned(&model), &PrintOptions::default()).unwrap();
    insta::assert_snapshot!(
        "latex__every_function.tex",
        without_version(&files[0].contents)
    );
}

#[test]
fn markdown_is_stable() {
    for name in [
        "models/paper-2d.json",
        "models/go1-trot-d6.json",
        "tests/fixtures/models/every-function.json",
    ] {
        let files = markdown::emit(
            &Equations::as_learned(&model(name)),
            &PrintOptions::default(),
        )
        .unwrap();
        let name = format!("markdown__{}", files[0].path);
        insta::assert_snapshot!(name, without_version(&files[0].contents));
    }
}

#[test]
fn mathml_is_stable() {
    for name in [
        "models/paper-2d.json",
        "models/go1-trot-d6.json",
        "tests/fixtures/models/every-function.json",
    ] {
        let files = mathml::emit(
            &Equations::as_learned(&model(name)),
            &PrintOptions::default(),
        )
        .unwrap();
        let name = format!("mathml__{}", files[0].path);
        insta::assert_snapshot!(name, without_version(&files[0].contents));
    }
}
