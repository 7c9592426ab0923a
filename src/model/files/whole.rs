//! One file, written beside its place and then moved there.

use std::io::{self, BufWriter, Write};
use std::path::Path;

use super::part::{Part, remove_left_in};

/// A generated file, not yet on disk.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EmittedFile {
    /// Path relative to the output folder, with `/` between its parts.
    pub path: String,
    pub contents: String,
}

impl EmittedFile {
    pub fn new(path: impl Into<String>, contents: impl Into<String>) -> Self {
        Self {
            path: path.into(),
            contents: contents.into(),
        }
    }
}

/// Whether a file that is there already may be replaced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overwrite {
    Refuse,
    Replace,
}

impl Overwrite {
    pub fn when_forced(force: bool) -> Self {
        if force { Self::Replace } else { Self::Refuse }
    }

    pub fn allows(self, path: &Path) -> bool {
        match self {
            Self::Refuse => path.symlink_metadata().is_err(),
            Self::Replace => true,
        }
    }
}

/// Makes `path` of what `fill` writes, in one step, or replaces it.
///
/// # Errors
/// [`io::ErrorKind::AlreadyExists`] for a file that may not be replaced, also one that appears meanwhile, and those of
/// the file system; then `path` is as it was, and nothing is left beside it. What a process that was killed has left
/// there is removed by the next call.
pub fn write_whole(
    path: &Path,
    overwrite: Overwrite,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    if !overwrite.allows(path) {
        return Err(io::ErrorKind::AlreadyExists.into());
    }
    // What is no file, such as /dev/null or a pipe, would be gone; a link stays, its file is replaced.
    let place = match path.metadata() {
        Ok(found) if !found.is_file() => {
            return Err(io::Error::other("it is there and no regular file"));
        }
        Ok(_) => path.canonicalize()?,
        Err(_) => path.to_owned(),
    };
    remove_left_in(match place.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        Some(_) | None => Path::new("."),
    });
    let mut part = Part::beside(&place)?;
    let mut file = BufWriter::new(&part.file);
    fill(&mut file)?;
    file.into_inner()?.sync_all()?;
    part.put(overwrite)
}
