//! The first sentences of a report: uses the model is fit for, whether its training used the recordings, errors.

use std::collections::BTreeSet;

use super::*;
use crate::mpc::{Lift, settings_for};

pub(crate) struct Introduction {
    pub headline: String,
    /// Passed metrics in which a baseline is better.
    pub beaten: Option<String>,
    pub compared: String,
    /// Why the model fails, where that is known.
    pub cause: Option<String>,
    pub subject: String,
    pub errors: String,
    pub template: Option<String>,
    pub commands: Option<String>,
    pub recordings: Table,
}

impl Introduction {
    /// All but the headline.
    pub(crate) fn sentences(&self) -> Vec<&str> {
        let always = [&self.subject, &self.compared, &self.errors].into_iter();
        let others = [&self.template, &self.commands, &self.cause];
        let all = always.chain(others.into_iter().flatten());
        all.map(String::as_str).collect()
    }
}

pub(crate) fn introduction(content: &Content<'_>) -> Result<Introduction> {
    Ok(Introduction {
        headline: headline(content.verdict, !content.assessment.remarks.is_empty()),
        beaten: beaten(content.verdict),
        compared: compared(content),
        cause: cause(content),
        subject: subject(content)?,
        errors: errors(content.assessment),
        template: beside_template(content.assessment),
        commands: commands(content),
        recordings: recordings(content)?,
    })
}

pub(crate) fn headline(verdict: &Verdict, is_doubtful: bool) -> String {
    let words = |of: &String| match of.as_str() {
        "whole motion" => "predictions of the whole motion".to_owned(),
        "torques" | "control" => of.clone(),
        short => format!("predictions over {short}"),
    };
    let [fit, failed] = [&verdict.fit_for, &verdict.failed]
        .map(|uses| listed(&uses.iter().map(words).collect::<Vec<_>>()));
    let judged = match (fit.as_str(), failed.as_str()) {
        ("", "") => "Not judged: no metric could be measured along these recordings.".to_owned(),
        (fit, "") => format!("Fit for {fit}."),
        ("", failed) => format!("Not fit for {failed}."),
        (fit, failed) => format!("Fit for {fit}; not fit for {failed}."),
    };
    match is_doubtful {
        true => format!("Do not rely on it here, see the notes. {judged}"),
        false => judged,
    }
}

fn beaten(verdict: &Verdict) -> Option<String> {
    let passed = verdict.rows.iter().filter(|row| row.passed == Some(true));
    let words = passed.filter_map(|row| {
        let (value, better) = (row.value_words(), row.better_baseline()?);
        Some(format!("{} ({value}; {better})", row.name))
    });
    let words: Vec<String> = words.collect();
    (!words.is_empty()).then(|| format!("A baseline is better in: {}.", listed(&words)))
}

fn cause(content: &Content<'_>) -> Option<String> {
    let failed = &content.verdict.failed;
    let lift_r2 = content.assessment.lift.torque.r2().contact;
    let is_plain = settings_for(content.model).lift == Lift::Transpose;
    if let Some(r2) = lift_r2
        .filter(|_| is_plain)
        .filter(|r2| *r2 < 0.5 && failed.iter().any(|of| of == "torques"))
    {
        return Some(format!(
            "Torques fail because encoder and decoder lose them: R^2 of recorded torques, projected and lifted, is {r2:.2}."
        ));
    }
    let mut paths = content.assessment.runs.iter().map(|run| &run.segment.path);
    let are_known = paths.all(|path| seen(content, path) == Some(true));
    (are_known && !failed.is_empty()).then(|| {
        "The model is at fault, not the recordings: it was trained on these files.".to_owned()
    })
}

