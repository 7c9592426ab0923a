//! The controller as a crate with a C interface: `NAME-controller/`.
//!
//! In: a complete linear model. Out: romc's own controller sources ([`sources`]), the model's numbers as
//! `src/control_model.rs`, its equations as the crate that `--emit rust` makes, a header, examples, and the versions of
//! the solver that romc was built with ([`lock`]).

mod control_model;
mod lock;

use askama::Template;

use crate::codegen::interface::ModelInterface;
use crate::codegen::{Precision, SineCosine, Units, rust};
use crate::codegen::{tidy, wrapped};
use crate::deploy::{EmitError, PlannedJump};
use crate::equations::Equations;
use crate::files::EmittedFile;
use crate::lower::Form;
use crate::model::ReducedModel;
use crate::mpc::ControlModel;
use crate::mpc::interface::{Settings, all_codes};
use crate::robot::{InputRule, Leg, Robot, STATE_DIM, WrenchFrame};
use control_model::{ControlModelText, SettingText, quoted_names};

/// What the files of a controller, as a crate or in C, take from the model, the robot and romc.
pub(super) struct Facts<'a> {
    pub(super) model: &'a str,
    pub(super) name: &'a str,
    pub(super) upper: String,
    pub(super) robot: &'a str,
    pub(super) latent_dim: usize,
    pub(super) state_dim: usize,
    pub(super) state_names: String,
    pub(super) input_names: String,
    joint_names: String,
    /// How `u` comes from torques, lines of a comment.
    pub(super) input_is: String,
    pub(super) codes: Vec<(String, i32)>,
    pub(super) texts: Vec<(i32, String)>,
    pub(super) defaults: Settings,
    pub(super) settings: Vec<SettingText>,
    link_m: String,
    rust_version: &'static str,
}

impl<'a> Facts<'a> {
    pub(super) fn new(entries: &'a ModelInterface, plant: &'a ControlModel) -> Self {
        let (name, robot) = (entries.identifier.as_str(), plant.robot());
        let texts = all_codes().map(|(code, text)| (code, text.to_string_lossy().into_owned()));
        let texts: Vec<(i32, String)> = texts.collect();
        Self {
            model: &entries.name,
            name,
            upper: name.to_ascii_uppercase(),
            robot: robot.name(),
            latent_dim: entries.latent_dim,
            state_dim: STATE_DIM,
            state_names: Robot::state_names().join(" "),
            input_names: Robot::input_names().join(" "),
            joint_names: robot.joint_names().join(" "),
            input_is: input_in_words(plant.input_rule(), name),
            codes: (texts.iter())
                .map(|(code, text)| (constant(text), *code))
                .collect(),
            texts,
            defaults: Settings::default(),
            settings: SettingText::all(),
            link_m: format!("{:?}", robot.geometry(Leg::FrontRight).lengths_m[0]),
            rust_version: env!("CARGO_PKG_RUST_VERSION"),
        }
    }

    /// The version of a package that the crate needs.
    fn version(&self, package: &str) -> &'static str {
        lock::version(package)
    }
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

/// The crate of a model's controller; `provenance` is the text of each file's first line, and `plan` the jump of its C
/// example.
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
    for (path, text) in lock::files(provenance) {
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
pub(super) fn plant(model: &ReducedModel) -> Result<ControlModel, EmitError> {
    match model.is_linear() {
        true => Ok(crate::mpc::control_model(model)?),
        false => Err(EmitError::Nonlinear {
            model: model.name().to_owned(),
        }),
    }
}

/// How the controller's inputs come from torques, for the header's first comment.
fn input_in_words(rule: &InputRule, name: &str) -> String {
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

fn project(
    entries: &ModelInterface,
    plant: &ControlModel,
    provenance: &str,
    jumps_a_plan: bool,
) -> Result<Vec<(String, String)>, EmitError> {
    let facts = &Facts::new(entries, plant);
    let name = facts.name;
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
    files.push(("Cargo.lock".to_owned(), lock::text(hash, name)));
    for (path, text) in lock::LICENCES {
        files.push((path.to_owned(), text.to_owned()));
    }
    Ok(files)
}

/// The name of a code: the words of its text before the colon.
fn constant(text: &str) -> String {
    let word = text.split(':').next().unwrap_or(text);
    word.to_ascii_uppercase().replace(' ', "_")
}
