//! Logs of other programs: columns and topics of any name, unit, order and clock become a recording.
//!
//! [`map`] is the file that says what stands where, [`units`] and [`elements`] the words in it;
//! [`log`] holds what was read, [`text`] reads it from text files; [`signal`] takes a quantity from it;
//! [`assemble`] brings all quantities to one clock, turns quaternions and rates of the body's own axes
//! into roll, pitch, yaw and their rates ([`attitude`]), and makes segments; [`guess`] writes a first map.

pub mod guess;
pub mod map;

mod assemble;
mod attitude;
mod elements;

mod interpolate;
mod log;
mod signal;
mod text;
mod units;

pub use assemble::Assembled;
pub(super) use assemble::assemble;
pub(super) use text::read_texts;
