use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;

use super::{Host, HostError, run_in};
use crate::recording::{Recording, read};

fn words(line: &str) -> Vec<OsString> {
    line.split(' ').map(OsString::from).collect()
}

fn jump(name: &str) -> Recording {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let jump = read(&root.join("examples/recordings/go1/test_01.csv.gz")).expect("a recording");
    Recording {
        path: PathBuf::from(name),
        ..jump
    }
}

#[test]
fn training_takes_recordings_of_the_host_and_leaves_the_model_there() {
    let host = Arc::new(Host::new(Arc::new([jump("one"), jump("two")]), None));
    let line = "romc train --latent-dim 2 --seed 5 --output none/in-memory.json -- one two";
    let answer = run_in(&host, words(line)).expect("a training");
    let model = answer.model.expect("the model");
    assert_eq!((model.name(), model.latent_dim()), ("in-memory", 2));
    assert!(answer.json["report"]["training"]["rollout_z_m"].is_f64());
    assert!(answer.text.contains("latent coordinates from 2 recordings"));
    assert!(answer.notes.iter().any(|note| note.starts_with("--seed: ")));
    assert!(!Path::new("none").exists());
    // Notes of a later command on this thread are its own.
    let again = run_in(&host, words("romc inspect -- two")).expect("an answer");
    assert!(again.notes.is_empty() && again.model.is_none());
    assert_eq!(again.json["files"][0]["file"], "two");
}

#[test]
fn stopped_study_begins_no_training() {
    let host = Arc::new(Host::new(Arc::new([jump("one")]), None));
    host.stop.store(true, Ordering::Relaxed);
    let folder = tempfile::tempdir().expect("a folder");
    let line = "romc study --latent-dims 2 --seeds 3 --out-dir";
    let mut arguments = words(line);
    arguments.extend([folder.path().join("study").into(), "one".into()]);
    let answer = run_in(&host, arguments).expect("an answer");
    assert_eq!(answer.json["missing"].as_array().map(Vec::len), Some(3));
}

#[test]
fn refusals_have_neither_heading_nor_usage() {
    let host = Arc::new(Host::default());
    let refused = |line: &str| run_in(&host, words(line)).expect_err("a refusal");
    let usage = refused("romc train --latent-dim=99 --output m.json a.csv");
    assert!(matches!(usage, HostError::Usage(_)));
    assert_eq!(
        usage.to_string(),
        "invalid value '99' for '--latent-dim <D>': expected a whole number from 1 to 18"
    );
    let failed = refused("romc train --latent-dim=2 --output m.json none.csv");
    assert!(matches!(
        failed,
        HostError::Failed(crate::Error::Recording(_))
    ));
}
