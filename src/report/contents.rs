//! The figures of a report: from an assessment, from the controller's runs, from a study.

use super::*;
use crate::mpc::{Lift, MpcSettings, settings_for};
use crate::study::{DimensionSummary, Spread, Summary};

const MAX_JUMPS: usize = 3;

#[derive(Debug, Clone, Copy)]
pub(crate) struct Content<'a> {
    pub model: &'a ReducedModel,
    pub assessment: &'a Assessment<'a>,
    pub verdict: &'a Verdict,
    /// The controller along each recording with the transpose lift; empty if it did not run.
    pub plain: &'a [NamedRun],
    pub consistent: &'a [NamedRun],
    /// Those with the model's usual lift, by which it is judged.
    pub usual: &'a [NamedRun],
    pub study: Option<&'a Summary>,
    pub plan: Option<&'a Segment>,
    /// Digests of the recordings' files, by path, as a model's provenance has them.
    pub digests: &'a [(PathBuf, String)],
}

#[derive(Default)]
pub(crate) struct AllFigures {
    /// Body position over the first motion.
    pub overview: Option<Figure>,
    pub encoder: Vec<Figure>,
    pub jumps: Vec<JumpFigures>,
    pub study: Vec<Figure>,
}

pub(crate) struct JumpFigures {
    pub title: String,
    /// Root mean square errors in body x and z over the whole motion.
    pub body_rms: [String; 2],
    pub motion: Option<(Figure, Film)>,
    pub body: Figure,
    /// Figures to fold away, each with a title.
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
        let first = self.overview.iter().chain(&self.encoder);
        first.chain(jumps).chain(&self.study)
    }
}

pub(crate) fn all_figures(content: &Content<'_>) -> Result<AllFigures> {
    let mut figures = AllFigures::default();
    let (model, assessment) = (content.model, content.assessment);
    if let Some(run) = assessment.runs.first() {
        figures.encoder.push(encoder(model, assessment, run)?);
    }
    for (index, jump) in Jump::all(content)?.into_iter().take(MAX_JUMPS).enumerate() {
        if index == 0 {
            figures.overview = Some(jump.overview());
        }
        let [joints, body] = jump.coordinates();
        let mut folded = vec![
            ("Latent accelerations", jump.accelerations()?),
            ("Body position with baselines", jump.baselines()),
            ("Joint angles", joints),
        ];
        let path = &jump.run.segment.path;
        let is_first = (assessment.runs[..index].iter()).all(|run| run.segment.path != *path);
        let run = content.usual.iter().find(|(of, _)| of == path);
        if let Some((_, run)) = run.filter(|_| is_first) {
            let torques = torques(model, settings_for(model).lift, run, &jump.place);
            let inputs = latent_inputs(model, run, &jump.place);
            folded.extend([
                ("Joint torques of the controller", torques),
                ("Latent inputs of the controller", inputs),
            ]);
        }
        let plan = content.plan.filter(|_| index == 0);
        figures.jumps.push(JumpFigures {
            title: jump.place.words.clone(),
            body_rms: jump.body_rms(),
            motion: jump.motion(plan),
            body,
            folded,
        });
    }
    figures.study = content.study.map(study_figures).unwrap_or_default();
    Ok(figures)
}

