//! The generated C on the processors of robots, emulated.

use std::fs;
use std::path::Path;
use std::process::Command;

use romc::codegen::Precision;

use crate::emitted::Emitted;
use crate::programs::{root, shipped, succeed};
use crate::tools::has;

/// Size of the sections that a linked or compiled file puts into code and into memory, bytes.
fn sections(size: &str, file: &Path) -> (usize, usize) {
    let output = succeed(Command::new(size).arg(file));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let numbers: Vec<usize> = (text.lines().nth(1).expect("a line").split_whitespace())
        .take(3)
        .map(|word| word.parse().expect("a number"))
        .collect();
    (numbers[0] + numbers[1], numbers[1] + numbers[2])
}

#[test]
fn self_test_passes_on_a_cortex_m7_within_its_code_and_memory() {
    if !has("arm-none-eabi-gcc") || !has("qemu-system-arm") {
        return;
    }
    let board = root().join("tests/controller_c/cortex_m7");
    let script = format!("-T{}", board.join("link.ld").display());
    let startup = board.join("startup.c");
    for (precision, most_code, most_state) in [
        (Precision::Single, 80_000, 48_000),
        (Precision::Double, 96_000, 96_000),
    ] {
        let emitted = Emitted::new(&shipped("go1-d4"), precision);
        let name = &emitted.name;
        let machine = [
            "-std=c99",
            "-O2",
            "-ffp-contract=off",
            "-mcpu=cortex-m7",
            "-mfpu=fpv5-d16",
            "-mfloat-abi=hard",
            "-mthumb",
        ];
        let sources = [format!("{name}_controller.c"), format!("{name}.c")];
        let mut code = 0;
        for source in &sources {
            let object = emitted.folder().join(format!("{source}.o"));
            succeed(
                Command::new("arm-none-eabi-gcc")
                    .args(machine)
                    .args(["-c", source, "-o"])
                    .arg(&object)
                    .current_dir(emitted.folder()),
            );
            code += sections("arm-none-eabi-size", &object).0;
        }
        let state = emitted.folder().join("state.c");
        let bytes = format!("{}_CONTROLLER_BYTES", name.to_ascii_uppercase());
        let text = format!("#include \"{name}_controller.h\"\nchar state[{bytes}];\n");
        fs::write(&state, text).expect("written");
        let object = emitted.folder().join("state.o");
        succeed(
            Command::new("arm-none-eabi-gcc")
                .args(machine)
                .args(["-c", "state.c", "-o"])
                .arg(&object)
                .current_dir(emitted.folder()),
        );
        let state = sections("arm-none-eabi-size", &object).1;
        println!("{precision:?}: {code} bytes of code, {state} of state");
        assert!(code <= most_code && state <= most_state, "{code} {state}");
        for program in ["controller_selftest", "selftest"] {
            let image = emitted.scratch.path().join("image");
            succeed(
                Command::new("arm-none-eabi-gcc")
                    .args(machine)
                    .args(["-nostartfiles", "--specs=rdimon.specs", &script])
                    .arg(&startup)
                    .args(&sources)
                    .arg(format!("{name}_{program}.c"))
                    .args(["-lm", "-o"])
                    .arg(&image)
                    .current_dir(emitted.folder()),
            );
            let output = succeed(
                Command::new("qemu-system-arm")
                    .args(["-M", "mps2-an500", "-nographic", "-semihosting", "-kernel"])
                    .arg(&image),
            );
            println!("{}", String::from_utf8_lossy(&output.stdout));
        }
    }
}

#[test]
fn self_test_passes_on_aarch64() {
    if !has("aarch64-linux-gnu-gcc") || !has("qemu-aarch64-static") {
        return;
    }
    for precision in [Precision::Single, Precision::Double] {
        let emitted = Emitted::new(&shipped("go1-d4"), precision);
        let test = format!("{}_controller_selftest.c", emitted.name);
        let program = emitted.program("aarch64-linux-gnu-gcc", &["-static"], &test);
        let output = succeed(Command::new("qemu-aarch64-static").arg(program));
        println!("{precision:?}: {}", String::from_utf8_lossy(&output.stdout));
    }
}
