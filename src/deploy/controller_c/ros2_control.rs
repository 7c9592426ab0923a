//! A plugin of ros2_control around the controller in C: `ros2_control/` beside it.

use std::ops::Deref;

use crate::deploy::EmitError;
use crate::mpc::STEP_SLACK;
use crate::recording::check::{BODY_SPEED_M_S, JOINT_MARGIN_RAD};

/// What its files take besides the facts of the controller.
struct Facts<'a> {
    controller: &'a super::Facts<'a>,
    /// Name of the package, its namespace and its library.
    package: String,
    version: &'static str,
}

impl<'a> Deref for Facts<'a> {
    type Target = super::Facts<'a>;

    fn deref(&self) -> &super::Facts<'a> {
        self.controller
    }
}

templates! {
    #[derive(askama::Template)]
    Header: "controller_c/ros2_control/controller_header.askama",
    Source: "controller_c/ros2_control/controller_source.askama",
    PlanHeader: "controller_c/ros2_control/plan_header.askama",
    PlanSource: "controller_c/ros2_control/plan_source.askama",
    Cmake: "controller_c/ros2_control/cmake.askama",
    Package: "controller_c/ros2_control/package.askama",
    Plugin: "controller_c/ros2_control/plugin.askama",
    Parameters: "controller_c/ros2_control/yaml.askama",
    Readme: "controller_c/ros2_control/readme.askama",
}

/// Paths below the controller's folder, and texts.
pub(super) fn files(
    controller: &super::Facts<'_>,
    provenance: &str,
) -> Result<Vec<(String, String)>, EmitError> {
    let facts = &Facts {
        controller,
        package: format!("{}_ros2_control", controller.name.to_ascii_lowercase()),
        version: env!("CARGO_PKG_VERSION"),
    };
    let (hash, slashes) = (format!("# {provenance}"), format!("// {provenance}"));
    let texts = [
        ("src/controller.hpp", Header::text(&slashes, facts)?),
        ("src/controller.cpp", Source::text(&slashes, facts)?),
        ("src/plan.hpp", PlanHeader::text(&slashes, facts)?),
        ("src/plan.cpp", PlanSource::text(&slashes, facts)?),
        ("CMakeLists.txt", Cmake::text(&hash, facts)?),
        ("package.xml", Package::text(provenance, facts)?),
        ("plugin.xml", Plugin::text(provenance, facts)?),
        ("controllers.yaml", Parameters::text(&hash, facts)?),
        ("README.md", Readme::text(provenance, facts)?),
    ];
    let below = texts.map(|(path, text)| (format!("ros2_control/{path}"), text));
    Ok(below.into())
}
