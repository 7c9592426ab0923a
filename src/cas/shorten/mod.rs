//! The shortest form of a long sum with floating-point coefficients, such as an equation of a model.
//!
//! What can be said about one term alone is found by [`ExprPool::simplify`]. Then the terms that can
//! interact are found: each is brought to its normal form, and those whose normal forms have a
//! monomial in common, as powers or as sines and cosines of multiple angles, are a group. Only
//! groups are searched, and only a form that is shorter replaces one; all other terms keep their
//! bits and their places. A sum of monomials, each with at most one function of a variable, needs
//! no search at all, so that the time for long sums of these is linear.
//!
//! **Coefficients.** Those of a group that are small multiples of one of them, to a unit in the last
//! place, are taken as such multiples (`0.1` and `-0.3` are 1 and -3 times `0.1`); otherwise they
//! are the decimal fractions that are written for them, as far as these fit, and floats beyond.
//!
//! **Check.** Every replacement is evaluated at some points, also far out, beside what it replaces; one that
//! differs by more than rounding explains, or has no value where there was one, is dropped.
//!
//! `search.rs` replaces group by group, `groups.rs` finds the groups, `forms.rs` the shortest form of
//! one, `agreement.rs` compares it with what it replaces. Read `search.rs` first.

mod agreement;
mod forms;
mod groups;
mod search;

pub use search::{Shortened, Shortener};

use super::node::ExprId;
use super::number::Number;

/// Summands `coefficient * expr`.
type Summands = Vec<(f64, ExprId)>;
/// The same with coefficients of a group's own.
type Scaled = Vec<(Number, ExprId)>;
