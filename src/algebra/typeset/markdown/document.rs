//! The Markdown file of a model.

use askama::Template;

use crate::equations::{Equations, Unit};
use crate::files::EmittedFile;
use crate::typeset::latex::{TexMath, TexNumber, TexSymbol, TexUnit, tex_cases};
use crate::typeset::page::{Markup, Page, rendered};
use crate::typeset::words::Spelling;
use crate::typeset::{
    Decimal, EquationSystem, Math, NumberStyle, PrintOptions, Symbol, TypesetError,
};

use super::escape::MarkdownText;

/// The file `NAME.md`: each phase's equations in `math` fences, and the table of
/// coefficients, as GitHub and GitLab show them.
///
/// # Errors
/// [`TypesetError`] if a candidate term has a variable without a symbol.
pub fn emit(
    equations: &Equations<'_>,
    options: &PrintOptions,
) -> Result<Vec<EmittedFile>, TypesetError> {
    let page = Page::new::<Markdown>(equations, options)?;
    let path = format!("{}.md", equations.model().identifier());
    Ok(vec![EmittedFile::new(path, rendered(&Document { page })?)])
}

#[derive(Template)]
#[template(path = "markdown/page.askama", config = "../../templates/askama.toml")]
struct Document {
    page: Page,
}

const NUMBERS: NumberStyle = NumberStyle::Plain;

struct Markdown;

impl Spelling for Markdown {
    fn text(text: &str) -> String {
        MarkdownText(text).to_string()
    }

    fn number(number: &Decimal) -> String {
        let numbers = NUMBERS;
        format!("$`{}`$", TexNumber { number, numbers })
    }

    fn term(math: &Math, _: &str) -> String {
        let numbers = NUMBERS;
        format!("$`{}`$", TexMath { math, numbers })
    }

    fn left(symbol: &Symbol, _: &str) -> String {
        format!("$`{}`$", TexSymbol(symbol))
    }
}

impl Markup for Markdown {
    fn system(system: &EquationSystem, width_em: f64) -> String {
        tex_cases(system, width_em)
    }

    fn head(symbol: &Symbol, phase: &str, unit: Option<Unit>) -> String {
        let (symbol, phase) = (TexSymbol(symbol), MarkdownText(phase));
        format!("$`{symbol}`$ {phase}{}", after_comma(unit))
    }

    fn row_head(math: &Math, unit: Option<Unit>) -> String {
        format!("{}{}", Self::term(math, ""), after_comma(unit))
    }
}

fn after_comma(unit: Option<Unit>) -> String {
    unit.map_or(String::new(), |unit| format!(", $`{}`$", TexUnit(unit)))
}
