//! What came of a training.

use serde::{Deserialize, Serialize};

use super::metrics::SetMetrics;
use super::select::Choice;
use crate::model::ReducedModel;

/// A trained model and its figures.
#[derive(Clone, Debug)]
pub struct Trained {
    /// The model, with the provenance filled in.
    pub model: ReducedModel,
    /// The figures.
    pub report: TrainReport,
}

/// Figures of a training, as the provenance carries them too.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrainReport {
    /// Coordinates that the encoder looks at.
    pub encoded: Vec<String>,
    /// Share of the input's energy that the latent input cannot carry.
    pub lift_loss: f64,
    /// Active terms of every phase.
    pub active_terms: Vec<PhaseTerms>,
    /// The regression that was chosen.
    pub choice: Choice,
    /// Candidates tried.
    pub candidates: usize,
    /// Figures on the training recordings.
    pub training: SetMetrics,
    /// Figures on the validation recordings, if there were any.
    pub validation: Option<SetMetrics>,
}

/// Number of coefficients that are not zero in one phase.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PhaseTerms {
    /// Name of the phase.
    pub phase: String,
    /// Active terms.
    pub active: usize,
}
