//! `NAME_controller.c`.

use std::ops::Deref;

use askama::Template;
use nalgebra::DMatrix;

use super::Facts;
use super::legs::Legs;
use super::numbers::{Numbers, integers, nested};
use super::solver;
use crate::codegen::Precision;
use crate::codegen::interface::{ModelInterface, PhaseInterface};
use crate::mpc::interface::Accepts;
use crate::mpc::problem::{Row, pairs};
use crate::mpc::shared::{NO_PHASE, RATE_SOFTNESS, RATE_TOLERANCE, TOLERANCE};
use crate::mpc::{ControlModel, ControlModelParts, FallbackSettings, InputGivenState, MpcSettings};
use crate::robot::{DRY_SPEED_RAD_S, GRAVITY_M_S2, JOINT_DIM, SINGULAR_BOUND, WrenchFrame};

/// Complementarity and residual in single precision, at which rounding ends the progress.
const SINGLE: (f64, f64) = (1e-4, 1e-3);
/// Complementarity of a lift in single precision: with that of the plan torques would be off by 0.1 N m.
const SINGLE_LIFT: f64 = 1e-6;

/// Complementarity and softness of rows with limits on torque rates in single precision: weights of rows stay far below
/// the inverse of its rounding.
const SINGLE_RATE: (f64, f64) = (1e-5, 1e-4);

/// `NAME_controller.c`.
#[derive(Template)]
#[template(path = "controller_c/source.askama", config = "templates/askama.toml")]
pub(super) struct Source<'a> {
    facts: &'a Facts<'a>,
    numbers: Numbers,
    parts: &'a ControlModelParts,
    /// Of the stage problem: twice the latent dimension, as one number, which Eva wants of the length of an array.
    n_states: usize,
    n_torque_pairs: usize,
    max_nnz: usize,
    has_actuators: bool,
    given_state: String,
    given_covariance: String,
    acceleration_error: String,
    is_body_frame: bool,
    solver: SolverNumbers,
    functions: String,
    lift_functions: String,
    online: String,
    legs: Legs,
    torque_mean: String,
    torque_deviation: String,
    weight_n: f64,
    fallback: FallbackSettings,
    force: String,
    phase_of_feet: String,
    is_grounded: String,
    input_mean: String,
    input_root: String,
    torque_rows: String,
    torque_bound: String,
    torque_per_loss: String,
    torque_joint: String,
    rate_rows: String,
    joint_rows: String,
    joint_bound: String,
    joint_lower: String,
    joint_upper: String,
    torque_limit: String,
    viscous: String,
    dry: String,
    armature: String,
    phases: &'a [PhaseInterface],
}

impl<'a> Deref for Source<'a> {
    type Target = Facts<'a>;

    fn deref(&self) -> &Facts<'a> {
        self.facts
    }
}

/// Where iterations end, by the precision.
struct SolverNumbers {
    tolerance: f64,
    lift_tolerance: f64,
    rate_tolerance: f64,
    rate_softness: f64,
    accepted_residual: f64,
}

