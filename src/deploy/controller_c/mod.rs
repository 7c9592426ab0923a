//! The controller in C99 alone, `NAME-controller-c/`. In: a complete linear model. Out: its equations as made by
//! `--emit c`, and the controller in one file. Solver and steps are translated from their Rust (`src/translate`); the
//! rest has the operations of `control/online` in their order, for the same bits. Read
//! `templates/controller_c/source.askama` first.

mod ros2_control;
mod selftest;
pub(super) mod source;

use super::*;
use crate::deploy::controller::{self, plant};
use crate::deploy::emit::{EmitOptions, compiled};
use crate::mpc::problem::StageRows;
use crate::solver::ROW_NUMBERS;
use source::nested;
use source::{Numbers, Source};

struct Facts<'a> {
    controller: controller::Facts<'a>,
    banner: String,
    real: &'static str,
    /// Torque limits, an initialiser in double precision.
    torque_limit: String,
    limits: &'a [(f64, f64)],
    f: &'static str,
    /// Macros that enable rows linking stages: name and description.
    switches: Vec<(&'static str, &'static str)>,
    row_numbers: usize,
    solver_stage: String,
    n_phases: usize,
    /// Whether the model has the distribution of inputs given states, in all phases.
    has_given_state: bool,
    rows: &'a StageRows,
    /// Whether the model has strides to walk by.
    walks: bool,
    /// Whether the trajectory is a given one, and whether it begins in motion, so that no stand leads to it.
    has_plan: bool,
    begins_moving: bool,
    timing: Timing,
    /// Names of the columns of a log.
    log_columns: Vec<String>,
}

extends! { <'a> Facts<'a>: controller::Facts<'a>, controller }

templates! {
    #[derive(askama::Template)]
    "NAME_controller.h": Header "controller_c/header.askama",
    "NAME_robot.h": RobotHeader "controller_c/robot.askama",
    "NAME_log.h": LogHeader "controller_c/log.askama",
    "NAME_example.c": Example "controller_c/example.askama",
    "NAME_budget.c": Budget "controller_c/budget.askama",
    "CMakeLists.txt": Cmake "controller_c/cmake.askama",
    "README.md": Readme "controller_c/readme.askama",
}

/// Speed of the body at the beginning of a trajectory up to which the robot stands there.
const STANDS_M_S: f64 = 0.1;

/// The files of a model's controller in C; `provenance` is the text of each file's first line.
pub(crate) fn emit(
    equations: &Equations<'_>,
    options: &EmitOptions,
    provenance: &str,
) -> Result<Vec<EmittedFile>, EmitError> {
    let (model, precision) = (&equations.model, options.precision);
    let plant = plant(model)?;
    let rows = StageRows::of_all_kinds(&plant);
    let is_complete = plant.phase_of_feet.iter().all(Option::is_some);
    let strides = match model.stride_prior() {
        Ok(_) if is_complete => Some(crate::mpc::walk_strides(model)?),
        _ => None,
    };
    let entries = compiled(equations, options, Units::Si)?;
    let own = |phase: &&PhaseInterface| phase.identifier.eq_ignore_ascii_case("controller");
    if let Some(phase) = entries.phases.iter().find(own) {
        return Err(EmitError::PhaseName {
            model: model.name().to_owned(),
            phase: phase.identifier.clone(),
        });
    }
    let facts = &Facts::new(
        &entries,
        &plant,
        &rows,
        (precision, options.plan.as_ref()),
        (provenance, strides.is_some()),
    );
    let name = facts.name;
    let (what, jump) = match &options.plan {
        Some(plan) => ("A jump of one's own", plan.thinned()),
        None => {
            let shipped = PlannedJump::shipped()?.thinned();
            ("A jump of a simulated go1", shipped.within(model))
        }
    };
    let source = Source::new(facts, &entries, &plant, strides, precision)?;
    let self_test = selftest::text(facts, model, &jump, precision)?;
    let mut texts = texts(facts, provenance)?;
    let made = [
        (format!("{name}_controller.c"), tidy(&source.render()?)),
        jump.constants(what, name, provenance, precision),
        (format!("{name}_controller_selftest.c"), tidy(&self_test)),
    ];
    texts.splice(1..1, made);
    texts.extend(ros2_control::files(facts, provenance)?);
    let of_model = c::emit(&entries, provenance, precision, options.sines)?;
    let of_model = of_model.into_iter().map(|file| (file.path, file.contents));
    let mut files: Vec<(String, String)> = of_model
        .filter(|(path, _)| !path.ends_with("CMakeLists.txt"))
        .collect();
    files.extend(texts);
    let place = |(path, text)| EmittedFile::new(format!("{name}-controller-c/{path}"), text);
    Ok(files.into_iter().map(place).collect())
}

impl<'a> Facts<'a> {
    fn new(
        entries: &'a ModelInterface,
        plant: &'a ControlModel,
        rows: &'a StageRows,
        (precision, plan): (Precision, Option<&PlannedJump>),
        (provenance, walks): (&str, bool),
    ) -> Self {
        let controller = controller::Facts::new(entries, plant, plan);
        let (real, f) = match precision {
            Precision::Double => ("double", ""),
            Precision::Single => ("float", "f"),
        };
        let limits = plant.robot().torque_limit_nm();
        let begins_moving = plan.is_some_and(|plan| {
            let velocity = plan.dx.fixed_view::<3, 1>(JOINT_DIM, 0);
            velocity.norm() > STANDS_M_S
        });
        let switch = |setting: &Setting| match setting.accepts {
            Accepts::LinkRows(name, what) => Some((name, what)),
            _ => None,
        };
        Self {
            solver_stage: source::stage(controller.name, &controller.upper, real, walks),
            row_numbers: ROW_NUMBERS,
            walks,
            has_plan: plan.is_some(),
            begins_moving,
            controller,
            banner: format!("/* {provenance} */"),
            real,
            torque_limit: Numbers(Precision::Double).vector(limits),
            limits: plant.robot().joint_limit_rad(),
            f,
            switches: SETTINGS.iter().filter_map(switch).collect(),
            n_phases: plant.phases().len(),
            has_given_state: (plant.phases().iter()).all(|phase| phase.given_state.is_some()),
            rows,
            timing: Timing::default(),
            log_columns: ControllerLog::column_names(entries.latent_dim),
        }
    }
}
