//! The controller as a crate with a C interface: `NAME-controller/`.
//!
//! In: a complete linear model. Out: romc's own controller sources ([`sources`]), the model's
//! numbers as `src/control_model.rs`, its equations as the crate that `--emit rust` makes, a header,
//! examples, and the versions of the solver that romc was built with ([`lock`]).

mod control_model;
mod lock;
mod sources;

use askama::Template;

use crate::codegen::interface::ModelInterface;
use crate::codegen::line_wrapping::{tidy, wrapped};
use crate::codegen::{Precision, SineCosine, Units, rust};
use crate::deploy::{EmitError, PlannedJump};
use crate::equations::Equations;
use crate::files::EmittedFile;
use crate::lower::Form;
use crate::model::ReducedModel;
use crate::mpc::ControlModel;
use crate::mpc::interface::{self, Settings};
use crate::robot::{InputRule, Leg, Robot, STATE_DIM, WrenchFrame};
use control_model::ControlModelText;
use lock::Lock;

/// What the files of a controller's project take from the model, the robot and romc.
struct Facts<'a> {
    model: &'a str,
    name: &'a str,
    upper: String,
    robot: &'a str,
    latent_dim: usize,
    state_dim: usize,
    state_names: String,
    input_names: String,
    joint_names: String,
    /// How `u` comes from torques, lines of a comment.
    input_is: String,
    /// Constant and value of every code.
    codes: Vec<(String, i32)>,
    texts: Vec<(i32, String)>,
    defaults: Settings,
    link_m: String,
    rust_version: &'static str,
    clarabel: &'a str,
    nalgebra: &'a str,
    thiserror: &'a str,
}

templates! {
    #[derive(askama::Template)]
    Cargo: "controller/cargo.askama",
    Lib: "controller/lib.askama",
    Header: "controller/header.askama",
    Readme: "controller/readme.askama",
    ExampleC: "controller/example_c.askama",
    ExamplePlanC: "controller/example_plan_c.askama",
    ExampleCpp: "controller/example_cpp.askama",
    Binding: "controller/binding_py.askama",
    ExamplePy: "controller/example_py.askama",
}

/// The crate of a model's controller; `provenance` is the text of each file's first line, and `plan`
/// the jump of its C example.
///
/// # Errors
/// [`EmitError::Nonlinear`] if encoder or decoder have layers with an activation,
/// [`EmitError::Control`] if the model lacks something that control needs,
/// [`EmitError::Lower`] and [`EmitError::Template`].
pub fn emit(
    equations: &Equations<'_>,
    form: Form,
    provenance: &str,
    plan: Option<&PlannedJump>,
) -> Result<Vec<EmittedFile>, EmitError> {
    let plant = plant(equations.model())?;
    let entries = &ModelInterface::new(equations, form, Units::Si)?;
    let name = entries.identifier.as_str();
    let folder = format!("{name}-controller");
    let mut files = Vec::new();
    let mut add = |path: &str, text: String| {
        files.push(EmittedFile::new(format!("{folder}/{path}"), text));
    };
    for (path, text) in sources::files(provenance) {
        add(&path, text);
    }
    let text = ControlModelText::new(entries, &plant, format!("// {provenance}"));
    add("src/control_model.rs", tidy(&text.render()?));
    for (path, text) in project(entries, &plant, provenance, plan.is_some())? {
        add(&path, text);
    }
    for file in rust::emit(entries, provenance, Precision::Double, SineCosine::Inline)? {
        let path = file.path.replacen(name, "model", 1);
        add(&path, file.contents);
    }
    if let Some(plan) = plan {
        files.extend(plan.files(&format!("{folder}/examples"), name, provenance));
    }
    Ok(files)
}

/// What a controller knows of a model.
///
/// # Errors
/// [`EmitError::Nonlinear`] and [`EmitError::Control`].
pub(super) fn plant(model: &ReducedModel) -> Result<ControlModel, EmitError> {
    match model.is_linear() {
        true => Ok(ControlModel::new(model)?),
        false => Err(EmitError::Nonlinear {
            model: model.name().to_owned(),
        }),
    }
}

