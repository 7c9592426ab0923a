//! Faults between a file and a segment ready for training.

#![allow(missing_docs, reason = "each variant's message names its fields")]

use std::io;
use std::path::Path;

use thiserror::Error;

use crate::files::magic::OtherFormat;
use crate::files::{Located, Place};
use crate::robot::RobotError;

/// A fault and its place: the file, a row (1 is the header) or a cell.
pub type RecordingError = Located<RecordingFault>;

/// What is wrong at a place.
#[derive(Debug, Error)]
pub enum RecordingFault {
    /// The file does not exist.
    #[error("no such file")]
    Missing,
    /// A file of another format, which its first bytes show.
    #[error("found {}, expected a text table or an MCAP log; this makes one: {}", .0.what, .0.remedy)]
    OtherFormat(OtherFormat),
    /// A folder with this many MCAP files, but no list of them.
    #[error(
        "found a folder of {0} MCAP files without metadata.yaml that are not NAME_0.mcap, NAME_1.mcap and so on, \
         expected the parts of one bag; give separate recordings one by one: FOLDER/*.mcap"
    )]
    Bag(usize),
    /// A damaged MCAP file, or one that packs its chunks in another way.
    #[error("no MCAP file that can be read: {0}")]
    Mcap(String),
    /// An MCAP file without a topic of numbers; the first reason in brackets, or nothing.
    #[error("found no topic of ROS messages with numbers{0}")]
    NoTopic(String),
    /// A recording that cannot be of the robot of the others, or of any.
    #[error("{0}; leave this recording out, or mend its map of columns")]
    Contradiction(String),
    /// Topics that are not a recording by their names.
    #[error(
        "found {found}, expected {expected}; `romc inspect --guess LOG` writes a map for --columns, to be completed"
    )]
    Topics { found: String, expected: String },
    /// A folder, which only a map of columns makes a recording of.
    #[error(
        "found a folder, expected a file, or `--columns` with a map that names the folder's files"
    )]
    Folder,
    /// Columns without names, of which nothing can be guessed.
    #[error(
        "found columns without names, of which no map can be guessed; a map counts them from 1"
    )]
    Unnamed,
    /// The file cannot be opened, read or written.
    #[error("cannot {action}")]
    Io {
        action: &'static str,
        source: io::Error,
    },
    /// The gzip stream is damaged or ends early.
    #[error("damaged gzip stream")]
    Gzip(#[source] io::Error),
    /// The file holds nothing but blank lines.
    #[error("empty file, expected a header and at least two samples")]
    Empty,
    /// The file ends after its header of this many columns.
    #[error("header of {0} columns but no sample")]
    HeaderOnly(usize),
    /// A row is not separated as its header is, or the header not at all.
    #[error("found `{found}`, expected cells separated by {expected}")]
    Delimiter {
        found: String,
        expected: &'static str,
    },
    /// Columns that the format requires are absent.
    #[error(
        "missing {}; the header starts with {}{}",
        listed(columns, 8),
        listed(found, 3),
        foreign_hint(columns)
    )]
    MissingColumns {
        columns: Vec<String>,
        found: Vec<String>,
    },
    /// Two columns have the same name; columns count from 1.
    #[error("occurs twice, as number {first} and {second}")]
    DuplicateColumn { first: usize, second: usize },
    /// A row has fewer cells than the header, or more; the place is the first column without a
    /// cell, or the last column.
    #[error("found {found} cells, expected {expected}{hint}")]
    RowLength {
        found: usize,
        expected: usize,
        hint: &'static str,
    },
    /// A map of columns is no valid TOML, or has a key that maps do not have.
    #[error("no map of columns: {0}")]
    MapSyntax(String),
    /// A key of a map of columns does not fit the map or the log.
    #[error("found {found}, expected {expected}")]
    Map { found: String, expected: String },
    /// A topic with a clock of its own has no sample for longer than is interpolated; in s.
    #[error(
        "found no sample for {found} s, expected at most {expected} s (`max_gap_s` in `[time]`)"
    )]
    Gap { found: f64, expected: f64 },
    /// The clocks of a log's topics have no two samples in common.
    #[error("found clocks that do not overlap, expected topics of the same time")]
    NoOverlap,
    /// The trunk points straight up or down, where an angular velocity says no rates of roll and yaw.
    #[error("found a pitch of 90 degrees, expected less where rates come from angular velocities")]
    Upright,
    /// A cell is not a finite number.
    #[error("found `{found}`, expected {expected}")]
    Number {
        found: String,
        expected: &'static str,
    },
    /// A contact flag is neither 0 nor 1.
    #[error("found {0}, expected contact 0 or 1 (a force? compare it with a threshold first)")]
    Contact(f64),
    /// Samples are too far apart to show a jump; means in s.
    #[error(
        "found a sample every {found} s on average, expected at most {expected} s; is `Time` in milliseconds?"
    )]
    Sampling { found: f64, expected: f64 },
    /// Time stands still, or steps back by less than a new segment would.
    #[error("found {found} s after {previous} s, expected a later time or a new segment")]
    Time { found: f64, previous: f64 },
    /// A stretch of samples, which begins at the row, is too short for what is asked of it.
    #[error("found {found} consecutive samples, expected at least {expected}")]
    TooShort { found: usize, expected: usize },
    /// The text is not UTF-8; bytes of a line count from 1.
    #[error("found 0x{found:02x} as byte {byte}, expected UTF-8 text")]
    Encoding { byte: usize, found: u8 },
    /// A line is longer than this many bytes, and so no recording's.
    #[error("found a line of more than {0} bytes, expected a recording")]
    LineTooLong(usize),
    /// The file has more samples than this, which is the most that are read.
    #[error("found more than {0} samples, expected shorter recordings")]
    TooManyRows(usize),
    /// The file has more empty lines than this in a row.
    #[error("found more than {0} empty lines, expected samples or the end")]
    TooManyBlankRows(usize),
    /// No pattern of a phase rule matches any sample.
    #[error(
        "feet {feet:?} (fr, fl, rr, rl) match none of the phases {}",
        listed(phases, 8)
    )]
    NoPhase {
        feet: [bool; 4],
        phases: Vec<String>,
    },
    /// A smoothing window and polynomial order that do not fit together; no file's fault.
    #[error(
        "smoothing window {window} with order {order}: expected an odd window above the order, \
             at most 1001, and an order of at most 12"
    )]
    Smoothing { window: usize, order: usize },
    /// The robot's kinematics refuse a sample.
    #[error("no body wrench")]
    Wrench(#[source] Box<RobotError>),
}

