//! Rows of a file to matrices and back.

use nalgebra::DMatrix;

use super::error::{ArtifactError, ArtifactFault};
use super::manifest::Rows;
use crate::files::{Located, Place};

/// The matrix with these rows; every row must have `expected` numbers, or as many as the first.
pub(super) fn from_rows(
    file: &str,
    tensor: &str,
    rows: &Rows,
    expected: Option<usize>,
) -> Result<DMatrix<f64>, ArtifactError> {
    let expected = expected.or(rows.first().map(Vec::len)).unwrap_or(0);
    for (row, numbers) in rows.iter().enumerate() {
        if numbers.len() != expected {
            let found = numbers.len();
            let place = Place::Entry(format!("`{tensor}`[{row}]").into());
            let fault = ArtifactFault::RowLength { found, expected };
            return Err(Located::new(file, place, fault));
        }
    }
    Ok(DMatrix::from_row_iterator(
        rows.len(),
        expected,
        rows.iter().flatten().copied(),
    ))
}

/// The rows of a matrix.
pub(super) fn to_rows(matrix: &DMatrix<f64>) -> Rows {
    matrix
        .row_iter()
        .map(|row| row.iter().copied().collect())
        .collect()
}
