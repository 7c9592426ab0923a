//! What can go wrong between a file and a segment ready for training.

use std::io;
use std::path::PathBuf;

use thiserror::Error;

use crate::robot::RobotError;

/// Faults of recordings. Rows are lines of the file: 1 is the header.
#[derive(Debug, Error)]
pub enum RecordingError {
    /// A file has other samples than when it was read before.
    #[error("{path}: changed while its samples were in use, expected the same samples again")]
    Changed { path: PathBuf },
    /// The file does not exist.
    #[error("{}: no such file", path.display())]
    Missing {
        /// The file.
        path: PathBuf,
    },
    /// The file cannot be opened, read or written.
    #[error("{}: cannot {action}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// `open`, `read` or `write`.
        action: &'static str,
        /// The system's reason.
        source: io::Error,
    },
    /// The gzip stream is damaged or ends early.
    #[error("{}: row {row}: damaged gzip stream", path.display())]
    Gzip {
        /// The file.
        path: PathBuf,
        /// The row that could not be unpacked.
        row: usize,
        /// The decoder's reason.
        source: io::Error,
    },
    /// The file holds nothing but blank lines.
    #[error("{}: empty file, expected a header and at least two samples", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// The file ends after its header.
    #[error("{}: header of {columns} columns but no sample", path.display())]
    HeaderOnly {
        /// The file.
        path: PathBuf,
        /// Columns in the header.
        columns: usize,
    },
    /// A row is not separated as its header is, or the header not at all.
    #[error("{}: row {row}: found `{found}`, expected cells separated by {expected}", path.display())]
    Delimiter {
        /// The file.
        path: PathBuf,
        /// The row.
        row: usize,
        /// The start of the line.
        found: String,
        /// The separators expected.
        expected: &'static str,
    },
    /// Columns that the format requires are absent.
    #[error("{}: row 1: missing {}; the header starts with {}", path.display(), listed(columns, 8), listed(found, 3))]
    MissingColumns {
        /// The file.
        path: PathBuf,
        /// Their names, in the order of the format.
        columns: Vec<String>,
        /// The names found.
        found: Vec<String>,
    },
    /// Two columns have the same name.
    #[error("{}: row 1: column `{column}` occurs twice, as number {first} and {second}", path.display())]
    DuplicateColumn {
        /// The file.
        path: PathBuf,
        /// The name.
        column: String,
        /// Its first place, counted from 1.
        first: usize,
        /// Its second place.
        second: usize,
    },
    /// A row has fewer cells than the header, or more.
    #[error("{}: row {row}, column `{column}`: found {found} cells, expected {expected}{hint}", path.display())]
    RowLength {
        /// The file.
        path: PathBuf,
        /// The row.
        row: usize,
        /// First column without a cell, or the last column when there are more.
        column: String,
        /// Cells found.
        found: usize,
        /// Columns of the header.
        expected: usize,
        /// What may be the reason, or nothing.
        hint: &'static str,
    },
    /// A cell is not a number.
    #[error("{}: row {row}, column `{column}`: found `{found}`, expected {expected}", path.display())]
    Number {
        /// The file.
        path: PathBuf,
        /// The row.
        row: usize,
        /// The column's name.
        column: String,
        /// The cell's text, cut after 40 characters.
        found: String,
        /// What a number looks like in this file.
        expected: &'static str,
    },
    /// Samples are too far apart to show a jump.
    #[error("{}: row {row}, column `Time`: found a sample every {found} s on average, expected at most {expected} s; is `Time` in milliseconds?", path.display())]
    Sampling {
        /// The file.
        path: PathBuf,
        /// First row of the segment.
        row: usize,
        /// Mean distance between samples, in s.
        found: f64,
        /// Largest distance accepted, in s.
        expected: f64,
    },
    /// A cell is NaN, infinite, or too large for a double.
    #[error("{}: row {row}, column `{column}`: found `{found}`, expected a finite number", path.display())]
    NotFinite {
        /// The file.
        path: PathBuf,
        /// The row.
        row: usize,
        /// The column's name.
        column: String,
        /// The cell's text.
        found: String,
    },
    /// A contact flag is neither 0 nor 1.
    #[error("{}: row {row}, column `{column}`: found {found}, expected contact 0 or 1 (a force? compare it with a threshold first)", path.display())]
    Contact {
        /// The file.
        path: PathBuf,
        /// The row.
        row: usize,
        /// The foot's column.
        column: String,
        /// The value.
        found: f64,
    },
    /// Time stands still, or steps back by less than a new segment would.
    #[error("{}: row {row}, column `Time`: found {found} s after {previous} s, expected a later time or a new segment", path.display())]
    Time {
        /// The file.
        path: PathBuf,
        /// The row.
        row: usize,
        /// Its time.
        found: f64,
        /// The time of the row before.
        previous: f64,
    },
    /// A stretch of samples is too short for what is asked of it.
    #[error("{}: row {row}: found {found} consecutive samples, expected at least {expected}", path.display())]
    TooShort {
        /// The file.
        path: PathBuf,
        /// Its first row.
        row: usize,
        /// Samples found.
        found: usize,
        /// Samples needed.
        expected: usize,
    },
    /// The text is not UTF-8.
    #[error("{}: row {row}, byte {byte}: found 0x{found:02x}, expected UTF-8 text", path.display())]
    Encoding {
        /// The file.
        path: PathBuf,
        /// The row.
        row: usize,
        /// Byte in the line, counted from 1.
        byte: usize,
        /// The byte.
        found: u8,
    },
    /// A line is longer than any recording's.
    #[error("{}: row {row}: found a line of more than {limit} bytes, expected a recording", path.display())]
    LineTooLong {
        /// The file.
        path: PathBuf,
        /// The row.
        row: usize,
        /// The longest line accepted.
        limit: usize,
    },
    /// The file has more samples than are read.
    #[error("{}: row {row}: found more than {limit} samples, expected shorter recordings", path.display())]
    TooManyRows {
        /// The file.
        path: PathBuf,
        /// The first row beyond.
        row: usize,
        /// The most samples accepted.
        limit: usize,
    },
    /// No pattern of a phase rule matches any sample.
    #[error("{}: row {row}: feet {feet:?} (fr, fl, rr, rl) match none of the phases {}", path.display(), listed(phases, 8))]
    NoPhase {
        /// The file.
        path: PathBuf,
        /// The first row.
        row: usize,
        /// Its contact flags.
        feet: [bool; 4],
        /// Names of the rule's phases.
        phases: Vec<String>,
    },
    /// A smoothing window and polynomial order that do not fit together.
    #[error("smoothing window {window} with order {order}: expected an odd window above the order")]
    Smoothing {
        /// Samples of the window.
        window: usize,
        /// Degree of the polynomial.
        order: usize,
    },
    /// A batch of zero rows was asked for.
    #[error("found a batch of {found} rows, expected at least 2")]
    Batch {
        /// The batch asked for.
        found: usize,
    },
    /// The robot's kinematics refuse a sample.
    #[error("{}: row {row}: no body wrench", path.display())]
    Wrench {
        /// The file.
        path: PathBuf,
        /// The row.
        row: usize,
        /// Which leg, where, and why.
        source: RobotError,
    },
}

