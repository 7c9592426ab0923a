//! The coefficients as booktabs tables.

use crate::typeset::{CoefficientRow, CoefficientTable, Decimal, NumberStyle};

use super::escape::{TexText, label};
use super::math::{TexMath, TexNumber, TexSymbol, TexUnit};

/// Most columns of numbers side by side.
const WIDEST: usize = 8;
/// Rows from which a table breaks across pages.
const LONGEST: usize = 40;

/// One table of at most [`WIDEST`] columns.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TableBlock {
    /// Column specification.
    pub columns: String,
    /// Caption, escaped.
    pub caption: String,
    /// Label.
    pub label: String,
    /// Row of phase names over the columns.
    pub phases: String,
    /// Rules below the phase names.
    pub rules: String,
    /// Row of accelerations.
    pub heads: String,
    /// Rows of coefficients.
    pub rows: Vec<String>,
    /// Whether it must break across pages.
    pub long: bool,
}

/// Cuts the table into blocks that fit on a page. Phases share a block when
/// all of them fit, and stay apart otherwise.
pub(super) fn blocks(
    table: &CoefficientTable,
    model_name: &str,
    numbers: NumberStyle,
) -> Vec<TableBlock> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    let all_fit = table.columns.len() <= WIDEST;
    for column in 0..table.columns.len() {
        let fits = groups.last().is_some_and(|group: &Vec<usize>| {
            let same_phase = table.columns[group[0]].0 == table.columns[column].0;
            group.len() < WIDEST && (all_fit || same_phase)
        });
        match groups.last_mut() {
            Some(group) if fits => group.push(column),
            _ => groups.push(vec![column]),
        }
    }
    let count = groups.len();
    let units = match table.units {
        Some(_) => ". The unit of a coefficient is that of its column over that of its term",
        None => "",
    };
    let block = |(place, columns): (usize, &Vec<usize>)| {
        let part = match count {
            1 => String::new(),
            _ => format!(", part {} of {count}", place + 1),
        };
        let name = TexText(model_name);
        let layout = Layout {
            table,
            columns,
            numbers,
        };
        layout.block(
            format!(r"Coefficients of \texttt{{{name}}}{part}{units}"),
            format!("tab:{}:{}", label(model_name), place + 1),
        )
    };
    groups.iter().enumerate().map(block).collect()
}

struct Layout<'a> {
    table: &'a CoefficientTable,
    columns: &'a [usize],
    numbers: NumberStyle,
}

