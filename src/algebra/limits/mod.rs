//! Ranges of the numbers that users set, one table for flags, files of settings and programs.
//!
//! Imports nothing. [`table`] has a [`Range`] per setting; the command line parses with it, the rooms that take the
//! number check it, and a program that calls the library may ask it first.

mod range;
pub mod table;

pub use range::{OutOfRange, Range};
pub use table::of_training;
