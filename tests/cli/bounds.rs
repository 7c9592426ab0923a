//! Endless files, and small ones that unpack to a large size, are refused with a place, in little memory.

#![cfg(target_os = "linux")]

use std::fmt::Write as _;
use std::fs;
use std::process::{Command, Output};

use super::{JUMP, MODEL, folder, path, text};

/// Runs with this many megabytes of address space.
fn within(megabytes: usize, arguments: &[&str]) -> Output {
    let script = format!("ulimit -v {} && exec \"$0\" \"$@\"", megabytes * 1024);
    Command::new("sh")
        .args(["-c", &script, env!("CARGO_BIN_EXE_romc")])
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("sh runs")
}

#[test]
fn files_without_end_and_files_of_nothing_but_tables_are_refused_in_little_memory() {
    let folder = folder();
    let at = |name: &str| path(&folder, name);
    let (endless_model, endless_text) = (at("endless.json"), at("endless.txt"));
    for link in [&endless_model, &endless_text, &at("endless.toml")] {
        std::os::unix::fs::symlink("/dev/zero", link).expect("a link");
    }
    let mut tables = "a = ".to_owned();
    for _ in 0..500_000 {
        tables += "[{},";
    }
    let mut dotted = String::new();
    for line in 0..40_000 {
        let _ = writeln!(dotted, "a.b{line}.c.d.e.f.g.h.i.j=0");
    }
    let shipped = fs::read_to_string(MODEL).expect("the shipped model");
    let (first, provenance) = shipped
        .split_once("\"provenance\": {")
        .expect("its last key");
    let values = "[0],".repeat(2_000_000);
    let model = format!("{first}\"provenance\": {{\"a\": [{values}0], {provenance}");
    for (name, contents) in [
        ("tables.toml", &tables),
        ("dotted.toml", &dotted),
        ("m.json", &model),
    ] {
        fs::write(at(name), contents).expect("written");
    }
    let files = ["endless.toml", "tables.toml", "dotted.toml", "m.json"].map(at);
    let [endless, tables, dotted, values] = files.each_ref().map(String::as_str);
    let new = at("new.json");
    let cases: [(&[&str], &str); 12] = [
        (&["inspect", &endless_model], "more than"),
        (&["check", &endless_model, MODEL], "more than"),
        (&["check", &endless_text, MODEL], "more than"),
        (&["check", MODEL, MODEL, "--domain", endless], "more than"),
        (
            &["check", MODEL, MODEL, "--domain", dotted],
            "signs of tables",
        ),
        (&["inspect", JUMP, "--columns", endless], "more than"),
        (&["inspect", JUMP, "--columns", tables], "signs of tables"),
        (&["robot", dotted], "signs of tables"),
        (&["robot", endless], "more than"),
        (
            &["train", JUMP, "--output", &new, "--config", endless],
            "more than",
        ),
        (
            &["train", JUMP, "--output", &new, "--config", dotted],
            "signs of tables",
        ),
        (&["inspect", values], "more than 100000 values"),
    ];
    for (arguments, reason) in cases {
        // The binary of a debug build alone needs a quarter of this.
        let output = within(700, arguments);
        let stderr = text(&output.stderr);
        assert!(
            matches!(output.status.code(), Some(1 | 2)),
            "{arguments:?}: {stderr}"
        );
        assert!(
            stderr.starts_with("error: ") && stderr.contains(reason),
            "{arguments:?}: {stderr}"
        );
    }
}
