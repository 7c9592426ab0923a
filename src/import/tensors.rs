//! Named arrays of numbers in a foreign file, whatever its container.

use std::path::Path;

use nalgebra::DMatrix;

use super::error::{ImportError, shape_text};
use super::npz;

/// Largest tensor that is read: the coefficients of the largest library fit twice.
pub(super) const MAX_ELEMENTS: usize = 4 << 20;

/// Type of the numbers of a tensor.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Element {
    F32,
    F64,
    Bool,
    /// Any other type, by its name in the file.
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

/// Which index runs fastest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    /// The last (C).
    Last,
    /// The first (Fortran).
    First,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Endian {
    Little,
    Big,
}

/// Where the numbers of a tensor are.
#[derive(Clone, Debug)]
pub(super) enum Place {
    /// At this byte of the file.
    Bytes { start: usize },
    /// In this member of the zip file, after this many bytes of header.
    Member { index: usize, header: usize },
}

/// What a file says about one tensor.
#[derive(Clone, Debug)]
pub(super) struct TensorInfo {
    pub(super) name: String,
    pub(super) shape: Vec<usize>,
    pub(super) element: Element,
    pub(super) order: Order,
    pub(super) endian: Endian,
    pub(super) place: Place,
}

impl TensorInfo {
    /// `net.0.weight (18 x 4)`.
    pub(super) fn describe(&self) -> String {
        format!("`{}` ({})", self.name, shape_text(&self.shape))
    }
}

/// The numbers of a tensor of one or two indices.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Array {
    pub(super) shape: Vec<usize>,
    pub(super) order: Order,
    pub(super) values: Vec<f64>,
}

impl Array {
    /// The array as a matrix of `rows x columns`, laid out as its indices say.
    pub(super) fn matrix(&self, rows: usize, columns: usize) -> DMatrix<f64> {
        match self.order {
            Order::Last => DMatrix::from_row_slice(rows, columns, &self.values),
            Order::First => DMatrix::from_column_slice(rows, columns, &self.values),
        }
    }

    /// The index of the number at a position of `values`.
    pub(super) fn index_of(&self, position: usize) -> Vec<usize> {
        let mut rest = position;
        let mut take = |dim: &usize| {
            let index = rest % dim;
            rest /= dim;
            index
        };
        match self.order {
            Order::First => self.shape.iter().map(take).collect(),
            Order::Last => {
                let mut index: Vec<usize> = self.shape.iter().rev().map(&mut take).collect();
                index.reverse();
                index
            }
        }
    }
}

/// A file of tensors: their descriptions, and the bytes to read them from.
#[derive(Debug)]
pub(super) struct TensorFile<'b> {
    file: String,
    bytes: &'b [u8],
    infos: Vec<TensorInfo>,
}

