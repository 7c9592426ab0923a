//! Text files as logs: any separator, with or without header.

use std::path::{Path, PathBuf};

use super::log::{Channel, Log};
use super::map::{ColumnMap, Delimiter, TextFormat};
use crate::recording::csv::MAX_ROWS;
use crate::recording::error::{RecordingError, RecordingFault, shortened};
use crate::recording::instant::Instant;
use crate::recording::lines::{self, Lines};
use crate::recording::number::NumberReader;

/// Numbers from which a column is kept as times: beyond, one number does not hold a microsecond.
const LARGE: f64 = 1e8;

/// Reads the files of a recording: `path` itself, or those that the map names, in the folder `path` or beside it.
///
/// In a file's name `{}` stands for the name of `path` without its ending.
///
/// # Errors
/// [`RecordingError`] with file and row.
pub(in crate::recording) fn read_texts(
    path: &Path,
    map: &ColumnMap,
) -> Result<Vec<Log>, RecordingError> {
    let named = map.files();
    if path.is_dir() && named.is_empty() {
        let found = "a folder".to_owned();
        let expected = format!("a file, or the names of its files in {}", map.file);
        return Err(RecordingFault::Map { found, expected }.of(path));
    }
    let mut logs = Vec::new();
    if !path.is_dir() {
        logs.push(read_text(path, &map.text)?);
    }
    for name in named {
        logs.push(Log {
            name: name.to_owned(),
            ..read_text(&file_beside(path, name), &map.text)?
        });
    }
    Ok(logs)
}

fn file_beside(path: &Path, name: &str) -> PathBuf {
    if path.is_dir() {
        return path.join(name);
    }
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let folder = path.parent().unwrap_or(Path::new(""));
    folder.join(name.replace("{}", stem.trim_end_matches(".csv")))
}

/// Reads one text file, plain or gzip, as a log without name.
pub(in crate::recording) fn read_text(
    path: &Path,
    format: &TextFormat,
) -> Result<Log, RecordingError> {
    let mut lines = Lines::open(path)?;
    let mut sheet: Option<Sheet> = None;
    while let Some((row, line)) = lines.next_row()? {
        if row <= format.skip || line.trim().is_empty() {
            continue;
        }
        match &mut sheet {
            None => sheet = Some(Sheet::begin(path, row, line, format)),
            Some(Sheet { log, .. }) if log.len() == MAX_ROWS => {
                return Err(RecordingFault::TooManyRows(MAX_ROWS).at(path, log.first_row));
            }
            Some(sheet) => sheet.push(row, line)?,
        }
    }
    let log = sheet.ok_or_else(|| RecordingFault::Empty.of(path))?.log;
    match log.len() {
        0 => Err(RecordingFault::HeaderOnly(log.columns.len()).of(path)),
        _ => Ok(log),
    }
}

/// The rows read so far.
struct Sheet {
    delimiter: Delimiter,
    numbers: NumberReader,
    log: Log,
}

impl Sheet {
    /// From the first line: names, or already numbers.
    fn begin(path: &Path, row: usize, line: &str, format: &TextFormat) -> Self {
        // NumPy and MATLAB write headers as comments.
        let header = line.trim_start().trim_start_matches(['#', '%']);
        let delimiter = format.delimiter.unwrap_or_else(|| delimiter_of(header));
        let numbers = || NumberReader::new(character(delimiter));
        let (cells, mut reader) = (cells(header, delimiter), numbers());
        let is_value = |cell: &String| {
            cell.is_empty() || reader.parse(cell).is_some() || Instant::from_iso(cell).is_some()
        };
        let is_named = format.header.unwrap_or_else(|| !cells.iter().all(is_value));
        let mut sheet = Self {
            delimiter,
            numbers: numbers(),
            log: Log {
                path: path.to_owned(),
                columns: vec![Channel::default(); cells.len()],
                is_named,
                first_row: if is_named { row + 1 } else { row },
                ..Log::default()
            },
        };
        if is_named {
            for (column, name) in sheet.log.columns.iter_mut().zip(cells) {
                column.name = name;
            }
        } else {
            sheet.push_cells(cells);
        }
        sheet
    }

