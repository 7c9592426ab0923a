//! A model to files: [`Equations`] enter [`emit()`], files in memory leave, for
//! [`write_files`](crate::files::write_files). Equations come from `typeset`, code from `codegen`; `controller` adds
//! the sources of `romc-control` and `romc-robot` and the model's numbers. Read `emit` first.

/// A template also sees the members of one of its fields.
macro_rules! extends {
    (<$life:lifetime> $name:ty: $base:ty, $field:ident) => {
        impl<$life> std::ops::Deref for $name {
            type Target = $base;

            fn deref(&self) -> &$base {
                &self.$field
            }
        }
    };
}

/// Templates of whole files, of which `NAME` in a path is the model's; askama looks from where the derive stands.
macro_rules! templates {
    (#[$derive:meta] $($path:literal: $template:ident $source:literal),* $(,)?) => {
        templates! { @each [#[$derive]] $($template $source),* }

        fn texts(facts: &Facts<'_>, provenance: &str) -> askama::Result<Vec<(String, String)>> {
            Ok(vec![$({
                let banner = &crate::deploy::banner($path, provenance);
                let text = askama::Template::render(&$template { banner, facts })?;
                ($path.replace("NAME", facts.name), crate::codegen::tidy(&text))
            }),*])
        }
    };
    (@each $derive:tt $($template:ident $source:literal),*) => {$(
        templates! { @one $derive $template $source }
    )*};
    (@one [$($derive:tt)*] $template:ident $source:literal) => {
        $($derive)*
        #[template(path = $source, config = "templates/askama.toml")]
        struct $template<'a> {
            banner: &'a str,
            facts: &'a Facts<'a>,
        }

        extends! { <'a> $template<'a>: Facts<'a>, facts }
    };
}

mod controller;
mod controller_c;
mod emit;
mod planned;

pub use emit::{EmitError, EmitOptions, Target, emit};
pub(crate) use planned::PlannedJump;

use askama::Template;
use nalgebra::DMatrix;

use crate::codegen::interface::{ModelInterface, PhaseInterface};
use crate::codegen::{
    CodegenError, Precision, SineCosine, Units, c, rust, script::Script, tidy, wrapped,
};
use crate::equations::Equations;
use crate::files::EmittedFile;
use crate::lower::{Form, LowerError};
use crate::model::ReducedModel;
use crate::mpc::interface::{Accepts, SETTINGS, Setting, Settings, all_codes};
use crate::mpc::{ControlModel, ControlPhase, MpcError, MpcSettings, Timing};
use crate::recording::{self, ControllerLog, RecordingError};
use crate::robot::{
    ContactFlags, FOOT_DIM, InputRule, JOINT_DIM, Leg, Robot, RobotError, STATE_DIM, WrenchFrame,
};

/// The first line of a generated file: a comment in its language, or the text for a template to make one of.
fn banner(path: &str, provenance: &str) -> String {
    match path.rsplit_once('.').map(|(_, ending)| ending) {
        Some("c" | "h") => format!("/* {provenance} */"),
        Some("rs" | "cpp" | "hpp") => format!("// {provenance}"),
        Some("md" | "xml") => provenance.to_owned(),
        _ => format!("# {provenance}"),
    }
}
