//! Formats of other programs, recognised by content or extension, with the commands that convert them: `magic.toml`.

use std::sync::OnceLock;

use serde::Deserialize;

use super::*;

/// Bytes that [`recognised`] needs of a file.
pub const MAGIC_BYTES: usize = 512;
pub const MCAP: &[u8] = b"\x89MCAP0\r\n";
const SEARCHED: usize = 1 << 16;

/// Arrays become columns; those of two axes one for each of the second.
const TO_COLUMNS: &str = "; c = {k: np.squeeze(a[k]) for k in a if k[:2] != '__'}; \
     pd.DataFrame({k if v.ndim < 2 else f'{k}_{i}': v.reshape(len(v), -1)[:, i] for k, v in c.items() if v.ndim \
     for i in range(v.size // len(v))}).to_csv(sys.argv[2], index=False)";

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OtherFormat {
    pub what: String,
    /// The lines; empty for arrays that `romc import` reads as they are.
    pub remedy: String,
    pub(crate) is_packed: bool,
}

#[derive(Deserialize)]
struct Table {
    format: Vec<Row>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Row {
    what: String,
    #[serde(default)]
    endings: Vec<String>,
    /// Of one the first bytes, and text inside.
    #[serde(default)]
    signs: Vec<Vec<String>>,
    #[serde(default)]
    at: usize,
    ends: Option<String>,
    test: Option<Test>,
    packed: Option<String>,
    arrays: Option<String>,
    table: Option<String>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Test {
    Safetensors,
    Onnx,
    #[serde(rename = "web page")]
    WebPage,
}

fn table() -> &'static [Row] {
    static TABLE: OnceLock<Vec<Row>> = OnceLock::new();
    TABLE.get_or_init(|| {
        let table = toml::from_str::<Table>(include_str!("magic.toml"));
        table.expect("romc's own table, read by tests").format
    })
}

/// The format of a file with these first bytes, with a command that converts it; none for a text table or log.
pub fn recognised(path: &Path, start: &[u8]) -> Option<OtherFormat> {
    let is_table = |row: &&Row| row.table.is_some() || row.packed.is_some();
    let mut rows = table().iter().filter(is_table);
    let row = rows.find(|row| row.holds(start))?;
    let remedy = match (&row.packed, &row.table) {
        (Some(line), _) => in_shell(line, path),
        (None, Some(line)) => match line.strip_prefix(':') {
            Some(code) => to_table(code, path),
            None => in_shell(line, path),
        },
        (None, None) => return None,
    };
    let (what, is_packed) = (row.what.clone(), row.packed.is_some());
    Some(OtherFormat {
        what,
        remedy,
        is_packed,
    })
}

pub(crate) fn arrays(path: &Path, bytes: &[u8]) -> Option<OtherFormat> {
    arrays_by_content(path, bytes).or_else(|| arrays_by_ending(path))
}

pub fn arrays_by_content(path: &Path, bytes: &[u8]) -> Option<OtherFormat> {
    let rows = table().iter().filter(|row| row.holds(bytes));
    rows.filter_map(|row| row.of_arrays(path)).next()
}

pub fn arrays_by_ending(path: &Path) -> Option<OtherFormat> {
    let ending = path.extension()?.to_string_lossy().to_lowercase();
    let row = (table().iter()).find(|row| row.endings.contains(&ending))?;
    row.of_arrays(path)
}

/// The same of a path that is no file: a TensorFlow checkpoint's stem, or the folder of a SavedModel.
pub fn arrays_by_neighbours(path: &Path) -> Option<OtherFormat> {
    let index = PathBuf::from(format!("{}.index", path.display()));
    let parts = [index, path.join("saved_model.pb")];
    let part = parts.iter().find(|part| part.is_file());
    arrays_by_ending(part.map_or(path, PathBuf::as_path))
}

impl Row {
    fn holds(&self, bytes: &[u8]) -> bool {
        let latin_1 = |text: &str| -> Vec<u8> { text.chars().map(|c| c as u8).collect() };
        // A file that ends before the place of the sign does not have it.
        let from = bytes.get(self.at..).unwrap_or_default();
        let is_signed = |sign: &Vec<String>| {
            let mut inside = sign.iter().skip(1);
            from.starts_with(&latin_1(&sign[0])) && inside.all(|text| has(bytes, text.as_bytes()))
        };
        self.signs.iter().any(is_signed)
            || self.test.is_some_and(|test| test.holds(bytes))
            || (self.ends.as_ref()).is_some_and(|end| bytes.ends_with(&latin_1(end)))
    }

