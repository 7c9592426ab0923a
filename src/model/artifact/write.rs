//! From a model to a file that appears whole or not at all, and to the digest by which generated files name the model
//! that they come from.

use std::path::Path;
use std::{fmt, fs, io};

use sha2::{Digest as _, Sha256};

use super::manifest::Manifest;
use super::print::print;
use super::read::ArtifactError;
use crate::files::{Overwrite, Place, hex, write_whole};
use crate::model::ReducedModel;

/// The model file as text: equal for equal models, numbers in the shortest form that reads back to the same bits.
pub fn to_text(model: &ReducedModel) -> String {
    let value = serde_json::to_value(Manifest::of(model))
        .expect("a manifest is strings, finite numbers and string-keyed maps");
    print(&value)
}

/// Checks whether [`write()`] would refuse.
pub fn check_place(
    path: &Path,
    model: &ReducedModel,
    overwrite: Overwrite,
) -> Result<(), ArtifactError> {
    check_text(path, &to_text(model), overwrite)
}

fn check_text(path: &Path, text: &str, overwrite: Overwrite) -> Result<(), ArtifactError> {
    let same = || fs::read(path).is_ok_and(|bytes| bytes == text.as_bytes());
    match overwrite.allows(path) || same() {
        true => Ok(()),
        false => {
            let text = "a file of this name is there already";
            let file = path.display().to_string();
            Err(ArtifactError::text(&file, Place::Whole, text))
        }
    }
}

/// Writes a model file: into a new file beside `path`, which is then moved there.
pub fn write(path: &Path, model: &ReducedModel, overwrite: Overwrite) -> Result<(), ArtifactError> {
    let text = to_text(model);
    let written = write_whole(path, overwrite, |out| out.write_all(text.as_bytes()));
    match written {
        Err(source) if source.kind() == io::ErrorKind::AlreadyExists => {
            check_text(path, &text, Overwrite::Refuse)
        }
        Err(source) => {
            let (file, action) = (path.display().to_string(), "write the model file");
            Err(ArtifactError::io(&file, action, source))
        }
        Ok(()) => Ok(()),
    }
}

/// SHA-256 of a model in the form in which [`write()`] writes it.
///
/// The layout of the file that was read does not matter. For a file that romc wrote the digest is what `sha256sum`
/// prints.
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

pub fn digest(model: &ReducedModel) -> Digest {
    Digest(Sha256::digest(to_text(model)).into())
}
