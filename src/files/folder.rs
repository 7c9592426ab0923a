//! Putting emitted files into a folder, whole or not at all.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{File, OpenOptions};
use std::io::{Read as _, Seek as _, Write as _};
use std::path::{Path, PathBuf};
use std::{fs, io};

use sha2::{Digest as _, Sha256};

use super::emitted::EmittedFile;
use super::part::{Part, remove_left_in};
use super::whole::Overwrite;

/// Lists what romc wrote into the folder.
const LIST: &str = ".romc-emitted";

/// Why files could not be written.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// The folder holds a file of this name that romc did not make.
    #[error("{path}: not made by romc; move it away or use --force to replace it")]
    Foreign {
        /// The file.
        path: PathBuf,
    },
    /// The folder holds a file that romc made, with other contents.
    #[error("{path}: changed since romc made it; move it away or use --force to replace it")]
    Changed {
        /// The file.
        path: PathBuf,
    },
    /// The system refused.
    #[error("{path}")]
    Io {
        /// File or folder.
        path: PathBuf,
        /// What the system says.
        #[source]
        source: io::Error,
    },
}

/// Refuses a folder that holds files of these names whose contents romc did not write.
///
/// # Errors
/// [`FolderError::Foreign`], [`FolderError::Changed`], [`FolderError::Io`].
pub fn check_folder<'a>(
    folder: &Path,
    names: impl IntoIterator<Item = &'a str>,
    overwrite: Overwrite,
) -> Result<(), FolderError> {
    let emitted = Emitted::read(folder)?;
    names
        .into_iter()
        .try_for_each(|name| emitted.check(folder, name, None, overwrite))
}

/// Files that earlier runs wrote into `folder`, beside `files`, and that are as romc made them.
///
/// # Errors
/// [`FolderError::Io`], [`FolderError::Foreign`] for a list of files that is none.
pub fn earlier_files(folder: &Path, files: &[EmittedFile]) -> Result<Vec<PathBuf>, FolderError> {
    Ok(Emitted::read(folder)?.others(folder, files))
}

/// Writes the files into `folder`, which is made if it does not exist. Every file is first
/// written beside its place, then renamed; nothing is renamed before all are written.
/// Files of earlier runs that are no longer emitted stay.
///
/// # Errors
/// [`FolderError::Foreign`] and [`FolderError::Changed`] before anything is written, [`FolderError::Io`].
pub fn write_files(
    folder: &Path,
    files: &[EmittedFile],
    overwrite: Overwrite,
) -> Result<Vec<PathBuf>, FolderError> {
    let emitted = Emitted::read(folder)?;
    for file in files {
        emitted.check(folder, &file.path, Some(file), overwrite)?;
    }
    let mut staged = staged(folder, files)?;
    // The list comes first: after an interruption each finished file is known as ours.
    emitted.extend(folder, files)?;
    for part in &mut staged {
        let put = part.put();
        put.map_err(|error| io_error(part.place(), error))?;
    }
    settle(folder)?;
    Ok(staged.iter().map(|part| part.place().to_owned()).collect())
}

/// The files that romc wrote into a folder: of each name the digest of its contents, and while a run lasts that of the
/// new ones.
///
/// A line of the list is a SHA-256 digest, two spaces and a name, as `sha256sum` prints them.
#[derive(Debug, Default)]
struct Emitted(BTreeMap<String, BTreeSet<String>>);

