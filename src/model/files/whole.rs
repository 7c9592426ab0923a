//! One file, written next to its place and then moved there.

use std::collections::hash_map::RandomState;
use std::ffi::OsString;
use std::hash::{BuildHasher as _, Hasher as _};
use std::io::{BufWriter, Write};

use super::*;

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

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overwrite {
    Refuse,
    Replace,
}

/// Whether it is forced.
impl From<bool> for Overwrite {
    fn from(force: bool) -> Self {
        if force { Self::Replace } else { Self::Refuse }
    }
}

impl Overwrite {
    pub fn allows(self, path: &Path) -> bool {
        match self {
            Self::Refuse => path.symlink_metadata().is_err(),
            Self::Replace => true,
        }
    }
}

/// Creates or replaces `path` in one step with the bytes that `fill` writes.
///
/// # Errors
/// [`io::ErrorKind::AlreadyExists`] for a file that may not be replaced, also one that appears meanwhile, and errors of
/// the file system. Then `path` is unchanged, and no other file is left. Files left by a killed process are removed by
/// the next call.
pub fn write_whole(
    path: &Path,
    overwrite: Overwrite,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    if !overwrite.allows(path) {
        return Err(io::ErrorKind::AlreadyExists.into());
    }
    // Anything but a regular file, such as /dev/null or a pipe, would be lost. A link stays; its file is replaced.
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

const ENDING: &str = ".part";
const DIGITS: usize = 16;
const MAX_TRIED: usize = 16;

/// A new hidden file, removed unless it is moved to its place; its lock shows that the process lives.
pub(super) struct Part {
    pub file: File,
    path: PathBuf,
    pub place: PathBuf,
    is_placed: bool,
}

impl Part {
    /// A link or file of that name is never opened.
    pub(crate) fn beside(place: &Path) -> io::Result<Self> {
        let name = place.file_name().ok_or(io::ErrorKind::InvalidFilename)?;
        let mut last = None;
        for _ in 0..MAX_TRIED {
            let number = RandomState::new().build_hasher().finish();
            let mut part = OsString::from(".");
            part.push(name);
            part.push(format!(".{number:0DIGITS$x}{ENDING}"));
            let path = place.with_file_name(part);
            match OpenOptions::new().write(true).create_new(true).open(&path) {
                Ok(file) => {
                    let locked = file.try_lock();
                    // `remove_left_in` of another process may have met it before the lock.
                    let is_removed = matches!(locked, Err(TryLockError::WouldBlock))
                        || path.symlink_metadata().is_err();
                    if !is_removed {
                        return Ok(Self {
                            file,
                            path,
                            place: place.to_owned(),
                            is_placed: false,
                        });
                    }
                }
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => last = Some(error),
                Err(error) => return Err(error),
            }
        }
        Err(last.unwrap_or_else(|| io::ErrorKind::AlreadyExists.into()))
    }

    /// In one step. Of several processes that refuse, one alone succeeds.
    pub(crate) fn put(&mut self, overwrite: Overwrite) -> io::Result<()> {
        if overwrite == Overwrite::Refuse {
            match fs::hard_link(&self.path, &self.place) {
                // The part is the second name of the file, and goes in the end.
                Ok(()) => return Ok(()),
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => return Err(error),
                // A file system without links: whoever makes the file has the place.
                Err(_) => drop(File::create_new(&self.place)?),
            }
        }
        let renamed = fs::rename(&self.path, &self.place);
        if renamed.is_err() && overwrite == Overwrite::Refuse {
            let _ = fs::remove_file(&self.place);
        }
        self.is_placed = renamed.is_ok();
        renamed
    }
}

impl Drop for Part {
    fn drop(&mut self) {
        if !self.is_placed {
            // The first error is the relevant one.
            let _ = fs::remove_file(&self.path);
        }
    }
}

pub(super) fn remove_left_in(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let is_file = entry.file_type().is_ok_and(|kind| kind.is_file());
        if is_file && is_part(&entry.file_name().to_string_lossy()) {
            let path = entry.path();
            if let Ok(file) = OpenOptions::new().write(true).open(&path)
                && file.try_lock().is_ok()
            {
                let _ = fs::remove_file(&path);
            }
        }
    }
}

/// `.NAME.0123456789abcdef.part`
fn is_part(name: &str) -> bool {
    let inner = name.strip_prefix('.');
    let inner = inner.and_then(|inner| inner.strip_suffix(ENDING));
    let number = inner.and_then(|inner| inner.rsplit_once('.'));
    number.is_some_and(|(_, digits)| {
        digits.len() == DIGITS && digits.bytes().all(|byte| byte.is_ascii_hexdigit())
    })
}