/// `a`, `b` and 3 more.
fn listed(names: &[String], most: usize) -> String {
    let mut text = names
        .iter()
        .take(most)
        .map(|name| format!("`{}`", shortened(name)))
        .collect::<Vec<_>>()
        .join(", ");
    if names.len() > most {
        text.push_str(&format!(" and {} more", names.len() - most));
    }
    text
}

/// The text, cut after 40 characters and without control characters.
pub(super) fn shortened(text: &str) -> String {
    const MOST: usize = 40;
    let mut out = String::new();
    for c in text.chars().take(MOST) {
        match c {
            '\t' => out.push_str("\\t"),
            c if c.is_control() => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    if text.chars().nth(MOST).is_some() {
        out.push('…');
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn listed_many_names_counts_the_rest() {
        let names: Vec<String> = (0..5).map(|i| format!("c{i}")).collect();
        assert_eq!(listed(&names, 2), "`c0`, `c1` and 3 more");
        assert_eq!(listed(&names[..1], 2), "`c0`");
    }

    #[test]
    fn shortened_cuts_long_text_and_hides_control_characters() {
        assert_eq!(shortened("a\u{1b}b"), "a\u{fffd}b");
        assert_eq!(shortened("Time\tfeet"), "Time\\tfeet");
        assert_eq!(shortened(&"é".repeat(50)).chars().count(), 41);
    }
}
