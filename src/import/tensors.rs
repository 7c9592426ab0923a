//! Named arrays of numbers: in a foreign file, whatever its container, or in memory.

use std::borrow::Cow;
use std::fmt::Display;

use nalgebra::DMatrix;
use safetensors::{Dtype, SafeTensors};
use sha2::digest::Output;
use sha2::{Digest as _, Sha256};

use super::ImportError;
use super::run::{damaged, too_large};
use crate::files::Place;

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
    /// As many numbers as the dimensions say.
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
    /// The first index runs fastest (Fortran), not the last (C).
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
        let mut index = vec![0; self.shape.len()];
        for step in 0..index.len() {
            let axis = match self.is_column_major {
                true => step,
                false => index.len() - 1 - step,
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
type Bytes<'b> = dyn Fn(&TensorInfo, usize) -> Result<Cow<'b, [u8]>, ImportError> + 'b;

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
    ) -> Result<TensorFile<'b>, ImportError> {
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

    /// The numbers of a tensor for one use, which `place` names in errors; all are finite, and as many as the matrix
    /// has.
    pub(super) fn read(
        &self,
        info: &TensorInfo,
        (rows, columns): (usize, usize),
        place: impl Fn(&[usize]) -> Place,
    ) -> Result<DMatrix<f64>, ImportError> {
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
pub(super) fn open_safetensors<'b>(
    file: &str,
    bytes: &'b [u8],
) -> Result<TensorFile<'b>, ImportError> {
    let (header, metadata) = SafeTensors::read_metadata(bytes)
        .map_err(|error| damaged(file, "safetensors", &error.to_string()))?;
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
pub(super) fn open_arrays<'t>(
    source: &str,
    tensors: &'t [Tensor<'t>],
) -> Result<TensorFile<'t>, ImportError> {
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
