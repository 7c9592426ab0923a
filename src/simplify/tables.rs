//! Tables of a certificate and of its effect on rollouts, and both as a page of Markdown.

use askama::Template;

use super::measure::PrintedEquation;
use super::*;

pub(crate) fn equation_table(certificate: &Certificate) -> Table {
    Table::of(certificate.equations())
        .column("phase, equation", "", |(phase, e)| name(phase, e.output))
        .column("terms", "", |(_, e)| e.terms.to_string())
        .column("rms of ddz", "", |(_, e)| e.rms)
        .column("allowed error", "", |(_, e)| e.allowed)
        .column("certified error", "", |(_, e)| {
            bound_words(e.bound.magnitude())
        })
        .column("measured max", "", |(_, e)| e.measured.map(|m| m.max))
        .column("measured rms", "", |(_, e)| e.measured.map(|m| m.rms))
        .table()
}

pub(crate) fn change_table(certificate: &Certificate) -> Table {
    let changes = certificate.equations().flat_map(|(phase, equation)| {
        let name = name(phase, equation.output);
        let changes = equation.changes.iter();
        changes.map(move |change| (name.clone(), change))
    });
    Table::of(changes)
        .column("phase, equation", "", |(name, _)| name.clone())
        .column("term", "", |(_, change)| &change.own.term)
        .column("change", "", |(_, change)| change_words(change))
        .column("before", "", |(_, change)| change.own.before.to_string())
        .column("after", "", |(_, change)| change.own.after.to_string())
        .column("bound", "", |(_, change)| interval_words(change.bound))
        .column("measured max", "", |(_, c)| c.measured.map(|m| m.max))
        .column("measured rms", "", |(_, c)| c.measured.map(|m| m.rms))
        .table()
}

pub(crate) fn rollout_table(effect: &RolloutEffect) -> Table {
    let names = effect.names.iter().zip(&effect.units);
    let names = names.map(|(name, unit)| format!("{name}, {unit}"));
    let every = format!("restarted every {} s", effect.restart_every_s);
    let mut table = Table::default();
    table.column("rms error", "", names);
    for (kind, title) in ["whole motion", &every].into_iter().enumerate() {
        let of = |rms: &[Option<f64>; 2]| rms[kind];
        let before = format!("{title}, before");
        table.column(&before, "", effect.before.rms.iter().map(of));
        table.column("after", "", effect.after.rms.iter().map(of));
    }
    table
}

fn printing_table(printed: &[PrintedEquation]) -> Table {
    Table::of(printed)
        .column("phase, equation", "", |e| name(&e.phase, e.output))
        .column("bound", "", |e| e.bound.map(interval_words))
        .column("measured max", "", |e| e.measured.map(|m| m.max))
        .column("measured rms", "", |e| e.measured.map(|m| m.rms))
        .table()
}

fn name(phase: &str, output: usize) -> Cell {
    format!("{phase}, ddz{}", output + 1).into()
}

fn change_words(change: &Change) -> String {
    let others = || {
        let terms = change.effects.iter().map(|effect| {
            let (before, after) = (significant(effect.before), significant(effect.after));
            format!("{}: {before} to {after}", effect.term)
        });
        terms.collect::<Vec<_>>().join(", ")
    };
    match change.kind {
        ChangeKind::Dropped => "dropped".to_owned(),
        ChangeKind::Constant => format!("into the constant ({})", others()),
        ChangeKind::Linear => format!("made linear ({})", others()),
        ChangeKind::Rounded => match change.digits.unwrap_or_default() {
            1 => "rounded to 1 digit".to_owned(),
            digits => format!("rounded to {digits} digits"),
        },
    }
}

/// An interval of four-digit numbers that contains the interval.
fn interval_words(interval: Interval) -> String {
    let [below, hi] = [-interval.lo(), interval.hi()].map(|end| rounded_up(end, 4));
    format!("[{}, {}]", significant(-below), significant(hi))
}

/// A bound in four digits, never below it.
pub(crate) fn bound_words(bound: f64) -> String {
    significant(rounded_up(bound, 4))
}

pub(crate) fn lost_words(certificate: &Certificate) -> Vec<String> {
    let phases = (certificate.phases.iter()).filter(|phase| !phase.lost.is_empty());
    let sentence = |phase: &PhaseCertificate| {
        let names: Vec<String> = phase.lost.iter().map(ToString::to_string).collect();
        format!(
            "Phase {} no longer depends on {}",
            phase.name,
            names.join(", ")
        )
    };
    phases.map(sentence).collect()
}

#[derive(Template)]
#[template(path = "simplify/certificate.askama", config = "templates/askama.toml")]
struct Page<'a> {
    name: &'a str,
    digests: [String; 2],
    certificate: &'a Certificate,
    rollouts: Option<&'a RolloutEffect>,
    printed: &'a [PrintedEquation],
}

/// The page of a certificate alone, without rollouts and printed equations.
pub fn certificate_page(models: [&ReducedModel; 2], certificate: &Certificate) -> String {
    markdown(models, certificate, None, &[])
}

/// The certificate and its effect on rollouts, with the effect of rounding when printed, as a page of Markdown.
pub(crate) fn markdown(
    models: [&ReducedModel; 2],
    certificate: &Certificate,
    rollouts: Option<&RolloutEffect>,
    printed: &[PrintedEquation],
) -> String {
    let page = Page {
        name: models[0].name(),
        digests: models.map(|model| artifact::digest(model).short()),
        certificate,
        rollouts,
        printed,
    };
    page.render().expect("a page of numbers and tables") + "\n"
}

fn exact_steps(steps: &[ExactStep]) -> Table {
    Table::of(steps)
        .column("step", "", |step| step.to_string())
        .column("as learned", "", |step| ExactStep::sum_words(&step.before))
        .column("simplified", "", |step| ExactStep::sum_words(&step.after))
        .table()
}

fn share(share: Option<f64>) -> String {
    share.map_or("not known without recordings".to_owned(), |share| {
        format!("{} %", bound_words(100.0 * share))
    })
}

fn equations(certificate: &Certificate) -> Table {
    let equations = || certificate.equations().map(|(_, equation)| equation);
    let mut table = equation_table(certificate);
    table.column("bound", "", equations().map(|e| interval_words(e.bound)));
    let sums = equations().map(|e| interval_words(e.sum_of_bounds));
    table.column("sum of changes", "", sums);
    table
}

fn percent(share: &Option<f64>) -> String {
    format!("{:.1}", share.map_or(0.0, |share| 100.0 * share))
}

fn domain(ranges: &[(String, Interval)]) -> Table {
    Table::of(ranges)
        .column("variable", "", |(variable, _)| variable)
        .column("from", "", |(_, range)| range.lo().to_string())
        .column("to", "", |(_, range)| range.hi().to_string())
        .table()
}

/// Text that cannot end a code span.
fn code(text: &str) -> String {
    text.replace('`', "'")
}

#[cfg(test)]
#[path = "../../tests/units/simplify_tables.rs"]
mod tests;
