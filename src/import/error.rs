//! Faults of files of models trained elsewhere, and of the options given with them.

use crate::files::{Fault, Located, Place};
use crate::model::ModelError;

/// A fault and its place: the file, a tensor with its use, a character of a text, or an option.
pub type ImportError = Located<Fault<ModelError>>;

/// A file, or one tensor of it, with more than `max` of `unit`.
pub(super) fn too_large(file: &str, place: Place, max: u64, unit: &str) -> ImportError {
    let text = format!("found more than {max} {unit}, which no model needs");
    ImportError::text(file, place, text)
}

pub(super) fn damaged(file: &str, format: &str, found: &str) -> ImportError {
    let text = format!("not a usable {format} file: {found}");
    ImportError::text(file, Place::Whole, text)
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
