//! Putting emitted files into a folder, whole or not at all.

use std::collections::BTreeSet;
use std::fs::{File, OpenOptions};
use std::io::{Read as _, Seek as _, Write as _};
use std::path::{Path, PathBuf};
use std::{fs, io};

use sha2::{Digest as _, Sha256};

use super::part::{Part, remove_left_in};
use super::whole::{EmittedFile, Overwrite};

const LIST: &str = ".romc-emitted";

/// Why files could not be written.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each variant's message names its fields")]
pub enum FolderError {
    #[error("{path}: not made by romc; move it away or use --force to replace it")]
    Foreign { path: PathBuf },
    #[error("{path}: changed since romc made it; move it away or use --force to replace it")]
    Changed { path: PathBuf },
    #[error(
        "{path}: another command wrote it while this one ran, which wrote nothing; give it a folder of its own, or run it again"
    )]
    Concurrent { path: PathBuf },
    #[error("{path}")]
    Io { path: PathBuf, source: io::Error },
}

/// Refuses a folder that holds files of these names whose contents romc did not write.
///
/// # Errors
/// [`FolderError::Foreign`], [`FolderError::Changed`], [`FolderError::Io`].
pub fn check_folder(
    folder: &Path,
    names: &[&str],
    overwrite: Overwrite,
) -> Result<(), FolderError> {
    check_all(folder, names.iter().map(|name| (*name, None)), overwrite)
}

/// Refuses a folder in which a name stands for something else than what romc wrote there, or writes now.
fn check_all<'a>(
    folder: &Path,
    files: impl Iterator<Item = (&'a str, Option<&'a EmittedFile>)> + Clone,
    overwrite: Overwrite,
) -> Result<(), FolderError> {
    let none = Emitted::default();
    let check = |list: &Option<List>| {
        let emitted = list.as_ref().map_or(&none, |list| &list.emitted);
        let mut files = files.clone();
        files.try_for_each(|(name, new)| emitted.check(folder, name, new, overwrite))
    };
    match List::of(folder)? {
        // A file that stands there may be that of a run which has begun the list since.
        None => check(&None).or_else(|_| check(&List::of(folder)?)),
        list => check(&list),
    }
}

/// Files that earlier runs wrote into `folder`, beside `files`, and that are as romc made them.
///
/// # Errors
/// [`FolderError::Io`], [`FolderError::Foreign`] for a list of files that is none.
pub fn earlier_files(folder: &Path, files: &[EmittedFile]) -> Result<Vec<PathBuf>, FolderError> {
    let list = List::of(folder)?;
    Ok(list.map_or_else(Vec::new, |list| list.emitted.others(folder, files)))
}

/// What earlier runs wrote into a folder when a command begins.
#[derive(Debug, Default)]
pub struct Begun(Emitted);

impl Begun {
    /// The folder as it is now; it need not be there.
    ///
    /// # Errors
    /// [`FolderError::Io`], [`FolderError::Foreign`] for a list of files that is none.
    pub fn of(folder: &Path) -> Result<Self, FolderError> {
        let list = List::of(folder)?;
        Ok(Self(list.map(|list| list.emitted).unwrap_or_default()))
    }

    fn check(&self, folder: &Path, file: &EmittedFile, now: &Emitted) -> Result<(), FolderError> {
        let (then, now) = (self.0.digests(&file.path), now.digests(&file.path));
        // Models that share a folder share this one, which builds the last of them.
        let is_shared = file.path == PROJECT;
        match is_shared || now == then || now.contains(&digest(file.contents.as_bytes())) {
            true => Ok(()),
            false => Err(FolderError::Concurrent {
                path: folder.join(&file.path),
            }),
        }
    }
}

/// [`write_files_since`] now.
///
/// # Errors
/// As it.
pub fn write_files(
    folder: &Path,
    files: &[EmittedFile],
    overwrite: Overwrite,
) -> Result<Vec<PathBuf>, FolderError> {
    write_files_since(&Begun::of(folder)?, folder, files, overwrite)
}

