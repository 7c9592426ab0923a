//! Contact phases: which feet are down, and for how long. A rule is a list of named foot patterns, the first match
//! wins, as in the model file. With the paper's two phases, samples with one to three feet down count as contact and so
//! join the launch or the landing they border (section IV-C4). Three phases describe an asynchronous jump.

pub use crate::robot::PhasePattern;

use super::*;

/// Fewest samples of a span: fewer are chatter of contact and join the span before them.
pub const CHATTER_SAMPLES: usize = 5;

/// How samples are assigned to phases.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PhaseRule {
    /// Patterns; the first match wins.
    pub patterns: Vec<PhasePattern>,
    /// Spans of fewer samples join the span before them (chatter of contact).
    pub min_samples: usize,
}

/// Place of a span in a jump.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Stance {
    /// Contact before any flight; a segment without flight is all launch.
    Launch,
    /// No foot down.
    Flight,
    /// Contact after a flight.
    Landing,
}

/// Consecutive samples of a segment of one phase, by its index in [`PhaseRule::patterns`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PhaseSpan {
    pub phase: usize,
    pub kind: Stance,
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
        Self::named([("contact", FeetRule::Any), ("flight", FeetRule::None)])
    }

    fn named<const N: usize>(patterns: [(&str, FeetRule); N]) -> Self {
        let pattern = |(name, feet): (&str, FeetRule)| PhasePattern {
            name: name.to_owned(),
            feet,
        };
        Self::new(patterns.map(pattern).into())
    }

    fn read<const N: usize>(patterns: [&str; N]) -> Self {
        Self::new(
            patterns
                .map(|text| text.parse().expect("a known pattern"))
                .into(),
        )
    }

    /// The asynchronous jump: `contact` (a front foot is down), `rear` (only rear feet), `flight` (none).
    pub fn three_phase() -> Self {
        let all = (0..16).map(|bits: u8| std::array::from_fn(|foot| bits & (1 << foot) != 0));
        let down = all.filter(|feet: &ContactFlags| feet.contains(&true));
        let (rear, front) = down.partition(|feet| !feet[0] && !feet[1]);
        Self::named([
            ("contact", FeetRule::Patterns(front)),
            ("rear", FeetRule::Patterns(rear)),
            ("flight", FeetRule::None),
        ])
    }

    /// A trot: `fr_rl` and `fl_rr`, the diagonal pairs or one foot of them, `all` for every other contact, and
    /// `flight`.
    pub fn trot() -> Self {
        let pairs = ["fr_rl=1001,1000,0001", "fl_rr=0110,0100,0010"];
        Self::read([pairs[0], pairs[1], "all=any", "flight=none"])
    }

    /// A crawl: a phase for each foot in the air, and `all` for every other contact.
    pub fn crawl() -> Self {
        let up = ["fr_up=0111", "fl_up=1011", "rr_up=1101", "rl_up=1110"];
        Self::read([up[0], up[1], up[2], up[3], "all=any"])
    }

    /// The rule with spans under `min_samples` joined to the span before them.
    pub fn with_min_samples(mut self, min_samples: usize) -> Self {
        self.min_samples = min_samples;
        self
    }

    /// The rule without phases of fewer samples than these in recordings, and those phases with their samples.
    ///
    /// # Errors
    /// [`RecordingError`] if a segment matches no phase.
    pub fn without_rare(
        mut self,
        recordings: &[Recording],
        least: usize,
    ) -> Outcome<(Self, Vec<(String, usize)>)> {
        let mut counts = vec![0; self.patterns.len()];
        for segment in recordings.iter().flat_map(|each| &each.segments) {
            for span in self.spans(segment)? {
                counts[span.phase] += span.range.len();
            }
        }
        let mut rare = Vec::new();
        let mut counts = counts.into_iter();
        self.patterns.retain(|pattern| {
            let count = counts.next().unwrap_or(0);
            if count < least {
                rare.push((pattern.name.clone(), count));
            }
            count >= least
        });
        Ok((self, rare))
    }

    pub fn names(&self) -> Vec<String> {
        self.patterns.iter().map(|p| p.name.clone()).collect()
    }

    /// Index of the first pattern that matches, if any does.
    pub fn phase_of(&self, feet: ContactFlags) -> Option<usize> {
        self.patterns.iter().position(|p| p.feet.matches(feet))
    }

    /// The spans of a segment, in order and without gaps. A run that matches no pattern (transitional, under a rule of
    /// exact patterns) joins the neighbour with more feet down, on a tie the one before it.
    ///
    /// # Errors
    /// [`RecordingError`] if no sample matches any pattern.
    pub fn spans(&self, segment: &Segment) -> Outcome<Vec<PhaseSpan>> {
        let feet = &segment.feet;
        let mut phases: Vec<Option<usize>> = feet.iter().map(|f| self.phase_of(*f)).collect();
        if phases.iter().all(Option::is_none) {
            let Some(&feet) = feet.first() else {
                return Ok(Vec::new());
            };
            let phases = listed(&self.names(), 8);
            let words = format!("feet {feet:?} (fr, fl, rr, rl) match none of the phases {phases}");
            return Err(text(words).at(&segment.path, segment.row(0)));
        }
        assign_transitional(&mut phases, feet);
        let phases: Vec<usize> = phases.into_iter().flatten().collect();
        let runs = stretches(0..phases.len(), |a, b| phases[a] == phases[b]).into_iter();
        let runs = runs.map(|range| (phases[range.start], range));
        let runs = merge_short(runs, self.min_samples);
        Ok(with_stance(runs, feet))
    }
}

fn feet_down(feet: ContactFlags) -> usize {
    feet.iter().filter(|down| **down).count()
}

/// Gives runs of samples without phase that of a neighbour, of which at least one has a phase.
fn assign_transitional(phases: &mut [Option<usize>], feet: &[ContactFlags]) {
    let alike = |a: usize, b: usize| phases[a].is_some() == phases[b].is_some();
    for run in stretches(0..phases.len(), alike) {
        if phases[run.start].is_some() {
            continue;
        }
        let before = run.start.checked_sub(1);
        let after = (run.end < phases.len()).then_some(run.end);
        let down = |sample: Option<usize>| sample.map(|sample| feet_down(feet[sample]));
        let joined = after.filter(|_| down(after) > down(before)).or(before);
        let phase = joined.and_then(|sample| phases[sample]);
        phases[run].fill(phase);
    }
}

type Run = (usize, Range<usize>);

fn merge_short(runs: impl Iterator<Item = Run>, min_samples: usize) -> Vec<Run> {
    let mut out: Vec<Run> = Vec::new();
    for (phase, range) in runs {
        match out.last_mut() {
            // A short first run has nothing before it and joins the next run.
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
    let span = |(phase, range): Run| {
        let own = feet[range.clone()].iter(); // most samples decide: a span may have swallowed chatter
        let airborne = own.filter(|feet| feet_down(**feet) == 0).count();
        let flies = 2 * airborne > range.len();
        flown |= flies;
        let kind = match (flies, flown) {
            (true, _) => Stance::Flight,
            (false, true) => Stance::Landing,
            (false, false) => Stance::Launch,
        };
        PhaseSpan { phase, kind, range }
    };
    runs.into_iter().map(span).collect()
}
