//! Integration of the hybrid model.
//!
//! A model and recorded inputs come in; rollouts leave. `rollout.rs` first, `integrate.rs` for the method.

#![allow(missing_docs, reason = "names say it all where there is no comment")]

mod integrate;
mod rollout;

pub use integrate::{Integration, IntegrationMethod, IntegrationOptions, OdeSystem, integrate};
pub use rollout::{
    LatentSegment, Restart, Rollout, SimError, Window, rollout, with_input_statistics,
};
pub(crate) use rollout::{integrate_stretches, phase_rule, restart_windows};
