//! Rows of functions in C: block after block of columns, all lanes of one side by side.

use std::ops::Range;

use super::dialect::CDialect;
use crate::codegen::code::{Expr, Index};
use crate::codegen::dialect::{Dialect, Lines};
use crate::codegen::lanes::Row;
use crate::codegen::printer::Printer;
use crate::ir::LANES;

/// The lines of a row.
pub(super) fn row(dialect: &CDialect, row: &Row) -> Lines {
    let [_, block, lane, _, sums] = &row.names;
    let print = |expr: &Expr| Printer::new(dialect).expression(expr);
    let full = row.n_slopes / LANES;
    let mut lines = vec![(0, format!("{}_eight {sums};", dialect.name))];
    for run in &row.runs() {
        let columns = |first: Index, has_slopes: bool, op: &str| {
            columns(dialect, row, run, &first, has_slopes, op)
        };
        // The first block begins the sums, and the last may have fewer slopes than lanes.
        let mut blocks = run.clone();
        if blocks.start == 0 {
            lines.extend(columns(Index::fixed(0), full > 0, "="));
            blocks.start = 1;
        }
        let inner = blocks.start..blocks.end.min(full).max(blocks.start);
        if inner.len() == 1 {
            lines.extend(columns(Index::fixed(LANES * inner.start), true, "+="));
        } else if !inner.is_empty() {
            let first = Index::fixed(LANES * inner.start).plus(LANES, block);
            let inside = columns(first, true, "+=");
            let head = dialect.for_loop(&block.to_string(), inner.len());
            lines.extend(looped(head, inside));
        }
        if inner.end < blocks.end {
            lines.extend(columns(Index::fixed(LANES * inner.end), false, "+="));
        }
        if run.contains(&full) && !row.n_slopes.is_multiple_of(LANES) {
            let at = Index::variable(lane).shifted(LANES * full);
            let [_, target, slope] = row.column(run, &at).map(|expr| print(&expr));
            let head = dialect.for_loop(&lane.to_string(), row.n_slopes % LANES);
            lines.extend(looped(head, vec![(0, format!("{target} = {slope};"))]));
        }
    }
    let (sum, start) = (print(&row.sum), print(&row.start));
    let total = format!("{}_LANE_TOTAL({sums})", dialect.upper());
    lines.push((0, format!("{sum} = {start} + {total};")));
    lines
}

/// One block of columns from `first` on.
fn columns(
    dialect: &CDialect,
    row: &Row,
    run: &Range<usize>,
    first: &Index,
    has_slopes: bool,
    op: &str,
) -> Lines {
    let [_, _, lane, _, sums] = &row.names;
    let (upper, at) = (dialect.upper(), first.clone().plus(1, lane));
    let in_lanes = CDialect {
        in_lanes: true,
        ..dialect.clone()
    };
    let print = |expr: &Expr| Printer::new(&in_lanes).expression(expr);
    let mut body = Vec::new();
    let [term, target, slope] = row.column(run, &at);
    if has_slopes {
        let target = Printer::new(dialect).expression(&target);
        body.push((0, format!("{upper}_WRITE({target}) = {};", print(&slope))));
    }
    let term = print(&term);
    body.push((0, format!("{upper}_SUMS({sums}, {lane}) {op} {term};")));
    let head = format!("for (size_t {lane} = 0; {lane} < {LANES}; {lane} += {upper}_LANE_STEP)");
    looped(head, body)
}

fn looped(head: String, body: Lines) -> Lines {
    let inside = body.into_iter().map(|(depth, line)| (depth + 1, line));
    let open = std::iter::once((0, format!("{head} {{")));
    open.chain(inside).chain([(0, "}".to_owned())]).collect()
}