impl Emitted {
    fn read(folder: &Path) -> Result<Self, FolderError> {
        let list = folder.join(LIST);
        match list.symlink_metadata() {
            // Lines that go into somebody else's file would change it.
            Ok(found) if !found.is_file() => return Err(FolderError::Foreign { path: list }),
            Ok(_) => {}
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Self::default()),
            Err(error) => return Err(io_error(&list, error)),
        }
        let text = fs::read_to_string(&list).map_err(|error| io_error(&list, error))?;
        let mut emitted = Self::default();
        for (digest, name) in text.lines().filter_map(|line| line.split_once("  ")) {
            let digests = emitted.0.entry(name.to_owned()).or_default();
            digests.insert(digest.to_owned());
        }
        Ok(emitted)
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
        let is_listed = self.0.contains_key(name);
        if overwrite == Overwrite::Replace || (found.is_file() && self.is_own(&path, name, new)) {
            Ok(())
        } else if is_listed {
            Err(FolderError::Changed { path })
        } else {
            Err(FolderError::Foreign { path })
        }
    }

    /// Whether the contents at `path` are ones that romc wrote under this name, or writes now.
    fn is_own(&self, path: &Path, name: &str, new: Option<&EmittedFile>) -> bool {
        let Ok(contents) = fs::read(path) else {
            return false;
        };
        let is_listed = |digests: &BTreeSet<String>| digests.contains(&digest(&contents));
        new.is_some_and(|new| new.contents.as_bytes() == contents)
            || self.0.get(name).is_some_and(is_listed)
    }

    /// Adds files to the list by appending under a lock, so that runs at the same time keep each other's lines.
    fn extend(&self, folder: &Path, files: &[EmittedFile]) -> Result<(), FolderError> {
        let mut lines = String::new();
        for file in files {
            let digest = digest(file.contents.as_bytes());
            let known = self.0.get(&file.path);
            if !known.is_some_and(|digests| digests.contains(&digest)) {
                lines += &format!("{digest}  {}\n", file.path);
            }
        }
        let list = folder.join(LIST);
        let opened = OpenOptions::new().append(true).create(true).open(&list);
        opened
            .and_then(|mut file| {
                locked(&file)?;
                file.write_all(lines.as_bytes())
            })
            .map_err(|error| io_error(&list, error))
    }

    /// Files of the list beside `files` that are as romc wrote them.
    fn others(&self, folder: &Path, files: &[EmittedFile]) -> Vec<PathBuf> {
        let now: BTreeSet<&str> = files.iter().map(|file| file.path.as_str()).collect();
        let others = self.0.keys().filter(|name| !now.contains(name.as_str()));
        others
            .map(|name| (name, folder.join(name)))
            .filter(|(name, path)| path.is_file() && self.is_own(path, name, None))
            .map(|(_, path)| path)
            .collect()
    }
}

/// Drops earlier digests of files from the list of a folder: of each name the one stays that its file has now, or else
/// the last. Equal emissions leave equal lists.
fn settle(folder: &Path) -> Result<(), FolderError> {
    let list = folder.join(LIST);
    let settle = || {
        let mut file = OpenOptions::new().read(true).write(true).open(&list)?;
        locked(&file)?;
        let mut text = String::new();
        file.read_to_string(&mut text)?;
        let mut kept: Vec<(&str, Vec<&str>)> = Vec::new();
        for (digest, name) in text.lines().filter_map(|line| line.split_once("  ")) {
            match kept.iter_mut().find(|(known, _)| *known == name) {
                Some((_, digests)) => digests.push(digest),
                None => kept.push((name, vec![digest])),
            }
        }
        let mut settled = String::new();
        for (name, digests) in kept {
            let last = digests[digests.len() - 1];
            let now = (digests.len() > 1)
                .then(|| fs::read(folder.join(name)).ok())
                .flatten()
                .map(|contents| digest(&contents));
            let of_now = digests.iter().find(|known| Some(**known) == now.as_deref());
            settled += &format!("{}  {name}\n", of_now.unwrap_or(&last));
        }
        if settled != text {
            file.set_len(0)?;
            file.rewind()?;
            file.write_all(settled.as_bytes())?;
        }
        Ok(())
    };
    settle().map_err(|error| io_error(&list, error))
}

/// Waits for the lock of the list, which ends with the file; where the file system has none, runs at the same time
/// may lose each other's lines, and a file is then refused as changed.
fn locked(file: &File) -> io::Result<()> {
    match file.lock() {
        Err(error) if error.kind() != io::ErrorKind::Unsupported => Err(error),
        _ => Ok(()),
    }
}

