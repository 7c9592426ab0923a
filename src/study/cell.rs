//! The outcome of one training of a study.

use serde::{Deserialize, Serialize};

use super::plan::CellId;
use crate::evaluate::combined_loss;
use crate::train::{SetMetrics, TrainReport};

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Cell {
    pub id: CellId,
    pub outcome: Outcome,
}

/// Metrics, or the reason why there are none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Outcome {
    Trained(Metrics),
    /// Training refused, for this reason; the same settings would refuse again.
    Refused(String),
}

/// Metrics of one model, on the validation jumps where there are any, else on the training jumps.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Metrics {
    /// Mean square of `x - decode(encode(x))`, scaled units (16).
    pub decoder_mse: f64,
    /// Active coefficients in the first phase (contact), as the paper counts them.
    pub active: usize,
    /// Active coefficients over all phases.
    pub active_all_phases: usize,
    /// Coefficient of determination of the joint torques of the plain lift from projected inputs.
    pub torque_r2: f64,
    /// Root mean square error of body x over predictions of 0.1 s, m.
    pub prediction_x_m: f64,
    pub prediction_z_m: f64,
}

impl Metrics {
    pub(crate) fn of(report: &TrainReport) -> Self {
        let set: &SetMetrics = report.validation.as_ref().unwrap_or(&report.training);
        let active = report.active_terms.iter().map(|phase| phase.active);
        Self {
            decoder_mse: set.decoder_mse,
            active: active.clone().next().unwrap_or(0),
            active_all_phases: active.sum(),
            torque_r2: set.torque_r2,
            prediction_x_m: set.prediction_x_m,
            prediction_z_m: set.prediction_z_m,
        }
    }

    pub(crate) fn is_finite(&self) -> bool {
        let [x, z] = [self.prediction_x_m, self.prediction_z_m];
        let values = [x, z, self.decoder_mse, self.torque_r2];
        values.into_iter().all(f64::is_finite)
    }

    /// `L_mod = 2 E_dec + 2 lambda ln |Xi|` (29), over the active coefficients of all phases; without any, the
    /// logarithm counts as 0.
    pub(crate) fn combined_loss(&self, lambda: f64) -> f64 {
        combined_loss(self.decoder_mse, self.active_all_phases.max(1), lambda)
            .expect("at least one coefficient")
    }
}
