//! The numbers of a model as `src/control_model.rs`.

use askama::Template;
use nalgebra::Dim;
use nalgebra::storage::RawStorage;

use crate::codegen::interface::{ModelInterface, PhaseInterface};
use crate::mpc::{ControlModel, ControlModelParts, ControlPhase};
use crate::robot::{Leg, LegGeometry, Robot, STATE_DIM, WrenchFrame};

const WIDTH: usize = 5;

#[derive(Template)]
#[template(
    path = "controller/control_model.askama",
    config = "templates/askama.toml"
)]
pub(crate) struct ControlModelText<'a> {
    banner: String,
    model: &'a str,
    name: &'a str,
    robot: String,
    leg_types: &'static str,
    frame: &'static str,
    actuators: Vec<(&'static str, String)>,
    plant: &'a ControlModel,
    parts: &'a ControlModelParts,
    knows_inputs: bool,
    /// Each phase with its constants' beginning.
    phases: Vec<(String, &'a PhaseInterface, &'a ControlPhase)>,
}

/// Type and value of a matrix as a Rust array, row by row.
fn array<R: Dim, C: Dim, S: RawStorage<f64, R, C>>(
    matrix: &nalgebra::Matrix<f64, R, C, S>,
) -> String {
    let rows = matrix.row_iter();
    let texts: Vec<String> = rows
        .flat_map(|row| row.iter().map(|v| format!("{v:?}")).collect::<Vec<_>>())
        .collect();
    let lines: Vec<String> = texts.chunks(WIDTH).map(|line| line.join(", ")).collect();
    format!(
        "[f64; {}] = [\n    {},\n]",
        texts.len(),
        lines.join(",\n    ")
    )
}

impl<'a> ControlModelText<'a> {
    pub(crate) fn new(
        entries: &'a ModelInterface,
        plant: &'a ControlModel,
        banner: String,
    ) -> Self {
        let rule = plant.input_rule();
        let pairs = entries.phases.iter().zip(plant.phases());
        Self {
            banner,
            model: &entries.name,
            name: &entries.identifier,
            robot: robot_text(plant.robot()),
            leg_types: leg_types(plant.robot()),
            frame: match rule.wrench_frame() {
                WrenchFrame::Body => "Body",
                WrenchFrame::World => "World",
            },
            actuators: (rule.actuators().iter())
                .flat_map(|actuators| actuators.named())
                .map(|(name, values)| (name, format!("{values:?}")))
                .collect(),
            plant,
            parts: plant.parts(),
            knows_inputs: plant
                .phases()
                .iter()
                .any(|phase| phase.given_state.is_some()),
            phases: pairs
                .map(|(entries, phase)| (entries.identifier.to_ascii_uppercase(), entries, phase))
                .collect(),
        }
    }
}

/// The names that the robot's text needs beside `LegGeometry`.
fn leg_types(robot: &Robot) -> &'static str {
    let is_planar = |leg: Leg| matches!(robot.geometry(leg), LegGeometry::Planar(_));
    match Leg::ALL.map(is_planar) {
        [true, true, true, true] => "PlanarLeg",
        [false, false, false, false] => "ChainLeg",
        _ => "ChainLeg, PlanarLeg",
    }
}

/// A robot as a Rust expression: the debug form of structs, arrays, texts and numbers is one.
fn robot_text(robot: &Robot) -> String {
    let legs: Vec<String> = Leg::ALL
        .map(|leg| format!("        {:?},\n", robot.geometry(leg)))
        .into();
    let hips = Leg::ALL.map(|leg| <[f64; 3]>::from(robot.hip_position(leg)));
    let fields = [
        ("name", format!("{:?}", robot.name())),
        ("mass_kg", format!("{:?}", robot.mass_kg())),
        ("legs", format!("[\n{}    ]", legs.concat())),
        ("hip_position_m", format!("{hips:?}")),
        ("joint_names", format!("{:?}", robot.joint_names())),
        ("torque_limit_nm", format!("{:?}", robot.torque_limit_nm())),
        ("joint_limit_rad", format!("{:?}", robot.joint_limit_rad())),
        (
            "joint_speed_limit_rad_s",
            format!("{:?}", robot.joint_speed_limit_rad_s()),
        ),
    ];
    let fields = fields.map(|(name, value)| format!("    {name}: {value},\n"));
    format!("Robot {{\n{}}}", fields.concat())
}
