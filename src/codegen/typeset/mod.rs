//! Equations laid out for print, before they have a spelling.
//!
//! A model enters; a [`Typeset`] leaves: one [`EquationSystem`] a phase, of `Math` trees with all parentheses, signs
//! and rounded coefficients in place, which [`latex`], [`markdown`] and [`mathml`] spell. Read `tree` first, then
//! `expression` and `equations`.

mod decimal;
mod equations;
pub(crate) mod expression;
pub mod latex;
pub mod markdown;
pub mod mathml;
mod robot;
mod symbols;
mod table;
mod text;
pub(crate) mod tree;
pub mod words;

pub use decimal::{Decimal, Rounding};
pub(crate) use equations::{CoefficientPart, CoefficientRow, CoefficientTable};
pub use equations::{Equation, EquationSystem, Typeset, alike};
pub(crate) use robot::RobotTypeset;
pub(crate) use symbols::Emitted;
pub use symbols::{Form, NumberStyle, PrintOptions, RenameError, SymbolTable, TypesetError};
pub use table::{COLUMNS, Cell, Table, rounded, rounded_up, significant, wrapped};
pub use text::{TextOptions, equations_text, model_text};
pub(crate) use tree::{EQUALS, Glyph, Math, Signed, Symbol, break_lines, symbol_width, width};

use std::fmt;

use askama::Template;
use decimal::{Rounder, RoundingReport};
use expression::{are_rounded, terms};
use latex::tex_cases;
use nalgebra::{DMatrix, DVector};
use tree::greek_letter;
use words::{Page, Spelling, code_point, rendered};

use crate::equations::{Equations, Unit};
use crate::files::{EmittedFile, is_invisible};
use crate::model::{AffineMap, FeetRule, LatentVariable, MAX_LATENT_DIM, ReducedModel};
use crate::symbolic::{ExprId, ExprPool, Function, Node, Number, SymbolId};
