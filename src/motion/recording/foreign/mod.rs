//! Logs of other programs: columns and topics of any name, unit, order and clock become a recording.
//!
//! `map` is the file that says what stands where, `units` and `elements` the words in it;
//! `log` holds what was read, `text` reads it from text files, `mcap` from MCAP files
//! by the definitions of their messages (`message`), `mcap_write` writes those; `signal` takes a quantity from it;
//! `assemble` brings all quantities to one clock, turns quaternions and rates of the body's own axes
//! into roll, pitch, yaw and their rates (`attitude`), and makes segments; `guess` writes a first map.

pub mod guess;
pub mod map;

mod assemble;
mod attitude;
mod elements;

mod interpolate;
mod log;
mod map_checks;
mod mcap;
mod mcap_write;
mod message;
mod signal;
mod text;
mod units;

pub(super) use assemble::assemble;
pub(super) use mcap::read_mcap;
pub(super) use mcap_write::write_mcap;
pub use mcap_write::{BODY_TOPIC, FEET_TOPIC, INPUT_TOPIC, JOINT_TOPIC};
pub(super) use text::read_texts;
