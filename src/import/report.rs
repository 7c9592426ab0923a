//! The decisions of an import: the use of each tensor, how it was stored, tensors left unused.

use std::fmt;

use serde::Serialize;

/// Everything that was decided on the way from a foreign file to a model.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ImportReport {
    /// The file.
    pub file: String,
    /// Its kind: the name of a [`Format`](super::Format), or `arrays` for tensors in memory.
    pub format: &'static str,
    /// Number of latent coordinates.
    pub latent_dim: usize,
    /// Number of robot coordinates, if there is an encoder or decoder.
    pub state_dim: Option<usize>,
    /// Number of candidate terms.
    pub library_dim: usize,
    /// The order of a standard library's terms in the file, by its name.
    pub library_order: Option<&'static str>,
    /// The candidate terms of a file of tensors in the order of its coefficients.
    pub terms: Vec<String>,
    /// Tensors that became part of the model.
    pub used: Vec<UsedTensor>,
    /// Tensors that did not.
    pub unused: Vec<UnusedTensor>,
    /// Equations that became part of the model.
    pub equations: Vec<ReadEquation>,
    /// Further decisions, in words.
    pub notes: Vec<String>,
}

/// A tensor that became part of the model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UsedTensor {
    /// What it is used as, such as `encoder.weight`.
    pub role: String,
    /// Its name in the file.
    pub tensor: String,
    /// Dimensions in the file.
    pub shape: Vec<usize>,
    /// Type of its numbers.
    pub element: String,
    /// Who decided this.
    pub chosen: Chosen,
    /// How it was stored.
    pub layout: Layout,
}

/// Who decided what a tensor is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Chosen {
    /// `--map`.
    Mapped,
    /// Its name.
    Named,
}

/// How a tensor was stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Layout {
    /// Weights for column vectors.
    Column,
    /// Weights for row vectors.
    Row,
    /// Coefficients, one row per term.
    TermsByLatent,
    /// Coefficients, one row per latent coordinate.
    LatentByTerms,
    /// A list of numbers, or a matrix that is the same both ways.
    Plain,
}

impl fmt::Display for Layout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Layout::Column => "column vectors (W x), as in the model file",
            Layout::Row => "row vectors (x W), transposed",
            Layout::TermsByLatent => "one row per term, as in the model file",
            Layout::LatentByTerms => "one row per latent coordinate, transposed",
            Layout::Plain => "as stored",
        })
    }
}

/// A tensor that is no part of the model.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct UnusedTensor {
    /// Its name in the file.
    pub tensor: String,
    /// Dimensions in the file.
    pub shape: Vec<usize>,
}

/// An equation that became a column of Xi.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ReadEquation {
    /// Its phase.
    pub phase: String,
    /// Its left side, such as `ddz1`.
    pub output: String,
    /// Line of its start, from 1.
    pub line: usize,
    /// Number of its terms.
    pub terms: usize,
}
