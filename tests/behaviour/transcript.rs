//! Transcripts of commands: output, exit code and written files; and the differences of two transcripts.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::{Read as _, Write as _};
use std::path::Path;
use std::process::Command;

use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;

/// Files whose text is recorded. Of other files the digest of their numbers is recorded, of code only the name.
const TEXTS: [&str; 7] = ["tex", "md", "html", "toml", "txt", "mathml", "json"];
const CODE: [&str; 10] = [
    "c", "h", "rs", "py", "m", "cpp", "hpp", "lock", "yaml", "xml",
];
const LONGEST_TEXT: usize = 40_000;

/// Lines of one entry: `$ command`, output with `1 ` (stdout) or `2 ` (stderr) before it, `exit CODE`, `file PATH` with
/// `| ` before its text.
pub struct Transcript {
    pub name: String,
    lines: Vec<String>,
}

impl Transcript {
    pub fn of(name: &str, text: &str) -> Self {
        let mut is_timed = false;
        let lines = text.lines().map(|line| {
            is_timed = line.ends_with(" us") || is_timed && line.len() > 2;
            without_times(line, is_timed && line.contains(".csv"))
        });
        Self {
            name: name.to_owned(),
            lines: lines.collect(),
        }
    }

    /// The transcript with `~` for each token that differs in a second run.
    pub fn masked(&self, again: &Self) -> Self {
        assert_eq!(
            self.lines.len(),
            again.lines.len(),
            "{}: a second run has other lines",
            self.name
        );
        let lines = self.lines.iter().zip(&again.lines).map(|(first, second)| {
            if first == second {
                return first.clone();
            }
            let (first, second) = (tokens(first), tokens(second));
            // The number of ticks and bars in a drawing of times varies.
            if let [_, _, "numbers", _] = first[..] {
                return "| ~ numbers ~".to_owned();
            }
            assert_eq!(
                first.len(),
                second.len(),
                "{}: {first:?} {second:?}",
                self.name
            );
            let pairs = first.iter().zip(&second);
            pairs
                .map(|(a, b)| if a == b { *a } else { "~" })
                .collect::<Vec<_>>()
                .join(" ")
        });
        Self {
            name: self.name.clone(),
            lines: lines.collect(),
        }
    }

    /// Lines that differ; numbers are compared by their digits, space between tokens is ignored. `pairs` of texts apply
    /// to the recorded lines.
    pub fn differences(&self, now: &Self, pairs: &[(String, String)]) -> Vec<String> {
        let expected: Vec<String> = self.compared().map(|line| renamed(line, pairs)).collect();
        let found: Vec<&str> = now.compared().collect();
        let agree = |a: &str, b: &str| {
            let (a, b) = (tokens(a), tokens(b));
            a.len() == b.len()
                && a.iter()
                    .zip(&b)
                    .all(|(a, b)| a == b || *a == "~" || *b == "~")
        };
        let mut differences: Vec<String> = expected
            .iter()
            .zip(&found)
            .filter(|(a, b)| !agree(a, b))
            .take(6)
            .map(|(a, b)| format!("{}:\n  before {a}\n  now    {b}", self.name))
            .collect();
        if expected.len() != found.len() {
            differences.push(format!(
                "{}: {} lines before, {} now",
                self.name,
                expected.len(),
                found.len()
            ));
        }
        differences
    }

    /// All lines except the texts of self-tests, which are compared by running them, and the names of the controller's
    /// sources copied from romc; emitted code and files of the controller in C without their sizes.
    fn compared(&self) -> impl Iterator<Item = &str> {
        let lines = self.lines.iter().map(String::as_str);
        let lines =
            lines.filter(|line| !line.starts_with("> ") && !line.contains("-controller/src/"));
        lines.map(|line| {
            let name = line.trim_end_matches(|digit: char| digit.is_ascii_digit());
            let ending = name.trim_end().rsplit_once('.').map(|(_, ending)| ending);
            let is_code = ending.is_some_and(|ending| CODE.contains(&ending));
            match is_code || line.contains("-controller-c/") {
                true => name,
                false => line,
            }
        })
    }

