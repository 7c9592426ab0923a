//! The generated C under sanitizers, valgrind, analysers, other compilers and from C++.

use std::fs;
use std::process::Command;

use romc::codegen::Precision;
use romc::robot::WrenchFrame;

use crate::emitted::Emitted;
use crate::programs::{shipped, succeed};
use crate::tools::{has, has_compiler_with, is_there};
use crate::without_given_state;

#[test]
fn self_tests_and_example_pass_in_both_precisions_with_sanitizers() {
    for (model, precision, macros) in [
        ("go1-d2", Precision::Double, "-DGO1_D2_TORQUE_RATES=0"),
        ("go1-d4", Precision::Single, "-DGO1_D4_TORQUE_RATES=1"),
    ] {
        let emitted = Emitted::new(&shipped(model), precision);
        let sanitize = [
            macros,
            "-g",
            "-O1",
            "-fsanitize=address,undefined",
            "-fno-sanitize-recover=all",
        ];
        if !has_compiler_with("cc", &sanitize) {
            return;
        }
        for program in ["controller_selftest", "selftest", "example"] {
            let source = format!("{}_{program}.c", emitted.name);
            let built = emitted.program("cc", &sanitize, &source);
            println!(
                "{model} {precision:?}: {}",
                Emitted::output(&mut Command::new(built))
            );
        }
    }
}

#[test]
fn self_tests_pass_under_clang_and_valgrind() {
    for (model, precision) in [
        ("go1-d2", Precision::Double),
        ("go1-d4", Precision::Double),
        ("go1-d6", Precision::Single),
    ] {
        let emitted = Emitted::new(&shipped(model), precision);
        let source = format!("{}_controller_selftest.c", emitted.name);
        if has("clang") {
            let built = emitted.program("clang", &[], &source);
            println!(
                "{model} {precision:?}: {}",
                Emitted::output(&mut Command::new(built))
            );
        }
        if model == "go1-d2" && has("valgrind") {
            let built = emitted.program("cc", &["-g"], &source);
            let quiet = ["-q", "--error-exitcode=9", "--track-origins=yes"];
            succeed(Command::new("valgrind").args(quiet).arg(built));
        }
    }
}

#[test]
fn self_tests_pass_without_the_consistent_lift() {
    let imported = without_given_state("go1-d4");
    let world = shipped("go1-d4")
        .into_builder()
        .wrench_frame(WrenchFrame::World);
    let world = world.build().expect("a sound model");
    for (model, precision) in [(imported, Precision::Single), (world, Precision::Double)] {
        let emitted = Emitted::new(&model, precision);
        let upper = emitted.name.to_ascii_uppercase();
        let without = ["CONSISTENT_LIFT", "MACHINE"].map(|part| format!("-D{upper}_{part}=0"));
        let source = format!("{}_controller_selftest.c", emitted.name);
        for compiler in ["cc", "clang"]
            .into_iter()
            .filter(|compiler| *compiler == "cc" || has(compiler))
        {
            let built = emitted.program(compiler, &[&without[0], &without[1]], &source);
            let text = Emitted::output(&mut Command::new(built));
            assert!(
                text.contains("transpose lift") && !text.contains("consistent"),
                "{text}"
            );
        }
    }
}

#[test]
fn analysers_find_nothing() {
    let emitted = Emitted::new(&shipped("go1-d2"), Precision::Double);
    let name = &emitted.name;
    let sources = [
        "_controller.c",
        "_example.c",
        "_budget.c",
        "_controller_selftest.c",
    ];
    let sources = sources.map(|end| format!("{name}{end}"));
    if has("clang-tidy") {
        // Vectors of one length are adjacent arguments; indices are small (stages by rows); a solver without links, or
        // without rows on the state, does not read all values prepared for it.
        let checks = "-*,bugprone-*,clang-analyzer-*,-bugprone-easily-swappable-parameters,\
            -bugprone-implicit-widening-of-multiplication-result,-clang-analyzer-deadcode.DeadStores";
        succeed(
            Command::new("clang-tidy")
                .args(["--quiet", "--warnings-as-errors=*"])
                .arg(format!("--checks={checks}"))
                .args(&sources[..2])
                .args(["--", "-std=c99"])
                .current_dir(emitted.folder()),
        );
    }
    if has("cppcheck") {
        succeed(
            Command::new("cppcheck")
                .args(["--std=c99", "--quiet", "--error-exitcode=1"])
                .arg("--enable=warning,performance,portability")
                // It reports arrays filled by memcpy as uninitialised.
                .arg("--suppress=ctuArrayIndex")
                .args(&sources)
                .current_dir(emitted.folder()),
        );
    }
}

#[test]
fn headers_are_clean_in_cpp() {
    if !is_there("c++") {
        return;
    }
    let emitted = Emitted::new(&shipped("go1-d6"), Precision::Single);
    let name = &emitted.name;
    let caller = format!(
        "#include \"{name}_controller.h\"\n#include \"{name}_robot.h\"\n#include \"{name}_log.h\"\n\
         static int put(void *, const char *, size_t) {{ return 0; }}\n\
         int main() {{ static {name}_controller c; static {name}_log_row rows[2]; {name}_log log;\n\
         {name}_command command = {{}}; {name}_log_init(&log, rows, 2);\n\
         {name}_log_add(&log, 0, nullptr, nullptr, nullptr, &command);\n\
         return {name}_log_write(&log, put, nullptr) + {name}_controller_init(&c, nullptr); }}\n"
    );
    fs::write(emitted.folder().join("caller.cpp"), caller).expect("written");
    let strict = ["-Wall", "-Wextra", "-pedantic", "-Werror"];
    let program = emitted.scratch.path().join("caller");
    succeed(
        Command::new("c++")
            .arg("-std=c++11")
            .args(strict)
            .arg("caller.cpp")
            .args(emitted.objects("cc", &[]))
            .args(["-lm", "-o"])
            .arg(&program)
            .current_dir(emitted.folder()),
    );
    succeed(&mut Command::new(program));
}
