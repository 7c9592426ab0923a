//! Named arrays of numbers, in a foreign file or in memory. Headers are read first, and later no more bytes than they
//! announce: a small file cannot fill the memory. In an npz (zip) file, an array begins with `\x93NUMPY`, two bytes of
//! the version (1 to 3) and the length of the rest (2 or 4 bytes, little endian). A Python dictionary follows:
//! `{'descr': '<f8', 'fortran_order': False, 'shape': (18, 4), }`.

use std::borrow::Cow;
use std::fmt::Display;

use safetensors::{Dtype, SafeTensors};
use sha2::digest::Output;
use zip::ZipArchive;

use super::run::{damaged, too_large};
use super::*;

/// Largest tensor that is read: the coefficients of the largest library fit twice.
const MAX_ELEMENTS: usize = 4 << 20;
/// Bytes before the header of a safetensors file: its length.
const LENGTH_BYTES: usize = 8;

/// A named array of numbers.
#[derive(Clone, Debug)]
pub struct Tensor<'t> {
    /// Its name, by which its use is found.
    pub name: String,
    /// Dimensions.
    pub shape: Vec<usize>,
    /// As many numbers as the product of the dimensions.
    pub values: &'t [f64],
    /// The first index runs fastest (Fortran), not the last (C).
    pub is_column_major: bool,
}

impl Tensor<'_> {
    fn little_endian(&self) -> Vec<u8> {
        let values = self.values.iter();
        values.flat_map(|value| value.to_le_bytes()).collect()
    }
}

#[derive(Clone, Debug, Default)]
pub(super) struct TensorInfo {
    pub(super) name: String,
    pub(super) shape: Vec<usize>,
    /// The type of its numbers, and the bytes of one: 8, 4 (floats) or 1 (truth values), 0 for types that are not read.
    pub(super) element: (String, usize),
    pub(super) is_column_major: bool,
    pub(super) is_big_endian: bool,
    /// Member of a zip file, or place among the arrays in memory.
    pub(super) member: usize,
    /// First byte of the numbers in the member or file.
    pub(super) start: usize,
}

impl TensorInfo {
    pub(super) fn describe(&self) -> String {
        format!("`{}` ({})", self.name, shape_text(&self.shape))
    }

    fn index_of(&self, mut position: usize) -> Vec<usize> {
        let rank = self.shape.len();
        let mut index = vec![0; rank];
        for step in 0..rank {
            let axis = if self.is_column_major {
                step
            } else {
                rank - 1 - step
            };
            index[axis] = position % self.shape[axis];
            position /= self.shape[axis];
        }
        index
    }

    fn decode(&self, number: &[u8]) -> f64 {
        let mut little = number.to_vec();
        if self.is_big_endian {
            little.reverse();
        }
        match *little.as_slice() {
            [a, b, c, d, e, f, g, h] => f64::from_le_bytes([a, b, c, d, e, f, g, h]),
            [a, b, c, d] => f64::from(f32::from_le_bytes([a, b, c, d])),
            _ => f64::from(u8::from(little != [0])),
        }
    }
}

/// The bytes of a tensor's numbers, so many.
type Bytes<'b> = dyn Fn(&TensorInfo, usize) -> Read<Cow<'b, [u8]>> + 'b;

/// A file of tensors: their descriptions, and their numbers, which are read one tensor at a time.
pub(super) struct TensorFile<'b> {
    pub(super) file: String,
    /// By their names.
    pub(super) infos: Vec<TensorInfo>,
    bytes: Box<Bytes<'b>>,
}

impl<'b> TensorFile<'b> {
    pub(super) fn new(
        file: &str,
        mut infos: Vec<TensorInfo>,
        bytes: Box<Bytes<'b>>,
    ) -> Read<TensorFile<'b>> {
        infos.sort_by(|a, b| a.name.cmp(&b.name));
        if let Some(pair) = infos.windows(2).find(|pair| pair[0].name == pair[1].name) {
            let (place, found) = (format!("`{}`", pair[0].name), "two tensors of this name");
            return Err(ImportError::at(file, place, found, "different names"));
        }
        let file = file.to_owned();
        Ok(TensorFile { file, infos, bytes })
    }

    pub(super) fn listing(&self) -> String {
        const MOST: usize = 24;
        let shown = self.infos.iter().take(MOST).map(TensorInfo::describe);
        let mut texts: Vec<String> = shown.collect();
        match self.infos.len().saturating_sub(MOST) {
            0 if texts.is_empty() => return "no tensors at all".to_owned(),
            0 => {}
            more => texts.push(format!("{more} more")),
        }
        texts.join(", ")
    }

    pub(super) fn refused(
        &self,
        place: impl Into<Place>,
        found: impl Into<Box<str>>,
        expected: impl Into<Box<str>>,
    ) -> ImportError {
        ImportError::at(&self.file, place, found, expected)
    }

    pub(super) fn missing(&self, role: &dyn Display) -> ImportError {
        let found = format!("no tensor for {role} among {}", self.listing());
        let expected = format!("a tensor of that name, or --map {role}=TENSOR");
        self.refused(Place::Whole, found, expected)
    }

    /// The numbers of a tensor, all finite, as many as the matrix has; `place` names its use in errors.
    pub(super) fn read(
        &self,
        info: &TensorInfo,
        (rows, columns): (usize, usize),
        place: impl Fn(&[usize]) -> Place,
    ) -> Read<DMatrix<f64>> {
        let (element, size) = (&info.element.0, info.element.1);
        if size == 0 {
            let found = format!("numbers of type {element}");
            return Err(self.refused(place(&[]), found, "f32 or f64"));
        }
        let count = (info.shape.iter()).try_fold(1usize, |count, &dim| count.checked_mul(dim));
        let Some(count) = count.filter(|&count| count <= MAX_ELEMENTS) else {
            let (max, unit) = (MAX_ELEMENTS as u64, "numbers");
            return Err(too_large(&self.file, place(&[]), max, unit));
        };
        let bytes = (self.bytes)(info, size * count)?;
        let numbers = bytes.chunks_exact(size);
        let values: Vec<f64> = numbers.map(|number| info.decode(number)).collect();
        match values.iter().position(|value| !value.is_finite()) {
            None if info.is_column_major => Ok(DMatrix::from_column_slice(rows, columns, &values)),
            None => Ok(DMatrix::from_row_slice(rows, columns, &values)),
            Some(position) => {
                let place = place(&info.index_of(position));
                Err(self.refused(place, values[position].to_string(), "a finite number"))
            }
        }
    }
}

