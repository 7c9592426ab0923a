//! A plugin of ros2_control around the controller in C, in the folder `ros2_control/` next to it.

use std::f64::consts::FRAC_PI_2;

use super::*;
use crate::mpc::STEP_SLACK;
use crate::recording::Column;
use crate::recording::check::{BODY_SPEED_M_S, JOINT_MARGIN_RAD};

struct Facts<'a> {
    controller: &'a super::Facts<'a>,
    /// Name of the package, its namespace and its library.
    package: String,
    version: &'static str,
    /// The columns of a jump with the physical limits of the robot, as an initialiser.
    columns: String,
    /// The motion by default: along a given plan, by commands for a model with strides.
    start: &'static str,
    /// Name of the controller in the example of its parameters.
    node: &'static str,
}

extends! { <'a> Facts<'a>: super::Facts<'a>, controller }

templates! {
    #[derive(askama::Template)]
    "ros2_control/src/controller.hpp": Header "controller_c/ros2_control/controller_header.askama",
    "ros2_control/src/controller.cpp": Source "controller_c/ros2_control/controller_source.askama",
    "ros2_control/src/plan.hpp": PlanHeader "controller_c/ros2_control/plan_header.askama",
    "ros2_control/src/plan.cpp": PlanSource "controller_c/ros2_control/plan_source.askama",
    "ros2_control/CMakeLists.txt": Cmake "controller_c/ros2_control/cmake.askama",
    "ros2_control/package.xml": Package "controller_c/ros2_control/package.askama",
    "ros2_control/plugin.xml": Plugin "controller_c/ros2_control/plugin.askama",
    "ros2_control/controllers.yaml": Parameters "controller_c/ros2_control/yaml.askama",
    "ros2_control/README.md": Readme "controller_c/ros2_control/readme.askama",
}

pub(super) fn files(
    controller: &super::Facts<'_>,
    provenance: &str,
) -> askama::Result<Vec<(String, String)>> {
    let start = match (controller.has_plan, controller.begins_moving) {
        (true, true) => "jump",
        (false, _) if controller.walks => "walk",
        _ => "stand",
    };
    let facts = Facts {
        start,
        node: match start {
            "walk" => "walk_controller",
            _ => "jump_controller",
        },
        controller,
        package: format!("{}_ros2_control", controller.name.to_ascii_lowercase()),
        version: env!("CARGO_PKG_VERSION"),
        columns: columns(controller.limits),
    };
    texts(&facts, provenance)
}

fn columns(joint_limit_rad: &[(f64, f64)]) -> String {
    let range = |column: Column| match column {
        Column::Position(i @ 0..JOINT_DIM) => {
            let (lower, upper) = joint_limit_rad[i];
            Some((lower - JOINT_MARGIN_RAD, upper + JOINT_MARGIN_RAD))
        }
        Column::Position(15 | 16) => Some((-FRAC_PI_2, FRAC_PI_2)),
        Column::Velocity(12..15) => Some((-BODY_SPEED_M_S, BODY_SPEED_M_S)),
        _ => None,
    };
    let end = |end: f64| match end.is_finite() {
        true => format!("{end:?}"),
        false => format!("{}ANY", if end < 0.0 { "-" } else { "" }),
    };
    let of_states = [Column::Position, Column::Velocity].into_iter();
    let states = of_states.flat_map(|kind| (0..STATE_DIM).map(kind));
    let torques = (0..JOINT_DIM).map(Column::Torque);
    let all = [Column::Time].into_iter().chain(states).chain(torques);
    nested(all.chain((0..FOOT_DIM).map(Column::Foot)).map(|column| {
        let (lower, upper) = range(column).unwrap_or((-f64::INFINITY, f64::INFINITY));
        format!("{{{:?}, {}, {}}}", column.name(), end(lower), end(upper))
    }))
}
