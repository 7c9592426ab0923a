//! Whether two sets of equations are equal. In: two files, each a model, equations as text, LaTeX or Markdown. Out: a
//! [`Comparison`]. For each phase and acceleration it has a proof that the two sides are equal, or a point where they
//! differ, with the difference and its terms. Numbers count as the decimals that they are written as; those of LaTeX
//! and Markdown as rounded in their last digit, unless [`CheckOptions::exact`].
//!
//! Read `compare.rs` first: it pairs phases and equations and proves equality by normal forms. `side.rs` reads a file,
//! `point.rs` searches for a point of difference in interval arithmetic.
//!
//! ```
//! use romc::check::{CheckOptions, Side, compare};
//!
//! let options = CheckOptions::default();
//! let text = Side::from_bytes("a.txt", b"ddz1 = 0.3612*sin(2*z1)", &options, &[])?;
//! let paper = br"\[\ddot z_1 = 0.72\sin z_1\cos z_1\]";
//! let paper = Side::from_bytes("b.tex", paper, &options, &[])?;
//! let comparison = compare(&text, &paper, &options);
//! assert!(comparison.is_equal());
//! # Ok::<(), romc::check::CheckError>(())
//! ```

#![allow(
    missing_docs,
    reason = "names are self-explanatory where there is no comment"
)]

mod compare;
mod point;
mod side;
#[cfg(test)]
#[path = "../../tests/check/units.rs"]
mod units;

pub(crate) use compare::TermDifference;
pub use compare::{Comparison, Difference, Verdict, compare};
pub(crate) use point::CheckDomain;
pub(crate) use point::Gap;
pub(crate) use side::read_sides;
pub use side::{CheckError, Side};

use std::path::Path;

use crate::files::{Place, size};
use crate::import::{Format, ImportError, SymbolNames, read_equations};
use crate::model::{LatentVariable, MAX_LATENT_DIM, ReducedModel};
use crate::symbolic::{
    CanonicalForm, CanonicalForms, Coefficient, ExprId, ExprPool, Interval, Node, Number,
    ParseError, Reading, SymbolId,
};

#[derive(Clone, Debug, Default, PartialEq)]
pub struct CheckOptions {
    pub exact: bool,
    pub(crate) symbols: SymbolNames,
    pub(crate) domain: CheckDomain,
}
