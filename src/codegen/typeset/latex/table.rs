//! The coefficients as a booktabs table: phases below each other, one column per acceleration.

use super::document::{TEX, is_narrow};
use super::*;
use crate::typeset::words;

/// Lines of normal size from which a table breaks across pages, or is cut where it cannot.
const LONGEST: f64 = 36.0;

/// One table no wider than its column of text or, over two columns, the page.
pub(super) struct TableBlock {
    /// `table`, `table*` over two columns, or `longtable`.
    pub environment: &'static str,
    /// Commands before the rows.
    pub size: &'static str,
    pub columns: String,
    pub caption: String,
    /// Labels for `\ref`: its own, and for the first block that of the whole table.
    pub labels: Vec<String>,
    pub heads: String,
    /// Title and rows of each group of phases.
    pub parts: Vec<(String, Vec<String>)>,
}

/// One block, as narrow as it can be printed well; several only where it is wider than the page or longer than a
/// column in which no table breaks.
pub(super) fn blocks(
    table: &CoefficientTable,
    model_name: &str,
    numbers: NumberStyle,
    width_em: f64,
) -> Vec<TableBlock> {
    let mut blocks = Vec::new();
    for layout in layouts(table, width_em) {
        let parts = table.parts.iter().map(|part| {
            let is_shown = |row: &&CoefficientRow| {
                let mut columns = layout.columns.iter();
                columns.any(|&column| row.coefficients[column].is_some())
            };
            Part {
                phases: part,
                rows: part.rows.iter().filter(is_shown).collect(),
                is_continued: false,
            }
        });
        let parts: Vec<Part<'_>> = parts.collect();
        let n_lines: usize = parts.iter().map(|part| part.rows.len() + 1).sum();
        let longest = (LONGEST / layout.print.scale) as usize;
        let is_long = n_lines > longest && layout.environment == TABLE && !is_narrow(width_em);
        let layout = match is_long {
            true => Layout {
                environment: "longtable",
                ..layout
            },
            false => layout,
        };
        let pieces = match is_long {
            true => vec![parts],
            false => pieces(parts, longest),
        };
        blocks.extend((pieces.iter()).map(|parts| block(table, &layout, parts, numbers)));
    }
    let count = blocks.len();
    let name = tex_text(model_name);
    let stem = format!("tab:{}", label(model_name));
    let rule = match table.unit_rule() {
        "" => String::new(),
        rule => format!(". {}", rule.trim_end_matches('.')),
    };
    for (place, block) in (1..).zip(&mut blocks) {
        let part = match count {
            1 => String::new(),
            _ => format!(", part {place} of {count}"),
        };
        block.caption = format!("Coefficients of the model {name}{part}{rule}");
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

/// Phases with some of their rows.
struct Part<'a> {
    phases: &'a CoefficientPart,
    rows: Vec<&'a CoefficientRow>,
    is_continued: bool, // from the table before
}

/// Parts cut into tables of at most `longest` lines, titles included.
fn pieces(parts: Vec<Part<'_>>, longest: usize) -> Vec<Vec<Part<'_>>> {
    let mut pieces: Vec<Vec<Part<'_>>> = vec![Vec::new()];
    let mut used = 0;
    for Part { phases, rows, .. } in parts {
        let mut rest = rows.as_slice();
        loop {
            // A title is always above a row of its phase.
            if used + 1 + rest.len().min(1) > longest {
                pieces.push(Vec::new());
                used = 0;
            }
            let (now, later) = rest.split_at(rest.len().min(longest - used - 1));
            let last = pieces.last_mut().expect("begun above");
            last.push(Part {
                phases,
                rows: now.to_vec(),
                is_continued: rest.len() < rows.len(),
            });
            used += 1 + now.len();
            rest = later;
            if rest.is_empty() {
                break;
            }
        }
    }
    pieces
}

const TABLE: &str = "table";

/// How the rows are set.
struct Print {
    /// Size of letters, as a share of that of the text around.
    scale: f64,
    /// Space around a column, in em: twice `\\tabcolsep`.
    column_space_em: f64,
    commands: &'static str,
}

/// From normal to tight. Letters of `\\footnotesize` are wider than scaled ones.
const PRINTS: [Print; 3] = [
    Print {
        scale: 1.0,
        column_space_em: 1.2,
        commands: "",
    },
    Print {
        scale: 0.85,
        column_space_em: 1.2,
        commands: "\\footnotesize\n",
    },
    Print {
        scale: 0.85,
        column_space_em: 0.6,
        commands: "\\footnotesize\\setlength{\\tabcolsep}{3pt}\n",
    },
];

/// Columns side by side, and how they are set.
struct Layout {
    environment: &'static str,
    print: &'static Print,
    columns: Vec<usize>,
}

/// The first print that fits a column of text, then the page of two; else columns in groups that fit the page.
fn layouts(table: &CoefficientTable, width_em: f64) -> Vec<Layout> {
    let (page, page_em) = match is_narrow(width_em) {
        true => ("table*", 2.0 * width_em),
        false => (TABLE, width_em),
    };
    let all: Vec<usize> = (0..table.columns.len()).collect();
    for (environment, available) in [(TABLE, width_em), (page, page_em)] {
        let fits = |print: &&Print| width_of(table, &all, print) <= available;
        if let Some(print) = PRINTS.iter().find(fits) {
            return vec![Layout {
                environment,
                print,
                columns: all,
            }];
        }
    }
    let print = &PRINTS[PRINTS.len() - 1];
    // As few groups as fit, nearly equal; at least one column each.
    let fit = |group: &[usize]| group.len() == 1 || width_of(table, group, print) <= page_em;
    let sizes = (2..=all.len()).map(|n_groups| all.len().div_ceil(n_groups));
    let size = sizes.into_iter().find(|size| all.chunks(*size).all(fit));
    let groups = all.chunks(size.unwrap_or(1));
    groups
        .map(|columns| Layout {
            environment: page,
            print,
            columns: columns.to_vec(),
        })
        .collect()
}

const TERM_HEAD_EM: f64 = 2.31;

/// Estimated width of the table with these columns, in em of the text around.
fn width_of(table: &CoefficientTable, columns: &[usize], print: &Print) -> f64 {
    let rows = || table.parts.iter().flat_map(|part| &part.rows);
    let terms = rows()
        .map(|row| width(&row.term))
        .fold(TERM_HEAD_EM, f64::max);
    let units = rows().filter_map(|row| row.unit).map(unit_width);
    let units = units.reduce(f64::max);
    let numbers = columns.iter().map(|&column| {
        let (left, unit) = &table.columns[column];
        let head = symbol_width(left).max(unit.map_or(0.0, unit_width));
        ColumnWidth::of(column, rows()).em().max(head)
    });
    let widths: Vec<f64> = [terms].into_iter().chain(units).chain(numbers).collect();
    let titles = table.parts.iter().map(|part| {
        let title = part.row_title(&words::PLAIN);
        LETTER_EM * title.chars().count() as f64
    });
    let width =
        print.scale * widths.iter().sum::<f64>() + print.column_space_em * widths.len() as f64;
    (titles.map(|title| print.scale * title)).fold(width, f64::max)
}

const LETTER_EM: f64 = 0.5; // of a title, on average

/// Estimated width of a unit in print.
fn unit_width(unit: Unit) -> f64 {
    let em = |letter: char| match letter {
        'm' => 0.84,
        '^' => 0.0,
        '0'..='9' => 0.4,
        _ => 0.6,
    };
    unit.to_string().chars().map(em).sum()
}

/// A block without its caption and labels.
fn block(
    table: &CoefficientTable,
    layout: &Layout,
    parts: &[Part<'_>],
    numbers: NumberStyle,
) -> TableBlock {
    let shown = || parts.iter().flat_map(|part| part.rows.iter().copied());
    let of_rows = |&column: &usize| ColumnWidth::of(column, shown());
    let widths: Vec<ColumnWidth> = layout.columns.iter().map(of_rows).collect();
    let has_units = table.has_units();
    let row = |row: &&CoefficientRow| {
        let cells = layout.columns.iter().zip(&widths);
        let cells = cells.map(|(&column, width)| {
            let number = row.coefficients[column].as_ref();
            number.map_or(String::new(), |number| cell(number, width, numbers))
        });
        let unit = row
            .unit
            .map_or(String::new(), |unit| format!("${}$", tex_unit(unit)));
        let cells: Vec<String> = [format!("${}$", tex(&row.term, numbers))]
            .into_iter()
            .chain(has_units.then_some(unit))
            .chain(cells)
            .collect();
        cells.join(" & ").trim_end().to_owned() + r" \\"
    };
    let widths_of_columns = widths.iter().map(|width| match numbers {
        NumberStyle::Plain => "r".to_owned(),
        NumberStyle::Siunitx => format!("S[table-format={}]", width.format()),
    });
    let n_columns = layout.columns.len() + if has_units { 2 } else { 1 };
    let title = |part: &Part<'_>| {
        let continued = if part.is_continued { ", continued" } else { "" };
        let title = part.phases.row_title(&TEX) + continued;
        format!(r"\multicolumn{{{n_columns}}}{{@{{}}l}}{{\emph{{{title}}}}} \\")
    };
    let before = if has_units { "ll" } else { "l" };
    TableBlock {
        environment: layout.environment,
        size: layout.print.commands,
        columns: format!(
            "@{{}}{before}{}@{{}}",
            widths_of_columns.collect::<String>()
        ),
        caption: String::new(),
        labels: Vec::new(),
        heads: heads(table, &layout.columns, numbers),
        parts: (parts.iter())
            .map(|part| (title(part), part.rows.iter().map(row).collect()))
            .collect(),
    }
}

/// Symbols of the columns and, where they are physical, their units in a second line.
fn heads(table: &CoefficientTable, columns: &[usize], numbers: NumberStyle) -> String {
    let head = |math: String| match numbers {
        NumberStyle::Plain => format!(" & ${math}$"),
        NumberStyle::Siunitx => format!(" & {{${math}$}}"),
    };
    let of = |&column: &usize| {
        let (left, unit) = &table.columns[column];
        let unit = unit.map(|unit| head(tex_unit(unit)));
        (head(tex_symbol(left)), unit.unwrap_or_default())
    };
    let (symbols, units): (String, String) = columns.iter().map(of).unzip();
    match table.has_units() {
        true => format!("Term & Unit{symbols} \\\\\n &{units} \\\\"),
        false => format!(r"Term{symbols} \\"),
    }
}

fn cell(number: &Decimal, width: &ColumnWidth, numbers: NumberStyle) -> String {
    if numbers == NumberStyle::Siunitx {
        return number.to_string();
    }
    // Missing digits are padded, so decimal points are aligned.
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
