//! Sections below the equations: words, tables and figures about one thing each.

use super::jump::meaning;
use super::tables::with_phases;
use super::*;
use crate::mpc::{Lift, settings_for};

pub(super) struct Section<'a> {
    pub id: &'static str,
    pub title: &'static str,
    pub paragraphs: Vec<String>,
    pub tables: Vec<Table>,
    pub folded: Vec<Table>,
    pub figures: &'a [Figure],
}

impl<'a> Section<'a> {
    fn new(id: &'static str) -> Self {
        let row = WORDS.iter().find(|row| row[0] == id);
        let row = row.expect("a row for each section");
        Self {
            id,
            title: row[1],
            paragraphs: row[2..].iter().map(|&text| text.to_owned()).collect(),
            tables: Vec::new(),
            folded: Vec::new(),
            figures: &[],
        }
    }

    fn and(mut self, notes: impl IntoIterator<Item = String>) -> Self {
        self.paragraphs.extend(notes);
        self
    }

    fn with(mut self, tables: impl IntoIterator<Item = Table>) -> Self {
        self.tables.extend(tables);
        self
    }

    fn folding(mut self, tables: impl IntoIterator<Item = Table>) -> Self {
        let tables = tables.into_iter().filter(|table| !table.rows.is_empty());
        self.folded.extend(tables);
        self
    }

    fn showing(self, figures: &'a [Figure]) -> Self {
        Self { figures, ..self }
    }
}

pub(super) fn sections<'a>(
    content: &Content<'_>,
    introduction: &Introduction,
    figures: &'a AllFigures,
    options: &PageOptions,
) -> Vec<Section<'a>> {
    let (model, assessment) = (content.model, content.assessment);
    let every = assessment.restart_every_s;
    let by_phase = format!(
        "All {} coordinates: root mean square errors over whole motions and restarted every {every} s; on the right those of \
         each phase, restarted",
        assessment.names.len()
    );
    let dynamics = dynamics_table(model, assessment).captioned("Each phase of the model");
    let errors = with_phases(coordinate_table(model, assessment), model, assessment);
    let mut sections = vec![
        Section::new("coordinates").folding([errors.captioned(by_phase)]),
        Section::new("stability").with([dynamics, size_table(content)]),
        beside_templates(content, introduction),
        control(content, introduction),
        Section::new("latent").showing(&figures.encoder),
        Section::new("simplification").folding(options.simplification.iter().cloned()),
        Section::new("study").showing(&figures.study),
    ];
    sections.retain(|section| match section.id {
        "simplification" => !section.folded.is_empty(),
        "study" => !section.figures.is_empty(),
        _ => true,
    });
    sections
}

/// Metrics that no change of the coefficients' values changes.
fn size_table(content: &Content<'_>) -> Table {
    let (model, assessment) = (content.model, content.assessment);
    let shown = |value: Option<f64>| value.map_or("-".to_owned(), significant);
    let lift_r2 = assessment.lift.torque.r2().contact;
    let (loss, decoder) = (assessment.combined_loss(), assessment.decoder_mean_square());
    let rows = [
        ("latent coordinates", model.latent_dim().to_string()),
        ("active terms", assessment.active_terms.to_string()),
        ("decoder mean square, scaled units", shown(decoder)),
        ("torque R^2 of the transpose lift, contact", shown(lift_r2)),
        ("combined loss of accuracy and size L_mod", shown(loss)),
    ];
    Table::of(rows)
        .column("metric", "", |row| row.0)
        .column("value", "", |row| row.1.clone())
        .table()
        .captioned("Size, encoder and decoder")
}

