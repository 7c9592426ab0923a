//! The header of a NumPy `.npy` array, versions 1 to 3.
//!
//! `\x93NUMPY`, two version bytes, the length of the rest (2 or 4 bytes, little endian), then a
//! Python dictionary: `{'descr': '<f8', 'fortran_order': False, 'shape': (18, 4), }`.

use std::io::{self, Read};

use super::tensors::{Element, Endian, Order};

const MAGIC: &[u8; 6] = b"\x93NUMPY";
const MAX_HEADER_BYTES: usize = 1 << 16;
const MAX_RANK: usize = 32;

/// What a header says.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Header {
    pub(super) shape: Vec<usize>,
    pub(super) element: Element,
    pub(super) order: Order,
    pub(super) endian: Endian,
    /// Bytes before the first number.
    pub(super) length: usize,
}

/// Why a header cannot be used.
#[derive(Debug)]
pub(super) enum HeaderError {
    Read(io::Error),
    Content {
        found: String,
        expected: &'static str,
    },
}

fn content(found: impl Into<String>, expected: &'static str) -> HeaderError {
    HeaderError::Content {
        found: found.into(),
        expected,
    }
}

/// Reads the header at the start of an array.
pub(super) fn read_header(reader: &mut impl Read) -> Result<Header, HeaderError> {
    let mut fixed = [0; 8];
    reader.read_exact(&mut fixed).map_err(HeaderError::Read)?;
    if !fixed.starts_with(MAGIC) {
        return Err(content(
            "another kind of file",
            "an array that starts with \\x93NUMPY",
        ));
    }
    let (length_bytes, length) = match fixed[6] {
        1 => {
            let mut length = [0; 2];
            reader.read_exact(&mut length).map_err(HeaderError::Read)?;
            (2, usize::from(u16::from_le_bytes(length)))
        }
        2 | 3 => {
            let mut length = [0; 4];
            reader.read_exact(&mut length).map_err(HeaderError::Read)?;
            (4, u32::from_le_bytes(length) as usize)
        }
        version => return Err(content(format!("version {version}"), "version 1, 2 or 3")),
    };
    if length > MAX_HEADER_BYTES {
        return Err(content(
            format!("a header of {length} bytes"),
            "at most 65536 bytes",
        ));
    }
    let mut text = vec![0; length];
    reader.read_exact(&mut text).map_err(HeaderError::Read)?;
    let text = String::from_utf8_lossy(&text);
    let dictionary = Dictionary::parse(&text).ok_or_else(|| {
        content(
            "a header that cannot be read",
            "descr, fortran_order and shape",
        )
    })?;
    let (element, endian) = element_of(dictionary.descr);
    Ok(Header {
        shape: dictionary.shape,
        element,
        order: if dictionary.fortran_order {
            Order::First
        } else {
            Order::Last
        },
        endian,
        length: fixed.len() + length_bytes + length,
    })
}

/// `<f8` and its relatives; a missing text is a type made of several.
fn element_of(descr: Option<&str>) -> (Element, Endian) {
    let Some(descr) = descr else {
        return (Element::Other("a structure".to_owned()), Endian::Little);
    };
    let (endian, name) = match descr.strip_prefix('>') {
        Some(name) => (Endian::Big, name),
        None => (Endian::Little, descr.trim_start_matches(['<', '|', '='])),
    };
    let element = match name {
        "f4" => Element::F32,
        "f8" => Element::F64,
        "b1" | "?" => Element::Bool,
        _ => Element::Other(format!("{:?}", descr.chars().take(40).collect::<String>())),
    };
    (element, endian)
}

/// The three entries of the header's dictionary.
struct Dictionary<'t> {
    descr: Option<&'t str>,
    fortran_order: bool,
    shape: Vec<usize>,
}

impl<'t> Dictionary<'t> {
    fn parse(text: &'t str) -> Option<Self> {
        let mut rest = text.trim().strip_prefix('{')?.strip_suffix('}')?.trim();
        let (mut descr, mut fortran_order, mut shape) = (None, None, None);
        while !rest.is_empty() {
            let (key, after) = quoted(rest)?;
            let value = after.trim_start().strip_prefix(':')?.trim_start();
            rest = match key {
                "descr" => {
                    let (found, after) = match quoted(value) {
                        Some((found, after)) => (Some(found), after),
                        None => (None, after_list(value)?),
                    };
                    descr = Some(found);
                    after
                }
                "fortran_order" => {
                    let (found, after) = truth(value)?;
                    fortran_order = Some(found);
                    after
                }
                "shape" => {
                    let (found, after) = tuple(value)?;
                    shape = Some(found);
                    after
                }
                _ => return None,
            };
            rest = rest.trim_start();
            rest = match rest.strip_prefix(',') {
                Some(after) => after.trim_start(),
                None if rest.is_empty() => rest,
                None => return None,
            };
        }
        Some(Dictionary {
            descr: descr?,
            fortran_order: fortran_order?,
            shape: shape?,
        })
    }
}

