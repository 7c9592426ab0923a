//! The generated plugin of ros2_control, built and driven on stubs of ROS.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use romc::codegen::Precision;

use crate::emitted::Emitted;
use crate::programs::{WARNINGS, root, shipped, succeed};
use crate::tools::{has, has_compiler_with};

fn stubs() -> PathBuf {
    root().join("tests/controller_c/ros2")
}

/// The plugin, its driver and the controller as one program, all with the same macros.
fn drive(emitted: &Emitted, compiler: &str, flags: &[&str], macros: &[&str]) -> PathBuf {
    let (name, package) = (&emitted.name, emitted.folder().join("ros2_control"));
    let program = emitted.scratch.path().join("drive");
    succeed(
        Command::new(compiler)
            .args(WARNINGS)
            .args(["-std=c++17", "-g", "-O1"])
            .args(flags)
            .args(macros)
            .arg(format!("-DNAME={name}"))
            .arg(format!("-DUPPER={}", name.to_ascii_uppercase()))
            .arg(format!("-DJUMP=\"{name}_jump.h\""))
            .arg(format!("-I{}", stubs().join("include").display()))
            .args(["-I..", "-Isrc", "src/controller.cpp", "src/plan.cpp"])
            .arg(stubs().join("drive.cpp"))
            .args(emitted.objects("cc", macros))
            .args(["-lm", "-o"])
            .arg(&program)
            .current_dir(package),
    );
    program
}

/// A recorded jump as a file that is not packed.
fn jump_file(folder: &Path) -> PathBuf {
    let path = root().join("examples/recordings/go1/test_01.csv.gz");
    let recording = romc::recording::read(&path).expect("a sound recording");
    let file = folder.join("jump.csv");
    romc::recording::write(&file, &recording).expect("written");
    file
}

/// Builds the plugin and drives it along a jump, whatever it does to memory being checked by its driver and `flags`.
fn check_efforts(compiler: &str, flags: &[&str], macros: &[&str]) {
    if !has_compiler_with(compiler, flags) {
        return;
    }
    let emitted = Emitted::new(&shipped("go1-d4"), Precision::Double);
    let jump = jump_file(emitted.scratch.path());
    let program = drive(&emitted, compiler, flags, macros);
    let text = Emitted::output(Command::new(program).arg(&jump));
    println!("{compiler} {flags:?} {macros:?}: {text}");
    let is_consistent = !macros.contains(&TRANSPOSED_LIFT);
    assert_eq!(text.contains("consistent"), is_consistent, "{text}");
}

const SANITIZE: [&str; 2] = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"];
const TRANSPOSED_LIFT: &str = "-DGO1_D4_CONSISTENT_LIFT=0";

#[test]
fn plugin_gives_the_controllers_efforts_without_allocating() {
    check_efforts("c++", &SANITIZE, &[]);
}

#[test]
fn plugin_of_the_older_interface_gives_the_efforts_of_other_choices_without_allocating() {
    let [address, fatal] = SANITIZE;
    let humble = [address, fatal, "-DROMC_STUB_HUMBLE"];
    check_efforts(
        "c++",
        &humble,
        &[TRANSPOSED_LIFT, "-DGO1_D4_TORQUE_RATES=1"],
    );
}

#[test]
fn plugin_gives_the_controllers_efforts_under_clang() {
    check_efforts("clang++", &[], &[]);
}

#[test]
fn package_builds_and_installs_with_cmake_in_both_precisions() {
    if !has("cmake") || !has("c++") {
        return;
    }
    for precision in [Precision::Double, Precision::Single] {
        let emitted = Emitted::new(&shipped("go1-d2"), precision);
        let package = emitted.folder().join("ros2_control");
        let prefix = emitted.scratch.path().join("prefix");
        let run = |arguments: &[&str]| {
            succeed(Command::new("cmake").args(arguments).current_dir(&package));
        };
        let places = [
            format!("-DCMAKE_PREFIX_PATH={}", stubs().display()),
            format!("-DCMAKE_INSTALL_PREFIX={}", prefix.display()),
            format!("-DCMAKE_CXX_FLAGS={}", WARNINGS.join(" ")),
        ];
        let [stubs, installed, warnings] = places.each_ref().map(String::as_str);
        run(&["-S", ".", "-B", "build", stubs, installed, warnings]);
        run(&["--build", "build"]);
        run(&["--install", "build"]);
        let description = prefix.join("share/go1_d2_ros2_control/plugin.xml");
        let text = fs::read_to_string(description).expect("installed");
        assert!(
            text.contains("<library path=\"go1_d2_ros2_control\">"),
            "{text}"
        );
        assert!(prefix.join("lib/libgo1_d2_ros2_control.so").exists());
    }
}