fn encoder(
    model: &ReducedModel,
    assessment: &Assessment<'_>,
    run: &SegmentRun<'_>,
) -> Result<Figure> {
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
    let caption = format!("{what}, by coordinate and latent coordinate (scaled units).");
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

/// Figures 10 and 11 of the paper; bars are one standard deviation over the seeds to either side.
pub(crate) fn study_figures(summary: &Summary) -> Vec<Figure> {
    let legend = [
        (Role::Recorded, "mean over seeds"),
        (Role::SecondBaseline, "standard deviation"),
    ];
    let figure = |id: &str, caption: &str, panels: Vec<Panel>| {
        let figure = Figure::over_time(id, caption, panels, &legend);
        (figure.over("latent coordinates")).in_columns(2, (360.0, 210.0))
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
        panel("error of body x over 0.1 s, mm", |row| {
            millimetres(row.prediction_x_m)
        }),
        panel("error of body z over 0.1 s, mm", |row| {
            millimetres(row.prediction_z_m)
        }),
    ];
    let combined = panel("combined loss", |row| range(row.combined_loss));
    let accuracy = "Accuracy against complexity over the latent dimension (figure 10 of the paper)";
    let (loss, lambda) = ("Combined loss 2 E_dec + 2 lambda ln |Xi|", summary.lambda);
    let loss = format!("{loss} with lambda = {lambda} (figure 11 of the paper)");
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

fn logarithm(spread: Spread) -> [f64; 3] {
    let [low, mean, high] = range(spread);
    [low.max(0.1 * mean), mean, high].map(f64::log10)
}

pub(crate) fn control_figures(
    model: &ReducedModel,
    settings: &MpcSettings,
    runs: &[NamedRun],
) -> Vec<Figure> {
    let figures = runs.iter().enumerate().flat_map(|(index, (path, run))| {
        let place = JumpName::of_recording(index, path);
        [
            torques(model, settings.lift, run, &place),
            latent_inputs(model, run, &place),
            latent_tracking(model, settings, run, &place),
            solve_times(settings, run, &place),
        ]
    });
    figures.collect()
}

pub(crate) fn without_statistics(model: &ReducedModel) -> Option<&str> {
    let mut phases = model.phases().iter().enumerate();
    let without = phases.find(|&(index, _)| model.input_statistics(index).is_err());
    without.map(|(_, phase)| phase.name.as_str())
}

fn line(run: &Run, role: Role, value: impl Fn(&StepRow) -> Option<f64>) -> Series {
    let points = run.rows.iter().map(|row| (row.time_s, value(row)));
    Series::through(role, points)
}

pub(super) fn torques(model: &ReducedModel, lift: Lift, run: &Run, place: &JumpName) -> Figure {
    let limits = model.robot().ok().map(Robot::torque_limit_nm);
    let panel = |joint: usize| {
        let limit = |sign: f64| limits.map(|limits| sign * limits[joint]);
        let recorded = |row: &StepRow| Some(row.recorded_torque_nm[joint]);
        let lines = vec![
            line(run, Role::Recorded, recorded),
            line(run, Role::Full, |row| Some(row.command.torque_nm[joint])),
            line(run, Role::Limit, |_| limit(1.0)),
            line(run, Role::Limit, |_| limit(-1.0)),
        ];
        Panel::lines(format!("{}, N m", Robot::state_names()[joint]), lines)
    };
    let lift = match lift {
        Lift::Transpose => "transpose",
        Lift::Consistent => "consistent",
    };
    let caption = format!(
        "Joint torques along {}: recorded, and commanded by the controller ({lift} lift); limits of the robot.",
        place.words
    );
    let legend = [
        (Role::Recorded, "recorded"),
        (Role::Full, "commanded"),
        (Role::Limit, "limits"),
    ];
    let panels = (0..JOINT_DIM).map(panel).collect();
    Figure::over_time(place.id("torques"), caption, panels, &legend)
}

pub(super) fn latent_inputs(model: &ReducedModel, run: &Run, place: &JumpName) -> Figure {
    let panel = |latent: usize| {
        let chosen = |row: &StepRow| row.command.u_lat.get(latent).copied();
        let title = format!("u{}", latent + 1);
        Panel::lines(title, vec![line(run, Role::Full, chosen)])
    };
    let words = &place.words;
    let caption = format!("Latent inputs of the controller along {words} (scaled units).");
    let panels = (0..model.latent_dim()).map(panel).collect();
    let legend = [(Role::Full, "commanded")];
    Figure::over_time(place.id("latent_inputs"), caption, panels, &legend)
}

fn latent_tracking(
    model: &ReducedModel,
    settings: &MpcSettings,
    run: &Run,
    place: &JumpName,
) -> Figure {
    let horizon_s = settings.horizon as f64 * settings.step_s;
    let panel = |latent: usize| {
        let planned = run.rows.iter().map(|row| {
            let end = row.z_planned.as_ref().map(|z| z[latent]);
            (row.time_s + horizon_s, end)
        });
        let planned = Series::through(Role::Full, planned);
        let reference = line(run, Role::Recorded, |row| Some(row.z_reference[latent]));
        Panel::lines(format!("z{}", latent + 1), vec![reference, planned])
    };
    let caption = format!(
        "Latent positions along {} (scaled units): the reference, and the end of each plan, {horizon_s} s after its step.",
        place.words
    );
    let panels = (0..model.latent_dim()).map(panel).collect();
    let legend = [
        (Role::Recorded, "reference"),
        (Role::Full, "end of the plan"),
    ];
    Figure::over_time(place.id("latent_tracking"), caption, panels, &legend)
}

fn solve_times(settings: &MpcSettings, run: &Run, place: &JumpName) -> Figure {
    let line = |value: fn(&StepRow) -> f64| line(run, Role::Recorded, |row| Some(value(row)));
    let milliseconds = line(|row| 1e-3 * row.command.solve_us);
    let iterations = line(|row| f64::from(row.command.iterations));
    let panels = vec![
        Panel::lines("time of a step, ms", vec![milliseconds]),
        Panel::lines("iterations", vec![iterations]),
    ];
    let caption = format!(
        "Steps along {}: wall time from measurement to command, {} stages of {} s each, and \
         interior-point iterations.",
        place.words, settings.horizon, settings.step_s
    );
    let legend = [(Role::Recorded, "one step")];
    let figure = Figure::over_time(place.id("solve_times"), caption, panels, &legend);
    figure.in_columns(2, (360.0, 170.0))
}
