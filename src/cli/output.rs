//! Files, tables and progress: how every command shows what it did.

use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

use crate::Error;
use crate::files::{Overwrite, write_whole};
use crate::recording::{self, Recording};

/// Tells before long work that its output could not be written.
///
/// # Errors
/// [`Error::IsFolder`] for a folder, [`Error::Exists`] if the file is there and may not be replaced,
/// [`Error::NoFolder`] if its folder is not.
pub fn check_output(path: Option<&Path>, overwrite: Overwrite) -> Result<(), Error> {
    let Some(path) = path else { return Ok(()) };
    if path.is_dir() || path.file_name().is_none() {
        return Err(Error::IsFolder(path.to_owned()));
    }
    if !overwrite.allows(path) {
        return Err(Error::Exists(path.to_owned()));
    }
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() && !folder.is_dir() => {
            Err(Error::NoFolder {
                path: path.to_owned(),
                folder: folder.to_owned(),
            })
        }
        Some(_) | None => Ok(()),
    }
}

/// Writes a whole file.
///
/// # Errors
/// [`Error::Exists`] as [`check_output`], [`Error::Write`] if the file system refuses.
pub fn write_file(path: &Path, contents: &[u8], overwrite: Overwrite) -> Result<(), Error> {
    check_output(Some(path), overwrite)?;
    write_whole(path, |out| out.write_all(contents)).map_err(|source| Error::Write {
        path: path.to_owned(),
        source,
    })
}

/// Reads recordings, showing which.
///
/// # Errors
/// [`Error::Recording`] for the first that cannot be read.
pub fn read_recordings(paths: &[PathBuf]) -> Result<Vec<Recording>, Error> {
    let progress = spinner("reading recordings");
    let read = (paths.iter())
        .map(|path| {
            progress.set_message(format!("reading {}", path.display()));
            Ok(recording::read(path)?)
        })
        .collect();
    progress.finish_and_clear();
    read
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

    /// Titles of the columns.
    pub fn header(&self) -> &[String] {
        &self.header
    }

    /// The rows so far.
    pub fn rows(&self) -> &[Vec<String>] {
        &self.rows
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

/// A bar on stderr for a known number of steps, shown only when stderr is a terminal.
pub fn progress_bar(message: impl Into<String>) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len}")
        .expect("the bar's template is a constant");
    let bar = ProgressBar::new(0).with_style(style);
    bar.set_message(message.into());
    bar
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn significant_keeps_four_digits() {
        assert_eq!(significant(0.0123449), "0.01234");
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
