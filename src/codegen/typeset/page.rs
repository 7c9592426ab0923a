//! Pages of Markdown and HTML: what stands on them, in a markup that the page chooses.

use askama::Template;

use super::decimal::Decimal;
use super::equations::{EquationSystem, Typeset};
use super::options::PrintOptions;
use super::tree::{Math, Symbol};
use super::words::{self, Spelling};
use crate::equations::{Equations, Unit};

/// Longest line of an equation unless chosen, in em.
const WIDTH_EM: f64 = 44.0;

/// How a page spells text and mathematics.
pub(super) trait Markup: Spelling {
    fn system(system: &EquationSystem, width_em: f64) -> String;
    /// The head of a column: an acceleration of a phase, with its unit where that is physical.
    fn head(symbol: &Symbol, phase: &str, unit: Option<Unit>) -> String;
    /// The head of a row: a candidate term, with its unit where that is physical.
    fn row_head(term: &Math, unit: Option<Unit>) -> String;
}

pub(super) struct Page {
    pub name: String,
    pub description: String,
    pub version: &'static str,
    pub digest: Option<String>,
    /// Name, feet and equations of each phase.
    pub phases: Vec<[String; 3]>,
    pub rounding: String,
    pub heads: Vec<String>,
    /// Each candidate term with a cell for each column.
    pub rows: Vec<(String, Vec<String>)>,
}

impl Page {
    pub(crate) fn new<M: Markup>(equations: &Equations<'_>, options: &PrintOptions) -> Self {
        let model = equations.model();
        let width_em = options.width_em.unwrap_or(WIDTH_EM);
        let typeset = Typeset::new(equations, &options.symbols, options.rounding);
        let phases = typeset.systems.iter().zip(equations.phases());
        let table = &typeset.table;
        let cell = |number: &Option<Decimal>| number.as_ref().map_or(String::new(), M::number);
        Self {
            name: M::text(model.name()),
            description: M::text(model.description()),
            version: env!("CARGO_PKG_VERSION"),
            digest: options.digest.as_deref().map(M::text),
            phases: phases
                .map(|(system, phase)| {
                    let feet = M::text(&words::feet(&phase.feet));
                    [M::text(&phase.name), feet, M::system(system, width_em)]
                })
                .collect(),
            rounding: words::rounding::<M>(options.rounding, &typeset.rounding),
            heads: (table.columns.iter())
                .map(|(phase, symbol, unit)| M::head(symbol, phase, *unit))
                .collect(),
            rows: (table.rows.iter())
                .map(|row| {
                    let cells = row.coefficients.iter().map(cell).collect();
                    (M::row_head(&row.term, row.unit), cells)
                })
                .collect(),
        }
    }
}

/// The text of a template, with one line end at its end.
pub fn rendered(template: &impl Template) -> askama::Result<String> {
    let mut text = template.render()?;
    text.truncate(text.trim_end().len());
    text.push('\n');
    Ok(text)
}
