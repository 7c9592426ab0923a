//! The controller as a crate with a C interface, `NAME-controller/`. In: a complete linear model. Out: romc's own
//! controller sources and the versions of its solver ([`lock`]), the numbers as `src/control_model.rs`, the equations
//! as the crate that `--emit rust` makes, a header, examples.

mod control_model;
mod joints;
mod lock;

use super::*;
use crate::mpc::Drives;
use control_model::{ControlModelText, SettingText};
use joints::JointTexts;

/// Data of the model, the robot and romc for the files of a controller, as a crate or in C.
pub(super) struct Facts<'a> {
    pub(super) model: &'a str,
    pub(super) name: &'a str,
    pub(super) upper: String,
    pub(super) robot: &'a str,
    pub(super) latent_dim: usize,
    pub(super) latent_lines: &'a [String],
    pub(super) state_dim: usize,
    pub(super) state_names: String,
    pub(super) input_names: String,
    pub(super) joints: JointTexts,
    pub(super) input_is: String,
    pub(super) codes: Vec<(String, i32)>,
    pub(super) texts: Vec<(i32, String)>,
    pub(super) defaults: Settings,
    pub(super) settings: Vec<SettingText>,
    /// Fields of the settings that are not the library's own, as Rust.
    chosen: String,
    has_plan: bool,
    link_m: String,
    rust_version: &'static str,
}

impl<'a> Facts<'a> {
    pub(super) fn new(
        entries: &'a ModelInterface,
        plant: &'a ControlModel,
        plan: Option<&PlannedJump>,
    ) -> Self {
        let (name, robot) = (entries.identifier.as_str(), plant.robot());
        let usual = MpcSettings {
            drives: Drives::of(robot),
            ..MpcSettings::default()
        };
        let settings = Settings::from(plan.map_or(&usual, |plan| &plan.settings));
        let texts = all_codes().map(|(code, text)| (code, text.to_string_lossy().into_owned()));
        let texts: Vec<(i32, String)> = texts.collect();
        Self {
            model: &entries.name,
            name,
            upper: name.to_ascii_uppercase(),
            robot: robot.name,
            latent_dim: entries.latent_dim,
            latent_lines: &entries.latent_lines,
            state_dim: STATE_DIM,
            state_names: Robot::state_names().join(" "),
            input_names: Robot::input_names().join(" "),
            joints: JointTexts::new(robot),
            input_is: input_in_words(plant.input_rule(), name),
            codes: texts.iter().map(constant).collect(),
            texts,
            settings: SettingText::all(&settings),
            chosen: changed(&settings),
            defaults: settings,
            has_plan: plan.is_some(),
            link_m: format!("{:?}", robot.geometry(Leg::FrontRight).lengths_m[0]),
            rust_version: env!("CARGO_PKG_RUST_VERSION"),
        }
    }

    fn version(&self, package: &str) -> &'static str {
        lock::version(package)
    }
}

templates! {
    #[derive(askama::Template)]
    "Cargo.toml": Cargo "controller/cargo.askama",
    "src/lib.rs": Lib "controller/lib.askama",
    "include/NAME_controller.h": Header "controller/header.askama",
    "README.md": Readme "controller/readme.askama",
    "examples/example.c": ExampleC "controller/example_c.askama",
    "examples/example.cpp": ExampleCpp "controller/example_cpp.askama",
    "python/NAME_controller.py": Binding "controller/binding_py.askama",
    "python/example.py": ExamplePy "controller/example_py.askama",
}

/// The crate of a model's controller; `provenance` is the first line of its files, `plan` the jump of its C example.
pub(crate) fn emit(
    equations: &Equations<'_>,
    form: Form,
    provenance: &str,
    plan: Option<&PlannedJump>,
) -> Result<Vec<EmittedFile>, EmitError> {
    let plant = plant(&equations.model)?;
    let entries = &ModelInterface::new(equations, form, Units::Si)?;
    let facts = &Facts::new(entries, &plant, plan);
    let (name, folder) = (facts.name, format!("{}-controller", facts.name));
    let numbers = ControlModelText::new(entries, &plant, format!("// {provenance}")).render()?;
    let mut texts: Vec<(String, String)> = lock::files(provenance).collect();
    texts.push(("src/control_model.rs".to_owned(), tidy(&numbers)));
    texts.extend(self::texts(facts, provenance)?);
    texts.push((
        "Cargo.lock".to_owned(),
        lock::text(&banner("Cargo.lock", provenance), name),
    ));
    texts.extend(lock::LICENCES.map(|(path, text)| (path.to_owned(), text.to_owned())));
    for file in rust::emit(entries, provenance, Precision::Double, SineCosine::Inline)? {
        texts.push((file.path.replacen(name, "model", 1), file.contents));
    }
    let mut files: Vec<EmittedFile> = (texts.into_iter())
        .map(|(path, text)| EmittedFile::new(format!("{folder}/{path}"), text))
        .collect();
    if let Some(plan) = plan {
        files.extend(plan.files(&format!("{folder}/examples"), name, provenance));
    }
    Ok(files)
}

pub(super) fn plant(model: &ReducedModel) -> Result<ControlModel, EmitError> {
    match model.is_linear() {
        true => Ok(crate::mpc::control_model(model)?),
        false => Err(EmitError::Nonlinear {
            model: model.name().to_owned(),
        }),
    }
}

fn input_in_words(rule: &InputRule, name: &str) -> String {
    let torques = match rule.actuators() {
        None => "its torques are those of the motors",
        Some(_) => {
            "its torques are those at the links: losses to friction and to the inertia of motors and legs are \
             subtracted, and commands have them on top"
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
        WrenchFrame::Ground => {
            "force and moment are those of the feet that push the body, the force in world axes, the \
             moments those that do work on the rates of roll, pitch and yaw about the body's origin"
        }
    };
    let of_torques = match rule.actuators() {
        None => "",
        Some(_) if rule.inertia_is_loss(false) => {
            ", of torques less the inertia of the motors times ddq"
        }
        Some(_) if rule.legs().is_some() => {
            ", of torques less, with a foot on the ground, the inertia of the motors times ddq and the torques of \
             the legs' links (leg_torque)"
        }
        Some(_) => {
            ", of torques less, with a foot on the ground, the inertia of the motors times ddq"
        }
    };
    let text = format!(
        "Of u, {torques}; {wrench}. {name}_generalised_input() of the model makes it{of_torques}."
    );
    wrapped(&text, 100, "").join("\n * ")
}

/// `name: value, ` of each setting that differs from the library's.
fn changed(settings: &Settings) -> String {
    let all = SETTINGS.iter().zip(settings.numbers());
    let changed = all.zip(Settings::default().numbers());
    let changed = changed.filter(|((_, own), usual)| own != usual);
    let fields = changed.map(|((setting, own), _)| match setting.kind {
        "i32" => format!("{}: {own}, ", setting.name),
        _ => format!("{}: {own:?}, ", setting.name),
    });
    fields.collect()
}

/// The name of a code: the words of its text before the colon.
fn constant((code, text): &(i32, String)) -> (String, i32) {
    let word = text.split(':').next().unwrap_or(text);
    (word.to_ascii_uppercase().replace(' ', "_"), *code)
}
