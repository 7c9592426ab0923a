//! Replacements of a term: nothing, a constant, a straight line.

use super::certificate::ChangeKind;
use super::ranges::Ranges;
use super::workspace::Workspace;
use crate::symbolic::{ExprId, Interval, SymbolId};

/// Terms of more variables than this are not made linear.
const MAX_LINEAR_SYMBOLS: usize = 4;
/// A constant or slope that would lower the error by less than this share is left out.
const WORTHWHILE: f64 = 0.05;

/// A replacement of a term `theta`: `theta = sum r_k theta_k + error`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Rewrite {
    pub kind: ChangeKind,
    /// Rows and factors `r_k`.
    pub parts: Vec<(usize, f64)>,
    /// All values of the error over the box.
    pub error: Interval,
}

/// All replacements of a term over the box of `ranges`, simplest first; none for a term without
/// finite values there.
pub(super) fn rewrites(workspace: &Workspace, ranges: &mut Ranges, row: usize) -> Vec<Rewrite> {
    let range = ranges.term(row);
    if range.is_empty() || !range.magnitude().is_finite() {
        return Vec::new();
    }
    let mut all = vec![Rewrite {
        kind: ChangeKind::Dropped,
        parts: Vec::new(),
        error: range,
    }];
    if workspace.constant() == Some(row) {
        return all;
    }
    all.extend(centred(workspace, ChangeKind::Constant, Vec::new(), range));
    let sides = ranges.sides(ranges.expr(row));
    let Some(parts) = slopes(workspace, ranges, row, &sides) else {
        return all;
    };
    let mut difference = vec![(row, Interval::point(1.0))];
    let negated = parts
        .iter()
        .map(|&(row, factor)| (row, Interval::point(-factor)));
    difference.extend(negated);
    let error = ranges.combination(&difference);
    if error.magnitude().is_finite() {
        let kind = ChangeKind::Linear;
        let with_constant = centred(workspace, kind, parts.clone(), error);
        all.extend(with_constant.or(Some(Rewrite { kind, parts, error })));
    }
    all
}

/// The replacement with a constant that puts the middle of the error at zero, where that is worth it.
fn centred(
    workspace: &Workspace,
    kind: ChangeKind,
    mut parts: Vec<(usize, f64)>,
    error: Interval,
) -> Option<Rewrite> {
    let middle = error.middle();
    if middle.abs() <= WORTHWHILE * error.magnitude() {
        return None;
    }
    parts.push((workspace.constant()?, middle));
    Some(Rewrite {
        kind,
        parts,
        error: error - Interval::point(middle),
    })
}

/// Slopes of the chords along each variable through the middle of the box, exact for products.
fn slopes(
    workspace: &Workspace,
    ranges: &mut Ranges,
    row: usize,
    sides: &[(SymbolId, f64, f64)],
) -> Option<Vec<(usize, f64)>> {
    let expr = ranges.expr(row);
    let is_affine = (sides.iter()).all(|&(symbol, _, _)| {
        let slope = ranges.pool().derivative(expr, symbol);
        ranges.pool().is_constant(slope)
    });
    if is_affine || sides.len() > MAX_LINEAR_SYMBOLS {
        return None;
    }
    let size = ranges.term(row).width();
    let mut parts = Vec::new();
    for (index, &(symbol, _, half)) in sides.iter().enumerate() {
        let rise = value(ranges, expr, sides, index, 1.0) - value(ranges, expr, sides, index, -1.0);
        if half == 0.0 || rise.abs() <= WORTHWHILE * size {
            continue;
        }
        parts.push((workspace.variable(symbol)?, rise / (2.0 * half)));
    }
    let is_line = !parts.is_empty() && parts.iter().all(|part| part.1.is_finite());
    is_line.then_some(parts)
}

/// The value where one variable is `step` half widths from its centre and the others at theirs.
fn value(
    ranges: &mut Ranges,
    expr: ExprId,
    sides: &[(SymbolId, f64, f64)],
    moved: usize,
    step: f64,
) -> f64 {
    ranges.pool().evaluate(expr, &|symbol| {
        let place = sides.iter().position(|(known, _, _)| *known == symbol);
        place.map_or(f64::NAN, |place| {
            let (_, centre, half) = sides[place];
            match place == moved {
                true => centre + step * half,
                false => centre,
            }
        })
    })
}
