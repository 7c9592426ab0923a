//! `NAME_controller.c`: a model's numbers as initialisers of C, and the texts made from Rust, renamed for an instance.

use std::borrow::Borrow;

use super::*;
use crate::mpc::problem::{Row, pairs};
use crate::mpc::structured::{LINK_SOFTNESS, LINK_TOLERANCE, TOLERANCE};
use crate::mpc::{FallbackSettings, Gait, InputGivenState, NO_PHASE, Strides, torque_deviation};
use crate::robot::{GRAVITY_M_S2, LegShape};

#[derive(Template)]
#[template(path = "controller_c/source.askama", config = "templates/askama.toml")]
pub(super) struct Source<'a> {
    facts: &'a Facts<'a>,
    /// Of the stage problem: twice the latent dimension, as one number, which Eva wants of the length of an array.
    n_states: usize,
    n_paired: usize,
    max_nnz: usize,
    has_actuators: bool,
    /// Of a phase, whether the rotors' inertia is a loss; and without a foot on the ground.
    inertia_is_loss: String,
    inertia_is_always_loss: bool,
    has_legs: bool,
    feet_of_phase: String,
    given_state: String,
    given_covariance: String,
    acceleration_error: String,
    is_body_frame: bool,
    solver: [(&'static str, f64); 5],
    functions: String,
    lift_functions: String,
    online: String,
    numbers: Numbers,
    plant: &'a ControlModel,
    phase_of_feet: String,
    is_grounded: String,
    input_mean: String,
    input_root: String,
    legs: String,
    arm_from: String,
    torque_mean: String,
    torque_deviation: String,
    weight_n: f64,
    fallback: FallbackSettings,
    phases: &'a [PhaseInterface],
    walk: Option<WalkText>,
}

/// Additional data in the controller of a model with strides.
struct WalkText {
    /// Initialisers.
    gait: String,
    nodes: String,
    steps: String,
    /// Settings for walks that differ from the controller's own, with their numbers in C.
    settings: Vec<(&'static str, String)>,
}

extends! { <'a> Source<'a>: Facts<'a>, facts }

impl<'a> Source<'a> {
    pub(super) fn new(
        facts: &'a Facts<'a>,
        entries: &'a ModelInterface,
        plant: &'a ControlModel,
        strides: Option<Strides>,
        precision: Precision,
    ) -> Result<Self, MpcError> {
        let (numbers, phases) = (Numbers(precision), plant.phases());
        let (robot, feet) = (plant.robot(), plant.phase_of_feet.iter());
        let root =
            |phase: &ControlPhase| numbers.rows(&phase.latent_root.transpose(), facts.latent_dim);
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
            n_paired: 2 * pairs(&facts.rows.input),
            max_nnz: (entries.phases.iter())
                .map(|phase| phase.pattern.len())
                .fold(1, usize::max),
            given_state: of_given(|given| &given.mean),
            given_covariance: of_given(|given| &given.covariance),
            acceleration_error: of_given(|given| &given.acceleration_error),
            has_actuators: plant.input_rule().actuators().is_some(),
            inertia_is_loss: inertia_is_loss(plant),
            inertia_is_always_loss: plant.input_rule().inertia_is_loss(false),
            has_legs: plant.input_rule().legs().is_some(),
            feet_of_phase: feet_of_phase(plant, numbers),
            is_body_frame: plant.input_rule().wrench_frame() == WrenchFrame::Body,
            solver: solver_numbers(precision, mpc.qp.accepted_residual),
            functions: for_controller(FUNCTIONS, facts.name),
            lift_functions: of_lift(),
            online: for_controller(ONLINE, facts.name),
            numbers,
            plant,
            phase_of_feet: integers(feet.map(|phase| phase.unwrap_or(NO_PHASE) as i64)),
            is_grounded: integers(phases.iter().map(|phase| i64::from(phase.is_grounded))),
            input_mean: numbers.matrix(phases.iter().map(|phase| &phase.latent_mean)),
            input_root: nested(phases.iter().map(root)),
            legs: nested(Leg::ALL.map(|leg| numbers.leg(&robot.geometry(leg).shape))),
            arm_from: numbers.matrix(match plant.input_rule().wrench_frame() {
                WrenchFrame::Body => [[0.0; 3]; 4],
                WrenchFrame::World | WrenchFrame::Ground => robot.hip_position_m,
            }),
            torque_mean: numbers.matrix(phases.iter().map(|phase| &phase.torque_mean)),
            torque_deviation: nested(deviations),
            weight_n: robot.mass_kg() * GRAVITY_M_S2,
            fallback: mpc.fallback,
            phases: &entries.phases,
            walk: strides.map(|strides| WalkText::new(facts, &strides, robot, numbers)),
        })
    }
}

impl WalkText {
    fn new(facts: &Facts<'_>, strides: &Strides, robot: &Robot, numbers: Numbers) -> Self {
        let own = Settings::from(&crate::mpc::walk_settings(robot));
        let settings = SETTINGS
            .iter()
            .zip(own.numbers().into_iter().zip(facts.defaults.numbers()));
        let differs = settings.filter(|(_, (own, usual))| own != usual);
        let text = |setting: &Setting, number: f64| match setting.kind {
            "i32" => format!("{number}"),
            _ => numbers.one(number),
        };
        Self {
            gait: numbers.gait(&strides.gait),
            nodes: numbers.vector(&strides.nodes),
            steps: for_controller(WALK, facts.name),
            settings: differs
                .map(|(setting, (own, _))| (setting.name, text(setting, own)))
                .collect(),
        }
    }
}

impl Source<'_> {
    /// Rows of the decoder that the controller uses.
    fn decoded_rows(&self) -> usize {
        if self.has_legs { STATE_DIM } else { JOINT_DIM }
    }
}

