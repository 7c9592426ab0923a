//! The page: an introduction, equations, jumps, sections of words, tables and figures, placed by a template.

use askama::Template;

use super::contents::{AllFigures, JumpFigures};
use super::figures::panel_svg;
use super::provenance::{Origin, origin};
use super::sections::{Section, sections, tiles};
use super::*;
use crate::artifact;
use crate::equations::{Equations, PhaseEquations};
use crate::typeset::latex::tex_cases;
use crate::typeset::mathml::{Html, HtmlProse, HtmlText, system};
use crate::typeset::words::{feet, rounding};
use crate::typeset::{EquationSystem, Rounding, SymbolTable, Typeset, TypesetError, rendered};

const WIDTH_EM: f64 = 44.0;

#[derive(Debug, Clone, Default)]
pub(crate) struct PageOptions {
    /// Effects of simplification within several tolerances, and every change of the chosen one; tables without rows are
    /// left out.
    pub simplification: Vec<Table>,
    pub commands: Vec<String>,
}

/// The report as one HTML page: no request to anywhere, one small script for animations and for copying equations.
pub(crate) fn page(
    content: &Content<'_>,
    introduction: &Introduction,
    figures: &AllFigures,
    options: &PageOptions,
) -> Result<String, TypesetError> {
    let model = content.model;
    let equations = &Equations::of(model);
    let typeset = Typeset::new(equations, &SymbolTable::default(), Rounding::default());
    let page = Page {
        model,
        version: env!("CARGO_PKG_VERSION"),
        digest: artifact::digest(model).to_string(),
        introduction,
        tiles: tiles(content),
        remarks: &content.assessment.remarks,
        phases: typeset.systems.iter().zip(equations.phases()).collect(),
        rounding: rounding::<Html>(Rounding::default(), &typeset.rounding),
        jumps: &figures.jumps,
        rest: content.assessment.runs.len() - figures.jumps.len(),
        sections: sections(content, figures, options),
        origin: origin(model.provenance()),
        commands: &options.commands,
    };
    Ok(rendered(&page)?)
}

/// What the template shows; it escapes texts by [`html`], and sentences of the report itself by [`prose`].
#[derive(Template)]
#[template(path = "report/page.askama", config = "templates/askama.toml")]
struct Page<'a> {
    model: &'a ReducedModel,
    version: &'static str,
    digest: String,
    introduction: &'a Introduction,
    tiles: Vec<(String, String)>,
    remarks: &'a [String],
    phases: Vec<(&'a EquationSystem, &'a PhaseEquations)>,
    rounding: String,
    jumps: &'a [JumpFigures],
    rest: usize,
    sections: Vec<Section<'a>>,
    origin: Origin,
    commands: &'a [String],
}

fn html(text: &str) -> String {
    HtmlText(text).to_string()
}

/// Symbols in the text become mathematics.
fn prose(text: &str) -> String {
    HtmlProse(text).to_string()
}

fn errors(jump: &JumpFigures) -> String {
    let [x, z] = jump.body_rms_m.map(|rms| match rms {
        Some(rms) => format!("{} mm", rounded(1e3 * rms, 2)),
        None => "nothing predicted".to_owned(),
    });
    format!("body x off by {x}, body z by {z} over the whole jump")
}

fn holds(phase: &PhaseEquations) -> String {
    html(&feet(&phase.feet))
}

fn math(equations: &EquationSystem) -> String {
    system(equations, WIDTH_EM)
}

fn latex(equations: &EquationSystem) -> String {
    let latex = tex_cases(equations, WIDTH_EM);
    let lines = latex.lines().map(|line| format!("{}\n", HtmlText(line)));
    lines.collect()
}

fn layout(figure: &Figure) -> &'static str {
    match (figure.panels.len(), figure.columns) {
        (1, _) => "one",
        (_, 2) => "two",
        _ => "many",
    }
}