/// A text in single or double quotes, without escapes, and what follows it.
fn quoted(text: &str) -> Option<(&str, &str)> {
    let quote = text.chars().next().filter(|c| matches!(c, '\'' | '"'))?;
    text[1..].split_once(quote)
}

fn truth(text: &str) -> Option<(bool, &str)> {
    let is_true = text.strip_prefix("True").map(|rest| (true, rest));
    is_true.or_else(|| text.strip_prefix("False").map(|rest| (false, rest)))
}

/// `(18, 4)`, `(4,)` or `()`; Python 2 wrote `(18L, 4L)`.
fn tuple(text: &str) -> Option<(Vec<usize>, &str)> {
    let (inside, rest) = text.strip_prefix('(')?.split_once(')')?;
    let mut dims = Vec::new();
    let mut parts = inside.split(',').map(str::trim).peekable();
    while let Some(part) = parts.next() {
        if part.is_empty() && parts.peek().is_none() {
            break;
        }
        if dims.len() == MAX_RANK || !part.starts_with(|c: char| c.is_ascii_digit()) {
            return None;
        }
        dims.push(part.trim_end_matches('L').parse().ok()?);
    }
    Some((dims, rest))
}

/// What follows a list in brackets.
fn after_list(text: &str) -> Option<&str> {
    let mut depth = 0usize;
    for (position, c) in text.char_indices() {
        match c {
            '[' | '(' => depth += 1,
            ']' | ')' => depth = depth.checked_sub(1)?,
            _ => {}
        }
        if depth == 0 {
            let end = position + c.len_utf8();
            return (end > 1).then(|| &text[end..]);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(version: u8, dictionary: &str) -> Result<Header, HeaderError> {
        let mut bytes = MAGIC.to_vec();
        bytes.extend([version, 0]);
        match version {
            1 => bytes.extend((dictionary.len() as u16).to_le_bytes()),
            _ => bytes.extend((dictionary.len() as u32).to_le_bytes()),
        }
        bytes.extend(dictionary.as_bytes());
        read_header(&mut bytes.as_slice())
    }

    #[test]
    fn header_of_numpy_is_read() {
        let read = header(
            1,
            "{'descr': '<f8', 'fortran_order': False, 'shape': (18, 4), }          \n",
        )
        .expect("as NumPy writes it");
        assert_eq!(read.shape, [18, 4]);
        assert_eq!((read.element, read.order), (Element::F64, Order::Last));
        assert_eq!(read.length, 10 + 71);
        let read = header(2, "{'shape': (5L,), 'fortran_order': True, 'descr': '>f4'}")
            .expect("keys in another order");
        assert_eq!(read.shape, [5]);
        assert_eq!((read.element, read.endian), (Element::F32, Endian::Big));
        assert_eq!(read.order, Order::First);
    }

    #[test]
    fn header_of_other_types_names_them() {
        for (descr, expected) in [
            ("'<i8'", "\"<i8\""),
            ("'|O'", "\"|O\""),
            ("[('a', '<f8'), ('b', '<f4', (2,))]", "a structure"),
        ] {
            let text = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': ()}}");
            let read = header(1, &text).expect("a header all the same");
            assert_eq!(read.element, Element::Other(expected.to_owned()));
            assert_eq!(read.shape, [0usize; 0]);
        }
    }

    #[test]
    fn header_without_all_entries_is_refused() {
        for text in [
            "",
            "{}",
            "{'descr': '<f8', 'shape': (1,)}",
            "{'descr': '<f8', 'fortran_order': 0, 'shape': (1,)}",
            "{'descr': '<f8', 'fortran_order': False, 'shape': (1,,)}",
            "{'descr': '<f8', 'fortran_order': False, 'shape': (-1,)}",
            "{'descr': '<f8', 'fortran_order': False, 'shape': (99999999999999999999,)}",
            "{'descr': '<f8', 'fortran_order': False, 'shape': (1,), 'more': 1}",
            "{'descr': f8, 'fortran_order': False, 'shape': (1,)}",
        ] {
            let refused = header(1, text);
            assert!(
                matches!(refused, Err(HeaderError::Content { .. })),
                "{text}: {refused:?}"
            );
        }
        assert!(matches!(
            header(9, "{}"),
            Err(HeaderError::Content { found, .. }) if found == "version 9"
        ));
    }
}
