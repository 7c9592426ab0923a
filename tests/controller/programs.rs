//! Programs of others that the tests of generated controllers run, and the models they are made of.

use std::path::Path;
use std::process::{Command, Output};

use romc::model::ReducedModel;
use romc::robot::{Actuators, WrenchFrame};

/// Warnings that generated headers, examples and plugins must not raise, in C and C++.
pub const WARNINGS: [&str; 6] = [
    "-Wall",
    "-Wextra",
    "-Wconversion",
    "-Wshadow",
    "-pedantic",
    "-Werror",
];

/// The project's folder.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// A model of `models/`.
pub fn shipped(name: &str) -> ReducedModel {
    romc::artifact::read(&root().join(format!("models/{name}.json"))).expect("a shipped model")
}

/// The model with other inputs: torques at the links, forces in the world's axes.
pub fn with_losses(model: ReducedModel) -> ReducedModel {
    let actuators = Actuators::of_leg([1.0, 0.6, 0.6], [0.2; 3], [0.01; 3]);
    let builder = model.into_builder().actuators(Some(actuators));
    let builder = builder.wrench_frame(WrenchFrame::World);
    builder.build().expect("a sound model")
}

/// Runs a command and returns its output, which must be a success.
pub fn succeed(command: &mut Command) -> Output {
    let output = command
        .output()
        .unwrap_or_else(|error| panic!("{command:?}: {error}"));
    assert!(
        output.status.success(),
        "{command:?}\n{}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
    output
}
