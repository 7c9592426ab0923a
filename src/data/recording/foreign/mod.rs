//! Logs of other programs: columns and topics of any name, unit, order and clock become a recording.
//!
//! `map` is the file that says what stands where, `elements` the words in it; `log` holds what was read, `text` reads
//! it from text files, `mcap` from MCAP files and folders of them by the definitions of their messages (`message`), one
//! table per topic and set of names (`topics`), `mcap_write` writes those; `signal` takes a quantity from it;
//! `assemble` brings all quantities to one clock, turns quaternions and rates of the body's own axes into roll, pitch,
//! yaw and their rates (`attitude`), and makes segments; `guess` writes a first map.

mod assemble;
mod elements;
pub mod guess;
mod map;
mod mcap;
mod mcap_write;
mod message;
mod signal;
mod text;
mod topics;

pub(super) use assemble::assemble;
pub(super) use elements::angles_of_quaternions;
pub use map::ColumnMap;
pub(super) use map::TextFormat;
pub(super) use mcap::{is_mcap, read_mcap};
pub use mcap_write::JOINT_TOPIC;
pub(super) use mcap_write::write_mcap;
pub(super) use text::{read_lines, read_texts};
