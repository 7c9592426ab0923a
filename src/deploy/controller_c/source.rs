//! `NAME_controller.c`: a model's numbers as initialisers of C, and the texts made from Rust, renamed for an instance.

use std::borrow::Borrow;
use std::ops::Deref;

use askama::Template;
use nalgebra::DMatrix;

use super::Facts;
use crate::codegen::Precision;
use crate::codegen::interface::{ModelInterface, PhaseInterface};
use crate::mpc::interface::Accepts;
use crate::mpc::problem::{Row, StageRows, pairs};
use crate::mpc::structured::{RATE_SOFTNESS, RATE_TOLERANCE, TOLERANCE};
use crate::mpc::{
    ControlModel, ControlPhase, FallbackSettings, InputGivenState, MpcError, MpcSettings,
};
use crate::mpc::{NO_PHASE, torque_deviation};
use crate::robot::{DRY_SPEED_RAD_S, GRAVITY_M_S2, JOINT_DIM, Leg, LegShape, WrenchFrame};

#[derive(Template)]
#[template(path = "controller_c/source.askama", config = "templates/askama.toml")]
pub(super) struct Source<'a> {
    facts: &'a Facts<'a>,
    /// Of the stage problem: twice the latent dimension, as one number, which Eva wants of the length of an array.
    n_states: usize,
    n_torque_pairs: usize,
    max_nnz: usize,
    has_actuators: bool,
    given_state: String,
    given_covariance: String,
    acceleration_error: String,
    is_body_frame: bool,
    solver: [(&'static str, f64); 5],
    functions: String,
    lift_functions: String,
    online: String,
    constants: String,
    legs: String,
    hips: String,
    arm_from: String,
    torque_mean: String,
    torque_deviation: String,
    weight_n: f64,
    fallback: FallbackSettings,
    phases: &'a [PhaseInterface],
}

impl<'a> Deref for Source<'a> {
    type Target = Facts<'a>;

    fn deref(&self) -> &Facts<'a> {
        self.facts
    }
}

impl<'a> Source<'a> {
    pub(super) fn new(
        facts: &'a Facts<'a>,
        entries: &'a ModelInterface,
        plant: &'a ControlModel,
        precision: Precision,
    ) -> Result<Self, MpcError> {
        let (numbers, phases) = (Numbers(precision), plant.phases());
        let robot = plant.robot();
        let mpc = MpcSettings::default();
        let of_given = |part: fn(&InputGivenState) -> &DMatrix<f64>| {
            let given = phases.iter().filter_map(|phase| phase.given_state.as_ref());
            nested(given.map(|given| numbers.rows(part(given), facts.latent_dim)))
        };
        let deviation = |phase: &ControlPhase| match torque_deviation(phase) {
            Some(rows) => Ok(numbers.matrix(rows)),
            None => Err(MpcError::Statistics {
                phase: phase.name.clone(),
            }),
        };
        let deviations: Vec<String> =
            (phases.iter().map(deviation)).collect::<Result<_, MpcError>>()?;
        Ok(Self {
            facts,
            n_states: 2 * facts.latent_dim,
            n_torque_pairs: pairs(&facts.rows.torque),
            max_nnz: (entries.phases.iter())
                .map(|phase| phase.pattern.len())
                .fold(1, usize::max),
            given_state: of_given(|given| &given.mean),
            given_covariance: of_given(|given| &given.covariance),
            acceleration_error: of_given(|given| &given.acceleration_error),
            has_actuators: plant.input_rule().actuators().is_some(),
            is_body_frame: plant.input_rule().wrench_frame() == WrenchFrame::Body,
            solver: solver_numbers(precision, mpc.qp.accepted_residual),
            functions: of_horizon(facts.name),
            lift_functions: of_lift(),
            online: online(facts.name),
            constants: constants(plant, facts.rows, numbers),
            legs: nested(Leg::ALL.map(|leg| numbers.leg(&robot.geometry(leg).shape))),
            hips: numbers.matrix(robot.hip_position_m),
            arm_from: numbers.matrix(match plant.input_rule().wrench_frame() {
                WrenchFrame::Body => [[0.0; 3]; 4],
                WrenchFrame::World => robot.hip_position_m,
            }),
            torque_mean: numbers.matrix(phases.iter().map(|phase| &phase.torque_mean)),
            torque_deviation: nested(deviations),
            weight_n: robot.mass_kg() * GRAVITY_M_S2,
            fallback: mpc.fallback,
            phases: &entries.phases,
        })
    }
}

