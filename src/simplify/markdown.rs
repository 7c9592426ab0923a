//! The certificate as a page of Markdown.

use std::fmt::Write as _;

use super::certificate::{Certificate, Change, ChangeKind, EquationCertificate, PhaseCertificate};
use super::measure::Measured;
use super::printing::PrintedEquation;
use super::rollouts::RolloutEffect;
use super::tolerance::Tolerance;
use crate::artifact;
use crate::equations::ExactStep;
use crate::model::ReducedModel;
use crate::symbolic::Interval;

/// What was done to a term, in words.
pub fn change_words(change: &Change) -> String {
    let others = || {
        let terms = change.effects.iter().map(|effect| {
            let (before, after) = (number(effect.before), number(effect.after));
            format!("{}: {before} to {after}", effect.term)
        });
        terms.collect::<Vec<_>>().join(", ")
    };
    match change.kind {
        ChangeKind::Dropped => "dropped".to_owned(),
        ChangeKind::Constant => format!("into the constant ({})", others()),
        ChangeKind::Linear => format!("made linear ({})", others()),
        ChangeKind::Quadratic => format!("made a parabola ({})", others()),
        ChangeKind::Rounded { digits: 1 } => "rounded to 1 digit".to_owned(),
        ChangeKind::Rounded { digits } => format!("rounded to {digits} digits"),
    }
}

/// What phases no longer depend on, a sentence each without its stop.
pub fn lost_words(certificate: &Certificate) -> Vec<String> {
    let phases = certificate
        .phases
        .iter()
        .filter(|phase| !phase.lost.is_empty());
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
    page += "\n## What the certificate says\n\n";
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
        page += &rollout_table(effect);
    }
    if !printed.is_empty() {
        page += "\n## What printing adds\n\n";
        page += &printing_table(printed);
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
    let mut table = row(&["step", "as learned", "simplified"]) + "|---|---|---|\n";
    for step in steps {
        let [before, after] = [&step.before, &step.after].map(|side| ExactStep::sum_words(side));
        table += &row(&[&code(&step.to_string()), &code(&before), &code(&after)]);
    }
    table
}

fn summary(certificate: &Certificate) -> String {
    let ((before, after), (slow, fast)) = (certificate.terms(), certificate.operations());
    let (digits_before, digits_after) = certificate.digits();
    let unit = match certificate.tolerance {
        Tolerance::ShareOfRms(_) => {
            " of the root mean square of each `ddz` over the recorded samples of the phase"
        }
        Tolerance::Absolute(_) => " scaled units per second squared for each `ddz`",
    };
    let share = |share: Option<f64>| {
        share.map_or("not known without recordings".to_owned(), |share| {
            format!("{} %", number(upward(100.0 * share)))
        })
    };
    format!(
        "- tolerance: {}{unit}\n- active terms: {before} before, {after} after\n- significant digits of all coefficients together: \
         {digits_before} before, {digits_after} after\n- operations of `ddz` in straight-line code: {slow} before, \
         {fast} after\n- changes: {}\n- largest bound, as a share of the \
         root mean square of its `ddz`: {}\n- largest error at a recorded sample, likewise: {}\n",
        certificate.tolerance,
        certificate.n_changes(),
        share(certificate.largest_bound_share()),
        share(certificate.largest_measured_share()),
    )
}

fn equations(certificate: &Certificate) -> String {
    let mut table = row(&[
        "phase",
        "equation",
        "terms",
        "rms of ddz",
        "allowed",
        "bound",
        "sum of changes",
        "measured max",
        "measured rms",
    ]);
    table += "|---|---|---|---|---|---|---|---|---|\n";
    for (phase, equation) in certificate.equations() {
        let EquationCertificate {
            terms_before,
            terms_after,
            ..
        } = equation;
        let [max, rms] = measured_cells(equation.measured);
        table += &row(&[
            &code(phase),
            &format!("ddz{}", equation.output + 1),
            &format!("{terms_before} to {terms_after}"),
            &equation.rms.map_or("-".to_owned(), number),
            &number(equation.allowed),
            &interval_words(equation.bound),
            &interval_words(equation.sum_of_bounds),
            &max,
            &rms,
        ]);
    }
    table
}

fn changes(certificate: &Certificate) -> String {
    if certificate.n_changes() == 0 {
        return "None.\n".to_owned();
    }
    let mut table = row(&[
        "phase",
        "equation",
        "term",
        "change",
        "coefficient before",
        "after",
        "bound",
        "measured max",
        "measured rms",
    ]);
    table += "|---|---|---|---|---|---|---|---|---|\n";
    for (phase, equation) in certificate.equations() {
        for change in &equation.changes {
            let [max, rms] = measured_cells(change.measured);
            table += &row(&[
                &code(phase),
                &format!("ddz{}", equation.output + 1),
                &format!("`{}`", code(&change.term)),
                &code(&change_words(change)),
                &change.before.to_string(),
                &change.after.to_string(),
                &interval_words(change.bound),
                &max,
                &rms,
            ]);
        }
    }
    table
}

