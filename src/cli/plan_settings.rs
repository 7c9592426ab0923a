//! Settings of the controller for a plan: a file next to it, which `romc plan` writes and other commands read.

use std::collections::BTreeMap;

use super::*;
use crate::mpc::interface::{SETTINGS, Settings};
use crate::mpc::{ControlError, MpcSettings};

/// `PLAN.settings.toml` of `PLAN.csv`, `PLAN.csv.gz` or `PLAN.mcap`.
pub(super) fn path_beside(plan: &Path) -> PathBuf {
    let name = plan.file_name().unwrap_or_default().to_string_lossy();
    let endings = [".gz", ".csv", ".mcap"];
    let stem = endings.iter().fold(&*name, |name, ending| {
        name.strip_suffix(ending).unwrap_or(name)
    });
    plan.with_file_name(format!("{stem}.settings.toml"))
}

/// The settings next to a recording; the usual ones where there is no file.
pub(super) fn beside(recording: &Path) -> Result<MpcSettings, Error> {
    let path = path_beside(recording);
    let usual = MpcSettings::default();
    if !path.is_file() {
        return Ok(usual);
    }
    let numbers: BTreeMap<String, f64> = read_settings(&path, |_| Ok(()))?;
    let mut settings = Settings::from(&usual);
    for (name, number) in numbers {
        if !settings.set(&name, number) {
            let message = format!("found `{name}`, expected names of settings of the controller");
            return Err(Error::refused(&path, message));
        }
    }
    let refused = |error: ControlError| Error::refused(&path, error.to_string());
    settings.to_mpc().map_err(refused)
}

/// The file for a plan: the settings that differ from the usual ones.
pub(super) fn text() -> String {
    let both = [MpcSettings::of_plans(), MpcSettings::default()];
    let [own, usual] = both.map(|settings| Settings::from(&settings).numbers());
    let mut text = "# Settings of the controller for the plan of the same name. `romc mpc` and `romc compile --plan`\n\
                    # read them. In flight, keep the torques of the commands: they swing the legs.\n"
        .to_owned();
    for ((setting, own), usual) in SETTINGS.iter().zip(own).zip(usual) {
        if own != usual {
            text += &format!("{} = {own:?} # {}\n", setting.name, setting.text);
        }
    }
    text
}
