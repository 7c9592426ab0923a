//! Contact phases: which feet are down, and for how long.
//!
//! A rule is a list of named foot patterns, the first match wins, as in the
//! model file. With the paper's two phases, samples with one to three feet
//! down count as contact and so join the launch or the landing they border
//! (section IV-C4). Three phases describe an asynchronous jump.

use std::ops::Range;

use super::error::{RecordingError, RecordingFault};
use super::segment::{Segment, stretches};
use crate::robot::{ContactFlags, FeetRule};

/// Fewest samples of a span: fewer are chatter of contact and join the span before them.
pub const CHATTER_SAMPLES: usize = 5;

/// A phase and its feet.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PhasePattern {
    /// Name of the phase.
    pub name: String,
    /// Feet that select it.
    pub feet: FeetRule,
}

/// How samples are assigned to phases.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PhaseRule {
    /// Patterns; the first match wins.
    pub patterns: Vec<PhasePattern>,
    /// Spans of fewer samples join the span before them (chatter of contact).
    pub min_samples: usize,
}

/// Place of a span in a jump.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Stance {
    /// Contact before any flight; a segment without flight is all launch.
    Launch,
    /// No foot down.
    Flight,
    /// Contact after a flight.
    Landing,
}

/// Consecutive samples of one phase.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PhaseSpan {
    /// Index of the phase in [`PhaseRule::patterns`].
    pub phase: usize,
    /// Place in the jump.
    pub kind: Stance,
    /// Samples of the segment.
    pub range: Range<usize>,
}

impl PhaseRule {
    /// A rule of these patterns that keeps every span.
    pub fn new(patterns: Vec<PhasePattern>) -> Self {
        PhaseRule {
            patterns,
            min_samples: 1,
        }
    }

    /// The paper's synchronous jump: `contact` (any foot), `flight` (none).
    pub fn two_phase() -> Self {
        Self::new(vec![
            pattern("contact", FeetRule::Any),
            pattern("flight", FeetRule::None),
        ])
    }

    /// The asynchronous jump: `contact` (a front foot is down), `rear` (only
    /// rear feet), `flight` (none).
    pub fn three_phase() -> Self {
        let all = (0..16).map(|bits: u8| std::array::from_fn(|foot| bits & (1 << foot) != 0));
        let (rear, front): (Vec<ContactFlags>, Vec<ContactFlags>) = all
            .filter(|feet: &ContactFlags| feet.contains(&true))
            .partition(|feet| !feet[0] && !feet[1]);
        Self::new(vec![
            pattern("contact", FeetRule::Patterns(front)),
            pattern("rear", FeetRule::Patterns(rear)),
            pattern("flight", FeetRule::None),
        ])
    }

    /// The rule with spans under `min_samples` joined to the span before them.
    pub fn with_min_samples(mut self, min_samples: usize) -> Self {
        self.min_samples = min_samples;
        self
    }

    /// Names of the phases.
    pub fn names(&self) -> Vec<String> {
        self.patterns.iter().map(|p| p.name.clone()).collect()
    }

    /// Index of the first pattern that matches, if any does.
    pub fn phase_of(&self, feet: ContactFlags) -> Option<usize> {
        self.patterns.iter().position(|p| p.feet.matches(feet))
    }

    /// The spans of a segment, in order and without gaps.
    ///
    /// A run of samples that matches no pattern (transitional, under a rule
    /// that lists exact patterns) joins the neighbour with more feet down, on
    /// a tie the one before it.
    ///
    /// # Errors
    /// [`RecordingFault::NoPhase`] if no sample matches any pattern.
    pub fn spans(&self, segment: &Segment) -> Result<Vec<PhaseSpan>, RecordingError> {
        let feet = &segment.feet;
        let mut phases: Vec<Option<usize>> = feet.iter().map(|f| self.phase_of(*f)).collect();
        let Some(first_known) = phases.iter().position(Option::is_some) else {
            return match feet.first() {
                None => Ok(Vec::new()),
                Some(&feet) => {
                    let phases = self.names();
                    let fault = RecordingFault::NoPhase { feet, phases };
                    Err(fault.at(&segment.path, segment.row(0)))
                }
            };
        };
        assign_transitional(&mut phases, feet, first_known);
        let phases: Vec<usize> = phases.into_iter().flatten().collect();
        let runs = stretches(0..phases.len(), |a, b| phases[a] == phases[b]).into_iter();
        let runs = runs.map(|range| (phases[range.start], range));
        let runs = merge_short(runs, self.min_samples);
        Ok(with_stance(runs, feet))
    }
}