/// SHA-256 in hexadecimal digits.
fn digest(contents: &[u8]) -> String {
    let bytes = Sha256::digest(contents);
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Files beside their places.
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

#[cfg(test)]
mod tests {
    use super::*;

    fn files(contents: &str) -> Vec<EmittedFile> {
        vec![
            EmittedFile::new("m.c", contents),
            EmittedFile::new("m/src/lib.rs", contents),
        ]
    }

    #[test]
    fn second_run_replaces_own_files_and_leaves_no_part() {
        let folder = tempfile::tempdir().expect("a folder");
        let out = folder.path().join("new/out");
        write_files(&out, &files("one"), Overwrite::Refuse).expect("first");
        let written = write_files(&out, &files("two"), Overwrite::Refuse).expect("second");
        assert_eq!(written, [out.join("m.c"), out.join("m/src/lib.rs")]);
        for path in written {
            assert_eq!(fs::read_to_string(path).expect("written"), "two");
        }
        let mut names: Vec<_> = fs::read_dir(&out)
            .expect("a folder")
            .map(|entry| entry.expect("an entry").file_name())
            .collect();
        names.sort();
        assert_eq!(names, [LIST, "m", "m.c"]);
    }

    #[test]
    fn a_place_that_cannot_be_taken_leaves_no_part() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut files = files("one");
        files.push(EmittedFile::new(
            "m.c/below",
            "a file stands where a folder should",
        ));
        let found = write_files(folder.path(), &files, Overwrite::Refuse);
        assert!(matches!(found, Err(FolderError::Io { .. })), "{found:?}");
        let left = fs::read_dir(folder.path()).expect("a folder");
        let names = left.map(|entry| entry.expect("an entry").file_name());
        let parts = names.filter(|name| name.to_string_lossy().ends_with(".part"));
        assert_eq!(parts.count(), 0);
    }

    #[test]
    fn runs_into_one_folder_at_a_time_leave_all_files_and_one_list() {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |name: &str| {
            let file = EmittedFile::new(name, "text");
            write_files(folder.path(), &[file], Overwrite::Refuse).expect("written")
        };
        write("a.c");
        write("b.c");
        let own = Emitted::read(folder.path()).expect("a list").0;
        assert!(own.contains_key("a.c") && own.contains_key("b.c"));
        write("a.c");
    }

    #[test]
    fn foreign_file_is_refused_and_kept_unless_forced() {
        let folder = tempfile::tempdir().expect("a folder");
        let foreign = folder.path().join("m.c");
        fs::write(&foreign, "mine").expect("written");
        let found = write_files(folder.path(), &files("new"), Overwrite::Refuse);
        assert!(matches!(found, Err(FolderError::Foreign { path }) if path == foreign));
        assert_eq!(fs::read_to_string(&foreign).expect("kept"), "mine");
        assert!(!folder.path().join("m").exists());
        write_files(folder.path(), &files("new"), Overwrite::Replace).expect("forced");
        assert_eq!(fs::read_to_string(&foreign).expect("replaced"), "new");
    }

    #[test]
    fn an_emitted_file_that_was_changed_is_refused_and_kept() {
        let folder = tempfile::tempdir().expect("a folder");
        write_files(folder.path(), &files("one"), Overwrite::Refuse).expect("first");
        let own = folder.path().join("m.c");
        fs::write(&own, "my own work").expect("written");
        let found = write_files(folder.path(), &files("two"), Overwrite::Refuse);
        assert!(matches!(found, Err(FolderError::Changed { path }) if path == own));
        assert_eq!(fs::read_to_string(&own).expect("kept"), "my own work");
        let other = folder.path().join("m/src/lib.rs");
        assert_eq!(fs::read_to_string(other).expect("kept"), "one");
        let checked = check_folder(folder.path(), ["m.c"], Overwrite::Refuse);
        assert!(matches!(checked, Err(FolderError::Changed { .. })));
        // What romc would write anyway is no loss.
        fs::write(&own, "two").expect("written");
        write_files(folder.path(), &files("two"), Overwrite::Refuse).expect("the same bytes");
    }

    #[test]
    fn files_of_earlier_runs_are_named_unless_changed() {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |name: &str| {
            let file = EmittedFile::new(name, "text");
            write_files(folder.path(), &[file], Overwrite::Refuse).expect("written")
        };
        write("old.c");
        write("mine.c");
        fs::write(folder.path().join("mine.c"), "changed").expect("written");
        write("new.c");
        let now = [EmittedFile::new("new.c", "text")];
        let earlier = earlier_files(folder.path(), &now).expect("a list");
        assert_eq!(earlier, [folder.path().join("old.c")]);
    }

    #[cfg(unix)]
    #[test]
    fn links_in_the_way_are_refused_and_what_they_lead_to_is_kept() {
        let folder = tempfile::tempdir().expect("a folder");
        let victim = folder.path().join("victim");
        fs::write(&victim, "precious").expect("written");
        for name in [LIST, "m.c"] {
            let link = folder.path().join(name);
            std::os::unix::fs::symlink(&victim, &link).expect("a link");
            let found = write_files(folder.path(), &files("one"), Overwrite::Refuse);
            assert!(matches!(found, Err(FolderError::Foreign { path }) if path == link));
            fs::remove_file(link).expect("removed");
        }
        assert_eq!(fs::read_to_string(victim).expect("kept"), "precious");
    }
}
