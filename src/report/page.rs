//! The page: sections of words, equations, tables and figures, placed by a template.

use askama::Template;

use super::contents::{AllFigures, Content};
use super::control::without_statistics;
use super::figures::{Figure, panel_svg};
use super::tables::{
    baseline_table, body_rms, control_table, coordinate_table, dynamics_table, failures,
    invariance_table, phase_table, run_table,
};
use crate::artifact;
use crate::equations::Equations;
use crate::evaluate::Invariance;
use crate::typeset::latex::tex_cases;
use crate::typeset::mathml::{HtmlText, system};
use crate::typeset::{
    Rounding, SymbolTable, Table, Typeset, TypesetError, rendered, significant, words,
};

/// Longest line of an equation, in em.
const WIDTH_EM: f64 = 44.0;

/// The parts of the page that do not follow from its [`Content`].
#[derive(Debug, Clone, Default)]
pub struct PageOptions {
    /// Effects of simplification within several tolerances.
    pub simplification: Vec<Table>,
    /// Every change of the chosen tolerance, folded away; none if it has no rows.
    pub changes: Table,
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
    let equations = &Equations::of(model);
    let typeset = Typeset::new(equations, &SymbolTable::default(), Rounding::default())?;
    let page = Page {
        name: html(model.name()),
        description: html(model.description()),
        version: env!("CARGO_PKG_VERSION"),
        digest: artifact::digest(model).to_string(),
        headline: (headline(content).iter())
            .map(|(name, value)| (html(name), html(value)))
            .collect(),
        remarks: (content.assessment.remarks.iter())
            .map(|remark| html(remark))
            .collect(),
        phases: phases(equations, &typeset),
        rounding: html(&words::rounding(Rounding::default(), &typeset.rounding)),
        sections: sections(content, figures, options),
        provenance: (model.provenance().iter())
            .map(|(key, value)| match value.as_str() {
                Some(text) => (html(key), html(text)),
                None => (html(key), html(&value.to_string())),
            })
            .collect(),
        commands: options
            .commands
            .iter()
            .map(|command| html(command))
            .collect(),
    };
    Ok(rendered(&page)?)
}

fn html(text: &str) -> String {
    HtmlText(text).to_string()
}

/// The numbers at the top of the page, each with its name.
fn headline(content: &Content<'_>) -> [(String, String); 6] {
    let Content {
        model, assessment, ..
    } = content;
    let every = assessment.restart_every_s;
    let shown = |value: Option<f64>| value.map_or("-".to_owned(), significant);
    let metres = |value: Option<f64>| value.map_or("-".to_owned(), |v| significant(v) + " m");
    let [full, restarted] =
        [&assessment.full, &assessment.restarted].map(|sums| metres(body_rms(assessment, sums)[1]));
    let card = |name: &str, value: String| (name.to_owned(), value);
    [
        card("latent coordinates", model.latent_dim().to_string()),
        card(
            "active terms, all phases",
            assessment.active_terms.to_string(),
        ),
        card("body.z error, whole jump", full),
        card(
            &format!("body.z error, restarted every {every} s"),
            restarted,
        ),
        card(
            "torque R² of the plain lift, contact",
            shown(assessment.lift.torque_r2().contact),
        ),
        card("L_mod (29)", shown(assessment.combined_loss())),
    ]
}

/// The sections below the equations, in their order.
fn sections(content: &Content<'_>, figures: &AllFigures, options: &PageOptions) -> Vec<Section> {
    let Content {
        model, assessment, ..
    } = content;
    let every = assessment.restart_every_s;
    let by_phase = format!("Root mean square errors by phase, restarted every {every} s");
    let constants = assessment.baselines.iter();
    let constants = constants.map(|b| format!("{}: {}.", b.name, b.template.constants()));
    let without = (content.consistent.is_empty())
        .then(|| without_statistics(model))
        .flatten()
        .map(|phase| {
            format!(
                "The controller did not run: the model has no input statistics of phase {phase}, \
                 which weigh its inputs. romc import --inputs-from takes them from recordings."
            )
        });
    let runs = [
        ("Plain lift, u = W_eᵀ u_lat", content.plain),
        ("Consistent lift", content.consistent),
    ];
    let runs = runs.into_iter().filter(|(_, runs)| !runs.is_empty());
    let mut sections = vec![
        Section::new(
            "latent",
            "Composition of the latent coordinates",
            &[ENCODER_WORDS],
        )
        .with(&figures.encoder, []),
        Section::new(
            "coordinates",
            "The model against the recordings",
            &[COORDINATE_WORDS],
        )
        .with(
            &figures.coordinates,
            [
                coordinate_table(assessment).captioned("Errors of every coordinate"),
                phase_table(model, assessment).captioned(by_phase),
            ],
        ),
        Section::new(
            "accelerations",
            "Latent accelerations, stability and inputs",
            &[DYNAMICS_WORDS],
        )
        .with(
            &figures.accelerations,
            std::iter::once(dynamics_table(model, assessment).captioned("Each phase of the model"))
                .chain(Invariance::of(model).ok().as_ref().map(invariance_table)),
        ),
        Section::new("aslip", "Beside the pendulum", &[BASELINE_WORDS])
            .and(constants)
            .with(
                &figures.baselines,
                [
                    baseline_table(assessment)
                        .captioned("Body position: the model and the pendulum"),
                ],
            ),
        Section::new(
            "control",
            "The controller along the recordings",
            &CONTROL_WORDS,
        )
        .and(without)
        .and(failures(content.plain))
        .with(
            &figures.control,
            runs.flat_map(|(lift, runs)| {
                [
                    control_table(runs).captioned(format!("{lift}: the model and its baselines")),
                    run_table(runs).captioned(format!(
                        "{lift}: the solver's work, and what the lift makes of recorded inputs"
                    )),
                ]
            }),
        ),
        Section {
            folded: Some(options.changes.clone())
                .filter(|table| !table.is_empty())
                .into_iter()
                .collect(),
            ..Section::new(
                "simplification",
                "How far the equations can be simplified",
                &SIMPLIFICATION_WORDS,
            )
            .with(&[], options.simplification.iter().cloned())
        },
        Section::new("study", "How many latent coordinates", &[STUDY_WORDS])
            .with(&figures.study, []),
    ];
    sections.retain(|section| match section.id {
        "simplification" => !section.tables.is_empty(),
        "study" => !section.figures.is_empty(),
        _ => true,
    });
    sections
}