fn subject(content: &Content<'_>) -> Result<String> {
    let (model, assessment) = (content.model, content.assessment);
    let robot = model.robot().map_or("a robot", |robot| robot.name);
    let phases: Vec<&str> = model.phases().iter().map(|p| p.name.as_str()).collect();
    let first = assessment.runs.first();
    let modelled = first.map(|run| modelled(model, run)).transpose()?;
    let names = assessment.names.iter().zip(modelled.into_iter().flatten());
    let absent = names.filter(|(_, is_modelled)| !is_modelled);
    let absent: Vec<String> = absent.map(|(name, _)| name.clone()).collect();
    let are = if absent.len() == 1 { "is" } else { "are" };
    let absent = match listed(&absent).as_str() {
        "" => String::new(),
        names => format!(
            " {names} {are} not modelled: no latent coordinate contains them, so their errors do not depend on the dynamics."
        ),
    };
    Ok(format!(
        "The model reduces the {} coordinates of {robot} to {} latent coordinates, with {} active terms in {} ({}).{absent}",
        assessment.names.len(),
        model.latent_dim(),
        assessment.active_terms,
        counted(phases.len(), "phase"),
        phases.join(", ")
    ))
}

fn seen(content: &Content<'_>, path: &Path) -> Option<bool> {
    let recordings = content.model.provenance().get("recordings");
    let entries = recordings.and_then(Value::as_array)?.iter();
    let trained = entries.filter(|entry| entry.get("sets") != Some(&json!(["test"])));
    let digests = trained.filter_map(|entry| entry.get("digest")?.as_str());
    let mut known = digests.filter(|digest| !digest.is_empty()).peekable();
    known.peek()?;
    let (_, digest) = content.digests.iter().find(|(of, _)| of == path)?;
    Some(known.any(|known| known == digest))
}

const FLATTERS: &str = "so these errors are smaller than on new recordings";

fn compared(content: &Content<'_>) -> String {
    let runs = &content.assessment.runs;
    let seconds: f64 = runs.iter().map(|run| run.segment.duration_s()).sum();
    let paths: BTreeSet<&Path> = runs.iter().map(|run| run.segment.path.as_path()).collect();
    let all_seen: Vec<_> = paths.iter().map(|path| seen(content, path)).collect();
    let count = |what: bool| all_seen.iter().filter(|seen| **seen == Some(what)).count();
    let of_recordings = counted(paths.len(), "recording");
    let training = match (count(true), count(false)) {
        (0, 0) => "The model file does not name the recordings of its training.".to_owned(),
        (0, 1) if paths.len() == 1 => "It was not used in training.".to_owned(),
        (0, _) => "None of them was used in training.".to_owned(),
        (1, 0) if paths.len() == 1 => format!("It was used in training, {FLATTERS}."),
        (yes, 0) if yes == paths.len() => format!("All were used in training, {FLATTERS}."),
        (yes, _) => format!("{yes} of the {of_recordings} were used in training, {FLATTERS}."),
    };
    let motions = counted(runs.len(), "motion");
    format!("Compared with {motions} of {of_recordings}, {seconds:.1} s in all. {training}")
}

fn errors(assessment: &Assessment<'_>) -> String {
    let words = |sums: &CoordinateSums| match (sums.diverged, body_rms(assessment, sums)) {
        (0, [Some(x), Some(z)]) => {
            let [x, z] = [x, z].map(|rms| with_unit(rms, "m"));
            format!("the root mean square error is {x} in body.x and {z} in body.z")
        }
        (0, _) => "the prediction does not contain the body's position".to_owned(),
        (diverged, _) => {
            let rollouts = counted(sums.windows, "rollout");
            format!("the prediction diverges in {diverged} of {rollouts}")
        }
    };
    let (over, long) = match &assessment.over_stride {
        Some([own, ..]) => ("a stride", own),
        None => ("the whole motion", &assessment.full),
    };
    let every = assessment.restart_every_s;
    format!(
        "Predictions use the recorded torques and contacts. Over {over} {}. Restarted every {every} s from the recorded \
         state, {}.",
        words(long),
        words(&assessment.restarted)
    )
}

/// The errors relative to those of the better template.
fn beside_template(assessment: &Assessment<'_>) -> Option<String> {
    let best = best_template(assessment).filter(|_| assessment.full.diverged == 0)?;
    let best = &assessment.baselines[best];
    let (own, others) = (body_rms(assessment, &assessment.full), best.full.rms());
    let ratio = |axis: usize| Some(others[axis]? / own[axis]?).filter(|ratio| ratio.is_finite());
    let words = |ratio: f64| match ratio {
        1.05.. => format!("{} times smaller", rounded(ratio, 2)),
        0.96.. => "equal".to_owned(),
        _ => format!("{} times larger", rounded(1.0 / ratio, 2)),
    };
    let (x, z, name) = (words(ratio(0)?), words(ratio(1)?), best.name);
    Some(format!(
        "The better baseline is {name}: over whole motions the model's error is {x} in body.x and {z} in body.z."
    ))
}