    fn of_arrays(&self, path: &Path) -> Option<OtherFormat> {
        let (lines, intent) = match (&self.packed, &self.arrays) {
            (Some(line), _) => (in_shell(line, path), "the file itself; in a shell"),
            (None, Some(lines)) => (
                in_python(lines, path),
                "an .npz or .safetensors file; in Python",
            ),
            (None, None) => return None,
        };
        let lines: String = lines.lines().map(|line| format!("\n    {line}")).collect();
        Some(OtherFormat {
            what: self.what.clone(),
            remedy: match lines.is_empty() {
                true => lines,
                false => format!("{intent}:{lines}"),
            },
            is_packed: self.packed.is_some(),
        })
    }
}

impl Test {
    fn holds(self, bytes: &[u8]) -> bool {
        match (self, bytes) {
            (Self::Safetensors, _) => {
                bytes.len() > 10 && bytes[6..8] == [0, 0] && bytes[8..10] == *b"{\""
            }
            // Field 1 is the version, field 2 the name of the program that wrote it.
            (Self::Onnx, [0x08, 1..=32, 0x12, length @ 1..=63, name @ ..]) => {
                let name = name.get(..usize::from(*length));
                name.is_some_and(|name| name.iter().all(u8::is_ascii_graphic))
            }
            (Self::Onnx, _) => false,
            (Self::WebPage, _) => {
                let start = bytes.trim_ascii_start();
                ["<!doctype html", "<html"].iter().any(|tag| {
                    let start = start.get(..tag.len());
                    start.is_some_and(|start| start.eq_ignore_ascii_case(tag.as_bytes()))
                })
            }
        }
    }
}

fn has(bytes: &[u8], text: &[u8]) -> bool {
    let first = &bytes[..bytes.len().min(SEARCHED)];
    let last = &bytes[bytes.len().saturating_sub(SEARCHED)..];
    let mut windows = first.windows(text.len()).chain(last.windows(text.len()));
    windows.any(|window| window == text)
}

fn filled(lines: &str, path: &Path, spelled: impl Fn(&Path) -> String) -> String {
    let folder = (path.parent()).filter(|folder| !folder.as_os_str().is_empty());
    lines
        .replace("{folder}", &spelled(folder.unwrap_or(Path::new("."))))
        .replace("{file}", &spelled(path))
        .replace("{stem}", &spelled(&path.with_extension("")))
}

fn in_shell(line: &str, path: &Path) -> String {
    filled(line, path, shell_path)
}

fn in_python(lines: &str, path: &Path) -> String {
    let escaped =
        |path: &Path| (path.display().to_string().replace('\\', "\\\\")).replace('"', "\\\"");
    filled(lines, path, escaped)
}

/// Python with NumPy and pandas that makes a table, or the arrays `a` of one.
fn to_table(code: &str, path: &Path) -> String {
    let columns = match code.ends_with("index=False)") {
        true => "",
        false => TO_COLUMNS,
    };
    let stem = (path.file_stem().unwrap_or(path.as_os_str())).to_string_lossy();
    let with_ending = |end: &str| path.with_file_name(format!("{stem}{end}"));
    let table = match with_ending(".csv") {
        same if same == path => with_ending("-table.csv"),
        other => other,
    };
    let (file, table) = (shell_path(path), shell_path(&table));
    format!("python3 -c \"import sys, numpy as np, pandas as pd; {code}{columns}\" {file} {table}")
}
