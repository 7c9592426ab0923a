//! Output and files of commands, compared with a recording of an earlier version (`behaviour/recorded.txt.gz`).
//!
//! Numbers must agree to the last printed digit, emitted C by its values (the recorded self-tests pass with the code of
//! today), texts but for the pairs in `behaviour/changed.txt`. `ROMC_RECORD=1` records anew; tokens that differ
//! between three runs, such as times, are recorded as `~`, which agrees with any token.

#[path = "behaviour/commands.rs"]
mod commands;
#[path = "tools/mod.rs"]
mod tools;
#[path = "behaviour/transcript.rs"]
mod transcript;

use std::fs;
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use commands::{Entry, entries};
use transcript::{Transcript, changed, read_recorded, self_tests_pass, write_recorded};

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/behaviour")
}

/// Applies `work` to all entries on two threads; results in the order of the entries.
fn for_all<T: Send>(entries: &[Entry], work: impl Fn(&Entry) -> T + Sync) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let results = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                while let Some((index, entry)) = {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    entries.get(index).map(|entry| (index, entry))
                } {
                    let result = work(entry);
                    results.lock().expect("no panic").push((index, result));
                }
            });
        }
    });
    let mut results = results.into_inner().expect("no panic");
    results.sort_by_key(|(index, _)| *index);
    results.into_iter().map(|(_, result)| result).collect()
}

#[test]
fn commands_print_and_write_what_they_did() {
    let path = folder().join("recorded.txt.gz");
    let mut entries = entries(&folder().join("commands.txt"));
    let wanted = std::env::var("ROMC_COMMANDS").unwrap_or_default();
    if std::env::var("ROMC_RECORD").is_ok() {
        let mut recorded = read_recorded(&path);
        entries.retain(|entry| entry.name.contains(&wanted));
        let anew = for_all(&entries, |entry| {
            let [first, second, third] = [(); 3].map(|()| entry.run().0);
            first.masked(&second).masked(&third)
        });
        recorded.extend(anew.into_iter().map(|entry| (entry.name.clone(), entry)));
        return write_recorded(&path, recorded.values());
    }
    let recorded = read_recorded(&path);
    let pairs = changed(&folder().join("changed.txt"));
    if !wanted.is_empty() {
        entries.retain(|entry| entry.name.contains(&wanted));
    } else if !tools::is_thorough() {
        // The test command stays within minutes: trainings, studies, plans and pages run where everything is asked for.
        const LONG: [&str; 6] = ["train", "study", "plan", "report", "demo", "compile-plan"];
        entries.retain(|entry| !LONG.iter().any(|long| entry.name.starts_with(long)));
        entries = entries.into_iter().step_by(12).collect();
    }
    let differences = for_all(&entries, |entry| {
        let before = recorded.get(&entry.name);
        let Some(before) = before else {
            return vec![format!("{} is not recorded", entry.name)];
        };
        let (now, place) = entry.run();
        let mut differences = before.differences(&now, &pairs);
        differences.extend(self_tests_pass(before, place.path()));
        differences
    })
    .concat();
    assert!(
        differences.is_empty(),
        "{} differences:\n{}",
        differences.len(),
        differences.join("\n")
    );
}

#[test]
fn a_changed_digit_a_word_and_a_missing_file_are_differences() {
    let before = Transcript::of(
        "name",
        "$ a\n1 mass 12.74 kg\n1 step ~ us\nexit 0\nfile out/a.csv",
    );
    let same = |text: &str| {
        before
            .differences(&Transcript::of("name", text), &[])
            .is_empty()
    };
    assert!(same(
        "$ a\n1 mass  12.74 kg\n1 step 17 us\nexit 0\nfile out/a.csv"
    ));
    assert!(!same(
        "$ a\n1 mass 12.75 kg\n1 step 17 us\nexit 0\nfile out/a.csv"
    ));
    assert!(!same(
        "$ a\n1 weight 12.74 kg\n1 step 17 us\nexit 0\nfile out/a.csv"
    ));
    assert!(!same(
        "$ a\n1 mass 12.74 kg\n1 step 17 us\nexit 1\nfile out/a.csv"
    ));
    assert!(!same("$ a\n1 mass 12.74 kg\n1 step 17 us\nexit 0"));
    let pairs = [("mass".to_owned(), "weight".to_owned())];
    let renamed = Transcript::of(
        "name",
        "$ a\n1 weight 12.74 kg\n1 step 17 us\nexit 0\nfile out/a.csv",
    );
    assert!(before.differences(&renamed, &pairs).is_empty());
}

#[test]
fn at_most_forty_texts_have_changed() {
    assert!(changed(&folder().join("changed.txt")).len() <= 40);
    assert!(entries(&folder().join("commands.txt")).len() >= 200);
    let _ = fs::metadata(folder().join("recorded.txt.gz")).expect("recorded");
}
