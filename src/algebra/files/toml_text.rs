//! Texts of TOML files, bounded in size and in tables.

use std::io;
use std::path::Path;

use super::size::{Format, read_text_capped};

/// Most tables and dotted keys of a file, by their signs: a parsed table takes several hundred times the two bytes that it
/// has in a file.
const MOST_TABLES: usize = 20_000;

/// The text of a TOML file.
///
/// # Errors
/// As [`read_text_capped`], and [`io::ErrorKind::InvalidData`] for a file of more tables than any settings have.
pub fn read_toml(path: &Path) -> io::Result<String> {
    let text = read_text_capped(path, Format::Settings)?;
    match text.bytes().filter(|byte| b".[{".contains(byte)).count() {
        ..=MOST_TABLES => Ok(text),
        found => {
            let text = format!(
                "found {found} signs of tables (`.`, `[`, `{{`), expected at most {MOST_TABLES}"
            );
            Err(io::Error::new(io::ErrorKind::InvalidData, text))
        }
    }
}
