//! A model to files: the targets of `romc compile`, and the controller as a crate.
//!
//! [`Equations`](crate::equations::Equations) enter [`emit()`]; files in memory leave, which
//! [`write_files`](crate::files::write_files) puts into a folder. Equations come from `typeset`, code from `codegen`;
//! `controller` adds the sources of `romc-control` and `romc-robot` and the model's numbers. Read `emit` first.

/// Templates of whole files, each a struct of its first line and the `Facts` of its module. The caller writes the
/// derive: askama looks for files from where it stands.
macro_rules! templates {
    (#[$derive:meta] $($template:ident: $path:tt),* $(,)?) => {
        templates! { @each [#[$derive]] $($template: $path),* }
    };
    (@each $derive:tt $($template:ident: $path:tt),*) => {$(
        templates! { @one $derive $template: $path }
    )*};
    (@one [$($derive:tt)*] $template:ident: $path:tt) => {
        $($derive)*
        #[template(path = $path, config = "templates/askama.toml")]
        struct $template<'a> {
            banner: &'a str,
            facts: &'a Facts<'a>,
        }

        impl<'a> $template<'a> {
            fn text(banner: &'a str, facts: &'a Facts<'a>) -> askama::Result<String> {
                askama::Template::render(&Self { banner, facts })
            }
        }

        impl<'a> std::ops::Deref for $template<'a> {
            type Target = Facts<'a>;

            fn deref(&self) -> &Facts<'a> {
                self.facts
            }
        }
    };
}

mod controller;
mod controller_c;
mod emit;
mod error;
mod planned;

pub use emit::{EmitOptions, Target, emit};
pub use error::EmitError;
pub(crate) use planned::PlannedJump;
