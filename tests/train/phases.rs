//! Phases of walks: usual ones by a name, others individually, and patterns of contacts.

use std::path::PathBuf;
use std::process::Command;

use serde_json::Value;

/// Trains on recordings of a folder. Returns the model's phases as `name=feet`, none without a model, and the notes.
fn trained(folder: &str, first: &str, flags: &[&str]) -> (Vec<String>, String) {
    let scratch = tempfile::tempdir().expect("a folder");
    let output = scratch.path().join("m.json");
    let recordings: Vec<PathBuf> = (1..=3)
        .map(|number| {
            let name = format!("examples/recordings/{folder}/{first}_0{number}.csv.gz");
            PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(name)
        })
        .collect();
    let run = Command::new(env!("CARGO_BIN_EXE_romc"))
        .arg("train")
        .args(recordings)
        .args(["--latent-dim", "6", "--body", "all", "--actuators", "none"])
        .args(["--body-equations", "all-phases", "--output"])
        .arg(&output)
        .args(flags)
        .output()
        .expect("romc starts");
    let notes = String::from_utf8(run.stderr).expect("UTF-8");
    if !run.status.success() {
        return (Vec::new(), notes);
    }
    let text = std::fs::read_to_string(&output).expect("a model");
    let model: Value = serde_json::from_str(&text).expect("JSON");
    let command = model["provenance"]["command"].as_str().expect("a command");
    for flag in flags
        .iter()
        .filter_map(|flag| flag.strip_prefix("--phase="))
    {
        assert!(command.contains(&format!(" --phase {flag}")), "{command}");
    }
    let phases = model["phases"].as_array().expect("phases").iter();
    let text = |phase: &Value| {
        let name = phase["name"].as_str().expect("a name");
        format!("{name}={}", phase["feet"])
    };
    (phases.map(text).collect(), notes)
}

const FR_RL: &str = "fr_rl=[[1,0,0,1],[1,0,0,0],[0,0,0,1]]";
const FL_RR: &str = "fl_rr=[[0,1,1,0],[0,1,0,0],[0,0,1,0]]";

#[test]
fn phases_of_a_trot_by_its_name_and_one_by_one_are_the_same() {
    let (by_name, notes) = trained("go1-trot", "train", &["--phases", "trot"]);
    assert_eq!(by_name, [FR_RL, FL_RR, "all=\"any\"", "flight=\"none\""]);
    assert!(!notes.contains("contacts look like"), "{notes}");
    let one_by_one = [
        "--phase=fr_rl=1001,1000,0001",
        "--phase=fl_rr=0110,0100,0010",
        "--phase=all=any",
        "--phase=flight=none",
    ];
    assert_eq!(trained("go1-trot", "train", &one_by_one).0, by_name);
}

#[test]
fn phases_of_a_walk_that_recordings_lack_are_left_out_and_named() {
    for (folder, first, motion, expected, left_out) in [
        (
            "go1-trot-other",
            "trot",
            "trot",
            &["fr_rl", "fl_rr", "all"][..],
            "phase `flight` is left out: 0 samples",
        ),
        (
            "go1-gaits",
            "crawl",
            "crawl",
            &["fr_up", "fl_up", "rr_up", "rl_up", "all"],
            "",
        ),
    ] {
        let (phases, notes) = trained(folder, first, &["--phases", motion]);
        let names: Vec<&str> = phases
            .iter()
            .filter_map(|text| text.split('=').next())
            .collect();
        assert_eq!(names, expected, "{notes}");
        assert!(notes.contains(left_out), "{notes}");
    }
}

#[test]
fn contacts_that_look_like_another_motion_are_noted() {
    for (folder, first, motion) in [
        ("go1", "train", None),
        ("go1-trot", "train", Some("trot")),
        ("go1-trot-other", "trot", Some("trot")),
        ("go1-gaits", "crawl", Some("crawl")),
        ("go1-gaits", "pronk", None),
    ] {
        let (_, notes) = trained(folder, first, &[]);
        let found = notes.split("contacts look like those of `--phases ").nth(1);
        let found = found.and_then(|rest| rest.split('`').next());
        assert_eq!(found, motion, "{folder} {first}: {notes}");
    }
}
