//! Why a model trained elsewhere could not be imported.

use std::io;
use std::path::PathBuf;

use thiserror::Error;

use crate::model::ModelError;

/// What is wrong with a foreign file, or with what was said about it.
#[derive(Debug, Error)]
pub enum ImportError {
    /// The file system refused.
    #[error("{}: cannot read the file", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's answer.
        #[source]
        source: io::Error,
    },
    /// The file, or one tensor of it, is larger than any model needs.
    #[error("{file}: {what} has more than {max} {unit}, which no model needs")]
    TooLarge {
        /// The file.
        file: String,
        /// `the file`, or a tensor.
        what: String,
        /// The bound.
        max: u64,
        /// What is counted.
        unit: &'static str,
    },
    /// The file's kind cannot be told from its name.
    #[error("{file}: found {found}, expected {expected}")]
    UnknownFormat {
        /// The file.
        file: String,
        /// Its ending.
        found: String,
        /// What can be read, and what to do with this kind.
        expected: &'static str,
    },
    /// The container is damaged.
    #[error("{file}: not a usable {format} file: {found}")]
    Container {
        /// The file.
        file: String,
        /// `safetensors` or `npz`.
        format: &'static str,
        /// What the container's reader says.
        found: String,
    },
    /// A member of an npz file is no usable array.
    #[error("{file}: `{tensor}`: found {found}, expected {expected}")]
    Array {
        /// The file.
        file: String,
        /// The array.
        tensor: String,
        /// What is there.
        found: String,
        /// What should be.
        expected: &'static str,
    },
    /// A tensor has numbers of a type that a model cannot take.
    #[error("{file}: `{tensor}` as {role}: found numbers of type {found}, expected {expected}")]
    Element {
        /// The file.
        file: String,
        /// The tensor.
        tensor: String,
        /// What it is wanted for.
        role: String,
        /// Its type.
        found: String,
        /// The types allowed.
        expected: &'static str,
    },
    /// A tensor holds a number that its use does not allow.
    #[error("{file}: `{tensor}`{index:?} as {role}: found {found}, expected {expected}")]
    Value {
        /// The file.
        file: String,
        /// The tensor.
        tensor: String,
        /// What it is wanted for.
        role: String,
        /// Index in the file's own layout, from 0.
        index: Box<[usize]>,
        /// The number.
        found: f64,
        /// The numbers allowed.
        expected: &'static str,
    },
    /// A tensor has the wrong shape.
    #[error("{file}: `{tensor}` as {role}: found {found}, expected {expected}")]
    Shape {
        /// The file.
        file: String,
        /// The tensor.
        tensor: String,
        /// What it is wanted for.
        role: String,
        /// Its shape.
        found: String,
        /// The shapes allowed, each with what it means.
        expected: Box<str>,
    },
    /// A square matrix could be stored either way.
    #[error(
        "{file}: `{tensor}` as {role}: found {found}, a square matrix, which does not tell how it is stored; expected {option}"
    )]
    Orientation {
        /// The file.
        file: String,
        /// The tensor.
        tensor: String,
        /// What it is wanted for.
        role: String,
        /// Its shape.
        found: String,
        /// The option that settles it.
        option: &'static str,
    },
    /// A tensor that was named is not in the file.
    #[error("{file}: found no tensor `{tensor}` for {role}, expected one of {available}")]
    NoTensor {
        /// The file.
        file: String,
        /// What it is wanted for.
        role: String,
        /// The name given.
        tensor: String,
        /// The tensors that the file has.
        available: String,
    },
    /// Nothing in the file looks like a tensor that a model needs.
    #[error(
        "{file}: found no tensor for {role} among {available}, expected --map {role}=TENSOR to name one"
    )]
    Missing {
        /// The file.
        file: String,
        /// What it is wanted for.
        role: String,
        /// The tensors that the file has.
        available: String,
    },
    /// Several tensors look like the same part.
    #[error("{file}: found {found} for {role}, expected one: name it with --map {role}=TENSOR")]
    Candidates {
        /// The file.
        file: String,
        /// What they look like.
        role: String,
        /// The tensors with their shapes.
        found: String,
    },
    /// A network of several layers.
    #[error(
        "{file}: found {found}, the layers of a deeper {part}, expected one linear layer, or --activation elu, tanh or sigmoid to say what is between them"
    )]
    Layers {
        /// The file.
        file: String,
        /// `encoder` or `decoder`.
        part: &'static str,
        /// The tensors with their shapes.
        found: String,
    },
    /// Coefficients came without the terms that they belong to.
    #[error("{file}: found no candidate terms for {found}, expected {expected}")]
    NoLibrary {
        /// The file.
        file: String,
        /// The coefficients with their shape.
        found: String,
        /// The options that give a library, with a suggestion if the shape allows one.
        expected: String,
    },
    /// A phase of which nobody said when it holds.
    #[error(
        "{file}: found {found} of phase `{phase}`, expected --phase {phase}=FEET (any, none, or patterns such as 0011 in the order fr fl rr rl)"
    )]
    NoFeet {
        /// The file.
        file: String,
        /// The phase.
        phase: String,
        /// Where it was seen.
        found: String,
    },
    /// Encoder or decoder came without scale factors.
    #[error(
        "{file}: found an {part} without scale factors, expected --scaling FACTOR (scaled value = factor times SI value: 0.1 for the published models, 1 for SI units)"
    )]
    NoScaling {
        /// The file.
        file: String,
        /// `encoder` or `decoder`.
        part: &'static str,
    },
    /// An option that cannot be followed.
    #[error("{option}: found {found}, expected {expected}")]
    Option {
        /// The option.
        option: &'static str,
        /// What was given.
        found: String,
        /// What could be.
        expected: String,
    },
    /// A place of a text file that cannot be read.
    #[error("{file}:{line}:{column}: found {found}, expected {expected}")]
    Text {
        /// The file.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Character in the line, from 1.
        column: usize,
        /// What is there.
        found: String,
        /// What could be.
        expected: String,
    },
    /// The parts do not make a model.
    #[error("{file}: not a usable model")]
    Model {
        /// The file.
        file: String,
        /// What is wrong; tensors by their names in the model file.
        #[source]
        source: Box<ModelError>,
    },
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
