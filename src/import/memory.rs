//! Tensors in memory, as another program of the same process holds them.

use sha2::digest::Output;
use sha2::{Digest as _, Sha256};

use super::error::{ImportError, shape_text};
use super::tensors::{Container, TensorFile, TensorInfo};

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
            let place = format!("`{}`", tensor.name);
            let found = format!("{} numbers", tensor.values.len());
            let expected = format!("{expected} ({})", shape_text(&tensor.shape));
            return Err(ImportError::at(source, place, found, expected));
        }
        infos.push(TensorInfo {
            name: tensor.name.clone(),
            shape: tensor.shape.clone(),
            is_column_major: tensor.is_column_major,
            member: index,
            ..TensorInfo::default()
        });
    }
    TensorFile::new(source, infos, Container::Memory(tensors))
}

pub(super) fn little_endian(tensor: &Tensor<'_>) -> Vec<u8> {
    let values = tensor.values.iter();
    values.flat_map(|value| value.to_le_bytes()).collect()
}

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