impl<'a> Source<'a> {
    /// The text of a plant, with deviations `C` of the torques by phase.
    pub(super) fn new(
        facts: &'a Facts<'a>,
        entries: &'a ModelInterface,
        (plant, deviations): (&'a ControlModel, &[[[f64; JOINT_DIM]; JOINT_DIM]]),
        precision: Precision,
    ) -> Self {
        let (numbers, rows) = (Numbers(precision), facts.rows);
        let (parts, robot) = (plant.parts(), plant.robot());
        let matrix = |matrix: &DMatrix<f64>| numbers.rows(matrix, facts.latent_dim);
        let row_matrix = |rows: &[Row]| numbers.matrix(rows.iter().map(|row| row.row.clone()));
        let limits = robot.joint_limit_rad();
        let weight_n = robot.mass_kg() * GRAVITY_M_S2;
        let losses = |index: usize| match plant.input_rule().actuators() {
            Some(actuators) => numbers.vector(*actuators.named()[index].1),
            None => String::new(),
        };
        let phases = plant.phases();
        let mpc = MpcSettings::default();
        let of_given = |part: fn(&InputGivenState) -> &DMatrix<f64>| {
            let given = phases.iter().filter_map(|phase| phase.given_state.as_ref());
            nested(given.map(|given| matrix(part(given))))
        };
        Self {
            facts,
            numbers,
            parts,
            n_states: 2 * facts.latent_dim,
            n_torque_pairs: pairs(&rows.torque),
            max_nnz: (entries.phases.iter())
                .map(|phase| phase.pattern.len())
                .fold(1, usize::max),
            given_state: of_given(|given| &given.mean),
            given_covariance: of_given(|given| &given.covariance),
            acceleration_error: of_given(|given| &given.acceleration_error),
            has_actuators: plant.input_rule().actuators().is_some(),
            is_body_frame: plant.input_rule().wrench_frame() == WrenchFrame::Body,
            solver: SolverNumbers::new(precision, mpc.qp.accepted_residual),
            functions: solver::of_horizon(facts.name),
            lift_functions: solver::of_lift(),
            online: solver::online(facts.name),
            legs: Legs::of(robot, numbers),
            torque_mean: numbers
                .matrix(phases.iter().map(|phase| phase.torque_mean.iter().copied())),
            torque_deviation: nested(deviations.iter().map(|rows| numbers.matrix(*rows))),
            weight_n,
            fallback: mpc.fallback,
            force: numbers.matrix((0..3).map(|axis| {
                let row = parts.lift.row(JOINT_DIM + axis);
                row.iter().map(|entry| entry / weight_n).collect::<Vec<_>>()
            })),
            phase_of_feet: integers(
                (parts.phase_of_feet.iter())
                    .map(|phase| phase.map_or(NO_PHASE, |phase| phase) as i64),
            ),
            is_grounded: integers(phases.iter().map(|phase| i64::from(phase.is_grounded))),
            input_mean: numbers
                .matrix(phases.iter().map(|phase| phase.latent_mean.iter().copied())),
            input_root: nested(
                phases
                    .iter()
                    .map(|phase| matrix(&phase.latent_root.transpose())),
            ),
            torque_rows: row_matrix(&rows.torque),
            torque_bound: numbers.vector(rows.torque.iter().map(|row| row.bound)),
            torque_per_loss: numbers.vector(rows.torque.iter().map(|row| row.per_loss)),
            torque_joint: integers(rows.torque.iter().map(|row| row.joint as i64)),
            rate_rows: row_matrix(&rows.rate),
            joint_rows: row_matrix(&rows.joint),
            joint_bound: numbers.vector(rows.joint.iter().map(|row| row.bound)),
            joint_lower: numbers.vector(limits.iter().map(|limit| limit.0)),
            joint_upper: numbers.vector(limits.iter().map(|limit| limit.1)),
            torque_limit: numbers.vector(robot.torque_limit_nm().iter().copied()),
            viscous: losses(0),
            dry: losses(1),
            armature: losses(2),
            phases: &entries.phases,
        }
    }
}

impl SolverNumbers {
    fn new(precision: Precision, accepted_residual: f64) -> Self {
        match precision {
            Precision::Double => Self {
                tolerance: TOLERANCE,
                lift_tolerance: TOLERANCE,
                rate_tolerance: RATE_TOLERANCE,
                rate_softness: RATE_SOFTNESS,
                accepted_residual,
            },
            Precision::Single => Self {
                tolerance: SINGLE.0,
                lift_tolerance: SINGLE_LIFT,
                rate_tolerance: SINGLE_RATE.0,
                rate_softness: SINGLE_RATE.1,
                accepted_residual: SINGLE.1,
            },
        }
    }
}
