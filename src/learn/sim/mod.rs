//! Integration of the hybrid model: a model and recorded inputs in, rollouts out. Read `rollout` first, then
//! `integrate`.

#![allow(missing_docs, reason = "names say it all where there is no comment")]

mod integrate;
mod rollout;

pub use integrate::{Integration, IntegrationMethod, IntegrationOptions, OdeSystem, integrate};
pub use rollout::{
    LatentSegment, Restart, Rollout, SimError, Window, rollout, with_input_statistics,
};
pub(crate) use rollout::{integrate_stretches, phase_rule, restart_windows};
