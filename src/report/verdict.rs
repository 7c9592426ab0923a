//! The verdict on the first screen: a row for each use, and every row as a table.

use super::*;

/// A result that a shape, a sign and words show, so that it needs no colour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Light {
    Passed,
    Failed,
    Partly,
    Open,
}

impl Light {
    fn of(row: &VerdictRow) -> Self {
        row.passed.map_or(Self::Open, |passed| match passed {
            true => Self::Passed,
            false => Self::Failed,
        })
    }

    /// Class in the page, sign, words.
    pub(super) fn parts(self) -> [&'static str; 3] {
        match self {
            Self::Passed => ["passed", "✓", "passed"],
            Self::Failed => ["failed", "✗", "failed"],
            Self::Partly => ["partly", "!", "partly"],
            Self::Open => ["open", "–", "not measured"],
        }
    }
}

/// A use, with the words of its worst row; of a use without a measured row, dashes.
pub(super) struct UseRow {
    pub title: String,
    pub metric: String,
    pub meaning: &'static str,
    pub value: String,
    pub needed: String,
    pub baseline: String,
    pub baseline_name: &'static str,
    pub baseline_meaning: &'static str,
    pub light: Light,
}

pub(super) fn use_rows(verdict: &Verdict) -> Vec<UseRow> {
    let rows = verdict.by_use().into_iter();
    rows.map(|(of, row)| UseRow::new(of, row)).collect()
}

impl UseRow {
    fn new(of: &str, row: Option<&VerdictRow>) -> Self {
        let title = match of {
            "torques" => "Torques".to_owned(),
            "control" => "Control".to_owned(),
            "whole motion" => "Prediction, whole motion".to_owned(),
            short => format!("Prediction over {short}"),
        };
        let shown = |value: Option<f64>| match (value, row) {
            (Some(value), Some(row)) => with_unit(value, row.unit),
            _ => "-".to_owned(),
        };
        let (metric, baseline_name) =
            row.map_or(("", ""), |row| (&row.name, row.best_baseline_name));
        Self {
            title,
            metric: metric.to_owned(),
            meaning: meaning(&METRICS, metric),
            value: shown(row.and_then(|row| row.value)),
            needed: row.map_or("-".to_owned(), |row| {
                format!("{} {}", row.bound.words(), shown(Some(row.threshold)))
            }),
            baseline: shown(row.and_then(|row| row.best_baseline)),
            baseline_name,
            baseline_meaning: meaning(&BASELINES, baseline_name),
            light: row.map_or(Light::Open, Light::of),
        }
    }
}

/// Starts of the metrics' names, and a line about each.
const METRICS: [&str; 6] = [
    "error of: root mean square; predicted with the recorded torques",
    "R^2 of torques: of torques found without the recorded ones; 1 is perfect",
    "error one stage ahead: over one stage of the controller's horizon",
    "deviation after a push: of the body, over 0.2 s after a push of 0.1 m/s",
    "share of steps without a plan: control steps that the solver did not solve",
    "latent directions: rank of the map from inputs to accelerations",
];

const BASELINES: [&str; 7] = [
    "constant velocity: the body keeps its velocity",
    "constant latent velocity: latent coordinates keep their velocity",
    "no dynamics: the same controller; inputs alone accelerate",
    "no feedback: the same controller without measurements after the push",
    "replay: the recorded torques, without a controller",
    "ASLIP: a spring-loaded pendulum with the recorded forces",
    "point mass: a body with the recorded forces",
];

/// The words about a metric or baseline.
fn meaning(known: &[&'static str], name: &str) -> &'static str {
    let mut known = known.iter().filter_map(|line| line.split_once(": "));
    let found = known.find(|(start, _)| name.starts_with(start));
    found.map_or("", |(_, words)| words)
}

/// The result of all uses: a light, and how many of the measured ones pass.
pub(super) fn total(verdict: &Verdict) -> (Light, String) {
    let (fit, failed) = (verdict.fit_for.len(), verdict.failed.len());
    let light = match (fit, failed) {
        (0, 0) => Light::Open,
        (_, 0) => Light::Passed,
        (0, _) => Light::Failed,
        _ => Light::Partly,
    };
    (light, format!("{fit} of {} passed", fit + failed))
}

pub(super) fn verdict_table(verdict: &Verdict) -> Table {
    let shown = |row: &VerdictRow, value| with_unit(value, row.unit);
    Table::of(&verdict.rows)
        .column("for", "", |row| &row.of)
        .column("metric", "", |row| &row.name)
        .column("model", "", |row| row.value_words())
        .column("needed", "", |row| {
            format!("{} {}", row.bound.words(), shown(row, row.threshold))
        })
        .column("baseline of the threshold", "", |row| {
            let baseline = row.baseline.map(|value| shown(row, value));
            baseline.map(|baseline| format!("{baseline}, {}", row.baseline_name))
        })
        .column("best baseline", "", |row| row.best_baseline_words())
        .column("result", "", |row| {
            let [_, _, result] = Light::of(row).parts();
            match row.counts {
                true => result.to_owned(),
                false => format!("{result}, does not count"),
            }
        })
        .table()
}
