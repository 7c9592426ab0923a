//! An identification as a TOML file.

use std::fmt::Write as _;
use std::path::Path;

use super::error::IdentifyError;
use super::identification::{Fit, Identification, Legs, Samples};
use crate::files::{Fault, Located, Place, read_toml};
use crate::robot::JOINT_NAMES;

impl Identification {
    /// The file's text: SI units, `[actuators]` in the order of the state's joints.
    pub fn to_toml(&self) -> String {
        let (error, alone) = (&self.standard_error, &self.force_alone);
        let mut out = String::from(
            "# What `romc identify` found in recordings. SI units: m, s, kg, N m, rad.\n",
        );
        for note in &self.notes {
            let _ = writeln!(out, "# {}", note.replace(['\n', '\r'], " "));
        }
        let _ = writeln!(out, "robot = {:?}", self.robot);
        numbers(&mut out, &gravity_and_mass(self.gravity_m_s2, self.mass_kg));
        numbers(&mut out, &[("delay_s", self.delay_s)]);
        let _ = writeln!(out, "\n# {}\n[actuators]", JOINT_NAMES.join(" "));
        for (name, values) in self.actuators.named() {
            let _ = writeln!(out, "{name} = [{}]", values.map(number).join(", "));
        }
        table(&mut out, "legs", &legs(&self.legs));
        table(
            &mut out,
            "standard_error",
            &gravity_and_mass(error.gravity_m_s2, error.mass_kg),
        );
        numbers(&mut out, &[("delay_s", error.delay_s)]);
        for (name, kinds) in [
            ("viscous_nm_s_rad", error.viscous_nm_s_rad),
            ("dry_nm", error.dry_nm),
            ("armature_kg_m2", error.armature_kg_m2),
        ] {
            let [hx, hy, kn] = kinds.to_array().map(number);
            let _ = writeln!(out, "{name} = {{ hx = {hx}, hy = {hy}, kn = {kn} }}");
        }
        table(&mut out, "standard_error.legs", &legs(&error.legs));
        table(&mut out, "r2", &fit(self.r2));
        table(
            &mut out,
            "force_alone",
            &gravity_and_mass(alone.gravity_m_s2, alone.mass_kg),
        );
        table(&mut out, "force_alone.r2", &fit(alone.r2));
        let Samples { contact, flight } = self.samples;
        let _ = writeln!(out, "\n[samples]\ncontact = {contact}\nflight = {flight}");
        out
    }

    /// Reads a file that [`Identification::to_toml`] wrote; its notes are comments and stay there.
    ///
    /// # Errors
    /// [`IdentifyError::File`] with line and column of a fault of syntax, or with the entry whose value no robot has.
    pub fn read(path: &Path) -> Result<Self, IdentifyError> {
        let file = path.display().to_string();
        let action = "read";
        let refused = |source| -> Located<Fault> {
            Located::new(&file, Place::Whole, Fault::Io { action, source })
        };
        Self::from_toml(&file, &read_toml(path).map_err(refused)?)
    }

    /// Reads the text of such a file; `file` stands for it in messages.
    ///
    /// # Errors
    /// As [`Identification::read`].
    pub fn from_toml(file: &str, text: &str) -> Result<Self, IdentifyError> {
        let found: Self = toml::from_str(text).map_err(|error| {
            let of_byte = |span: std::ops::Range<usize>| Place::of_byte(text, span.start);
            let place = error.span().map_or(Place::Whole, of_byte);
            Located::<Fault>::new(file, place, Fault::Text(error.message().into()))
        })?;
        found.require_plausible(file)?;
        Ok(found)
    }

    fn require_plausible(&self, file: &str) -> Result<(), IdentifyError> {
        let refuse = |entry: String, found: f64, expected: &str| {
            Err(Located::at(file, entry, found.to_string(), expected).into())
        };
        for (name, value) in gravity_and_mass(self.gravity_m_s2, self.mass_kg) {
            if !(value.is_finite() && value > 0.0) {
                return refuse(name.to_owned(), value, "a finite number above 0");
            }
        }
        if !self.delay_s.is_finite() {
            return refuse("delay_s".to_owned(), self.delay_s, "a finite number");
        }
        if let Some((name, joint, value)) = self.actuators.unusable() {
            let entry = format!("actuators.{name}, joint {}", JOINT_NAMES[joint]);
            return refuse(entry, value, "a finite number, at least 0");
        }
        Ok(())
    }
}

type Entry = (&'static str, f64);

fn gravity_and_mass(gravity_m_s2: f64, mass_kg: f64) -> [Entry; 2] {
    [("gravity_m_s2", gravity_m_s2), ("mass_kg", mass_kg)]
}

fn legs(legs: &Legs) -> [Entry; 5] {
    [
        ("side_kg_m", legs.side_kg_m),
        ("thigh_kg_m", legs.thigh_kg_m),
        ("calf_kg_m", legs.calf_kg_m),
        ("thigh_kg_m2", legs.thigh_kg_m2),
        ("calf_kg_m2", legs.calf_kg_m2),
    ]
}

fn fit(fit: Fit) -> [Entry; 2] {
    [("x", fit.x), ("z", fit.z)]
}

fn table(out: &mut String, name: &str, entries: &[Entry]) {
    let _ = writeln!(out, "\n[{name}]");
    numbers(out, entries);
}

fn numbers(out: &mut String, entries: &[Entry]) {
    for (name, value) in entries {
        let _ = writeln!(out, "{name} = {}", number(*value));
    }
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
