//! Finds out how a matrix is stored, from its shape and from what is known already.

use super::error::{ImportError, shape_text};
use super::options::{WeightVectors, XiLayout};
use super::report::Layout;
use super::role::Part;
use super::tensors::TensorInfo;

/// What a tensor is and where: the subject of complaints about its shape.
#[derive(Clone, Copy, Debug)]
pub(super) struct Subject<'s> {
    pub(super) file: &'s str,
    pub(super) info: &'s TensorInfo,
    pub(super) role: &'s str,
}

impl Subject<'_> {
    /// Complains about the shape.
    pub(super) fn shape_error(&self, expected: String) -> ImportError {
        ImportError::Shape {
            file: self.file.to_owned(),
            tensor: self.info.name.clone(),
            role: self.role.to_owned(),
            found: shape_text(&self.info.shape),
            expected: expected.into(),
        }
    }

    /// Complains that the shape fits both ways.
    pub(super) fn orientation_error(&self, option: &'static str) -> ImportError {
        ImportError::Orientation {
            file: self.file.to_owned(),
            tensor: self.info.name.clone(),
            role: self.role.to_owned(),
            found: shape_text(&self.info.shape),
            option,
        }
    }
}

/// Dimensions as far as they are known before a tensor is looked at.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Known {
    /// `d`.
    pub(super) latent: Option<usize>,
    /// `n`.
    pub(super) state: Option<usize>,
}

/// How a matrix is stored, and the dimensions that follow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Found<D> {
    pub(super) layout: Layout,
    /// Rows and columns as stored.
    pub(super) stored: (usize, usize),
    pub(super) dims: D,
}

/// `(d, n)` of the weights of a map.
pub(super) type MapDims = (usize, usize);

/// How the weights of a map are stored.
///
/// An encoder has `d <= n`, so that every shape but a square tells. A list of `n` numbers is the
/// only row of an encoder or the only column of a decoder.
pub(super) fn weights(
    subject: Subject<'_>,
    part: Part,
    vectors: Option<WeightVectors>,
    known: Known,
) -> Result<Found<MapDims>, ImportError> {
    let candidates: Vec<Found<MapDims>> = match subject.info.shape[..] {
        [length] => {
            let stored = match part {
                Part::Encoder => (1, length),
                Part::Decoder => (length, 1),
            };
            vec![Found {
                layout: Layout::Plain,
                stored,
                dims: (1, length),
            }]
        }
        [rows, columns] => {
            let (column, row) = match part {
                Part::Encoder => ((rows, columns), (columns, rows)),
                Part::Decoder => ((columns, rows), (rows, columns)),
            };
            let found = |layout, dims| Found {
                layout,
                stored: (rows, columns),
                dims,
            };
            vec![found(Layout::Column, column), found(Layout::Row, row)]
        }
        _ => Vec::new(),
    };
    let fits = |found: &&Found<MapDims>| {
        let (latent, state) = found.dims;
        let wanted = match (vectors, found.layout) {
            (Some(WeightVectors::Row), layout) => layout != Layout::Column,
            (Some(WeightVectors::Column), layout) => layout != Layout::Row,
            (None, _) => true,
        };
        wanted
            && (1..=state).contains(&latent)
            && known.latent.is_none_or(|known| known == latent)
            && known.state.is_none_or(|known| known == state)
    };
    let fitting: Vec<&Found<MapDims>> = candidates.iter().filter(fits).collect();
    match fitting[..] {
        [only] => Ok(*only),
        [] => Err(subject.shape_error(expected_weights(part, vectors, known))),
        [first, ..] if first.stored == (1, 1) => Ok(Found {
            layout: Layout::Plain,
            ..*first
        }),
        _ => Err(subject.orientation_error(
            "--weights column for z = W x (torch.nn.Linear) or --weights row for z = x W \
             (TensorFlow)",
        )),
    }
}

fn expected_weights(part: Part, vectors: Option<WeightVectors>, known: Known) -> String {
    let latent = known.latent.map_or("d".to_owned(), |d| d.to_string());
    let state = known.state.map_or("n".to_owned(), |n| n.to_string());
    let (column, row) = match part {
        Part::Encoder => (format!("{latent} x {state}"), format!("{state} x {latent}")),
        Part::Decoder => (format!("{state} x {latent}"), format!("{latent} x {state}")),
    };
    let bound = match (known.latent, known.state) {
        (Some(_), Some(_)) => "",
        _ => ", with d at most n",
    };
    match vectors {
        Some(WeightVectors::Column) => format!("{column} (--weights column){bound}"),
        Some(WeightVectors::Row) => format!("{row} (--weights row){bound}"),
        None => format!("{column} (column vectors) or {row} (row vectors){bound}"),
    }
}

/// `(library_dim, latent_dim)` of coefficients.
pub(super) type XiDims = (usize, usize);

/// How coefficients are stored; `library_dim` tells the number of terms for a latent dimension.
///
/// `expected` says in words what the shape should be.
pub(super) fn xi(
    subject: Subject<'_>,
    layout: Option<XiLayout>,
    latent: Option<usize>,
    library_dim: impl Fn(usize) -> Option<usize>,
    expected: impl Fn() -> String,
) -> Result<Found<XiDims>, ImportError> {
    let candidates: Vec<Found<XiDims>> = match subject.info.shape[..] {
        [length] => vec![Found {
            layout: Layout::Plain,
            stored: (length, 1),
            dims: (length, 1),
        }],
        [rows, columns] => {
            let found = |layout, dims| Found {
                layout,
                stored: (rows, columns),
                dims,
            };
            vec![
                found(Layout::TermsByLatent, (rows, columns)),
                found(Layout::LatentByTerms, (columns, rows)),
            ]
        }
        _ => Vec::new(),
    };
    let fits = |found: &&Found<XiDims>| {
        let (terms, coordinates) = found.dims;
        let wanted = match (layout, found.layout) {
            (Some(XiLayout::TermsByLatent), layout) => layout != Layout::LatentByTerms,
            (Some(XiLayout::LatentByTerms), layout) => layout != Layout::TermsByLatent,
            (None, _) => true,
        };
        wanted
            && coordinates > 0
            && latent.is_none_or(|latent| latent == coordinates)
            && library_dim(coordinates) == Some(terms)
    };
    let fitting: Vec<&Found<XiDims>> = candidates.iter().filter(fits).collect();
    match fitting[..] {
        [only] => Ok(*only),
        [] => Err(subject.shape_error(expected())),
        [first, ..] if first.stored == (1, 1) => Ok(Found {
            layout: Layout::Plain,
            ..*first
        }),
        _ => Err(subject.orientation_error(
            "--xi-layout terms-by-latent (a row a term) or --xi-layout latent-by-terms (a row a \
             latent coordinate)",
        )),
    }
}

/// Complains unless a tensor is a list of `expected` numbers; a matrix of one row or column is one.
pub(super) fn check_list(subject: Subject<'_>, expected: usize) -> Result<(), ImportError> {
    let is_list = match subject.info.shape[..] {
        [] => expected == 1,
        [length] => length == expected,
        [1, length] | [length, 1] => length == expected,
        _ => false,
    };
    if is_list {
        Ok(())
    } else {
        Err(subject.shape_error(format!("{expected} numbers")))
    }
}
