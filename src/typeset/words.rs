//! Sentences that every printed form of a model carries, as plain text.

use crate::model::FeetRule;

use super::decimal::Rounding;
use super::rounder::RoundingReport;
use super::table::rounded_up;

/// Names of the feet in the order of contact flags.
const FEET: [&str; 4] = ["fr", "fl", "rr", "rl"];

/// When a phase holds, as plain text.
pub fn feet(rule: &FeetRule) -> String {
    match rule {
        FeetRule::Any => "at least one foot on the ground".to_owned(),
        FeetRule::None => "no foot on the ground".to_owned(),
        FeetRule::Patterns(patterns) => {
            let patterns: Vec<String> = patterns
                .iter()
                .map(|pattern| {
                    let feet: Vec<&str> = FEET
                        .iter()
                        .zip(pattern)
                        .filter_map(|(name, on)| on.then_some(*name))
                        .collect();
                    if feet.is_empty() {
                        "none".to_owned()
                    } else {
                        feet.join(" ")
                    }
                })
                .collect();
            format!("feet on the ground: {}", patterns.join(", or "))
        }
    }
}

/// How coefficients were rounded and what it changed, in one line of plain text.
pub fn rounding(rule: Rounding, report: &RoundingReport) -> String {
    let rule = match rule {
        Rounding::Adaptive {
            decimals,
            relative_error,
        } => format!(
            "Coefficients have {decimals} decimals, more where they would be off by over {} %.",
            100.0 * relative_error
        ),
        Rounding::Decimals(places) => format!("Coefficients have {places} decimals."),
        Rounding::Significant(digits) => format!("Coefficients have {digits} significant digits."),
        Rounding::Exact => "Coefficients are printed in full.".to_owned(),
    };
    let error = match &report.largest {
        None => "No coefficient is changed by rounding.".to_owned(),
        Some((error, place)) => format!(
            "The largest rounding error is {} ({}, {}: {} * {}), the largest relative one {}.",
            at_most(*error),
            place.phase,
            place.output,
            place.coefficient,
            place.term,
            at_most(report.largest_relative)
        ),
    };
    let dropped = match report.dropped.len() {
        0 => String::new(),
        count => format!(
            " {count} of {} terms round to zero and are left out.",
            report.active
        ),
    };
    format!("{rule} {error}{dropped}")
}

/// Two significant digits that are not below `error`, but for its own last bits.
fn at_most(error: f64) -> String {
    format!("{:.1e}", rounded_up(error * (1.0 - 1e-9), 2))
}
