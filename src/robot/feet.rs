//! Rules on which feet are on the ground.

use std::fmt;

use super::joints::ContactFlags;

/// Which foot patterns select a phase.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FeetRule {
    /// At least one foot in contact.
    Any,
    /// No foot in contact.
    None,
    /// Exactly one of these patterns (order fr, fl, rr, rl).
    Patterns(Vec<ContactFlags>),
}

const N_PATTERNS: usize = 16;

impl fmt::Display for FeetRule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let patterns = match self {
            FeetRule::Any => return f.write_str("any"),
            FeetRule::None => return f.write_str("none"),
            FeetRule::Patterns(_) if self.is_always() => return f.write_str("always"),
            FeetRule::Patterns(patterns) => patterns,
        };
        let digits = |feet: &ContactFlags| feet.map(|down| if down { "1" } else { "0" }).concat();
        f.write_str(&patterns.iter().map(digits).collect::<Vec<_>>().join(","))
    }
}

impl FeetRule {
    /// The rule of a phase that holds whatever the feet do: all patterns.
    pub fn always() -> Self {
        FeetRule::Patterns(Self::all_patterns().collect())
    }

    /// From no foot to four feet.
    pub fn all_patterns() -> impl Iterator<Item = ContactFlags> {
        (0..N_PATTERNS).map(|code| std::array::from_fn(|foot| (code >> foot) & 1 == 1))
    }

    /// Whether it is the rule of all patterns, each in it once.
    pub fn is_always(&self) -> bool {
        matches!(self, FeetRule::Patterns(patterns) if patterns.len() == N_PATTERNS)
    }

    /// Whether the rule names this pattern.
    pub fn matches(&self, feet: ContactFlags) -> bool {
        match self {
            FeetRule::Any => feet.contains(&true),
            FeetRule::None => !feet.contains(&true),
            FeetRule::Patterns(patterns) => patterns.contains(&feet),
        }
    }
}
