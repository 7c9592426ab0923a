//! An identification as a TOML file.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use super::error::{IdentifyError, IdentifyFault};
use super::identification::{Fit, Identification, Legs, PerKind};
use crate::files::{Located, Place};
use crate::robot::JOINT_NAMES;

impl Identification {
    /// The file's text: SI units, `[actuators]` in the order of the state's joints.
    pub fn to_toml(&self) -> String {
        let error = &self.standard_error;
        let mut out = String::from(
            "# What `romc identify` found in recordings. SI units: m, s, kg, N m, rad.\n",
        );
        for note in &self.notes {
            let _ = writeln!(out, "# {}", note.replace(['\n', '\r'], " "));
        }
        let _ = writeln!(out, "robot = {:?}", self.robot);
        scalars(&mut out, self.gravity_m_s2, self.mass_kg, self.delay_s);
        let _ = writeln!(out, "\n# {}", JOINT_NAMES.join(" "));
        let _ = writeln!(out, "[actuators]");
        for (name, values) in [
            ("viscous", &self.actuators.viscous),
            ("dry", &self.actuators.dry),
            ("armature", &self.actuators.armature),
        ] {
            let listed: Vec<String> = values.iter().map(|value| number(*value)).collect();
            let _ = writeln!(out, "{name} = [{}]", listed.join(", "));
        }
        legs(&mut out, "legs", &self.legs);
        let _ = writeln!(out, "\n[standard_error]");
        scalars(&mut out, error.gravity_m_s2, error.mass_kg, error.delay_s);
        for (name, values) in [
            ("viscous_nm_s_rad", error.viscous_nm_s_rad),
            ("dry_nm", error.dry_nm),
            ("armature_kg_m2", error.armature_kg_m2),
        ] {
            let PerKind { hx, hy, kn } = values;
            let [hx, hy, kn] = [hx, hy, kn].map(number);
            let _ = writeln!(out, "{name} = {{ hx = {hx}, hy = {hy}, kn = {kn} }}");
        }
        legs(&mut out, "standard_error.legs", &error.legs);
        fit(&mut out, "r2", self.r2);
        let _ = writeln!(out, "\n[force_alone]");
        let _ = writeln!(
            out,
            "gravity_m_s2 = {}",
            number(self.force_alone.gravity_m_s2)
        );
        let _ = writeln!(out, "mass_kg = {}", number(self.force_alone.mass_kg));
        fit(&mut out, "force_alone.r2", self.force_alone.r2);
        let _ = writeln!(out, "\n[samples]");
        let _ = writeln!(out, "contact = {}", self.samples.contact);
        let _ = writeln!(out, "flight = {}", self.samples.flight);
        out
    }

    /// Reads a file that [`Identification::to_toml`] wrote; its notes are comments and stay there.
    ///
    /// # Errors
    /// [`IdentifyError::File`] with line and column of a fault of syntax, or with the entry whose
    /// value no robot has.
    pub fn read(path: &Path) -> Result<Self, IdentifyError> {
        let file = path.display().to_string();
        let text = fs::read_to_string(path)
            .map_err(|source| at(&file, Place::Whole, IdentifyFault::Read(source)))?;
        Self::from_toml(&file, &text)
    }

    /// Reads the text of such a file; `file` stands for it in messages.
    ///
    /// # Errors
    /// As [`Identification::read`].
    pub fn from_toml(file: &str, text: &str) -> Result<Self, IdentifyError> {
        let found: Self = toml::from_str(text).map_err(|error| {
            let place = match error.span() {
                None => Place::Whole,
                Some(span) => Place::of_byte(text, span.start),
            };
            let fault = IdentifyFault::Syntax(error.message().to_owned());
            at(file, place, fault)
        })?;
        found.require_plausible(file)?;
        Ok(found)
    }

    fn require_plausible(&self, file: &str) -> Result<(), IdentifyError> {
        let refuse = |entry: String, found: f64, expected: &'static str| {
            let fault = IdentifyFault::Value { found, expected };
            Err(at(file, Place::Entry(entry.into()), fault))
        };
        for (name, value) in [
            ("gravity_m_s2", self.gravity_m_s2),
            ("mass_kg", self.mass_kg),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return refuse(name.to_owned(), value, "a finite number above 0");
            }
        }
        if !self.delay_s.is_finite() {
            return refuse("delay_s".to_owned(), self.delay_s, "a finite number");
        }
        for (name, values) in [
            ("viscous", &self.actuators.viscous),
            ("dry", &self.actuators.dry),
            ("armature", &self.actuators.armature),
        ] {
            for (joint, value) in JOINT_NAMES.iter().zip(values) {
                if !(value.is_finite() && *value >= 0.0) {
                    let entry = format!("actuators.{name}, joint {joint}");
                    return refuse(entry, *value, "a finite number, at least 0");
                }
            }
        }
        Ok(())
    }
}

fn at(file: &str, place: Place, fault: IdentifyFault) -> IdentifyError {
    IdentifyError::File(Located::new(file, place, fault))
}

fn scalars(out: &mut String, gravity_m_s2: f64, mass_kg: f64, delay_s: f64) {
    for (name, value) in [
        ("gravity_m_s2", gravity_m_s2),
        ("mass_kg", mass_kg),
        ("delay_s", delay_s),
    ] {
        let _ = writeln!(out, "{name} = {}", number(value));
    }
}

fn legs(out: &mut String, table: &str, legs: &Legs) {
    let _ = writeln!(out, "\n[{table}]");
    for (name, value) in [
        ("side_kg_m", legs.side_kg_m),
        ("thigh_kg_m", legs.thigh_kg_m),
        ("calf_kg_m", legs.calf_kg_m),
        ("thigh_kg_m2", legs.thigh_kg_m2),
        ("calf_kg_m2", legs.calf_kg_m2),
    ] {
        let _ = writeln!(out, "{name} = {}", number(value));
    }
}

fn fit(out: &mut String, table: &str, fit: Fit) {
    let _ = writeln!(out, "\n[{table}]");
    let _ = writeln!(out, "x = {}", number(fit.x));
    let _ = writeln!(out, "z = {}", number(fit.z));
}

/// Six significant digits, spelled as TOML has floating-point numbers.
fn number(value: f64) -> String {
    if value.is_finite() {
        let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
        format!("{rounded:?}")
    } else {
        format!("{value:?}").to_lowercase()
    }
}
