//! Rules on which feet are on the ground.

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

impl FeetRule {
    /// Whether the rule names this pattern.
    ///
    /// ```
    /// use romc::robot::FeetRule;
    ///
    /// let rear_pair = FeetRule::Patterns(vec![[false, false, true, true]]);
    /// assert!(rear_pair.matches([false, false, true, true]));
    /// assert!(!rear_pair.matches([true; 4]));
    /// assert!(FeetRule::Any.matches([true, false, false, false]));
    /// assert!(FeetRule::None.matches([false; 4]));
    /// ```
    pub fn matches(&self, feet: ContactFlags) -> bool {
        match self {
            FeetRule::Any => feet.contains(&true),
            FeetRule::None => !feet.contains(&true),
            FeetRule::Patterns(patterns) => patterns.contains(&feet),
        }
    }
}
