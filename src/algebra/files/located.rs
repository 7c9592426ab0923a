//! Errors with their place in a file.

use std::error::Error;
use std::fmt;

/// A place in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    Whole,
    /// A row of a table, from 1 (the header).
    Row(usize),
    /// A cell of a table: its row and the name of its column.
    Cell(usize, Box<str>),
    /// A character of a text: line and column, from 1.
    Character(usize, usize),
    /// A named entry with what it is used for, such as `` `W_e`[3, 2] as encoder.weight ``.
    Entry(Box<str>),
    /// No place in a file: an option of the command line.
    Option(&'static str),
}

impl Place {
    /// The character of a text that begins at a byte.
    pub fn of_byte(text: &str, byte: usize) -> Place {
        let before = text.get(..byte).unwrap_or(text);
        let line = before.matches('\n').count() + 1;
        let last = before.rsplit('\n').next().unwrap_or("");
        Place::Character(line, last.chars().count() + 1)
    }

    /// The row of a table that the place is in.
    pub fn row(&self) -> Option<usize> {
        match self {
            Place::Row(row) | Place::Cell(row, _) => Some(*row),
            Place::Whole | Place::Character(..) | Place::Entry(_) | Place::Option(_) => None,
        }
    }
}

/// An error of kind `E` at a place; prints as `file: place: error`.
///
/// ```
/// use romc::files::{Located, Place};
///
/// #[derive(Debug, thiserror::Error)]
/// #[error("found `x`, expected a number")]
/// struct NoNumber;
///
/// let error: Located<NoNumber> = Located::new("jump.csv", Place::Cell(3, "Time".into()), NoNumber);
/// assert_eq!(error.to_string(), "jump.csv: row 3, column `Time`: found `x`, expected a number");
/// ```
#[derive(Debug)]
pub struct Located<E> {
    /// The file; empty for an option or argument.
    pub file: Box<str>,
    /// Where in the file.
    pub place: Place,
    /// The fault.
    pub kind: E,
}

impl<E> Located<E> {
    /// `kind` at `place` of `file`.
    pub fn new(file: &str, place: Place, kind: impl Into<E>) -> Self {
        Located {
            file: file.into(),
            place,
            kind: kind.into(),
        }
    }
}

impl<E: fmt::Display> fmt::Display for Located<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.file)?;
        match &self.place {
            Place::Whole => Ok(()),
            Place::Row(row) => write!(f, ": row {row}"),
            Place::Cell(row, column) => write!(f, ": row {row}, column `{column}`"),
            Place::Character(line, column) => write!(f, ":{line}:{column}"),
            Place::Entry(entry) => write!(f, ": {entry}"),
            Place::Option(option) => f.write_str(option),
        }?;
        match (self.file.is_empty(), &self.place) {
            (true, Place::Whole) => write!(f, "{}", self.kind),
            _ => write!(f, ": {}", self.kind),
        }
    }
}

/// The kind is part of the message, so the source is the kind's.
impl<E: Error> Error for Located<E> {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        self.kind.source()
    }
}
