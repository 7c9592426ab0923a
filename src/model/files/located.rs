//! Errors with their place in a file: one type for the faults of all readers.

use std::convert::Infallible;
use std::error::Error;

use super::*;

#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    Whole,
    Row(usize),
    Cell(usize, Box<str>),
    Character(usize, usize),
    Entry(Box<str>),
    /// A path of keys in a JSON file, such as `encoder.weights[3][2]`, with line and column.
    Key(Box<str>, usize, usize),
    /// No place in a file: an option of the command line.
    Option(&'static str),
}

impl Place {
    pub fn of_byte(text: &str, byte: usize) -> Place {
        let before = text.get(..byte).unwrap_or(text);
        let line = before.matches('\n').count() + 1;
        let last = before.rsplit('\n').next().unwrap_or("");
        Place::Character(line, last.chars().count() + 1)
    }

    pub fn row(&self) -> Option<usize> {
        match self {
            Place::Row(row) | Place::Cell(row, _) => Some(*row),
            _ => None,
        }
    }
}

impl From<&str> for Place {
    fn from(entry: &str) -> Self {
        Place::Entry(entry.into())
    }
}

impl From<String> for Place {
    fn from(entry: String) -> Self {
        Place::Entry(entry.into())
    }
}

impl From<(usize, usize)> for Place {
    fn from((line, column): (usize, usize)) -> Self {
        Place::Character(line, column)
    }
}

#[derive(Debug, thiserror::Error)]
pub enum Fault<C: Error + 'static = Infallible> {
    #[error("cannot {action}")]
    Io {
        action: &'static str,
        source: io::Error,
    },
    #[error("found {found}, expected {expected}")]
    Unexpected { found: Box<str>, expected: Box<str> },
    /// A text that breaks a grammar, in the words of its parser, or a fault without alternative.
    #[error("{0}")]
    Text(Box<str>),
    #[error("not a usable model")]
    Unusable(#[source] Box<C>),
}

/// An error of kind `E` at a place; prints as `file: place: error`.
///
/// ```
/// use romc::files::{Fault, Located, Place};
///
/// let error: Located<Fault> = Located::at("jump.csv", Place::Cell(3, "Time".into()), "`x`", "a number");
/// assert_eq!(error.to_string(), "jump.csv: row 3, column `Time`: found `x`, expected a number");
/// ```
#[derive(Debug)]
pub struct Located<E> {
    /// The file; empty for an option or argument.
    pub file: Box<str>,
    pub place: Place,
    pub kind: E,
}

impl<E> Located<E> {
    pub fn new(file: &str, place: Place, kind: impl Into<E>) -> Self {
        Located {
            file: file.into(),
            place,
            kind: kind.into(),
        }
    }
}

impl<C: Error + 'static> Located<Fault<C>> {
    pub fn at(
        file: &str,
        place: impl Into<Place>,
        found: impl Into<Box<str>>,
        expected: impl Into<Box<str>>,
    ) -> Self {
        let (found, expected) = (found.into(), expected.into());
        Self::new(file, place.into(), Fault::Unexpected { found, expected })
    }

    pub fn option(
        option: &'static str,
        found: impl Into<Box<str>>,
        expected: impl Into<Box<str>>,
    ) -> Self {
        Self::at("", Place::Option(option), found, expected)
    }

    pub fn text(file: &str, place: impl Into<Place>, text: impl Into<Box<str>>) -> Self {
        Self::new(file, place.into(), Fault::Text(text.into()))
    }

    pub fn io(file: &str, action: &'static str, source: io::Error) -> Self {
        Self::new(file, Place::Whole, Fault::Io { action, source })
    }

    pub fn unusable(file: &str, source: impl Into<C>) -> Self {
        Self::new(file, Place::Whole, Fault::Unusable(Box::new(source.into())))
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
            Place::Key(path, line, column) => {
                write!(f, ": at `{path}`, line {line}, column {column}")
            }
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
