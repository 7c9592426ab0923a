//! Equations laid out for print, before they have a spelling.
//!
//! A [`ReducedModel`](crate::model::ReducedModel) enters; a [`Typeset`] leaves: one
//! [`EquationSystem`] a phase, made of [`Math`] trees in which fractions, roots,
//! parentheses, signs and rounded coefficients have their final place. [`latex`],
//! [`markdown`] and [`mathml`] spell the same trees. Read [`tree`] first, then
//! [`expression()`] (from the algebra to the tree) and [`equations`].

mod decimal;
pub mod equations;
mod error;
pub mod expression;
pub mod latex;
pub mod markdown;
pub mod mathml;
mod options;
mod page;
pub mod robot;
mod rounder;
mod symbols;
mod table;
pub mod tree;
mod width;
pub mod words;

pub use decimal::{Decimal, MOST_DIGITS, Rounding};
pub use equations::{CoefficientRow, CoefficientTable, Equation, EquationSystem, Typeset};
pub use error::{RenameError, TypesetError};
pub use expression::expression;
pub use options::{Form, NumberStyle, PrintOptions};
pub use page::rendered;
pub use robot::RobotTypeset;
pub use rounder::{Place, RoundingReport};
pub use symbols::SymbolTable;
pub use table::{Cell, Rows, Table, rounded, rounded_up, significant};
pub use tree::{GREEK, Glyph, Math, Signed, Symbol};
pub use width::{EQUALS, break_lines, symbol_width, width};
