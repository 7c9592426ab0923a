//! How good a model is on a set of jumps, and the report of a training.

use super::dataset::Scaling;
use super::latent::map_samples;
use super::*;
use crate::sim::phase_rule;

pub(super) const PLACE: [usize; 3] = [BODY_X, BODY_X + 1, YAW]; // place and heading: x, y, yaw
const SHORT_S: f64 = 0.1;
const SMOOTHING: usize = 11; // samples, of the accelerations behind `ddz_r2`

#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SetMetrics {
    /// Mean square of `x - decode(encode(x))` over samples and coordinates, scaled units.
    pub decoder_mse: f64,
    /// Coefficient of determination of the smoothed `ddz` in each phase, over all latent coordinates together.
    pub ddz_r2: Vec<f64>,
    /// Coefficient of determination of the torques of `W_e^T pinv(W_e^T) u` (`J^T pinv(J^T) u`) and the joints' losses,
    /// over all plausible samples and joints, as in the lift of an [`Assessment`](crate::evaluate::Assessment).
    pub torque_r2: f64,
    /// Root mean square error of body x over predictions of 0.1 s with fixed steps.
    pub prediction_x_m: f64,
    pub prediction_z_m: f64,
    /// Root mean square error of body x over rollouts of whole jumps with fixed steps; `None` when one diverges.
    pub rollout_x_m: Option<f64>,
    pub rollout_z_m: Option<f64>,
}

/// Measures a finished model on recordings.
///
/// # Errors
/// [`TrainError`] if the model has no encoder, decoder, scaling or robot, or the recordings do not fit it.
pub fn assess(model: &ReducedModel, recordings: &[Recording]) -> Result<SetMetrics> {
    let scaling = Scaling {
        state: model.state_factors()?,
        input: model.input_factors()?,
    };
    let dataset = Dataset::new(
        recordings,
        &model.input_rule()?,
        &phase_rule(model),
        &scaling,
        SMOOTHING,
    )?;
    let features = Features::new(model.library());
    let xi: Vec<_> = (model.phases().iter().map(|phase| phase.xi.clone())).collect();
    let candidate = Candidate {
        features: &features,
        xi: &xi,
    };
    let maps = [model.encoder_map()?, model.decoder_map()?];
    let latent = Latent::of(&dataset, maps[0]);
    Ok(measure(candidate, maps, EncodedSet::new(&dataset, &latent)))
}

pub(super) fn measure(
    candidate: Candidate<'_>,
    [encoder, decoder]: [&StateMap; 2],
    set: EncodedSet<'_>,
) -> SetMetrics {
    let rms = |restart| body_rms(candidate, decoder, set, &windows(set.dataset, restart));
    let [prediction_x_m, prediction_z_m] = rms(Restart::Every(SHORT_S));
    let [rollout_x_m, rollout_z_m] = rms(Restart::Never);
    let phases = 0..set.dataset.phases.patterns.len();
    SetMetrics {
        decoder_mse: decoder_mse(decoder, set),
        ddz_r2: phases.map(|phase| ddz_r2(candidate, set, phase)).collect(),
        torque_r2: torque_r2(encoder, set),
        prediction_x_m,
        prediction_z_m,
        rollout_x_m: rollout_x_m.is_finite().then_some(rollout_x_m),
        rollout_z_m: rollout_z_m.is_finite().then_some(rollout_z_m),
    }
}

fn body_rms(
    candidate: Candidate<'_>,
    decoder: &StateMap,
    set: EncodedSet<'_>,
    windows: &[Window],
) -> [f64; 2] {
    let predictions = predict(candidate, set, &plain(windows));
    let mut squares = [0.0; 2];
    let mut count = 0;
    for (window, prediction) in windows.iter().zip(&predictions) {
        let decoded = map_samples(decoder, prediction);
        let x = &set.dataset.jumps[window.jump].x;
        let truth = x.columns(window.start + 1, window.steps);
        for (square, row) in squares.iter_mut().zip([BODY_X, BODY_Z]) {
            *square += (decoded.row(row) - truth.row(row)).norm_squared();
        }
        count += window.steps;
    }
    let rms = squares.map(|square| (square / count.max(1) as f64).sqrt());
    let scale = &set.dataset.scaling.state;
    [rms[0] / scale[BODY_X], rms[1] / scale[BODY_Z]]
}

