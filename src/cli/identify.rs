//! `romc identify`: gravity, mass and the joints' losses from recordings.

use super::*;
use crate::identify::{Identification, identify};

pub(super) fn run(arguments: &IdentifyArguments) -> Result<Answer> {
    Inputs::reading(&arguments.reading)
        .and(&arguments.recordings)
        .and_robot(Some(&arguments.robot))
        .check_output(arguments.output.as_deref(), Format::TOML, arguments.force)?;
    let robot = robot::chosen(&arguments.robot)?;
    let reader = reader(&arguments.reading, Clocks::Recorded, Some(robot))?;
    let recordings = read_with(&reader, &arguments.recordings)?;
    let paths = arguments.recordings.iter().map(PathBuf::as_path);
    note_repeated(&[("recordings", paths.collect())]);
    let progress = spinner("identifying");
    let found = identify(&recordings, robot);
    progress.finish_and_clear();
    let found = found?;
    let mut text = text(&found, robot, recordings.len());
    if let Some(path) = &arguments.output {
        write_file(path, found.to_toml().as_bytes(), arguments.force)?;
        let _ = writeln!(text, "\nwritten: {}", path.display());
    }
    Ok(Answer::new(text, report(&found, arguments)))
}

/// Tables of the parameters identified from this number of recordings.
pub fn text(found: &Identification, robot: &Robot, recordings: usize) -> String {
    let error = &found.standard_error;
    let delays = [found.delay_s, error.delay_s].map(|delay| 1e3 * delay);
    let body = [
        ("gravity", "m/s^2", [found.gravity_m_s2, error.gravity_m_s2]),
        ("mass", "kg", [found.mass_kg, error.mass_kg]),
        ("torque to motion", "ms", delays),
    ];
    let body = quantities("quantity", body);
    let [viscous, dry, armature] = found.losses();
    let viscous = [viscous, error.viscous_nm_s_rad];
    let losses = [
        ("viscous friction", "N m s/rad", viscous),
        ("dry friction", "N m", [dry, error.dry_nm]),
        ("rotor inertia", "kg m^2", [armature, error.armature_kg_m2]),
    ];
    let pair = |value, error| format!("{} ± {}", significant(value), two_digits(error));
    let joints = Table::of(losses)
        .column("joint friction and inertia", "", |(name, ..)| *name)
        .column("unit", "", |(_, unit, _)| *unit)
        .column("hx", "", |(.., [value, error])| pair(value.hx, error.hx))
        .column("hy", "", |(.., [value, error])| pair(value.hy, error.hy))
        .column("kn", "", |(.., [value, error])| pair(value.kn, error.kn))
        .table();
    let moments: [(&str, &str, fn(&LegMoments) -> f64); 5] = [
        ("first moment, sideways from the hip", "kg m", |l| {
            l.side_kg_m
        }),
        ("first moment of the thigh", "kg m", |l| l.thigh_kg_m),
        ("first moment of the calf", "kg m", |l| l.calf_kg_m),
        ("second moment of the thigh", "kg m^2", |l| l.thigh_kg_m2),
        ("second moment of the calf", "kg m^2", |l| l.calf_kg_m2),
    ];
    let moments = moments.map(|(name, unit, of)| (name, unit, [of(&found.legs), of(&error.legs)]));
    let links = quantities("one leg", moments);
    let alone = &found.force_alone;
    let by_forces = [alone.gravity_m_s2, alone.mass_kg];
    let by_all = [found.gravity_m_s2, found.mass_kg];
    let fits = [
        ("forces of the feet alone", alone.r2, by_forces),
        ("with friction, inertia and legs", found.r2, by_all),
    ];
    let fits = Table::of(fits)
        .column("trunk's acceleration by", "", |(name, ..)| *name)
        .column("R^2 x", "", |(_, r2, _)| format!("{:.3}", r2.x))
        .column("R^2 z", "", |(_, r2, _)| format!("{:.3}", r2.z))
        .column("gravity", "", |(.., [gravity, _])| format!("{gravity:.2}"))
        .column("mass", "kg", |(.., [_, mass])| format!("{mass:.2}"))
        .table();
    let notes = lines("\nnote: ", &found.notes);
    format!(
        "{} from {recordings} recordings: {} samples with feet on the ground, {} in flight\n\n\
         {body}\n{joints}\n{links}\n{fits}{notes}",
        robot.name, found.samples.contact, found.samples.flight
    )
}

fn quantities<const N: usize>(what: &str, rows: [(&str, &str, [f64; 2]); N]) -> Table {
    Table::of(rows)
        .column(what, "", |(name, ..)| *name)
        .column("unit", "", |(_, unit, _)| *unit)
        .column("value", "", |(.., [value, _])| significant(*value))
        .column("standard error", "", |(.., [_, error])| two_digits(*error))
        .table()
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

fn report(found: &Identification, arguments: &IdentifyArguments) -> Value {
    let alone = &found.force_alone;
    let [viscous, dry, armature] = found.losses();
    json!({
        "robot": found.robot,
        "recordings": names(&arguments.recordings),
        "gravity_m_s2": found.gravity_m_s2,
        "mass_kg": found.mass_kg,
        "delay_s": found.delay_s,
        "viscous_nm_s_rad": viscous,
        "dry_nm": dry,
        "armature_kg_m2": armature,
        "legs": found.legs,
        "standard_error": found.standard_error,
        "r2": { "force": alone.r2, "losses": found.r2 },
        "force_alone": { "gravity_m_s2": alone.gravity_m_s2, "mass_kg": alone.mass_kg },
        "samples": found.samples,
        "notes": found.notes,
        "output": shown(&arguments.output),
    })
}
