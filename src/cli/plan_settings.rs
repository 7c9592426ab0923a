//! Settings of the controller for a plan: a file next to it, which `romc plan` writes and other commands read.

use super::*;
use crate::mpc::interface::{Accepts, SETTINGS, Setting, Settings};

/// `PLAN.settings.toml` of `PLAN.csv`, `PLAN.csv.gz` or `PLAN.mcap`.
pub(super) fn path_for(plan: &Path) -> PathBuf {
    let mut stem = plan.to_owned();
    for ending in ["gz", "csv", "mcap"] {
        if stem
            .extension()
            .is_some_and(|own| own.eq_ignore_ascii_case(ending))
        {
            stem.set_extension("");
        }
    }
    let mut path = stem.into_os_string();
    path.push(".settings.toml");
    path.into()
}

/// The settings next to a recording, the others default; the usual ones where there is no file.
pub(super) fn read_for(recording: &Path, usual: &MpcSettings) -> Result<MpcSettings> {
    let path = path_for(recording);
    if !path.is_file() {
        return Ok(*usual);
    }
    let numbers: BTreeMap<String, f64> = read_settings(&path, |_| Ok(()))?;
    let mut settings = Settings::from(&MpcSettings::default());
    for (name, number) in numbers {
        let is_whole = SETTINGS
            .iter()
            .any(|of| of.name == name && of.kind == "i32");
        if is_whole && number.fract() != 0.0 {
            let message = format!("`{name}` is {number}, expected a whole number");
            return Err(Error::refused(&path, message));
        }
        if !settings.set(&name, number) {
            let message = format!("found `{name}`, expected names of settings of the controller");
            return Err(Error::refused(&path, message));
        }
    }
    let refused = |error: ControlError| Error::refused(&path, error.to_string());
    settings.to_mpc().map_err(refused)
}

/// Inputs count less than along a recorded jump, which brings the apex nearer. How much of them arrives is estimated.
pub(super) fn of_jumps(robot: &Robot) -> MpcSettings {
    MpcSettings {
        input_weight: 8.0,
        effectiveness: Some(1.0),
        drives: Drives::of(robot),
        ..MpcSettings::default()
    }
}

/// The file of settings for a plan: those that differ from the usual ones, joint PD, torques in flight.
pub(super) fn text(settings: &MpcSettings) -> String {
    let both = [settings, &MpcSettings::default()];
    let [own, usual] = both.map(|settings| Settings::from(settings).numbers());
    let mut text = "# Settings of the controller for the plan of the same name. `romc mpc` and `romc compile --plan`\n\
                    # read them.\n"
        .to_owned();
    for ((setting, own), usual) in SETTINGS.iter().zip(own).zip(usual) {
        if own != usual || setting.name.starts_with("drive_") || setting.name == "flight_torque" {
            text += &format!("{} = {own:?} # {}\n", setting.name, words(setting));
        }
    }
    text
}

/// What a setting is; a choice by its numbers, because names of C mean nothing in the file.
fn words(setting: &Setting) -> String {
    match (setting.text.split_once("UPPER_"), setting.accepts) {
        (Some((before, _)), Accepts::Whole(_, _, choices)) => format!("{before}{choices}"),
        _ => setting.text.to_owned(),
    }
}

/// Whether a file has this text already, as after a plan of the same name in another format.
pub(super) fn is_there(path: &Path, settings: &MpcSettings) -> bool {
    std::fs::read(path).is_ok_and(|found| found == text(settings).as_bytes())
}
