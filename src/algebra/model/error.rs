//! Faults of models, and of calls of their functions.

#![allow(missing_docs, reason = "each variant's message names its fields")]

use nalgebra::{Dim, Matrix, RawStorage};
use thiserror::Error;

use super::identifier::IdentifierError;
use super::library::{MAX_LATENT_DIM, MAX_LIBRARY_DIM, MAX_TERM_LEN};
use super::standard_library::MAX_DEGREE;
use crate::robot::RobotError;
use crate::symbolic::ParseError;

/// Why a model was refused, or could not answer.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ModelError {
    /// The model's or a phase's name cannot become an identifier.
    #[error("{what} {name:?} cannot be used in generated code")]
    Name {
        /// `model name` or `phases[i].name`.
        what: String,
        name: String,
        #[source]
        source: IdentifierError,
    },
    /// A part has another size or value than it can have, or does not fit the others.
    #[error("{place}: found {found}, expected {expected}")]
    Invalid {
        /// Path in the model file, such as `` `phases[0].xi` ``.
        place: String,
        found: String,
        expected: String,
    },
    /// The foot rule of a phase can never be the first that matches.
    #[error(
        "phases[{phase}].feet of {name:?}: no foot pattern selects this phase, because earlier phases take all that it names"
    )]
    UnreachablePhase { phase: usize, name: String },
    /// A tensor holds an infinity or a NaN.
    #[error("`{tensor}`[{row}][{column}]: found {found}, expected a finite number")]
    NonFinite {
        tensor: String,
        /// Row, from 0.
        row: usize,
        /// Column, from 0.
        column: usize,
        found: f64,
    },
    /// The rows of the encoder or of its Jacobian are (nearly) linearly dependent, so that latent
    /// inputs have no unique lift.
    #[error(
        "{matrix}: found singular values from {smallest:e} to {largest:e}, expected full row rank {expected} (smallest above {tolerance:e} times the largest)"
    )]
    RankDeficient {
        matrix: &'static str,
        smallest: f64,
        largest: f64,
        expected: usize,
        tolerance: f64,
    },
    /// The library was refused.
    #[error(transparent)]
    Library(#[from] LibraryError),
    /// The robot is unknown.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// A part of the file makes sense only with another.
    #[error("`{part}` needs `{needs}`, which the model does not have")]
    Incomplete {
        part: &'static str,
        needs: &'static str,
    },
    /// The model was asked for something it does not carry.
    #[error("model {model} has no `{part}`, needed for {purpose}")]
    Missing {
        model: String,
        /// Key of the model file which is absent.
        part: &'static str,
        purpose: &'static str,
    },
    /// Something needs a linear encoder or decoder, and the model's has activations.
    #[error("model {model}: found a nonlinear {part}, expected a linear one, needed for {purpose}")]
    Nonlinear {
        model: String,
        /// `encoder` or `decoder`.
        part: &'static str,
        purpose: &'static str,
    },
    /// A vector has the wrong length.
    #[error("{what}: found {found} entries, expected {expected}")]
    Dimension {
        what: &'static str,
        found: usize,
        expected: usize,
    },
    /// There is no phase with this index.
    #[error("found phase {found}, expected one below {count}")]
    PhaseIndex { found: usize, count: usize },
}

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
    /// A part of a term without variables is beyond the range of floats, such as `exp(1000)`.
    #[error(
        "`library`[{index}]: a constant part of {text:?} has no value that floats hold (up to 1.8e308)"
    )]
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

impl ModelError {
    /// `found` at a place, where `expected` should be.
    pub(crate) fn invalid(
        place: impl Into<String>,
        found: impl ToString,
        expected: impl Into<String>,
    ) -> Self {
        ModelError::Invalid {
            place: place.into(),
            found: found.to_string(),
            expected: expected.into(),
        }
    }

    /// A matrix of numbers of such different sizes that an iteration does not end.
    pub(super) fn no_decomposition(tensor: &str) -> Self {
        let found = "singular values or eigenvalues that could not be computed";
        ModelError::invalid(format!("`{tensor}`"), found, "numbers of similar size")
    }

    /// Refuses a vector of another length than expected.
    pub(super) fn check_dimension(
        what: &'static str,
        found: usize,
        expected: usize,
    ) -> Result<(), ModelError> {
        match found == expected {
            true => Ok(()),
            false => Err(ModelError::Dimension {
                what,
                found,
                expected,
            }),
        }
    }
}

/// Refuses a tensor of another shape than expected.
pub(super) fn check_shape(
    tensor: &str,
    found: (usize, usize),
    expected: (usize, usize),
) -> Result<(), ModelError> {
    if found == expected {
        return Ok(());
    }
    let [found, expected] = [found, expected].map(|(rows, columns)| format!("{rows} x {columns}"));
    let (place, expected) = (format!("`{tensor}`"), expected + " (rows x columns)");
    Err(ModelError::invalid(place, found, expected))
}

/// Refuses a tensor of another shape than expected, or with an entry that is no number.
pub(super) fn check_tensor<R: Dim, C: Dim, S: RawStorage<f64, R, C>>(
    tensor: &str,
    found: &Matrix<f64, R, C, S>,
    expected: (usize, usize),
) -> Result<(), ModelError> {
    check_shape(tensor, found.shape(), expected)?;
    check_finite(tensor, found)
}

/// Refuses the first entry that is infinite or not a number.
pub(super) fn check_finite<R: Dim, C: Dim, S: RawStorage<f64, R, C>>(
    tensor: &str,
    values: &Matrix<f64, R, C, S>,
) -> Result<(), ModelError> {
    for row in 0..values.nrows() {
        for column in 0..values.ncols() {
            let found = values[(row, column)];
            if !found.is_finite() {
                return Err(ModelError::NonFinite {
                    tensor: tensor.to_owned(),
                    row,
                    column,
                    found,
                });
            }
        }
    }
    Ok(())
}
