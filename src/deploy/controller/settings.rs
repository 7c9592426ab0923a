//! Settings of the controller as generated files have them, from the one table [`SETTINGS`].

use crate::codegen::line_wrapping::wrapped;
use crate::mpc::interface::{Accepts, SETTINGS, Setting, Settings};

/// A setting in generated files.
pub(in crate::deploy) struct SettingText {
    setting: &'static Setting,
    upper: String,
    pub(in crate::deploy) name: &'static str,
    /// `i32`, `f64` or `Real`.
    pub(in crate::deploy) kind: &'static str,
    pub(in crate::deploy) default: f64,
    /// The switch without which the generated C accepts zero alone.
    pub(in crate::deploy) switch: Option<&'static str>,
}

/// All settings, in the order of the structures; `upper` is the model's name in capitals.
pub(super) fn setting_texts(upper: &str) -> Vec<SettingText> {
    let defaults = Settings::default().numbers();
    let text = |(setting, default): (&'static Setting, f64)| SettingText {
        setting,
        upper: upper.to_owned(),
        name: setting.name,
        kind: setting.kind,
        default,
        switch: match setting.accepts {
            Accepts::Compiled(switch) => Some(switch),
            _ => None,
        },
    };
    SETTINGS.iter().zip(defaults).map(text).collect()
}

impl SettingText {
    /// Its declaration in the crate's header.
    pub(super) fn in_crate(&self) -> String {
        let kind = match self.kind {
            "i32" => "int32_t",
            _ => "double",
        };
        self.declaration(kind, 25 - kind.len(), self.setting.text)
    }

    /// Its declaration in the header of the generated C, unless it has none.
    pub(in crate::deploy) fn in_c(&self, real: &str) -> Option<String> {
        let (kind, width) = match self.kind {
            "i32" => ("int32_t", 19),
            "f64" => ("double", 20),
            _ if self.name.len() > 17 => (real, 24),
            _ => (real, 19),
        };
        let text = self.setting.in_c;
        (!text.is_empty()).then(|| self.declaration(kind, width, text))
    }

    fn declaration(&self, kind: &str, width: usize, text: &str) -> String {
        let name = format!("{};", self.name);
        let (width, text) = (width.max(name.len() + 1), self.with_upper(text));
        let default = match text.contains("(default)") {
            true => String::new(),
            false => format!(" ({})", self.default),
        };
        format!("{kind} {name:<width$}/**< {text}{default} */")
    }

    /// When the generated C refuses a number, and what it accepts instead.
    pub(in crate::deploy) fn refused(&self) -> (String, &'static str) {
        let (number, is_real) = (format!("settings->{}", self.name), self.kind == "Real");
        let condition = match self.setting.accepts {
            Accepts::Positive if is_real => format!("!is_positive({number})"),
            Accepts::Positive => format!("!(is_finite_double({number}) && {number} > 0)"),
            Accepts::With(other) => {
                format!("settings->{other} > 0 && !is_not_negative({number})")
            }
            _ => format!("!is_not_negative({number})"),
        };
        match self.setting.accepts {
            Accepts::Positive => (condition, "a positive number"),
            _ => (condition, "zero or a positive number"),
        }
    }

    /// Its description as a parameter of ROS, if it is one.
    pub(in crate::deploy) fn in_ros(&self) -> Option<String> {
        self.setting.in_ros.map(|text| self.with_upper(text))
    }

    fn with_upper(&self, text: &str) -> String {
        text.replace("UPPER", &self.upper)
    }
}

/// The names of the whole numbers or of the others, as a tuple in Python has them.
pub(super) fn quoted_names(is_whole: bool) -> String {
    let of_kind = (SETTINGS.iter()).filter(|setting| (setting.kind == "i32") == is_whole);
    let names: Vec<String> = of_kind
        .map(|setting| format!("{:?}", setting.name))
        .collect();
    wrapped(&names.join(", "), 88, "           ").join("\n")
}
