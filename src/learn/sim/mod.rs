//! Integration of the hybrid model: a model and recorded inputs in, rollouts out. Read `rollout` first, then
//! `integrate`.

pub(crate) mod integrate;
#[cfg(test)]
#[path = "../../../tests/evaluate/integrate.rs"]
mod integrate_tests;
mod rollout;
#[cfg(test)]
#[path = "../../../tests/evaluate/rollout.rs"]
mod rollout_tests;

pub use rollout::{
    LatentSegment, Restart, Rollout, SimError, Window, rollout, with_input_statistics,
};
pub(crate) use rollout::{integrate_stretches, phase_rule, restart_windows, rollout_over};
