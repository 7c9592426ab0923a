//! Tables of a certificate and of its effect on rollouts.

use super::certificate::{Certificate, Change, ChangeKind};
use super::printing::PrintedEquation;
use super::rollouts::RolloutEffect;
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

/// Root mean square errors of rollouts before and after.
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

/// Errors of equations whose coefficients are rounded for print.
pub(crate) fn printing_table(printed: &[PrintedEquation]) -> Table {
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
pub(crate) fn interval_words(interval: Interval) -> String {
    let [below, hi] = [-interval.lo(), interval.hi()].map(|end| rounded_up(end, 4));
    format!("[{}, {}]", significant(-below), significant(hi))
}

/// A bound in four digits, never below it.
pub(crate) fn bound_words(bound: f64) -> String {
    significant(rounded_up(bound, 4))
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