/// Of each phase, whether the rotors' inertia is a loss.
fn inertia_is_loss(plant: &ControlModel) -> String {
    let is_loss = |phase: &ControlPhase| plant.input_rule().inertia_is_loss(phase.is_grounded);
    integers(plant.phases().iter().map(|phase| i64::from(is_loss(phase))))
}

/// Of each phase, 1 for each foot on the ground.
fn feet_of_phase(plant: &ControlModel, numbers: Numbers) -> String {
    let feet = |phase| {
        plant
            .feet_of_phase(phase)
            .map(|down| f64::from(u8::from(down)))
    };
    numbers.matrix((0..plant.phases().len()).map(feet))
}

/// Tolerances at which iterations end. In single precision rounding ends the progress earlier. With the complementarity
/// of a plan, torques of a lift would have an error of 0.1 N m. Weights of rows that link stages have to stay far below
/// the inverse of rounding.
fn solver_numbers(precision: Precision, accepted_residual: f64) -> [(&'static str, f64); 5] {
    [
        ("TOLERANCE", TOLERANCE, 1e-4),
        ("LIFT_TOLERANCE", TOLERANCE, 1e-6),
        ("LINK_TOLERANCE", LINK_TOLERANCE, 1e-5),
        ("LINK_SOFTNESS", LINK_SOFTNESS, 1e-4),
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
        structure(&fields)
    }

    fn gait(self, gait: &Gait) -> String {
        let fields = [
            ("count", gait.count.to_string()),
            ("frequency_hz", self.one(gait.frequency_hz)),
            ("least", self.vector(gait.least)),
            ("most", self.vector(gait.most)),
            ("mean", self.vector(gait.mean)),
            ("stand", self.vector(gait.stand)),
        ];
        structure(&fields)
    }

    fn limits(self, rows: &[Row]) -> String {
        nested(rows.iter().map(|of| {
            let [bound, per_loss] = [of.bound, of.per_loss].map(|number| self.one(number));
            let (row, joint, kind) = (self.vector(&of.row), of.joint, of.kind as i32);
            format!("{{{joint}, {kind}, {bound}, {per_loss}, {row}}}")
        }))
    }

    fn rows(self, matrix: &DMatrix<f64>, most: usize) -> String {
        let row = |i| (0..matrix.ncols()).map(move |j| matrix[(i, j)]);
        self.matrix((0..matrix.nrows().min(most)).map(row))
    }

    /// Rows of vectors; one row of zeros if there are none.
    pub(in crate::deploy) fn matrix<R: IntoIterator<Item: Borrow<f64>>>(
        self,
        rows: impl IntoIterator<Item = R>,
    ) -> String {
        nested(rows.into_iter().map(|row| self.vector(row)))
    }
}

/// An initialiser with named fields.
fn structure(fields: &[(&str, String)]) -> String {
    let named = |(name, value): &(&str, String)| format!(".{name} = {value}");
    let fields: Vec<String> = fields.iter().map(named).collect();
    format!("{{{}}}", fields.join(",\n     "))
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
const WALKER: &str = include_str!("../../../templates/controller_c/walk_state.h");
const WALK: &str = include_str!("../../../templates/controller_c/walk.c");
const WALK_TYPES: [&str; 2] = ["walk_walker", "walk_gait"];

/// Whether a word is the type of a part of the controller's own state.
fn is_state(word: &str) -> bool {
    word.starts_with("online_") && STATE.contains(&format!("}} {word};"))
}

/// Whether a word is a value of such a type.
fn is_value(word: &str) -> bool {
    let separated = |end: &str| STATE.contains(&format!(" {word}{end}"));
    word.starts_with("ONLINE_") && (separated(",") || separated(" }"))
}

/// Types for the header of a controller: a stage of the horizon's solver, the state of the controller, the state of a
/// walk.
pub(super) fn stage(name: &str, upper: &str, real: &str, walks: bool) -> String {
    let rename = |word: &str| match word {
        "real" => Some(real.to_owned()),
        "NX" => Some(format!("2 * {upper}_LATENT_DIM")),
        "NU" => Some(format!("{upper}_LATENT_DIM")),
        "bool" => Some("int32_t".to_owned()),
        "WALK_WINDOW" => Some(format!("{upper}_{word}")),
        _ if is_state(word) || word.starts_with("solver_") => Some(format!("{name}_{word}")),
        _ if WALK_TYPES.contains(&word) => Some(format!("{name}_{word}")),
        _ if is_value(word) => Some(format!("{upper}_{word}")),
        _ => None,
    };
    let texts: &[&str] = if walks {
        &[STAGE, STATE, WALKER]
    } else {
        &[STAGE, STATE]
    };
    texts.iter().map(|text| renamed(text, rename)).collect()
}

/// With the names of the settings, of the state and of the stages that the header of a controller has.
fn for_controller(text: &str, name: &str) -> String {
    renamed(text, |word| match word {
        "online_settings" => Some(format!("{name}_controller_settings")),
        _ if is_state(word) || word == "solver_stage" => Some(format!("{name}_{word}")),
        _ if WALK_TYPES.contains(&word) => Some(format!("{name}_{word}")),
        _ if is_value(word) => Some(format!("{}_{word}", name.to_ascii_uppercase())),
        _ => None,
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
