//! Text files as logs: any separator, with or without header; or romc's own format.

use super::map::Delimiter;
use super::*;

const LARGE: f64 = 1e8; // numbers from which a column is kept as times: beyond, one number does not hold a microsecond

/// Reads the files of a recording: `path` itself and those that the map names, in the folder `path` or in the same
/// folder. `{}` stands for the name of `path` without its ending.
pub(crate) fn read_texts(path: &Path, map: &ColumnMap) -> Outcome<Vec<Log>> {
    let (named, is_folder) = (map.files(), path.is_dir());
    if is_folder && named.is_empty() {
        let expected = format!("a file, or the names of its files in {}", map.file);
        return Err(unexpected("a folder", expected).of(path));
    }
    let mut logs = Vec::new();
    if !is_folder {
        logs.push(read_text(path, &map.text)?);
    }
    let stem = path.file_stem().unwrap_or_default().to_string_lossy(); // a path without a name cannot be opened
    for name in named {
        let file = match is_folder {
            true => path.join(name),
            false => path.with_file_name(name.replace("{}", stem.trim_end_matches(".csv"))),
        };
        let log = read_text(&file, &map.text)?;
        let name = name.to_owned();
        logs.push(Log { name, ..log });
    }
    Ok(logs)
}

pub(crate) fn read_text(path: &Path, format: &TextFormat) -> Outcome<Log> {
    read_lines(path, Lines::open(path)?, format)
}

pub(crate) fn read_lines(path: &Path, mut lines: Lines, format: &TextFormat) -> Outcome<Log> {
    let mut sheet: Option<Sheet> = None;
    let mut blank = None;
    while let Some((row, line)) = lines.next_row()? {
        if row <= format.skip || line.trim().is_empty() {
            blank.get_or_insert(row);
            continue;
        }
        let blank = blank.filter(|_| format.own);
        match (&mut sheet, blank) {
            (None, None) => sheet = Some(Sheet::begin(path, row, line, format)?),
            (None, Some(_)) => {
                let fault = RecordingFault::delimiter("", "`;`, a tab or `,` in a header");
                return Err(fault.at(path, row - 1));
            }
            // Blank lines may end a file of romc's, but not divide it.
            (Some(sheet), Some(blank)) => return Err(sheet.length_fault(blank, 0)),
            (Some(sheet), None) => sheet.push(row, line)?,
        }
    }
    let empty = || text("empty file, expected a header and at least two samples").of(path);
    let sheet = sheet.ok_or_else(empty)?;
    match sheet.count {
        0 => Err(RecordingFault::header_only(sheet.log.columns.len()).of(path)),
        _ => Ok(sheet.log),
    }
}

struct Sheet {
    delimiter: Delimiter,
    numbers: NumberReader,
    log: Log,
    count: usize,
    own: Option<Vec<Option<Column>>>,
}

impl Sheet {
    /// From the first line: names, or already numbers.
    fn begin(path: &Path, row: usize, line: &str, format: &TextFormat) -> Outcome<Self> {
        // NumPy and MATLAB write headers as comments.
        let header = match format.own {
            true => line,
            false => line.trim_start().trim_start_matches(['#', '%']),
        };
        let delimiter = match (format.delimiter, delimiter_of(header)) {
            (None, Delimiter::Blank) if format.own => {
                let fault = RecordingFault::delimiter(line, "`;`, a tab or `,`");
                return Err(fault.at(path, row));
            }
            (given, found) => given.unwrap_or(found),
        };
        let cells = cells(header, delimiter);
        let mut numbers = NumberReader::new(character(delimiter));
        let is_value = |cell: &&str| {
            cell.is_empty() || numbers.parse(cell).is_some() || Instant::from_iso(cell).is_some()
        };
        let is_named = (format.header).unwrap_or_else(|| format.own || !cells.iter().all(is_value));
        let named = |cell: &&str| Channel::named(if is_named { cell } else { "" });
        let log = Log {
            path: path.to_owned(),
            columns: cells.iter().map(named).collect(),
            is_named,
            first_row: row + usize::from(is_named),
            ..Log::default()
        };
        let own = format.own.then(|| Column::arranged(path, &log.names()));
        let mut sheet = Self {
            delimiter,
            numbers: NumberReader::new(character(delimiter)),
            log,
            count: 0,
            own: own.transpose()?,
        };
        if !is_named {
            sheet.push_cells(row, cells)?;
        }
        Ok(sheet)
    }

    fn push(&mut self, row: usize, line: &str) -> Outcome<()> {
        if self.count == MAX_ROWS {
            let found = format!("more than {MAX_ROWS} samples");
            return Err(unexpected(found, "shorter recordings").at(&self.log.path, row));
        }
        let mut cells = cells(line, self.delimiter);
        let (expected, is_own) = (self.log.columns.len(), self.own.is_some());
        // A separator at the end of each line is no column.
        if !is_own && cells.len() == expected + 1 && cells.last().is_some_and(|c| c.is_empty()) {
            cells.pop();
        }
        if cells.len() != expected {
            let (other, separator) = match self.delimiter {
                Delimiter::Semicolon => (',', "`;`"),
                _ => (';', "`,`"),
            };
            return Err(match is_own && cells.len() == 1 && line.contains(other) {
                true => RecordingFault::delimiter(line, separator).at(&self.log.path, row),
                false => self.length_fault(row, cells.len()),
            });
        }
        if self.count == 0 {
            self.log.first_row = row;
        }
        self.push_cells(row, cells)
    }