fn constants(plant: &ControlModel, rows: &StageRows, numbers: Numbers) -> String {
    let (robot, phases) = (plant.robot(), plant.phases());
    let (d, limits) = (plant.latent_dim(), robot.joint_limit_rad());
    let row_matrix = |rows: &[Row]| numbers.matrix(rows.iter().map(|row| &row.row));
    let root = |phase: &ControlPhase| numbers.rows(&phase.latent_root.transpose(), d);
    let (torque, joint, rate) = (
        rows.torque.iter(),
        rows.joint.iter(),
        row_matrix(&rows.rate),
    );
    let feet = plant.phase_of_feet.iter();
    let force = plant.lift.rows(JOINT_DIM, 3) / (robot.mass_kg() * GRAVITY_M_S2);
    let [encoder, projection] = [&plant.encoder, &plant.projection].map(|m| numbers.rows(m, d));
    let [decoder, lift] = [&plant.decoder, &plant.lift].map(|m| numbers.rows(m, JOINT_DIM));
    let encoder_bias = numbers.vector(&plant.encoder_bias);
    let decoder_bias = numbers.vector(plant.decoder_bias.iter().take(JOINT_DIM));
    let force = numbers.rows(&force, 3);
    let phase_of_feet = integers(feet.map(|phase| phase.unwrap_or(NO_PHASE) as i64));
    let is_grounded = integers(phases.iter().map(|phase| i64::from(phase.is_grounded)));
    let input_mean = numbers.matrix(phases.iter().map(|phase| &phase.latent_mean));
    let input_root = nested(phases.iter().map(root));
    let torque_rows = row_matrix(&rows.torque);
    let torque_bound = numbers.vector(torque.clone().map(|row| row.bound));
    let torque_per_loss = numbers.vector(torque.clone().map(|row| row.per_loss));
    let torque_joint = integers(torque.map(|row| row.joint as i64));
    let joint_rows = row_matrix(&rows.joint);
    let joint_bound = numbers.vector(joint.map(|row| row.bound));
    let joint_lower = numbers.vector(limits.iter().map(|limit| limit.0));
    let joint_upper = numbers.vector(limits.iter().map(|limit| limit.1));
    let torque_limit = numbers.vector(robot.torque_limit_nm());
    let mut out = format!(
        "\
/* W_e s_x and b_e. */
static const real ENCODER[D][S] = {encoder};
static const real ENCODER_BIAS[D] = {encoder_bias};
/* Rows of W_d / s_x and b_d / s_x for the joints. */
static const real DECODER[12][D] = {decoder};
static const real DECODER_BIAS[12] = {decoder_bias};
/* Rows of W_e^T / s_u for torques, and for the force over the robot's weight. */
static const real LIFT[12][D] = {lift};
static const real FORCE[3][D] = {force};
/* pinv(W_e^T) s_u. */
static const real PROJECTION[D][S] = {projection};
/* Phase of each foot pattern, bit k for foot k; ONLINE_NO_PHASE for none. */
static const int PHASE_OF_FEET[16] = {phase_of_feet};
static const int IS_GROUNDED[N_PHASES] = {is_grounded};
/* Mean of the training's latent inputs by phase, and lower Cholesky factor of their covariance, column by column. */
static const real INPUT_MEAN[N_PHASES][D] = {input_mean};
static const real INPUT_ROOT[N_PHASES][D][D] = {input_root};
/* Torque limits that can be active, first N_TORQUE_PAIRS with both sides, row and -row: row . u_lat <= bound - per_loss *
 * loss of the joint. */
static const real TORQUE_ROWS[][D] = {torque_rows};
static const real TORQUE_BOUND[] = {torque_bound};
static const real TORQUE_PER_LOSS[] = {torque_per_loss};
static const int TORQUE_JOINT[] = {torque_joint};
/* Torques whose rates can be limited, with both signs: row . (u_lat - the one before) <= rate * step. */
static const real RATE_ROWS[][D] = {rate};
/* Joint limits that can be active: row . z <= bound. */
static const real JOINT_ROWS[][D] = {joint_rows};
static const real JOINT_BOUND[] = {joint_bound};
static const real JOINT_LOWER[12] = {joint_lower};
static const real JOINT_UPPER[12] = {joint_upper};
static const real TORQUE_LIMIT[12] = {torque_limit};
"
    );
    if let Some(actuators) = plant.input_rule().actuators() {
        out += "/* What the joints take. */\n";
        for (name, (_, values)) in ["VISCOUS", "DRY", "ARMATURE"].iter().zip(actuators.named()) {
            let values = numbers.vector(values);
            out += &format!("static const real {name}[12] = {values};\n");
        }
    }
    out
}

