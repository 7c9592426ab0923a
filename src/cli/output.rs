//! Files, tables and progress: how every command shows what it did.
//!
//! A file appears whole or not at all: it is written beside its final place and renamed.

use std::fmt::Display;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

use crate::Error;

/// Writes `contents` to `path` in one step, creating missing folders above it.
///
/// # Errors
/// [`Error::Exists`] if the file is there and `force` was not asked for, [`Error::Write`] if the
/// file system refuses.
pub fn write_file(path: &Path, contents: &[u8], force: Overwrite) -> Result<(), Error> {
    force.check(path)?;
    write_beside_then_rename(path, contents).map_err(|source| Error::Write {
        path: path.to_path_buf(),
        source,
    })
}

/// Whether a command may replace a file that is already there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Overwrite {
    /// Refuse with an error.
    Refuse,
    /// Replace it (`--force`).
    Replace,
}

impl Overwrite {
    /// From the state of a `--force` flag.
    pub fn when_forced(force: bool) -> Self {
        if force { Self::Replace } else { Self::Refuse }
    }

    /// Tells before long work that its output could not be written.
    ///
    /// # Errors
    /// [`Error::Exists`] if the file is there and may not be replaced.
    pub fn check(self, path: &Path) -> Result<(), Error> {
        match self {
            Self::Refuse if path.exists() => Err(Error::Exists(path.to_path_buf())),
            Self::Refuse | Self::Replace => Ok(()),
        }
    }
}

fn write_beside_then_rename(path: &Path, contents: &[u8]) -> io::Result<()> {
    if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        fs::create_dir_all(folder)?;
    }
    let beside = beside(path);
    let written = fs::File::create(&beside).and_then(|mut file| {
        file.write_all(contents)?;
        file.sync_all()
    });
    let renamed = written.and_then(|()| fs::rename(&beside, path));
    if renamed.is_err() && beside.exists() {
        fs::remove_file(&beside)?;
    }
    renamed
}

fn beside(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(format!(".{}.part", std::process::id()));
    path.with_file_name(name)
}

/// A table of text cells with a header, columns aligned: the first to the left, the rest to the right.
#[derive(Debug, Clone)]
pub struct Table {
    header: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// An empty table with these column titles.
    pub fn new<T: Into<String>>(header: impl IntoIterator<Item = T>) -> Self {
        Self {
            header: header.into_iter().map(Into::into).collect(),
            rows: Vec::new(),
        }
    }

    /// Adds a row; missing cells stay empty.
    pub fn row<T: Into<String>>(&mut self, cells: impl IntoIterator<Item = T>) -> &mut Self {
        self.rows.push(cells.into_iter().map(Into::into).collect());
        self
    }

    fn width(&self, column: usize) -> usize {
        std::iter::once(&self.header)
            .chain(&self.rows)
            .filter_map(|row| row.get(column))
            .map(|cell| cell.chars().count())
            .max()
            .unwrap_or(0)
    }
}

impl Display for Table {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let widths: Vec<usize> = (0..self.header.len()).map(|c| self.width(c)).collect();
        let line = |f: &mut std::fmt::Formatter<'_>, row: &[String]| {
            let mut text = String::new();
            for (column, width) in widths.iter().enumerate() {
                let cell = row.get(column).map_or("", String::as_str);
                match column {
                    0 => text.push_str(&format!("  {cell:<width$}")),
                    _ => text.push_str(&format!("  {cell:>width$}")),
                }
            }
            writeln!(f, "{}", text.trim_end())
        };
        line(f, &self.header)?;
        let rule: Vec<String> = widths.iter().map(|&width| "-".repeat(width)).collect();
        line(f, &rule)?;
        self.rows.iter().try_for_each(|row| line(f, row))
    }
}

/// A number with four significant digits, as tables show it.
pub fn significant(value: f64) -> String {
    if !value.is_finite() {
        return "diverged".to_owned();
    }
    let magnitude = value.abs();
    if magnitude == 0.0 {
        return "0".to_owned();
    }
    if !(1e-3..1e5).contains(&magnitude) {
        return format!("{value:.3e}");
    }
    let before_point = magnitude.log10().floor() as i32 + 1;
    format!("{value:.*}", usize::try_from(4 - before_point).unwrap_or(0))
}

/// A spinner on stderr, shown only when stderr is a terminal.
pub fn spinner(message: impl Into<String>) -> ProgressBar {
    let style = ProgressStyle::with_template("{spinner} {msg} [{elapsed}]")
        .expect("the spinner's template is a constant");
    let bar = ProgressBar::new_spinner().with_style(style);
    bar.set_message(message.into());
    bar.enable_steady_tick(Duration::from_millis(120));
    bar
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn write_file_refuses_an_existing_file_and_leaves_it_as_it_was() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("model.json");
        write_file(&path, b"first", Overwrite::Refuse).expect("a new file");
        let refused = write_file(&path, b"second", Overwrite::Refuse);
        assert!(matches!(refused, Err(Error::Exists(p)) if p == path));
        assert_eq!(fs::read(&path).expect("still there"), b"first");
        write_file(&path, b"second", Overwrite::Replace).expect("forced");
        assert_eq!(fs::read(&path).expect("replaced"), b"second");
        let left = fs::read_dir(folder.path()).expect("readable").count();
        assert_eq!(left, 1, "no part file stays behind");
    }

    #[test]
    fn significant_keeps_four_digits() {
        assert_eq!(significant(0.012345), "0.01234");
        assert_eq!(significant(12.3456), "12.35");
        assert_eq!(significant(0.0), "0");
        assert_eq!(significant(1.23456e-7), "1.235e-7");
        assert_eq!(significant(f64::NAN), "diverged");
    }

    #[test]
    fn table_aligns_numbers_to_the_right() {
        let mut table = Table::new(["coordinate", "rms"]);
        table.row(["body.x", "0.5"]).row(["body.z", "12.25"]);
        let text = table.to_string();
        assert_eq!(
            text,
            "  coordinate    rms\n  ----------  -----\n  body.x        0.5\n  body.z      12.25\n"
        );
    }
}