    fn push_cells(&mut self, row: usize, cells: Vec<&str>) -> Outcome<()> {
        for (place, cell) in cells.into_iter().enumerate() {
            let channel = &mut self.log.columns[place];
            match self.own.as_deref().map(|columns| columns[place]) {
                None => channel.push(cell, &mut self.numbers),
                Some(None) => {}
                Some(Some(column)) => (channel.push_own(column, cell, &mut self.numbers))
                    .map_err(|fault| fault.in_cell(&self.log.path, row, &channel.name))?,
            }
        }
        self.count += 1;
        Ok(())
    }

    fn length_fault(&self, row: usize, found: usize) -> RecordingError {
        let (columns, is_own) = (&self.log.columns, self.own.is_some());
        let expected = columns.len();
        let hint = match self.delimiter {
            Delimiter::Comma if is_own && found > expected => {
                "; where numbers have decimal commas, cells are separated by `;`"
            }
            _ if !is_own && self.count == 0 && self.log.is_named => {
                "; lines before the header are left out by `skip = 1` in `[text]` of the map, which \
                 `romc inspect --guess` finds"
            }
            _ => "",
        };
        let last = columns.last().filter(|_| is_own);
        let name = (columns.get(found).or(last)).map_or("", |column| &column.name);
        let fault = RecordingFault::RowLength {
            found,
            expected,
            hint,
        };
        fault.in_cell(&self.log.path, row, name)
    }
}

impl Channel {
    fn push(&mut self, cell: &str, numbers: &mut NumberReader) {
        let value = match numbers.parse(cell) {
            Some(value) => value,
            None if cell.is_empty() => f64::NAN,
            None if cell.eq_ignore_ascii_case("true") => 1.0,
            None if cell.eq_ignore_ascii_case("false") => 0.0,
            None => match Instant::from_iso(cell) {
                Some(instant) => return self.push_instant(instant),
                None => {
                    let sample = self.values.len();
                    (self.refused).get_or_insert_with(|| (sample, shortened(cell)));
                    f64::NAN
                }
            },
        };
        if self.instants.is_some() || value.abs() >= LARGE {
            let exact = Instant::from_decimal(cell).or_else(|| Instant::of(value));
            if let Some(instant) = exact {
                return self.push_instant(instant);
            }
        }
        self.push_value(value);
    }

    fn push_value(&mut self, value: f64) {
        self.values.push(value);
        if let Some(instants) = &mut self.instants {
            // Where this is no time, the value is NaN, which whoever needs the column refuses.
            instants.push(Instant::of(value).unwrap_or_default());
        }
    }

    /// Adds a cell of romc's own format: a date, 0 or 1 of a foot, or a finite number.
    fn push_own(&mut self, column: Column, cell: &str, numbers: &mut NumberReader) -> Checked<()> {
        let (is_foot, finite) = (matches!(column, Column::Foot(_)), "a finite number");
        if column == Column::Time
            && let Some(date) = Instant::from_iso(cell)
        {
            self.push_instant(date);
            return Ok(());
        }
        let value = match cell {
            "True" | "true" | "TRUE" if is_foot => Some(1.0),
            "False" | "false" | "FALSE" if is_foot => Some(0.0),
            _ => numbers.parse(cell),
        };
        match value {
            None => Err(RecordingFault::number(cell, numbers.expected())),
            Some(value) if !value.is_finite() => Err(RecordingFault::number(cell, finite)),
            Some(value) if is_foot && ![0.0, 1.0].contains(&value) => {
                Err(RecordingFault::contact(value))
            }
            Some(value) => {
                self.push_value(value);
                Ok(())
            }
        }
    }

    /// Adds a time; earlier values become times as well.
    pub(crate) fn push_instant(&mut self, instant: Instant) {
        let earlier = |value: &f64| Instant::of(*value).unwrap_or(instant);
        let all = || self.values.iter().map(earlier).collect();
        self.instants.get_or_insert_with(all).push(instant);
        self.values.push(instant.value());
    }
}

fn delimiter_of(line: &str) -> Delimiter {
    use Delimiter::{Blank, Comma, Semicolon, Tab};
    let mut known = [Tab, Semicolon, Comma].into_iter();
    let found = known.find(|delimiter| line.contains(character(*delimiter)));
    found.unwrap_or(Blank)
}

fn character(delimiter: Delimiter) -> char {
    char::from(delimiter as u8)
}

fn cells(line: &str, delimiter: Delimiter) -> Vec<&str> {
    match delimiter {
        Delimiter::Blank => line.split_whitespace().collect(),
        _ => lines::cells(line, character(delimiter)).collect(),
    }
}
