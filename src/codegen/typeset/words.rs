//! Sentences of all printed forms of a model, in the form's spelling, and the contents of Markdown and HTML pages.

use super::decimal::{LEAST_DECIMALS, Occurrence, RELATIVE_ERROR};
use super::*;
use crate::equations::PhaseEquations;
use crate::robot::{ContactFlags, Leg};

/// How external text and mathematics are spelled in a sentence.
#[derive(Debug)]
pub struct Spelling {
    /// Text, escaped to be shown unchanged.
    pub text: fn(&str) -> String,
    /// Mathematics within a line or cell, which the text spells in the library's syntax.
    pub(crate) math: fn(&Math, &str) -> String,
}

impl Spelling {
    pub(super) fn inline(&self, math: &Math) -> String {
        (self.math)(math, "")
    }

    pub(super) fn number(&self, number: &Decimal) -> String {
        (self.math)(&Math::Number(number.clone()), &number.to_string())
    }
}

/// The spelling of comments and terminals.
pub const PLAIN: Spelling = Spelling {
    text: str::to_owned,
    math: |_, text| text.to_owned(),
};

/// Whether a character of external text ends a line or is a control character.
pub(super) fn ends_line(character: char) -> bool {
    character.is_control() || matches!(character, '\u{2028}' | '\u{2029}')
}

/// A control character or invisible one, written out for a page.
pub(super) fn code_point(character: char) -> String {
    format!("[U+{:04X}]", u32::from(character))
}

/// `1 jump`, `2 jumps`: a count before the noun that it counts.
pub fn counted(count: usize, noun: &str) -> String {
    match count {
        1 => format!("1 {noun}"),
        _ => format!("{count} {noun}s"),
    }
}

/// `a`, `a and b`, `a, b and c`.
pub fn listed(items: &[String]) -> String {
    match items {
        [] => String::new(),
        [item] => item.clone(),
        [rest @ .., last] => format!("{} and {last}", rest.join(", ")),
    }
}

/// Words for how many feet of a front or rear pair are down, and whether they hold of none, one, both.
const PAIRS: [(&str, [bool; 3]); 5] = [
    ("", [true, true, true]),
    ("no {} foot", [true, false, false]),
    ("a {} foot", [false, true, true]),
    ("one {} foot alone", [false, true, false]),
    ("both {} feet", [false, false, true]),
];

/// When a phase holds, as plain text: `a front foot on the ground`.
pub fn feet(rule: &FeetRule) -> String {
    match rule {
        FeetRule::Any => "at least one foot on the ground".to_owned(),
        FeetRule::None => "no foot on the ground".to_owned(),
        FeetRule::Patterns(_) if rule.is_always() => "any feet on the ground or none".to_owned(),
        FeetRule::Patterns(patterns) => format!("{} on the ground", pairs(patterns)),
    }
}

/// When each of these phases holds, as a sentence.
fn conditions(phases: &[&PhaseEquations], text: fn(&str) -> String) -> String {
    let feet = |phase: &PhaseEquations| text(&feet(&phase.feet));
    let parts = phases.iter().enumerate();
    let parts: Vec<String> = parts
        .map(|(place, phase)| {
            let holds = if place == 0 { " holds" } else { "" };
            format!("{}{holds} with {}", text(&phase.name), feet(phase))
        })
        .collect();
    match phases {
        [phase] => format!("Holds with {}.", feet(phase)),
        _ => parts.join("; ") + ".",
    }
}

/// Patterns of feet by front and rear pair if that is equivalent, else listed individually.
fn pairs(patterns: &[ContactFlags]) -> String {
    let is_meant = |[front, rear]: [[bool; 3]; 2]| {
        FeetRule::all_patterns().all(|feet| {
            let down = |pair: &[bool]| pair.iter().filter(|down| **down).count();
            let holds = front[down(&feet[..2])] && rear[down(&feet[2..])];
            holds == patterns.contains(&feet)
        })
    };
    let mut all = PAIRS
        .iter()
        .flat_map(|front| PAIRS.map(|rear| (*front, rear)));
    match all.find(|((_, front), (_, rear))| is_meant([*front, *rear])) {
        Some(((_, [false, false, true]), (_, [false, false, true]))) => "all four feet".to_owned(),
        Some(((_, [true, false, false]), (_, [true, false, false]))) => "no foot".to_owned(),
        Some(((front, _), (rear, _))) => {
            let pairs = [(front, "front"), (rear, "rear")];
            let mut words = Vec::from(pairs.map(|(words, pair)| words.replace("{}", pair)));
            words.retain(|words| !words.is_empty());
            // feet on the ground come before feet in the air
            words.sort_by_key(|words| words.starts_with("no "));
            words.join(" and ")
        }
        None => (patterns.iter().map(by_name).collect::<Vec<_>>()).join(", or "),
    }
}

