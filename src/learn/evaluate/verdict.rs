//! The uses for which a model is fit: each row compares a metric with a baseline and a threshold.

use super::*;

const NO_BETTER: f64 = 0.98;
/// As a share of that of a constant velocity in x and z together: a coordinate alone may hardly accelerate.
const SHORT_SHARE: f64 = 0.25;
const WHOLE_SHARE: f64 = 1.0 / 3.0;
const STILL_M: f64 = 1e-4; // error of a constant velocity in body x and z below which recordings hardly move it
const TORQUE_R2: f64 = 0.5;
const UNPLANNED_SHARE: f64 = 0.5;
const LEAST_RANK: usize = 2; // latent directions in which inputs act on the ground: forwards and upwards
/// Of pitch and legs decoded from the encoded state: below it, the latent state does not represent them.
const REPRESENTED_R2: f64 = 0.9;
const WHOLE: &str = "whole motion";
const STRIDE: &str = "a stride";
const TORQUES: &str = "torques";
const CONTROL: &str = "control";
const TORQUES_IN_CONTACT: &str = "R^2 of torques in contact";
const AFTER_A_PUSH: &str = "deviation after a push";
const ONE_STAGE: &str = "error one stage ahead, share of the baseline's";
const CONSTANT_VELOCITY: &str = "constant velocity";
const CONSTANT_LATENT_VELOCITY: &str = "constant latent velocity";
const NO_DYNAMICS: &str = "no dynamics";

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Bound {
    #[serde(rename = "at most")]
    AtMost,
    #[serde(rename = "at least")]
    AtLeast,
}

impl Bound {
    pub fn words(self) -> &'static str {
        match self {
            Self::AtMost => "at most",
            Self::AtLeast => "at least",
        }
    }

    /// Whether a value is better than another one.
    fn prefers(self, value: f64, other: f64) -> bool {
        match self {
            Self::AtMost => value < other,
            Self::AtLeast => value > other,
        }
    }
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VerdictRow {
    pub name: String,
    #[serde(rename = "use")]
    pub of: String,
    pub unit: &'static str,
    /// Of the recording on which it is worst; infinite for a rollout that diverges, none if not measured.
    pub value: Option<f64>,
    pub baseline: Option<f64>,
    pub baseline_name: &'static str,
    /// Of all baselines with this metric, also of those that the threshold does not depend on.
    pub best_baseline: Option<f64>,
    pub best_baseline_name: &'static str,
    pub threshold: f64,
    pub bound: Bound,
    pub passed: Option<bool>,
    pub counts: bool,
}

