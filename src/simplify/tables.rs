//! Tables of a certificate and of its effect on rollouts, and both as a page of Markdown.

use std::fmt::Write as _;

use super::certificate::{Certificate, Change, ChangeKind, PhaseCertificate};
use super::measure::PrintedEquation;
use super::rollouts::RolloutEffect;
use crate::artifact;
use crate::equations::ExactStep;
use crate::model::ReducedModel;
use crate::symbolic::Interval;
use crate::typeset::{Cell, Table, rounded_up, significant};

/// Terms, root mean square, allowed, certified and measured error of each equation.
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

/// Every change with its bound and its error at the recorded samples.
pub(crate) fn change_table(certificate: &Certificate) -> Table {
    let changes = certificate.equations().flat_map(|(phase, equation)| {
        let name = name(phase, equation.output);
        let changes = equation.changes.iter();
        changes.map(move |change| (name.clone(), change))
    });
    Table::of(changes)
        .column("phase, equation", "", |(name, _)| name.clone())
        .column("term", "", |(_, change)| &change.term)
        .column("change", "", |(_, change)| change_words(change))
        .column("before", "", |(_, change)| change.before.to_string())
        .column("after", "", |(_, change)| change.after.to_string())
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
    for (kind, title) in ["whole jump", &every].into_iter().enumerate() {
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
        ChangeKind::Rounded { digits: 1 } => "rounded to 1 digit".to_owned(),
        ChangeKind::Rounded { digits } => format!("rounded to {digits} digits"),
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

/// What phases no longer depend on, a sentence each without its stop.
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

/// The certificate of a model and its simplification as a page: totals, changes, effect on rollouts,
/// what printing rounds, domain.
pub fn markdown(
    [model, simplified]: [&ReducedModel; 2],
    certificate: &Certificate,
    rollouts: Option<&RolloutEffect>,
    printed: &[PrintedEquation],
) -> String {
    let mut page = format!("# Simplification of `{}`\n\n", code(model.name()));
    let digest = |model| artifact::digest(model).short();
    let (from, to) = (digest(model), digest(simplified));
    let _ = writeln!(
        page,
        "- from the model with digest {from} to the one with digest {to}"
    );
    page += &summary(certificate);
    page += "\n## Statement\n\n";
    page += STATEMENT;
    page += "\n## Each equation\n\n";
    page += &equations(certificate);
    for text in lost_words(certificate) {
        let _ = writeln!(page, "\n{}.", code(&text));
    }
    if !certificate.exact.is_empty() {
        page += "\n## Exact steps\n\n";
        page += EXACT;
        page += &exact_steps(&certificate.exact);
    }
    page += "\n## Each change\n\n";
    page += &changes(certificate);
    if let Some(effect) = rollouts {
        page += "\n## Rollouts over the recordings\n\n";
        page += &rollout_text(effect);
    }
    if !printed.is_empty() {
        page += "\n## What printing adds\n\n";
        page += "Printed equations have rounded coefficients. Their `ddz` differs from that of the emitted code by:\n\n";
        page += &printing_table(printed).markdown();
    }
    page += "\n## The domain\n\n";
    for phase in &certificate.phases {
        page += &domain(phase);
    }
    page
}

const STATEMENT: &str = "\
For every phase, every point `(z, dz, u)` of its domain (the last section) and every latent coordinate, `ddz` of the
model minus `ddz` of the simplified model lies in the interval under *bound*, in exact arithmetic. Intervals are
computed with outward rounding, from the two models' coefficients and not from the list of changes; *sum of changes*
adds the bounds of the list and contains the same difference. *Measured* is the difference at the recorded samples in
the domain: it can never be larger. Nothing is stated about points outside the domain. All errors are in scaled units
per second squared. The rounding of emitted code comes on top of both models alike: about 1e-16 of its largest summand
in double precision; in single precision each function states its bound.
";

const EXACT: &str = "\
Terms that are together equal to shorter ones, for all arguments. Their coefficients were added or multiplied and
rounded once; the bounds below are those of the changes made after these steps.

";

fn exact_steps(steps: &[ExactStep]) -> String {
    Table::of(steps)
        .column("step", "", |step| step.to_string())
        .column("as learned", "", |step| ExactStep::sum_words(&step.before))
        .column("simplified", "", |step| ExactStep::sum_words(&step.after))
        .table()
        .markdown()
}

fn summary(certificate: &Certificate) -> String {
    let share = |share: Option<f64>| {
        share.map_or("not known without recordings".to_owned(), |share| {
            format!("{} %", bound_words(100.0 * share))
        })
    };
    format!(
        "- tolerance: {}\n- active terms: {}\n- significant digits of all coefficients together: {}\n\
         - operations of `ddz` in straight-line code: {}\n- changes: {}\n\
         - largest bound, as a share of the root mean square of its `ddz`: {}\n\
         - largest error at a recorded sample, likewise: {}\n",
        certificate.tolerance.words(),
        certificate.terms(),
        certificate.digits(),
        certificate.operations(),
        certificate.n_changes(),
        share(certificate.largest_bound_share()),
        share(certificate.largest_measured_share()),
    )
}

fn equations(certificate: &Certificate) -> String {
    let equations = || certificate.equations().map(|(_, equation)| equation);
    let mut table = equation_table(certificate);
    table.column("bound", "", equations().map(|e| interval_words(e.bound)));
    let sums = equations().map(|e| interval_words(e.sum_of_bounds));
    table.column("sum of changes", "", sums);
    table.markdown()
}

fn changes(certificate: &Certificate) -> String {
    match certificate.n_changes() {
        0 => "None.\n".to_owned(),
        _ => change_table(certificate).markdown(),
    }
}

fn rollout_text(effect: &RolloutEffect) -> String {
    let percent = |share: Option<f64>| share.map_or(0.0, |share| 100.0 * share);
    format!(
        "{}\nThe simplified model's rollouts leave the domain, where no bound holds, in {:.1} % of the samples of whole \
         jumps and {:.1} % of those of restarted ones; {} and {} of them diverged.\n",
        rollout_table(effect).markdown(),
        percent(effect.after.outside[0]),
        percent(effect.after.outside[1]),
        effect.after.diverged[0],
        effect.after.diverged[1]
    )
}

fn domain(phase: &PhaseCertificate) -> String {
    let name = code(&phase.name);
    let Some(ranges) = &phase.domain else {
        return format!("Phase {name}: none, so its equations were kept.\n\n");
    };
    let mut text = format!(
        "Phase {name}, with {} recorded samples inside",
        phase.samples
    );
    if phase.samples_outside > 0 {
        let _ = write!(text, " and {} outside", phase.samples_outside);
    }
    let table = Table::of(ranges)
        .column("variable", "", |(variable, _)| variable)
        .column("from", "", |(_, range)| range.lo().to_string())
        .column("to", "", |(_, range)| range.hi().to_string())
        .table();
    text + ":\n\n" + &table.markdown() + "\n"
}

/// Text that cannot end a code span.
fn code(text: &str) -> String {
    text.replace('`', "'")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn printed_interval_contains_the_interval() {
        assert_eq!(
            interval_words(Interval::new(-0.00012345678, 0.0)),
            "[-1.235e-4, 0]"
        );
        assert_eq!(
            interval_words(Interval::new(1.00009, 1.00009)),
            "[1.000, 1.001]"
        );
    }
}
