//! The digest by which generated files name the model that they come from.

use std::fmt;

use sha2::{Digest as _, Sha256};

use super::write::to_text;
use crate::files::hex;
use crate::model::ReducedModel;

/// SHA-256 of a model in the form in which [`write`](super::write()) writes it.
///
/// The layout of the file that was read does not matter. For a file that romc wrote the digest is
/// what `sha256sum` prints.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Digest([u8; 32]);

impl Digest {
    /// The first 16 hexadecimal digits, for headers of generated files.
    pub fn short(&self) -> String {
        self.to_string()[..16].to_owned()
    }
}

impl fmt::Display for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&hex(&self.0))
    }
}

/// The digest of a model.
pub fn digest(model: &ReducedModel) -> Digest {
    Digest(Sha256::digest(to_text(model)).into())
}
