//! Files that appear whole or not at all, and the folders that hold emitted files.
//!
//! Imports nothing; every stage that writes goes through here: [`write_whole`] replaces one file in one
//! step, [`write_files`] puts [`EmittedFile`]s into a folder and lists them there with digests,
//! so that only what romc wrote is replaced. Stages that
//! read state the place of a fault with [`Located`], stop where [`size`] says, and name formats that they do not read
//! by [`magic`].

pub mod magic;
pub mod size;

mod folder;
mod located;
mod part;
mod whole;

pub use folder::{FolderError, check_folder, earlier_files, hex, write_files};
pub use located::{Located, Place};
pub use whole::{EmittedFile, Overwrite, write_whole};
