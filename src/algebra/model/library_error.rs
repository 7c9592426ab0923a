//! Why a library was refused.

#![allow(missing_docs, reason = "each variant's message names its fields")]

use thiserror::Error;

use super::library::{MAX_LATENT_DIM, MAX_LIBRARY_DIM, MAX_TERM_LEN};
use super::standard_library::MAX_DEGREE;
use crate::symbolic::ParseError;

/// Why a library was refused.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum LibraryError {
    /// Too few or too many latent coordinates.
    #[error("`latent_dim`: found {found}, expected 1 to {MAX_LATENT_DIM}")]
    LatentDim { found: usize },
    /// No term at all.
    #[error("`library`: found no term, expected at least one")]
    Empty,
    /// More terms than can be handled.
    #[error("`library`: found {found} terms, expected at most {MAX_LIBRARY_DIM}")]
    TooManyTerms { found: usize },
    /// The shorthand asks for a polynomial degree beyond the bound.
    #[error("`library.degree`: found {found}, expected at most {MAX_DEGREE}")]
    Degree { found: u32 },
    /// A term is too long or has control characters.
    #[error(
        "`library`[{index}]: found {found} bytes or a control character, expected one line of at most {MAX_TERM_LEN} bytes"
    )]
    TermText {
        /// Index of the term, from 0.
        index: usize,
        found: usize,
    },
    /// A term is no expression over the model's variables.
    #[error("`library`[{index}]: {text:?} is not a candidate term")]
    Parse {
        /// Index of the term, from 0.
        index: usize,
        text: String,
        #[source]
        source: Box<ParseError>,
    },
    /// A term equals an earlier one, which a library to be trained on must not have.
    #[error("`library`[{second}]: {text:?} equals [{first}] {earlier:?}")]
    Duplicate {
        first: usize,
        second: usize,
        text: String,
        earlier: String,
    },
    /// A part of a term without variables has no finite value, such as `1/0`.
    #[error("`library`[{index}]: a constant part of {text:?} has no finite value")]
    NotFinite {
        /// Index of the term, from 0.
        index: usize,
        text: String,
    },
    /// A term vanishes for all arguments.
    #[error("`library`[{index}]: {text:?} is zero everywhere")]
    Zero {
        /// Index of the term, from 0.
        index: usize,
        text: String,
    },
}
