//! The equations of a model, and their output as programs, code and text.
//!
//! [`equations`] are the accelerations over the expressions of `romc-cas`, [`lower`] makes an [`ir::Program`] of them;
//! [`typeset`] and [`codegen`] print both. `romc` re-exports every module; depend on that.
#![allow(
    missing_docs,
    reason = "names are self-explanatory where there is no comment"
)]

use romc_cas as symbolic;
use romc_model::{files, model};
use romc_robot as robot;

pub mod codegen;
pub mod equations;
pub mod ir;
pub mod lower;
pub mod typeset;
#[cfg(test)]
#[path = "../../tests/typeset_values/mod.rs"]
mod typeset_values;