/// Opens a file; offsets and lengths of its tensors are checked against the file.
pub(super) fn open_safetensors<'b>(file: &str, bytes: &'b [u8]) -> Read<TensorFile<'b>> {
    let (header, metadata) =
        SafeTensors::read_metadata(bytes).map_err(|error| damaged(file, "safetensors", error))?;
    let tensors = metadata.tensors().into_iter();
    let infos = tensors.map(|(name, info)| TensorInfo {
        name,
        shape: info.shape.clone(),
        element: match info.dtype {
            Dtype::F32 => ("f32".to_owned(), 4),
            Dtype::F64 => ("f64".to_owned(), 8),
            Dtype::BOOL => ("bool".to_owned(), 1),
            other => (other.to_string(), 0),
        },
        start: LENGTH_BYTES + header + info.data_offsets.0,
        ..TensorInfo::default()
    });
    let numbers = |info: &TensorInfo, length| Ok(bytes[info.start..info.start + length].into());
    TensorFile::new(file, infos.collect(), Box::new(numbers))
}

/// Opens arrays as a file of tensors; `source` names them in errors.
pub(super) fn open_arrays<'t>(source: &str, tensors: &'t [Tensor<'t>]) -> Read<TensorFile<'t>> {
    let info = |(member, tensor): (usize, &Tensor<'_>)| {
        let expected = tensor.shape.iter().product::<usize>();
        if tensor.values.len() != expected {
            let place = format!("`{}`", tensor.name);
            let found = format!("{} numbers", tensor.values.len());
            let expected = format!("{expected} ({})", shape_text(&tensor.shape));
            return Err(ImportError::at(source, place, found, expected));
        }
        Ok(TensorInfo {
            name: tensor.name.clone(),
            shape: tensor.shape.clone(),
            element: ("f64".to_owned(), 8),
            is_column_major: tensor.is_column_major,
            member,
            ..TensorInfo::default()
        })
    };
    let infos = tensors.iter().enumerate().map(info);
    let numbers = |info: &TensorInfo, _| Ok(tensors[info.member].little_endian().into());
    TensorFile::new(source, infos.collect::<Result<_, _>>()?, Box::new(numbers))
}

pub(super) fn digest(tensors: &[Tensor<'_>]) -> Output<Sha256> {
    let mut digest = Sha256::new();
    for tensor in tensors {
        let (name, shape) = (&tensor.name, &tensor.shape);
        let order = if tensor.is_column_major { "F" } else { "C" };
        digest.update(format!("{name} {shape:?} {order}\n"));
        digest.update(tensor.little_endian());
    }
    digest.finalize()
}

/// A shape in words: `18 x 4`, `4 numbers`, `one number`.
pub(super) fn shape_text(shape: &[usize]) -> String {
    match shape {
        [] => "one number".to_owned(),
        [length] => format!("{length} numbers"),
        _ => {
            let dims: Vec<String> = shape.iter().map(usize::to_string).collect();
            dims.join(" x ")
        }
    }
}

const MAX_MEMBERS: usize = 10_000;
const MAGIC: &[u8; 6] = b"\x93NUMPY";
const MAX_HEADER_BYTES: usize = 1 << 16;
const MAX_RANK: usize = 32;

type Archive<'b> = ZipArchive<Cursor<&'b [u8]>>;

pub(super) fn open_npz<'b>(file: &str, bytes: &'b [u8]) -> Read<TensorFile<'b>> {
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(|e| damaged(file, "npz", e))?;
    if archive.has_duplicate_names() {
        return Err(damaged(file, "npz", "two arrays of one name"));
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

fn describe(file: &str, archive: &mut Archive<'_>, member: usize) -> Read<Option<TensorInfo>> {
    let mut entry = archive
        .by_index(member)
        .map_err(|e| damaged(file, "npz", e))?;
    let name = entry
        .name()
        .map_err(|e| damaged(file, "npz", e))?
        .into_owned();
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

fn numbers(file: &str, bytes: &[u8], info: &TensorInfo, length: usize) -> Read<Cow<'static, [u8]>> {
    let refused = |found: String| {
        let place = format!("`{}`", info.name);
        let expected = "as many bytes as its shape and type need";
        ImportError::at(file, place, found, expected)
    };
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(|e| damaged(file, "npz", e))?;
    let member = (archive.by_index(info.member)).map_err(|error| refused(error.to_string()))?;
    let mut unpacked = Vec::new();
    // One byte more than needed reveals too long an array; it also reaches the member's end and its checksum.
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

/// The description in an array's header, without name and member; otherwise the text found and the expected text.
fn read_header(reader: &mut impl io::Read) -> Result<TensorInfo, (String, &'static str)> {
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
