//! NumPy's `.npz`: a zip file of `.npy` arrays.
//!
//! Only headers are read until an array is asked for, and then no more bytes are unpacked than its
//! header announces: a small file cannot fill the memory.

use std::io::{Cursor, Read};

use zip::ZipArchive;
use zip::result::ZipError;

use super::error::ImportError;
use super::npy::{self, HeaderError};
use super::tensors::{Place, TensorInfo};

type Archive<'b> = ZipArchive<Cursor<&'b [u8]>>;

/// Most members that a file may have.
const MAX_MEMBERS: usize = 10_000;

/// Describes all arrays.
pub(super) fn infos(file: &str, bytes: &[u8]) -> Result<Vec<TensorInfo>, ImportError> {
    let mut archive = open(file, bytes)?;
    if archive.len() > MAX_MEMBERS {
        return Err(ImportError::TooLarge {
            file: file.to_owned(),
            what: "the file".to_owned(),
            max: MAX_MEMBERS as u64,
            unit: "arrays",
        });
    }
    let mut infos = Vec::new();
    for index in 0..archive.len() {
        infos.extend(info(file, &mut archive, index)?);
    }
    Ok(infos)
}

/// The bytes of an array's numbers.
pub(super) fn data(
    file: &str,
    bytes: &[u8],
    info: &TensorInfo,
    index: usize,
    header: usize,
    length: usize,
) -> Result<Vec<u8>, ImportError> {
    let damaged = |found: String| ImportError::Array {
        file: file.to_owned(),
        tensor: info.name.clone(),
        found,
        expected: "as many bytes as its shape and type need",
    };
    let mut archive = open(file, bytes)?;
    let member = archive
        .by_index(index)
        .map_err(|error| damaged(error.to_string()))?;
    let mut unpacked = Vec::new();
    // One byte more than needed tells an array that is too long; it also reaches the end of the
    // member, where the checksum is compared.
    member
        .take((header + length + 1) as u64)
        .read_to_end(&mut unpacked)
        .map_err(|error| damaged(error.to_string()))?;
    if unpacked.len() != header + length {
        let found = match unpacked.len().checked_sub(header) {
            Some(found) if found <= length => format!("{found} bytes"),
            Some(_) => format!("more than {length} bytes"),
            None => "no bytes".to_owned(),
        };
        return Err(damaged(found));
    }
    unpacked.drain(..header);
    Ok(unpacked)
}

fn open<'b>(file: &str, bytes: &'b [u8]) -> Result<Archive<'b>, ImportError> {
    ZipArchive::new(Cursor::new(bytes)).map_err(|error| ImportError::Container {
        file: file.to_owned(),
        format: "npz",
        found: error.to_string(),
    })
}

/// Describes a member; `None` for one that is no array.
fn info(
    file: &str,
    archive: &mut Archive<'_>,
    index: usize,
) -> Result<Option<TensorInfo>, ImportError> {
    let container = |error: ZipError| ImportError::Container {
        file: file.to_owned(),
        format: "npz",
        found: error.to_string(),
    };
    let mut member = archive.by_index(index).map_err(container)?;
    let name = member.name().map_err(container)?.into_owned();
    let Some(name) = name.strip_suffix(".npy").map(str::to_owned) else {
        return Ok(None);
    };
    let header = npy::read_header(&mut member).map_err(|error| {
        let (found, expected) = match error {
            HeaderError::Read(error) => (error.to_string(), "a readable .npy array"),
            HeaderError::Content { found, expected } => (found, expected),
        };
        ImportError::Array {
            file: file.to_owned(),
            tensor: name.clone(),
            found,
            expected,
        }
    })?;
    Ok(Some(TensorInfo {
        name,
        shape: header.shape,
        element: header.element,
        order: header.order,
        endian: header.endian,
        place: Place::Member {
            index,
            header: header.length,
        },
    }))
}
