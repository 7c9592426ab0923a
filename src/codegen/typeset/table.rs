//! Tables of results: one set of cells, rendered as text, Markdown, HTML or CSV.

use super::decimal::finite_digits;
use super::mathml::HtmlProse;
use super::*;

/// A number with four significant digits; `diverged` for one that is not finite.
pub fn significant(value: f64) -> String {
    if !value.is_finite() {
        return "diverged".to_owned();
    }
    let magnitude = value.abs();
    if magnitude == 0.0 {
        return "0".to_owned();
    }
    if !(1e-3..1e5).contains(&magnitude) {
        return format!("{value:.3e}");
    }
    let before_point = magnitude.log10().floor() as i32 + 1;
    format!("{value:.*}", usize::try_from(4 - before_point).unwrap_or(0))
}

/// The float nearest to `value` in so many significant decimal digits.
pub fn rounded(value: f64, digits: usize) -> f64 {
    let text = format!("{value:.*e}", finite_digits(value, digits) - 1);
    text.parse().expect("a formatted float reads back")
}

/// The smallest number of `digits` significant decimal digits that is not below `value`.
pub fn rounded_up(value: f64, digits: usize) -> f64 {
    let nearest = rounded(value, digits);
    if nearest >= value {
        return nearest;
    }
    let place = value.abs().log10().floor() as i32 + 1 - digits as i32;
    rounded(nearest + 10f64.powi(place), digits)
}

/// One cell. A number has as many decimals as the other numbers of its column; a value that is absent is `-`.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    Text(String),
    Number(f64),
}

impl Default for Cell {
    fn default() -> Self {
        Self::Text(String::new())
    }
}

macro_rules! cells {
    ($($shown:ty),*) => {$(
        impl From<$shown> for Cell {
            fn from(shown: $shown) -> Self {
                Self::Text(shown.to_string())
            }
        }
    )*};
}
cells!(String, &str, &String, usize);

impl From<f64> for Cell {
    fn from(value: f64) -> Self {
        Self::Number(value)
    }
}

impl<T: Into<Cell>> From<Option<T>> for Cell {
    fn from(value: Option<T>) -> Self {
        value.map_or("-".into(), T::into)
    }
}

const MOST_IN_COLUMN: i32 = 6; // digits of a number whose column has decimals in common

/// Decimals with which the largest of these numbers has three significant digits and the smallest two; `None` where
/// that needs too many digits, so that each number has its own.
fn common_decimals(numbers: impl Iterator<Item = f64>) -> Option<usize> {
    let sizes = numbers.filter(|value| value.is_finite() && *value != 0.0);
    let places = sizes.map(|value| value.abs().log10().floor() as i32);
    let ranges = places.map(|place| (place, place));
    let (least, most) = ranges.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
    let decimals = (2 - most).max(1 - least.min(1)).max(0);
    let is_short = most.max(0) + 1 + decimals <= MOST_IN_COLUMN;
    is_short.then_some(decimals as usize)
}

/// A table with named columns; the first column names the rows. `Display` aligns it for a terminal.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Table {
    pub caption: String,
    columns: Vec<(String, String)>,
    pub rows: Vec<Vec<Cell>>,
}

impl Table {
    /// An empty table with these columns, which have no units.
    pub fn new<T: Into<String>>(columns: impl IntoIterator<Item = T>) -> Self {
        let columns = columns.into_iter().map(|name| (name.into(), String::new()));
        Self {
            columns: columns.collect(),
            ..Self::default()
        }
    }

    /// Starts a table with a row for each item; columns follow by `Rows::column`.
    pub fn of<T>(items: impl IntoIterator<Item = T>) -> Rows<T> {
        let items: Vec<T> = items.into_iter().collect();
        let table = Self {
            rows: vec![Vec::new(); items.len()],
            ..Self::default()
        };
        Rows { items, table }
    }

    /// Adds a row; missing cells stay empty.
    pub fn row<T: Into<Cell>>(&mut self, cells: impl IntoIterator<Item = T>) -> &mut Self {
        self.rows.push(cells.into_iter().map(Into::into).collect());
        self
    }

    /// Adds a column to the right, with a cell for each row; the first column of an empty table makes the rows.
    pub fn column<T: Into<Cell>>(
        &mut self,
        name: &str,
        unit: &str,
        cells: impl IntoIterator<Item = T>,
    ) -> &mut Self {
        self.push_column(name, unit, cells.into_iter().map(Into::into).collect());
        self
    }

