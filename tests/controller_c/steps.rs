//! The C of the controller's own steps is generated from their Rust: a change of the Rust changes commands.

use std::fs;
use std::path::Path;
use std::process::Command;

use romc_translate::controller;

use crate::emitted::Emitted;
use crate::programs::{root, shipped, succeed};
use crate::{Rates, replay_file};

/// Copies the sources of the C, with one piece of text changed in one file.
fn copy_changed(to: &Path, file: &str, from: &str, changed: &str) {
    for folder in [
        "src/control/solver",
        "src/control/online",
        "src/robot",
        "templates/controller_c",
    ] {
        fs::create_dir_all(to.join(folder)).expect("a folder");
        for entry in fs::read_dir(root().join(folder)).expect("sources") {
            let path = entry.expect("an entry").path();
            if path.is_file() {
                let name = path.file_name().expect("a file");
                fs::copy(&path, to.join(folder).join(name)).expect("copied");
            }
        }
    }
    let path = to.join(file);
    let text = fs::read_to_string(&path).expect("a source");
    assert_eq!(text.matches(from).count(), 1, "`{from}` in {file}");
    fs::write(&path, text.replace(from, changed)).expect("written");
}

/// The C generated with one piece of text changed in one file, as paths and texts.
pub(crate) fn made_of_changed(
    file: &str,
    from: &str,
    changed: &str,
) -> [(&'static str, String); 6] {
    let copy = tempfile::tempdir().expect("a folder");
    copy_changed(copy.path(), file, from, changed);
    controller(copy.path()).expect("in the subset")
}

/// Lines of the committed C and their replacements after a change.
fn changed_lines(file: &str, from: &str, changed: &str) -> Vec<(String, String)> {
    let mut pairs = Vec::new();
    for (path, text) in made_of_changed(file, from, changed) {
        let committed = fs::read_to_string(root().join(path)).expect("committed");
        let lines = committed.lines().zip(text.lines());
        pairs.extend(
            lines
                .filter(|(old, new)| old != new)
                .map(|(old, new)| (old.to_owned(), new.to_owned())),
        );
    }
    pairs
}

#[test]
fn changes_of_the_steps_in_rust_change_the_commands_of_the_c() {
    let model = shipped("go1-d2");
    let emitted = Emitted::with_library_sines(&model);
    let source = emitted
        .folder()
        .join(format!("{}_controller.c", emitted.name));
    let original = fs::read_to_string(&source).expect("emitted");
    let steps = emitted.scratch.path().join("steps");
    let (bytes, ..) = replay_file(&model, 1200, 1, Rates::Free);
    fs::write(&steps, bytes).expect("written");
    let replay = root().join("tests/controller_c/replay.c");
    let replay = replay.to_str().expect("UTF-8");
    succeed(Command::new(emitted.program("cc", &[], replay)).arg(&steps));
    for (number, (file, from, changed)) in [
        (
            "plan.rs",
            "POSTURE_LEAD: f64 = 0.4",
            "POSTURE_LEAD: f64 = 0.3",
        ),
        (
            "command.rs",
            "self.disbelieved >= patience",
            "self.disbelieved < patience",
        ),
        (
            "command.rs",
            "self.feed_forward_nm[i] *= fade",
            "self.feed_forward_nm[i] *= fade * fade",
        ),
        (
            "effectiveness.rs",
            "PRIOR_WEIGHT: Real = 10.0",
            "PRIOR_WEIGHT: Real = 9.0",
        ),
    ]
    .into_iter()
    .enumerate()
    {
        let lines = changed_lines(&format!("src/control/online/{file}"), from, changed);
        let [(old, new)] = lines.as_slice() else {
            panic!("`{changed}` changes {lines:?}");
        };
        assert_eq!(original.matches(old.as_str()).count(), 1, "{old}");
        fs::write(&source, original.replace(old.as_str(), new)).expect("written");
        // Another flag gives another object.
        let program = emitted.program("cc", &[&format!("-DCHANGE={number}")], replay);
        let output = Command::new(program).arg(&steps).output().expect("it runs");
        let text = String::from_utf8_lossy(&output.stdout);
        let counts = text
            .split_once(" different")
            .map(|(before, _)| before.rsplit(' ').next());
        let different: usize = counts
            .flatten()
            .and_then(|count| count.parse().ok())
            .unwrap_or_else(|| panic!("`{changed}`: {}, no count: {text}", output.status));
        assert!(different > 0, "`{changed}` changes no command: {text}");
    }
}
