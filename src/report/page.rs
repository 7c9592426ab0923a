//! The page: sections of words, equations, tables and figures, placed by a template.

use askama::Template;

use super::contents::{AllFigures, Content};
use super::figures::{Figure, panel_svg};
use crate::artifact;
use crate::equations::Equations;
use crate::typeset::TypesetError;
use crate::typeset::latex::{LatexOptions, tex_cases};
use crate::typeset::mathml::{HtmlText, system};
use crate::typeset::{Rounding, SymbolTable, Typeset, words};

/// Longest line of an equation, in em.
const WIDTH_EM: f64 = 44.0;

/// A table for the page; the first column names the rows.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct PageTable {
    /// What it lists.
    pub caption: String,
    /// Titles of the columns.
    pub header: Vec<String>,
    /// Cells, a row after the other.
    pub rows: Vec<Vec<String>>,
}

/// Words and tables that the caller has.
#[derive(Debug, Clone, Default)]
pub struct PageOptions {
    /// The most telling figures: a name and a value.
    pub headline: Vec<(String, String)>,
    /// Warnings below the figures of the headline.
    pub remarks: Vec<String>,
    /// Errors of every coordinate.
    pub coordinates: Vec<PageTable>,
    /// The model beside the template models.
    pub baselines: Vec<PageTable>,
    /// Latent accelerations, stability, input gain.
    pub dynamics: Vec<PageTable>,
    /// The controller's runs.
    pub control: Vec<PageTable>,
    /// Sentences below the tables of the controller.
    pub control_notes: Vec<String>,
    /// What simplification within several tolerances does.
    pub simplification: Vec<PageTable>,
    /// Long lists of changes, shown when asked for.
    pub changes: Vec<PageTable>,
    /// Sentences below the tables of baselines.
    pub baseline_notes: Vec<String>,
    /// Commands that reproduce the report, in order.
    pub commands: Vec<String>,
}

/// The report as one HTML page: no request to anywhere, one small script for copying equations.
///
/// # Errors
/// [`TypesetError`] if a candidate term has a variable without a symbol.
pub fn page(
    content: &Content<'_>,
    figures: &AllFigures,
    options: &PageOptions,
) -> Result<String, TypesetError> {
    let model = content.model;
    let mut sections = vec![
        section(
            "latent",
            "What the latent coordinates are",
            &[ENCODER_WORDS],
            &figures.encoder,
            &[],
        ),
        section(
            "coordinates",
            "The model against the recordings",
            &[COORDINATE_WORDS],
            &figures.coordinates,
            &options.coordinates,
        ),
        section(
            "accelerations",
            "Latent accelerations, stability and inputs",
            &[DYNAMICS_WORDS],
            &figures.accelerations,
            &options.dynamics,
        ),
        with_notes(
            section(
                "aslip",
                "Beside the pendulum",
                &[BASELINE_WORDS],
                &figures.baselines,
                &options.baselines,
            ),
            &options.baseline_notes,
        ),
        with_notes(
            section(
                "control",
                "The controller along the recordings",
                &[CONTROL_WORDS],
                &figures.control,
                &options.control,
            ),
            &options.control_notes,
        ),
    ];
    if !options.simplification.is_empty() {
        sections.push(Section {
            folded: options.changes.iter().map(table_view).collect(),
            ..section(
                "simplification",
                "How far the equations can be simplified",
                &SIMPLIFICATION_WORDS,
                &[],
                &options.simplification,
            )
        });
    }
    if !figures.study.is_empty() {
        sections.push(section(
            "study",
            "How many latent coordinates",
            &[STUDY_WORDS],
            &figures.study,
            &[],
        ));
    }
    let equations = &Equations::of(model);
    let typeset = Typeset::new(equations, &SymbolTable::default(), Rounding::default())?;
    let page = Page {
        name: HtmlText(model.name()).to_string(),
        description: HtmlText(model.description()).to_string(),
        version: env!("CARGO_PKG_VERSION"),
        digest: artifact::digest(model).to_string(),
        headline: (options.headline.iter())
            .map(|(name, value)| (HtmlText(name).to_string(), HtmlText(value).to_string()))
            .collect(),
        remarks: (options.remarks.iter())
            .map(|remark| HtmlText(remark).to_string())
            .collect(),
        phases: phases(equations, &typeset),
        rounding: HtmlText(&words::rounding(Rounding::default(), &typeset.rounding)).to_string(),
        sections,
        provenance: (model.provenance().iter())
            .map(|(key, value)| {
                let words = value
                    .as_str()
                    .map_or_else(|| value.to_string(), str::to_owned);
                (HtmlText(key).to_string(), HtmlText(&words).to_string())
            })
            .collect(),
        commands: (options.commands.iter())
            .map(|command| HtmlText(command).to_string())
            .collect(),
    };
    let mut text = page.render()?;
    text.truncate(text.trim_end().len());
    text.push('\n');
    Ok(text)
}

