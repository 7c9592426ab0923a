//! The Markdown file of a model.

use askama::Template;

use crate::equations::Equations;
use crate::files::EmittedFile;
use crate::typeset::TypesetError;
use crate::typeset::latex::{
    LatexOptions, NumberStyle, TexMath, TexNumber, TexSymbol, TexUnit, tex_cases,
};
use crate::typeset::{CoefficientRow, Rounding, SymbolTable, Typeset, words};

use super::escape::MarkdownText;

/// Options of the Markdown backend.
#[derive(Clone, Debug, PartialEq)]
pub struct MarkdownOptions {
    /// How coefficients are rounded.
    pub rounding: Rounding,
    /// Longest line of an equation in em.
    pub width_em: f64,
    /// New names for variables.
    pub symbols: SymbolTable,
    /// Digest of the model file.
    pub digest: Option<String>,
}

impl Default for MarkdownOptions {
    fn default() -> Self {
        Self {
            rounding: Rounding::default(),
            width_em: 44.0,
            symbols: SymbolTable::default(),
            digest: None,
        }
    }
}

/// The file `NAME.md`: each phase's equations in `math` fences, and the table of
/// coefficients, as GitHub and GitLab show them.
///
/// # Errors
/// [`TypesetError`] if a candidate term has a variable without a symbol.
pub fn emit(
    system: &Equations<'_>,
    options: &MarkdownOptions,
) -> Result<Vec<EmittedFile>, TypesetError> {
    let model = system.model();
    let typeset = Typeset::new(system, &options.symbols, options.rounding)?;
    let latex = LatexOptions {
        width_em: options.width_em,
        ..LatexOptions::default()
    };
    let phases = typeset
        .systems
        .iter()
        .zip(model.phases())
        .map(|(system, phase)| PhaseView {
            name: MarkdownText(&phase.name).to_string(),
            feet: words::feet(&phase.feet),
            math: tex_cases(system, &latex),
        })
        .collect();
    let columns = &typeset.table.columns;
    let page = Page {
        name: MarkdownText(model.name()).to_string(),
        description: MarkdownText(model.description()).to_string(),
        version: env!("CARGO_PKG_VERSION"),
        digest: options
            .digest
            .as_deref()
            .map(|digest| MarkdownText(digest).to_string()),
        phases,
        rounding: MarkdownText(&words::rounding(options.rounding, &typeset.rounding)).to_string(),
        heads: columns
            .iter()
            .enumerate()
            .map(|(column, (phase, symbol))| {
                let unit = typeset.table.units.as_ref().map(|units| units[column]);
                let unit = unit.map_or(String::new(), |unit| format!(", $`{}`$", TexUnit(unit)));
                format!("$`{}`$ {}{unit}", TexSymbol(symbol), MarkdownText(phase))
            })
            .collect(),
        rows: typeset.table.rows.iter().map(row).collect(),
    };
    let mut contents = page.render()?;
    contents.truncate(contents.trim_end().len());
    contents.push('\n');
    let path = format!("{}.md", model.identifier().as_str());
    Ok(vec![EmittedFile::new(path, contents)])
}

#[derive(Template)]
#[template(path = "markdown/page.askama", config = "templates/askama.toml")]
struct Page {
    name: String,
    description: String,
    version: &'static str,
    digest: Option<String>,
    phases: Vec<PhaseView>,
    rounding: String,
    heads: Vec<String>,
    rows: Vec<String>,
}

/// One phase in the template.
struct PhaseView {
    name: String,
    feet: String,
    math: String,
}

fn row(row: &CoefficientRow) -> String {
    let numbers = NumberStyle::Plain;
    let math = &row.term.clone().into_math();
    let unit = (row.unit).map_or(String::new(), |unit| format!(", $`{}`$", TexUnit(unit)));
    let mut text = format!("| $`{}`${unit} |", TexMath { math, numbers });
    for cell in &row.coefficients {
        match cell {
            Some(number) => text.push_str(&format!(" $`{}`$ |", TexNumber { number, numbers })),
            None => text.push_str(" |"),
        }
    }
    text
}
