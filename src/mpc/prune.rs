//! Which of many linear constraints can be active at all.
//!
//! A row is superfluous if no point that satisfies the other rows violates it. That is a linear
//! program for each row: maximise `row · v` subject to the others, with the row itself relaxed so
//! that the maximum exists.

use super::problem::Row;
use super::qp::{Cone, ConeProgram, Outcome, QpSettings, QpSolver};
use super::sparse::SparseColumns;

/// By how much a relaxed row may be exceeded before it counts as needed, relative to its relaxation.
const MARGIN: f64 = 1e-5;

/// The rows without those that follow from the others, in the same order.
///
/// Rows are tried from the last to the first and leave the set at once, so of two equal rows the
/// first stays. A row stays whenever its linear program is not solved beyond doubt.
pub(super) fn needed_rows(rows: Vec<Row>) -> Vec<Row> {
    let mut kept = rows;
    for index in (0..kept.len()).rev() {
        if is_superfluous(&kept, index) {
            kept.remove(index);
        }
    }
    kept
}

fn is_superfluous(rows: &[Row], index: usize) -> bool {
    let relaxation = rows[index]
        .row
        .iter()
        .map(|entry| entry.abs())
        .fold(0.0, f64::max)
        .max(1.0);
    match maximum(rows, index, relaxation) {
        Some(maximum) => maximum <= rows[index].bound + MARGIN * relaxation,
        None => false,
    }
}

/// `max row_index · v` subject to all rows, that one relaxed.
fn maximum(rows: &[Row], index: usize, relaxation: f64) -> Option<f64> {
    let dim = rows[index].row.len();
    let entries: Vec<(usize, usize)> = (0..rows.len())
        .flat_map(|row| (0..dim).map(move |col| (row, col)))
        .collect();
    let mut a = SparseColumns::from_pattern(rows.len(), dim, &entries);
    let mut b = Vec::with_capacity(rows.len());
    for (row, constraint) in rows.iter().enumerate() {
        for (col, &entry) in constraint.row.iter().enumerate() {
            a.set(row, col, entry);
        }
        b.push(constraint.bound + if row == index { relaxation } else { 0.0 });
    }
    let program = ConeProgram {
        p: SparseColumns::from_pattern(dim, dim, &[]),
        q: rows[index].row.iter().map(|entry| -entry).collect(),
        a,
        b,
        cones: vec![Cone::Nonnegative(rows.len())],
    };
    let settings = QpSettings {
        tolerance: 1e-9,
        max_iterations: 100,
        ..QpSettings::default()
    };
    let mut solver = QpSolver::new(program, settings).ok()?;
    match solver.solve() {
        Outcome::Solved => Some(
            rows[index]
                .row
                .iter()
                .zip(solver.solution())
                .map(|(row, value)| row * value)
                .sum(),
        ),
        Outcome::Inaccurate
        | Outcome::Infeasible
        | Outcome::Unbounded
        | Outcome::IterationCap
        | Outcome::NumericalFailure => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(joint: usize, row: &[f64], bound: f64) -> Row {
        Row {
            joint,
            row: row.to_vec(),
            bound,
        }
    }

    #[test]
    fn row_outside_the_square_of_the_others_is_dropped_and_one_that_cuts_a_corner_stays() {
        let square = [
            row(0, &[1.0, 0.0], 1.0),
            row(1, &[-1.0, 0.0], 1.0),
            row(2, &[0.0, 1.0], 1.0),
            row(3, &[0.0, -1.0], 1.0),
        ];
        let mut rows = square.to_vec();
        rows.push(row(4, &[1.0, 1.0], 2.5));
        rows.push(row(5, &[1.0, 1.0], 1.5));
        rows.push(row(6, &[0.5, 0.0], 0.5));
        let kept: Vec<usize> = needed_rows(rows).iter().map(|row| row.joint).collect();
        assert_eq!(kept, [0, 1, 2, 3, 5]);
    }

    #[test]
    fn a_single_row_is_always_needed() {
        assert_eq!(needed_rows(vec![row(0, &[2.0, 0.0], 1.0)]).len(), 1);
    }
}
