//! Settings of the controller as generated files have them, from the one table [`SETTINGS`].

use crate::codegen::line_wrapping::wrapped;
use crate::mpc::interface::{Accepts, SETTINGS, Setting, Settings};

/// A setting in generated files; `upper` is the model's name in capitals.
pub(in crate::deploy) struct SettingText {
    pub(in crate::deploy) setting: &'static Setting,
    pub(in crate::deploy) default: f64,
}

impl SettingText {
    pub(super) fn all() -> Vec<Self> {
        let defaults = Settings::default().numbers();
        let all = SETTINGS.iter().zip(defaults);
        all.map(|(setting, default)| Self { setting, default })
            .collect()
    }

    /// Its declaration in the crate's header.
    pub(super) fn in_crate(&self, upper: &str) -> String {
        let (kind, width) = match self.setting.kind {
            "i32" => ("int32_t", 18),
            _ => ("double", 19),
        };
        self.declaration(kind, width, self.setting.text, upper)
    }

    /// Its declaration in the header of the generated C, unless it has none.
    pub(in crate::deploy) fn in_c(&self, real: &str, upper: &str) -> Option<String> {
        let (kind, width) = match self.setting.kind {
            "i32" => ("int32_t", 19),
            "f64" => ("double", 20),
            _ if self.setting.name.len() > 17 => (real, 24),
            _ => (real, 19),
        };
        let text = self.setting.in_c;
        (!text.is_empty()).then(|| self.declaration(kind, width, text, upper))
    }

    fn declaration(&self, kind: &str, width: usize, text: &str, upper: &str) -> String {
        let name = format!("{};", self.setting.name);
        let (width, text) = (width.max(name.len() + 1), text.replace("UPPER", upper));
        let default = match text.contains("(default)") {
            true => String::new(),
            false => format!(" ({})", self.default),
        };
        format!("{kind} {name:<width$}/**< {text}{default} */")
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
            Accepts::With(first) => {
                let condition = format!("settings->{first} > 0 && !is_not_negative({number})");
                (condition, other)
            }
            _ => (format!("!is_not_negative({number})"), other),
        }
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
