//! The shortest form of a long sum with floating-point coefficients, such as an equation of a model. Read `search.rs`
//! first, which replaces group by group. `groups.rs` finds the groups, `forms.rs` the shortest form of one, and
//! `agreement.rs` compares it with the group in intervals and at points.
//!
//! Each term is converted to its normal form. Terms whose normal forms share a monomial, as powers or as sines and
//! cosines of multiple angles, are a group. Only groups are searched. A form replaces a group only if it is shorter and
//! has the same values at some points, also far out; all other terms keep their bits and places. Sums of monomials,
//! each with at most one function of a variable, need no search, so the time for long ones is linear.
//!
//! Coefficients of a group that are small multiples of one of them, to a unit in the last place, are treated as such
//! (`0.1` and `-0.3` are 1 and -3 times `0.1`). Others are treated as the decimal fractions that are written for them
//! where these fit, else as floats.

mod agreement;
mod forms;
mod groups;
pub(crate) mod search;

use std::collections::{BTreeMap, BTreeSet, HashMap};

use agreement::Agreement;
use search::{Block, Distance, Shortener};

use super::*;
use crate::simplify::MAX_WORK;

/// Summands `coefficient * expr`.
type Summands = Vec<(f64, ExprId)>;
/// The same with coefficients of a group's own.
type Scaled = Vec<(Number, ExprId)>;
