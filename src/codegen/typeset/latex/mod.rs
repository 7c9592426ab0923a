//! Equations for papers: [`Equations`] enter, LaTeX files leave.
//!
//! Read [`emit`] first: it names the files. Names from a model file pass through `tex_text` and nothing else.
//!
//! ```
//! use nalgebra::DMatrix;
//! use romc::equations::Equations;
//! use romc::typeset::{PrintOptions, latex};
//! use romc::model::{FeetRule, Library, Phase, ReducedModel};
//!
//! let library = Library::from_terms(1, &["1".into(), "dz1".into(), "sin(dz1)".into()])?;
//! let xi = DMatrix::from_column_slice(3, 1, &[0.29, -1.22, -1.0]);
//! let phase = Phase { name: "flight".into(), feet: FeetRule::None, xi };
//! let model = ReducedModel::builder("flight-only", library).phase(phase).build()?;
//! let files = latex::emit(&Equations::of(&model), &PrintOptions::default())?;
//! assert!(files[0].contents.contains(r"\ddot{z}_1 = 0.29 - 1.22\dot{z}_1 - 1.00\sin(\dot{z}_1)"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! In a paper: `\usepackage{amsmath}` in the preamble, then `\input{flight_only}` for all phases, or
//! `\input{flight_only_flight}` for one, and `\eqref{eq:flight-only:flight}` to refer to it.

mod document;
pub(crate) mod math;
mod nomenclature;
mod table;

pub use document::emit;
pub use math::tex_cases;
pub(crate) use math::{tex, tex_symbol, tex_unit};

use super::*;
use math::{label, tex_number, tex_text};
