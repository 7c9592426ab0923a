//! The coefficients as booktabs tables.

use crate::typeset::{CoefficientRow, CoefficientTable, Decimal, NumberStyle, width};

use super::document::is_narrow;
use super::escape::{label, tex_text};
use super::math::{tex, tex_number, tex_symbol, tex_unit};

/// The word above the terms.
const TERM_HEAD_EM: f64 = 2.31;
/// Space around a column, in em: twice LaTeX's `\tabcolsep` at 10 pt.
const COLUMN_SPACE_EM: f64 = 1.2;
/// Width of a unit beside a term, in em.
const UNIT_EM: f64 = 5.0;
/// Rows from which a table breaks across pages, or is cut where it cannot.
const LONGEST: usize = 40;

/// One table no wider than its column of text.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TableBlock {
    pub columns: String,
    pub caption: String,
    /// What `\ref` can name: its own label, and for the first that of the whole.
    pub labels: Vec<String>,
    pub phases: String,
    pub rules: String,
    pub heads: String,
    pub rows: Vec<String>,
    pub long: bool,
}

/// Cuts the table into blocks that fit into a column of text. Phases share a block when
/// all of them fit, and stay apart otherwise. In one of two columns no table breaks across pages:
/// there long ones are cut between rows, too.
pub(super) fn blocks(
    table: &CoefficientTable,
    model_name: &str,
    numbers: NumberStyle,
    width_em: f64,
) -> Vec<TableBlock> {
    let mut cuts: Vec<(Vec<usize>, Vec<&CoefficientRow>)> = Vec::new();
    for columns in groups(table, width_em) {
        let is_active = |row: &CoefficientRow, column: usize| row.coefficients[column].is_some();
        let rows = table.rows.iter();
        let shown = rows.filter(|row| columns.iter().any(|&column| is_active(row, column)));
        let rows: Vec<&CoefficientRow> = shown.collect();
        let at_once = match is_narrow(width_em) {
            true => LONGEST,
            false => rows.len().max(1),
        };
        let parts = rows.chunks(at_once);
        cuts.extend(parts.map(|rows| (columns.clone(), rows.to_vec())));
    }
    let count = cuts.len();
    let units = match table.has_units() {
        true => ". The unit of a coefficient is that of its column over that of its term",
        false => "",
    };
    let name = tex_text(model_name);
    let stem = format!("tab:{}", label(model_name));
    let block = |(place, (columns, rows)): (usize, &(Vec<usize>, Vec<&CoefficientRow>))| {
        let part = match count {
            1 => String::new(),
            _ => format!(", part {} of {count}", place + 1),
        };
        let whole = (place == 0).then(|| stem.clone());
        let own = (count > 1).then(|| format!("{stem}:{}", place + 1));
        let layout = Layout {
            table,
            columns,
            numbers,
        };
        layout.block(
            rows,
            format!(r"Coefficients of \texttt{{{name}}}{part}{units}"),
            whole.into_iter().chain(own).collect(),
        )
    };
    cuts.iter().enumerate().map(block).collect()
}

/// The numbers of the tables in running text.
pub(super) fn references(blocks: &[TableBlock]) -> String {
    let of = |block: &TableBlock| format!(r"\ref{{{}}}", block.labels[block.labels.len() - 1]);
    match blocks {
        [] => "none".to_owned(),
        [one] => format!("table~{}", of(one)),
        [first, .., last] => format!("tables~{} to~{}", of(first), of(last)),
    }
}

