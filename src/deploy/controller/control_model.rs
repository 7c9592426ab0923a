//! The numbers of a model as `src/control_model.rs`, and settings as generated files have them, from [`SETTINGS`].

use super::*;
use nalgebra::storage::RawStorage;
use nalgebra::{DVector, Dim};

const WIDTH: usize = 5;

#[derive(Template)]
#[template(
    path = "controller/control_model.askama",
    config = "templates/askama.toml"
)]
pub(crate) struct ControlModelText<'a> {
    banner: String,
    model: &'a str,
    name: &'a str,
    robot: String,
    frame: &'static str,
    actuators: Vec<(&'static str, String)>,
    legs: String,
    plant: &'a ControlModel,
    /// Each phase with its constants' beginning.
    phases: Vec<(String, &'a PhaseInterface, &'a ControlPhase)>,
}

fn numbers<R: Dim, C: Dim, S: RawStorage<f64, R, C>>(
    matrix: &nalgebra::Matrix<f64, R, C, S>,
) -> String {
    let rows = matrix.row_iter();
    let texts: Vec<String> = rows
        .flat_map(|row| row.iter().map(|v| format!("{v:?}")).collect::<Vec<_>>())
        .collect();
    let lines: Vec<String> = texts.chunks(WIDTH).map(|line| line.join(", ")).collect();
    format!("[{}]", lines.join(",\n    "))
}

fn matrix(matrix: &DMatrix<f64>) -> String {
    let (rows, columns) = matrix.shape();
    let numbers = numbers(matrix);
    format!("DMatrix::from_row_slice({rows}, {columns}, &{numbers})")
}

fn vector(vector: &DVector<f64>) -> String {
    format!("DVector::from_column_slice(&{})", numbers(vector))
}

impl<'a> ControlModelText<'a> {
    pub(crate) fn new(
        entries: &'a ModelInterface,
        plant: &'a ControlModel,
        banner: String,
    ) -> Self {
        let rule = plant.input_rule();
        let pairs = entries.phases.iter().zip(plant.phases());
        Self {
            banner,
            model: &entries.name,
            name: &entries.identifier,
            robot: robot_text(plant.robot()),
            frame: match rule.wrench_frame() {
                WrenchFrame::Body => "Body",
                WrenchFrame::World => "World",
                WrenchFrame::Ground => "Ground",
            },
            actuators: (rule.actuators().iter())
                .flat_map(|actuators| actuators.named())
                .map(|(name, values)| (name, format!("{values:?}")))
                .collect(),
            legs: (rule
                .actuators()
                .map(|actuators| format!("{:?}", actuators.legs)))
            .unwrap_or_default(),
            plant,
            phases: pairs
                .map(|(entries, phase)| (entries.identifier.to_ascii_uppercase(), entries, phase))
                .collect(),
        }
    }
}

/// A robot as a Rust expression: the debug form of structs, arrays, texts and numbers is one.
fn robot_text(robot: &Robot) -> String {
    let legs: Vec<String> = Leg::ALL
        .map(|leg| format!("        {:?},\n", robot.geometry(leg)))
        .into();
    let hips = Leg::ALL.map(|leg| <[f64; 3]>::from(robot.hip_position(leg)));
    let fields = [
        ("name", format!("{:?}", robot.name)),
        ("mass_kg", format!("{:?}", robot.mass_kg())),
        ("legs", format!("[\n{}    ]", legs.concat())),
        ("hip_position_m", format!("{hips:?}")),
        ("joint_names", format!("{:?}", robot.joint_names)),
        ("torque_limit_nm", format!("{:?}", robot.torque_limit_nm())),
        ("joint_limit_rad", format!("{:?}", robot.joint_limit_rad())),
        (
            "joint_speed_limit_rad_s",
            format!("{:?}", &robot.joint_speed_limit_rad_s),
        ),
    ];
    let fields = fields.map(|(name, value)| format!("    {name}: {value},\n"));
    format!("Robot {{\n{}}}", fields.concat())
}

