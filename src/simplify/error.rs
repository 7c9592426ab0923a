//! Why a model was not simplified.

#![allow(missing_docs, reason = "each variant's message names its fields")]

use std::path::PathBuf;

use crate::lower::LowerError;
use crate::model::ModelError;

/// Errors of simplification.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SimplifyError {
    #[error("the domain {0}")]
    Domain(String),
    #[error("{path}: {message}", path = path.display())]
    DomainFile { path: PathBuf, message: String },
    #[error(
        "model `{model}` has no encoder, so recordings give it no domain; give a .toml file with one table per phase, such as [contact], and a range for each of z1, dz1, u1, ..., such as z1 = [-0.2, 0.4]"
    )]
    NoEncoder { model: String },
    #[error(
        "a tolerance in percent is a share of the root mean square of each ddz over recordings, and the domain has none; give a number in scaled units per s^2"
    )]
    NoSamples,
    #[error(
        "a margin widens the box around recordings; the ranges of a .toml file are taken as they are"
    )]
    Margin,
    #[error(
        "internal error: in phase `{phase}`, ddz{output} of the simplified model is off by {measured:e} at a recorded sample, beyond the bound {bound:e}", output = output + 1
    )]
    Contradiction {
        phase: String,
        output: usize,
        measured: f64,
        bound: f64,
    },
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    Lower(#[from] LowerError),
}