impl RecordingFault {
    pub(super) fn io(action: &'static str, source: io::Error) -> Self {
        RecordingFault::Io { action, source }
    }

    /// A file that cannot be opened or read; there may be none.
    pub(super) fn unreadable(action: &'static str, source: io::Error) -> Self {
        match source.kind() {
            io::ErrorKind::NotFound => RecordingFault::Missing,
            _ => RecordingFault::io(action, source),
        }
    }

    /// A stretch of fewer samples than are expected.
    pub(super) fn too_short(found: usize, expected: usize) -> Self {
        RecordingFault::TooShort { found, expected }
    }

    /// A line that is not separated as expected.
    pub(super) fn delimiter(line: &str, expected: &'static str) -> Self {
        let found = shortened(line);
        RecordingFault::Delimiter { found, expected }
    }

    /// The fault of a file as a whole.
    pub(super) fn of(self, path: &Path) -> RecordingError {
        Located::new(&path.display().to_string(), Place::Whole, self)
    }

    /// The fault at a row.
    pub(super) fn at(self, path: &Path, row: usize) -> RecordingError {
        Located::new(&path.display().to_string(), Place::Row(row), self)
    }

    /// The fault in a cell.
    pub(super) fn in_cell(self, path: &Path, row: usize, column: &str) -> RecordingError {
        let place = Place::Cell(row, column.into());
        Located::new(&path.display().to_string(), place, self)
    }

    /// The fault of an argument, in no file.
    pub(super) fn of_argument(self) -> RecordingError {
        Located::new("", Place::Whole, self)
    }
}

/// How to read a header with hardly a name of the format.
fn foreign_hint(missing: &[String]) -> &'static str {
    const MANY: usize = 30;
    match missing.len() {
        MANY.. => {
            "; for a log of another program `romc inspect --guess LOG` writes a map for --columns"
        }
        _ => "",
    }
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
    fn shortened_cuts_long_text_and_hides_control_characters() {
        assert_eq!(shortened("a\u{1b}b"), "a\u{fffd}b");
        assert_eq!(shortened("Time\tfeet"), "Time\\tfeet");
        assert_eq!(shortened(&"é".repeat(50)).chars().count(), 41);
    }
}
