//! The figures of a report, from an assessment and the controller's runs.

use std::path::PathBuf;

use super::complexity::study_figures;
use super::control::{latent_inputs, torques};
use super::figures::{Drawing, Figure, Film, HeatMap, Panel, subscript};
use super::jump::{Jump, JumpName};
use super::tables::NamedRun;
use crate::evaluate::{Assessment, SegmentRun, Verdict};
use crate::model::{ModelError, ReducedModel};
use crate::mpc::Lift;
use crate::recording::Segment;
use crate::study::Summary;

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
    /// The plan that the first jump follows, if there is one.
    pub plan: Option<&'a Segment>,
    /// Digests of the recordings' files, by path, as a model's provenance has them.
    pub digests: &'a [(PathBuf, String)],
}

#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct AllFigures {
    pub encoder: Vec<Figure>,
    pub jumps: Vec<JumpFigures>,
    pub study: Vec<Figure>,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct JumpFigures {
    pub title: String,
    /// Root mean square errors of body x and z over the whole jump, in m.
    pub body_rms_m: [Option<f64>; 2],
    /// The robot recorded and predicted, as a strip for paper and animated.
    pub motion: Option<(Figure, Film)>,
    pub body: Figure,
    /// Figures to fold away, each with a title: accelerations, template models, joints, and the controller's run if this
    /// is the first jump of a recording.
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
    for (index, jump) in jumps(content)?.into_iter().take(MAX_JUMPS).enumerate() {
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
    if let Some(summary) = content.study {
        figures.study = study_figures(summary);
    }
    Ok(figures)
}

pub(super) fn jumps<'a>(content: &Content<'a>) -> Result<Vec<Jump<'a>>, ModelError> {
    let (model, assessment) = (content.model, content.assessment);
    let jump = |(index, run): (usize, &'a SegmentRun<'a>)| {
        let path = &run.segment.path;
        let mut place = JumpName::of_recording(index, path);
        let same = assessment.runs.iter().map(|run| &run.segment.path);
        if same.filter(|other| *other == path).count() > 1 {
            place.words += &format!(", from row {}", run.segment.first_row);
        }
        Jump::new(model, assessment, run, place)
    };
    assessment.runs.iter().enumerate().map(jump).collect()
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
    let rows = assessment.names.len();
    let d = model.latent_dim();
    let at = |row: usize, column: usize| weights[(column, row)] / factors[row];
    let values = (0..rows * d).map(|k| at(k / d, k % d)).collect();
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
            values,
        }),
    };
    let figure = Figure::over_time("encoder", caption, vec![map], &[]).over("");
    Ok(figure.in_columns(1, (120.0 + 40.0 * d.min(18) as f64, 330.0)))
}
