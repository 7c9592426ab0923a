//! Tests of `src/learn/train/frame.rs`.

use super::*;
use crate::recording::PhaseRule;
use crate::robot::InputRule;
use crate::train::dataset::{ScaleOptions, Scaling};
use crate::train::options::TrainOptions;
use crate::train::random::Random;

const STEP_S: f64 = 0.002;
const SAMPLES: usize = 2000;
const GAIN: f64 = 0.3; // of a load in the acceleration of its own coordinate

fn robot() -> &'static Robot {
    romc_model::robot_file::by_name("go1").expect("known robot")
}

fn all() -> BodyRows {
    "all".parse().expect("known rows")
}

/// Weights of the joints in the momentum of each body coordinate, `18 x 6`: random, and symmetric under mirroring.
fn true_rows() -> DMatrix<f64> {
    let joints: Vec<usize> = (0..JOINT_DIM).collect();
    let mut random = Random::new(7);
    let mut rows = DMatrix::zeros(STATE_DIM, 6);
    for (mut row, &coordinate) in rows.column_iter_mut().zip(&all().coordinates) {
        let parity = if is_lateral(coordinate) { -1.0 } else { 1.0 };
        let directions = DMatrix::from_columns(&joints_of_pairs(&joints, robot(), parity));
        row += &directions * random.matrix(directions.ncols(), 1, 0.2);
        row[coordinate] = 1.0;
    }
    rows
}

/// A robot with these rows whose legs move at random: in free fall, or pushed by random forces and moments.
fn moving(rows: &DMatrix<f64>, is_pushed: bool) -> Dataset {
    let mut random = Random::new(8);
    let factors = ScaleOptions::in_frame(WrenchFrame::Ground).factors();
    let mut ddx = random.matrix(STATE_DIM, SAMPLES, 1.0);
    let mut u = random.matrix(STATE_DIM, SAMPLES, 1.0);
    if !is_pushed {
        u.fill(0.0);
    }
    for (row, &coordinate) in rows.column_iter().zip(&all().coordinates) {
        let fall = match coordinate {
            BODY_Z => -GRAVITY_M_S2 * factors.state[BODY_Z],
            _ => 0.0,
        };
        for sample in 0..SAMPLES {
            let by_joints = row
                .rows(0, JOINT_DIM)
                .dot(&ddx.view((0, sample), (JOINT_DIM, 1)));
            ddx[(coordinate, sample)] = GAIN * u[(coordinate, sample)] + fall - by_joints;
        }
    }
    let mut dx = &ddx * STEP_S;
    for sample in 1..SAMPLES {
        let sum = dx.column(sample - 1) + dx.column(sample);
        dx.set_column(sample, &sum);
    }
    let phase = usize::from(!is_pushed);
    let jump = Jump {
        path: "made.csv".into(),
        time_s: (0..SAMPLES).map(|k| STEP_S * k as f64).collect(),
        x: DMatrix::zeros(STATE_DIM, SAMPLES),
        dx,
        ddx,
        u,
        losses: None,
        feet: vec![[is_pushed; 4]; SAMPLES],
        phase: vec![phase; SAMPLES],
        spans: vec![(phase, 0..SAMPLES)],
        is_image: false,
        implausible: Vec::new(),
    };
    let Scaling { state, input } = factors;
    Dataset {
        jumps: vec![jump],
        phases: PhaseRule::two_phase(),
        scaling: Scaling { state, input },
        smoothing: 1,
        rule: InputRule::new(robot(), None, WrenchFrame::Ground),
    }
}

fn error(found: &DMatrix<f64>, expected: &DMatrix<f64>) -> f64 {
    (found - expected).norm() / expected.rows(0, JOINT_DIM).norm()
}

#[test]
fn momentum_of_six_coordinates_is_found_in_flights_and_without_them() {
    let rows = true_rows();
    for is_pushed in [false, true] {
        let found = momentum_rows(&moving(&rows, is_pushed), &all().coordinates, robot());
        let missed = error(&found, &rows);
        assert!(missed < 0.03, "{is_pushed}: {missed}");
    }
    // Without the loads in the regression, their effect would be attributed to the joints.
    let mut unseen = moving(&rows, true);
    unseen.jumps[0].u.fill(0.0);
    let found = momentum_rows(&unseen, &all().coordinates, robot());
    assert!(error(&found, &rows) > 0.03);
}

#[test]
fn rows_without_flight_need_force_and_moment_in_the_axes_of_the_world() {
    let rows = true_rows();
    let mut published = moving(&rows, true);
    published.rule = InputRule::published(robot());
    let found = momentum_rows(&published, &all().coordinates, robot());
    assert_eq!(found.rows(0, JOINT_DIM).amax(), 0.0);
}

#[test]
fn rows_of_all_of_the_body_leave_room_for_all_joints() {
    let training = moving(&true_rows(), false);
    let active: Vec<usize> = (0..STATE_DIM).collect();
    let dim = |text: &str| {
        let body: BodyRows = text.parse().expect("known rows");
        let rows = (Coordinates::Named, &body);
        let options = TrainOptions::new("m", 6).regression;
        Frame::new(&training, &active, 6, rows, &options, robot()).dim()
    };
    assert_eq!(dim("x,z,pitch"), 9);
    assert_eq!(dim("all"), 18);
    assert_eq!(dim("x,z,yaw"), 18);
}

/// For any basis of the space, the rows become those that a mirror keeps and those whose sign it changes.
#[test]
fn space_that_a_mirror_leaves_alone_has_rows_that_stay_or_change_sign() {
    let joints: Vec<usize> = (0..JOINT_DIM).collect();
    let [even, odd] = [1.0, -1.0].map(|parity| {
        let all = joints_of_pairs(&joints, robot(), parity);
        DMatrix::from_columns(&all[..3 - usize::from(parity < 0.0)])
    });
    let both: Vec<_> = even.column_iter().chain(odd.column_iter()).collect();
    let both = DMatrix::from_columns(&both);
    let turn = Random::new(9).matrix(5, 5, 1.0).qr().q();
    let mixed = &both * turn;
    let classes = symmetry_classes(&mixed, robot());
    assert_eq!(classes.each_ref().map(DMatrix::ncols), [3, 2]);
    for (rows, parity) in classes.iter().zip([1.0, -1.0]) {
        assert!((image(rows, robot()) - rows * parity).amax() < 1e-12);
        let inside = &both * both.tr_mul(rows);
        assert!((inside - rows).amax() < 1e-12);
        assert_eq!(
            parities(&rows.transpose(), robot()),
            vec![parity; rows.ncols()]
        );
    }
    assert!((image(&mixed, robot()).abs() - mixed.abs()).amax() > 1e-3);
}
