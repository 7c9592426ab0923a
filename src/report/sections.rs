//! Sections below the equations: words, tables and figures about one thing each, and the tiles at the top.

use super::tables::{verdict_table, with_phases};
use super::*;

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

pub(super) fn tiles(content: &Content<'_>) -> Vec<(String, String)> {
    let (model, assessment) = (content.model, content.assessment);
    let every = assessment.restart_every_s;
    let shown = |value: Option<f64>| value.map_or("-".to_owned(), significant);
    let with = |value: Option<f64>, unit: f64, digits| {
        value.map_or("-".to_owned(), |value| {
            rounded(unit * value, digits).to_string()
        })
    };
    let errors = |sums: &CoordinateSums| {
        let [x, z] = body_rms(assessment, sums).map(|rms| with(rms, 1e3, 2));
        format!("{x}, {z} mm")
    };
    let pair = |(name, unit): (&str, f64)| {
        let row = content.verdict.rows.iter().find(|row| row.name == name);
        let row = row.map(|row| [row.value, row.baseline].map(|value| with(value, unit, 3)));
        row.map_or("-".to_owned(), |pair| pair.join(", "))
    };
    let (d, terms) = (model.latent_dim(), assessment.active_terms);
    let loss = shown(assessment.combined_loss());
    let lift_r2 = assessment.lift.torque.r2().contact;
    let restarted = format!("body x, z: rms error, restarted every {every} s");
    let (over, long) = match &assessment.over_stride {
        Some([own, ..]) => ("body x, z: rms error over a stride", own),
        None => ("body x, z: rms error over whole motions", &assessment.full),
    };
    let names = [
        over,
        &restarted,
        "torque R² in contact that the controller finds itself: worst recording; no dynamics",
        "deviation after a push, mm: worst recording; no feedback",
        "size alone: latent coordinates, active terms, combined loss of accuracy and size L_mod",
        "encoder and decoder alone, whatever the dynamics: torque R² of the plain lift, contact",
    ];
    let [whole, restarted] = [long, &assessment.restarted].map(errors);
    let [torques, push] = [(TORQUES_IN_CONTACT, 1.0), (AFTER_A_PUSH, 1e3)].map(pair);
    let size = format!("{d}, {terms}, {loss}");
    let values = [whole, restarted, torques, push, size, shown(lift_r2)];
    names.map(str::to_owned).into_iter().zip(values).collect()
}

