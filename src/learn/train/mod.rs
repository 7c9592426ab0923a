//! Learning: recordings in, a reduced-order model with its figures out.
//!
//! Enters: recordings of jumps, a robot, [`TrainOptions`]. Leaves: a [`Trained`] model, whose provenance says how to
//! repeat it, and a [`TrainReport`]. Read [`closed_form()`] first: it walks from the dataset over the encoder's row
//! space (`subspace`, `varimax`) and the decoder (`latent`) to the dynamics (`weak_form`, `sparse`, `select`),
//! judged by rollouts.

#![allow(missing_docs, reason = "names say it all where there is no comment")]

mod closed_form;
mod dataset;
mod features;
mod frame;
mod growth;
mod joint;
mod jumps;
mod knowledge;
mod latent;
mod metrics;
mod progress;
mod rollout;
mod select;
mod sparse;
mod subspace;
mod varimax;
mod weak_form;

mod assemble;
mod dynamics_fit;
mod error;
mod judge;
mod options;
#[cfg(test)]
mod oscillator;
mod overlap;
mod prune;
mod random;
mod refine;
mod report;
mod seeds;
mod split;
mod task;
mod thin;
mod vectors;

pub use assemble::{Origin, SourceFile, sha256};
pub use closed_form::closed_form;
pub use dataset::{MIN_SAMPLES, ScaleOptions};
pub use error::TrainError;
pub use joint::{Integrator, Unroll, joint};
pub use metrics::{SetMetrics, assess};
pub use options::{
    Coordinates, EncoderOptions, JointOptions, MapOptions, Method, RegressionOptions, TrainOptions,
    Transfer,
};
pub use progress::{Monitor, Progress};
pub use report::{PartScore, PhaseTerms, SeedReport, TrainReport, Trained};
pub use split::Split;
pub use task::Recordings;
