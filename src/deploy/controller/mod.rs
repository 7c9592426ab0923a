//! The controller as a crate with a C interface: `NAME-controller/`.
//!
//! In: a complete linear model. Out: romc's own controller sources ([`sources`]), the model's
//! numbers as `src/control_model.rs`, its equations as the crate that `--emit rust` makes, a header,
//! examples, and the versions of the solver that romc was built with ([`lock`]).

mod control_model;
mod lock;
mod sources;

use askama::Template;

use crate::codegen::Precision;
use crate::codegen::SineCosine;
use crate::codegen::Units;
use crate::codegen::interface::ModelInterface;
use crate::codegen::line_wrapping::tidy;
use crate::codegen::rust;
use crate::deploy::EmitError;
use crate::equations::Equations;
use crate::files::EmittedFile;
use crate::lower::LowerOptions;
use crate::mpc::ControlModel;
use crate::mpc::interface::{Settings, TEXTS};
use crate::robot::{InputRule, Robot, STATE_DIM, WrenchFrame};
use control_model::ControlModelText;
use lock::Lock;

#[derive(Template)]
#[template(path = "controller/cargo.askama", config = "templates/askama.toml")]
struct Cargo<'a> {
    banner: String,
    name: &'a str,
    rust_version: &'static str,
    clarabel: &'a str,
    nalgebra: &'a str,
    thiserror: &'a str,
}

#[derive(Template)]
#[template(path = "controller/lib.askama", config = "templates/askama.toml")]
struct Lib<'a> {
    banner: String,
    model: &'a str,
    name: &'a str,
    robot: &'a str,
    state_dim: usize,
}

#[derive(Template)]
#[template(path = "controller/header.askama", config = "templates/askama.toml")]
struct Header<'a> {
    banner: String,
    model: &'a str,
    name: &'a str,
    upper: &'a str,
    robot: &'a str,
    latent_dim: usize,
    state_dim: usize,
    state_names: String,
    input_names: String,
    /// How `u` comes from torques, lines of a comment.
    input_is: String,
    /// Constant and value of every code.
    codes: Vec<(String, i32)>,
    defaults: Settings,
}

#[derive(Template)]
#[template(path = "controller/readme.askama", config = "templates/askama.toml")]
struct Readme<'a> {
    provenance: &'a str,
    model: &'a str,
    name: &'a str,
    robot: &'a str,
    latent_dim: usize,
    texts: Vec<(i32, String)>,
}

#[derive(Template)]
#[template(path = "controller/example_c.askama", config = "templates/askama.toml")]
struct ExampleC<'a> {
    banner: String,
    name: &'a str,
    upper: &'a str,
    link_m: String,
}

#[derive(Template)]
#[template(
    path = "controller/example_cpp.askama",
    config = "templates/askama.toml"
)]
struct ExampleCpp<'a> {
    banner: String,
    name: &'a str,
    upper: &'a str,
}

#[derive(Template)]
#[template(
    path = "controller/binding_py.askama",
    config = "templates/askama.toml"
)]
struct Binding<'a> {
    banner: String,
    model: &'a str,
    name: &'a str,
    latent_dim: usize,
    state_dim: usize,
}

#[derive(Template)]
#[template(
    path = "controller/example_py.askama",
    config = "templates/askama.toml"
)]
struct ExamplePy<'a> {
    banner: String,
    name: &'a str,
}

/// The crate of a model's controller; `provenance` is the text of each file's first line.
///
/// # Errors
/// [`EmitError::Nonlinear`] if encoder or decoder have layers with an activation,
/// [`EmitError::Control`] if the model lacks something that control needs,
/// [`EmitError::Lower`] and [`EmitError::Template`].
pub fn emit(
    equations: &Equations<'_>,
    options: &LowerOptions,
    provenance: &str,
) -> Result<Vec<EmittedFile>, EmitError> {
    let model = equations.model();
    if !model.is_linear() {
        return Err(EmitError::Nonlinear {
            model: model.name().to_owned(),
        });
    }
    let plant = ControlModel::new(model)?;
    let entries = &ModelInterface::new(equations, options, Units::Si)?;
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
    for (path, text) in project(entries, &plant, provenance)? {
        add(&path, text);
    }
    for file in rust::emit(entries, provenance, Precision::Double, SineCosine::Inline)? {
        let path = file.path.replacen(name, "model", 1);
        add(&path, file.contents);
    }
    Ok(files)
}

