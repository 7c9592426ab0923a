//! From programs and equations to text: C, Rust, Python, MATLAB, LaTeX, Markdown, MathML, and the controller.
//!
//! A model enters [`emit()`]; files in memory leave, which [`write_files`] puts into a folder.
//! `entries` lists what is generated, `translate` turns programs into the statements of
//! `code`, `printer` prints them with what a `dialect` spells, templates place them.
//! Backends decide nothing mathematical. Read `emit` first.

mod c;
mod code;
mod controller;
mod dialect;
mod emit;
mod entries;
mod folder;
mod functions;
mod homes;
mod ident;
mod kernel;
pub mod latex;
mod literal;
pub mod markdown;
pub mod mathml;
mod precision;
mod printer;
mod row;
mod rust;
mod script;
mod sines;
mod tables;
mod target;
mod translate;
mod translate_arrays;
pub mod typeset;
mod units;
mod usage;
mod vectors;
mod wrap;

pub use emit::{EmitOptions, Target, emit};
pub use folder::{FolderError, check_folder, write_files};
pub use precision::{Precision, worst_errors};
pub use sines::SineCosine;
pub use target::{EmitError, EmittedFile};
pub use units::Units;