/// Writes the files into `folder`, which is made if it does not exist. Every file is first
/// written beside its place, then moved there; nothing is moved before all are written.
/// Files of earlier runs that are no longer emitted stay. Runs at the same time into one folder
/// move their files one after the other, under the lock of its list; of two that write other contents under one name,
/// the second is refused, unless it may replace.
///
/// # Errors
/// [`FolderError::Foreign`], [`FolderError::Changed`] and [`FolderError::Concurrent`] before anything is written,
/// [`FolderError::Io`].
pub fn write_files_since(
    begun: &Begun,
    folder: &Path,
    files: &[EmittedFile],
    overwrite: Overwrite,
) -> Result<Vec<PathBuf>, FolderError> {
    let named = files.iter().map(|file| (file.path.as_str(), Some(file)));
    check_all(folder, named, overwrite)?;
    let mut staged = staged(folder, files)?;
    let mut list = List::begun(folder)?;
    let mut is_there = Vec::with_capacity(files.len());
    for file in files {
        is_there.push(folder.join(&file.path).symlink_metadata().is_ok());
        list.emitted
            .check(folder, &file.path, Some(file), overwrite)?;
        if overwrite == Overwrite::Refuse {
            begun.check(folder, file, &list.emitted)?;
        }
    }
    // The list comes first: after an interruption each finished file is known as ours.
    list.extend(files)?;
    for (part, is_there) in staged.iter_mut().zip(is_there) {
        // What nobody has checked is not replaced.
        let overwrite = Overwrite::when_forced(is_there || overwrite == Overwrite::Replace);
        let put = part.put(overwrite);
        put.map_err(|error| io_error(&part.place, error))?;
    }
    list.settle(folder)?;
    Ok(staged.iter().map(|part| part.place.clone()).collect())
}

/// The file of a folder's CMake project, whichever model it is of.
const PROJECT: &str = "CMakeLists.txt";

const CARGOS_LINE: &[u8] = b"# This file is automatically @generated by Cargo.";

/// The files that romc wrote into a folder, in the order of its list: of each name the digest of its contents, and
/// while a run lasts that of the new ones.
///
/// A line of the list is a SHA-256 digest, two spaces and a name, as `sha256sum` prints them.
#[derive(Debug, Default)]
struct Emitted(Vec<(String, Vec<String>)>);

/// The open list of a folder, locked as long as it lives, so that nobody else renames files that it names.
#[derive(Debug)]
struct List {
    file: File,
    path: PathBuf,
    text: String,
    emitted: Emitted,
}

impl List {
    fn of(folder: &Path) -> Result<Option<Self>, FolderError> {
        Self::opened(folder, OpenOptions::new().read(true), File::lock_shared)
    }

    /// The list of a folder, to be written; a new one if it has none.
    fn begun(folder: &Path) -> Result<Self, FolderError> {
        let mut options = OpenOptions::new();
        options.read(true).write(true).create(true).truncate(false);
        let missing = || io_error(&folder.join(LIST), io::ErrorKind::NotFound.into());
        Self::opened(folder, &options, File::lock)?.ok_or_else(missing)
    }

    /// Network file systems lock for one alone only what is open for writing.
    fn opened(
        folder: &Path,
        options: &OpenOptions,
        lock: fn(&File) -> io::Result<()>,
    ) -> Result<Option<Self>, FolderError> {
        let path = folder.join(LIST);
        // Lines that go into somebody else's file would change it.
        if path.symlink_metadata().is_ok_and(|found| !found.is_file()) {
            return Err(FolderError::Foreign { path });
        }
        let read = || {
            let mut file = options.open(&path)?;
            locked(lock(&file))?;
            let mut text = String::new();
            file.read_to_string(&mut text)?;
            Ok::<_, io::Error>((file, text))
        };
        match read() {
            Ok((file, text)) => Ok(Some(Self {
                file,
                emitted: Emitted::of(&text),
                path,
                text,
            })),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(io_error(&path, error)),
        }
    }

    fn extend(&mut self, files: &[EmittedFile]) -> Result<(), FolderError> {
        let mut lines = String::new();
        for file in files {
            let digest = digest(file.contents.as_bytes());
            if !self.emitted.digests(&file.path).contains(&digest) {
                lines += &format!("{digest}  {}\n", file.path);
                self.emitted.add(&digest, &file.path);
            }
        }
        let written = self.file.write_all(lines.as_bytes());
        written.map_err(|error| io_error(&self.path, error))?;
        self.text += &lines;
        Ok(())
    }