/// Where iterations end. In single precision rounding ends the progress earlier; torques of a lift would be off by 0.1 N m
/// with the complementarity of a plan, and weights of rows of rates have to stay far below the inverse of rounding.
fn solver_numbers(precision: Precision, accepted_residual: f64) -> [(&'static str, f64); 5] {
    [
        ("TOLERANCE", TOLERANCE, 1e-4),
        ("LIFT_TOLERANCE", TOLERANCE, 1e-6),
        ("RATE_TOLERANCE", RATE_TOLERANCE, 1e-5),
        ("RATE_SOFTNESS", RATE_SOFTNESS, 1e-4),
        ("ACCEPTED_RESIDUAL", accepted_residual, 1e-3),
    ]
    .map(|(name, double, single)| match precision {
        Precision::Double => (name, double),
        Precision::Single => (name, single),
    })
}

const WIDTH: usize = 6;

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
    pub(in crate::deploy) fn vector<V: Borrow<f64>>(
        self,
        values: impl IntoIterator<Item = V>,
    ) -> String {
        list(values.into_iter().map(|value| self.one(*value.borrow())))
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

    fn rows(self, matrix: &DMatrix<f64>, count: usize) -> String {
        let row = |i| (0..matrix.ncols()).map(move |j| matrix[(i, j)]);
        self.matrix((0..count).map(row))
    }

    /// Rows of vectors; one row of zeros if there are none.
    pub(in crate::deploy) fn matrix<R: IntoIterator<Item: Borrow<f64>>>(
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

const STAGE: &str = include_str!("../../../templates/controller_c/solver_stage.h");
const FUNCTIONS: &str = include_str!("../../../templates/controller_c/solver.c");
const STATE: &str = include_str!("../../../templates/controller_c/online_state.h");
const ONLINE: &str = include_str!("../../../templates/controller_c/online.c");

fn online(name: &str) -> String {
    renamed(ONLINE, |word| {
        (word == "online_share").then(|| format!("{name}_{word}"))
    })
}

/// A stage of the horizon's solver and the controller's own state, for the header of a controller.
pub(super) fn stage(name: &str, upper: &str, real: &str) -> String {
    let rename = |word: &str| match word {
        "real" => Some(real.to_owned()),
        "NX" => Some(format!("2 * {upper}_LATENT_DIM")),
        "NU" => Some(format!("{upper}_LATENT_DIM")),
        _ if word == "online_share" || word.starts_with("solver_") => {
            Some(format!("{name}_{word}"))
        }
        _ => None,
    };
    renamed(STAGE, rename) + &renamed(STATE, rename)
}

fn of_horizon(name: &str) -> String {
    renamed(FUNCTIONS, |word| {
        (word == "solver_stage").then(|| format!("{name}_{word}"))
    })
}

/// The solver of a lift: one stage of twelve inputs, without states that matter.
fn of_lift() -> String {
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