fn by_name(pattern: &ContactFlags) -> String {
    let feet = Leg::ALL.iter().zip(pattern).filter(|(_, down)| **down);
    let feet: Vec<&str> = feet.map(|(leg, _)| leg.short_name()).collect();
    match feet.as_slice() {
        [] => "no foot".to_owned(),
        [foot] => format!("{foot} alone"),
        [rest @ .., last] => format!("{} and {last}", rest.join(", ")),
    }
}

/// The rounding of coefficients and its effect, in a few sentences.
pub fn rounding(spelling: &Spelling, rule: Rounding, report: &RoundingReport) -> String {
    let rule = match rule {
        Rounding::Adaptive => format!(
            "Coefficients have {LEAST_DECIMALS} decimals, and more where rounding would change them by over {} %.",
            100.0 * RELATIVE_ERROR
        ),
        Rounding::Decimals(places) => format!("Coefficients have {places} decimals."),
        Rounding::Significant(digits) => format!("Coefficients have {digits} significant digits."),
        Rounding::Exact => "Coefficients are printed in full.".to_owned(),
    };
    let rule = (spelling.text)(&rule);
    let error = match &report.largest {
        None => "No coefficient is changed by rounding.".to_owned(),
        Some((error, place)) => format!(
            "The largest rounding error is {}, of the term {} of {} in phase {}; relative errors \
             of printed coefficients are at most {}{}",
            spelling.number(&at_most(*error)),
            summand(spelling, place),
            (spelling.math)(&Math::Symbol(place.left.clone()), &place.output),
            (spelling.text)(&place.phase),
            spelling.number(&at_most(100.0 * report.largest_relative)),
            (spelling.text)(" %.")
        ),
    };
    let dropped = match report.dropped.len() {
        0 => String::new(),
        count => format!(
            " {count} of {} terms round to zero and are left out.",
            report.active
        ),
    };
    let terms = match report.are_terms_rounded {
        true => {
            " Factors in arguments of functions have as many digits; these errors do not contain their rounding."
        }
        false => "",
    };
    format!("{rule} {error}{dropped}{terms}")
}

/// A coefficient with more digits than are printed, before its term.
fn summand(spelling: &Spelling, place: &Occurrence) -> String {
    let coefficient = Decimal::exact(rounded(place.coefficient, 6));
    let number = spelling.number(&coefficient);
    match &place.math {
        Signed {
            math: Math::Number(one),
            ..
        } if one.is_one() => number,
        term => number + " " + &(spelling.math)(&term.clone().into_math(), &place.term),
    }
}

/// Two significant digits that are not below `error`, but for its own last bits.
fn at_most(error: f64) -> Decimal {
    let error = rounded_up(error * (1.0 - 1e-9), 2);
    Decimal::rounded(error, Rounding::Significant(2))
}

const WIDTH_EM: f64 = 44.0; // longest line of an equation unless chosen

pub(super) struct Page<'a> {
    pub equations: &'a Equations<'a>,
    pub spelling: &'a Spelling,
    pub typeset: Typeset,
    /// Symbol of each latent coordinate, its quantity and unit; empty where the model does not determine them.
    pub coordinates: Vec<(Symbol, String)>,
    pub rounding: String,
    width_em: f64,
    pub digest: Option<&'a str>,
    pub version: &'static str,
}

impl<'a> Page<'a> {
    pub(super) fn new(
        equations: &'a Equations<'a>,
        options: &'a PrintOptions,
        spelling: &'a Spelling,
    ) -> Self {
        let typeset = Typeset::new(equations, &options.symbols, options.rounding);
        let words = equations.latent_words().into_iter().enumerate();
        let coordinates = words.map(|(index, words)| {
            let symbol = options.symbols.symbol(LatentVariable::Z(index));
            (symbol, words.to_string())
        });
        Self {
            coordinates: coordinates.collect(),
            equations,
            spelling,
            rounding: rounding(spelling, options.rounding, &typeset.rounding),
            typeset,
            width_em: options.width_em.unwrap_or(WIDTH_EM),
            digest: options.digest.as_deref(),
            version: env!("CARGO_PKG_VERSION"),
        }
    }

    /// Title, condition and equations of each group of phases with equal equations.
    pub(super) fn phases(
        &self,
        math: impl Fn(&EquationSystem, f64) -> String,
    ) -> Vec<(String, String, String)> {
        let systems = &self.typeset.systems;
        let groups = alike(systems).into_iter().zip(&self.typeset.table.parts);
        let groups = groups.map(|(group, part)| {
            let phases: Vec<&PhaseEquations> = (group.iter())
                .map(|&at| &self.equations.phases[at])
                .collect();
            let math = math(&systems[group[0]], self.width_em);
            (
                part.title(self.spelling),
                conditions(&phases, self.spelling.text),
                math,
            )
        });
        groups.collect()
    }
}

/// The text of a template, with one line end at its end.
pub fn rendered(template: &impl Template) -> askama::Result<String> {
    let mut text = template.render()?;
    text.truncate(text.trim_end().len());
    text.push('\n');
    Ok(text)
}