fn rollout_table(effect: &RolloutEffect) -> String {
    let every = effect.restart_every_s;
    let mut table = row(&[
        "rms error",
        "whole jump, before",
        "after",
        &format!("restarted every {every} s, before"),
        "after",
    ]);
    table += "|---|---|---|---|---|\n";
    let cell = |rms: Option<f64>| rms.map_or("-".to_owned(), number);
    for (k, name) in effect.names.iter().enumerate() {
        let (before, after) = (effect.before.rms[k], effect.after.rms[k]);
        table += &row(&[
            &format!("{name}, {}", effect.units[k]),
            &cell(before[0]),
            &cell(after[0]),
            &cell(before[1]),
            &cell(after[1]),
        ]);
    }
    let percent = |share: Option<f64>| share.map_or(0.0, |share| 100.0 * share);
    let _ = writeln!(
        table,
        "\nThe simplified model's rollouts leave the domain, where no bound holds, in {:.1} % of the samples of whole \
         jumps and {:.1} % of those of restarted ones; {} and {} of them diverged.",
        percent(effect.after.outside[0]),
        percent(effect.after.outside[1]),
        effect.after.diverged[0],
        effect.after.diverged[1]
    );
    table
}

fn printing_table(printed: &[PrintedEquation]) -> String {
    let mut table = "Printed equations have rounded coefficients. Their `ddz` differs from that of the emitted code by:\n\n".to_owned();
    table += &row(&["phase", "equation", "bound", "measured max", "measured rms"]);
    table += "|---|---|---|---|---|\n";
    for equation in printed {
        let [max, rms] = measured_cells(equation.measured);
        table += &row(&[
            &code(&equation.phase),
            &format!("ddz{}", equation.output + 1),
            &equation.bound.map_or("-".to_owned(), interval_words),
            &max,
            &rms,
        ]);
    }
    table
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
    text += ":\n\n| variable | from | to |\n|---|---|---|\n";
    for (variable, range) in ranges {
        text += &row(&[variable, &range.lo().to_string(), &range.hi().to_string()]);
    }
    text + "\n"
}

fn row(cells: &[&str]) -> String {
    format!("| {} |\n", cells.join(" | "))
}

fn measured_cells(measured: Option<Measured>) -> [String; 2] {
    measured.map_or(["-".to_owned(), "-".to_owned()], |measured| {
        [number(measured.max), number(measured.rms)]
    })
}

/// Text that cannot end a cell or a code span.
fn code(text: &str) -> String {
    text.replace('|', "\\|").replace('`', "'")
}

/// Four significant digits.
fn number(value: f64) -> String {
    let rounded: f64 = format!("{value:.3e}")
        .parse()
        .expect("a formatted float reads back");
    if rounded == 0.0 {
        "0".to_owned()
    } else if (1e-3..1e5).contains(&rounded.abs()) {
        rounded.to_string()
    } else {
        format!("{rounded:e}")
    }
}

/// An interval of four-digit numbers that contains the interval.
pub fn interval_words(interval: Interval) -> String {
    let (lo, hi) = (-upward(-interval.lo()), upward(interval.hi()));
    format!("[{}, {}]", number(lo), number(hi))
}

/// A bound in four digits, never below it.
pub fn bound_words(bound: f64) -> String {
    number(upward(bound))
}

/// The smallest number of four significant digits that is not below `value`.
fn upward(value: f64) -> f64 {
    let rounded: f64 = format!("{value:.3e}")
        .parse()
        .expect("a formatted float reads back");
    if rounded >= value {
        return rounded;
    }
    let step = 10f64.powi(value.abs().log10().floor() as i32 - 3);
    format!("{:.3e}", rounded + step)
        .parse()
        .expect("a formatted float reads back")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn printed_interval_contains_the_interval() {
        let mut value = 1.23456789e-8;
        while value < 1e6 {
            for sign in [1.0, -1.0] {
                let shown = upward(sign * value);
                assert!(shown >= sign * value && (shown - sign * value).abs() <= 1.1e-3 * value);
                assert_eq!(number(shown).parse::<f64>(), Ok(shown), "{value}");
            }
            value *= 1.37;
        }
        assert_eq!(
            interval_words(Interval::new(-0.00012345678, 0.0)),
            "[-1.235e-4, 0]"
        );
    }
}
