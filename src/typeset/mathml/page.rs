//! Equations as `math` elements, and a page that shows them.

use askama::Template;

use crate::equations::{Equations, Unit};
use crate::files::EmittedFile;
use crate::typeset::TypesetError;
use crate::typeset::latex::{LatexOptions, tex_cases};
use crate::typeset::{
    EQUALS, EquationSystem, Rounding, SymbolTable, Typeset, break_lines, symbol_width, words,
};

use super::escape::HtmlText;
use super::math::{Mathml, MathmlNumber, MathmlSymbol, MathmlTerms};

/// What a continued line is set in by, in em.
const INDENT: f64 = 2.0;

/// Options of the MathML backend.
#[derive(Clone, Debug, PartialEq)]
pub struct MathmlOptions {
    /// How coefficients are rounded.
    pub rounding: Rounding,
    /// Longest line in em.
    pub width_em: f64,
    /// New names for variables.
    pub symbols: SymbolTable,
    /// Digest of the model file, for the page's head.
    pub digest: Option<String>,
}

impl Default for MathmlOptions {
    fn default() -> Self {
        Self {
            rounding: Rounding::default(),
            width_em: 44.0,
            symbols: SymbolTable::default(),
            digest: None,
        }
    }
}

/// One phase as a `math` element: a brace before its equations, each broken into
/// lines of `width_em`. The LaTeX of the same equations stands in an annotation,
/// where tools for copying find it.
pub fn system(system: &EquationSystem, width_em: f64) -> String {
    let mut rows = String::new();
    for equation in &system.equations {
        let left = MathmlSymbol(&equation.left);
        let first = symbol_width(&equation.left) + EQUALS;
        let lines = break_lines(&equation.terms, width_em, first, INDENT);
        let mut head = format!("{left}<mo>=</mo>");
        if lines.is_empty() {
            let zero = equation.right();
            rows.push_str(&row(&head, &Mathml(&zero).to_string(), 0.0));
        }
        for (place, terms) in lines.into_iter().enumerate() {
            let continues = place > 0;
            let indent = if continues { INDENT } else { 0.0 };
            let right = MathmlTerms { terms, continues }.to_string();
            rows.push_str(&row(&head, &right, indent));
            head.clear();
        }
    }
    let options = LatexOptions {
        width_em,
        ..LatexOptions::default()
    };
    let tex = tex_cases(system, &options);
    format!(
        "<math display=\"block\"><semantics><mrow><mo fence=\"true\" form=\"prefix\" \
         stretchy=\"true\">{{</mo><mtable displaystyle=\"true\">{rows}</mtable></mrow>\
         <annotation encoding=\"application/x-tex\">{}</annotation></semantics></math>",
        HtmlText(&tex)
    )
}

fn row(left: &str, right: &str, indent: f64) -> String {
    let space = if indent > 0.0 {
        format!("<mspace width=\"{indent}em\"/>")
    } else {
        String::new()
    };
    format!(
        "<mtr><mtd style=\"text-align:right;padding-right:0\"><mrow>{left}</mrow></mtd>\
         <mtd style=\"text-align:left;padding-left:0\"><mrow>{space}{right}</mrow></mtd></mtr>"
    )
}

/// The page `NAME.html`: each phase's equations and the table of coefficients,
/// without scripts or anything from elsewhere.
///
/// # Errors
/// [`TypesetError`] if a candidate term has a variable without a symbol.
pub fn emit(
    latent: &Equations<'_>,
    options: &MathmlOptions,
) -> Result<Vec<EmittedFile>, TypesetError> {
    let model = latent.model();
    let typeset = Typeset::new(latent, &options.symbols, options.rounding)?;
    let phases = typeset
        .systems
        .iter()
        .zip(model.phases())
        .map(|(equations, phase)| PhaseView {
            name: HtmlText(&phase.name).to_string(),
            feet: HtmlText(&words::feet(&phase.feet)).to_string(),
            math: system(equations, options.width_em),
        })
        .collect();
    let page = Page {
        name: HtmlText(model.name()).to_string(),
        description: HtmlText(model.description()).to_string(),
        version: env!("CARGO_PKG_VERSION"),
        digest: options
            .digest
            .as_deref()
            .map(|digest| HtmlText(digest).to_string()),
        phases,
        rounding: HtmlText(&words::rounding(options.rounding, &typeset.rounding)).to_string(),
        heads: heads(&typeset),
        rows: rows(&typeset),
    };
    let mut contents = page.render()?;
    contents.truncate(contents.trim_end().len());
    contents.push('\n');
    let path = format!("{}.html", model.identifier().as_str());
    Ok(vec![EmittedFile::new(path, contents)])
}

#[derive(Template)]
#[template(path = "mathml/page.askama", config = "templates/askama.toml")]
struct Page {
    name: String,
    description: String,
    version: &'static str,
    digest: Option<String>,
    phases: Vec<PhaseView>,
    rounding: String,
    heads: Vec<String>,
    rows: Vec<RowView>,
}

/// One phase in the template.
struct PhaseView {
    name: String,
    feet: String,
    math: String,
}

/// One candidate term in the template.
struct RowView {
    term: String,
    cells: Vec<String>,
}

fn heads(typeset: &Typeset) -> Vec<String> {
    let columns = &typeset.table.columns;
    columns
        .iter()
        .enumerate()
        .map(|(column, (phase, symbol))| {
            let unit = typeset.table.units.as_ref().map(|units| units[column]);
            format!(
                "<math>{}</math><br><small>{}{}</small>",
                MathmlSymbol(symbol),
                HtmlText(phase),
                after_comma(unit)
            )
        })
        .collect()
}

/// A unit behind a name, if there is one.
fn after_comma(unit: Option<Unit>) -> String {
    unit.map_or(String::new(), |unit| format!(", {unit}"))
}

fn rows(typeset: &Typeset) -> Vec<RowView> {
    typeset
        .table
        .rows
        .iter()
        .map(|row| RowView {
            term: format!(
                "<math>{}</math><small>{}</small>",
                Mathml(&row.term.clone().into_math()),
                after_comma(row.unit)
            )
            .replace("<small></small>", ""),
            cells: row
                .coefficients
                .iter()
                .map(|cell| {
                    cell.as_ref().map_or(String::new(), |number| {
                        format!("<math>{}</math>", MathmlNumber(number))
                    })
                })
                .collect(),
        })
        .collect()
}
