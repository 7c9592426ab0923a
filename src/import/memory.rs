//! Tensors in memory, as another program of the same process holds them.

use std::borrow::Cow;

use sha2::digest::Output;
use sha2::{Digest as _, Sha256};

use super::error::{ImportError, ImportFault, shape_text};
use super::tensors::{Element, TensorFile, TensorInfo};
use crate::files::Place;

/// A named array of numbers.
#[derive(Clone, Debug)]
pub struct Tensor<'t> {
    /// Its name, by which its use is found.
    pub name: String,
    /// Dimensions.
    pub shape: Vec<usize>,
    /// As many numbers as the dimensions say.
    pub values: &'t [f64],
    /// The first index runs fastest (Fortran), not the last (C).
    pub is_column_major: bool,
}

/// Opens arrays as a file of tensors; `source` names them in errors.
pub(super) fn open<'t>(
    source: &str,
    tensors: &'t [Tensor<'t>],
) -> Result<TensorFile<'t>, ImportError> {
    let mut infos = Vec::with_capacity(tensors.len());
    for (index, tensor) in tensors.iter().enumerate() {
        let expected = tensor.shape.iter().product::<usize>();
        if tensor.values.len() != expected {
            let place = Place::Entry(format!("`{}`", tensor.name).into());
            let found = format!("{} numbers", tensor.values.len());
            let expected = format!("{expected} ({})", shape_text(&tensor.shape));
            return Err(ImportFault::at(source, place, found, expected));
        }
        infos.push(TensorInfo {
            name: tensor.name.clone(),
            shape: tensor.shape.clone(),
            element: Element::F64,
            is_column_major: tensor.is_column_major,
            is_big_endian: false,
            member: index,
            start: 0,
        });
    }
    let bytes = |info: &TensorInfo, _| Ok(Cow::Owned(little_endian(&tensors[info.member])));
    TensorFile::new(source, infos, Box::new(bytes))
}

fn little_endian(tensor: &Tensor<'_>) -> Vec<u8> {
    let values = tensor.values.iter();
    values.flat_map(|value| value.to_le_bytes()).collect()
}

/// Digest of names, dimensions and numbers.
pub(super) fn digest(tensors: &[Tensor<'_>]) -> Output<Sha256> {
    let mut digest = Sha256::new();
    for tensor in tensors {
        let (name, shape) = (&tensor.name, &tensor.shape);
        let order = if tensor.is_column_major { "F" } else { "C" };
        digest.update(format!("{name} {shape:?} {order}\n"));
        digest.update(little_endian(tensor));
    }
    digest.finalize()
}

#[cfg(test)]
mod tests {
    use super::super::{ImportOptions, import_tensors};
    use super::*;
    use crate::model::LibraryChoice;

    fn options() -> ImportOptions {
        let terms = ["1", "z1", "dz2"].map(str::to_owned);
        ImportOptions {
            name: "m".to_owned(),
            library: Some(LibraryChoice::Terms(terms.to_vec())),
            ..ImportOptions::default()
        }
    }

    fn xi(values: &[f64], is_column_major: bool) -> Tensor<'_> {
        Tensor {
            name: "xi.contact".to_owned(),
            shape: vec![3, 2],
            values,
            is_column_major,
        }
    }

    #[test]
    fn arrays_of_either_order_make_the_same_model() {
        let rows = [xi(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], false)];
        let columns = [xi(&[1.0, 3.0, 5.0, 2.0, 4.0, 6.0], true)];
        let model = |tensors: &[_]| {
            let imported = import_tensors("arrays", tensors, &options()).expect("a model");
            imported.model.phases()[0].xi.clone()
        };
        assert_eq!(model(&rows), model(&columns));
        assert_eq!(model(&rows)[(1, 0)], 3.0);
        assert_ne!(digest(&rows), digest(&columns));
    }

    #[test]
    fn numbers_that_do_not_fit_the_dimensions_are_refused() {
        let error = import_tensors("arrays", &[xi(&[1.0], false)], &options());
        let error = error.expect_err("too few numbers").to_string();
        assert!(
            error.contains("found 1 numbers, expected 6 (3 x 2)"),
            "{error}"
        );
    }
}
