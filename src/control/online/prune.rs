//! Which of many linear constraints can be active at all.
//!
//! A row is superfluous if no point that satisfies the other rows violates it by more than a margin. That is a linear
//! program for each row: maximise `row · v` subject to the others, with the row itself relaxed so that the maximum
//! exists. The margin matters: left and right legs have nearly equal rows, of which each cuts a sliver off what the
//! other allows.

use super::problem::Row;
use super::qp::{Cone, ConeProgram, QpSettings, QpSolver, sparse};
use crate::solver::Outcome;

/// The rows without those that follow from the others to within `margin`, in the same order.
///
/// Rows are tried from the last to the first, so of two equal rows the first stays. As rows leave, earlier decisions
/// loosen; at the end each dropped row is tried against those that stayed and comes back if they no longer imply it. A
/// row also stays whenever its linear program is not solved beyond doubt.
pub fn needed_rows(rows: Vec<Row>, margin: f64) -> Vec<Row> {
    let mut is_kept = vec![true; rows.len()];
    for index in (0..rows.len()).rev() {
        is_kept[index] = !is_implied(&rows, &is_kept, index, margin);
    }
    // Each round brings at least one row back, so this ends.
    let is_missing = |is_kept: &[bool], index: usize| {
        !is_kept[index] && !is_implied(&rows, is_kept, index, margin)
    };
    while let Some(index) = (0..rows.len()).find(|&index| is_missing(&is_kept, index)) {
        is_kept[index] = true;
    }
    let rows = rows.into_iter().zip(is_kept);
    rows.filter_map(|(row, is_kept)| is_kept.then_some(row))
        .collect()
}

/// Whether the rows kept besides `index` imply it to within `margin`.
fn is_implied(rows: &[Row], is_kept: &[bool], index: usize, margin: f64) -> bool {
    let sizes = rows[index].row.iter().map(|entry| entry.abs());
    let relaxation = sizes.fold(0.0, f64::max).max(1.0) + margin;
    let others = (0..rows.len()).filter(|&other| is_kept[other] && other != index);
    let mut others: Vec<&Row> = others.map(|other| &rows[other]).collect();
    others.push(&rows[index]);
    match maximum(&others, relaxation) {
        // The solver's own tolerance must not decide.
        Some(maximum) => maximum <= rows[index].bound + margin.max(1e-6 * relaxation),
        None => false,
    }
}

/// `max row · v` for the last row subject to all rows, that one relaxed.
fn maximum(rows: &[&Row], relaxation: f64) -> Option<f64> {
    let last = rows.last()?;
    let dim = last.row.len();
    let mut entries = Vec::with_capacity(rows.len() * dim);
    for (number, row) in rows.iter().enumerate() {
        let values = row.row.iter().enumerate();
        entries.extend(values.map(|(col, &value)| (number, col, value)));
    }
    let mut b: Vec<f64> = rows.iter().map(|row| row.bound).collect();
    b[rows.len() - 1] += relaxation;
    let program = ConeProgram {
        p: sparse(dim, dim, &[]),
        q: last.row.iter().map(|entry| -entry).collect(),
        a: sparse(rows.len(), dim, &entries),
        b,
        cones: vec![Cone::Nonnegative(rows.len())],
    };
    let settings = QpSettings {
        tolerance: 1e-9,
        max_iterations: 100,
        ..QpSettings::default()
    };
    let mut solver = QpSolver::new(program, settings).ok()?;
    if solver.solve() != Outcome::Solved {
        return None;
    }
    let terms = last.row.iter().zip(solver.solution());
    Some(terms.map(|(row, value)| row * value).sum())
}