const ENCODER_WORDS: &str = "The darker a cell (the brighter on a dark screen), the more of that coordinate the latent one takes.";
const COORDINATE_WORDS: &str = "The model is started from the recorded state and driven by the recorded torques and contacts: once over the whole jump, and again and again from the recorded state. Errors are root mean squares in SI units.";
const DYNAMICS_WORDS: &str = "Eigenvalues belong to each phase's linearisation at its mean state: a positive real part means that small deviations grow at that rate. The input gain is the matrix by which latent inputs accelerate the latent coordinates; its rank counts singular values above 1 % of the largest.";
const BASELINE_WORDS: &str = "The actuated spring-loaded inverted pendulum under the same forces, with the published constants and with the constants that fit the accelerations of these very recordings best.";
const CONTROL_WORDS: [&str; 3] = [
    "At each control step the controller sees the recorded state and plans along the recording. Its commands are not fed back to a robot: these are the commands that it would have given in the states that the robot really had. With the recorded input as reference they are the lifted recorded input whatever the dynamics are, so that the torques in the figures show what the lift is worth.",
    "What the dynamics are worth is in the tables: predictions one stage ahead with the recorded input; torques where the controller has to find its input itself; and how far the body is off in the 0.2 s after a push of 0.1 m/s, where the commands act on a body with the robot's mass and feet that stay where they stand.",
    "The model that knows nothing has the same encoder and decoder and ddz = g u for dynamics, with g fitted to this very recording. Feedback off is the same controller, given the recorded state after the push; replay is the recorded torques.",
];

const SIMPLIFICATION_WORDS: [&str; 2] = [
    "Terms are dropped, coefficients shortened and nearly linear functions made linear, as long as no ddz of a phase can be off by more than the tolerance anywhere in its domain: the smallest box around the recorded latent states and inputs of the phase, a tenth of each range wider on both sides.",
    "The certified error is proven by interval arithmetic for every point of that box. The measured errors are those at the recorded samples. Nothing is proven outside the box, so rollouts stand beside.",
];

const STUDY_WORDS: &str = "One model for every latent dimension and seed, judged on recordings that were not trained on. With more coordinates the decoder errs less and the equations grow.";

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

fn figure_view(figure: &Figure) -> FigureView {
    FigureView {
        id: html(&figure.id),
        caption: html(&figure.caption),
        kind: match (figure.panels.len(), figure.columns) {
            (1, _) => "one",
            (_, 2) => "two",
            _ => "many",
        },
        legend: (figure.legend.iter())
            .map(|(role, words)| (role.class(), html(words)))
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
    tables: Vec<Table>,
    /// Tables whose captions are the summaries that unfold them.
    folded: Vec<Table>,
    figures: Vec<FigureView>,
}

impl Section {
    fn new(id: &'static str, title: &'static str, paragraphs: &[&str]) -> Self {
        Self {
            id,
            title,
            paragraphs: paragraphs.iter().map(|text| html(text)).collect(),
            tables: Vec::new(),
            folded: Vec::new(),
            figures: Vec::new(),
        }
    }

    /// Adds paragraphs.
    fn and(mut self, notes: impl IntoIterator<Item = String>) -> Self {
        self.paragraphs
            .extend(notes.into_iter().map(|note| html(&note)));
        self
    }

    /// Adds figures and tables.
    fn with(self, figures: &[Figure], tables: impl IntoIterator<Item = Table>) -> Self {
        Self {
            tables: tables.into_iter().collect(),
            figures: figures.iter().map(figure_view).collect(),
            ..self
        }
    }
}

/// A figure in the template.
struct FigureView {
    id: String,
    caption: String,
    kind: &'static str,
    legend: Vec<(&'static str, String)>,
    panels: Vec<String>,
}