const ENCODER_WORDS: &str = "The darker a cell (the brighter on a dark screen), the more of that coordinate the latent one takes.";
const COORDINATE_WORDS: &str = "The model is started from the recorded state and driven by the recorded torques and contacts: once over the whole jump, and again and again from the recorded state. Errors are root mean squares in SI units.";
const DYNAMICS_WORDS: &str = "Eigenvalues belong to each phase's linearisation at its mean state: a positive real part means that small deviations grow at that rate. The input gain is the matrix by which latent inputs accelerate the latent coordinates; its rank counts singular values above 1 % of the largest.";
const BASELINE_WORDS: &str = "The actuated spring-loaded inverted pendulum under the same forces, with the published constants and with the constants that fit the accelerations of these very recordings best.";
const CONTROL_WORDS: &str = "At each control step the controller sees the recorded state and plans along the recording. Its commands are not fed back to a robot: this tells what it would have commanded where the robot really was.";

const SIMPLIFICATION_WORDS: [&str; 2] = [
    "Terms are dropped, coefficients shortened and nearly linear functions made linear, as long as no ddz of a phase can be off by more than the tolerance anywhere in its domain: the smallest box around the recorded latent states and inputs of the phase, a tenth of each range wider on both sides.",
    "The certified error is proven by interval arithmetic for every point of that box. The measured errors are those at the recorded samples. Nothing is proven outside the box, so rollouts stand beside.",
];

const STUDY_WORDS: &str = "One model for every latent dimension and seed, judged on recordings that were not trained on. With more coordinates the decoder errs less and the equations grow.";

fn phases(latent: &Equations<'_>, typeset: &Typeset) -> Vec<PhaseView> {
    let options = LatexOptions {
        width_em: WIDTH_EM,
        ..LatexOptions::default()
    };
    (typeset.systems.iter().zip(latent.phases()))
        .enumerate()
        .map(|(index, (equations, phase))| PhaseView {
            index,
            name: HtmlText(&phase.name).to_string(),
            feet: HtmlText(&words::feet(&phase.feet)).to_string(),
            terms: phase.active_count(),
            math: system(equations, WIDTH_EM),
            latex: HtmlLines(&tex_cases(equations, &options)).to_string(),
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

fn section(
    id: &'static str,
    title: &'static str,
    paragraphs: &[&str],
    figures: &[Figure],
    tables: &[PageTable],
) -> Section {
    Section {
        id,
        title,
        paragraphs: paragraphs.iter().map(|p| HtmlText(p).to_string()).collect(),
        tables: tables.iter().map(table_view).collect(),
        folded: Vec::new(),
        figures: figures.iter().map(figure_view).collect(),
    }
}

fn with_notes(mut section: Section, notes: &[String]) -> Section {
    (section.paragraphs).extend(notes.iter().map(|note| HtmlText(note).to_string()));
    section
}

fn table_view(table: &PageTable) -> PageTable {
    let escape = |cells: &Vec<String>| cells.iter().map(|c| HtmlText(c).to_string()).collect();
    PageTable {
        caption: HtmlText(&table.caption).to_string(),
        header: escape(&table.header),
        rows: table.rows.iter().map(escape).collect(),
    }
}

fn figure_view(figure: &Figure) -> FigureView {
    FigureView {
        id: HtmlText(&figure.id).to_string(),
        caption: HtmlText(&figure.caption).to_string(),
        kind: if figure.panels.len() == 1 {
            "one"
        } else if figure.columns == 2 {
            "two"
        } else {
            "many"
        },
        legend: (figure.legend.iter())
            .map(|(role, words)| (role.class(), HtmlText(words).to_string()))
            .collect(),
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
    headline: Vec<(String, String)>,
    remarks: Vec<String>,
    phases: Vec<PhaseView>,
    rounding: String,
    sections: Vec<Section>,
    provenance: Vec<(String, String)>,
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

/// A section in the template, escaped.
struct Section {
    id: &'static str,
    title: &'static str,
    paragraphs: Vec<String>,
    tables: Vec<PageTable>,
    folded: Vec<PageTable>,
    figures: Vec<FigureView>,
}

/// A figure in the template.
struct FigureView {
    id: String,
    caption: String,
    kind: &'static str,
    legend: Vec<(&'static str, String)>,
    panels: Vec<String>,
}
