//! A normal form with exact coefficients, which decides whether two expressions are equal.
//!
//! Sines, cosines and exponentials become exponentials `exp(P)` with complex rational polynomials `P`, so that
//! products, squares, sums and multiples of angles need no rule of their own; sums of `c * x^k * exp(P)` with distinct
//! `x^k exp(P)` are zero only if every `c` is. Roots, logarithms, magnitudes, tangents and reciprocals of sums are
//! atoms with arguments in normal form; [`CanonicalForms::without_fractions`] removes the last two kinds by multiplying
//! out.
//!
//! Each number may carry a radius: the half unit of the last digit of a decimal in print. Radii add up through all
//! operations, and arguments of functions that agree within them count as equal.
//!
//! Two expressions with the same form have the same value wherever both are defined. Different forms prove a difference
//! only where no atoms depend on each other (`sqrt(1 + x)`, `sqrt(2 + x)` and `sqrt(2 + 3*x + x^2)` do), so a
//! difference should be confirmed at a point.

mod forms;
mod polynomial;
mod products;
mod roots;

pub use forms::CanonicalForms;
pub use polynomial::{CanonicalForm, Coefficient};
