//! Named arrays of numbers in a foreign file, whatever its container.

use std::borrow::Cow;

use nalgebra::DMatrix;
use safetensors::{Dtype, SafeTensors};

use super::error::{ImportError, damaged, shape_text, too_large};
use super::memory::{self, Tensor};
use super::npz;
use crate::files::Place;

/// Largest tensor that is read: the coefficients of the largest library fit twice.
const MAX_ELEMENTS: usize = 4 << 20;

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) enum Element {
    F32,
    #[default]
    F64,
    Bool,
    Other(String),
}

impl Element {
    pub(super) fn name(&self) -> &str {
        match self {
            Element::F32 => "f32",
            Element::F64 => "f64",
            Element::Bool => "bool",
            Element::Other(name) => name,
        }
    }

    /// Bytes of one number, if it is of a type that can be read.
    fn size(&self) -> Option<usize> {
        match self {
            Element::F32 => Some(4),
            Element::F64 => Some(8),
            Element::Bool => Some(1),
            Element::Other(_) => None,
        }
    }
}

#[derive(Clone, Debug, Default)]
pub(super) struct TensorInfo {
    pub(super) name: String,
    pub(super) shape: Vec<usize>,
    pub(super) element: Element,
    /// The first index runs fastest (Fortran), not the last (C).
    pub(super) is_column_major: bool,
    pub(super) is_big_endian: bool,
    /// Member of a zip file; 0 in other containers.
    pub(super) member: usize,
    /// First byte of the numbers in the member or file.
    pub(super) start: usize,
}

impl TensorInfo {
    pub(super) fn describe(&self) -> String {
        format!("`{}` ({})", self.name, shape_text(&self.shape))
    }

    /// Its numbers as a matrix of `rows x columns`, laid out as their indices say.
    fn matrix(&self, (rows, columns): (usize, usize), values: &[f64]) -> DMatrix<f64> {
        match self.is_column_major {
            false => DMatrix::from_row_slice(rows, columns, values),
            true => DMatrix::from_column_slice(rows, columns, values),
        }
    }

    fn index_of(&self, position: usize) -> Vec<usize> {
        let mut rest = position;
        let mut index = vec![0; self.shape.len()];
        for step in 0..index.len() {
            let axis = match self.is_column_major {
                true => step,
                false => index.len() - 1 - step,
            };
            index[axis] = rest % self.shape[axis];
            rest /= self.shape[axis];
        }
        index
    }
}

/// What the numbers of tensors are in.
pub(super) enum Container<'b> {
    Safetensors(&'b [u8]),
    Npz(&'b [u8]),
    Memory(&'b [Tensor<'b>]),
}

/// A file of tensors: their descriptions, and their numbers, which are read one tensor at a time.
pub(super) struct TensorFile<'b> {
    file: String,
    infos: Vec<TensorInfo>,
    container: Container<'b>,
}

impl<'b> TensorFile<'b> {
    pub(super) fn new(
        file: &str,
        mut infos: Vec<TensorInfo>,
        container: Container<'b>,
    ) -> Result<TensorFile<'b>, ImportError> {
        infos.sort_by(|a, b| a.name.cmp(&b.name));
        if let Some(pair) = infos.windows(2).find(|pair| pair[0].name == pair[1].name) {
            let place = format!("`{}`", pair[0].name);
            let found = "two tensors of this name";
            return Err(ImportError::at(file, place, found, "different names"));
        }
        let file = file.to_owned();
        Ok(TensorFile {
            file,
            infos,
            container,
        })
    }

    /// The bytes of a tensor's numbers, as many as its shape and type need.
    fn bytes(&self, info: &TensorInfo, length: usize) -> Result<Cow<'b, [u8]>, ImportError> {
        Ok(match self.container {
            Container::Safetensors(bytes) => Cow::from(&bytes[info.start..info.start + length]),
            Container::Npz(bytes) => npz::numbers(&self.file, bytes, info, length)?.into(),
            Container::Memory(tensors) => memory::little_endian(&tensors[info.member]).into(),
        })
    }

    pub(super) fn file(&self) -> &str {
        &self.file
    }

    pub(super) fn infos(&self) -> &[TensorInfo] {
        &self.infos
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

    pub(super) fn missing(&self, role: &dyn std::fmt::Display) -> ImportError {
        let found = format!("no tensor for {role} among {}", self.listing());
        let expected = format!("a tensor of that name, or --map {role}=TENSOR");
        self.refused(Place::Whole, found, expected)
    }

    /// The numbers of a tensor for one use, which `place` names in errors; all are finite, and as
    /// many as the matrix has.
    pub(super) fn read(
        &self,
        info: &TensorInfo,
        matrix: (usize, usize),
        place: impl Fn(&[usize]) -> Place,
    ) -> Result<DMatrix<f64>, ImportError> {
        let Some(size) = info.element.size() else {
            let found = format!("numbers of type {}", info.element.name());
            return Err(self.refused(place(&[]), found, "f32 or f64"));
        };
        let count = (info.shape.iter()).try_fold(1usize, |count, &dim| count.checked_mul(dim));
        let Some(count) = count.filter(|&count| count <= MAX_ELEMENTS) else {
            let (max, unit) = (MAX_ELEMENTS as u64, "numbers");
            return Err(too_large(&self.file, place(&[]), max, unit));
        };
        let bytes = self.bytes(info, size * count)?;
        let numbers = bytes.chunks_exact(size);
        let values: Vec<f64> = numbers.map(|number| decode(info, number)).collect();
        match values.iter().position(|value| !value.is_finite()) {
            None => Ok(info.matrix(matrix, &values)),
            Some(position) => {
                let place = place(&info.index_of(position));
                Err(self.refused(place, values[position].to_string(), "a finite number"))
            }
        }
    }
}

/// Bytes before the header: its length.
const LENGTH_BYTES: usize = 8;

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
            Dtype::F32 => Element::F32,
            Dtype::F64 => Element::F64,
            Dtype::BOOL => Element::Bool,
            other => Element::Other(other.to_string()),
        },
        start: LENGTH_BYTES + header + info.data_offsets.0,
        ..TensorInfo::default()
    });
    TensorFile::new(file, infos.collect(), Container::Safetensors(bytes))
}

fn decode(info: &TensorInfo, number: &[u8]) -> f64 {
    let mut little = [0; 8];
    let little = &mut little[..number.len()];
    little.copy_from_slice(number);
    if info.is_big_endian {
        little.reverse();
    }
    match *little {
        [a, b, c, d, e, f, g, h] => f64::from_le_bytes([a, b, c, d, e, f, g, h]),
        [a, b, c, d] => f64::from(f32::from_le_bytes([a, b, c, d])),
        _ => f64::from(u8::from(little != [0])),
    }
}