fn pattern(name: &str, feet: FeetRule) -> PhasePattern {
    PhasePattern {
        name: name.to_owned(),
        feet,
    }
}

fn feet_down(feet: ContactFlags) -> usize {
    feet.iter().filter(|down| **down).count()
}

fn assign_transitional(phases: &mut [Option<usize>], feet: &[ContactFlags], first_known: usize) {
    let known = phases[first_known];
    phases[..first_known].fill(known);
    let mut at = first_known;
    while at < phases.len() {
        if phases[at].is_some() {
            at += 1;
            continue;
        }
        let before = phases[at - 1];
        let end = phases[at..].iter().position(Option::is_some);
        let Some(end) = end.map(|offset| at + offset) else {
            phases[at..].fill(before);
            return;
        };
        let joins_next = feet_down(feet[end]) > feet_down(feet[at - 1]);
        let phase = if joins_next { phases[end] } else { before };
        phases[at..end].fill(phase);
        at = end;
    }
}

type Run = (usize, Range<usize>);

fn merge_short(runs: impl Iterator<Item = Run>, min_samples: usize) -> Vec<Run> {
    let mut out: Vec<Run> = Vec::new();
    for (phase, range) in runs {
        match out.last_mut() {
            // A short first run has nothing before it and joins what follows.
            Some((first, before)) if before.len() < min_samples => {
                *first = phase;
                before.end = range.end;
            }
            Some((last, before)) if *last == phase || range.len() < min_samples => {
                before.end = range.end;
            }
            _ => out.push((phase, range)),
        }
    }
    out
}

