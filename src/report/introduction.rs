//! A report's first words: what the model is fit for, whether its training saw the recordings, errors.

use std::collections::BTreeSet;

use super::tables::template_rms;
use super::*;
use crate::mpc::{Lift, settings_for};

pub(crate) struct Introduction {
    pub headline: String,
    pub sentences: Vec<String>,
    pub recordings: Table,
}

pub(crate) fn introduction(content: &Content<'_>) -> Result<Introduction> {
    let mut sentences = vec![subject(content)?, compared(content), errors(content)];
    sentences.extend(beside_pendulum(content));
    sentences.extend(commands(content));
    sentences.extend(cause(content));
    Ok(Introduction {
        headline: headline(content.verdict, !content.assessment.remarks.is_empty()),
        sentences,
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
        ("", "") => "Not judged: these recordings show nothing that it predicts.".to_owned(),
        (fit, "") => format!("Fit for {fit}."),
        ("", failed) => format!("Not fit for {failed}."),
        (fit, failed) => format!("Fit for {fit}; not fit for {failed}."),
    };
    match is_doubtful {
        true => format!("Do not rely on it here, see the notes. {judged}"),
        false => judged,
    }
}

/// Why the model fails, where that is known.
fn cause(content: &Content<'_>) -> Option<String> {
    let failed = &content.verdict.failed;
    let lift_r2 = content.assessment.lift.torque.r2().contact;
    let is_plain = settings_for(content.model).lift == Lift::Transpose;
    if let Some(r2) = lift_r2
        .filter(|_| is_plain)
        .filter(|r2| *r2 < 0.5 && failed.iter().any(|of| of == "torques"))
    {
        return Some(format!(
            "Torques fail because encoder and decoder lose them: R^2 of recorded inputs projected and lifted is {r2:.2}."
        ));
    }
    let mut paths = content.assessment.runs.iter().map(|run| &run.segment.path);
    let are_known = paths.all(|path| seen(content, path) == Some(true));
    (are_known && !failed.is_empty()).then(|| {
        "The model is at fault, not the recordings: its training had these very files.".to_owned()
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
            " {names} {are} not modelled: no latent coordinate takes them in, and errors there say nothing about the dynamics."
        ),
    };
    Ok(format!(
        "The model reduces the {} coordinates of {robot} to {} latent ones, with {} active terms in {} ({}).{absent}",
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

const FLATTERS: &str = "which flatters the figures below";

fn compared(content: &Content<'_>) -> String {
    let runs = &content.assessment.runs;
    let seconds: f64 = runs.iter().map(|run| run.segment.duration_s()).sum();
    let paths: BTreeSet<&Path> = runs.iter().map(|run| run.segment.path.as_path()).collect();
    let all_seen: Vec<_> = paths.iter().map(|path| seen(content, path)).collect();
    let count = |what: bool| all_seen.iter().filter(|seen| **seen == Some(what)).count();
    let of_recordings = counted(paths.len(), "recording");
    let training = match (count(true), count(false)) {
        (0, 0) => "The model file does not say which recordings it was made with.".to_owned(),
        (0, 1) if paths.len() == 1 => "Its training did not see it.".to_owned(),
        (0, _) => "Its training saw none of them.".to_owned(),
        (1, 0) if paths.len() == 1 => format!("Its training saw it, {FLATTERS}."),
        (yes, 0) if yes == paths.len() => format!("Its training saw all of them, {FLATTERS}."),
        (yes, _) => format!("Its training saw {yes} of the {of_recordings}, {FLATTERS}."),
    };
    let motions = counted(runs.len(), "motion");
    format!("It is compared with {motions} of {of_recordings}, {seconds:.1} s in all. {training}")
}

fn millimetres(metres: f64) -> String {
    format!("{} mm", rounded(1e3 * metres, 2))
}

fn errors(content: &Content<'_>) -> String {
    let assessment = content.assessment;
    let shown = |value: Option<f64>| value.map_or("nowhere predicted".to_owned(), millimetres);
    let (over, long) = match &assessment.over_stride {
        Some([own, ..]) => ("a stride", own),
        None => ("whole motions", &assessment.full),
    };
    let [long, short] = [long, &assessment.restarted].map(|sums| {
        let [x, z] = body_rms(assessment, sums).map(shown);
        format!("{x} in body.x and {z} in body.z")
    });
    let runs = assessment.runs.iter();
    let diverged = runs.filter(|run| run.full.diverged_at_s().is_some());
    let diverged = match diverged.count() {
        0 => String::new(),
        diverged => format!(" The rollout diverges in {}.", counted(diverged, "motion")),
    };
    format!(
        "Driven by the recorded torques and contacts over {over}, its error is {long} (root mean square); started \
         again every {} s from the recorded state, {short}.{diverged}",
        assessment.restart_every_s
    )
}

fn beside_pendulum(content: &Content<'_>) -> Option<String> {
    let assessment = content.assessment;
    let own = body_rms(assessment, &assessment.full);
    let words = |(axis, name): (usize, &str)| -> Option<String> {
        let templates = assessment.baselines.iter();
        let errors = templates.filter_map(|template| template_rms(&template.full)[axis]);
        let ratio = errors.reduce(f64::min)? / own[axis]?;
        let words = match ratio {
            1.05.. => format!("{} times closer in {name}", rounded(ratio, 2)),
            0.96.. => format!("as close in {name}"),
            _ => format!("{} times further off in {name}", rounded(1.0 / ratio, 2)),
        };
        (ratio.is_finite() && ratio > 0.0).then_some(words)
    };
    let words = [(0, "body.x"), (1, "body.z")].into_iter().filter_map(words);
    let words = words.reduce(|x, z| format!("{x} and {z}"))?;
    Some(format!(
        "Beside the better of two spring-loaded pendulums under the same forces it is {words}."
    ))
}

fn commands(content: &Content<'_>) -> Option<String> {
    let runs = || content.consistent.iter().map(|(_, run)| run);
    let steps: usize = runs().map(|run| run.summary.steps).sum();
    let solved: usize = runs().map(|run| run.summary.solved).sum();
    let limits = match runs().map(|run| run.summary.limit_violations).sum() {
        0 => "none of its commands leaves the torque limits".to_owned(),
        violations => format!(
            "{} beyond the torque limits",
            counted(violations, "command")
        ),
    };
    let recoveries = runs().filter_map(|run| {
        let metrics = run.metrics.as_ref()?;
        let off = metrics.baseline.feedback_off.recovery_rms_m?;
        Some([metrics.recovery_rms_m?, off])
    });
    let recoveries: Vec<[f64; 2]> = recoveries.collect();
    let mean = |which: usize| {
        let sum: f64 = recoveries.iter().map(|pair| pair[which]).sum();
        millimetres(sum / recoveries.len() as f64)
    };
    let recovery = (!recoveries.is_empty()).then(|| {
        let (own, off) = (mean(0), mean(1));
        format!(" After a push of 0.1 m/s the body stays off by {own} on average, and by {off} with no feedback.")
    });
    let recovery = recovery.unwrap_or_default();
    (steps > 0).then(|| {
        format!(
            "Along these recordings the latent controller solves {solved} of {steps} steps, and {limits}.{recovery}"
        )
    })
}

fn recordings(content: &Content<'_>) -> Result<Table> {
    let rows = Jump::all(content)?.into_iter().map(|jump| {
        let rms = jump.body_rms_m();
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
    let shown = |rms: Option<f64>| rms.map(|rms| rounded(1e3 * rms, 2).to_string());
    let table = Table::of(rows)
        .column("recording", "", |(words, ..)| words.clone())
        .column("seen in training", "", |(_, s, _)| {
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
        .column("rise of the body", "m", |(_, s, _)| moved(z, risen, s))
        .column("body.x rms, whole motion", "mm", |(.., rms)| shown(rms[0]))
        .column("body.z rms, whole motion", "mm", |(.., rms)| shown(rms[1]))
        .table();
    let count = counted(table.rows.len(), "motion");
    Ok(table.captioned(format!("{count} of the recordings")))
}

#[cfg(test)]
#[test]
fn a_model_without_measured_rows_is_not_judged() {
    assert!(headline(&Verdict::default(), false).starts_with("Not judged"));
}