    /// Recorded self-tests: path and text.
    fn self_tests(&self) -> Vec<(&str, String)> {
        let mut tests: Vec<(&str, String)> = Vec::new();
        for line in &self.lines {
            if let Some(path) = line
                .strip_prefix("file ")
                .filter(|path| path.ends_with("_selftest.c"))
            {
                tests.push((path, String::new()));
            } else if let (Some(text), Some((_, test))) =
                (line.strip_prefix("> "), tests.last_mut())
            {
                writeln!(test, "{text}").expect("text");
            }
        }
        tests
    }
}

/// A line with `~` for times: of a control step in the last two columns of a row, of programs in words, in JSON.
fn without_times(line: &str, is_timed_row: bool) -> String {
    const NAMES: [&str; 5] = ["\"p50\"", "\"p99\"", "\"max\"", "\"solve_ms\"", "\"bytes\""];
    let is_of_programs = line.contains(" convex programs, ");
    // A table with times has a different length in each run.
    let is_of_files = line.ends_with(" bytes)");
    let is_of_steps = line.contains("time of a step");
    if !is_timed_row
        && !is_of_steps
        && !is_of_programs
        && !is_of_files
        && !NAMES.iter().any(|name| line.contains(name))
    {
        return line.to_owned();
    }
    let parts = tokens(line);
    let is_time = |at: usize| {
        is_timed_row && at + 2 >= parts.len()
            || is_of_steps && parts.get(at + 1) == Some(&"us")
            || is_of_programs && parts.get(at + 1) == Some(&"ms")
            || is_of_files && parts.get(at + 1) == Some(&"bytes")
            || at > 0 && NAMES.contains(&parts[at - 1])
    };
    let masked = parts.iter().enumerate();
    let masked = masked.map(|(at, part)| if is_time(at) { "~" } else { part });
    masked.collect::<Vec<_>>().join(" ")
}

fn renamed(line: &str, pairs: &[(String, String)]) -> String {
    pairs
        .iter()
        .fold(line.to_owned(), |line, (old, new)| line.replace(old, new))
}

/// Words and numbers of a line: parts between spaces, and between the marks of JSON and HTML.
fn tokens(line: &str) -> Vec<&str> {
    line.split([' ', ',', ':', '{', '}', '[', ']', '<', '>', '(', ')', ';'])
        .filter(|token| !token.is_empty())
        .collect()
}

/// Appends the files of a folder to a transcript, in the order of their names.
pub fn written(place: &Path, folder: &Path, text: &mut String) {
    let listed = fs::read_dir(place.join(folder)).expect("a folder");
    let mut entries: Vec<_> = listed.map(|entry| entry.expect("an entry")).collect();
    entries.sort_by_key(fs::DirEntry::file_name);
    for entry in entries {
        let path = folder.join(entry.file_name());
        if entry.path().is_dir() {
            written(place, &path, text);
            continue;
        }
        let name = path.to_str().expect("UTF-8");
        let Some((_, ending)) = name
            .rsplit_once('.')
            .filter(|(stem, _)| !stem.ends_with('/'))
        else {
            continue;
        };
        writeln!(text, "file {name}").expect("text");
        let bytes = fs::read(entry.path()).expect("a file");
        if name.ends_with("_selftest.c") {
            for line in String::from_utf8(bytes).expect("UTF-8").lines() {
                writeln!(text, "> {line}").expect("text");
            }
        } else if TEXTS.contains(&ending) && bytes.len() < LONGEST_TEXT {
            for line in String::from_utf8(bytes).expect("UTF-8").lines() {
                writeln!(text, "| {line}").expect("text");
            }
        } else if !CODE.contains(&ending) {
            for line in digests(name, &bytes) {
                writeln!(text, "| {line}").expect("text");
            }
        }
    }
}

