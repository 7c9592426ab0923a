//! Integration of the hybrid model.
//!
//! A model and recorded inputs come in; rollouts leave. `rollout.rs` first, `compiled.rs` for what is
//! integrated (a model's programs, run by the interpreter), `integrate.rs` for the method, `latent.rs`
//! for how a recording is encoded.

mod compiled;
mod error;
mod inputs;
mod integrate;
mod latent;
mod rollout;

pub use compiled::CompiledModel;
pub use error::SimError;
pub use inputs::input_statistics;
pub use integrate::{Integration, IntegrationMethod, IntegrationOptions, integrate};
pub use latent::LatentSegment;
pub use rollout::{Restart, Rollout, Window, restart_windows, rollout};
