//! Joint training of encoder, decoder and dynamics by Adam, as published and improved.
//!
//! Enters: recordings and [`JointOptions`](super::JointOptions). Leaves: a trained model. Read [`loss`] first (equations
//! 9 to 20 and their gradient), which asks [`linear`] or [`nonlinear`] maps for encoding and decoding, then [`stages`]
//! (the transfer steps of section IV-D) and [`joint`] (seeds, choice, assembly).

pub mod batch;
pub mod linear;
pub mod loss;
pub mod network;
pub mod nonlinear;
pub mod parameters;
pub mod projection;
pub mod stages;
pub mod unroll;

mod adam;
mod fold;
mod multiply;
mod run;
mod schedule;

pub use loss::{LossWeights, Losses};
pub use run::joint;
pub use schedule::Schedule;
pub use unroll::{Integrator, Unroll};