/// How the controller's inputs come from torques, for the header's first comment.
pub(super) fn input_in_words(rule: &InputRule, name: &str) -> String {
    let torques = match rule.actuators() {
        None => "its torques are those of the motors",
        Some(_) => {
            "its torques are those at the links: what friction and the inertia of the motors take is off, and \
             commands have it on top"
        }
    };
    let wrench = match rule.wrench_frame() {
        WrenchFrame::Body => {
            "force and moment are those of the feet on the body, along axes parallel to the body's: sums \
             of F_k = -J_k^-T tau_k and of p_k x F_k, p_k the foot from its own hip"
        }
        WrenchFrame::World => {
            "force and moment are those of the feet on the body, the force in world axes, the moments \
             those that do work on the rates of roll, pitch and yaw about the body's origin"
        }
    };
    let of_torques = match rule.actuators() {
        None => "",
        Some(_) => ", of torques less the inertia of the motors times ddq",
    };
    let text = format!(
        "Of u, {torques}; {wrench}. {name}_generalised_input() of the model makes it{of_torques}."
    );
    wrapped(&text, 100, "").join("\n * ")
}

/// What is the same for all models but for names.
fn project(
    entries: &ModelInterface,
    plant: &ControlModel,
    provenance: &str,
    jumps_a_plan: bool,
) -> Result<Vec<(String, String)>, EmitError> {
    let name = entries.identifier.as_str();
    let lock = Lock::own();
    let facts = &Facts {
        model: &entries.name,
        name,
        upper: name.to_ascii_uppercase(),
        robot: plant.robot().name(),
        latent_dim: entries.latent_dim,
        state_dim: STATE_DIM,
        state_names: Robot::state_names().join(" "),
        input_names: Robot::input_names().join(" "),
        joint_names: plant.robot().joint_names().join(" "),
        input_is: input_in_words(plant.input_rule(), name),
        codes: texts()
            .map(|(code, text)| (constant(&text), code))
            .collect(),
        texts: texts().collect(),
        defaults: Settings::default(),
        link_m: format!("{:?}", plant.robot().geometry(Leg::FrontRight).lengths()[0]),
        rust_version: env!("CARGO_PKG_RUST_VERSION"),
        clarabel: lock.version("clarabel"),
        nalgebra: lock.version("nalgebra"),
        thiserror: lock.version("thiserror"),
    };
    let (hash, slashes) = (format!("# {provenance}"), format!("// {provenance}"));
    let [hash, slashes] = [hash.as_str(), &slashes];
    let block = &format!("/* {provenance} */");
    let example_c = match jumps_a_plan {
        true => ExamplePlanC::text(block, facts)?,
        false => ExampleC::text(block, facts)?,
    };
    let templates = [
        ("Cargo.toml", Cargo::text(hash, facts)?),
        ("src/lib.rs", Lib::text(slashes, facts)?),
        ("include/NAME_controller.h", Header::text(block, facts)?),
        ("README.md", Readme::text(provenance, facts)?),
        ("examples/example.c", example_c),
        ("examples/example.cpp", ExampleCpp::text(slashes, facts)?),
        ("python/NAME_controller.py", Binding::text(hash, facts)?),
        ("python/example.py", ExamplePy::text(hash, facts)?),
    ];
    let mut files: Vec<(String, String)> = (templates.into_iter())
        .map(|(path, text)| (path.replace("NAME", name), tidy(&text)))
        .collect();
    files.push(("Cargo.lock".to_owned(), lock.text(hash, name)));
    for (path, text) in sources::LICENCES {
        files.push((path.to_owned(), text.to_owned()));
    }
    Ok(files)
}

/// Every code of the interface with its text.
pub(super) fn texts() -> impl Iterator<Item = (i32, String)> {
    interface::all_codes().map(|code| {
        let text = interface::status_text(code).to_string_lossy();
        (code, text.into_owned())
    })
}

/// The name of a code: the words of its text before the colon.
pub(super) fn constant(text: &str) -> String {
    let word = text.split(':').next().unwrap_or(text);
    word.to_ascii_uppercase().replace(' ', "_")
}
