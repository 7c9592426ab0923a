//! Rows of a file to matrices and back.

use nalgebra::DMatrix;

use super::error::ArtifactError;
use super::manifest::Rows;

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
            return Err(ArtifactError::RowLength {
                file: file.to_owned(),
                tensor: tensor.to_owned(),
                row,
                found: numbers.len(),
                expected,
            });
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
