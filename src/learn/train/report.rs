//! What came of a training.

use serde::Serialize;

use super::joint::Losses;
use super::metrics::SetMetrics;
use super::select::Choice;
use crate::model::ReducedModel;

#[derive(Clone, Debug)]
pub struct Trained {
    pub model: ReducedModel,
    pub report: TrainReport,
}

/// Figures of a training, as the provenance carries them too.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrainReport {
    /// Coordinates that the encoder looks at.
    pub encoded: Vec<String>,
    /// Share of the input's energy that the latent input cannot carry.
    pub lift_loss: f64,
    pub active_terms: Vec<PhaseTerms>,
    /// The regression that was chosen, where there was a choice.
    pub choice: Option<Choice>,
    pub candidates: usize,
    /// The seeds that were tried, where there were several; the first is the one kept.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub seeds: Vec<SeedReport>,
    /// Mean over pairs of seeds of (coefficients active in both) / (active in either), latent coordinates matched.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub support_overlap: Option<f64>,
    /// How well the deviations of the training jumps from their prior are explained, one entry per part
    /// of a jump; empty without a prior.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub deviations: Vec<PartScore>,
    /// Figures on the training recordings.
    pub training: SetMetrics,
    /// Figures on the validation recordings, if there were any.
    pub validation: Option<SetMetrics>,
}

/// How well the accelerations' deviations in one part of a jump are explained.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PartScore {
    pub part: String,
    /// Coefficient of determination of the deviations from the prior, over all latent coordinates and
    /// jumps, each jump left out of prior and fit in turn; 0 is what the prior alone explains.
    pub ddz_r2: f64,
}

/// Number of coefficients that are not zero in one phase.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct PhaseTerms {
    pub phase: String,
    pub active: usize,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SeedReport {
    pub seed: u64,
    /// What seeds are compared by, less is better: the validation score of rollouts, or with the published method the
    /// combined loss on the validation recordings.
    pub score: f64,
    /// Losses of the last epoch of the first step of a joint training.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub losses: Option<Losses>,
    pub active: usize,
    /// For every latent coordinate the robot coordinate that moves it most on the training jumps.
    pub dominant: Vec<String>,
    /// Figures on the validation recordings, or on the training recordings where there are none.
    pub judged: SetMetrics,
}
