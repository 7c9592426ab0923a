//! `romc identify`: gravity, mass and the joints' losses from recordings.

use std::fmt::Write as _;
use std::path::PathBuf;

use serde_json::{Value, json};

use super::Answer;
use super::args::IdentifyArguments;
use super::destination::{Format, Inputs, check_output};
use super::output::{note_repeated, read_with, reader, spinner, write_file};
use super::robot;
use crate::Error;
use crate::files::Overwrite;
use crate::identify::{Identification, PerKind, identify};
use crate::recording::Clocks;
use crate::robot::Robot;
use crate::typeset::{Table, significant};

/// Identifies the robot and writes the file, if one is asked for.
///
/// # Errors
/// [`Error::Robot`] for an unknown name, [`Error::Recording`] for a file that cannot be read,
/// [`Error::Identify`] for recordings that do not say enough, [`Error::Exists`] for the output.
pub fn run(arguments: &IdentifyArguments) -> Result<Answer, Error> {
    let overwrite = Overwrite::when_forced(arguments.force);
    let inputs = Inputs::default()
        .and(&arguments.recordings)
        .and(&arguments.reading.columns)
        .and_robot(Some(&arguments.robot));
    check_output(
        arguments.output.as_deref(),
        Format::Toml,
        &inputs,
        overwrite,
    )?;
    let robot = robot::chosen(&arguments.robot)?;
    let recordings = read_with(
        &reader(&arguments.reading, Clocks::Recorded)?,
        &arguments.recordings,
    )?;
    let paths = arguments.recordings.iter().map(PathBuf::as_path);
    note_repeated(&[("recordings", paths.collect())]);
    let progress = spinner("identifying");
    let found = identify(&recordings, robot);
    progress.finish_and_clear();
    let found = found?;
    let mut text = text(&found, robot, recordings.len());
    if let Some(path) = &arguments.output {
        write_file(path, found.to_toml().as_bytes(), overwrite)?;
        let _ = writeln!(text, "\nwritten: {}", path.display());
    }
    Ok(Answer {
        text,
        json: report(&found, arguments),
    })
}

fn text(found: &Identification, robot: &Robot, recordings: usize) -> String {
    let error = &found.standard_error;
    let mut body = Table::new(["quantity", "unit", "value", "standard error"]);
    for (name, unit, value, error) in [
        ("gravity", "m/s^2", found.gravity_m_s2, error.gravity_m_s2),
        ("mass", "kg", found.mass_kg, error.mass_kg),
        (
            "torque to motion",
            "ms",
            1e3 * found.delay_s,
            1e3 * error.delay_s,
        ),
    ] {
        body.row([
            name.to_owned(),
            unit.to_owned(),
            significant(value),
            two_digits(error),
        ]);
    }
    let mut joints = Table::new(["losses of a joint", "unit", "hx", "hy", "kn"]);
    for (name, unit, values, errors) in [
        (
            "viscous friction",
            "N m s/rad",
            found.viscous(),
            error.viscous_nm_s_rad,
        ),
        ("dry friction", "N m", found.dry(), error.dry_nm),
        ("armature", "kg m^2", found.armature(), error.armature_kg_m2),
    ] {
        let mut row = vec![name.to_owned(), unit.to_owned()];
        let pairs = values.to_array().into_iter().zip(errors.to_array());
        row.extend(pairs.map(|(value, error)| with_error(value, error)));
        joints.row(row);
    }
    let (of, legs) = (&found.legs, &error.legs);
    let mut links = Table::new(["one leg", "unit", "value", "standard error"]);
    for (name, unit, value, error) in [
        (
            "first moment beside the hip",
            "kg m",
            of.side_kg_m,
            legs.side_kg_m,
        ),
        (
            "first moment of the thigh",
            "kg m",
            of.thigh_kg_m,
            legs.thigh_kg_m,
        ),
        (
            "first moment of the calf",
            "kg m",
            of.calf_kg_m,
            legs.calf_kg_m,
        ),
        (
            "second moment of the thigh",
            "kg m^2",
            of.thigh_kg_m2,
            legs.thigh_kg_m2,
        ),
        (
            "second moment of the calf",
            "kg m^2",
            of.calf_kg_m2,
            legs.calf_kg_m2,
        ),
    ] {
        links.row([
            name.to_owned(),
            unit.to_owned(),
            significant(value),
            two_digits(error),
        ]);
    }
    let alone = &found.force_alone;
    let mut fits = Table::new([
        "trunk's acceleration by",
        "R^2 x",
        "R^2 z",
        "gravity",
        "mass, kg",
    ]);
    for (name, r2, gravity, mass) in [
        (
            "the feet's forces alone",
            alone.r2,
            alone.gravity_m_s2,
            alone.mass_kg,
        ),
        (
            "losses and legs too",
            found.r2,
            found.gravity_m_s2,
            found.mass_kg,
        ),
    ] {
        fits.row([
            name.to_owned(),
            format!("{:.3}", r2.x),
            format!("{:.3}", r2.z),
            format!("{gravity:.2}"),
            format!("{mass:.2}"),
        ]);
    }
    let mut text = format!(
        "{} from {recordings} recordings: {} samples with feet on the ground, {} in flight\n\n\
         {body}\n{joints}\n{links}\n{fits}",
        robot.name(),
        found.samples.contact,
        found.samples.flight
    );
    for note in &found.notes {
        let _ = writeln!(text, "\nnote: {note}");
    }
    text
}

fn with_error(value: f64, error: f64) -> String {
    format!("{} ± {}", significant(value), two_digits(error))
}

fn two_digits(value: f64) -> String {
    if !value.is_finite() {
        return "unknown".to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    let before_point = value.abs().log10().floor() as i32 + 1;
    format!("{value:.*}", usize::try_from(2 - before_point).unwrap_or(0))
}

/// The keys that other programs rely on; see `docs/identify.md`.
fn report(found: &Identification, arguments: &IdentifyArguments) -> Value {
    let error = &found.standard_error;
    let kinds = |values: PerKind| json!({"hx": values.hx, "hy": values.hy, "kn": values.kn});
    let alone = &found.force_alone;
    json!({
        "command": "identify",
        "robot": found.robot,
        "recordings": arguments.recordings.iter().map(|path| path.display().to_string())
            .collect::<Vec<_>>(),
        "gravity_m_s2": found.gravity_m_s2,
        "mass_kg": found.mass_kg,
        "delay_s": found.delay_s,
        "viscous_nm_s_rad": kinds(found.viscous()),
        "dry_nm": kinds(found.dry()),
        "armature_kg_m2": kinds(found.armature()),
        "legs": found.legs,
        "standard_error": {
            "gravity_m_s2": error.gravity_m_s2,
            "mass_kg": error.mass_kg,
            "delay_s": error.delay_s,
            "viscous_nm_s_rad": kinds(error.viscous_nm_s_rad),
            "dry_nm": kinds(error.dry_nm),
            "armature_kg_m2": kinds(error.armature_kg_m2),
            "legs": error.legs,
        },
        "r2": { "force": alone.r2, "losses": found.r2 },
        "force_alone": { "gravity_m_s2": alone.gravity_m_s2, "mass_kg": alone.mass_kg },
        "samples": found.samples,
        "notes": found.notes,
        "output": arguments.output.as_ref().map(|path| path.display().to_string()),
    })
}
