//! The generated C on emulated processors of robots.

use std::fs;
use std::path::Path;
use std::process::Command;

use romc::codegen::Precision;

use crate::emitted::Emitted;
use crate::programs::{root, shipped, succeed};
use crate::tools::has;

/// Section sizes of a linked or compiled file: code and memory, bytes.
fn sections(size: &str, file: &Path) -> (usize, usize) {
    let output = succeed(Command::new(size).arg(file));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let numbers: Vec<usize> = (text.lines().nth(1).expect("a line").split_whitespace())
        .take(3)
        .map(|word| word.parse().expect("a number"))
        .collect();
    (numbers[0] + numbers[1], numbers[1] + numbers[2])
}

/// Compiler of the board, with the options common to all files.
const MACHINE: [&str; 8] = [
    "arm-none-eabi-gcc",
    "-std=c99",
    "-O2",
    "-ffp-contract=off",
    "-mcpu=cortex-m7",
    "-mfpu=fpv5-d16",
    "-mfloat-abi=hard",
    "-mthumb",
];

/// Output of a program of a generated folder on the emulated board, and whether it succeeds.
fn on_board(emitted: &Emitted, program: &str, flags: &[&str], qemu: &[&str]) -> (String, bool) {
    let board = root().join("tests/controller_c/cortex_m7");
    let (name, image) = (&emitted.name, emitted.scratch.path().join("image"));
    succeed(
        Command::new(MACHINE[0])
            .args(&MACHINE[1..])
            .args(["-nostartfiles", "--specs=rdimon.specs"])
            .arg(format!("-T{}", board.join("link.ld").display()))
            .args(flags)
            .args([board.join("startup.c"), board.join("clock.c")])
            .args(["_controller.c", ".c", program].map(|end| format!("{name}{end}")))
            .args(["-lm", "-o"])
            .arg(&image)
            .current_dir(emitted.folder()),
    );
    let output = Command::new("qemu-system-arm")
        .args(["-M", "mps2-an500", "-nographic", "-semihosting"])
        .args(qemu)
        .arg("-kernel")
        .arg(&image)
        .output()
        .expect("an emulator");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    println!("{text}");
    (text, output.status.success())
}

#[test]
fn cap_for_a_time_holds_on_a_cortex_m7_and_grows_with_the_time() {
    if !has("arm-none-eabi-gcc") || !has("qemu-system-arm") {
        return;
    }
    let emitted = Emitted::new(&shipped("go1-d2"), Precision::Single);
    // Thousands of instructions instead of microseconds, so the result does not depend on this machine.
    let budget = |thousands: f64| {
        let flag = format!("-DGO1_D2_BUDGET_US={thousands}");
        let flags = ["-DGO1_D2_CLOCK_US=clock_us", "-DGO1_D2_REPEATS=1", &flag];
        on_board(&emitted, "_budget.c", &flags, &["-icount", "shift=0"])
    };
    let (text, has_cap) = budget(100.0);
    assert!(!has_cap && text.matches("no iteration fits").count() == 2);
    let caps = [1000.0, 2000.0].map(|most| {
        let (text, has_cap) = budget(most);
        assert!(has_cap);
        let lines: Vec<Vec<f64>> = (text.lines())
            .map(|line| {
                line.split([' ', ':', ';'])
                    .filter_map(|word| word.parse().ok())
                    .collect()
            })
            .collect();
        let [plain, prepared] = [0, 1].map(|line| {
            let [step, iteration, cap, worst, _, longest, iterations] = lines[line][..] else {
                panic!("other numbers: {text}");
            };
            assert!(step + iteration <= worst && worst <= most && most < worst + iteration);
            assert!(longest <= worst && iterations <= cap, "{text}");
            (cap, iterations)
        });
        assert!(plain.0 < prepared.0, "prepare saves nothing: {text}");
        plain
    });
    let [(less, reached), (more, _)] = caps;
    assert!(less == reached && less < more, "{caps:?}");
}

#[test]
fn self_test_passes_on_a_cortex_m7_within_its_code_and_memory() {
    if !has("arm-none-eabi-gcc") || !has("qemu-system-arm") {
        return;
    }
    for (precision, most_code, most_state) in [
        (Precision::Single, 83_000, 48_000),
        (Precision::Double, 96_000, 96_000),
    ] {
        let emitted = Emitted::new(&shipped("go1-d4"), precision);
        let name = &emitted.name;
        let sources = [format!("{name}_controller.c"), format!("{name}.c")];
        let mut code = 0;
        for source in &sources {
            let object = emitted.folder().join(format!("{source}.o"));
            succeed(
                Command::new(MACHINE[0])
                    .args(&MACHINE[1..])
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
            Command::new(MACHINE[0])
                .args(&MACHINE[1..])
                .args(["-c", "state.c", "-o"])
                .arg(&object)
                .current_dir(emitted.folder()),
        );
        let state = sections("arm-none-eabi-size", &object).1;
        println!("{precision:?}: {code} bytes of code, {state} of state");
        assert!(code <= most_code && state <= most_state, "{code} {state}");
        for program in ["_controller_selftest.c", "_selftest.c"] {
            assert!(on_board(&emitted, program, &[], &[]).1);
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