impl VerdictRow {
    fn new(
        (of, name, unit): (&str, &str, &'static str),
        value: Option<f64>,
        (baseline_name, baseline): (&'static str, Option<f64>),
        (bound, threshold): (Bound, f64),
    ) -> Self {
        let passes = |value: f64| match bound {
            Bound::AtMost => value <= threshold,
            Bound::AtLeast => value >= threshold,
        };
        Self {
            name: name.to_owned(),
            of: of.to_owned(),
            unit,
            value,
            baseline,
            baseline_name,
            best_baseline: baseline,
            best_baseline_name: baseline_name,
            threshold,
            bound,
            passed: value.map(passes),
            counts: true,
        }
    }

    /// Other baselines of this metric, by name.
    fn with_baselines(
        mut self,
        others: impl IntoIterator<Item = (&'static str, Option<f64>)>,
    ) -> Self {
        for (name, other) in others {
            let is_better = |best| other.is_some_and(|other| self.bound.prefers(other, best));
            if self.best_baseline.map_or(other.is_some(), is_better) {
                (self.best_baseline, self.best_baseline_name) = (other, name);
            }
        }
        self
    }

    /// Whether a baseline is better than the model.
    pub fn is_beaten(&self) -> bool {
        let pair = self.value.zip(self.best_baseline);
        self.counts && pair.is_some_and(|(value, best)| self.bound.prefers(best, value))
    }

    pub(crate) fn is_failed(&self) -> bool {
        self.counts && self.passed == Some(false)
    }

    /// By how much the value passes, as a share of the threshold; infinite without one.
    fn margin(&self) -> f64 {
        let excess = self.value.map(|value| value - self.threshold);
        let margin = excess.map_or(f64::INFINITY, |excess| match self.bound {
            Bound::AtMost => -excess,
            Bound::AtLeast => excess,
        });
        match margin.is_nan() {
            true => f64::NEG_INFINITY,
            false => margin / self.threshold.abs().max(f64::MIN_POSITIVE),
        }
    }

    /// Value and unit, `diverges` or `not measured`.
    pub fn value_words(&self) -> String {
        let shown = |value| with_unit(value, self.unit);
        self.value.map_or("not measured".to_owned(), shown)
    }

    /// The best baseline, if it is better than the model.
    pub fn better_baseline(&self) -> Option<String> {
        self.best_baseline_words().filter(|_| self.is_beaten())
    }

    /// `ASLIP (fitted constants): 0.7 mm`.
    pub fn best_baseline_words(&self) -> Option<String> {
        let best = with_unit(self.best_baseline?, self.unit);
        Some(format!("{}: {best}", self.best_baseline_name))
    }

    /// `deviation after a push 12.3 mm, at most 11.9 mm (no feedback: 12.1 mm)`.
    pub fn words(&self) -> String {
        let shown = |value| with_unit(value, self.unit);
        let value = self.value_words();
        let against = |baseline| format!(" ({}: {})", self.baseline_name, shown(baseline));
        let baseline = self.baseline.map(against).unwrap_or_default();
        let (name, bound, threshold) = (&self.name, self.bound.words(), shown(self.threshold));
        format!("{name} {value}, {bound} {threshold}{baseline}")
    }
}

/// A value of a metric for reading, metres in mm below 1 m; `diverges` for one that is not finite.
pub fn with_unit(value: f64, unit: &str) -> String {
    match unit {
        _ if !value.is_finite() => "diverges".to_owned(),
        "m" if value.abs() < 1.0 => format!("{:.1} mm", 1e3 * value),
        "m" => format!("{value:.1} m"),
        "" if value.fract() == 0.0 => format!("{value}"),
        unit => format!("{value:.3} {unit}").trim_end().to_owned(),
    }
}

/// Uses are `0.1 s` (predictions between restarts, by their time), `whole motion` (for walks `a stride`), `torques`
/// (computed by the controller without recorded inputs) and `control`. A use that is not measured is in neither list.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Verdict {
    pub fit_for: Vec<String>,
    pub failed: Vec<String>,
    pub rows: Vec<VerdictRow>,
}

impl Verdict {
    pub fn fails_predictions(&self) -> bool {
        (self.failed.iter()).any(|of| ![TORQUES, CONTROL].contains(&of.as_str()))
    }

    /// Every use with its worst counted row: failed ones first, then those with a baseline, then by margin; none where it
    /// was not measured.
    pub fn by_use(&self) -> Vec<(&str, Option<&VerdictRow>)> {
        let mut uses: Vec<&str> = self.rows.iter().map(|row| &*row.of).collect();
        uses.retain(|of| ![TORQUES, CONTROL].contains(of));
        uses.dedup();
        let worst = |of: &str| {
            let rows = self.rows.iter().filter(|row| row.of == of && row.counts);
            let measured = rows.filter(|row| row.passed.is_some());
            let order = |row: &VerdictRow| (row.passed, row.baseline.is_none());
            measured
                .min_by(|a, b| (order(a).cmp(&order(b))).then(a.margin().total_cmp(&b.margin())))
        };
        let uses = uses.into_iter().chain([TORQUES, CONTROL]);
        uses.map(|of| (of, worst(of))).collect()
    }

    pub fn fails_control(&self) -> bool {
        (self.failed.iter()).any(|of| [TORQUES, CONTROL].contains(&of.as_str()))
    }
}

/// Without the controller's figures along each recording, torques and control are not judged.
pub fn verdict(
    model: &ReducedModel,
    assessment: &Assessment<'_>,
    control: &[&ControlMetrics],
) -> Verdict {
    let short = format!("{} s", assessment.restart_every_s);
    let mut rows = prediction_rows(assessment, &short);
    let mut of_control = worst_of(control);
    if !control.is_empty() {
        of_control.extend(rank_row(model, assessment));
    }
    let fails_soon = (rows.iter()).any(|row| row.of == short && row.is_failed());
    without_predictions(&mut of_control, fails_soon);
    rows.extend(of_control);
    let mut verdict = Verdict::default();
    for of in [&short, WHOLE, STRIDE, TORQUES, CONTROL] {
        let mut counted = rows.iter().filter(|row| row.of == of && row.counts);
        if counted.clone().any(VerdictRow::is_failed) {
            verdict.failed.push(of.to_owned());
        } else if counted.any(|row| row.passed == Some(true)) {
            verdict.fit_for.push(of.to_owned());
        }
    }
    Verdict { rows, ..verdict }
}

/// The verdict with a controller of [`usual_settings`], and why this one was not measured, if so.
/// `progress(done, total)` is called after each recording.
pub fn verdict_by_default(
    model: &ReducedModel,
    recordings: &[Recording],
    assessment: &Assessment<'_>,
    mut progress: impl FnMut(usize, usize),
) -> (Verdict, Option<EvaluateError>) {
    let settings = usual_settings(model, recordings);
    let measured = recordings.iter().zip(1..).map(|(recording, done)| {
        let metrics = control_metrics(model, recording, settings);
        progress(done, recordings.len());
        metrics
    });
    match measured.collect::<Result<Vec<_>, _>>() {
        Ok(control) => {
            let control: Vec<&ControlMetrics> = control.iter().collect();
            (verdict(model, assessment, &control), None)
        }
        Err(error) => (verdict(model, assessment, &[]), Some(error)),
    }
}

fn prediction_rows(assessment: &Assessment<'_>, short: &str) -> Vec<VerdictRow> {
    let [whole, restarted] = &assessment.constant_velocity;
    let [latent_whole, latent_restarted] = &assessment.constant_latent_velocity;
    let soon = (NO_BETTER, SHORT_SHARE);
    let long = match &assessment.over_stride {
        // Without feedback the least deviation decides after a few strides where a walk is.
        Some([own, constant, in_latent]) => ((STRIDE, own, [constant, in_latent]), soon),
        None => (
            (WHOLE, &assessment.full, [whole, latent_whole]),
            (WHOLE_SHARE, f64::INFINITY),
        ),
    };
    let constant = [restarted, latent_restarted];
    let horizons = [((short, &assessment.restarted, constant), soon), long];
    let mut rows = Vec::new();
    for ((of, own, [constant, in_latent]), (of_own, of_both)) in horizons {
        let rms = |sums: &CoordinateSums, names: &[&str]| joint_rms(assessment, sums, names);
        let [x, z] = ["body.x", "body.z"].map(|name| rms(constant, &[name]).unwrap_or(0.0));
        let row = |name: &str, names: &[&str], unit, limit: &dyn Fn(f64) -> f64| {
            let (value, baseline) = (rms(own, names)?, rms(constant, names)?);
            let (name_of, baseline) = match rms(in_latent, names) {
                Some(less) if less < baseline => (CONSTANT_LATENT_VELOCITY, less),
                _ => (CONSTANT_VELOCITY, baseline),
            };
            let value = match own.diverged {
                0 => Some(value).filter(|_| x.hypot(z) > STILL_M),
                _ => Some(f64::INFINITY),
            };
            let the = if of == WHOLE { "the " } else { "" };
            let name = format!("error of {name} over {the}{of}");
            let against = (name_of, Some(baseline));
            let bound = (Bound::AtMost, limit(baseline));
            Some(VerdictRow::new((of, &name, unit), value, against, bound))
        };
        let templates = |axis: usize| {
            assessment.baselines.iter().filter_map(move |template| {
                let sums = match of {
                    STRIDE => return None,
                    WHOLE => &template.full,
                    _ => &template.restarted,
                };
                Some((template.name, sums.rms()[axis]))
            })
        };
        let limit = |baseline: f64| (of_own * baseline).min(of_both * x.hypot(z));
        let body = ["body.x", "body.z"].into_iter().zip(0..);
        rows.extend(body.filter_map(|(name, axis)| {
            Some(row(name, &[name], "m", &limit)?.with_baselines(templates(axis)))
        }));
        if of != short {
            continue; // in open loop, small differences at take-off determine where pitch and legs end
        }
        let in_plane = |name: &&str| name.ends_with(".hy") || name.ends_with(".kn");
        let names = Robot::state_names();
        let joints = names[..JOINT_DIM].iter().map(String::as_str);
        let legs: Vec<&str> = joints.filter(in_plane).collect();
        for (name, names) in [("body.pitch", &["body.pitch"][..]), ("the legs", &legs)] {
            rows.extend(
                row(name, names, "rad", &|baseline| baseline).map(|row| VerdictRow {
                    counts: are_represented(assessment, names),
                    ..row
                }),
            );
        }
    }
    rows
}

/// Whether the latent state represents these coordinates.
fn are_represented(assessment: &Assessment<'_>, names: &[&str]) -> bool {
    let r2 = |name: &&str| assessment.fit(&assessment.decoded, name)?.r2;
    names
        .iter()
        .all(|name| r2(name).is_some_and(|r2| r2 >= REPRESENTED_R2))
}

fn joint_rms(assessment: &Assessment<'_>, sums: &CoordinateSums, names: &[&str]) -> Option<f64> {
    let squares = (names.iter()).map(|name| Some(assessment.fit(sums, name)?.rms.powi(2)));
    let total: f64 = squares.collect::<Option<Vec<_>>>()?.iter().sum();
    Some((total / names.len() as f64).sqrt())
}

fn worst_of(control: &[&ControlMetrics]) -> Vec<VerdictRow> {
    let mut worst: Vec<VerdictRow> = Vec::new();
    for rows in control.iter().map(|metrics| control_rows(metrics)) {
        match worst.is_empty() {
            true => worst.extend(rows),
            false => (worst.iter_mut().zip(rows))
                .filter(|(worst, row)| row.margin() < worst.margin())
                .for_each(|(worst, row)| *worst = row),
        }
    }
    worst
}

/// If predictions fail, a passed test of the control is not due to the dynamics: it counts as not measured.
fn without_predictions(rows: &mut [VerdictRow], fails_soon: bool) {
    let mut one_stage = rows.iter().filter(|row| row.name == ONE_STAGE);
    if fails_soon || one_stage.any(VerdictRow::is_failed) {
        let others = rows.iter_mut().filter(|row| row.of == CONTROL);
        for row in others.filter(|row| row.passed == Some(true)) {
            (row.value, row.passed) = (None, None);
        }
    }
}

fn control_rows(metrics: &ControlMetrics) -> [VerdictRow; 5] {
    let baseline = &metrics.baseline;
    let blind = &baseline.no_dynamics;
    let torque = |name, own, other: Option<f64>| {
        let least = other.map_or(TORQUE_R2, |other| other.max(TORQUE_R2));
        let (row, against) = ((TORQUES, name, ""), (NO_DYNAMICS, other));
        VerdictRow::new(row, own, against, (Bound::AtLeast, least))
    };
    let (own, other) = (metrics.torque_r2, blind.torque_r2);
    let contact = torque(TORQUES_IN_CONTACT, own.contact, other.contact);
    let mut flight = torque("R^2 of torques in flight", own.flight, other.flight);
    let stage = |name, other: &Option<_>| {
        let share = (metrics.prediction_rms.as_ref())
            .zip(other.as_ref())
            .map(|(own, other)| own.share_of(other));
        let row = (CONTROL, ONE_STAGE, "");
        VerdictRow::new(row, share, (name, Some(1.0)), (Bound::AtMost, NO_BETTER))
    };
    let constant = &baseline.constant_velocity.prediction_rms;
    let constant = stage(CONSTANT_VELOCITY, constant);
    let uninformed = stage(NO_DYNAMICS, &blind.prediction_rms);
    let stage = match uninformed.margin() < constant.margin() {
        true => uninformed,
        false => constant,
    };
    let off = baseline.feedback_off.recovery_rms_m;
    let push = VerdictRow::new(
        (CONTROL, AFTER_A_PUSH, "m"),
        metrics.recovery_rms_m.filter(|_| off.is_some()),
        ("no feedback", off),
        (Bound::AtMost, NO_BETTER * off.unwrap_or(0.0)),
    )
    .with_baselines([
        (NO_DYNAMICS, blind.recovery_rms_m),
        ("replay", baseline.replay.recovery_rms_m),
    ]);
    let unplanned = VerdictRow::new(
        (CONTROL, "share of steps without a plan", ""),
        Some(metrics.unplanned_share),
        ("", None),
        (Bound::AtMost, UNPLANNED_SHARE),
    );
    flight.counts = false;
    [contact, flight, stage, push, unplanned]
}

pub(super) fn failure(metrics: &ControlMetrics) -> Option<String> {
    let rows = control_rows(metrics);
    let failed = rows.iter().filter(|row| row.is_failed());
    let words: Vec<String> = failed.map(VerdictRow::words).collect();
    (!words.is_empty()).then(|| words.join("; "))
}

fn rank_row(model: &ReducedModel, assessment: &Assessment<'_>) -> Option<VerdictRow> {
    let phases = model.phases().iter().zip(&assessment.linearised);
    let on_ground = phases.filter(|(phase, _)| !phase.feet.matches([false; 4]));
    let ranks = on_ground.filter_map(|(_, linear)| linear.as_ref());
    let least = ranks.map(LinearisedPhase::input_effective_rank).min()?;
    let name = "latent directions in which inputs act on the ground";
    let (row, against) = ((CONTROL, name, ""), ("", None));
    let bound = (Bound::AtLeast, LEAST_RANK.min(model.latent_dim()) as f64);
    Some(VerdictRow::new(row, Some(least as f64), against, bound))
}
