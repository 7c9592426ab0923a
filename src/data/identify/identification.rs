//! The parameters of a robot identified from recordings, also as a TOML file.

use serde::{Deserialize, Serialize};

use super::*;
use crate::files::size::read_toml;

#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PerKind {
    pub hx: f64,
    pub hy: f64,
    pub kn: f64,
}

impl PerKind {
    pub(crate) fn from_array([hx, hy, kn]: [f64; LEG_JOINT_DIM]) -> Self {
        Self { hx, hy, kn }
    }

    pub(crate) fn to_array(self) -> [f64; LEG_JOINT_DIM] {
        [self.hx, self.hy, self.kn]
    }

    pub(crate) fn mean(joints: &[f64; JOINT_DIM]) -> Self {
        Self::from_array(std::array::from_fn(|kind| {
            let legs = joints.iter().skip(kind).step_by(LEG_JOINT_DIM);
            legs.sum::<f64>() / (JOINT_DIM / LEG_JOINT_DIM) as f64
        }))
    }
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StandardError {
    pub gravity_m_s2: f64,
    pub mass_kg: f64,
    pub delay_s: f64,
    pub viscous_nm_s_rad: PerKind,
    pub dry_nm: PerKind,
    pub armature_kg_m2: PerKind,
    pub legs: LegMoments,
}

/// R^2 of the trunk's acceleration in contact along the world's axes, over windows.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fit {
    pub x: f64,
    pub z: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ForceAlone {
    pub gravity_m_s2: f64,
    pub mass_kg: f64,
    pub r2: Fit,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Samples {
    pub contact: usize,
    pub flight: usize,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Identification {
    pub robot: String, // whose geometry was used
    pub gravity_m_s2: f64,
    pub mass_kg: f64,
    pub delay_s: f64, // time from a recorded torque to its effect on the motion, s
    pub actuators: Actuators,
    pub legs: LegMoments,
    pub standard_error: StandardError,
    pub r2: Fit,
    pub force_alone: ForceAlone,
    pub samples: Samples,
    #[serde(default)]
    pub notes: Vec<String>,
}

const WORSE: f64 = 0.05; // by how much the whole equation may fit less forwards than forces alone

const GRAVITY_SHARE: f64 = 0.04;
const MASS_SHARE: f64 = 0.3;

const NO_GRAVITY_SHARE: f64 = 0.25; // share from which on gravity is no robot's

impl Identification {
    pub(super) fn doubts(&self, mass_kg: f64) -> Vec<String> {
        let mut doubts = Vec::new();
        if (self.gravity_m_s2 / GRAVITY_M_S2 - 1.0).abs() > GRAVITY_SHARE {
            doubts.push(format!(
                "gravity is {:.2} m/s^2, expected {GRAVITY_M_S2} within {:.0} %: the body's velocities may be in its \
                 own frame, its motion late, or the clock wrong",
                self.gravity_m_s2,
                100.0 * GRAVITY_SHARE
            ));
        }
        if (self.mass_kg / mass_kg - 1.0).abs() > MASS_SHARE {
            doubts.push(format!(
                "the mass is {:.1} kg, and {mass_kg:.1} kg in the robot's description: torques in other units, \
                 missing ones, or a payload",
                self.mass_kg
            ));
        }
        doubts
    }

    /// Why these values are no robot's. Upwards forces alone may fit better: commanded torques are noisy there.
    pub fn contradiction(&self) -> Option<String> {
        if (self.gravity_m_s2 / GRAVITY_M_S2 - 1.0).abs() > NO_GRAVITY_SHARE {
            let expected = format!("expected {GRAVITY_M_S2}: do not use these values");
            return Some(format!(
                "gravity is {:.2} m/s^2, {expected}",
                self.gravity_m_s2
            ));
        }
        let alone = self.force_alone.r2;
        let axes = [
            ("forwards", self.r2.x, alone.x, alone.x - WORSE),
            ("upwards", self.r2.z, alone.z, 0.0),
        ];
        let (axis, whole, alone, _) =
            (axes.into_iter()).find(|(_, whole, _, bound)| *whole < bound.max(0.0))?;
        Some(format!(
            "R^2 of the trunk's acceleration {axis} is {whole:.2}, and {alone:.2} by the feet's forces alone: \
             signs, order, units or frames of torques, joints or body are not this robot's; do not use these values"
        ))
    }

    /// Losses of the joints with the moments of the legs, as models have them.
    pub fn actuators_and_legs(&self) -> Actuators {
        Actuators {
            legs: Some(self.legs),
            ..self.actuators.clone()
        }
    }

    /// By kind of joint viscous friction in N m s/rad, dry friction in N m and armature in kg m^2.
    pub fn losses(&self) -> [PerKind; 3] {
        (self.actuators.named()).map(|(_, joints)| PerKind::mean(joints))
    }
}

impl Identification {
    pub fn to_toml(&self) -> String {
        let (error, alone) = (&self.standard_error, &self.force_alone);
        let body = |gravity, mass, delay: Option<f64>| {
            let known = gravity_and_mass(gravity, mass).into_iter();
            entries(known.chain(delay.map(|delay| ("delay_s", delay))))
        };
        let fit = |fit: Fit| entries([("x", fit.x), ("z", fit.z)]);
        let actuators = (self.actuators.named())
            .map(|(name, values)| format!("{name} = [{}]\n", values.map(number).join(", ")));
        let losses = [
            ("viscous_nm_s_rad", error.viscous_nm_s_rad),
            ("dry_nm", error.dry_nm),
            ("armature_kg_m2", error.armature_kg_m2),
        ];
        let losses = losses.map(|(name, kinds)| {
            let [hx, hy, kn] = kinds.to_array().map(number);
            format!("{name} = {{ hx = {hx}, hy = {hy}, kn = {kn} }}\n")
        });
        let errors = body(error.gravity_m_s2, error.mass_kg, Some(error.delay_s));
        let Samples { contact, flight } = self.samples;
        let mut out = String::from(
            "# Identified from recordings by `romc identify`. SI units: m, s, kg, N m, rad.\n",
        );
        let notes = self.notes.iter();
        out.extend(notes.map(|note| format!("# {}\n", note.replace(['\n', '\r'], " "))));
        out += &format!("robot = {:?}\n", self.robot);
        out += &body(self.gravity_m_s2, self.mass_kg, Some(self.delay_s));
        out += &format!("\n# {}", JOINT_NAMES.join(" "));
        for (name, entries) in [
            ("actuators", actuators.concat()),
            ("legs", legs(&self.legs)),
            ("standard_error", errors + &losses.concat()),
            ("standard_error.legs", legs(&error.legs)),
            ("r2", fit(self.r2)),
            ("force_alone", body(alone.gravity_m_s2, alone.mass_kg, None)),
            ("force_alone.r2", fit(alone.r2)),
            (
                "samples",
                format!("contact = {contact}\nflight = {flight}\n"),
            ),
        ] {
            out += &format!("\n[{name}]\n{entries}");
        }
        out
    }

    /// Reads a file of [`Identification::to_toml`] without its notes.
    pub fn read(path: &Path) -> Result<Self, IdentifyError> {
        let file = path.display().to_string();
        let refused = |source| Located::<Fault>::io(&file, "read", source);
        Self::from_toml(&file, &read_toml(path).map_err(refused)?)
    }

    /// The same of a text; `file` stands for it in messages.
    pub(crate) fn from_toml(file: &str, text: &str) -> Result<Self, IdentifyError> {
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

fn legs(legs: &LegMoments) -> String {
    entries([
        ("side_kg_m", legs.side_kg_m),
        ("thigh_kg_m", legs.thigh_kg_m),
        ("calf_kg_m", legs.calf_kg_m),
        ("thigh_kg_m2", legs.thigh_kg_m2),
        ("calf_kg_m2", legs.calf_kg_m2),
    ])
}

fn entries(entries: impl IntoIterator<Item = Entry>) -> String {
    let lines = (entries.into_iter()).map(|(name, value)| format!("{name} = {}\n", number(value)));
    lines.collect()
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
