//! Faults between a file and a segment ready for training.

use thiserror::Error;

use super::*;
use crate::files::magic::OtherFormat;
use crate::files::{Located, Place};

/// A fault and its place: the file, a row (1 is the header) or a cell.
pub type RecordingError = Located<RecordingFault>;

pub(super) type Outcome<T> = Result<T, RecordingError>;
pub(super) type Checked<T> = Result<T, RecordingFault>;

/// A fault at a place in a recording.
#[derive(Debug, Error)]
pub enum RecordingFault {
    #[error("found {found}, expected {expected}")]
    Unexpected { found: String, expected: String },
    /// A row of another length than the header; the place is the first column without a cell, or the last column.
    #[error("found {found} cells, expected {expected}{hint}")]
    RowLength {
        found: usize,
        expected: usize,
        hint: &'static str,
    },
    #[error("{0}")]
    Text(String), // without alternative, or in the words of a parser
    #[error("cannot {action}")]
    Io {
        action: &'static str,
        source: io::Error,
    },
    #[error("damaged gzip stream")]
    Gzip(#[source] io::Error),
    #[error("no body wrench")]
    Wrench(#[source] Box<RobotError>), // the robot's kinematics refuse a sample
}

pub(super) fn unexpected(found: impl Into<String>, expected: impl Into<String>) -> RecordingFault {
    let (found, expected) = (found.into(), expected.into());
    RecordingFault::Unexpected { found, expected }
}

pub(super) fn text(words: impl Into<String>) -> RecordingFault {
    RecordingFault::Text(words.into())
}

pub(super) fn io_fault(action: &'static str, source: io::Error) -> RecordingFault {
    match source.kind() {
        io::ErrorKind::NotFound if action != "write" => text("no such file"),
        _ => RecordingFault::Io { action, source },
    }
}

impl RecordingFault {
    pub(super) fn mcap(words: impl std::fmt::Display) -> Self {
        text(format!("no MCAP file that can be read: {words}"))
    }

    /// A recording that cannot be of the robot of the others, or of any.
    pub(super) fn contradiction(words: &str) -> Self {
        text(format!(
            "{words}; leave this recording out, or mend its map of columns"
        ))
    }

    pub(super) fn header_only(columns: usize) -> Self {
        text(format!("header of {columns} columns but no sample"))
    }

    pub(super) fn other_format(format: &OtherFormat) -> Self {
        let makes = "a text table or an MCAP log; convert the file with";
        unexpected(&*format.what, format!("{makes}: {}", format.remedy))
    }

    pub(super) fn too_short(found: usize, expected: usize) -> Self {
        let found = format!("{found} consecutive samples");
        unexpected(found, format!("at least {expected}"))
    }

    pub(super) fn delimiter(line: &str, expected: &str) -> Self {
        Self::number(line, &format!("cells separated by {expected}"))
    }

    pub(super) fn number(cell: &str, expected: &str) -> Self {
        unexpected(format!("`{}`", shortened(cell)), expected)
    }

    pub(super) fn contact(value: f64) -> Self {
        let expected = "contact 0 or 1 (a force? compare it with a threshold first)";
        unexpected(value.to_string(), expected)
    }

    /// A time in s that stands still, or steps back by less than a new segment would.
    pub(super) fn time(found: f64, previous: f64) -> Self {
        let found = format!("{found} s after {previous} s");
        unexpected(found, "a later time or a new segment")
    }

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
}

/// `a`, `b` and 3 more.
pub(super) fn listed(names: &[String], most: usize) -> String {
    let first = names.iter().take(most);
    let first = first.map(|name| format!("`{}`", shortened(name)));
    let first = first.collect::<Vec<_>>().join(", ");
    match names.len().saturating_sub(most) {
        0 => first,
        more => format!("{first} and {more} more"),
    }
}

pub(super) fn shortened(text: &str) -> String {
    const MOST: usize = 40;
    let rest = text.chars().nth(MOST).map(|_| '…');
    let shown = text.chars().take(MOST).map(|c| match c {
        c if c.is_control() && c != '\t' => '\u{fffd}',
        c => c,
    });
    let shown: String = shown.chain(rest).collect();
    shown.replace('\t', "\\t")
}
