//! Separates equations into candidate terms and their coefficients.
//!
//! A coefficient is the number in front of a term, bit for bit as it is written; sums inside a product with a number
//! are multiplied out (`2*(0.5*z1 - u1)` is `z1 - 2*u1`), products of sums stay one term (`z1*(1 + dz1)`).

use std::collections::HashMap;

use crate::model::LatentVariable;
use crate::symbolic::{ExprId, ExprPool, Function, Node, Number};

pub(super) type Coefficients = HashMap<ExprId, Number>;

/// Coefficients of `expr` as a sum over terms; `None` if one overflows.
///
/// A sum which `is_term` names is taken whole.
pub(super) fn coefficients(
    pool: &ExprPool,
    expr: ExprId,
    is_term: &dyn Fn(ExprId) -> bool,
) -> Option<Coefficients> {
    let mut found = Coefficients::new();
    let mut open = vec![(Number::ONE, expr)];
    while let Some((factor, expr)) = open.pop() {
        let (inner, rest) = pool.split(expr);
        let coefficient = multiply(factor, inner)?;
        match pool.node(rest) {
            Node::Sum(terms) if !is_term(rest) => {
                open.extend(terms.iter().map(|&term| (coefficient, term)));
            }
            _ if coefficient.is_zero() => {}
            _ => {
                let sum = found.entry(rest).or_insert(Number::ZERO);
                *sum = sum.checked_add(coefficient)?;
            }
        }
    }
    found.retain(|_, coefficient| !coefficient.is_zero());
    Some(found)
}

/// The product, without touching a number that is multiplied by one.
fn multiply(a: Number, b: Number) -> Option<Number> {
    match (a.is_one(), b.is_one()) {
        (true, _) => Some(b),
        (false, true) => Some(a),
        (false, false) => a.checked_mul(b),
    }
}

/// Sorts terms as the standard library does: constant, z, dz, monomials by degree, sin z, sin dz, cos z, cos dz,
/// anything else, u.
pub(super) fn sort(pool: &ExprPool, latent_dim: usize, terms: &mut [ExprId]) {
    let key = |expr: &ExprId| Key::of(pool, latent_dim, *expr);
    terms.sort_by(|a, b| key(a).cmp(&key(b)).then_with(|| pool.compare(*a, *b)));
}

/// Place of a term; the derived order is that of the variants and their fields.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Key {
    Constant,
    /// Degree, then indices into (z, dz), each as often as its power.
    Monomial(usize, Vec<usize>),
    /// Function (sin, cos), then index into (z, dz).
    Trigonometric(usize, usize),
    Other,
    Input(usize),
}

impl Key {
    fn of(pool: &ExprPool, latent_dim: usize, expr: ExprId) -> Key {
        if expr == ExprId::ONE {
            return Key::Constant;
        }
        if let Some(LatentVariable::U(index)) = variable(pool, latent_dim, expr) {
            return Key::Input(index);
        }
        if let Node::Apply(function, argument) = pool.node(expr) {
            let state = state_index(pool, latent_dim, *argument);
            return match (function, state) {
                (Function::Sin, Some(index)) => Key::Trigonometric(0, index),
                (Function::Cos, Some(index)) => Key::Trigonometric(1, index),
                _ => Key::Other,
            };
        }
        match monomial(pool, latent_dim, expr) {
            Some(indices) => Key::Monomial(indices.len(), indices),
            None => Key::Other,
        }
    }
}

fn variable(pool: &ExprPool, latent_dim: usize, expr: ExprId) -> Option<LatentVariable> {
    let symbol = pool.as_symbol(expr)?;
    LatentVariable::from_name(pool.symbol_name(symbol), latent_dim)
}

fn state_index(pool: &ExprPool, latent_dim: usize, expr: ExprId) -> Option<usize> {
    let place = variable(pool, latent_dim, expr)?.place(latent_dim)?;
    (place < 2 * latent_dim).then_some(place)
}

/// Indices into (z, dz), rising, each as often as its power.
fn monomial(pool: &ExprPool, latent_dim: usize, expr: ExprId) -> Option<Vec<usize>> {
    let mut indices = Vec::new();
    for &factor in pool.factors_of(expr) {
        let (base, power) = match pool.node(factor) {
            Node::Power(base, exponent) => {
                let power = pool.as_number(*exponent)?.as_integer()?;
                (*base, usize::try_from(power).ok()?)
            }
            _ => (factor, 1),
        };
        let index = state_index(pool, latent_dim, base)?;
        indices.extend(std::iter::repeat_n(index, power));
    }
    indices.sort_unstable();
    Some(indices)
}
