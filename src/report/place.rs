//! The jump that a figure shows: the end of its name and the words of its caption.

use std::path::Path;

use crate::evaluate::SegmentRun;

/// Which jump a figure shows.
pub(super) struct Place {
    /// Number from 1, which ends the figure's name.
    pub suffix: String,
    /// Name of the recording, with the row where the jump begins if there may be several.
    pub words: String,
}

impl Place {
    /// A whole recording, as the controller follows it.
    pub fn of_recording(index: usize, path: &Path) -> Self {
        Self {
            suffix: (index + 1).to_string(),
            words: stem(path),
        }
    }

    /// One segment of a recording, perhaps of several.
    pub fn of_segment(index: usize, run: &SegmentRun<'_>, is_one_of_several: bool) -> Self {
        let (path, row) = (&run.segment.path, run.segment.first_row);
        let mut words = stem(path);
        if is_one_of_several {
            words.push_str(&format!(", from row {row}"));
        }
        Self {
            suffix: (index + 1).to_string(),
            words,
        }
    }
}

/// Name of a recording without folder and endings.
fn stem(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let name = name.trim_end_matches(".gz").trim_end_matches(".csv");
    name.to_owned()
}
