//! The page: a verdict, equations, jumps, sections of words, tables and figures, placed by a template.

use askama::Template;

use super::contents::{AllFigures, Content, JumpFigures};
use super::figures::{Figure, Film, Role, panel_svg};
use super::provenance::origin;
use super::sections::{Section, sections, tiles};
use super::verdict::Verdict;
use crate::artifact;
use crate::equations::Equations;
use crate::typeset::latex::tex_cases;
use crate::typeset::mathml::{Html, HtmlProse, HtmlText, system};
use crate::typeset::{
    Rounding, SymbolTable, Table, Typeset, TypesetError, rendered, rounded, words,
};

/// Longest line of an equation, in em.
const WIDTH_EM: f64 = 44.0;

/// The parts of the page that do not follow from its [`Content`].
#[derive(Debug, Clone, Default)]
pub struct PageOptions {
    /// Effects of simplification within several tolerances.
    pub simplification: Vec<Table>,
    /// Every change of the chosen tolerance; none if it has no rows.
    pub changes: Table,
    /// Commands that reproduce the report, in order.
    pub commands: Vec<String>,
}

/// The report as one HTML page: no request to anywhere, one small script for animations and for copying equations.
///
/// # Errors
/// [`TypesetError`] if a candidate term has a variable without a symbol.
pub fn page(
    content: &Content<'_>,
    verdict: Verdict,
    figures: &AllFigures,
    options: &PageOptions,
) -> Result<String, TypesetError> {
    let model = content.model;
    let equations = &Equations::of(model);
    let typeset = Typeset::new(equations, &SymbolTable::default(), Rounding::default())?;
    let origin = origin(model.provenance());
    let all = |texts: &[String]| texts.iter().map(|text| prose(text)).collect();
    let page = Page {
        name: html(model.name()),
        description: html(model.description()),
        version: env!("CARGO_PKG_VERSION"),
        digest: artifact::digest(model).to_string(),
        headline: prose(&verdict.headline),
        sentences: all(&verdict.sentences),
        recordings: verdict.recordings,
        tiles: (tiles(content).iter())
            .map(|(name, value)| (prose(name), prose(value)))
            .collect(),
        remarks: all(&content.assessment.remarks),
        phases: phases(equations, &typeset),
        rounding: words::rounding::<Html>(Rounding::default(), &typeset.rounding),
        jumps: figures.jumps.iter().map(jump_view).collect(),
        rest: content.assessment.runs.len() - figures.jumps.len(),
        sections: sections(content, figures, options),
        facts: (origin.facts.iter())
            .map(|(key, value)| (html(key), html(value)))
            .collect(),
        lists: origin.lists,
        commands: (options.commands.iter())
            .map(|command| html(command))
            .collect(),
    };
    Ok(rendered(&page)?)
}

fn html(text: &str) -> String {
    HtmlText(text).to_string()
}

/// Sentences of the report itself, with their symbols as mathematics.
pub(super) fn prose(text: &str) -> String {
    HtmlProse(text).to_string()
}

fn legend(entries: &[(Role, String)]) -> Vec<(&'static str, String)> {
    let entries = entries.iter();
    entries
        .map(|(role, words)| (role.class(), prose(words)))
        .collect()
}

fn jump_view(jump: &JumpFigures) -> JumpView {
    let [x, z] = jump.body_rms_m.map(|rms| match rms {
        Some(rms) => format!("{} mm", rounded(1e3 * rms, 2)),
        None => "nothing predicted".to_owned(),
    });
    JumpView {
        title: html(&jump.title),
        errors: format!("body x off by {x}, body z by {z} over the whole jump"),
        film: jump.film.clone(),
        film_legend: (jump.film.as_ref()).map_or_else(Vec::new, |film| legend(&film.legend)),
        strip: jump.strip.as_ref().map(figure_view),
        body: figure_view(&jump.body),
        folded: (jump.folded.iter())
            .map(|(title, figure)| (*title, figure_view(figure)))
            .collect(),
    }
}

fn phases(latent: &Equations<'_>, typeset: &Typeset) -> Vec<PhaseView> {
    (typeset.systems.iter().zip(latent.phases()))
        .enumerate()
        .map(|(index, (equations, phase))| PhaseView {
            index,
            name: html(&phase.name),
            feet: html(&words::feet(&phase.feet)),
            terms: phase.active_count(),
            math: system(equations, WIDTH_EM),
            latex: HtmlLines(&tex_cases(equations, WIDTH_EM)).to_string(),
        })
        .collect()
}

/// Text whose line ends stay.
struct HtmlLines<'a>(&'a str);

impl std::fmt::Display for HtmlLines<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        (self.0.lines()).try_for_each(|line| writeln!(f, "{}", HtmlText(line)))
    }
}

pub(super) fn figure_view(figure: &Figure) -> FigureView {
    FigureView {
        id: html(&figure.id),
        caption: prose(&figure.caption),
        kind: match (figure.panels.len(), figure.columns) {
            (1, _) => "one",
            (_, 2) => "two",
            _ => "many",
        },
        legend: legend(&figure.legend),
        panels: (figure.panels.iter())
            .map(|panel| panel_svg(figure, panel))
            .collect(),
    }
}

#[derive(Template)]
#[template(path = "report/page.askama", config = "templates/askama.toml")]
struct Page {
    name: String,
    description: String,
    version: &'static str,
    digest: String,
    headline: String,
    sentences: Vec<String>,
    recordings: Table,
    tiles: Vec<(String, String)>,
    remarks: Vec<String>,
    phases: Vec<PhaseView>,
    rounding: String,
    jumps: Vec<JumpView>,
    /// Jumps without figures.
    rest: usize,
    sections: Vec<Section>,
    facts: Vec<(String, String)>,
    lists: Vec<Table>,
    commands: Vec<String>,
}

/// One phase in the template.
struct PhaseView {
    index: usize,
    name: String,
    feet: String,
    terms: usize,
    math: String,
    latex: String,
}

/// One jump in the template.
struct JumpView {
    title: String,
    errors: String,
    film: Option<Film>,
    film_legend: Vec<(&'static str, String)>,
    strip: Option<FigureView>,
    body: FigureView,
    folded: Vec<(&'static str, FigureView)>,
}

/// A figure in the template.
pub(super) struct FigureView {
    id: String,
    caption: String,
    kind: &'static str,
    legend: Vec<(&'static str, String)>,
    panels: Vec<String>,
}
