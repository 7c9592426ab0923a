//! `romc train --from`: a trained model refined on recordings of hardware, or of another robot.

use std::path::Path;

use super::args::{TrainArguments, TrainSettings};
use super::prepared_recordings::RecordedSets;
use super::robot::chosen;
use super::*;
use crate::robot::Actuators;
use crate::robot_file::read_actuators;
use crate::train::{Origin, Refined, refine_from};

pub(super) fn run(arguments: &TrainArguments, from: &Path) -> Result<Answer> {
    let settings = own_settings(arguments, from)?;
    let reading = &arguments.reading;
    Inputs::reading(reading)
        .and([from])
        .and(&arguments.recordings)
        .and_robot(settings.robot.as_deref())
        .and(&settings.actuators)
        .check_output(
            reading.file_of_model(&arguments.output),
            Format::MODEL,
            arguments.force,
        )?;
    let model = reading.model(from)?;
    let robot = match &settings.robot {
        Some(name) => chosen(name)?,
        None => model.robot()?,
    };
    let actuators = match settings.actuators.as_deref() {
        None => model.actuators().cloned(),
        Some("none") => None,
        Some("identify") => {
            let message = "found `--actuators identify` with --from, expected a file of `romc identify`, or none";
            return Err(Error::refused(from, message));
        }
        Some(path) => Some(read_actuators(Path::new(path), Some(robot))?),
    };
    let is_other = model.robot().is_ok_and(|own| own.name != robot.name);
    if is_other && settings.actuators.is_none() && actuators.is_some() {
        note(
            "joint friction, rotor inertia and moments of the legs are those of the model's robot; --actuators replaces \
             them",
        );
    }
    let legs = |of: Option<&Actuators>| of.is_some_and(|known| known.legs.is_some());
    if legs(actuators.as_ref()) != legs(model.actuators()) {
        note(
            "torques that carry and move the links of legs on the ground are subtracted in one of model and --actuators, \
             and not in the other: inputs differ from those of the model's training",
        );
    }
    let sets = [&arguments.recordings[..], &[], &[]];
    let mut recorded = RecordedSets::whole(sets, &arguments.reading, &settings, robot)?;
    note_repeated(&recorded.files());
    let read = recorded.read();
    recorded.report_findings();
    read?;
    let mut command = format!(
        "romc train --from {} {}",
        quoted(from),
        quoted_all(&arguments.recordings)
    );
    command += &(settings.as_flags() + &arguments.reading.as_flags());
    let name = arguments.name.iter();
    command.extend(name.map(|name| format!(" --name {}", quoted_text(name))));
    command += &format!(" --output {}", quoted(&arguments.output));
    let origin = Origin::new(command, &arguments.recordings);
    let training = &recorded.sets[0].recordings;
    let mut refined = refine_from(&model, training, robot, actuators, &origin)?;
    let name = named(arguments.name.as_deref(), &arguments.output);
    refined.model = refined.model.into_builder().name(name).build()?;
    reading.write_model(&arguments.output, &refined.model, arguments.force)?;
    Ok(answer(arguments, from, &refined))
}

/// Settings of the recordings; the others are those of the model.
fn own_settings(arguments: &TrainArguments, from: &Path) -> Result<TrainSettings> {
    let given = &arguments.settings;
    let own = TrainSettings {
        robot: given.robot.clone(),
        actuators: given.actuators.clone(),
        leave_out_implausible: given.leave_out_implausible,
        accelerations: given.accelerations,
        smooth: given.smooth.clone(),
        smooth_rows: given.smooth_rows,
        ..TrainSettings::default()
    };
    let flags = given.as_flags();
    let own_flags = own.as_flags();
    let is_foreign = |flag: &&str| flag.starts_with("--") && !own_flags.contains(*flag);
    let of_training = flags.split_whitespace().find(is_foreign);
    let others = [
        (
            *given != own,
            of_training.unwrap_or("a setting of a training"),
        ),
        (!arguments.validation.is_empty(), "--validation"),
        (!arguments.test.is_empty(), "--test"),
        (arguments.split.is_some(), "--split"),
        (arguments.config.is_some(), "--config"),
    ];
    match others.into_iter().find(|(is_given, _)| *is_given) {
        None => Ok(own),
        Some((_, name)) => {
            let message = format!(
                "found {name} with --from, expected --robot, --actuators and options for reading alone: encoder, library and \
                 phases are those of the model"
            );
            Err(Error::refused(from, message))
        }
    }
}

fn answer(arguments: &TrainArguments, from: &Path, refined: &Refined) -> Answer {
    let table = Table::of(&refined.coefficients)
        .column("phase", "", |of| &of.phase)
        .column("equation", "", |of| format!("ddz{}", of.coordinate))
        .column("term", "", |of| &of.term)
        .column("before", "scaled", |of| of.before)
        .column("after", "scaled", |of| of.after)
        .column("standard errors", "", |of| {
            format!("{:.1}", of.standard_errors)
        })
        .table();
    let output = arguments.output.display().to_string();
    let mut text = format!("{output}: {} refined\n\n{table}\n", from.display());
    text += &lines("multiplied as a whole: ", &refined.multiplied);
    text += &lines("unchanged: ", &refined.unchanged);
    let json = json!({
        "from": from.display().to_string(),
        "output": output,
        "coefficients": refined.coefficients,
        "multiplied": refined.multiplied,
        "unchanged": refined.unchanged,
    });
    Answer::new(text, json)
}
