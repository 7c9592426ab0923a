//! The jump that a figure shows: the end of its name and the words of its caption.

use std::path::Path;

use super::tables::file_name;

/// Which jump a figure shows.
pub(super) struct Place {
    /// Number from 1, which ends the figure's name.
    pub suffix: String,
    /// Name of the recording, with the row where the jump begins if there may be several.
    pub words: String,
}

impl Place {
    /// A recording.
    pub fn of_recording(index: usize, path: &Path) -> Self {
        let name = file_name(path);
        let stem = name.trim_end_matches(".gz").trim_end_matches(".csv");
        Self {
            suffix: (index + 1).to_string(),
            words: stem.to_owned(),
        }
    }
}