/// Digests of the numbers of a file as printed; of a table one per column, since some columns are times.
fn digests(name: &str, bytes: &[u8]) -> Vec<String> {
    let mut unpacked = Vec::new();
    if name.ends_with(".gz") {
        GzDecoder::new(bytes)
            .read_to_end(&mut unpacked)
            .expect("gzip");
    } else {
        unpacked.extend_from_slice(bytes);
    }
    let Ok(text) = String::from_utf8(unpacked) else {
        return vec!["not text".to_owned()];
    };
    let of_numbers = |text: &mut dyn Iterator<Item = &str>| {
        let (mut hash, mut count) = (0xcbf2_9ce4_8422_2325_u64, 0);
        let numbers = text.flat_map(|part| {
            part.split(|c: char| !(c.is_ascii_alphanumeric() || "+-.".contains(c)))
        });
        for number in numbers.filter(|word| word.parse::<f64>().is_ok()) {
            // FNV-1a, the same in every release of Rust.
            for byte in number.bytes().chain([0]) {
                hash = (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
            }
            count += 1;
        }
        format!("{count} numbers {hash:016x}")
    };
    if !name.contains(".csv") {
        return vec![of_numbers(&mut text.lines())];
    }
    let mut rows = text.lines().filter(|line| !line.starts_with('#'));
    let columns = rows.next().unwrap_or_default().split(',').enumerate();
    let digest = |(index, column)| {
        let cells = rows.clone().filter_map(|row| row.split(',').nth(index));
        format!("column {column} {}", of_numbers(&mut { cells }))
    };
    columns.map(digest).collect()
}

/// Compiles the present C with the recorded self-tests, and runs them.
pub fn self_tests_pass(before: &Transcript, place: &Path) -> Vec<String> {
    let mut failures = Vec::new();
    for (path, text) in before.self_tests() {
        if let Err(fault) = fs::write(place.join(path), text) {
            failures.push(format!("{path}: {fault}: the command wrote no such folder"));
            continue;
        }
        let stem = path.strip_suffix("_selftest.c").expect("a self-test");
        let model = stem.strip_suffix("_controller").unwrap_or(stem);
        let sources = [stem, model]
            .into_iter()
            .take(if stem == model { 1 } else { 2 });
        let mut compiler = Command::new("cc");
        compiler
            .current_dir(place)
            .args(["-O1", "-ffp-contract=off", "-o", "selftest", path]);
        compiler
            .args(sources.map(|source| format!("{source}.c")))
            .arg("-lm");
        let compiled = compiler.output().expect("a C compiler");
        if !compiled.status.success() {
            failures.push(format!(
                "{path}: {}",
                String::from_utf8_lossy(&compiled.stderr)
            ));
            continue;
        }
        let run = Command::new(place.join("selftest"))
            .output()
            .expect("a program");
        if !run.status.success() {
            failures.push(format!("{path}: {}", String::from_utf8_lossy(&run.stdout)));
        }
    }
    failures
}

/// Pairs of texts, `old => new`, one per line.
pub fn changed(path: &Path) -> Vec<(String, String)> {
    let text = fs::read_to_string(path).expect("pairs of texts");
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    let pairs = lines.map(|line| {
        line.split_once(" => ")
            .unwrap_or_else(|| panic!("{line}: expected `old => new`"))
    });
    pairs
        .map(|(old, new)| (old.to_owned(), new.to_owned()))
        .collect()
}

pub fn read_recorded(path: &Path) -> BTreeMap<String, Transcript> {
    let mut text = "\n".to_owned();
    let file = File::open(path).expect("recorded output");
    GzDecoder::new(file)
        .read_to_string(&mut text)
        .expect("gzip");
    let entries = text
        .split("\n== ")
        .filter_map(|entry| entry.trim_end().split_once('\n'));
    entries
        .map(|(name, lines)| (name.to_owned(), Transcript::of(name, lines)))
        .collect()
}

pub fn write_recorded<'t>(path: &Path, recorded: impl IntoIterator<Item = &'t Transcript>) {
    let mut file = GzEncoder::new(File::create(path).expect("a file"), Compression::best());
    for transcript in recorded {
        writeln!(
            file,
            "== {}\n{}",
            transcript.name,
            transcript.lines.join("\n")
        )
        .expect("written");
    }
    file.finish().expect("written");
}
