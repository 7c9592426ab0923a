//! The coefficients as booktabs tables.

use super::document::is_narrow;
use super::*;

const TERM_HEAD_EM: f64 = 2.31;
const COLUMN_SPACE_EM: f64 = 1.2; // around a column: twice LaTeX's `\tabcolsep` at 10 pt
const UNIT_EM: f64 = 5.0; // beside a term
/// Rows from which a table breaks across pages, or is cut where it cannot.
const LONGEST: usize = 40;

/// One table no wider than its column of text.
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

/// Cuts the table into blocks as wide as a column of text: phases share one if all fit. Narrow ones are cut between
/// rows as well, as no table breaks across pages there.
pub(super) fn blocks(
    table: &CoefficientTable,
    model_name: &str,
    numbers: NumberStyle,
    width_em: f64,
) -> Vec<TableBlock> {
    let mut blocks = Vec::new();
    for columns in groups(table, width_em) {
        let is_shown = |row: &&CoefficientRow| {
            let mut cells = columns.iter().map(|&column| &row.coefficients[column]);
            cells.any(Option::is_some)
        };
        let rows: Vec<&CoefficientRow> = table.rows.iter().filter(is_shown).collect();
        let at_once = match is_narrow(width_em) {
            true => LONGEST,
            false => rows.len().max(1),
        };
        let parts = rows.chunks(at_once);
        blocks.extend(parts.map(|rows| block(table, &columns, rows, numbers)));
    }
    let count = blocks.len();
    let units = match table.has_units() {
        true => ". The unit of a coefficient is that of its column over that of its term",
        false => "",
    };
    let (name, stem) = (tex_text(model_name), format!("tab:{}", label(model_name)));
    for (place, block) in (1..).zip(&mut blocks) {
        let part = match count {
            1 => String::new(),
            _ => format!(", part {place} of {count}"),
        };
        block.caption = format!(r"Coefficients of \texttt{{{name}}}{part}{units}");
        let own = (count > 1).then(|| format!("{stem}:{place}"));
        let whole = (place == 1).then(|| stem.clone());
        block.labels = whole.into_iter().chain(own).collect();
    }
    blocks
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
    let terms = table.rows.iter();
    let terms = terms.map(|row| width(&row.term) + row.unit.map_or(0.0, |_| UNIT_EM));
    let terms = terms.fold(TERM_HEAD_EM, f64::max) + COLUMN_SPACE_EM;
    let widths = table
        .columns
        .iter()
        .enumerate()
        .map(|(column, (.., unit))| {
            let head = unit.map_or(1.0, |_| UNIT_EM);
            ColumnWidth::of(column, table.rows.iter()).em().max(head) + COLUMN_SPACE_EM
        });
    let widths: Vec<f64> = widths.collect();
    let all_fit = terms + widths.iter().sum::<f64>() <= width_em;
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for column in 0..table.columns.len() {
        let fits = groups.last().is_some_and(|group| {
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

/// A block without its caption and labels.
fn block(
    table: &CoefficientTable,
    columns: &[usize],
    rows: &[&CoefficientRow],
    numbers: NumberStyle,
) -> TableBlock {
    let of_rows = |&column: &usize| ColumnWidth::of(column, rows.iter().copied());
    let widths: Vec<ColumnWidth> = columns.iter().map(of_rows).collect();
    let row = |row: &&CoefficientRow| {
        let mut text = format!("${}$", tex(&row.term, numbers));
        if let Some(unit) = row.unit {
            text.push_str(&format!(r"\quad${}$", tex_unit(unit)));
        }
        for (&column, width) in columns.iter().zip(&widths) {
            text.push_str(" & ");
            if let Some(number) = &row.coefficients[column] {
                text.push_str(&cell(number, width, numbers));
            }
        }
        text.trim_end().to_owned() + r" \\"
    };
    let head = |math: String| match numbers {
        NumberStyle::Plain => format!(" & ${math}$"),
        NumberStyle::Siunitx => format!(" & {{${math}$}}"),
    };
    let heads = columns.iter().map(|&column| &table.columns[column]);
    let symbols = heads.clone().map(|(_, left, _)| head(tex_symbol(left)));
    let units = heads.filter_map(|(.., unit)| Some(head(tex_unit((*unit)?))));
    let units = match table.has_units() {
        true => format!("\n{} \\\\", units.collect::<String>()),
        false => String::new(),
    };
    let (phases, rules) = phase_heads(table, columns);
    let widths_of_columns = widths.iter().map(|width| match numbers {
        NumberStyle::Plain => "r".to_owned(),
        NumberStyle::Siunitx => format!("S[table-format={}]", width.format()),
    });
    TableBlock {
        columns: format!("l{}", widths_of_columns.collect::<String>()),
        caption: String::new(),
        labels: Vec::new(),
        phases,
        rules,
        heads: format!(r"Term{} \\{units}", symbols.collect::<String>()),
        rows: rows.iter().map(row).collect(),
        long: rows.len() > LONGEST,
    }
}

/// Phase names, each over its columns, and the rules below them.
fn phase_heads(table: &CoefficientTable, columns: &[usize]) -> (String, String) {
    let phase = |column: &usize| &table.columns[*column].0;
    let (mut names, mut rules) = (String::new(), String::new());
    let mut start = 2;
    for columns in columns.chunk_by(|a, b| phase(a) == phase(b)) {
        let (span, name) = (columns.len(), tex_text(phase(&columns[0])));
        let end = start + span - 1;
        names.push_str(&format!(r" & \multicolumn{{{span}}}{{c}}{{{name}}}"));
        rules.push_str(&format!(r"\cmidrule(lr){{{start}-{end}}}"));
        start = end + 1;
    }
    (format!(r"{} \\", names.trim_start()), rules)
}

fn cell(number: &Decimal, width: &ColumnWidth, numbers: NumberStyle) -> String {
    if numbers == NumberStyle::Siunitx {
        return number.to_string();
    }
    // Points stand below each other when the missing digits take their space.
    let (_, decimals) = number.places();
    let point = if decimals == 0 { "." } else { "" };
    let pad = match (number.exponent, width.decimals - decimals) {
        (Some(_), _) | (None, 0) => String::new(),
        (None, missing) => format!(r"\phantom{{{point}{}}}", "0".repeat(missing)),
    };
    format!("${}{pad}$", tex_number(number, numbers))
}

/// The most digits in a column, before and after the point and in the power of ten.
#[derive(Default)]
struct ColumnWidth {
    integers: usize,
    decimals: usize,
    exponent: usize,
    negative_exponent: bool,
    negative: bool,
}

impl ColumnWidth {
    fn of<'a>(column: usize, rows: impl Iterator<Item = &'a CoefficientRow>) -> Self {
        let mut width = Self::default();
        for number in rows.filter_map(|row| row.coefficients[column].as_ref()) {
            let (integers, decimals) = number.places();
            width.negative |= number.negative;
            width.integers = width.integers.max(integers);
            width.decimals = width.decimals.max(decimals);
            if let Some(exponent) = number.exponent {
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
        let exponent = match (self.exponent, self.negative_exponent) {
            (0, _) => String::new(),
            (digits, true) => format!("e-{digits}"),
            (digits, false) => format!("e{digits}"),
        };
        format!("-{}.{}{exponent}", self.integers.max(1), self.decimals)
    }
}
