//! Logs of other programs: columns and topics of any name, unit, order and clock become a recording. `map` assigns
//! columns to quantities, `elements` has the words in it. `text` reads text files, `mcap` MCAP files and folders of
//! them by the definitions of their messages (`message`), one table per topic and set of names (`topics`). `signal`
//! extracts a quantity from a log; `assemble` converts all to one clock and makes segments; `guess` writes a first map.

mod assemble;
mod elements;
pub(super) mod guess;
pub(super) mod map;
mod mcap;
pub(super) mod mcap_write;
mod message;
mod signal;
mod text;
mod topics;

pub(super) use assemble::assemble;
pub(super) use elements::angles_of_quaternions;
pub(super) use map::TextFormat;
pub(super) use mcap::{is_mcap, read_mcap};
pub(super) use mcap_write::write_mcap;
pub(super) use text::{read_lines, read_texts};

use std::borrow::Cow;
use std::collections::BTreeMap;

use elements::{Dimension, QUATERNION, Quantity, angle_rates, in_world, named, ordered, unwrap};
use map::Frame;
use signal::{Channel, Log};

use super::*;
use crate::recording::Recording;
use crate::recording::clock::Instant;
use crate::recording::error::{Checked, Outcome, RecordingError, RecordingFault, shortened};
use crate::recording::lines::{self, Lines, MAX_ROWS, NumberReader};