fn with_stance(runs: Vec<Run>, feet: &[ContactFlags]) -> Vec<PhaseSpan> {
    let mut flown = false;
    runs.into_iter()
        .map(|(phase, range)| {
            // Most samples decide: a span may have swallowed chatter.
            let airborne = feet[range.clone()]
                .iter()
                .filter(|feet| feet_down(**feet) == 0)
                .count();
            let kind = if 2 * airborne > range.len() {
                flown = true;
                Stance::Flight
            } else if flown {
                Stance::Landing
            } else {
                Stance::Launch
            };
            PhaseSpan { phase, kind, range }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::segment::tests::sample_segment;

    fn segment(pattern: &[(usize, [u8; 4])]) -> Segment {
        let feet: Vec<ContactFlags> = pattern
            .iter()
            .flat_map(|(count, feet)| std::iter::repeat_n(feet.map(|f| f == 1), *count))
            .collect();
        let mut segment = sample_segment(feet.len());
        segment.feet = feet;
        segment
    }

    fn brief(rule: &PhaseRule, segment: &Segment) -> Vec<(usize, Stance, Range<usize>)> {
        let spans = rule.spans(segment).unwrap();
        assert_eq!(spans.first().map(|s| s.range.start), Some(0));
        assert_eq!(spans.last().map(|s| s.range.end), Some(segment.len()));
        spans
            .into_iter()
            .map(|s| (s.phase, s.kind, s.range))
            .collect()
    }

    #[test]
    fn spans_two_phase_transitional_samples_join_launch_and_landing() {
        let jump = segment(&[
            (10, [1, 1, 1, 1]),
            (2, [0, 0, 1, 1]),
            (1, [0, 0, 0, 1]),
            (20, [0, 0, 0, 0]),
            (3, [0, 1, 0, 0]),
            (9, [1, 1, 1, 1]),
        ]);
        assert_eq!(
            brief(&PhaseRule::two_phase(), &jump),
            [
                (0, Stance::Launch, 0..13),
                (1, Stance::Flight, 13..33),
                (0, Stance::Landing, 33..45)
            ]
        );
    }

    #[test]
    fn spans_three_phase_separates_the_rear_stance() {
        let jump = segment(&[
            (10, [1, 1, 1, 1]),
            (2, [0, 1, 1, 1]),
            (30, [0, 0, 1, 1]),
            (1, [0, 0, 1, 0]),
            (20, [0, 0, 0, 0]),
        ]);
        assert_eq!(
            brief(&PhaseRule::three_phase(), &jump),
            [
                (0, Stance::Launch, 0..12),
                (1, Stance::Launch, 12..43),
                (2, Stance::Flight, 43..63)
            ]
        );
    }

    #[test]
    fn three_phase_rule_matches_every_contact_exactly_once() {
        let rule = PhaseRule::three_phase();
        for bits in 0..16_u8 {
            let feet = std::array::from_fn(|foot| bits & (1 << foot) != 0);
            let matching = rule.patterns.iter().filter(|p| p.feet.matches(feet));
            assert_eq!(matching.count(), 1, "{feet:?}");
        }
    }

    #[test]
    fn spans_exact_patterns_give_transitions_to_the_side_with_more_feet() {
        let exact = |name: &str, feet: [u8; 4]| {
            pattern(name, FeetRule::Patterns(vec![feet.map(|f| f == 1)]))
        };
        let rule = PhaseRule::new(vec![
            exact("all", [1, 1, 1, 1]),
            exact("rear", [0, 0, 1, 1]),
            exact("none", [0; 4]),
        ]);
        let jump = segment(&[
            (1, [1, 0, 1, 1]),
            (5, [1, 1, 1, 1]),
            (2, [0, 1, 1, 1]),
            (5, [0, 0, 1, 1]),
            (1, [0, 0, 0, 1]),
            (5, [0, 0, 0, 0]),
            (2, [1, 0, 0, 0]),
            (5, [1, 1, 1, 1]),
            (1, [1, 1, 0, 0]),
        ]);
        assert_eq!(
            brief(&rule, &jump),
            [
                (0, Stance::Launch, 0..8),
                (1, Stance::Launch, 8..14),
                (2, Stance::Flight, 14..19),
                (0, Stance::Landing, 19..27)
            ]
        );
    }

    #[test]
    fn spans_no_pattern_matches_is_an_error_with_row_and_feet() {
        let rule = PhaseRule::new(vec![pattern("flight", FeetRule::None)]);
        let error = rule.spans(&segment(&[(3, [1, 1, 0, 0])])).unwrap_err();
        let text = error.to_string();
        assert!(matches!(error.kind, RecordingFault::NoPhase { .. }));
        assert_eq!(error.place.row(), Some(2));
        assert!(text.contains("none of the phases `flight`"), "{text}");
    }

    #[test]
    fn spans_chatter_shorter_than_the_minimum_joins_its_neighbour() {
        let jump = segment(&[
            (1, [0; 4]),
            (9, [1; 4]),
            (2, [0; 4]),
            (4, [1; 4]),
            (20, [0; 4]),
            (1, [1; 4]),
            (2, [0; 4]),
        ]);
        let rule = PhaseRule::two_phase().with_min_samples(3);
        assert_eq!(
            brief(&rule, &jump),
            [(0, Stance::Launch, 0..16), (1, Stance::Flight, 16..39)]
        );
        assert_eq!(PhaseRule::two_phase().spans(&jump).unwrap().len(), 7);
    }

    #[test]
    fn spans_single_sample_is_one_span() {
        let rule = PhaseRule::two_phase().with_min_samples(10);
        let one = segment(&[(1, [1; 4])]);
        assert_eq!(brief(&rule, &one), [(0, Stance::Launch, 0..1)]);
    }
}