    /// [`Table::column`] of cells of one type: compiled once.
    fn push_column(&mut self, name: &str, unit: &str, cells: Vec<Cell>) {
        if self.columns.is_empty() && self.rows.is_empty() {
            self.rows.resize(cells.len(), Vec::new());
        }
        self.columns.push((name.to_owned(), unit.to_owned()));
        for (row, cell) in self.rows.iter_mut().zip(cells) {
            row.push(cell);
        }
    }

    /// The table with a caption, which only HTML shows.
    pub fn captioned(self, caption: impl Into<String>) -> Self {
        Self {
            caption: caption.into(),
            ..self
        }
    }

    /// The same cells with a row for each column but the first, whose cells become the titles.
    pub fn transposed(&self) -> Self {
        let header = self.header();
        let rows = self.shown();
        let mut columns = (0..header.len()).map(|column| {
            let lines = std::iter::once(&header).chain(&rows);
            lines.map(move |line| line.get(column).cloned().unwrap_or_default())
        });
        let titles = columns.next().into_iter().flatten();
        let mut table = Self::new(titles).captioned(&self.caption);
        for cells in columns {
            table.row(cells);
        }
        table
    }

    fn header(&self) -> Vec<String> {
        let title = |(name, unit): &(String, String)| match unit.as_str() {
            "" => name.clone(),
            unit => format!("{name}, {unit}"),
        };
        self.columns.iter().map(title).collect()
    }

    /// The text of each cell.
    pub(super) fn shown(&self) -> Vec<Vec<String>> {
        let decimals = (0..self.columns.len()).map(|column| {
            let cells = self.rows.iter().filter_map(|row| row.get(column));
            common_decimals(cells.filter_map(|cell| match cell {
                Cell::Number(value) => Some(*value),
                Cell::Text(_) => None,
            }))
        });
        let decimals: Vec<Option<usize>> = decimals.collect();
        let text = |(column, cell): (usize, &Cell)| match (cell, decimals.get(column)) {
            (Cell::Text(text), _) => text.clone(),
            (Cell::Number(value), Some(Some(decimals))) if value.is_finite() && *value != 0.0 => {
                format!("{value:.decimals$}")
            }
            (Cell::Number(value), _) => significant(*value),
        };
        let rows = self.rows.iter();
        rows.map(|row| row.iter().enumerate().map(text).collect())
            .collect()
    }

    /// A Markdown table; characters that would become markup are escaped.
    pub fn markdown(&self) -> String {
        let line = |row: &[String]| {
            let cells: Vec<String> = row.iter().map(|cell| escaped(cell)).collect();
            format!("| {} |\n", cells.join(" | "))
        };
        let rule = "---|".repeat(self.columns.len());
        let rows: String = self.shown().iter().map(|row| line(row)).collect();
        format!("{}|{rule}\n{rows}", line(&self.header()))
    }

    /// A `<table>` with the caption, if there is one.
    pub fn html(&self) -> String {
        let rendered = Html { table: self }.render();
        rendered.expect("writing to a String cannot fail")
    }

    /// Comma-separated values: names of the columns, then the rows; cells with commas, quotes or line ends are quoted.
    pub fn csv(&self) -> String {
        let quoted = |cell: &str| match cell.contains([',', '"', '\n']) {
            true => format!("\"{}\"", cell.replace('"', "\"\"")),
            false => cell.to_owned(),
        };
        let line = |cells: Vec<String>| cells.join(",") + "\n";
        let names = self.columns.iter().map(|(name, _)| quoted(name));
        let rows = self.rows.iter().map(|row| {
            let cells = row.iter().map(|cell| match cell {
                Cell::Text(text) => quoted(text),
                Cell::Number(value) => significant(*value),
            });
            line(cells.collect())
        });
        std::iter::once(line(names.collect())).chain(rows).collect()
    }
}

#[derive(Template)]
#[template(path = "mathml/table.askama", config = "templates/askama.toml")]
struct Html<'a> {
    table: &'a Table,
}

/// A table under construction, with a row for each item.
#[derive(Debug, Clone)]
pub struct Rows<T> {
    items: Vec<T>,
    table: Table,
}

impl<T> Rows<T> {
    /// Adds a column to the right: its name, its unit (may be empty) and the cell of an item.
    pub fn column<C: Into<Cell>>(mut self, name: &str, unit: &str, cell: impl Fn(&T) -> C) -> Self {
        (self.table).column(name, unit, self.items.iter().map(cell));
        self
    }

    pub fn table(self) -> Table {
        self.table
    }
}

