//! `romc inspect`: what a recording or a model holds, and what is implausible in it.

use std::path::Path;

use serde_json::{Value, json};

use super::Answer;
use super::args::InspectArguments;
use super::{inspect_model, inspect_recording, robot};
use crate::robot::Robot;
use crate::{Error, artifact, recording};

/// Inspects each file: those that end in `.json` as models, all others as recordings.
///
/// # Errors
/// Whatever reading the file refuses.
pub fn run(arguments: &InspectArguments) -> Result<Answer, Error> {
    let robot = robot::chosen(&arguments.robot)?;
    let answers = (arguments.files.iter())
        .map(|path| inspect(path, robot))
        .collect::<Result<Vec<_>, _>>()?;
    let texts: Vec<String> = answers.iter().map(|answer| answer.text.clone()).collect();
    let files: Vec<Value> = answers.into_iter().map(|answer| answer.json).collect();
    Ok(Answer {
        text: texts.join("\n"),
        json: json!({ "command": "inspect", "files": files }),
    })
}

fn inspect(path: &Path, robot: &Robot) -> Result<Answer, Error> {
    if artifact::is_standard_input(path) || path.extension().is_some_and(|e| e == "json") {
        inspect_model::describe(path, &artifact::read(path)?)
    } else {
        inspect_recording::describe(&recording::read(path)?, robot)
    }
}
