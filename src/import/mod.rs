//! Models trained elsewhere: safetensors, NumPy's npz, arrays in memory, equations as text.
//!
//! In: a file, with [`ImportOptions`] for data that tensors do not carry. Out: a checked model with an
//! [`ImportReport`], or an [`ImportError`] with file, place, the text found and the text expected. Read `run.rs` first.
//! `assign.rs` decides the use of each tensor, `assemble.rs` makes parts of a model of them, `latent.rs` decomposes
//! equations.
//!
//! ```
//! use romc::import::{Format, ImportOptions, import_from_bytes};
//!
//! let text = "[contact]\nddz1 = -4*z1 - 0.1*dz1 + 2*(u1 - 0.5)\n[flight]\nddz1 = -1\n";
//! let options = ImportOptions { name: "hopper".into(), ..ImportOptions::default() };
//! let imported = import_from_bytes("hopper.txt", Format::Equations, text.as_bytes(), &options)?;
//! let terms: Vec<&str> = imported.model.library().terms().iter().map(|t| t.text.as_str()).collect();
//! assert_eq!(terms, ["1", "z1", "dz1", "u1"]);
//! assert_eq!(imported.model.phases()[0].xi.as_slice(), [-1.0, -4.0, -0.1, 2.0]);
//! # Ok::<(), romc::import::ImportError>(())
//! ```

mod assemble;
mod assign;
mod equations;
mod latent;
mod latex;
mod library;
mod options;
mod role;
mod run;
mod tensors;
#[cfg(test)]
#[path = "../../tests/import/units.rs"]
mod units;

pub(crate) use latex::variables::{NameError, SymbolNames};
pub(crate) use library::read_terms;
pub use options::{Format, ImportOptions, WeightVectors, XiLayout, parse_standard};
pub(crate) use role::Mapping;
pub(crate) use run::{Chosen, import, read_equations};
pub use run::{ImportReport, Imported, import_from_bytes, import_tensors};
pub use tensors::Tensor;

use std::collections::{BTreeSet, HashMap};
use std::fmt;
use std::io::{self, Cursor, Read as _};
use std::path::Path;
use std::str::FromStr;

use assemble::Parts;
use equations::Sections;
use nalgebra::{DMatrix, DVector};
use options::standard_text;
use role::{ONLY_PHASE, Part, Role, is_of_optimiser};
use serde_json::{Map, Value, json};
use sha2::{Digest as _, Sha256};
use tensors::{TensorFile, TensorInfo};

use crate::files::{Place, hex, magic};
use crate::model::{
    Activation, CoordinateNames, CoordinateOrder, FeetRule, InputStatistics, LatentVariable,
    Library, LibraryChoice, LibraryOrder, MAX_LATENT_DIM, ModelError, Phase, ReducedModel,
    ScaleFactors, Scaling, StandardLibrary, StateMap,
};
use crate::robot::PhasePattern;
use crate::symbolic::{ExprId, ExprPool, Function, Node, ParseErrorKind};

/// A fault and its place: the file, a tensor with its use, a character of a text, or an option.
pub type ImportError = crate::files::Located<crate::files::Fault<crate::model::ModelError>>;

type Read<T> = Result<T, ImportError>;
