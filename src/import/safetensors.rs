//! Safetensors files, such as PyTorch state dicts.

use std::borrow::Cow;

use safetensors::{Dtype, SafeTensors};

use super::error::{ImportError, damaged};
use super::tensors::{Element, TensorFile, TensorInfo};

/// Bytes before the header: its length.
const LENGTH_BYTES: usize = 8;

/// Opens a file; offsets and lengths of its tensors are checked against the file.
pub(super) fn open<'b>(file: &str, bytes: &'b [u8]) -> Result<TensorFile<'b>, ImportError> {
    let (header, metadata) = SafeTensors::read_metadata(bytes)
        .map_err(|error| damaged(file, "safetensors", &error.to_string()))?;
    let tensors = metadata.tensors().into_iter();
    let infos = tensors.map(|(name, info)| TensorInfo {
        name,
        shape: info.shape.clone(),
        element: match info.dtype {
            Dtype::F32 => Element::F32,
            Dtype::F64 => Element::F64,
            Dtype::BOOL => Element::Bool,
            other => Element::Other(other.to_string()),
        },
        is_column_major: false,
        is_big_endian: false,
        member: 0,
        start: LENGTH_BYTES + header + info.data_offsets.0,
    });
    let read = |info: &TensorInfo, length| Ok(Cow::from(&bytes[info.start..info.start + length]));
    TensorFile::new(file, infos.collect(), Box::new(read))
}
