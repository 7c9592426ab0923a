//! Which rows can be active at all.

use romc::mpc::problem::{Row, RowKind, has_links_or_cones, needed_rows};
use romc::mpc::{Lift, MpcSettings, RowSelection};

use crate::synthetic::{Equations, model, unwatched};

fn row(joint: usize, row: &[f64], bound: f64) -> Row {
    Row {
        kind: RowKind::JointLimit,
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

fn rows_of_stage(settings: MpcSettings) -> Vec<Row> {
    let model = model(Equations::Linear);
    let controller = romc::mpc::controller(&model, settings).expect("the model is complete");
    let rows = romc::mpc::problem::StageRows::new(controller.plant(), &settings);
    [rows.input, rows.link, rows.soft, rows.cones].concat()
}

fn with_all_kinds() -> MpcSettings {
    MpcSettings {
        rows: RowSelection::All,
        torque_rate_nm_s: Some(100.0),
        body_friction: Some(0.5),
        ..unwatched()
    }
}

#[test]
fn every_kind_has_rows_if_the_settings_ask_for_all() {
    let rows = rows_of_stage(with_all_kinds());
    for kind in RowKind::ALL {
        assert!(rows.iter().any(|row| row.kind == kind), "{kind:?}");
    }
    assert!(has_links_or_cones(&with_all_kinds()));
}

#[test]
fn kinds_that_the_settings_do_not_ask_for_have_no_rows() {
    let settings = MpcSettings {
        lift: Lift::Consistent,
        ..unwatched()
    };
    let rows = rows_of_stage(settings);
    assert!(rows.iter().all(|row| row.kind == RowKind::JointLimit));
    assert!(!has_links_or_cones(&settings));
    for settings in [
        MpcSettings {
            torque_rate_nm_s: Some(100.0),
            ..settings
        },
        MpcSettings {
            body_friction: Some(0.5),
            ..settings
        },
    ] {
        assert!(has_links_or_cones(&settings), "{settings:?}");
    }
}

#[test]
fn rows_of_a_rate_are_divided_by_it_and_cones_have_their_coefficient_as_bound() {
    let settings = with_all_kinds();
    let twice = MpcSettings {
        torque_rate_nm_s: Some(200.0),
        body_friction: Some(1.0),
        ..settings
    };
    for (row, other) in rows_of_stage(settings).iter().zip(rows_of_stage(twice)) {
        let factor = match row.kind {
            RowKind::TorqueRate => 0.5,
            RowKind::TorqueLimit | RowKind::JointLimit | RowKind::BodyFriction => 1.0,
        };
        let entries: Vec<f64> = row.row.iter().map(|entry| factor * entry).collect();
        assert_eq!(other.row, entries, "{row:?}");
        if row.kind == RowKind::BodyFriction {
            assert_eq!((row.bound, other.bound), (0.5, 1.0));
        }
    }
}