/// How the controller's inputs come from torques, for the header's first comment.
fn input_in_words(rule: &InputRule, name: &str) -> String {
    let torques = match rule.actuators() {
        None => "its torques are those of the motors",
        Some(_) => {
            "its torques are those at the links, what the joints take is off; commands have it on top"
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
    let text =
        format!("Of u, {torques}; {wrench}. {name}_generalised_input() of the model makes it.");
    let mut lines = vec![String::new()];
    for word in text.split(' ') {
        let last = lines.last_mut().expect("never empty");
        match last.len() + word.len() {
            ..100 if last.is_empty() => last.push_str(word),
            ..100 => *last += &format!(" {word}"),
            _ => lines.push(word.to_owned()),
        }
    }
    lines.join("\n * ")
}

/// What is the same for all models but for names.
fn project(
    entries: &ModelInterface,
    plant: &ControlModel,
    provenance: &str,
) -> Result<Vec<(String, String)>, EmitError> {
    let (model, name) = (entries.name.as_str(), entries.identifier.as_str());
    let upper = &name.to_ascii_uppercase();
    let robot = plant.robot().name();
    let (latent_dim, state_dim) = (entries.latent_dim, STATE_DIM);
    let comments = [format!("// {provenance}"), format!("/* {provenance} */")];
    let [slashes, block] = &comments;
    let hash = format!("# {provenance}");
    let lock = Lock::own();
    let cargo = Cargo {
        banner: hash.clone(),
        name,
        rust_version: env!("CARGO_PKG_RUST_VERSION"),
        clarabel: lock.version("clarabel"),
        nalgebra: lock.version("nalgebra"),
        thiserror: lock.version("thiserror"),
    };
    let lib = Lib {
        banner: slashes.clone(),
        model,
        name,
        robot,
        state_dim,
    };
    let header = Header {
        banner: block.clone(),
        model,
        name,
        upper,
        robot,
        latent_dim,
        state_dim,
        state_names: Robot::state_names().join(" "),
        input_names: Robot::input_names().join(" "),
        input_is: input_in_words(plant.input_rule(), name),
        codes: texts()
            .map(|(code, text)| (constant(&text), code))
            .collect(),
        defaults: Settings::default(),
    };
    let readme = Readme {
        provenance,
        model,
        name,
        robot,
        latent_dim,
        texts: texts().collect(),
    };
    let example_c = ExampleC {
        banner: block.clone(),
        name,
        upper,
        link_m: format!("{:?}", plant.robot().geometry().thigh_m),
    };
    let example_cpp = ExampleCpp {
        banner: slashes.clone(),
        name,
        upper,
    };
    let binding = Binding {
        banner: hash.clone(),
        model,
        name,
        latent_dim,
        state_dim,
    };
    let example_py = ExamplePy {
        banner: hash.clone(),
        name,
    };
    let templates = [
        ("Cargo.toml".to_owned(), cargo.render()?),
        ("src/lib.rs".to_owned(), lib.render()?),
        (format!("include/{name}_controller.h"), header.render()?),
        ("README.md".to_owned(), readme.render()?),
        ("examples/example.c".to_owned(), example_c.render()?),
        ("examples/example.cpp".to_owned(), example_cpp.render()?),
        (format!("python/{name}_controller.py"), binding.render()?),
        ("python/example.py".to_owned(), example_py.render()?),
    ];
    let mut files: Vec<(String, String)> = templates
        .into_iter()
        .map(|(path, text)| (path, tidy(&text)))
        .collect();
    files.push(("Cargo.lock".to_owned(), lock.text(&hash, name)));
    for (path, text) in sources::LICENCES {
        files.push((path.to_owned(), text.to_owned()));
    }
    Ok(files)
}

/// Every code of the interface with its text.
fn texts() -> impl Iterator<Item = (i32, String)> {
    TEXTS
        .iter()
        .map(|(code, text)| (*code, text.to_string_lossy().into_owned()))
}

/// The name of a code: the words of its text before the colon.
fn constant(text: &str) -> String {
    let word = text.split(':').next().unwrap_or(text);
    word.to_ascii_uppercase().replace(' ', "_")
}
