//! The list of commands, and how one entry is run.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use tempfile::TempDir;

use crate::transcript::{Transcript, written};

/// Commands that run one after the other in one folder.
pub struct Entry {
    pub name: String,
    commands: Vec<String>,
}

/// The entries of a list: names at the start of a line, their commands below, indented.
pub fn entries(path: &Path) -> Vec<Entry> {
    let mut entries: Vec<Entry> = Vec::new();
    for line in fs::read_to_string(path)
        .expect("the list of commands")
        .lines()
    {
        match (line.strip_prefix("  "), line.starts_with('#')) {
            (_, true) => {}
            (None, _) => entries.push(Entry {
                name: line.to_owned(),
                commands: Vec::new(),
            }),
            (Some(command), _) => entries
                .last_mut()
                .expect("a name first")
                .commands
                .push(command.to_owned()),
        }
    }
    entries
}

impl Entry {
    /// Runs the commands in a fresh folder; returns their output and files, and the folder.
    pub fn run(&self) -> (Transcript, TempDir) {
        let place = tempfile::tempdir().expect("a temporary folder");
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        for (link, target) in [
            ("models", "models"),
            ("examples", "examples"),
            ("fixtures", "tests/fixtures"),
        ] {
            std::os::unix::fs::symlink(root.join(target), place.path().join(link)).expect("a link");
        }
        fs::create_dir(place.path().join("out")).expect("a folder");
        let mut text = String::new();
        for command in &self.commands {
            let arguments = command
                .split(' ')
                .flat_map(|word| expanded(place.path(), word));
            let mut process = Command::new(env!("CARGO_BIN_EXE_romc"));
            let output = process
                .current_dir(place.path())
                .args(arguments)
                .output()
                .expect("the binary runs");
            writeln!(text, "$ {command}").expect("text");
            for (stream, bytes) in [(1, &output.stdout), (2, &output.stderr)] {
                for line in String::from_utf8_lossy(bytes).lines() {
                    writeln!(text, "{stream} {line}").expect("text");
                }
            }
            writeln!(text, "exit {}", output.status.code().unwrap_or(-1)).expect("text");
        }
        written(place.path(), Path::new("out"), &mut text);
        (Transcript::of(&self.name, &text), place)
    }
}

/// The files that match a word with `*` or `[..]` in its last part, in order; the word itself if it has neither.
fn expanded(place: &Path, word: &str) -> Vec<String> {
    let Some((folder, pattern)) = word
        .rsplit_once('/')
        .filter(|(_, pattern)| pattern.contains(['*', '[']))
    else {
        return vec![word.to_owned()];
    };
    let listed = fs::read_dir(place.join(folder)).expect("a folder of recordings");
    let names = listed.map(|entry| {
        entry
            .expect("an entry")
            .file_name()
            .into_string()
            .expect("UTF-8")
    });
    let mut files: Vec<String> = names
        .filter(|name| matches(pattern.as_bytes(), name.as_bytes()))
        .map(|name| {
            PathBuf::from(folder)
                .join(name)
                .to_str()
                .expect("UTF-8")
                .to_owned()
        })
        .collect();
    files.sort();
    assert!(!files.is_empty(), "{word} matches no file");
    files
}

fn matches(pattern: &[u8], name: &[u8]) -> bool {
    match (pattern, name) {
        ([], []) => true,
        ([b'*', rest @ ..], _) => (0..=name.len()).any(|skipped| matches(rest, &name[skipped..])),
        ([b'[', set @ ..], [first, others @ ..]) => {
            let end = set
                .iter()
                .position(|byte| *byte == b']')
                .expect("a closed set");
            set[..end].contains(first) && matches(&set[end + 1..], others)
        }
        ([byte, rest @ ..], [first, others @ ..]) => byte == first && matches(rest, others),
        _ => false,
    }
}