pub(super) fn sections<'a>(
    content: &Content<'_>,
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
    let invariance = Invariance::of(model);
    let not_told =
        (invariance.as_ref().err()).map(|error| format!("Invariance is not told: {error}."));
    let physics = invariance.ok().flatten();
    let dynamics = dynamics_table(model, assessment).captioned("Each phase of the model");
    let every_row = verdict_table(content.verdict);
    let every_row =
        every_row.captioned("Every figure with its baseline and the value that it needs");
    let errors = with_phases(coordinate_table(model, assessment), model, assessment);
    let mut sections = vec![
        Section::new("verdict").folding([every_row]),
        Section::new("coordinates").folding([errors.captioned(by_phase)]),
        (Section::new("stability").and(not_told))
            .with([dynamics])
            .with(physics.as_ref().map(invariance_table)),
        beside_pendulum(content),
        control(content),
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

fn beside_pendulum(content: &Content<'_>) -> Section<'static> {
    let assessment = content.assessment;
    let baselines = &assessment.baselines;
    let constants = baselines.iter();
    let constants = constants.map(|b| format!("{}: {}.", b.name, b.template.constants()));
    let is_springless = baselines.iter().any(|b| b.template.stiffness_n_m == 0.0);
    let springless = is_springless.then(|| SPRINGLESS.to_owned());
    let table = baseline_table(assessment).captioned("Body position: the model and the pendulum");
    (Section::new("aslip").and(constants).and(springless)).with([table])
}

fn control(content: &Content<'_>) -> Section<'static> {
    let (plain, shown) = (content.plain, content.consistent);
    let without = without_statistics(content.model).filter(|_| shown.is_empty());
    let without = without.map(|phase| {
        format!(
            "The controller did not run: the model has no input statistics of phase {phase}, \
             which weigh its inputs. romc import --inputs-from takes them from recordings."
        )
    });
    let along = match shown.len() {
        1 => "",
        _ => " along the first recording",
    };
    let judged = |runs: &[NamedRun], caption: String| control_table(runs).captioned(caption);
    let beside = "the model and its baselines";
    let of_first = format!("{CONSISTENT}: {beside}{along}");
    let first = shown.get(..1).map(|first| judged(first, of_first));
    let of_every = format!("{CONSISTENT}: the same along every recording");
    let every = (shown.len() > 1).then(|| judged(shown, of_every));
    let runs = [(PLAIN, plain), (CONSISTENT, shown)].into_iter();
    let runs = runs.filter(|(_, runs)| !runs.is_empty());
    let work = runs.map(|(lift, runs)| {
        let words = "the solver's work, and what the lift makes of recorded inputs";
        let table = run_table(runs).captioned(format!("{lift}: {words}"));
        // Few runs with many figures each: a column per run, so that the table is no wider than the page.
        match table.rows.len() <= MOST_RUNS {
            true => table.transposed(),
            false => table,
        }
    });
    Section::new("control")
        .and(without)
        .and(failures(content.usual))
        .with(first)
        .folding(every)
        .folding([judged(plain, format!("{PLAIN}: {beside}"))])
        .folding(work)
}

const PLAIN: &str = "Plain lift, u = W_e^T u_lat";
const CONSISTENT: &str = "Consistent lift";
const MOST_RUNS: usize = 6;

const WORDS: [&[&str]; 8] = [
    &[
        "verdict",
        "The verdict row by row",
        "A model is fit for a use if every counted row of it passes; of the controller's figures those of the recording with the least margin are shown. Where predictions one stage ahead or between restarts fail, other figures of the control that pass are not due to the dynamics and count as not measured.",
    ],
    &["coordinates", "Errors of every coordinate"],
    &[
        "stability",
        "Phases, stability and inputs",
        "Eigenvalues belong to each phase's linearisation at its mean state: a positive real part means that small deviations grow at that rate. The input gain is the matrix by which latent inputs accelerate the latent coordinates; its rank counts singular values above 1 % of the largest.",
    ],
    &[
        "aslip",
        "Beside the pendulum",
        "The actuated spring-loaded inverted pendulum under the same forces, with the published constants and with the constants that fit the accelerations of these very recordings best.",
    ],
    &[
        "control",
        "The controller along the recordings",
        "At each control step the controller sees the recorded state and plans along the recording. Its commands are not fed back to a robot: these are the commands that it would have given in the states that the robot really had. With the recorded input as reference they are the lifted recorded input whatever the dynamics are, so that the torques in the figures show what the lift is worth.",
        "What the dynamics are worth is in the tables: predictions one stage ahead with the recorded input; torques where the controller has to find its input itself; and how far the body is off in the 0.2 s after a push of 0.1 m/s, where the commands act on a body with the robot's mass and feet that stay where they stand.",
        "The no-dynamics baseline has the same encoder and decoder and ddz = g u, with g fitted to this very recording. Feedback off is the same controller, given the recorded state after the push; replay is the recorded torques.",
    ],
    &[
        "latent",
        "Composition of the latent coordinates",
        "The darker a cell (the brighter on a dark screen), the more of that coordinate the latent one takes.",
    ],
    &[
        "simplification",
        "How far the equations can be simplified",
        "Terms are dropped, coefficients shortened and nearly linear functions made linear, as long as no acceleration ddz of a phase can be off by more than the tolerance anywhere in its domain: the smallest box around the recorded latent states and inputs of the phase, a tenth of each range wider on both sides.",
        "The certified error is proven by interval arithmetic for every point of that box. The measured errors are those at the recorded samples. Nothing is proven outside the box, so rollouts stand beside.",
    ],
    &[
        "study",
        "How many latent coordinates",
        "One model for every latent dimension and seed, judged on recordings that were not trained on. With more coordinates the decoder errs less and the equations grow.",
    ],
];

const SPRINGLESS: &str = "Where k_s is 0, a spring that pushes away would have fitted best: it is left out, and that pendulum is a mass under the recorded forces alone, which falls where these do not carry it.";