/// The baseline with recorded forces that is closest to the body over whole motions.
pub(super) fn best_template(assessment: &Assessment<'_>) -> Option<usize> {
    let error = |baseline: &Baseline| {
        let [x, z] = baseline.full.rms();
        Some(x?.hypot(z?))
    };
    let errors = assessment.baselines.iter().map(error).enumerate();
    let errors = errors.filter_map(|(index, error)| Some((index, error?)));
    let best = errors.min_by(|a, b| a.1.total_cmp(&b.1));
    best.map(|(index, _)| index)
}

fn commands(content: &Content<'_>) -> Option<String> {
    let runs = || content.usual.iter().map(|(_, run)| run);
    let steps: usize = runs().map(|run| run.summary.steps).sum();
    let solved: usize = runs().map(|run| run.summary.solved).sum();
    let limits = match runs().map(|run| run.summary.limit_violations).sum() {
        0 => "no command exceeds the torque limits".to_owned(),
        violations => format!("{} above the torque limits", counted(violations, "command")),
    };
    let recoveries = runs().filter_map(|run| {
        let metrics = run.metrics.as_ref()?;
        let off = metrics.baseline.feedback_off.recovery_rms_m?;
        Some([metrics.recovery_rms_m?, off])
    });
    let recoveries: Vec<[f64; 2]> = recoveries.collect();
    let mean = |which: usize| {
        let sum: f64 = recoveries.iter().map(|pair| pair[which]).sum();
        with_unit(sum / recoveries.len() as f64, "m")
    };
    let recovery = (!recoveries.is_empty()).then(|| {
        let (own, off) = (mean(0), mean(1));
        format!(" After a push of 0.1 m/s the body deviates by {own} on average, and by {off} without feedback.")
    });
    let recovery = recovery.unwrap_or_default();
    (steps > 0).then(|| {
        format!(
            "Along these recordings the controller solves {solved} of {steps} steps, and {limits}.{recovery}"
        )
    })
}

fn recordings(content: &Content<'_>) -> Result<Table> {
    let rows = Jump::all(content)?.into_iter().map(|jump| {
        let rms = jump.body_rms();
        (jump.place.words, &*jump.run.segment, rms)
    });
    let names = &content.assessment.names;
    let [x, z] = ["body.x", "body.z"].map(|body| names.iter().position(|name| name == body));
    let moved = |row: Option<usize>, of: fn(&[f64]) -> f64, segment: &Segment| {
        row.map(|row| {
            let values: Vec<f64> = segment.x.row(row).iter().copied().collect();
            format!("{:.2}", of(&values)).replace("-0.00", "0.00")
        })
    };
    let travelled = |values: &[f64]| values[values.len() - 1] - values[0];
    let risen = |values: &[f64]| values.iter().copied().fold(f64::MIN, f64::max) - values[0];
    let table = Table::of(rows)
        .column("recording", "", |(words, ..)| words.clone())
        .column("used in training", "", |(_, s, _)| {
            match seen(content, &s.path) {
                Some(true) => "yes",
                Some(false) => "no",
                None => "unknown",
            }
        })
        .column("duration", "s", |(_, s, _)| {
            format!("{:.2}", s.duration_s())
        })
        .column("forward", "m", |(_, s, _)| moved(x, travelled, s))
        .column("rise", "m", |(_, s, _)| moved(z, risen, s))
        .column("error of body.x", "", |(.., rms)| rms[0].clone())
        .column("error of body.z", "", |(.., rms)| rms[1].clone())
        .table();
    let count = counted(table.rows.len(), "motion");
    let words = "root mean square errors over the whole motion";
    Ok(table.captioned(format!("{count} of the recordings; {words}")))
}

#[cfg(test)]
#[test]
fn a_model_without_measured_rows_is_not_judged() {
    assert!(headline(&Verdict::default(), false).starts_with("Not judged"));
}
