//! Between NumPy arrays and nalgebra's.
//!
//! romc keeps samples as columns, column after column in memory; the same memory is a NumPy array
//! with one row per sample. So recordings and results pass without copies.

use nalgebra::{DMatrix, DVector};
use numpy::ndarray::{Array2, ArrayView1, ArrayView2, ShapeBuilder};
use numpy::{Element, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::errors::refusal;

/// A read-only array over the samples of a matrix, one row per sample.
///
/// # Safety
/// `owner` must keep `matrix` alive and unchanged.
pub unsafe fn rows<'py>(
    owner: Bound<'py, PyAny>,
    matrix: &DMatrix<f64>,
) -> Bound<'py, PyArray2<f64>> {
    let shape = (matrix.ncols(), matrix.nrows());
    let view = ArrayView2::from_shape(shape, matrix.as_slice()).expect("a matrix is contiguous");
    // SAFETY: the caller's promise.
    read_only(unsafe { PyArray2::borrow_from_array(&view, owner) })
}

/// A read-only array over a matrix as it is.
///
/// # Safety
/// As [`rows`].
pub unsafe fn matrix<'py>(
    owner: Bound<'py, PyAny>,
    matrix: &DMatrix<f64>,
) -> Bound<'py, PyArray2<f64>> {
    let view = ArrayView2::from_shape(matrix.shape().f(), matrix.as_slice());
    let view = view.expect("a matrix is contiguous");
    // SAFETY: the caller's promise.
    read_only(unsafe { PyArray2::borrow_from_array(&view, owner) })
}

/// A read-only array over values.
///
/// # Safety
/// As [`rows`].
pub unsafe fn values<'py, T: Element>(
    owner: Bound<'py, PyAny>,
    values: &[T],
) -> Bound<'py, PyArray1<T>> {
    // SAFETY: the caller's promise.
    let array = unsafe { PyArray1::borrow_from_array(&ArrayView1::from(values), owner) };
    array.readwrite().make_nonwriteable();
    array
}

/// A read-only array over tuples of equal length, one row each.
///
/// # Safety
/// As [`rows`].
pub unsafe fn tuples<'py, T: Element, const N: usize>(
    owner: Bound<'py, PyAny>,
    tuples: &[[T; N]],
) -> Bound<'py, PyArray2<T>> {
    let view = ArrayView2::from_shape((tuples.len(), N), tuples.as_flattened());
    let view = view.expect("tuples are contiguous");
    // SAFETY: the caller's promise.
    read_only(unsafe { PyArray2::borrow_from_array(&view, owner) })
}

fn read_only<T: Element>(array: Bound<'_, PyArray2<T>>) -> Bound<'_, PyArray2<T>> {
    array.readwrite().make_nonwriteable();
    array
}

/// A matrix handed over to Python, one row per column of it.
pub fn into_rows(py: Python<'_>, matrix: DMatrix<f64>) -> Bound<'_, PyArray2<f64>> {
    let shape = (matrix.ncols(), matrix.nrows());
    let values: Vec<f64> = matrix.data.into();
    let array = Array2::from_shape_vec(shape, values).expect("a matrix is contiguous");
    PyArray2::from_owned_array(py, array)
}

/// One vector per row of an array.
///
/// # Errors
/// `ModelError` for rows of another length.
pub fn vectors(
    name: &str,
    array: &PyReadonlyArray2<'_, f64>,
    width: usize,
) -> PyResult<Vec<DVector<f64>>> {
    let found = array.shape()[1];
    if found != width {
        let message = format!("`{name}`: found rows of {found} numbers, expected {width}");
        return Err(refusal(array.py(), &message, Some(name)));
    }
    let rows = array.as_array();
    let vector = |row: ArrayView1<'_, f64>| DVector::from_iterator(width, row.iter().copied());
    Ok(rows.rows().into_iter().map(vector).collect())
}

/// One row per vector.
pub fn from_vectors<'py>(
    py: Python<'py>,
    width: usize,
    vectors: &[DVector<f64>],
) -> Bound<'py, PyArray2<f64>> {
    let mut matrix = DMatrix::zeros(width, vectors.len());
    for (mut column, vector) in matrix.column_iter_mut().zip(vectors) {
        column.copy_from(vector);
    }
    into_rows(py, matrix)
}
