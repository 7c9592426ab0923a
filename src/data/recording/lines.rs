//! Lines of a file in bounded memory, their cells, and cells as numbers with a decimal point or a decimal comma.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};

use flate2::bufread::MultiGzDecoder;

use super::*;
use crate::files::magic::{MAGIC_BYTES, recognised};
use crate::files::size::{Capped, Format};

pub(super) const MAX_ROWS: usize = 1_000_000; // most samples read from a file: half an hour at 2 ms
pub(super) const MAX_LINE_BYTES: usize = 1 << 16; // longest line accepted: some thirty times a row of 71 columns

const MAX_BLANK_ROWS: usize = 10_000; // most empty lines in a row, and in all beyond one for each that is not

const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];

/// The rows of a text, without line ends, byte order mark or trailing blanks.
pub(super) struct Lines<'a> {
    source: BufReader<Box<dyn Read + 'a>>,
    path: &'a Path,
    compressed: bool,
    row: usize,
    blank: [usize; 2], // empty lines since the last that was not, and in all
    buffer: Vec<u8>,
}

impl<'a> Lines<'a> {
    pub(crate) fn open(path: &'a Path) -> Outcome<Self> {
        let file = File::open(path).map_err(|source| io_fault("open", source).of(path))?;
        let size = file.metadata().ok().filter(fs::Metadata::is_file);
        Self::of(path, file, size.map_or(u64::MAX, |size| size.len()))
    }

    /// Lines of a source of `size` bytes, plain or gzip; the size limits the unpacked length.
    pub(crate) fn of(path: &'a Path, mut source: impl Read + 'a, size: u64) -> Outcome<Self> {
        let mut start = Vec::with_capacity(MAGIC_BYTES);
        let mut first = (&mut source).take(MAGIC_BYTES as u64);
        let read = first.read_to_end(&mut start);
        read.map_err(|source| io_fault("read", source).of(path))?;
        let compressed = start.starts_with(&GZIP_MAGIC);
        let plain = recognised(path, &start).filter(|_| !compressed);
        let source = io::Cursor::new(start).chain(source);
        let format = Format::Recording;
        let source: Box<dyn Read> = match compressed {
            true => {
                let unpacked = MultiGzDecoder::new(BufReader::new(source));
                Box::new(Capped::new(unpacked, format, format.most_unpacked(size)))
            }
            false => Box::new(Capped::new(source, format, format.most_bytes())),
        };
        let mut lines = Lines {
            source: BufReader::new(source),
            path,
            compressed,
            row: 0,
            blank: [0; 2],
            buffer: Vec::new(),
        };
        let unpacked = match compressed {
            true => lines.source.fill_buf().map(|start| recognised(path, start)),
            false => Ok(None),
        };
        match plain.or(unpacked.map_err(|source| lines.read_error(source))?) {
            Some(format) => Err(RecordingFault::other_format(&format).of(path)),
            None => Ok(lines),
        }
    }

    pub(crate) fn next_row(&mut self) -> Outcome<Option<(usize, &str)>> {
        self.row += 1;
        self.buffer.clear();
        let most = MAX_LINE_BYTES as u64 + 1;
        let mut source = (&mut self.source).take(most);
        let read = source.read_until(b'\n', &mut self.buffer);
        if read.map_err(|source| self.read_error(source))? == 0 {
            return Ok(None);
        }
        if self.buffer.pop_if(|last| *last == b'\n').is_some() {
            self.buffer.pop_if(|last| *last == b'\r');
        }
        if self.buffer.len() > MAX_LINE_BYTES {
            let found = format!("a line of more than {MAX_LINE_BYTES} bytes");
            return Err(unexpected(found, "a recording").at(self.path, self.row));
        }
        self.count_blank()?;
        let bytes = match self.buffer.strip_prefix(b"\xef\xbb\xbf") {
            Some(rest) if self.row == 1 => rest,
            _ => &self.buffer,
        };
        match std::str::from_utf8(bytes) {
            Ok(text) => Ok(Some((self.row, text))),
            Err(error) => {
                let at = error.valid_up_to();
                let found = format!("0x{:02x} as byte {}", bytes[at], at + 1);
                Err(unexpected(found, "UTF-8 text").at(self.path, self.row))
            }
        }
    }

    fn count_blank(&mut self) -> Outcome<()> {
        let is_blank = match self.buffer.first() {
            Some(first) if first.is_ascii_graphic() => false,
            _ => String::from_utf8_lossy(&self.buffer).trim().is_empty(),
        };
        let [since, all] = &mut self.blank;
        (*since, *all) = match is_blank {
            true => (*since + 1, *all + 1),
            false => (0, *all),
        };
        let filled = self.row - *all;
        if *since > MAX_BLANK_ROWS || *all > filled.saturating_add(MAX_BLANK_ROWS) {
            let found = format!("more than {MAX_BLANK_ROWS} empty lines");
            return Err(unexpected(found, "samples or the end").at(self.path, self.row));
        }
        Ok(())
    }

    fn read_error(&self, source: io::Error) -> RecordingError {
        match self.compressed && source.kind() != io::ErrorKind::FileTooLarge {
            true => RecordingFault::Gzip(source).at(self.path, self.row.max(1)),
            false => io_fault("read", source).of(self.path),
        }
    }
}

/// The cells of a line, trimmed and without their quotes, inside which a delimiter (in ASCII) does not separate.
pub(super) fn cells(line: &str, delimiter: char) -> impl Iterator<Item = &str> {
    let mut rest = Some(line);
    std::iter::from_fn(move || {
        let text = rest?;
        let mut quoted = false;
        let end = text.bytes().position(|byte| {
            quoted ^= byte == b'"';
            byte == delimiter as u8 && !quoted
        });
        let cell = trimmed(&text[..end.unwrap_or(text.len())]);
        rest = end.map(|end| &text[end + 1..]);
        let bare = cell.strip_prefix('"').and_then(|c| c.strip_suffix('"'));
        Some(bare.map_or(cell, str::trim))
    })
}

fn trimmed(cell: &str) -> &str {
    match cell.as_bytes() {
        [first, .., last] if first.is_ascii_graphic() && last.is_ascii_graphic() => cell,
        _ => cell.trim(),
    }
}

#[derive(Debug)]
pub(super) struct NumberReader {
    mark: Option<u8>, // `.` or `,`: the first one met holds for the rest
    pointed: String,
}

impl NumberReader {
    /// Of cells that are separated by this character: between commas the mark is a point.
    pub(crate) fn new(delimiter: char) -> Self {
        NumberReader {
            mark: (delimiter == ',').then_some(b'.'),
            pointed: String::new(),
        }
    }

    pub(crate) fn expected(&self) -> &'static str {
        match self.mark {
            None => "a number",
            Some(b'.') => "a number with a decimal point",
            Some(_) => "a number with a decimal comma",
        }
    }

    /// The value of a cell, or `None` if it is no number in this notation. May be infinite or NaN.
    pub(crate) fn parse(&mut self, cell: &str) -> Option<f64> {
        let Some(place) = cell.bytes().position(|b| b == b'.' || b == b',') else {
            return cell.parse().ok();
        };
        let found = cell.as_bytes()[place];
        if self.mark.is_some_and(|mark| mark != found) {
            return None;
        }
        let mut pointed = cell; // a second mark of either kind fails to parse
        if found == b',' {
            self.pointed.clear();
            (self.pointed).extend([&cell[..place], ".", &cell[place + 1..]]);
            pointed = &self.pointed;
        }
        let value = pointed.parse().ok()?;
        self.mark = Some(found);
        Some(value)
    }
}
