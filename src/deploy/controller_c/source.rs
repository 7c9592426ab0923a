//! `NAME_controller.c`.
//!
//! Numbers as initialisers of C.
//!
//! The legs of a robot as constants of the controller in C.
//!
//! The structured solver in C: the text that is made from its Rust, under the names and sizes of an instance.

use std::ops::Deref;

use askama::Template;
use nalgebra::DMatrix;

use super::Facts;
use crate::codegen::Precision;
use crate::codegen::interface::{ModelInterface, PhaseInterface};
use crate::mpc::interface::Accepts;
use crate::mpc::problem::{Row, pairs};
use crate::mpc::shared::{NO_PHASE, RATE_SOFTNESS, RATE_TOLERANCE, TOLERANCE};
use crate::mpc::{ControlModel, ControlModelParts, FallbackSettings, InputGivenState, MpcSettings};
use crate::robot::{DRY_SPEED_RAD_S, GRAVITY_M_S2, JOINT_DIM, Leg, LegShape, WrenchFrame};

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
    legs: String,
    hips: String,
    arm_from: String,
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
            functions: of_horizon(facts.name),
            lift_functions: of_lift(),
            online: online(facts.name),
            legs: nested(Leg::ALL.map(|leg| numbers.leg(&robot.geometry(leg).shape))),
            hips: numbers.matrix(robot.hip_position_m),
            arm_from: numbers.matrix(match plant.input_rule().wrench_frame() {
                WrenchFrame::Body => [[0.0; 3]; 4],
                WrenchFrame::World => robot.hip_position_m,
            }),
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

/// Numbers per line.
const WIDTH: usize = 6;

/// Writes numbers of one precision.
#[derive(Debug, Clone, Copy)]
pub(in crate::deploy) struct Numbers(pub Precision);

impl Numbers {
    /// One number, with a suffix in single precision.
    pub(super) fn one(self, value: f64) -> String {
        match self.0 {
            Precision::Double => format!("{value:?}"),
            Precision::Single => format!("{:?}f", value as f32),
        }
    }

    /// `{1.0, 2.0}`; one zero if there are none, as C has no empty arrays.
    pub(in crate::deploy) fn vector(self, values: impl IntoIterator<Item = f64>) -> String {
        list(values.into_iter().map(|value| self.one(value)))
    }

    fn leg(self, leg: &LegShape) -> String {
        let square = |rows: &[[f64; 3]; 3]| self.matrix(*rows);
        let fields = [
            ("fixed", square(&leg.fixed)),
            ("cosine", square(&leg.cosine)),
            ("sine", square(&leg.sine)),
            ("axis", self.vector(leg.axis)),
            ("hip", self.vector(leg.hip)),
            ("thigh", self.vector(leg.thigh)),
            ("calf", self.vector(leg.calf)),
            ("knee", self.one(leg.knee)),
            ("least", self.vector(leg.least)),
            ("volume", self.one(leg.volume)),
        ];
        let fields = fields.map(|(name, value)| format!(".{name} = {value}"));
        format!("{{{}}}", fields.join(",\n     "))
    }

    /// The first rows of a matrix.
    pub(super) fn rows(self, matrix: &DMatrix<f64>, count: usize) -> String {
        let row = |i| (0..matrix.ncols()).map(move |j| matrix[(i, j)]);
        self.matrix((0..count).map(row))
    }

    /// Rows of vectors; one row of zeros if there are none.
    pub(in crate::deploy) fn matrix<R: IntoIterator<Item = f64>>(
        self,
        rows: impl IntoIterator<Item = R>,
    ) -> String {
        nested(rows.into_iter().map(|row| self.vector(row)))
    }
}

/// An initialiser of initialisers, one per line.
pub(in crate::deploy) fn nested(rows: impl IntoIterator<Item = String>) -> String {
    let rows: Vec<String> = rows.into_iter().collect();
    match rows.is_empty() {
        true => "{{0}}".to_owned(),
        false => format!("{{\n    {},\n}}", rows.join(",\n    ")),
    }
}

/// An initialiser of integers.
pub(in crate::deploy) fn integers(values: impl IntoIterator<Item = i64>) -> String {
    list(values.into_iter().map(|value| value.to_string()))
}

/// An initialiser with one zero at least.
pub(in crate::deploy) fn list(values: impl Iterator<Item = String>) -> String {
    let values: Vec<String> = values.collect();
    if values.is_empty() {
        return "{0}".to_owned();
    }
    let lines: Vec<String> = values.chunks(WIDTH).map(|line| line.join(", ")).collect();
    format!("{{{}}}", lines.join(",\n     "))
}

/// A stage of the solver, and all else.
const STAGE: &str = include_str!("../../../templates/controller_c/solver_stage.h");
const FUNCTIONS: &str = include_str!("../../../templates/controller_c/solver.c");
const STATE: &str = include_str!("../../../templates/controller_c/online_state.h");
const ONLINE: &str = include_str!("../../../templates/controller_c/online.c");

/// The controller's own steps.
pub(super) fn online(name: &str) -> String {
    renamed(ONLINE, |word| {
        (word == "online_share").then(|| format!("{name}_{word}"))
    })
}

/// A stage of the horizon's solver and the controller's own state, for the header of a controller.
pub(super) fn stage(name: &str, upper: &str, real: &str) -> String {
    renamed(
        &format!(
            "{STAGE}{}",
            STATE.split_once("\n\n").map_or("", |(_, rest)| rest)
        ),
        |word| match word {
            "real" => Some(real.to_owned()),
            "NX" => Some(format!("2 * {upper}_LATENT_DIM")),
            "NU" => Some(format!("{upper}_LATENT_DIM")),
            "online_share" => Some(format!("{name}_{word}")),
            _ => word
                .starts_with("solver_")
                .then(|| format!("{name}_{word}")),
        },
    )
}

/// The solver of the horizon.
pub(super) fn of_horizon(name: &str) -> String {
    renamed(FUNCTIONS, |word| {
        (word == "solver_stage").then(|| format!("{name}_{word}"))
    })
}

/// The solver of a lift: one stage of twelve inputs, without states that matter.
pub(super) fn of_lift() -> String {
    let lift = |word: &str| {
        Some(match word {
            "NX" => "1".to_owned(),
            "NU" => "12".to_owned(),
            "LINKED" => "0".to_owned(),
            _ if word.starts_with("solver_") => format!("lift_{word}"),
            _ if word.starts_with("SOLVER_") => format!("LIFT_{word}"),
            _ => return None,
        })
    };
    renamed(STAGE, lift) + &renamed(FUNCTIONS, lift)
}

/// A text of C behind its first comment, with other names.
fn renamed(text: &str, rename: impl Fn(&str) -> Option<String>) -> String {
    let text = text.split_once("\n\n").map_or(text, |(_, rest)| rest);
    let mut out = String::with_capacity(2 * text.len());
    let mut rest = text;
    while let Some(first) = rest.find(|letter: char| letter.is_ascii_alphabetic()) {
        let after = &rest[first..];
        let is_part = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
        let end = after.find(|letter| !is_part(letter)).unwrap_or(after.len());
        out += &rest[..first];
        out += &rename(&after[..end]).unwrap_or_else(|| after[..end].to_owned());
        rest = &after[end..];
    }
    out + rest
}
