//! The generated plugin of ros2_control, built and driven on stubs of ROS, and by the ament and pluginlib of Debian.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use romc::codegen::Precision;

use crate::emitted::Emitted;
use crate::programs::{WARNINGS, root, shipped, succeed};
use crate::tools::{has, has_compiler_with, is_asked_for};

fn stubs() -> PathBuf {
    root().join("tests/controller_c/ros2")
}

/// The plugin, one of its drivers and the controller as one program, all with the same macros.
fn drive(
    emitted: &Emitted,
    driver: &str,
    compiler: &str,
    flags: &[&str],
    macros: &[&str],
) -> PathBuf {
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
            .arg(format!("-I{}", stubs().join("alone").display()))
            .args(["-I..", "-Isrc", "src/controller.cpp", "src/plan.cpp"])
            .arg(stubs().join(driver))
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
    let program = drive(&emitted, "drive.cpp", compiler, flags, macros);
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
fn plugin_walks_by_commands_as_the_state_machine_does() {
    if !has_compiler_with("c++", &SANITIZE) {
        return;
    }
    let emitted = Emitted::new(&shipped("go1-trot-d6"), Precision::Double);
    let program = drive(&emitted, "drive_walk.cpp", "c++", &SANITIZE, &[]);
    println!("{}", Emitted::output(&mut Command::new(program)));
}

/// Debian's ament and pluginlib, which are those of ROS 2.
fn has_ament() -> bool {
    let mut probe = Command::new("dpkg-query");
    probe.args(["-s", "ament-cmake", "pluginlib-dev"]);
    has("cmake") && has("c++") && is_asked_for("ament_cmake and pluginlib", &mut probe)
}

/// Runs cmake on a project: finds packages in the stubs and the prefix, for what Debian's ament needs its own Python.
fn build(project: &Path, build: &Path, prefix: &Path, definitions: &[String]) {
    let (stubs, prefix) = (stubs(), prefix.display());
    let mut configure = Command::new("cmake");
    configure.arg("-S").arg(project).arg("-B").arg(build);
    configure.arg("-DPython3_EXECUTABLE=/usr/bin/python3");
    configure.arg(format!("-DCMAKE_PREFIX_PATH={};{prefix}", stubs.display()));
    configure.arg(format!("-DCMAKE_INSTALL_PREFIX={prefix}"));
    configure.arg(format!("-DCMAKE_CXX_FLAGS={}", WARNINGS.join(" ")));
    succeed(configure.args(definitions));
    succeed(Command::new("cmake").arg("--build").arg(build));
}

#[test]
fn package_builds_with_ament_and_pluginlib_loads_and_drives_it() {
    if !has_ament() {
        return;
    }
    for (model, precision) in [
        ("go1-trot-d6", Precision::Single),
        ("go1-d2", Precision::Double),
    ] {
        let emitted = Emitted::new(&shipped(model), precision);
        let name = format!("{}_ros2_control", emitted.name);
        let scratch = emitted.scratch.path();
        let package = emitted.folder().join("ros2_control");
        let (built, prefix) = (scratch.join("build"), scratch.join("prefix"));
        build(&package, &built, &prefix, &[]);
        succeed(Command::new("cmake").arg("--install").arg(&built));
        let index = prefix.join("share/ament_index/resource_index");
        let listed = index
            .join("controller_interface__pluginlib__plugin")
            .join(&name);
        let text = fs::read_to_string(listed).expect("installed");
        assert_eq!(text.trim(), format!("share/{name}/plugin.xml"));
        // The driver has numbers in double precision.
        if precision == Precision::Single {
            continue;
        }
        let definitions = [
            "-DNAME=go1_d2".to_owned(),
            format!("-DPACKAGE={}", package.display()),
        ];
        let driver = scratch.join("driver");
        build(&stubs().join("loaded"), &driver, &prefix, &definitions);
        let places = format!("{}:{}", prefix.display(), stubs().display());
        let mut drive = Command::new(driver.join("drive"));
        let text = Emitted::output(
            drive
                .arg(jump_file(scratch))
                .env("AMENT_PREFIX_PATH", places),
        );
        println!("loaded by pluginlib: {text}");
    }
}
