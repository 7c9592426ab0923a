//! `romc inspect`: what a recording or a model holds, and what is implausible in it.

use serde_json::json;

use super::Answer;
use super::args::InspectArguments;
use super::destination::{Format, Inputs};
use super::output::{note, reader, shown, write_file};
use super::{inspect_model, inspect_recording, robot};
use crate::recording::Clocks;
use crate::recording::foreign::guess::guess;
use crate::robot::Robot;
use crate::{Error, artifact};

/// Endings of models; those of other tools are refused with the lines that convert them.
const OF_MODELS: [&str; 9] = [
    "json",
    "safetensors",
    "pt",
    "pth",
    "ckpt",
    "keras",
    "onnx",
    "tflite",
    "msgpack",
];

/// Inspects each file: those with an ending of models as such, all others as recordings.
pub fn run(arguments: &InspectArguments) -> Result<Answer, Error> {
    let robot = robot::chosen(&arguments.robot)?;
    if arguments.guess {
        return guessed(arguments, robot);
    }
    let reader = reader(&arguments.reading, Clocks::Recorded)?.for_robot(robot);
    let (mut texts, mut files) = (Vec::new(), Vec::new());
    for path in &arguments.files {
        let is_model = artifact::is_standard_input(path)
            || OF_MODELS
                .iter()
                .any(|of| path.extension().is_some_and(|e| e == *of));
        let Answer { text, json, .. } = match is_model {
            true => inspect_model::describe(path, &artifact::read(path)?)?,
            false => inspect_recording::describe(&reader.read(path)?, robot)?,
        };
        texts.push(text);
        files.push(json);
    }
    Ok(Answer::new(texts.join("\n"), json!({ "files": files })))
}

fn guessed(arguments: &InspectArguments, robot: &Robot) -> Result<Answer, Error> {
    let [log] = &arguments.files[..] else {
        return Err(Error::NotOne {
            found: format!("{} files", arguments.files.len()),
            expected: "log to guess a map of",
        });
    };
    Inputs::default()
        .and([log])
        .and_robot(Some(&arguments.robot))
        .check_output(arguments.output.as_deref(), Format::TOML, arguments.force)?;
    let guess = guess(log, robot)?;
    let outcome = match &guess.outcome {
        Ok(samples) => format!("read by this map, the log has {samples} samples"),
        Err(reason) => format!("read by this map: {reason}"),
    };
    let mut text = guess.text.clone();
    match &arguments.output {
        Some(path) => {
            write_file(path, guess.text.as_bytes(), arguments.force)?;
            text = format!("{}: a first map; {outcome}\n", path.display());
        }
        None => note(&outcome),
    }
    guess.notes.iter().for_each(|text| note(text));
    let json = json!({
        "file": log.display().to_string(),
        "map": guess.text,
        "missing": guess.missing,
        "notes": guess.notes,
        "samples": guess.outcome.as_ref().ok(),
        "refused": guess.outcome.as_ref().err(),
        "output": shown(&arguments.output),
    });
    Ok(Answer::new(text, json))
}
