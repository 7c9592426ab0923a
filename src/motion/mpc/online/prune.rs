//! Which of many linear constraints can be active at all.
//!
//! A row is superfluous if no point that satisfies the other rows violates it by more than a margin.
//! That is a linear program for each row: maximise `row · v` subject to the others, with the row
//! itself relaxed so that the maximum exists. The margin matters: left and right legs have nearly
//! equal rows, of which each cuts a sliver off what the other allows.

use super::problem::Row;
use super::qp::{Cone, ConeProgram, Outcome, QpSettings, QpSolver};
use super::sparse::SparseColumns;

/// The rows without those that follow from the others to within `margin`, in the same order.
///
/// Rows are tried from the last to the first, so of two equal rows the first stays. As rows leave,
/// earlier decisions loosen; at the end each dropped row is tried against those that stayed and
/// comes back if they no longer imply it. A row also stays whenever its linear program is not solved
/// beyond doubt.
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
    let entries: Vec<(usize, usize)> = (0..rows.len())
        .flat_map(|row| (0..dim).map(move |col| (row, col)))
        .collect();
    let mut a = SparseColumns::from_pattern(rows.len(), dim, &entries);
    let mut b = Vec::with_capacity(rows.len());
    for (number, constraint) in rows.iter().enumerate() {
        for (col, &entry) in constraint.row.iter().enumerate() {
            a.set(number, col, entry);
        }
        b.push(constraint.bound);
    }
    b[rows.len() - 1] += relaxation;
    let program = ConeProgram {
        p: SparseColumns::from_pattern(dim, dim, &[]),
        q: last.row.iter().map(|entry| -entry).collect(),
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
    if solver.solve() != Outcome::Solved {
        return None;
    }
    let terms = last.row.iter().zip(solver.solution());
    Some(terms.map(|(row, value)| row * value).sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(joint: usize, row: &[f64], bound: f64) -> Row {
        Row {
            joint,
            row: row.to_vec(),
            bound,
            per_loss: 0.0,
        }
    }

    fn square() -> Vec<Row> {
        let sides = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];
        let sides = sides.iter().enumerate();
        sides.map(|(joint, side)| row(joint, side, 1.0)).collect()
    }

    #[test]
    fn row_outside_the_square_of_the_others_is_dropped_and_one_that_cuts_a_corner_stays() {
        let mut rows = square();
        rows.push(row(4, &[1.0, 1.0], 2.5));
        rows.push(row(5, &[1.0, 1.0], 1.5));
        rows.push(row(6, &[0.5, 0.0], 0.5));
        let kept: Vec<usize> = needed_rows(rows, 0.0).iter().map(|row| row.joint).collect();
        assert_eq!(kept, [0, 1, 2, 3, 5]);
    }

    #[test]
    fn a_single_row_is_always_needed() {
        assert_eq!(needed_rows(vec![row(0, &[2.0, 0.0], 1.0)], 0.1).len(), 1);
    }

    #[test]
    fn nearly_equal_rows_are_told_apart_only_by_a_margin_smaller_than_their_difference() {
        let mut rows = square();
        rows.push(row(4, &[1.0, 0.01], 1.0));
        assert_eq!(needed_rows(rows.clone(), 1e-3).len(), 5);
        assert_eq!(needed_rows(rows, 0.02).len(), 4);
    }

    #[test]
    fn dropped_rows_stay_within_the_margin_of_those_that_stay() {
        // A many-sided polygon: each side is nearly implied by its neighbours.
        let rows: Vec<Row> = (0..60)
            .map(|side| {
                let angle = std::f64::consts::TAU * f64::from(side) / 60.0;
                row(side as usize, &[angle.cos(), angle.sin()], 1.0)
            })
            .collect();
        let kept = needed_rows(rows.clone(), 0.02);
        assert!(kept.len() < 40, "{} rows", kept.len());
        // The kept sides' corners are their farthest points.
        let angle = |row: &Row| (row.row[1].atan2(row.row[0])).rem_euclid(std::f64::consts::TAU);
        let mut angles: Vec<f64> = kept.iter().map(angle).collect();
        angles.sort_by(f64::total_cmp);
        angles.push(angles[0] + std::f64::consts::TAU);
        for pair in angles.windows(2) {
            let half = 0.5 * (pair[1] - pair[0]);
            let corner = [
                (pair[0] + half).cos() / half.cos(),
                (pair[0] + half).sin() / half.cos(),
            ];
            for row in &rows {
                let value = row.row[0] * corner[0] + row.row[1] * corner[1];
                assert!(value <= 1.0 + 0.02 + 1e-5, "{value}");
            }
        }
    }
}
