//! What the joints take of the motors' torques, from recordings.

use super::output::note;
use crate::Error;
use crate::identify::identify;
use crate::recording::RecordingFiles;
use crate::robot::{Actuators, Robot};

/// The word that stands for no file.
pub(super) const NONE: &str = "none";

/// The word that stands for what the training recordings tell.
pub(super) const IDENTIFIED: &str = "identify";
/// Files of recordings that tell it, at most.
const IDENTIFIED_FROM: usize = 20;

/// The actuators that the first recordings tell, `None` with a note on stderr where they do not.
///
/// # Errors
/// [`Error::Recording`] for a file that cannot be read.
pub(super) fn identified(
    recordings: &RecordingFiles,
    robot: &Robot,
) -> Result<Option<Actuators>, Error> {
    let found = identify(&recordings.first(IDENTIFIED_FROM)?, robot);
    let reason = match found.map(|found| (found.contradiction(), found.actuators)) {
        Ok((None, actuators)) => return Ok(Some(actuators)),
        Ok((Some(reason), _)) => reason,
        Err(reason) => reason.to_string(),
    };
    note(&format!(
        "torques are those of the motors, as the recordings do not tell the joints' losses: {reason}"
    ));
    Ok(None)
}
