//! The controller in C99 alone: `NAME-controller-c/`.
//!
//! In: a complete linear model. Out: the model's equations as `--emit c` makes them, and beside them the controller:
//! reference, horizon, structured solver, commands and fallbacks in one file. The solver and the steps of the
//! controller are made from their Rust (`src/translate`), the rest has the operations of `control/online` in their
//! order, so that both give the same bits. Read `templates/controller_c/source.askama` first.

mod ros2_control;
mod selftest;
pub(super) mod source;

use std::ops::Deref;

use askama::Template;

use crate::codegen::interface::{ModelInterface, PhaseInterface};
use crate::codegen::tidy;
use crate::codegen::{Precision, Units, c};
use crate::deploy::controller::{self, plant};
use crate::deploy::emit::{EmitOptions, compiled};
use crate::deploy::{EmitError, PlannedJump};
use crate::equations::Equations;
use crate::files::EmittedFile;
use crate::mpc::problem::StageRows;
use crate::mpc::shared::torque_deviation;
use crate::mpc::{ControlModel, ControlPhase, MpcError, MpcSettings};
use crate::solver::Shape;
use source::{Numbers, Source};

/// Rows of the friction pyramid and of the slack.
const OTHER_ROWS: usize = 5;

/// What the C files take besides.
struct Facts<'a> {
    controller: controller::Facts<'a>,
    banner: String,
    real: &'static str,
    /// Torque limits, an initialiser in double precision.
    torque_limit: String,
    /// Joint limits, initialisers in double precision.
    joint_lower: String,
    joint_upper: String,
    /// Suffix of libm's functions.
    f: &'static str,
    max_rows: usize,
    /// Numbers that the solver keeps per row.
    row_numbers: usize,
    /// The solver's stage, as C.
    solver_stage: String,
    n_phases: usize,
    /// Whether the model knows what its states say of its inputs, in all phases.
    has_given_state: bool,
    rows: &'a StageRows,
}

impl<'a> Deref for Facts<'a> {
    type Target = controller::Facts<'a>;

    fn deref(&self) -> &Self::Target {
        &self.controller
    }
}

templates! {
    #[derive(askama::Template)]
    Header: "controller_c/header.askama",
    Cmake: "controller_c/cmake.askama",
    Readme: "controller_c/readme.askama",
    Example: "controller_c/example.askama",
    RobotHeader: "controller_c/robot.askama",
}

/// The files of a model's controller in C; `provenance` is the text of each file's first line.
pub fn emit(
    equations: &Equations<'_>,
    options: &EmitOptions,
    provenance: &str,
) -> Result<Vec<EmittedFile>, EmitError> {
    let model = equations.model();
    let plant = plant(model)?;
    // Rates are chosen when it runs: the rows are those of 1 N m a stage.
    let unit_rate = MpcSettings {
        torque_rate_nm_s: Some(1.0),
        step_s: 1.0,
        ..MpcSettings::default()
    };
    let rows = StageRows::new(&plant, &unit_rate);
    let entries = compiled(equations, options, Units::Si)?;
    let own = |phase: &&PhaseInterface| phase.identifier.eq_ignore_ascii_case("controller");
    if let Some(phase) = entries.phases.iter().find(own) {
        return Err(EmitError::PhaseName {
            model: model.name().to_owned(),
            phase: phase.identifier.clone(),
        });
    }
    let name = entries.identifier.clone();
    let folder = format!("{name}-controller-c");
    let mut files = Vec::new();
    for file in c::emit(&entries, provenance, options.precision, options.sines)? {
        if !file.path.ends_with("CMakeLists.txt") {
            let path = format!("{folder}/{}", file.path);
            files.push(EmittedFile::new(path, file.contents));
        }
    }
    let facts = &facts(&entries, &plant, &rows, options.precision, provenance);
    let deviation = |phase: &ControlPhase| {
        torque_deviation(phase).ok_or_else(|| MpcError::Statistics {
            phase: phase.name.clone(),
        })
    };
    let deviations: Vec<_> = (plant.phases().iter().map(deviation)).collect::<Result<_, _>>()?;
    let plant_of_lift = (&plant, deviations.as_slice());
    let source = Source::new(facts, &entries, plant_of_lift, options.precision);
    let (what, jump) = match &options.plan {
        Some(plan) => ("A jump of one's own", plan.thinned()),
        None => {
            let shipped = PlannedJump::shipped()?.thinned();
            ("A jump of a simulated go1", shipped.within(model))
        }
    };
    let heading = (facts.banner.as_str(), facts.upper.as_str());
    let jump_header = jump.constants(what, heading, options.precision);
    let (block, hash) = (facts.banner.as_str(), format!("# {provenance}"));
    let texts = [
        ("NAME_controller.h", Header::text(block, facts)?),
        ("NAME_controller.c", source.render()?),
        ("NAME_jump.h", jump_header),
        (
            "NAME_controller_selftest.c",
            selftest::text(facts, model, &jump, options.precision)?,
        ),
        ("NAME_robot.h", RobotHeader::text(block, facts)?),
        ("NAME_example.c", Example::text(block, facts)?),
        ("CMakeLists.txt", Cmake::text(&hash, facts)?),
        ("README.md", Readme::text(provenance, facts)?),
    ];
    let texts = texts.map(|(path, text)| (path.to_owned(), text));
    for (path, text) in texts
        .into_iter()
        .chain(ros2_control::files(facts, provenance)?)
    {
        let path = format!("{folder}/{}", path.replace("NAME", &name));
        files.push(EmittedFile::new(path, tidy(&text)));
    }
    Ok(files)
}

fn facts<'a>(
    entries: &'a ModelInterface,
    plant: &'a ControlModel,
    rows: &'a StageRows,
    precision: Precision,
    provenance: &str,
) -> Facts<'a> {
    let joint_limit = |side: fn(&(f64, f64)) -> f64| {
        Numbers(Precision::Double).vector(plant.robot().joint_limit_rad().iter().map(side))
    };
    let controller = controller::Facts::new(entries, plant);
    let real = match precision {
        Precision::Double => "double",
        Precision::Single => "float",
    };
    let one_row = Shape {
        input: 1,
        ..Shape::default()
    };
    Facts {
        solver_stage: source::stage(controller.name, &controller.upper, real),
        row_numbers: one_row.memory(),
        controller,
        banner: format!("/* {provenance} */"),
        real,
        torque_limit: Numbers(Precision::Double)
            .vector(plant.robot().torque_limit_nm().iter().copied()),
        joint_lower: joint_limit(|limit| limit.0),
        joint_upper: joint_limit(|limit| limit.1),
        f: match precision {
            Precision::Double => "",
            Precision::Single => "f",
        },
        max_rows: rows.torque.len() + rows.joint.len() + OTHER_ROWS,
        n_phases: plant.phases().len(),
        has_given_state: plant
            .phases()
            .iter()
            .all(|phase| phase.given_state.is_some()),
        rows,
    }
}
