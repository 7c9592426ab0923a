//! Limits on the bytes read of a file, and on the bytes that those unpack to, independent of the sizes that the file
//! states.

use std::io::Read;

use super::magic::{OtherFormat, recognised};
use super::*;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    Settings,
    Robot,
    Model,
    Equations,
    Tensors,
    Recording,
    Chunk,
}

const MB: u64 = 1 << 20;

impl Format {
    const fn facts(self) -> (u64, &'static str) {
        match self {
            Self::Settings => (2 * MB, "settings"),
            Self::Robot => (16 * MB, "a URDF"),
            Self::Model => (32 * MB, "a model"),
            Self::Equations => (16 * MB, "equations"),
            Self::Tensors => (4096 * MB, "tensors"),
            Self::Recording => (4096 * MB, "a recording"),
            Self::Chunk => (1024 * MB, "a chunk of a log"),
        }
    }

    pub const fn most_bytes(self) -> u64 {
        self.facts().0
    }

    /// Logs of real sensors shrink to a tenth, not to a two-hundredth.
    pub fn most_unpacked(self, packed: u64) -> u64 {
        const RATIO: u64 = 200;
        const ALWAYS: u64 = 32 * MB;
        (RATIO.saturating_mul(packed).saturating_add(ALWAYS)).min(self.most_bytes())
    }

    pub(crate) fn too_large(self, most: u64) -> io::Error {
        let text = format!(
            "more than {most} bytes, expected at most so many of {}",
            self.facts().1
        );
        io::Error::new(io::ErrorKind::FileTooLarge, text)
    }
}

/// A source that fails beyond a number of bytes instead of ending there.
#[derive(Debug)]
pub struct Capped<R> {
    source: R,
    format: Format,
    most: u64,
    left: u64,
}

impl<R: Read> Capped<R> {
    pub fn new(source: R, format: Format, most: u64) -> Self {
        let left = most;
        Self {
            source,
            format,
            most,
            left,
        }
    }
}

impl<R: Read> Read for Capped<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.source.read(buffer)?;
        self.left = (self.left.checked_sub(count as u64))
            .ok_or_else(|| self.format.too_large(self.most))?;
        Ok(count)
    }
}

pub fn read_capped(path: &Path, format: Format) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let file = File::open(path)?;
    Capped::new(file, format, format.most_bytes()).read_to_end(&mut bytes)?;
    Ok(bytes)
}

pub fn read_text_capped(path: &Path, format: Format) -> io::Result<String> {
    let bytes = read_capped(path, format)?;
    let invalid = |text: String| io::Error::new(io::ErrorKind::InvalidData, text);
    if let Some(OtherFormat { what, remedy, .. }) = recognised(path, &bytes) {
        let expected = format.facts().1;
        let text = format!("found {what}, expected {expected}; convert it with: {remedy}");
        return Err(invalid(text));
    }
    String::from_utf8(bytes).map_err(|error| invalid(error.to_string()))
}

/// Counted by their signs: a parsed table needs several hundred times its two bytes in a file.
const MOST_TABLES: usize = 20_000;

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