fn beside_templates(content: &Content<'_>, introduction: &Introduction) -> Section<'static> {
    let assessment = content.assessment;
    let baselines = &assessment.baselines;
    let constants = |b: &Baseline| format!("{}Constants: {}.", meaning(b), b.template.constants());
    let is_springless = baselines.iter().any(|b| b.template.stiffness_n_m == 0.0);
    let springless = is_springless.then(|| SPRINGLESS.to_owned());
    let table = baseline_table(assessment).captioned("Errors of the body's position");
    let section = Section::new("aslip").and(introduction.template.clone());
    let section = section.and(baselines.iter().map(constants)).and(springless);
    let title = match is_springless {
        true => "Compared with the point mass (fitted)",
        false => section.title,
    };
    Section { title, ..section }.with([table])
}

fn control(content: &Content<'_>, introduction: &Introduction) -> Section<'static> {
    let without = without_statistics(content.model).filter(|_| content.usual.is_empty());
    let without = without.map(|phase| {
        format!(
            "The controller did not run: the model has no input statistics of phase {phase}, \
             which weigh its inputs. romc import --inputs-from computes them from recordings."
        )
    });
    let mut lifts = [
        ("Transpose lift", content.plain),
        ("Consistent lift", content.consistent),
    ];
    if settings_for(content.model).lift == Lift::Consistent {
        lifts.reverse();
    }
    let [(usual, runs), (other, others)] = lifts;
    let judged = |lift: &str, runs: &[NamedRun], along: &str| {
        let caption = format!("{lift}: the model and its baselines{along}");
        control_table(runs).captioned(caption)
    };
    let along = match runs.len() {
        1 => "",
        _ => " along the first recording",
    };
    let judged_by = format!("{usual}, used for the verdict");
    let first = runs.get(..1).map(|first| judged(&judged_by, first, along));
    let every = (runs.len() > 1).then(|| judged(usual, runs, " along every recording"));
    let mut failed = Table::new(["failed along each recording"]);
    for words in failures(runs) {
        failed.row([words]);
    }
    let work = lifts.into_iter().filter(|(_, runs)| !runs.is_empty());
    let work = work.map(|(lift, runs)| {
        let words = "effort of the solver, and recorded inputs after projection and lift";
        let table = run_table(runs).captioned(format!("{lift}: {words}"));
        // Few runs with many metrics each: a column per run, so that the table is no wider than the page.
        match table.rows.len() <= MOST_RUNS {
            true => table.transposed(),
            false => table,
        }
    });
    Section::new("control")
        .and(introduction.commands.clone())
        .and(without)
        .with(first)
        .folding([failed.captioned("Failed metrics of each recording")])
        .folding(every)
        .folding([judged(other, others, "")])
        .folding(work)
}

const MOST_RUNS: usize = 6;

/// Id, title and paragraphs of each section.
const WORDS: [&[&str]; 7] = [
    &[
        "coordinates",
        "Errors of every coordinate",
        "R^2 is 1 for a perfect prediction and 0 for the mean of the recording.",
    ],
    &[
        "stability",
        "Phases, stability and size",
        "Eigenvalues are those of each phase's linearisation at its mean state. A positive real part means that small deviations grow at that rate. The input gain maps latent inputs to latent accelerations; its rank counts singular values above 1 % of the largest. Metrics of size, encoder and decoder are the same for any values of the coefficients.",
    ],
    &["aslip", "Compared with the spring-loaded pendulum"],
    &[
        "control",
        "The controller along the recordings",
        "At each control step the controller gets the recorded state and plans along the recording. Its commands are not applied to a robot. With the recorded input as reference, the commands are the lifted recorded input for any dynamics: the plots of torques show the lift. The transpose lift is u = W_e^T u_lat; the consistent lift finds torques whose foot forces give the latent input.",
        "The tables show three effects of the dynamics. Predictions one stage ahead use the recorded input. Torques are found without the recorded ones. The deviation after a push of 0.1 m/s counts over 0.2 s, with commands that act on a body with the robot's mass and fixed feet.",
        "No dynamics: the same encoder, decoder and controller with ddz = g u, g fitted to this recording. No feedback: the same controller with the recorded state after the push. Replay: the recorded torques again, without a controller. Constant velocity: latent coordinates keep their velocity.",
    ],
    &[
        "latent",
        "Composition of the latent coordinates",
        "A darker cell (brighter on a dark screen) is a larger weight of the coordinate in the latent coordinate.",
    ],
    &[
        "simplification",
        "How far the equations can be shortened",
        "Terms are dropped, coefficients shortened and nearly linear functions made linear. No acceleration ddz of a phase changes by more than the tolerance anywhere in its domain. The domain is the smallest box around the recorded latent states and inputs of the phase, wider by a tenth of each range on both sides.",
        "The certified error is proven by interval arithmetic for every point of that box. The measured errors are those at the recorded samples. Outside the box nothing is proven; the errors of predictions show the effect there.",
    ],
    &[
        "study",
        "How many latent coordinates",
        "One model for every latent dimension and seed, judged on recordings that training did not use. More coordinates reduce the decoder's error and lengthen the equations.",
    ],
];

const SPRINGLESS: &str = "The fit of the spring is negative: it would push away. The fitted baseline therefore has no spring and no rest length.";
