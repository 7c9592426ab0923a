//! What a user can choose about the LaTeX.

use crate::typeset::{Rounding, SymbolTable};

use super::math::NumberStyle;

/// How the equations of a phase stand on the page.
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

/// Options of the LaTeX backend.
///
/// The default reproduces the form of the paper's equations (25) and (26).
#[derive(Clone, Debug, PartialEq)]
pub struct LatexOptions {
    /// How coefficients are rounded.
    pub rounding: Rounding,
    /// How numbers are spelled.
    pub numbers: NumberStyle,
    /// How equations are arranged.
    pub form: Form,
    /// Longest line in em of the text around (1 em is 10 pt in a 10 pt document):
    /// 32 suits one column, 22 a column of a two-column paper.
    pub width_em: f64,
    /// New names for variables.
    pub symbols: SymbolTable,
    /// Digest of the model file, for the first line of each file.
    pub digest: Option<String>,
}

impl Default for LatexOptions {
    fn default() -> Self {
        Self {
            rounding: Rounding::default(),
            numbers: NumberStyle::default(),
            form: Form::default(),
            width_em: 32.0,
            symbols: SymbolTable::default(),
            digest: None,
        }
    }
}
