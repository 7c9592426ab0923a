//! Putting emitted files into a folder, whole or not at all.

use std::collections::BTreeSet;
use std::fs::OpenOptions;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::{fs, io};

use super::emitted::EmittedFile;
use super::whole::{Overwrite, beside};

/// Names the files of the folder that were emitted, one per line.
const MANIFEST: &str = ".romc-emitted";

/// Why files could not be written.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// The folder holds a file of this name that romc did not make.
    #[error("{path}: not made by romc; move it away or use --force to replace it")]
    Foreign {
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

/// Refuses a folder that holds files of these names that romc did not make.
///
/// # Errors
/// [`FolderError::Foreign`], [`FolderError::Io`].
pub fn check_folder<'a>(
    folder: &Path,
    names: impl IntoIterator<Item = &'a str>,
    overwrite: Overwrite,
) -> Result<(), FolderError> {
    let own = emitted_names(folder)?;
    for name in names {
        let path = folder.join(name);
        let is_own = own.contains(name) || overwrite == Overwrite::Replace;
        if path.symlink_metadata().is_ok() && (path.is_dir() || !is_own) {
            return Err(FolderError::Foreign { path });
        }
    }
    Ok(())
}

/// Writes the files into `folder`, which is made if it does not exist. Every file is first
/// written beside its place, then renamed; nothing is renamed before all are written.
/// Files of earlier runs that are no longer emitted stay.
///
/// # Errors
/// [`FolderError::Foreign`] before anything is written, [`FolderError::Io`].
pub fn write_files(
    folder: &Path,
    files: &[EmittedFile],
    overwrite: Overwrite,
) -> Result<Vec<PathBuf>, FolderError> {
    let names = || files.iter().map(|file| file.path.as_str());
    check_folder(folder, names(), overwrite)?;
    let mut staged = Staged::default();
    for file in files {
        staged.add(folder, file)?;
    }
    // The list comes first: after an interruption each finished file is known as ours.
    list(folder, names())?;
    for (beside, path) in &staged.0 {
        fs::rename(beside, path).map_err(|error| io_error(path, error))?;
    }
    Ok(staged.0.iter().map(|(_, path)| path.clone()).collect())
}

/// The files of a folder that romc made.
fn emitted_names(folder: &Path) -> Result<BTreeSet<String>, FolderError> {
    let manifest = folder.join(MANIFEST);
    match fs::read_to_string(&manifest) {
        Ok(text) => Ok(text.lines().map(str::to_owned).collect()),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(BTreeSet::new()),
        Err(error) => Err(io_error(&manifest, error)),
    }
}

/// Adds names to the list of the folder's files: by appending, so that runs at the same time keep each
/// other's.
fn list<'a>(folder: &Path, names: impl Iterator<Item = &'a str>) -> Result<(), FolderError> {
    let known = emitted_names(folder)?;
    let new: String = names
        .filter(|name| !known.contains(*name))
        .map(|name| format!("{name}\n"))
        .collect();
    let manifest = folder.join(MANIFEST);
    let opened = OpenOptions::new().append(true).create(true).open(&manifest);
    opened
        .and_then(|mut file| file.write_all(new.as_bytes()))
        .map_err(|error| io_error(&manifest, error))
}

/// Files beside their places, with these places; what has not been renamed is removed in the end.
#[derive(Default)]
struct Staged(Vec<(PathBuf, PathBuf)>);

impl Staged {
    fn add(&mut self, folder: &Path, file: &EmittedFile) -> Result<(), FolderError> {
        let path = folder.join(&file.path);
        let parent = path.parent().unwrap_or(folder);
        fs::create_dir_all(parent).map_err(|error| io_error(parent, error))?;
        let beside = beside(&path).map_err(|error| io_error(&path, error))?;
        self.0.push((beside.clone(), path));
        fs::write(&beside, &file.contents).map_err(|error| io_error(&beside, error))
    }
}

impl Drop for Staged {
    fn drop(&mut self) {
        for (beside, _) in &self.0 {
            // After success there is nothing; after an error, that one is reported.
            let _ = fs::remove_file(beside);
        }
    }
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
        assert_eq!(names, [MANIFEST, "m", "m.c"]);
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
        let own = emitted_names(folder.path()).expect("a list");
        assert!(own.contains("a.c") && own.contains("b.c"));
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
}
