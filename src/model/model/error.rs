//! Faults of models, and of calls of their functions.

use super::*;

pub(super) type Result<T, E = ModelError> = std::result::Result<T, E>;

#[derive(Clone, Debug, PartialEq, Error)]
pub enum ModelError {
    #[error("{what} {name:?} cannot be used in generated code")]
    Name {
        /// `model name` or `phases[i].name`.
        what: String,
        name: String,
        #[source]
        source: IdentifierError,
    },
    #[error("{place}: found {found}, expected {expected}")]
    Invalid {
        /// Path in the model file, such as `` `phases[0].xi` ``.
        place: String,
        found: String,
        expected: String,
    },
    #[error("`library`[{index}]: {text:?} is not a candidate term")]
    Term {
        index: usize,
        text: String,
        #[source]
        source: Box<ParseError>,
    },
    #[error(
        "phases[{phase}].feet of {name:?}: no foot pattern selects this phase, because earlier phases already select all its patterns"
    )]
    UnreachablePhase { phase: usize, name: String },
    #[error("`{tensor}`[{row}][{column}]: found {found}, expected a finite number")]
    NonFinite {
        tensor: String,
        row: usize,
        column: usize,
        found: f64,
    },
    #[error(transparent)]
    Robot(#[from] RobotError),
    #[error("`{part}` needs `{needs}`, which the model does not have")]
    Incomplete {
        part: &'static str,
        needs: &'static str,
    },
    #[error("model {model} has no `{part}`, needed for {purpose}")]
    Missing {
        model: String,
        part: &'static str,
        purpose: &'static str,
    },
    #[error("model {model}: found a nonlinear {part}, expected a linear one, needed for {purpose}")]
    Nonlinear {
        model: String,
        part: &'static str,
        purpose: &'static str,
    },
    #[error("found phase {found}, expected one below {count}")]
    PhaseIndex { found: usize, count: usize },
}

impl ModelError {
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

    /// A matrix with numbers of such different sizes that an iteration does not converge.
    pub(super) fn no_decomposition(tensor: &str) -> Self {
        let found = "singular values or eigenvalues that could not be computed";
        ModelError::invalid(format!("`{tensor}`"), found, "numbers of similar size")
    }

    pub(super) fn check_dimension(what: &str, found: usize, dim: usize) -> Result<()> {
        check(found == dim, what, || format!("{found} entries"), dim)
    }
}

pub(super) fn check<F: ToString>(
    is_expected: bool,
    place: &str,
    found: impl FnOnce() -> F,
    expected: impl ToString,
) -> Result<()> {
    match is_expected {
        true => Ok(()),
        false => Err(ModelError::invalid(place, found(), expected.to_string())),
    }
}

pub(super) fn check_count(
    place: &str,
    found: usize,
    things: &str,
    range: RangeInclusive<usize>,
) -> Result<()> {
    let expected = format!("{} to {}", range.start(), range.end());
    let text = || format!("{found} {things}").trim_end().to_owned();
    check(range.contains(&found), place, text, expected)
}

pub(super) fn check_shape(
    tensor: &str,
    found: (usize, usize),
    expected: (usize, usize),
) -> Result<()> {
    let text = |(rows, columns)| format!("{rows} x {columns}");
    let (place, wanted) = (format!("`{tensor}`"), text(expected) + " (rows x columns)");
    check(found == expected, &place, || text(found), wanted)
}

pub(super) fn check_tensor<R: Dim, C: Dim, S: RawStorage<f64, R, C>>(
    tensor: &str,
    found: &Matrix<f64, R, C, S>,
    expected: (usize, usize),
) -> Result<()> {
    check_shape(tensor, found.shape(), expected)?;
    check_finite(tensor, found)
}

pub(super) fn check_finite<R: Dim, C: Dim, S: RawStorage<f64, R, C>>(
    tensor: &str,
    values: &Matrix<f64, R, C, S>,
) -> Result<()> {
    let columns = values.ncols();
    let mut places = (0..values.len()).map(|k| (k / columns, k % columns));
    match places.find(|&place| !values[place].is_finite()) {
        None => Ok(()),
        Some((row, column)) => Err(ModelError::NonFinite {
            tensor: tensor.to_owned(),
            row,
            column,
            found: values[(row, column)],
        }),
    }
}
