//! Equations as `math` elements, and a page that shows them.

use askama::Template;

use crate::equations::{Equations, Unit};
use crate::files::EmittedFile;
use crate::typeset::latex::tex_cases;
use crate::typeset::page::{Page, rendered};
use crate::typeset::words::Spelling;
use crate::typeset::{
    EQUALS, EquationSystem, Math, PrintOptions, TypesetError, break_lines, symbol_width,
};

use super::math::{mathml, mathml_symbol, mathml_terms};
use super::prose::HtmlText;

/// What a continued line is set in by, in em.
const INDENT: f64 = 2.0;

/// One phase as a `math` element: a brace before its equations, each broken into lines of `width_em`. The LaTeX of the
/// same equations stands in an annotation, where tools for copying find it.
pub fn system(system: &EquationSystem, width_em: f64) -> String {
    let mut rows = String::new();
    for equation in &system.equations {
        let left = mathml_symbol(&equation.left);
        let first = symbol_width(&equation.left) + EQUALS;
        let lines = break_lines(&equation.terms, width_em, first, INDENT);
        let relation = if equation.is_approximate { "≈" } else { "=" };
        let mut head = format!("{left}<mo>{relation}</mo>");
        if lines.is_empty() {
            rows.push_str(&row(&head, &mathml(&equation.right()), 0.0));
        }
        for (place, terms) in lines.into_iter().enumerate() {
            let continues = place > 0;
            let indent = if continues { INDENT } else { 0.0 };
            rows.push_str(&row(&head, &mathml_terms(terms, continues), indent));
            head.clear();
        }
    }
    let tex = tex_cases(system, width_em);
    format!(
        "<math display=\"block\"><semantics><mrow><mo fence=\"true\" form=\"prefix\" \
         stretchy=\"true\">{{</mo><mtable displaystyle=\"true\">{rows}</mtable></mrow>\
         <annotation encoding=\"application/x-tex\">{}</annotation></semantics></math>",
        HtmlText(&tex)
    )
}

fn row(left: &str, right: &str, indent: f64) -> String {
    let space = match indent > 0.0 {
        true => format!("<mspace width=\"{indent}em\"/>"),
        false => String::new(),
    };
    format!(
        "<mtr><mtd style=\"text-align:right;padding-right:0\"><mrow>{left}</mrow></mtd>\
         <mtd style=\"text-align:left;padding-left:0\"><mrow>{space}{right}</mrow></mtd></mtr>"
    )
}

/// The page `NAME.html`: each phase's equations and the table of coefficients, without scripts or anything from
/// elsewhere.
///
/// # Errors
/// [`TypesetError::Template`].
pub fn emit(
    equations: &Equations<'_>,
    options: &PrintOptions,
) -> Result<Vec<EmittedFile>, TypesetError> {
    let page = Page::new::<Html>(equations, options);
    let path = format!("{}.html", equations.model().identifier());
    Ok(vec![EmittedFile::new(path, rendered(&Document { page })?)])
}

#[derive(Template)]
#[template(path = "mathml/page.askama", config = "templates/askama.toml")]
struct Document<'a> {
    page: Page<'a>,
}

/// Text and mathematics for the content of an element.
#[derive(Clone, Copy, Debug)]
pub struct Html;

impl Spelling for Html {
    fn text(text: &str) -> String {
        HtmlText(text).to_string()
    }

    fn math(math: &Math, _: &str) -> String {
        format!("<math>{}</math>", mathml(math))
    }
}

fn after_comma(unit: &Option<Unit>) -> String {
    unit.map_or(String::new(), |unit| format!(", {unit}"))
}