/// Text that Markdown shows as it is inside a cell.
fn escaped(cell: &str) -> String {
    let escape = |letter: char| match letter {
        '|' | '*' | '_' | '`' | '<' | '\\' | '$' => format!("\\{letter}"),
        _ if is_invisible(letter) => code_point(letter),
        _ => letter.to_string(),
    };
    cell.chars().map(escape).collect()
}

/// Longest line on a terminal, in characters.
pub const COLUMNS: usize = 100;
/// Widths to which titles are wrapped, one after the other, until a table fits.
const TITLE_WIDTHS: [usize; 4] = [20, 14, 10, 7];

impl fmt::Display for Table {
    /// Columns aligned under their titles: the first to the left, the rest to the right. Where a line would be too
    /// long, titles are wrapped, then columns follow in a second block that repeats the first column.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (header, rows) = (self.header(), self.shown());
        let length = |text: &str| text.chars().count();
        let of_cells = |column: usize| {
            let cells = rows.iter().filter_map(|row| row.get(column));
            cells.map(|cell| length(cell)).max().unwrap_or(0)
        };
        let titles_of = |width: usize| -> Vec<Vec<String>> {
            let titles = header.iter().enumerate();
            titles
                .map(|(column, title)| wrapped(title, width.max(of_cells(column))))
                .collect()
        };
        let widths_of = |titles: &[Vec<String>]| -> Vec<usize> {
            let widths = titles.iter().enumerate().map(|(column, lines)| {
                let title = lines.iter().map(|line| length(line)).max();
                title.unwrap_or(0).max(of_cells(column))
            });
            widths.collect()
        };
        let fits =
            |widths: &[usize]| widths.iter().map(|width| 2 + width).sum::<usize>() <= COLUMNS;
        let mut titles = titles_of(usize::MAX);
        for width in TITLE_WIDTHS {
            if fits(&widths_of(&titles)) {
                break;
            }
            titles = titles_of(width);
        }
        let widths = widths_of(&titles);
        let blocks = blocks(&widths);
        for (place, block) in blocks.iter().enumerate() {
            if place > 0 {
                writeln!(f)?;
            }
            let height = (block.iter().map(|&column| titles[column].len())).max();
            for line in (0..height.unwrap_or(0)).rev() {
                // Titles stand on the rule below.
                let part = |&column: &usize| {
                    let lines: &Vec<String> = &titles[column];
                    let line = lines.len().checked_sub(line + 1);
                    line.map_or("", |line| &lines[line][..])
                };
                write_line(f, block, &widths, block.iter().map(part))?;
            }
            let rule: Vec<String> = block.iter().map(|&at| "-".repeat(widths[at])).collect();
            write_line(f, block, &widths, rule.iter().map(String::as_str))?;
            for row in &rows {
                let cell = |&column: &usize| row.get(column).map_or("", String::as_str);
                write_line(f, block, &widths, block.iter().map(cell))?;
            }
        }
        Ok(())
    }
}

fn write_line<'a>(
    f: &mut fmt::Formatter<'_>,
    block: &[usize],
    widths: &[usize],
    cells: impl Iterator<Item = &'a str>,
) -> fmt::Result {
    let mut text = String::new();
    for (&column, cell) in block.iter().zip(cells) {
        let width = widths[column];
        text += &match column {
            0 => format!("  {cell:<width$}"),
            _ => format!("  {cell:>width$}"),
        };
    }
    writeln!(f, "{}", text.trim_end())
}

/// Text on lines of at most `width` characters, or those of its longest word.
pub fn wrapped(title: &str, width: usize) -> Vec<String> {
    let words = title.split(' ');
    let longest = words.clone().map(|word| word.chars().count()).max();
    let width = width.max(longest.unwrap_or(0));
    let mut lines: Vec<String> = Vec::new();
    for word in words {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= width => {
                *line += " ";
                *line += word;
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// Columns of blocks that fit on a line, each with the first.
fn blocks(widths: &[usize]) -> Vec<Vec<usize>> {
    let mut blocks: Vec<Vec<usize>> = Vec::new();
    let mut used = 0;
    for column in 1..widths.len() {
        let needed = 2 + widths[column];
        if blocks.is_empty() || used + needed > COLUMNS {
            blocks.push(vec![0]);
            used = 2 + widths[0];
        }
        used += needed;
        blocks.last_mut().expect("begun above").push(column);
    }
    if blocks.is_empty() && !widths.is_empty() {
        blocks.push(vec![0]);
    }
    blocks
}
