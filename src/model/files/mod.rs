//! Files that appear whole or not at all, and the folders that hold emitted files.
//!
//! Imports nothing; every stage that writes files uses it. [`write_whole`] replaces one file in one step.
//! [`write_files`] puts [`EmittedFile`]s into a folder and lists them there with digests, so that only files of romc
//! are replaced. Stages that read report the place of a fault with [`Located`], limit the size by [`size`], and
//! identify unsupported formats by [`magic`]. `text` restricts texts of files that reach a terminal or a shell.

pub mod magic;
pub mod size;

mod folder;
mod located;
mod text;
mod whole;

pub use folder::{
    Emitted, FolderError, check_folder, earlier_files, hex, write_files, write_files_since,
};
pub use located::{Fault, Located, Place};
pub use text::{is_invisible, shell_path, shell_word};
pub use whole::{EmittedFile, Overwrite, write_whole};

use std::fs::{self, File, OpenOptions, TryLockError};
use std::path::{Path, PathBuf};
use std::{fmt, io};
