//! Descriptions of the tensors of a safetensors file.

use safetensors::{Dtype, SafeTensors};

use super::error::ImportError;
use super::tensors::{Element, Endian, Order, Place, TensorInfo};

/// Bytes before the header: its length.
const LENGTH_BYTES: usize = 8;

/// Describes all tensors; offsets and lengths have been checked against the file.
pub(super) fn infos(file: &str, bytes: &[u8]) -> Result<Vec<TensorInfo>, ImportError> {
    let (header, metadata) =
        SafeTensors::read_metadata(bytes).map_err(|error| ImportError::Container {
            file: file.to_owned(),
            format: "safetensors",
            found: error.to_string(),
        })?;
    let described = metadata
        .tensors()
        .into_iter()
        .map(|(name, info)| TensorInfo {
            name,
            shape: info.shape.clone(),
            element: element(info.dtype),
            order: Order::Last,
            endian: Endian::Little,
            place: Place::Bytes {
                start: LENGTH_BYTES + header + info.data_offsets.0,
            },
        });
    Ok(described.collect())
}

fn element(dtype: Dtype) -> Element {
    if dtype == Dtype::F32 {
        Element::F32
    } else if dtype == Dtype::F64 {
        Element::F64
    } else if dtype == Dtype::BOOL {
        Element::Bool
    } else {
        Element::Other(dtype.to_string())
    }
}