    /// Drops earlier digests of files: of each name the one stays that its file has now, or else the last. Equal
    /// emissions leave equal lists.
    fn settle(&mut self, folder: &Path) -> Result<(), FolderError> {
        let mut settled = String::new();
        for (name, digests) in &self.emitted.0 {
            let last = &digests[digests.len() - 1];
            let contents = (digests.len() > 1).then(|| fs::read(folder.join(name)).ok());
            let now = contents.flatten().map(|contents| digest(&contents));
            let of_now = now.filter(|now| digests.contains(now));
            settled += &format!("{}  {name}\n", of_now.as_ref().unwrap_or(last));
        }
        if settled != self.text {
            let mut write = || {
                self.file.set_len(0)?;
                self.file.rewind()?;
                self.file.write_all(settled.as_bytes())
            };
            write().map_err(|error| io_error(&self.path, error))?;
        }
        Ok(())
    }
}

impl Emitted {
    fn of(list: &str) -> Self {
        let mut emitted = Self::default();
        for (digest, name) in list.lines().filter_map(|line| line.split_once("  ")) {
            emitted.add(digest, name);
        }
        emitted
    }

    fn add(&mut self, digest: &str, name: &str) {
        match self.0.iter_mut().find(|(known, _)| known == name) {
            Some((_, digests)) => digests.push(digest.to_owned()),
            None => self.0.push((name.to_owned(), vec![digest.to_owned()])),
        }
    }

    /// The digests under a name, none for one that is not in the list.
    fn digests(&self, name: &str) -> &[String] {
        let entry = self.0.iter().find(|(known, _)| known == name);
        entry.map_or(&[], |(_, digests)| digests)
    }

    /// Refuses a name that stands for something else than what romc wrote there, or `new` is.
    fn check(
        &self,
        folder: &Path,
        name: &str,
        new: Option<&EmittedFile>,
        overwrite: Overwrite,
    ) -> Result<(), FolderError> {
        let path = folder.join(name);
        let Ok(found) = path.symlink_metadata() else {
            return Ok(());
        };
        if path.is_dir() {
            return Err(FolderError::Foreign { path });
        }
        if overwrite == Overwrite::Replace || (found.is_file() && self.is_own(&path, name, new)) {
            Ok(())
        } else if self.digests(name).is_empty() {
            Err(FolderError::Foreign { path })
        } else {
            Err(FolderError::Changed { path })
        }
    }

    fn is_own(&self, path: &Path, name: &str, new: Option<&EmittedFile>) -> bool {
        let Ok(contents) = fs::read(path) else {
            return false;
        };
        // Cargo rewrites the lock file that it is given, which is nobody's work.
        let is_cargos = name.ends_with("Cargo.lock") && contents.starts_with(CARGOS_LINE);
        let own = self.digests(name);
        new.is_some_and(|new| new.contents.as_bytes() == contents)
            || !own.is_empty() && (is_cargos || own.contains(&digest(&contents)))
    }

    /// Files of the list beside `files` that are as romc wrote them.
    fn others(&self, folder: &Path, files: &[EmittedFile]) -> Vec<PathBuf> {
        let is_now = |name: &str| files.iter().any(|file| file.path == name);
        let names: BTreeSet<&String> = self.0.iter().map(|(name, _)| name).collect();
        (names.into_iter().filter(|name| !is_now(name)))
            .map(|name| (name, folder.join(name)))
            .filter(|(name, path)| path.is_file() && self.is_own(path, name, None))
            .map(|(_, path)| path)
            .collect()
    }
}

/// What became of the lock of the list, which ends with the file; where the file system has none, runs at the same time
/// may lose each other's lines, and a file is then refused as changed.
fn locked(lock: io::Result<()>) -> io::Result<()> {
    match lock {
        Err(error) if error.kind() != io::ErrorKind::Unsupported => Err(error),
        _ => Ok(()),
    }
}

/// Bytes in hexadecimal digits.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn digest(contents: &[u8]) -> String {
    hex(&Sha256::digest(contents))
}

fn staged(folder: &Path, files: &[EmittedFile]) -> Result<Vec<Part>, FolderError> {
    let mut parts = Vec::new();
    let mut tidied = BTreeSet::new();
    for file in files {
        let place = folder.join(&file.path);
        let parent = place.parent().unwrap_or(folder).to_owned();
        fs::create_dir_all(&parent).map_err(|error| io_error(&parent, error))?;
        if !tidied.contains(&parent) {
            remove_left_in(&parent);
            tidied.insert(parent);
        }
        let part = Part::beside(&place).map_err(|error| io_error(&place, error))?;
        let written = (&part.file).write_all(file.contents.as_bytes());
        written.map_err(|error| io_error(&place, error))?;
        parts.push(part);
    }
    Ok(parts)
}

fn io_error(path: &Path, source: io::Error) -> FolderError {
    FolderError::Io {
        path: path.to_owned(),
        source,
    }
}
