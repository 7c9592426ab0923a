//! NumPy's `.npz`: a zip file of `.npy` arrays.
//!
//! Only headers are read until an array is asked for, and then no more bytes are unpacked than its header announces: a
//! small file cannot fill the memory. An array is `\x93NUMPY`, two bytes of the version (1 to 3), the length of the
//! rest (2 or 4 bytes, little endian), and a Python dictionary: `{'descr': '<f8', 'fortran_order': False, 'shape': (18,
//! 4), }`.

use std::borrow::Cow;
use std::fmt::Display;
use std::io::{self, Cursor, Read};

use zip::ZipArchive;

use super::ImportError;
use super::run::{self, too_large};
use super::tensors::{TensorFile, TensorInfo};
use crate::files::Place;

const MAX_MEMBERS: usize = 10_000;
const MAGIC: &[u8; 6] = b"\x93NUMPY";
const MAX_HEADER_BYTES: usize = 1 << 16;
const MAX_RANK: usize = 32;

type Archive<'b> = ZipArchive<Cursor<&'b [u8]>>;

pub(super) fn open<'b>(file: &str, bytes: &'b [u8]) -> Result<TensorFile<'b>, ImportError> {
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(|e| damaged(file, e))?;
    if archive.has_duplicate_names() {
        return Err(damaged(file, "two arrays of one name"));
    }
    if archive.len() > MAX_MEMBERS {
        let max = MAX_MEMBERS as u64;
        return Err(too_large(file, Place::Whole, max, "arrays"));
    }
    let mut infos = Vec::new();
    for member in 0..archive.len() {
        infos.extend(describe(file, &mut archive, member)?);
    }
    let file_name = file.to_owned();
    let numbers = move |info: &TensorInfo, length| numbers(&file_name, bytes, info, length);
    TensorFile::new(file, infos, Box::new(numbers))
}

fn damaged(file: &str, error: impl Display) -> ImportError {
    run::damaged(file, "npz", &error.to_string())
}

fn describe(
    file: &str,
    archive: &mut Archive<'_>,
    member: usize,
) -> Result<Option<TensorInfo>, ImportError> {
    let mut entry = archive.by_index(member).map_err(|e| damaged(file, e))?;
    let name = entry.name().map_err(|e| damaged(file, e))?.into_owned();
    let Some(name) = name.strip_suffix(".npy") else {
        return Ok(None);
    };
    match read_header(&mut entry) {
        Ok(header) => Ok(Some(TensorInfo {
            name: name.to_owned(),
            member,
            ..header
        })),
        Err((found, expected)) => Err(ImportError::at(file, format!("`{name}`"), found, expected)),
    }
}

fn numbers(
    file: &str,
    bytes: &[u8],
    info: &TensorInfo,
    length: usize,
) -> Result<Cow<'static, [u8]>, ImportError> {
    let refused = |found: String| {
        let place = format!("`{}`", info.name);
        let expected = "as many bytes as its shape and type need";
        ImportError::at(file, place, found, expected)
    };
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(|e| damaged(file, e))?;
    let member = (archive.by_index(info.member)).map_err(|error| refused(error.to_string()))?;
    let mut unpacked = Vec::new();
    // One byte more than needed reveals an array that is too long; it also reaches the end of the member, where the
    // checksum is compared.
    (member.take((info.start + length + 1) as u64))
        .read_to_end(&mut unpacked)
        .map_err(|error| refused(error.to_string()))?;
    match unpacked.len().checked_sub(info.start) {
        Some(found) if found == length => Ok(unpacked.split_off(info.start).into()),
        Some(found) if found < length => Err(refused(format!("{found} bytes"))),
        Some(_) => Err(refused(format!("more than {length} bytes"))),
        None => Err(refused("no bytes".to_owned())),
    }
}

/// The description in an array's header, without name and member; else what was found and expected.
fn read_header(reader: &mut impl Read) -> Result<TensorInfo, (String, &'static str)> {
    let io = |error: io::Error| (error.to_string(), "a readable .npy array");
    let mut fixed = [0; 8];
    reader.read_exact(&mut fixed).map_err(io)?;
    if !fixed.starts_with(MAGIC) {
        let found = "another kind of file".to_owned();
        return Err((found, "an array that starts with \\x93NUMPY"));
    }
    let length_bytes = match fixed[6] {
        1 => 2,
        2 | 3 => 4,
        version => return Err((format!("version {version}"), "version 1, 2 or 3")),
    };
    let mut length = [0; 4];
    reader.read_exact(&mut length[..length_bytes]).map_err(io)?;
    let length = u32::from_le_bytes(length) as usize;
    if length > MAX_HEADER_BYTES {
        return Err((format!("a header of {length} bytes"), "at most 65536 bytes"));
    }
    let mut text = vec![0; length];
    reader.read_exact(&mut text).map_err(io)?;
    let text = String::from_utf8_lossy(&text);
    let start = fixed.len() + length_bytes + length;
    let found = || "a header that cannot be read".to_owned();
    parse_header(&text, start).ok_or_else(|| (found(), "descr, fortran_order and shape"))
}

fn parse_header(text: &str, start: usize) -> Option<TensorInfo> {
    let value = |key: &str| {
        let quoted = ["'", "\""].map(|quote| format!("{quote}{key}{quote}"));
        let (_, after) = quoted.iter().find_map(|key| text.split_once(key))?;
        Some(after.trim_start().strip_prefix(':')?.trim_start())
    };
    let (element, is_big_endian) = parse_element(value("descr")?)?;
    let order = value("fortran_order")?;
    let is_column_major = order.starts_with("True");
    (is_column_major || order.starts_with("False")).then_some(())?;
    Some(TensorInfo {
        shape: parse_shape(value("shape")?)?,
        element,
        is_column_major,
        is_big_endian,
        start,
        ..TensorInfo::default()
    })
}

/// `'<f8'` and its relatives, with the flag of big-endian numbers.
fn parse_element(text: &str) -> Option<((String, usize), bool)> {
    if text.starts_with('[') {
        return Some((("a structure".to_owned(), 0), false));
    }
    let quote = text.chars().next().filter(|c| matches!(c, '\'' | '"'))?;
    let (descr, _) = text[1..].split_once(quote)?;
    let element = match descr.trim_start_matches(['<', '>', '|', '=']) {
        "f4" => ("f32".to_owned(), 4),
        "f8" => ("f64".to_owned(), 8),
        "b1" | "?" => ("bool".to_owned(), 1),
        _ => {
            let short: String = descr.chars().take(40).collect();
            (format!("{short:?}"), 0)
        }
    };
    Some((element, descr.starts_with('>')))
}

/// `(18, 4)`, `(4,)` or `()`; Python 2 wrote `(18L, 4L)`.
fn parse_shape(text: &str) -> Option<Vec<usize>> {
    let (inside, _) = text.strip_prefix('(')?.split_once(')')?;
    let inside = inside.trim().strip_suffix(',').unwrap_or(inside.trim());
    if inside.is_empty() {
        return Some(Vec::new());
    }
    let dims = inside.split(',').map(|dim| {
        let digits = dim.trim().trim_end_matches('L');
        let is_number = digits.starts_with(|c: char| c.is_ascii_digit());
        digits.parse().ok().filter(|_| is_number)
    });
    let dims: Vec<usize> = dims.collect::<Option<_>>()?;
    (dims.len() <= MAX_RANK).then_some(dims)
}
