//! Matrices as lists of rows and vectors as lists of numbers, for `#[serde(with = "listed")]`.

use serde::Deserialize as _;
use serde::de::{DeserializeOwned, Error as _};

use super::*;

pub(super) trait Listed: Sized {
    type List: Serialize + DeserializeOwned;

    fn to_list(&self) -> Self::List;

    /// The value of a list, or the fault in words.
    fn of_list(list: Self::List) -> Result<Self, String>;
}

impl Listed for DVector<f64> {
    type List = Vec<f64>;

    fn to_list(&self) -> Vec<f64> {
        self.as_slice().to_vec()
    }

    fn of_list(list: Vec<f64>) -> Result<Self, String> {
        Ok(list.into())
    }
}

impl Listed for DMatrix<f64> {
    type List = Vec<Vec<f64>>;

    fn to_list(&self) -> Vec<Vec<f64>> {
        let rows = self.row_iter();
        rows.map(|row| row.iter().copied().collect()).collect()
    }

    fn of_list(rows: Vec<Vec<f64>>) -> Result<Self, String> {
        let columns = rows.first().map_or(0, Vec::len);
        if let Some(row) = rows.iter().position(|row| row.len() != columns) {
            let found = rows[row].len();
            return Err(format!(
                "found {found} numbers in row [{row}], expected {columns} as in the first"
            ));
        }
        let numbers = rows.iter().flatten().copied();
        Ok(DMatrix::from_row_iterator(rows.len(), columns, numbers))
    }
}

impl<T: Listed> Listed for Option<T> {
    type List = Option<T::List>;

    fn to_list(&self) -> Self::List {
        self.as_ref().map(T::to_list)
    }

    fn of_list(list: Self::List) -> Result<Self, String> {
        list.map(T::of_list).transpose()
    }
}

pub(super) fn serialize<T: Listed, S: Serializer>(value: &T, to: S) -> Result<S::Ok, S::Error> {
    value.to_list().serialize(to)
}

pub(super) fn deserialize<'de, T: Listed, D: Deserializer<'de>>(from: D) -> Result<T, D::Error> {
    T::of_list(T::List::deserialize(from)?).map_err(D::Error::custom)
}
