//! A normal form with exact coefficients, which decides whether two expressions are equal.
//!
//! Sines, cosines and exponentials become `exp(P)` with complex rational polynomials `P`, so that products, squares,
//! sums and multiples of angles need no rules. Sums of `c * x^k * exp(P)` with distinct `x^k exp(P)` are zero only if
//! every `c` is. Roots, logarithms, magnitudes, tangents and reciprocals of sums are atoms with arguments in normal
//! form; [`CanonicalForms::without_fractions`] removes the last two kinds by multiplying out. A number may carry a
//! radius, half a unit of the last digit of a printed decimal. Radii add up through all operations; arguments of
//! functions that agree within them count as equal.
//!
//! Equal forms prove equal values wherever both are defined. Different forms prove a difference only where no atoms
//! depend on each other (`sqrt(1 + x)`, `sqrt(2 + x)` and `sqrt(2 + 3*x + x^2)` do): confirm it at a point.

pub(crate) mod forms;
pub(crate) mod polynomial;
mod products;
mod roots;

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use forms::{CanonicalForms, MAX_ROOT, exponentials};
use num_bigint::{BigInt, BigUint};
use num_traits::{One, Signed, ToPrimitive, Zero};
use polynomial::{Atom, CanonicalForm, Coefficient, Monomial, Rational, nearest, ratio};

use crate::{ExprId, ExprPool, Function, Node, Number, SymbolId};