impl<'b> TensorFile<'b> {
    /// The tensors that a container's reader has described; numbers are read one tensor at a time.
    pub(super) fn new(
        file: &str,
        bytes: &'b [u8],
        mut infos: Vec<TensorInfo>,
    ) -> Result<TensorFile<'b>, ImportError> {
        infos.sort_by(|a, b| a.name.cmp(&b.name));
        if let Some(pair) = infos.windows(2).find(|pair| pair[0].name == pair[1].name) {
            return Err(ImportError::Array {
                file: file.to_owned(),
                tensor: pair[0].name.clone(),
                found: "two tensors of this name".to_owned(),
                expected: "different names",
            });
        }
        Ok(TensorFile {
            file: file.to_owned(),
            bytes,
            infos,
        })
    }

    pub(super) fn file(&self) -> &str {
        &self.file
    }

    /// All tensors, sorted by name.
    pub(super) fn infos(&self) -> &[TensorInfo] {
        &self.infos
    }

    pub(super) fn find(&self, name: &str) -> Option<&TensorInfo> {
        self.infos.iter().find(|info| info.name == name)
    }

    /// All tensors in words, for messages.
    pub(super) fn listing(&self) -> String {
        const MOST: usize = 24;
        let mut texts: Vec<String> = self
            .infos
            .iter()
            .take(MOST)
            .map(TensorInfo::describe)
            .collect();
        match self.infos.len().saturating_sub(MOST) {
            0 if texts.is_empty() => "no tensors at all".to_owned(),
            0 => texts.join(", "),
            more => {
                texts.push(format!("{more} more"));
                texts.join(", ")
            }
        }
    }

    /// The numbers of a tensor for one use, which names them in errors.
    pub(super) fn read(&self, info: &TensorInfo, role: &str) -> Result<Array, ImportError> {
        let (size, count) = self.check(info, role)?;
        let length = size * count;
        let member;
        let bytes = match info.place {
            Place::Bytes { start } => &self.bytes[start..start + length],
            Place::Member { index, header } => {
                member = npz::data(&self.file, self.bytes, info, index, header, length)?;
                &member
            }
        };
        let values = bytes
            .chunks_exact(size)
            .map(|number| decode(&info.element, info.endian, number))
            .collect();
        let array = Array {
            shape: info.shape.clone(),
            order: info.order,
            values,
        };
        self.check_finite(&array, info, role)?;
        Ok(array)
    }

    fn check(&self, info: &TensorInfo, role: &str) -> Result<(usize, usize), ImportError> {
        let size = info.element.size().ok_or_else(|| ImportError::Element {
            file: self.file.clone(),
            tensor: info.name.clone(),
            role: role.to_owned(),
            found: info.element.name().to_owned(),
            expected: "f32 or f64",
        })?;
        let count = (info.shape.iter()).try_fold(1usize, |count, &dim| count.checked_mul(dim));
        match count.filter(|&count| count <= MAX_ELEMENTS) {
            Some(count) => Ok((size, count)),
            None => Err(ImportError::TooLarge {
                file: self.file.clone(),
                what: info.describe(),
                max: MAX_ELEMENTS as u64,
                unit: "numbers",
            }),
        }
    }

    fn check_finite(
        &self,
        array: &Array,
        info: &TensorInfo,
        role: &str,
    ) -> Result<(), ImportError> {
        match array.values.iter().position(|value| !value.is_finite()) {
            None => Ok(()),
            Some(position) => Err(ImportError::Value {
                file: self.file.clone(),
                tensor: info.name.clone(),
                role: role.to_owned(),
                index: array.index_of(position).into(),
                found: array.values[position],
                expected: "a finite number",
            }),
        }
    }
}

/// One number from its bytes, as many as its type has.
fn decode(element: &Element, endian: Endian, number: &[u8]) -> f64 {
    let fits = "a chunk is as long as its element";
    match (element, endian) {
        (Element::F32, Endian::Little) => {
            f64::from(f32::from_le_bytes(number.try_into().expect(fits)))
        }
        (Element::F32, Endian::Big) => {
            f64::from(f32::from_be_bytes(number.try_into().expect(fits)))
        }
        (Element::F64, Endian::Little) => f64::from_le_bytes(number.try_into().expect(fits)),
        (Element::F64, Endian::Big) => f64::from_be_bytes(number.try_into().expect(fits)),
        (Element::Bool | Element::Other(_), _) => f64::from(u8::from(number[0] != 0)),
    }
}

/// A file's name without its folders, for what is kept in the model.
pub(super) fn short_name(file: &str) -> String {
    let name = Path::new(file).file_name();
    name.map_or_else(
        || file.to_owned(),
        |name| name.to_string_lossy().into_owned(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn array_index_follows_its_order() {
        let array = |order| Array {
            shape: vec![2, 3],
            order,
            values: (0..6).map(f64::from).collect(),
        };
        for order in [Order::Last, Order::First] {
            let array = array(order);
            let matrix = array.matrix(2, 3);
            for position in 0..6 {
                let index = array.index_of(position);
                assert_eq!(matrix[(index[0], index[1])], array.values[position]);
            }
        }
        assert_eq!(array(Order::Last).index_of(4), [1, 1]);
        assert_eq!(array(Order::First).index_of(4), [0, 2]);
    }

    #[test]
    fn numbers_decode_from_either_byte_order() {
        let value = -0.1f64;
        assert_eq!(
            decode(&Element::F64, Endian::Little, &value.to_le_bytes()),
            value
        );
        assert_eq!(
            decode(&Element::F64, Endian::Big, &value.to_be_bytes()),
            value
        );
        let single = 0.3f32;
        assert_eq!(
            decode(&Element::F32, Endian::Big, &single.to_be_bytes()),
            f64::from(single)
        );
        assert_eq!(decode(&Element::Bool, Endian::Little, &[1]), 1.0);
    }
}
