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
    /// Something else than what a recording, log or map has there.
    #[error("found {found}, expected {expected}")]
    Unexpected { found: String, expected: String },
    #[error("no such file")]
    Missing,
    #[error("no MCAP file that can be read: {0}")]
    Mcap(String),
    /// A fault without alternative, or in the words of a parser.
    #[error("{0}")]
    Text(String),
    /// A recording that cannot be of the robot of the others, or of any.
    #[error("{0}; leave this recording out, or mend its map of columns")]
    Contradiction(String),
    #[error("cannot {action}")]
    Io {
        action: &'static str,
        source: io::Error,
    },
    #[error("damaged gzip stream")]
    Gzip(#[source] io::Error),
    #[error("empty file, expected a header and at least two samples")]
    Empty,
    /// The file ends after its header of this many columns.
    #[error("header of {0} columns but no sample")]
    HeaderOnly(usize),
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
    /// A row has fewer cells than the header, or more; the place is the first column without a cell, or the last
    /// column.
    #[error("found {found} cells, expected {expected}{hint}")]
    RowLength {
        found: usize,
        expected: usize,
        hint: &'static str,
    },
    /// No pattern of a phase rule matches any sample.
    #[error(
        "feet {feet:?} (fr, fl, rr, rl) match none of the phases {}",
        listed(phases, 8)
    )]
    NoPhase {
        feet: [bool; 4],
        phases: Vec<String>,
    },
    /// The robot's kinematics refuse a sample.
    #[error("no body wrench")]
    Wrench(#[source] Box<RobotError>),
}

impl RecordingFault {
    pub(super) fn unexpected(found: impl Into<String>, expected: impl Into<String>) -> Self {
        let (found, expected) = (found.into(), expected.into());
        RecordingFault::Unexpected { found, expected }
    }

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

    /// A file of another format, which its first bytes show.
    pub(super) fn other_format(format: &OtherFormat) -> Self {
        let expected = format!(
            "a text table or an MCAP log; this makes one: {}",
            format.remedy
        );
        Self::unexpected(format.what.clone(), expected)
    }

    /// A stretch of fewer samples than are expected.
    pub(super) fn too_short(found: usize, expected: usize) -> Self {
        Self::unexpected(
            format!("{found} consecutive samples"),
            format!("at least {expected}"),
        )
    }

    /// A line whose cells are not separated as expected.
    pub(super) fn delimiter(line: &str, expected: &str) -> Self {
        Self::number(line, &format!("cells separated by {expected}"))
    }

    /// A cell that is not a number as expected.
    pub(super) fn number(cell: &str, expected: &str) -> Self {
        Self::unexpected(format!("`{}`", shortened(cell)), expected)
    }

    /// A contact that is neither 0 nor 1.
    pub(super) fn contact(value: f64) -> Self {
        let expected = "contact 0 or 1 (a force? compare it with a threshold first)";
        Self::unexpected(value.to_string(), expected)
    }

    /// A time in s that stands still, or steps back by less than a new segment would.
    pub(super) fn time(found: f64, previous: f64) -> Self {
        let found = format!("{found} s after {previous} s");
        Self::unexpected(found, "a later time or a new segment")
    }

    /// The fault of a file as a whole.
    pub(super) fn of(self, path: &Path) -> RecordingError {
        Located::new(&path.display().to_string(), Place::Whole, self)
    }

    pub(super) fn at(self, path: &Path, row: usize) -> RecordingError {
        Located::new(&path.display().to_string(), Place::Row(row), self)
    }

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
    match missing.len() < MANY {
        true => "",
        false => {
            "; for a log of another program `romc inspect --guess LOG` writes a map for --columns"
        }
    }
}

/// `a`, `b` and 3 more.
fn listed(names: &[String], most: usize) -> String {
    let first = names.iter().take(most);
    let first = first.map(|name| format!("`{}`", shortened(name)));
    let mut text = first.collect::<Vec<_>>().join(", ");
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
