//! Generated code under sanitizers and valgrind, and checked by static analysers.

use std::path::PathBuf;
use std::process::Command;

use romc::codegen::Precision;
use romc::lower::Form;
use romc::model::ReducedModel;

use super::drivers::{Build, Workshop, contents, succeed};
use super::tools::has;
use super::{Case, SOME_MODELS, check_all, models, some_shipped};

/// Builds with sanitizers and under valgrind, if this machine has them.
fn memory_checkers() -> Vec<Build> {
    Build::sanitized()
        .into_iter()
        .chain(Build::valgrind())
        .collect()
}

#[test]
fn sanitizers_and_valgrind_are_silent_on_generated_functions() {
    let random: Vec<ReducedModel> = (0..SOME_MODELS / 3).map(models::random).collect();
    let cases = [
        Case::new(some_shipped(3), 20, Form::Automatic),
        Case::new(
            (1000..1000 + SOME_MODELS / 4).map(models::random).collect(),
            20,
            Form::Tables,
        ),
        Case::new(
            (0..2).map(models::random_nonlinear).collect(),
            20,
            Form::Automatic,
        ),
        Case::new(random, 20, Form::Automatic),
    ];
    check_all("memory", &cases, |_| memory_checkers());
}

#[test]
fn sanitizers_and_valgrind_are_silent_on_selftests() {
    let models = models::shipped();
    let form = Form::default();
    let double = Workshop::new(&models, form);
    let single = Workshop::in_precision(&models, form, Precision::Single);
    let runs = [
        (&double, Build::sanitized(), 0),
        (&single, Build::sanitized(), 1),
        (&double, Build::valgrind(), 2),
    ];
    // Each model in one of the runs.
    for (workshop, build, first) in runs {
        let Some(build) = build else { continue };
        for model in models.iter().skip(first).step_by(3) {
            workshop.run_c_selftest(&build, model.identifier().as_str());
        }
    }
}

/// Folders with generated code of every kind: both precisions, lines and tables, layers.
fn emitted() -> Vec<Workshop> {
    let mut random: Vec<ReducedModel> = (0..SOME_MODELS / 4).map(models::random).collect();
    random.extend((0..2).map(models::random_nonlinear));
    let tables = Form::Tables;
    let automatic = Form::default();
    vec![
        Workshop::new(&some_shipped(2), automatic),
        Workshop::in_precision(&some_shipped(3), automatic, Precision::Single),
        Workshop::new(&random, tables),
    ]
}

/// Emitted files whose name has this ending.
fn files(workshops: &[Workshop], ending: &str) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for workshop in workshops {
        let all = contents(workshop.path()).into_iter();
        let paths = all.map(|(path, _)| workshop.path().join(path));
        files.extend(paths.filter(|path| path.to_string_lossy().ends_with(ending)));
    }
    assert!(files.len() >= 20, "{ending}: {} files", files.len());
    files
}

#[test]
fn clang_tidy_finds_nothing_bugprone_in_generated_c() {
    if !has("clang-tidy") {
        return;
    }
    // Functions have the adjacent arguments z, dz and u_lat: swappable arguments cannot be avoided.
    let checks = "-*,bugprone-*,clang-analyzer-*,-bugprone-easily-swappable-parameters";
    let workshops = emitted();
    succeed(
        Command::new("clang-tidy")
            .args(["--quiet", "--warnings-as-errors=*"])
            .arg(format!("--checks={checks}"))
            .args(files(&workshops, ".c"))
            .args(["--", "-std=c99"]),
    );
}

#[test]
fn cppcheck_finds_nothing_in_generated_c() {
    if !has("cppcheck") {
        return;
    }
    let workshops = emitted();
    succeed(
        Command::new("cppcheck")
            .args(["--std=c99", "--quiet", "--error-exitcode=1"])
            .arg("--enable=warning,style,performance,portability")
            // log(1 + x) is a term of the model, with the interpreter's rounding.
            .arg("--suppress=unpreciseMathCall")
            .args(files(&workshops, ".c")),
    );
}

#[test]
fn clippy_finds_nothing_in_generated_rust() {
    if !has("clippy-driver") {
        return;
    }
    let workshops = emitted();
    let folder = tempfile::tempdir().expect("a temporary folder");
    for file in files(&workshops, "src/lib.rs") {
        succeed(
            Command::new("clippy-driver")
                .args(["--edition", "2021", "--crate-type", "lib"])
                .args(["--crate-name", "generated", "--emit", "metadata"])
                .args(["--check-cfg", "cfg(feature, values(\"std\", \"libm\"))"])
                .args(["--check-cfg", "cfg(test)", "--cfg", "feature=\"std\""])
                .args(["-D", "warnings", "-D", "clippy::all"])
                .args(["-D", "clippy::pedantic"])
                .args(SPELLING)
                .arg(&file)
                .arg("-o")
                .arg(folder.path().join("generated.rmeta")),
        );
    }
}

/// Pedantic lints about names, digits and length: names and lengths come from the model, digits are the shortest that
/// read back, inlining was measured.
const SPELLING: [&str; 12] = [
    "-A",
    "clippy::doc_markdown",
    "-A",
    "clippy::inline_always",
    "-A",
    "clippy::many_single_char_names",
    "-A",
    "clippy::similar_names",
    "-A",
    "clippy::too_many_lines",
    "-A",
    "clippy::unreadable_literal",
];
