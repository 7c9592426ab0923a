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

/// Text of one cell; a float has four significant digits, a value that is absent is `-`.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Cell(String);

macro_rules! cells {
    ($($shown:ty),*) => {$(
        impl From<$shown> for Cell {
            fn from(shown: $shown) -> Self {
                Self(shown.to_string())
            }
        }
    )*};
}
cells!(String, &str, &String, usize);

impl From<f64> for Cell {
    fn from(value: f64) -> Self {
        Self(significant(value))
    }
}

impl<T: Into<Cell>> From<Option<T>> for Cell {
    fn from(value: Option<T>) -> Self {
        value.map_or("-".into(), T::into)
    }
}

/// A table with named columns; the first column names the rows. `Display` aligns it for a terminal.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Table {
    pub caption: String,
    columns: Vec<(String, String)>,
    pub rows: Vec<Vec<String>>,
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
        let cells = cells.into_iter().map(|cell| cell.into().0);
        self.rows.push(cells.collect());
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
            row.push(cell.0);
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
        let mut columns = (0..header.len()).map(|column| {
            let lines = std::iter::once(&header).chain(&self.rows);
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

    /// A Markdown table; characters that would become markup are escaped.
    pub fn markdown(&self) -> String {
        let line = |row: &[String]| {
            let cells: Vec<String> = row.iter().map(|cell| escaped(cell)).collect();
            format!("| {} |\n", cells.join(" | "))
        };
        let rule = "---|".repeat(self.columns.len());
        let rows: String = self.rows.iter().map(|row| line(row)).collect();
        format!("{}|{rule}\n{rows}", line(&self.header()))
    }

    /// A `<table>` with the caption, if there is one.
    pub fn html(&self) -> String {
        let rendered = Html { table: self }.render();
        rendered.expect("strings take all that is written")
    }

    /// Comma-separated values: names of the columns, then the rows; cells with commas, quotes or line ends are quoted.
    pub fn csv(&self) -> String {
        let quoted = |cell: &String| match cell.contains([',', '"', '\n']) {
            true => format!("\"{}\"", cell.replace('"', "\"\"")),
            false => cell.clone(),
        };
        let names = self.columns.iter().map(|(name, _)| name.clone()).collect();
        std::iter::once(&names)
            .chain(&self.rows)
            .map(|row| row.iter().map(quoted).collect::<Vec<_>>().join(",") + "\n")
            .collect()
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

impl fmt::Display for Table {
    /// Columns aligned under their titles: the first to the left, the rest to the right.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let header = self.header();
        let width = |column: usize| {
            let cells = std::iter::once(&header).chain(&self.rows);
            let widths = cells.filter_map(|row| Some(row.get(column)?.chars().count()));
            widths.max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..header.len()).map(width).collect();
        let line = |f: &mut fmt::Formatter<'_>, row: &[String]| {
            let mut text = String::new();
            for (column, width) in widths.iter().enumerate() {
                let cell = row.get(column).map_or("", String::as_str);
                match column {
                    0 => text.push_str(&format!("  {cell:<width$}")),
                    _ => text.push_str(&format!("  {cell:>width$}")),
                }
            }
            writeln!(f, "{}", text.trim_end())
        };
        line(f, &header)?;
        let rule: Vec<String> = widths.iter().map(|&width| "-".repeat(width)).collect();
        line(f, &rule)?;
        self.rows.iter().try_for_each(|row| line(f, row))
    }
}
