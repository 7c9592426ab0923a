//! Putting emitted files into a folder, whole or not at all.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::{fs, io};

use super::target::EmittedFile;
use crate::files::Overwrite;

/// Names the files of the folder that were emitted, one a line.
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
    let manifest = folder.join(MANIFEST);
    let own: BTreeSet<String> = match fs::read_to_string(&manifest) {
        Ok(text) => text.lines().map(str::to_owned).collect(),
        Err(error) if error.kind() == io::ErrorKind::NotFound => BTreeSet::new(),
        Err(error) => return Err(io_error(&manifest, error)),
    };
    for file in files {
        let path = folder.join(&file.path);
        let is_own = own.contains(&file.path) || overwrite == Overwrite::Replace;
        if path.symlink_metadata().is_ok() && (path.is_dir() || !is_own) {
            return Err(FolderError::Foreign { path });
        }
    }
    let mut names = own;
    names.extend(files.iter().map(|file| file.path.clone()));
    let list: String = names.iter().map(|name| format!("{name}\n")).collect();
    // The list comes first: after an interruption each finished file is known as ours.
    let list = EmittedFile::new(MANIFEST, list);

    let mut staged = Vec::new();
    let result = std::iter::once(&list)
        .chain(files)
        .try_for_each(|file| stage(folder, file).map(|paths| staged.push(paths)));
    if let Err(error) = result {
        for (beside, _) in &staged {
            // The first error is the one to report; what stays behind is only rubbish.
            let _ = fs::remove_file(beside);
        }
        return Err(error);
    }
    for (beside, path) in &staged {
        fs::rename(beside, path).map_err(|error| io_error(path, error))?;
    }
    Ok(staged.into_iter().skip(1).map(|(_, path)| path).collect())
}

/// Writes a file beside its place; returns where it is and where it belongs.
fn stage(folder: &Path, file: &EmittedFile) -> Result<(PathBuf, PathBuf), FolderError> {
    let path = folder.join(&file.path);
    let parent = path.parent().unwrap_or(folder);
    fs::create_dir_all(parent).map_err(|error| io_error(parent, error))?;
    let name = path.file_name().expect("emitted files have names");
    let name = name.to_string_lossy();
    let beside = parent.join(format!(".{name}.romc-part"));
    fs::write(&beside, &file.contents).map_err(|error| io_error(&beside, error))?;
    Ok((beside, path))
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