/// A setting in generated files.
pub(in crate::deploy) struct SettingText {
    pub(in crate::deploy) setting: &'static Setting,
    pub(in crate::deploy) default: f64,
}

impl SettingText {
    pub(super) fn all(settings: &Settings) -> Vec<Self> {
        let defaults = settings.numbers();
        let all = SETTINGS.iter().zip(defaults);
        all.map(|(setting, default)| Self { setting, default })
            .collect()
    }

    pub(super) fn in_crate(&self, upper: &str) -> String {
        self.declaration("double", self.setting.text, upper)
    }

    /// Its declaration in the header of the generated C, unless it has none.
    pub(in crate::deploy) fn in_c(&self, real: &str, upper: &str) -> Option<String> {
        let text = self.setting.in_c;
        (!text.is_empty()).then(|| self.declaration(real, text, upper))
    }

    fn declaration(&self, real: &str, text: &str, upper: &str) -> String {
        let kind = match self.setting.kind {
            "i32" => "int32_t",
            "f64" => "double",
            _ => real,
        };
        let (name, text) = (self.setting.name, text.replace("UPPER", upper));
        let default = match text.contains("(default)") {
            true => String::new(),
            false => format!(" ({})", self.default),
        };
        format!("{kind} {name}; /**< {text}{default} */")
    }

    /// Its default in the generated C.
    pub(in crate::deploy) fn default_in_c(&self) -> String {
        let number = match self.default.is_finite() {
            true => self.default.to_string(),
            false => "(double)INFINITY".to_owned(),
        };
        match self.setting.kind {
            "Real" => format!("(real){number}"),
            _ => number,
        }
    }

    /// The value that disables it in the generated C of this precision, if it is a bound of the supervisor.
    pub(in crate::deploy) fn off(&self, real: &str) -> Option<String> {
        match (self.setting.accepts, self.setting.kind) {
            (Accepts::Bound, "Real") => Some(format!("({real})INFINITY")),
            (Accepts::Bound, _) => Some("(double)INFINITY".to_owned()),
            (Accepts::Count, _) => Some("0".to_owned()),
            _ => None,
        }
    }

    /// The condition under which the generated C has it off, if it is a bound of the supervisor.
    pub(in crate::deploy) fn is_off(&self) -> Option<String> {
        let name = self.setting.name;
        match (self.setting.accepts, self.setting.kind) {
            (Accepts::Bound, "Real") => Some(format!("!solver_is_finite_number(chosen.{name})")),
            (Accepts::Bound, _) => Some(format!("!is_finite_double(chosen.{name})")),
            (Accepts::Count, _) => Some(format!("chosen.{name} == 0")),
            _ => None,
        }
    }

    /// Whether the generated C checks it by [`Self::refused`]; other choices it checks by hand.
    pub(in crate::deploy) fn is_checked_by_table(&self) -> bool {
        !matches!(self.setting.accepts, Accepts::Whole(..))
    }

    /// The condition under which the generated C refuses a value, and the accepted range in words.
    pub(in crate::deploy) fn refused(&self) -> (String, &'static str) {
        let number = format!("settings->{}", self.setting.name);
        let (positive, other) = ("a positive number", "zero or a positive number");
        match self.setting.accepts {
            Accepts::Positive if self.setting.kind == "f64" => {
                let condition = format!("!(is_finite_double({number}) && {number} > 0)");
                (condition, positive)
            }
            Accepts::Positive => (format!("!is_positive({number})"), positive),
            Accepts::Share => {
                let condition = format!("!is_not_negative({number}) || {number} > 1");
                (condition, "a number from 0 to 1")
            }
            Accepts::Bound => (format!("!({number} > 0)"), "a positive number or infinity"),
            Accepts::Count => (format!("{number} < 0"), other),
            _ => (format!("!is_not_negative({number})"), other),
        }
    }
}
