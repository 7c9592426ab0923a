//! A first map for an unknown log: from the names of its columns, then checked and completed by its numbers. `names`
//! interprets a name, `columns` sorts columns into quantities. `scales` finds units, signs, axes and orders: `physics`
//! tries them on the robot's geometry and weight, `feet` divides forces; `write` prints the map.

mod columns;
mod feet;
mod names;
mod physics;
mod scales;
mod write;

use std::path::Path;

use columns::Group;
use nalgebra::{DMatrix, Matrix3, Vector3};
use names::unit;
use physics::{scale, slopes};

use super::text::read_text;
use super::*;
use crate::recording::error::text;
use crate::recording::foreign::map::{ColumnMap, Name};
use crate::robot::{GRAVITY_M_S2, JOINT_DIM, Leg, Robot, STATE_DIM};

const MOST_SKIPPED: usize = 20; // most lines before the header of a text
const LEAST_COLUMNS: usize = 3; // fewest columns of a table

#[derive(Debug, Clone)]
pub struct Guess {
    /// The map, TOML with comments.
    pub text: String,
    /// Quantities that a recording needs and that were not found, by their tables.
    pub missing: Vec<&'static str>,
    /// The result of reading the log with the map: the number of samples, or the error.
    pub outcome: Result<usize, String>,
    /// Notes where other interpretations of the log fit as well, or none fits.
    pub notes: Vec<String>,
    pub(crate) open: Vec<String>, // questions left open by names and numbers; used if a log is read without a map
}

/// Guesses the map of a text or MCAP file.
///
/// # Errors
/// [`RecordingError`] for a file that is no table, or whose columns have no names.
pub fn guess(path: &Path, robot: &Robot) -> Outcome<Guess> {
    if is_mcap(path) {
        return guess_of(path, &read_mcap(path)?, robot);
    }
    let (log, skip) = match read_text(path, &TextFormat::default()) {
        // Lines before the header have other numbers of cells.
        Err(error) if matches!(error.kind, RecordingFault::RowLength { .. }) => {
            let table = |skip| {
                let other = TextFormat::default();
                let log = read_text(path, &TextFormat { skip, ..other }).ok()?;
                (log.columns.len() >= LEAST_COLUMNS).then_some((log, skip))
            };
            (1..=MOST_SKIPPED).find_map(table).ok_or(error)?
        }
        read => (read?, 0),
    };
    let mut guess = guess_of(path, &[log], robot)?;
    if skip > 0 {
        let skip = format!("[text]\nskip = {skip}   # lines before the header\n\n[time]\n");
        guess.text = guess.text.replacen("[time]\n", &skip, 1);
    }
    Ok(guess)
}

pub(crate) fn guess_of(path: &Path, logs: &[Log], robot: &Robot) -> Outcome<Guess> {
    if logs.iter().all(|log| !log.is_named) {
        let found = "found columns without names, of which no map can be guessed";
        return Err(text(format!("{found}; a map counts them from 1")).of(path));
    }
    Ok(write::guessed(path, logs, robot))
}