fn decoder_mse(decoder: &StateMap, set: EncodedSet<'_>) -> f64 {
    let (mut square, mut count) = (0.0, 0);
    for (jump, samples) in set.dataset.jumps.iter().zip(set.latent) {
        square += (map_samples(decoder, &samples.z) - &jump.x).norm_squared();
        count += jump.x.len();
    }
    square / count.max(1) as f64
}

fn ddz_r2(candidate: Candidate<'_>, set: EncodedSet<'_>, phase: usize) -> f64 {
    let (variables, target) = set.regression_samples(phase);
    let theta = (candidate.features).evaluate(&variables, &mut FeatureValues::default());
    let predicted = (theta * &candidate.xi[phase]).transpose();
    determination(&predicted, &target.transpose())
}

fn torque_r2(encoder: &StateMap, set: EncodedSet<'_>) -> f64 {
    let (mut predicted, mut recorded) = (Vec::new(), Vec::new());
    for (jump, samples) in set.dataset.jumps.iter().zip(set.latent) {
        let lift = lift_samples(encoder, &jump.x, &samples.u_lat);
        for sample in (0..jump.samples()).filter(|sample| !jump.implausible.contains(sample)) {
            predicted.extend(recorded_torque(&lift, jump, sample).iter());
            recorded.extend(recorded_torque(&jump.u, jump, sample).iter());
        }
    }
    let columns = |values: Vec<f64>| DMatrix::from_vec(JOINT_DIM, values.len() / JOINT_DIM, values);
    determination(&columns(predicted), &columns(recorded))
}

/// The motors' torques of a sample for inputs `u`: those at the links, joint friction and rotor inertia.
fn recorded_torque(u: &DMatrix<f64>, jump: &Jump, sample: usize) -> DVector<f64> {
    let net = u.view((0, sample), (JOINT_DIM, 1)).column(0).into_owned();
    match &jump.losses {
        None => net,
        Some(losses) => net + losses.column(sample),
    }
}

/// Coefficient of determination of samples in columns, over all rows together, each about its mean.
fn determination(predicted: &DMatrix<f64>, truth: &DMatrix<f64>) -> f64 {
    let mean = mean(truth);
    let (mut residual, mut spread) = (0.0, 0.0);
    for (predicted, truth) in predicted.column_iter().zip(truth.column_iter()) {
        residual += (predicted - truth).norm_squared();
        spread += (truth - &mean).norm_squared();
    }
    1.0 - residual / f64::max(spread, f64::MIN_POSITIVE)
}

#[derive(Clone, Debug)]
pub struct Trained {
    pub model: ReducedModel,
    pub report: TrainReport,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrainReport {
    pub encoded: Vec<String>,
    /// Share of the input's energy that the latent input cannot carry.
    pub lift_loss: f64,
    pub active_terms: Vec<PhaseTerms>,
    pub choice: Option<Choice>,
    pub candidates: usize,
    /// The seeds that were tried, where there were several; the first is the one kept.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub seeds: Vec<SeedReport>,
    /// Mean over pairs of seeds of (coefficients active in both) / (active in either), latent coordinates matched.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub support_overlap: Option<f64>,
    /// Of the parts of the training jumps' prior; empty without one.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub deviations: Vec<PartScore>,
    pub training: SetMetrics,
    pub validation: Option<SetMetrics>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PartScore {
    pub part: String,
    /// R^2 of the accelerations' deviations from the prior, each jump left out of prior and fit in turn.
    pub ddz_r2: f64,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct PhaseTerms {
    pub phase: String,
    pub active: usize,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SeedReport {
    pub seed: u64,
    /// Less is better: validation score of rollouts, or as published the combined loss on the validation recordings.
    pub score: f64,
    /// Losses of the last epoch of the first step of a joint training.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) losses: Option<Losses>,
    pub active: usize,
    /// For every latent coordinate the robot coordinate that moves it most on the training jumps.
    pub dominant: Vec<String>,
    /// Figures on the validation recordings, or on the training recordings where there are none.
    pub judged: SetMetrics,
}
