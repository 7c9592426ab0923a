//! Joint training of encoder, decoder and dynamics by Adam, as published and improved.
//!
//! Enters: recordings and [`JointOptions`](super::JointOptions). Leaves: a trained model. Read `loss` first (equations
//! 9 to 20 and their gradient), which asks [`linear`] or [`nonlinear`] maps for encoding and decoding, then [`stages`]
//! (the transfer steps of section IV-D) and [`joint`] (seeds, choice, assembly).

mod batch;
mod linear;
mod loss;
mod network;
mod nonlinear;
mod parameters;
mod projection;
mod stages;
mod unroll;

mod descent;
mod fold;
mod multiply;
mod run;

pub use descent::Schedule;
pub use loss::{LossWeights, Losses};
pub use run::joint;
pub use unroll::{Integrator, Unroll};