/// Columns that stand side by side.
fn groups(table: &CoefficientTable, width_em: f64) -> Vec<Vec<usize>> {
    let terms = table.rows.iter().map(|row| {
        let unit = row.unit.map_or(0.0, |_| UNIT_EM);
        width(&row.term) + unit
    });
    let terms = terms.fold(TERM_HEAD_EM, f64::max) + COLUMN_SPACE_EM;
    let widths: Vec<f64> = (0..table.columns.len())
        .map(|column| {
            let cells = table.rows.iter().map(|row| &row.coefficients[column]);
            let (.., unit) = table.columns[column];
            let head = unit.map_or(1.0, |_| UNIT_EM);
            ColumnWidth::of(cells).em().max(head) + COLUMN_SPACE_EM
        })
        .collect();
    let all_fit = terms + widths.iter().sum::<f64>() <= width_em;
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for column in 0..table.columns.len() {
        let fits = groups.last().is_some_and(|group: &Vec<usize>| {
            let same_phase = table.columns[group[0]].0 == table.columns[column].0;
            let taken: f64 = group.iter().map(|&column| widths[column]).sum();
            all_fit || same_phase && terms + taken + widths[column] <= width_em
        });
        match groups.last_mut() {
            Some(group) if fits => group.push(column),
            _ => groups.push(vec![column]),
        }
    }
    groups
}

struct Layout<'a> {
    table: &'a CoefficientTable,
    columns: &'a [usize],
    numbers: NumberStyle,
}

impl Layout<'_> {
    fn block(&self, rows: &[&CoefficientRow], caption: String, labels: Vec<String>) -> TableBlock {
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
            labels,
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
        let phase = |column: &usize| &self.table.columns[*column].0;
        let (mut names, mut rules) = (String::new(), String::new());
        let mut start = 2;
        for columns in self.columns.chunk_by(|a, b| phase(a) == phase(b)) {
            let (span, name) = (columns.len(), tex_text(phase(&columns[0])));
            let end = start + span - 1;
            names.push_str(&format!(r" & \multicolumn{{{span}}}{{c}}{{{name}}}"));
            rules.push_str(&format!(r"\cmidrule(lr){{{start}-{end}}}"));
            start = end + 1;
        }
        (format!(r"{} \\", names.trim_start()), rules)
    }

    fn heads(&self) -> String {
        let cell = |math: String| match self.numbers {
            NumberStyle::Plain => format!(" & ${math}$"),
            NumberStyle::Siunitx => format!(" & {{${math}$}}"),
        };
        let columns = || {
            self.columns
                .iter()
                .map(|&column| &self.table.columns[column])
        };
        let symbols: String = columns()
            .map(|(_, left, _)| cell(tex_symbol(left)))
            .collect();
        if !self.table.has_units() {
            return format!(r"Term{symbols} \\");
        }
        let units = columns().filter_map(|(.., unit)| Some(cell(tex_unit((*unit)?))));
        format!("Term{symbols} \\\\\n{} \\\\", units.collect::<String>())
    }

    fn row(&self, row: &CoefficientRow, widths: &[ColumnWidth]) -> String {
        let mut text = format!("${}$", tex(&row.term, self.numbers));
        if let Some(unit) = row.unit {
            text.push_str(&format!(r"\quad${}$", tex_unit(unit)));
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
            NumberStyle::Siunitx => number.to_string(),
            NumberStyle::Plain => {
                let text = tex_number(number, self.numbers);
                let missing = width.decimals - number.places().1;
                // Points stand below each other when the missing digits take their space.
                let point = if number.places().1 == 0 { "." } else { "" };
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
    negative: bool,
}

impl ColumnWidth {
    fn of<'a>(numbers: impl Iterator<Item = &'a Option<Decimal>>) -> Self {
        let mut width = Self::default();
        for number in numbers.flatten() {
            let (integers, decimals) = number.places();
            width.negative |= number.is_negative();
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

    /// Estimated width in print, in em of Computer Modern.
    fn em(&self) -> f64 {
        let digits = |count: usize| 0.5 * count as f64;
        let sign = if self.negative { 0.778 } else { 0.0 };
        let point = if self.decimals > 0 { 0.278 } else { 0.0 };
        let power = match self.exponent {
            0 => 0.0,
            // a cross with its spaces, 10, and small digits above
            count => 2.222 + 0.7 * (0.778 + digits(count)),
        };
        sign + digits(self.integers + self.decimals) + point + power
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
