//! The model file, `romc-model/1` and `romc-model/2`.
//!
//! In: a path or bytes. Out: a checked [`ReducedModel`], or an error with the file, tensor, index, the value found and
//! the value expected. [`write()`] makes files that are equal byte for byte for equal models. Read `manifest.rs` first:
//! it is the file's grammar.
//!
//! ```
//! use romc::artifact;
//!
//! let text = r#"{ "schema": "romc-model/1", "name": "spring", "latent_dim": 1,
//!     "library": ["z1", "dz1", "u1"],
//!     "phases": [ { "name": "contact", "feet": "any", "xi": [[-4.0], [-0.1], [2.0]] } ] }"#;
//! let model = artifact::read_from_bytes("spring.json", text.as_bytes())?;
//! assert_eq!(model.phases()[0].active_count(), 3);
//!
//! let again = artifact::read_from_bytes("again", artifact::to_text(&model).as_bytes())?;
//! assert_eq!(model, again);
//!
//! let one_row_short = text.replace(", [2.0]", "");
//! let error = artifact::read_from_bytes("spring.json", one_row_short.as_bytes()).unwrap_err();
//! assert_eq!(
//!     artifact::describe(&error),
//!     "spring.json: not a usable model: `phases[0].xi`: found 2 x 1, expected 3 x 1 (rows x columns)"
//! );
//! # Ok::<(), romc::artifact::ArtifactError>(())
//! ```
//!
//! [`ReducedModel`]: crate::model::ReducedModel

mod manifest;
mod read;
mod write;

pub use read::{ArtifactError, describe, is_standard_input, read, read_from_bytes};
pub use write::{Digest, check_place, digest, to_text, write};

use std::path::Path;
use std::{fmt, fs, io};

use manifest::Manifest;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::{Map, Number, Value};

use crate::files::{Fault, Located, Overwrite, Place, hex, magic, write_whole};
use crate::model::{
    CoordinateNames, InputStatistics, JumpPrior, Landmarks, Library, LibraryChoice, ModelError,
    Phase, ReducedModel, ScaleFactors, Scaling, StandardLibrary, StateMap,
};

type Result<T, E = ArtifactError> = std::result::Result<T, E>;
