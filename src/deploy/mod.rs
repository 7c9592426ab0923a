//! A model to files: the targets of `romc compile`, and the controller as a crate.
//!
//! [`Equations`](crate::equations::Equations) enter [`emit()`]; files in memory leave, which [`write_files`](crate::files::write_files) puts
//! into a folder. Equations come from `typeset`, code from `codegen`; `controller` adds the sources of
//! `mpc/online` and `robot` and the model's numbers. Read `emit` first.

mod controller;
mod controller_c;
mod emit;
mod error;
mod planned;

pub use emit::{EmitOptions, Target, emit};
pub use error::EmitError;
pub use planned::PlannedJump;
