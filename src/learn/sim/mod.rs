//! Integration of the hybrid model.
//!
//! A model and recorded inputs come in; rollouts leave. `rollout.rs` first, `integrate.rs` for the method, `latent.rs`
//! for how a recording is encoded.

#![allow(missing_docs, reason = "names say it all where there is no comment")]

mod integrate;
mod latent;
mod rollout;

pub use integrate::{Integration, IntegrationMethod, IntegrationOptions, OdeSystem, integrate};
pub(crate) use latent::phase_rule;
pub use latent::{LatentSegment, SimError, with_input_statistics};
pub use rollout::{Restart, Rollout, Window, rollout};
pub(crate) use rollout::{integrate_stretches, restart_windows};
