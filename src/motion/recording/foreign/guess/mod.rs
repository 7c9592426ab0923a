//! A first map for an unknown log: from the names of its columns, then checked and completed by its numbers.
//!
//! `first_map` is the way from one to the other; `names` says what a name means, by the words of
//! `vocabulary`; `evidence` compares positions with velocities to find units, signs, axes and the order
//! of a quaternion; `write` prints the map with what it rests on.

mod columns;
mod evidence;
mod first_map;
mod names;
mod vocabulary;
mod write;

pub(in crate::recording) use first_map::guess_of;
pub use first_map::{Guess, guess};