    fn push(&mut self, row: usize, line: &str) -> Result<(), RecordingError> {
        let log = &mut self.log;
        let mut cells = cells(line, self.delimiter);
        let expected = log.columns.len();
        // A separator at the end of each line is no column.
        if cells.len() == expected + 1 && cells.last().is_some_and(String::is_empty) {
            cells.pop();
        }
        if cells.len() != expected {
            let found = cells.len();
            let hint = match log.len() {
                0 if log.is_named => {
                    "; lines before the header are left out by `skip = 1` in `[text]` of the map, which \
                     `romc inspect --guess` finds"
                }
                _ => "",
            };
            let fault = RecordingFault::RowLength {
                found,
                expected,
                hint,
            };
            let name = log.columns.get(found).map_or("", |column| &column.name);
            return Err(fault.in_cell(&log.path, row, name));
        }
        if log.len() == 0 {
            log.first_row = row;
        }
        self.push_cells(cells);
        Ok(())
    }

    fn push_cells(&mut self, cells: Vec<String>) {
        for (column, cell) in self.log.columns.iter_mut().zip(cells) {
            column.push(&cell, &mut self.numbers);
        }
    }
}

impl Channel {
    fn push(&mut self, cell: &str, numbers: &mut NumberReader) {
        let value = match numbers.parse(cell) {
            Some(value) => value,
            None if cell.is_empty() => f64::NAN,
            None if cell.eq_ignore_ascii_case("true") => 1.0,
            None if cell.eq_ignore_ascii_case("false") => 0.0,
            None => {
                if let Some(instant) = Instant::from_iso(cell) {
                    return self.push_instant(instant);
                }
                let sample = self.values.len();
                self.refused
                    .get_or_insert_with(|| (sample, shortened(cell)));
                f64::NAN
            }
        };
        if self.instants.is_some() || value.abs() >= LARGE {
            let exact = Instant::from_decimal(cell).or_else(|| Instant::of(value));
            if let Some(instant) = exact {
                return self.push_instant(instant);
            }
        }
        self.values.push(value);
        if let Some(instants) = &mut self.instants {
            // No time: the value is NaN, which whoever needs the column refuses.
            instants.push(Instant {
                whole: 0,
                rest: 0.0,
            });
        }
    }

    /// Adds a time; earlier values become times as well.
    pub fn push_instant(&mut self, instant: Instant) {
        let earlier = |value: &f64| Instant::of(*value).unwrap_or(instant);
        self.instants
            .get_or_insert_with(|| self.values.iter().map(earlier).collect())
            .push(instant);
        self.values.push(instant.value());
    }
}

fn delimiter_of(line: &str) -> Delimiter {
    match line {
        _ if line.contains('\t') => Delimiter::Tab,
        _ if line.contains(';') => Delimiter::Semicolon,
        _ if line.contains(',') => Delimiter::Comma,
        _ => Delimiter::Blank,
    }
}

fn character(delimiter: Delimiter) -> char {
    match delimiter {
        Delimiter::Blank => ' ',
        Delimiter::Tab => '\t',
        Delimiter::Comma => ',',
        Delimiter::Semicolon => ';',
    }
}

fn cells(line: &str, delimiter: Delimiter) -> Vec<String> {
    match delimiter {
        Delimiter::Blank => line.split_whitespace().map(str::to_owned).collect(),
        Delimiter::Tab | Delimiter::Comma | Delimiter::Semicolon => {
            lines::cells(line, character(delimiter))
                .map(str::to_owned)
                .collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn log(text: &str) -> Log {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.txt");
        std::fs::write(&path, text).unwrap();
        read_text(&path, &TextFormat::default()).unwrap()
    }

    #[test]
    fn read_text_any_separator_gives_the_same_numbers() {
        for text in [
            "a;b\n0,5;True\n1;False\n",
            "a\tb\n0.5\ttrue\n1\tfalse\n",
            "# a, b\n0.5, 1\n1.0, 0,\n",
            "a b\n 0.5  1\n 1e0 0\n",
        ] {
            let log = log(text);
            assert_eq!(log.columns[0].values, [0.5, 1.0], "{text}");
            assert_eq!(log.columns[1].values, [1.0, 0.0], "{text}");
            assert_eq!((log.columns[1].name.as_str(), log.first_row), ("b", 2));
        }
    }

    #[test]
    fn read_text_without_header_counts_its_first_line() {
        let log = log("1 2\n3 4\n");
        assert!(!log.is_named && log.first_row == 1);
        assert_eq!(log.columns[1].values, [2.0, 4.0]);
        assert_eq!(log.column(&super::super::map::Name::Number(2)), Some(1));
        assert_eq!(log.column(&super::super::map::Name::Number(3)), None);
    }

    #[test]
    fn read_text_word_among_numbers_is_kept_with_its_sample() {
        let log = log("a,b\n1,2\n1,x\n");
        assert_eq!(log.columns[1].refused, Some((1, "x".to_owned())));
        assert!(log.columns[0].refused.is_none());
    }
}
