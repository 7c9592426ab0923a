//! Lines of a file in bounded memory, and their cells.

use std::io::{BufRead, Read};
use std::path::Path;

use super::error::{RecordingError, RecordingFault};

/// Longest line accepted, in bytes: some thirty times a row of 71 columns.
pub(super) const MAX_LINE_BYTES: usize = 1 << 16;

/// Most empty lines in a row, and in all beyond one for each that is not; compressed, billions would fit into a small file.
const MAX_BLANK_ROWS: usize = 10_000;

/// The rows of a text, without line ends, byte order mark or trailing blanks.
pub(super) struct Lines<'a, R> {
    source: R,
    path: &'a Path,
    compressed: bool,
    row: usize,
    /// Empty lines since the last that was not, and in all.
    blank: [usize; 2],
    buffer: Vec<u8>,
}

impl<'a, R: BufRead> Lines<'a, R> {
    pub fn new(path: &'a Path, source: R, compressed: bool) -> Self {
        Lines {
            source,
            path,
            compressed,
            row: 0,
            blank: [0; 2],
            buffer: Vec::new(),
        }
    }

    /// The next row's number and text; `None` at the end of the file.
    pub fn next_row(&mut self) -> Result<Option<(usize, &str)>, RecordingError> {
        self.row += 1;
        self.buffer.clear();
        let most = MAX_LINE_BYTES as u64 + 1;
        let read = (&mut self.source)
            .take(most)
            .read_until(b'\n', &mut self.buffer)
            .map_err(|source| self.read_error(source))?;
        if read == 0 {
            return Ok(None);
        }
        if self.buffer.last() == Some(&b'\n') {
            self.buffer.pop();
            if self.buffer.last() == Some(&b'\r') {
                self.buffer.pop();
            }
        }
        if self.buffer.len() > MAX_LINE_BYTES {
            return Err(RecordingFault::LineTooLong(MAX_LINE_BYTES).at(self.path, self.row));
        }
        self.count_blank()?;
        let bytes = match self.buffer.strip_prefix(b"\xef\xbb\xbf") {
            Some(rest) if self.row == 1 => rest,
            _ => &self.buffer,
        };
        match std::str::from_utf8(bytes) {
            Ok(text) => Ok(Some((self.row, text))),
            Err(error) => {
                let found = bytes[error.valid_up_to()];
                let byte = error.valid_up_to() + 1;
                Err(RecordingFault::Encoding { byte, found }.at(self.path, self.row))
            }
        }
    }

    /// Refuses to read on after too many empty lines.
    fn count_blank(&mut self) -> Result<(), RecordingError> {
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
        match *since > MAX_BLANK_ROWS || *all > filled.saturating_add(MAX_BLANK_ROWS) {
            true => Err(RecordingFault::TooManyBlankRows(MAX_BLANK_ROWS).at(self.path, self.row)),
            false => Ok(()),
        }
    }

    fn read_error(&self, source: std::io::Error) -> RecordingError {
        match self.compressed {
            true => RecordingFault::Gzip(source).at(self.path, self.row),
            false => RecordingFault::io("read", source).of(self.path),
        }
    }
}

/// Calls `visit` with each cell of a line, trimmed and without its quotes.
///
/// A delimiter inside a pair of double quotes does not separate.
pub(super) fn split_cells<E>(
    line: &str,
    delimiter: char,
    mut visit: impl FnMut(&str) -> Result<(), E>,
) -> Result<(), E> {
    if count(line, '"') == 0 && delimiter.is_ascii() {
        let mut start = 0;
        for (end, byte) in line.bytes().enumerate() {
            if byte == delimiter as u8 {
                visit(trimmed(&line[start..end]))?;
                start = end + 1;
            }
        }
        return visit(trimmed(&line[start..]));
    }
    let mut quoted = false;
    let separates = |c: char| {
        quoted ^= c == '"';
        c == delimiter && !quoted
    };
    line.split(separates).try_for_each(|cell| {
        let cell = cell.trim();
        let bare = cell.strip_prefix('"').and_then(|c| c.strip_suffix('"'));
        visit(bare.unwrap_or(cell).trim())
    })
}

/// How often an ASCII character is in a line.
pub(super) fn count(line: &str, character: char) -> usize {
    let wanted = character as u8;
    line.bytes().filter(|byte| *byte == wanted).count()
}

/// A cell without white space around it; most have none.
fn trimmed(cell: &str) -> &str {
    match cell.as_bytes() {
        [first, .., last] if first.is_ascii_graphic() && last.is_ascii_graphic() => cell,
        _ => cell.trim(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells(line: &str, delimiter: char) -> Vec<String> {
        let mut out = Vec::new();
        split_cells::<()>(line, delimiter, |cell| {
            out.push(cell.to_owned());
            Ok(())
        })
        .unwrap();
        out
    }

    #[test]
    fn split_cells_quoted_delimiter_does_not_separate() {
        assert_eq!(cells("\"0,5\", 1 ,\"a\"", ','), ["0,5", "1", "a"]);
        assert_eq!(cells("a;;b;", ';'), ["a", "", "b", ""]);
        assert_eq!(cells("\"a;b", ';'), ["\"a;b"]);
    }

    #[test]
    fn next_row_strips_mark_and_line_ends() {
        let text = b"\xef\xbb\xbfa\r\nb\n\nc";
        let mut lines = Lines::new(Path::new("t"), &text[..], false);
        let mut rows = Vec::new();
        while let Some((row, text)) = lines.next_row().unwrap() {
            rows.push((row, text.to_owned()));
        }
        let expected = [(1, "a"), (2, "b"), (3, ""), (4, "c")];
        assert!(rows.iter().map(|(r, t)| (*r, t.as_str())).eq(expected));
    }

    #[test]
    fn next_row_longest_line_is_read_and_one_byte_more_is_not() {
        let mut text = vec![b'1'; MAX_LINE_BYTES];
        text.push(b'\n');
        let mut lines = Lines::new(Path::new("t"), &text[..], false);
        assert!(lines.next_row().unwrap().is_some());
        text.insert(0, b'1');
        let mut lines = Lines::new(Path::new("t"), &text[..], false);
        let error = lines.next_row().unwrap_err();
        assert!(matches!(error.kind, RecordingFault::LineTooLong(_)));
        assert_eq!(error.place.row(), Some(1));
    }
}
