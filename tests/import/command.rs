//! `romc import` from outside: exit codes, output, files.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use romc::artifact;

const EQUATIONS: &str = "[contact]\nddz1 = 0.5 - 2*z1 + u1\n[flight]\nddz1 = -1\n";

fn romc(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_romc"))
        .current_dir(folder)
        .args(arguments)
        .output()
        .expect("the binary runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn command_writes_a_model_and_tells_what_it_read() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("hopper.txt"), EQUATIONS).expect("writable");
    let arguments = ["import", "hopper.txt", "--output", "hopper.json"];
    let first = romc(folder.path(), &arguments);
    assert!(first.status.success(), "{}", text(&first.stderr));
    let said = text(&first.stdout);
    assert!(
        said.contains("note: phase flight holds for feet `none`"),
        "{said}"
    );
    assert!(said.ends_with("hopper.json: model `hopper`\n"), "{said}");
    let model = artifact::read(&folder.path().join("hopper.json")).expect("a model file");
    assert_eq!(model.phases()[0].xi.as_slice(), [0.5, -2.0, 1.0]);

    let again = romc(folder.path(), &arguments);
    assert_eq!(again.status.code(), Some(1));
    assert!(
        text(&again.stderr).contains("--force"),
        "{}",
        text(&again.stderr)
    );
    let forced = romc(
        folder.path(),
        &[&arguments[..], &["--force", "--json"]].concat(),
    );
    assert!(forced.status.success());
    let answer: serde_json::Value = serde_json::from_slice(&forced.stdout).expect("one object");
    assert_eq!(answer["command"], "import");
    assert_eq!(answer["report"]["equations"][0]["terms"], 3);
}

#[test]
fn command_that_fails_leaves_no_file() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("bad.txt"), "[contact]\nddz1 = 2*zz\n").expect("writable");
    let failed = romc(
        folder.path(),
        &["import", "bad.txt", "--output", "bad.json"],
    );
    assert_eq!(failed.status.code(), Some(1));
    assert!(failed.stdout.is_empty());
    let said = text(&failed.stderr);
    assert!(said.contains("bad.txt:2:10: found `zz`"), "{said}");
    let left = fs::read_dir(folder.path()).expect("readable").count();
    assert_eq!(left, 1, "only the file to import");
}

#[test]
fn command_with_wrong_usage_ends_with_two() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for wrong in [
        ["--map", "foo=bar"],
        ["--phase", "contact"],
        ["--library", "degree=x"],
        ["--input-scaling", "0.1"],
    ] {
        let arguments = [&["import", "a.npz", "--output", "a.json"][..], &wrong].concat();
        assert_eq!(
            romc(folder.path(), &arguments).status.code(),
            Some(2),
            "{wrong:?}"
        );
    }
}
