//! From a model to a file that appears whole or not at all.

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use super::error::ArtifactError;
use super::export::manifest_of;
use super::print::print;
use crate::model::ReducedModel;

/// Whether a file that is there already may be replaced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overwrite {
    /// Refuse, unless the file holds the same bytes already.
    Refuse,
    /// Replace it.
    Replace,
}

/// The model file as text: equal for equal models, numbers in the shortest form that reads back to
/// the same bits.
pub fn to_text(model: &ReducedModel) -> String {
    let value = serde_json::to_value(manifest_of(model))
        .expect("a manifest is strings, finite numbers and string-keyed maps");
    print(&value)
}

/// Writes a model file; refuses to replace a different one.
///
/// # Errors
/// [`ArtifactError::Exists`], [`ArtifactError::Io`].
pub fn write(path: &Path, model: &ReducedModel) -> Result<(), ArtifactError> {
    write_with(path, model, Overwrite::Refuse)
}

/// Writes a model file: into a new file beside `path`, which is then renamed.
///
/// # Errors
/// [`ArtifactError::Exists`] if a different file is there and `overwrite` refuses,
/// [`ArtifactError::Io`].
pub fn write_with(
    path: &Path,
    model: &ReducedModel,
    overwrite: Overwrite,
) -> Result<(), ArtifactError> {
    let text = to_text(model);
    if overwrite == Overwrite::Refuse && path.symlink_metadata().is_ok() {
        let same = fs::read(path).is_ok_and(|bytes| bytes == text.as_bytes());
        return if same {
            Ok(())
        } else {
            Err(ArtifactError::Exists {
                path: path.to_owned(),
            })
        };
    }
    write_beside_and_rename(path, text.as_bytes()).map_err(|source| ArtifactError::Io {
        path: path.to_owned(),
        action: "write",
        source,
    })
}

fn write_beside_and_rename(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let name = path
        .file_name()
        .ok_or_else(|| io::Error::from(io::ErrorKind::InvalidFilename))?;
    let mut beside_name = std::ffi::OsString::from(".");
    beside_name.push(name);
    beside_name.push(format!(".{}.part", std::process::id()));
    let beside = path.with_file_name(beside_name);
    let written = fs::File::create(&beside)
        .and_then(|mut file| file.write_all(bytes).and_then(|()| file.sync_all()))
        .and_then(|()| fs::rename(&beside, path));
    if written.is_err() {
        // The first error is the one worth telling; a file that cannot be removed changes nothing.
        let _ = fs::remove_file(&beside);
    }
    written
}
