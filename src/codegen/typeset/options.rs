//! What a user can choose about printed equations, and why they cannot be printed.

use super::decimal::Rounding;
use super::symbols::SymbolTable;

/// How the equations of a phase stand on a page of LaTeX.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Form {
    /// [`Form::Cases`] for a phase that fits on a page, [`Form::Align`] for a longer one.
    #[default]
    #[value(skip)]
    Automatic,
    /// A number for each equation; breaks across pages.
    Align,
    /// One number, a brace around the phase's equations.
    Cases,
}

/// How numbers are written in LaTeX.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NumberStyle {
    /// Digits as they are: `0.36`, `1.2 \times 10^{-9}`.
    #[default]
    Plain,
    /// The macro of siunitx: `\num{0.36}`.
    Siunitx,
}

/// How equations are printed, in LaTeX, Markdown and MathML alike.
///
/// The default reproduces the form of the paper's equations (25) and (26).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PrintOptions {
    /// How coefficients are rounded.
    pub rounding: Rounding,
    /// Longest line in em of the text around (1 em is 10 pt in a 10 pt document): 32 suits one column, 22 a column of a
    /// two-column paper. `None` is 32 for LaTeX and 44 for other pages.
    pub width_em: Option<f64>,
    /// New names for variables.
    pub symbols: SymbolTable,
    /// Digest of the model file, for the first line of each file.
    pub digest: Option<String>,
    /// How numbers are spelled in LaTeX.
    pub numbers: NumberStyle,
    /// How equations are arranged in LaTeX.
    pub form: Form,
}

/// Why the equations of a model could not be printed.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each variant's message names its fields")]
pub enum TypesetError {
    /// A coefficient in robot coordinates is too large once folded with weights and scale factors.
    #[error("robot coordinates, {output}: the coefficient of {term:?} is {value} in SI units")]
    NotFinite {
        output: String,
        term: String,
        value: f64,
    },
    /// A template failed to render.
    #[error("a template failed")]
    Template(#[from] askama::Error),
}
