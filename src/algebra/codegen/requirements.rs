//! What statements need from outside.

use super::code::{Expr, MathFunction, Stmt};
use super::ident::Ident;

/// Whether the statements call the sine-and-cosine kernel.
pub fn calls_kernel(body: &[Stmt]) -> bool {
    body.iter().any(|statement| match statement {
        Stmt::Call { callee, .. } => callee.is_none(),
        Stmt::SinCosLane { .. } => true,
        other => calls_kernel(other.inner()),
    })
}

/// The arrays that are assigned in lanes.
pub fn assigned_in_lanes(body: &[Stmt]) -> Vec<Ident> {
    let assigned = |statement: &Stmt| match statement {
        Stmt::Row(row) => vec![row.slopes.clone()],
        other => assigned_in_lanes(other.inner()),
    };
    body.iter().flat_map(assigned).collect()
}

/// Whether the statements have sums of vectors.
pub fn has_fours(body: &[Stmt]) -> bool {
    body.iter()
        .any(|statement| matches!(statement, Stmt::Fours(_)))
}

/// Whether the statements apply a function.
pub fn calls_function(body: &[Stmt], function: MathFunction) -> bool {
    body.iter().any(|statement| match statement {
        Stmt::Let(_, value) | Stmt::Assign(_, value) | Stmt::AddAssign(_, value) => {
            applies(value, function)
        }
        Stmt::LetArray(_, elements) => elements.iter().any(|value| applies(value, function)),
        Stmt::SinCosLane { argument, .. } => applies(argument, function),
        // A row has sums of products only.
        other => calls_function(other.inner(), function),
    })
}

fn applies(expr: &Expr, function: MathFunction) -> bool {
    match expr {
        Expr::Apply(applied, a) => *applied == function || applies(a, function),
        Expr::Negate(a) => applies(a, function),
        Expr::Infix(_, a, b) => applies(a, function) || applies(b, function),
        Expr::Literal(_)
        | Expr::Name(_)
        | Expr::Element(..)
        | Expr::Entry(..)
        | Expr::Lanes(..)
        | Expr::LaneTotal(_) => false,
    }
}
