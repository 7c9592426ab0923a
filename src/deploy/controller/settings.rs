//! Settings of the controller as generated headers, checks, bindings and parameters have them: all from the one table,
//! [`SETTINGS`].

use crate::codegen::line_wrapping::wrapped;
use crate::mpc::interface::{Accepts, SETTINGS, Setting, Settings};

/// A setting in generated files.
pub(in crate::deploy) struct SettingText {
    setting: &'static Setting,
    pub(in crate::deploy) name: &'static str,
    pub(in crate::deploy) default: f64,
    upper: String,
}

/// All settings, in the order of the structures; `upper` is the model's name in capitals.
pub(super) fn setting_texts(upper: &str) -> Vec<SettingText> {
    let defaults = Settings::default().numbers();
    let text = |(setting, default): (&'static Setting, f64)| SettingText {
        setting,
        name: setting.name,
        default,
        upper: upper.to_owned(),
    };
    SETTINGS.iter().zip(defaults).map(text).collect()
}

impl SettingText {
    pub(in crate::deploy) fn is_whole(&self) -> bool {
        self.setting.kind == "i32"
    }

    /// Whether it has the precision of the generated C.
    pub(in crate::deploy) fn is_real(&self) -> bool {
        self.setting.kind == "Real"
    }

    /// Its declaration in the crate's header.
    pub(super) fn in_crate(&self) -> String {
        let kind = if self.is_whole() { "int32_t" } else { "double" };
        self.declaration(kind, 25 - kind.len(), self.setting.text)
    }

    /// Its declaration in the header of the generated C, unless it has none.
    pub(in crate::deploy) fn in_c(&self, real: &str) -> Option<String> {
        let (kind, width) = match self.setting.kind {
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

    /// The condition on which the generated C refuses a number.
    pub(in crate::deploy) fn refused_if(&self) -> String {
        let number = format!("settings->{}", self.name);
        match self.setting.accepts {
            Accepts::Positive if self.is_real() => format!("!is_positive({number})"),
            Accepts::Positive => format!("!(is_finite_double({number}) && {number} > 0)"),
            Accepts::With(other) => {
                format!("settings->{other} > 0 && !is_not_negative({number})")
            }
            _ => format!("!is_not_negative({number})"),
        }
    }

    /// What it accepts instead, in words.
    pub(in crate::deploy) fn expected(&self) -> &'static str {
        match self.setting.accepts {
            Accepts::Positive => "a positive number",
            _ => "zero or a positive number",
        }
    }

    /// The switch without which the generated C accepts zero alone.
    pub(in crate::deploy) fn switch(&self) -> Option<&'static str> {
        match self.setting.accepts {
            Accepts::Compiled(switch) => Some(switch),
            _ => None,
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
pub(super) fn quoted_names(settings: &[SettingText], is_whole: bool) -> String {
    let of_kind = settings
        .iter()
        .filter(|setting| setting.is_whole() == is_whole);
    let names: Vec<String> = of_kind
        .map(|setting| format!("\"{}\"", setting.name))
        .collect();
    wrapped(&names.join(", "), 88, "           ").join("\n")
}
