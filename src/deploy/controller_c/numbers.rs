//! Numbers as initialisers of C.

use nalgebra::DMatrix;

use crate::codegen::Precision;

/// Numbers per line.
const WIDTH: usize = 6;

/// Writes numbers of one precision.
#[derive(Debug, Clone, Copy)]
pub(in crate::deploy) struct Numbers(pub Precision);

impl Numbers {
    /// One number, with a suffix in single precision.
    pub(super) fn one(self, value: f64) -> String {
        match self.0 {
            Precision::Double => format!("{value:?}"),
            Precision::Single => format!("{:?}f", value as f32),
        }
    }

    /// `{1.0, 2.0}`; one zero if there are none, as C has no empty arrays.
    pub(in crate::deploy) fn vector(self, values: impl IntoIterator<Item = f64>) -> String {
        list(values.into_iter().map(|value| self.one(value)))
    }

    /// The first rows of a matrix.
    pub(super) fn rows(self, matrix: &DMatrix<f64>, count: usize) -> String {
        let row = |i| (0..matrix.ncols()).map(move |j| matrix[(i, j)]);
        self.matrix((0..count).map(row))
    }

    /// Rows of vectors; one row of zeros if there are none.
    pub(in crate::deploy) fn matrix<R: IntoIterator<Item = f64>>(
        self,
        rows: impl IntoIterator<Item = R>,
    ) -> String {
        nested(rows.into_iter().map(|row| self.vector(row)))
    }
}

/// An initialiser of initialisers, one per line.
pub(in crate::deploy) fn nested(rows: impl IntoIterator<Item = String>) -> String {
    let rows: Vec<String> = rows.into_iter().collect();
    match rows.is_empty() {
        true => "{{0}}".to_owned(),
        false => format!("{{\n    {},\n}}", rows.join(",\n    ")),
    }
}

/// An initialiser of integers.
pub(in crate::deploy) fn integers(values: impl IntoIterator<Item = i64>) -> String {
    list(values.into_iter().map(|value| value.to_string()))
}

/// An initialiser with one zero at least.
pub(in crate::deploy) fn list(values: impl Iterator<Item = String>) -> String {
    let values: Vec<String> = values.collect();
    if values.is_empty() {
        return "{0}".to_owned();
    }
    let lines: Vec<String> = values.chunks(WIDTH).map(|line| line.join(", ")).collect();
    format!("{{{}}}", lines.join(",\n     "))
}