impl Layout<'_> {
    fn block(&self, caption: String, label: String) -> TableBlock {
        let rows: Vec<&CoefficientRow> = self
            .table
            .rows
            .iter()
            .filter(|row| self.columns.iter().any(|&c| row.coefficients[c].is_some()))
            .collect();
        let (phases, rules) = self.phase_heads();
        let widths: Vec<ColumnWidth> = self
            .columns
            .iter()
            .map(|&column| ColumnWidth::of(rows.iter().map(|row| &row.coefficients[column])))
            .collect();
        let columns: String = widths.iter().map(|width| self.column(width)).collect();
        TableBlock {
            columns: format!("l{columns}"),
            caption,
            label,
            phases,
            rules,
            heads: self.heads(),
            long: rows.len() > LONGEST,
            rows: rows.iter().map(|row| self.row(row, &widths)).collect(),
        }
    }

    fn column(&self, width: &ColumnWidth) -> String {
        match self.numbers {
            NumberStyle::Plain => "r".to_owned(),
            NumberStyle::Siunitx => format!("S[table-format={}]", width.format()),
        }
    }

    /// Phase names, each over its columns, and the rules below them.
    fn phase_heads(&self) -> (String, String) {
        let mut names = String::new();
        let mut rules = String::new();
        let mut start = 0;
        while start < self.columns.len() {
            let name = &self.table.columns[self.columns[start]].0;
            let end = self.columns[start..]
                .iter()
                .position(|&column| self.table.columns[column].0 != *name)
                .map_or(self.columns.len(), |length| start + length);
            let span = end - start;
            names.push_str(&format!(
                r" & \multicolumn{{{span}}}{{c}}{{{}}}",
                TexText(name)
            ));
            rules.push_str(&format!(r"\cmidrule(lr){{{}-{}}}", start + 2, end + 1));
            start = end;
        }
        (format!(r"{} \\", names.trim_start()), rules)
    }

    fn heads(&self) -> String {
        let cell = |math: String| match self.numbers {
            NumberStyle::Plain => format!(" & ${math}$"),
            NumberStyle::Siunitx => format!(" & {{${math}$}}"),
        };
        let symbol = |&column: &usize| cell(TexSymbol(&self.table.columns[column].1).to_string());
        let symbols: String = self.columns.iter().map(symbol).collect();
        let heads = format!(r"Term{symbols} \\");
        let Some(units) = &self.table.units else {
            return heads;
        };
        let unit = |&column: &usize| cell(TexUnit(units[column]).to_string());
        let units: String = self.columns.iter().map(unit).collect();
        format!("{heads}\n{units} \\\\")
    }

    fn row(&self, row: &CoefficientRow, widths: &[ColumnWidth]) -> String {
        let term = row.term.clone().into_math();
        let math = TexMath {
            math: &term,
            numbers: self.numbers,
        };
        let mut text = format!("${math}$");
        if let Some(unit) = row.unit {
            text.push_str(&format!(r"\quad${}$", TexUnit(unit)));
        }
        for (&column, width) in self.columns.iter().zip(widths) {
            text.push_str(" & ");
            if let Some(number) = &row.coefficients[column] {
                text.push_str(&self.cell(number, width));
            }
        }
        text.trim_end().to_owned() + r" \\"
    }

    fn cell(&self, number: &Decimal, width: &ColumnWidth) -> String {
        match self.numbers {
            NumberStyle::Siunitx => {
                let sign = if number.is_negative() { "-" } else { "" };
                let power = number.exponent().map_or(String::new(), |e| format!("e{e}"));
                format!("{sign}{}{power}", number.digits())
            }
            NumberStyle::Plain => {
                let text = TexNumber {
                    number,
                    numbers: self.numbers,
                };
                let missing = width.decimals - places(number.digits()).1;
                // Points stand below each other when the missing digits take their space.
                let point = if missing > 0 && !number.digits().contains('.') {
                    "."
                } else {
                    ""
                };
                let pad = match (number.exponent(), missing) {
                    (Some(_), _) | (None, 0) => String::new(),
                    (None, _) => format!(r"\phantom{{{point}{}}}", "0".repeat(missing)),
                };
                format!("${text}{pad}$")
            }
        }
    }
}

/// The most digits in a column, before and after the point and in the power of ten.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct ColumnWidth {
    integers: usize,
    decimals: usize,
    exponent: usize,
    negative_exponent: bool,
}

impl ColumnWidth {
    fn of<'a>(numbers: impl Iterator<Item = &'a Option<Decimal>>) -> Self {
        let mut width = Self::default();
        for number in numbers.flatten() {
            let (integers, decimals) = places(number.digits());
            width.integers = width.integers.max(integers);
            width.decimals = width.decimals.max(decimals);
            if let Some(exponent) = number.exponent() {
                let digits = exponent.unsigned_abs().to_string().len();
                width.exponent = width.exponent.max(digits);
                width.negative_exponent |= exponent < 0;
            }
        }
        width
    }

    /// In the form of siunitx, room for a minus included: `-2.2` or `-1.1e-2`.
    fn format(&self) -> String {
        let mut format = format!("-{}.{}", self.integers.max(1), self.decimals);
        if self.exponent > 0 {
            let sign = if self.negative_exponent { "-" } else { "" };
            format.push_str(&format!("e{sign}{}", self.exponent));
        }
        format
    }
}

/// How many digits stand before and after the point.
fn places(digits: &str) -> (usize, usize) {
    match digits.split_once('.') {
        Some((before, after)) => (before.len(), after.len()),
        None => (digits.len(), 0),
    }
}
