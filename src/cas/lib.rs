//! The computer algebra system. In: texts and coefficients. Out: derivatives, rewritten forms, values, bounds and texts
//! of hash-consed canonical expressions ([`ExprId`]) in an [`ExprPool`]. Read [`ExprPool`] first for the invariants,
//! then `build.rs` and `power.rs`, the constructors that ensure them; `order.rs` explains why equal sums print alike.
//! Only the parser recurses on the machine's stack, to a limited depth; no hash map is iterated for a result.
//!
//! | files | |
//! |---|---|
//! | `node`, `function`, `number`, `pool`, `order` | expressions and their storage |
//! | `build`, `power` | canonical constructors |
//! | `parse`, `defined`, `display` | the grammar of candidate terms, both ways; constants without a value |
//! | `interval`, `values` | values, and bounds over boxes |
//! | `diff` | derivatives |
//! | `slope`, `germ`, `series` | derivatives with values where roots, magnitudes and signs have kinks |
//! | `region`, `polynomial`, `trig`, `rules`, `factors` | substitution and rewriting, each way when asked |
//! | `simplify`, `shorten`, `cost` | choosing the shortest of equal forms |
//! | `canonical/` | a normal form with exact coefficients, to decide equality |
//!
//! ```
//! use romc::symbolic::ExprPool;
//!
//! let mut pool = ExprPool::new();
//! let ddz1 = pool.parse("0.36 - 0.91*dz2 - 0.16*dz1 - 0.75*sin(dz1)", &|_| true)?;
//! assert_eq!(
//!     pool.display(ddz1).to_string(),
//!     "0.36 - 0.16*dz1 - 0.91*dz2 - 0.75*sin(dz1)"
//! );
//!
//! let dz1 = pool.symbol_id("dz1");
//! let slope = pool.derivative(ddz1, dz1);
//! assert_eq!(pool.display(slope).to_string(), "-0.16 - 0.75*cos(dz1)");
//! assert_eq!(pool.evaluate(slope, &|_| 0.0), -0.91);
//! # Ok::<(), romc::symbolic::ParseError>(())
//! ```
#![allow(
    missing_docs,
    reason = "names are self-explanatory where there is no comment"
)]

mod build;
mod canonical;
mod cost;
mod defined;
mod diff;
mod display;
mod factors;
mod function;
mod germ;
#[cfg(test)]
#[path = "../../tests/symbolic_identities/mod.rs"]
mod identities;
mod interval;
mod node;
mod number;
mod order;
mod parse;
mod polynomial;
mod pool;
mod power;
mod region;
mod rules;
mod series;
mod shorten;
mod simplify;
mod slope;
mod trig;
mod values;

pub use canonical::{
    forms::CanonicalForms,
    polynomial::{CanonicalForm, Coefficient},
};
pub use defined::Reading;

pub use function::Function;
pub use interval::Interval;
pub use node::{ExprId, Node, SymbolId};
pub use number::{Number, sum_of_floats};
pub use parse::{ParseError, ParseErrorKind};
pub use pool::ExprPool;
pub use shorten::search::{Shortened, Shortener};
pub use values::integer_power;

// Names that most files use.
use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::fmt;
use std::sync::Arc;

use defined::Guards;
use germ::{Germs, LAST_ORDER, Stop};
use node::{IdMap, IdSet};
use num_integer::{Integer, Roots};
use order::Exponent;
use pool::Sign;
