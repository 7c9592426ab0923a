//! The figures of a report, from an assessment and the controller's runs.

use super::control::{latent_inputs, torques};
use super::figures::{Drawing, HeatMap, subscript};
use super::jump::Jump;
use super::*;
use crate::mpc::Lift;
use crate::study::{DimensionSummary, Spread, Summary};

const MAX_JUMPS: usize = 3;

#[derive(Debug, Clone, Copy)]
pub(crate) struct Content<'a> {
    pub model: &'a ReducedModel,
    pub assessment: &'a Assessment<'a>,
    pub verdict: &'a Verdict,
    /// The controller along each recording with the plain lift; empty if it did not run.
    pub plain: &'a [NamedRun],
    /// The same with the lift that keeps torques and forces consistent.
    pub consistent: &'a [NamedRun],
    pub study: Option<&'a Summary>,
    pub plan: Option<&'a Segment>,
    /// Digests of the recordings' files, by path, as a model's provenance has them.
    pub digests: &'a [(PathBuf, String)],
}

#[derive(Default)]
pub(crate) struct AllFigures {
    pub encoder: Vec<Figure>,
    pub jumps: Vec<JumpFigures>,
    pub study: Vec<Figure>,
}

pub(crate) struct JumpFigures {
    pub title: String,
    /// Root mean square errors of body x and z over the whole jump, in m.
    pub body_rms_m: [Option<f64>; 2],
    /// The robot recorded and predicted, as a strip for paper and animated.
    pub motion: Option<(Figure, Film)>,
    pub body: Figure,
    /// Figures to fold away, each with a title: accelerations, template models, joints, and the controller's run if
    /// this is the first jump of a recording.
    pub folded: Vec<(&'static str, Figure)>,
}

impl AllFigures {
    pub(crate) fn iter(&self) -> impl Iterator<Item = &Figure> {
        let jumps = self.jumps.iter();
        let jumps = jumps.flat_map(|jump| {
            let folded = jump.folded.iter().map(|(_, figure)| figure);
            let strip = jump.motion.iter().map(|(strip, _)| strip);
            strip.chain([&jump.body]).chain(folded)
        });
        self.encoder.iter().chain(jumps).chain(&self.study)
    }
}

pub(crate) fn all_figures(content: &Content<'_>) -> Result<AllFigures, ModelError> {
    let mut figures = AllFigures::default();
    let (model, assessment) = (content.model, content.assessment);
    if let Some(run) = assessment.runs.first() {
        figures.encoder.push(encoder(model, assessment, run)?);
    }
    for (index, jump) in Jump::all(content)?.into_iter().take(MAX_JUMPS).enumerate() {
        let [joints, body] = jump.coordinates();
        let mut folded = vec![
            ("Latent accelerations", jump.accelerations()?),
            ("Beside the pendulum", jump.baselines()),
            ("Joint angles", joints),
        ];
        let path = &jump.run.segment.path;
        let is_first = (assessment.runs[..index].iter()).all(|run| run.segment.path != *path);
        let run = content.consistent.iter().find(|(of, _)| of == path);
        if let Some((_, run)) = run.filter(|_| is_first) {
            let torques = torques(model, Lift::Consistent, run, &jump.place);
            let inputs = latent_inputs(model, run, &jump.place);
            folded.extend([
                ("Joint torques of the controller", torques),
                ("Latent inputs of the controller", inputs),
            ]);
        }
        let plan = content.plan.filter(|_| index == 0);
        figures.jumps.push(JumpFigures {
            title: jump.place.words.clone(),
            body_rms_m: jump.body_rms_m(),
            motion: jump.motion(plan),
            body,
            folded,
        });
    }
    figures.study = content.study.map(study_figures).unwrap_or_default();
    Ok(figures)
}

/// Figures 6, 9 and 15 of the paper.
fn encoder(
    model: &ReducedModel,
    assessment: &Assessment<'_>,
    run: &SegmentRun<'_>,
) -> Result<Figure, ModelError> {
    let x = run.segment.x.column(0).into_owned();
    // d z / d x in SI units; without the scaling it is W_e of a linear encoder
    let weights = model.encoder_jacobian(&x)?;
    let factors = model.state_factors()?;
    let d = model.latent_dim();
    let rows = 0..assessment.names.len();
    let values = rows.flat_map(|row| (0..d).map(move |column| (row, column)));
    let values = values.map(|(row, column)| weights[(column, row)] / factors[row]);
    let what = match model.is_linear() {
        true => "Magnitudes of the encoder's weights",
        false => "Magnitudes of the encoder's Jacobian at the first sample",
    };
    let caption = format!("{what}: how much of each coordinate a latent one takes (scaled units).");
    let columns = (1..=d).map(|index| format!("z{}", subscript(index)));
    let map = Panel {
        title: "|weight|".to_owned(),
        drawing: Drawing::Heat(HeatMap {
            rows: assessment.names.clone(),
            columns: columns.collect(),
            values: values.collect(),
        }),
    };
    let figure = Figure::over_time("encoder", caption, vec![map], &[]).over("");
    Ok(figure.in_columns(1, (120.0 + 40.0 * d.min(18) as f64, 330.0)))
}

/// Figures 10 (decoder error and active coefficients) and 11 (combined loss) of a study; bars are one standard
/// deviation over the seeds to either side.
pub(crate) fn study_figures(summary: &Summary) -> Vec<Figure> {
    let legend = [
        (Role::Recorded, "mean over seeds"),
        (Role::SecondBaseline, "standard deviation"),
    ];
    let figure = |id: &str, caption: &str, panels: Vec<Panel>| {
        let figure = Figure::over_time(id, caption, panels, &legend);
        figure
            .over("latent coordinates")
            .in_columns(2, (360.0, 210.0))
    };
    let panel = |title: &str, bar: fn(&DimensionSummary) -> [f64; 3]| {
        let (mut means, mut bars) = (Vec::new(), Vec::new());
        for row in &summary.dimensions {
            let (x, [low, mean, high]) = (row.latent_dim as f64, bar(row));
            means.push((x, Some(mean)));
            bars.extend([(x, Some(low)), (x, Some(high)), (x, None)]);
        }
        let bars = Series::through(Role::SecondBaseline, bars);
        Panel::lines(title, vec![bars, Series::through(Role::Recorded, means)])
    };
    let decoder = "log10 of decoder mean square, scaled units";
    let over_dimensions = vec![
        panel(decoder, |row| logarithm(row.decoder_mse)),
        panel("active coefficients in contact", |row| range(row.active)),
        panel("x after 0.1 s, mm", |row| millimetres(row.prediction_x_m)),
        panel("z after 0.1 s, mm", |row| millimetres(row.prediction_z_m)),
    ];
    let combined = panel("combined loss", |row| range(row.combined_loss));
    let accuracy = "Accuracy against complexity over the latent dimension (figure 10 of the paper)";
    let loss = format!(
        "Combined loss 2 E_dec + 2 lambda log |Xi| with lambda = {} (figure 11 of the paper)",
        summary.lambda
    );
    vec![
        figure("complexity", accuracy, over_dimensions),
        figure("combined-loss", &loss, vec![combined]),
    ]
}

fn range(Spread { mean, std }: Spread) -> [f64; 3] {
    [mean - std, mean, mean + std]
}

fn millimetres(spread: Spread) -> [f64; 3] {
    range(spread).map(|metres| 1000.0 * metres)
}

/// Logarithms of a bar; one that reaches below zero ends at a tenth of its middle.
fn logarithm(spread: Spread) -> [f64; 3] {
    let [low, mean, high] = range(spread);
    [low.max(0.1 * mean), mean, high].map(f64::log10)
}
