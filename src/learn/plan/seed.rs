//! The trajectory that a plan starts from, and the model about it.

use super::*;
use crate::lower::CompiledModel;

pub(crate) const PITCH: usize = 16;
const LOST_ANGLE_RAD: f64 = 0.15;
/// Differences of the start to its decoded one from which on they are reported.
const LOST_PLACE_M: f64 = 0.03;

pub(crate) struct Seed<'a> {
    pub prior: &'a JumpPrior,
    pub rule: InputRule,
    pub latent_dim: usize,
    pub goal: Goal,
    pub start: [DVector<f64>; 2],
    pub start_lost: Vec<String>,
    pub decode: DMatrix<f64>, // x = decode z + decode_bias, SI units
    pub decode_bias: DVector<f64>,
    pub lift: DMatrix<f64>, // u = lift u_lat, SI units
    pub parts: Vec<SeedPart<'a>>,
}

/// A part of the prior at the clipped goal; vectors in scaled units, one per node or interval.
pub(crate) struct SeedPart<'a> {
    pub part: &'a JumpPart,
    pub landmark: &'a Landmark,
    pub phase: usize,
    pub duration_s: f64,
    pub z: Vec<DVector<f64>>,
    pub dz: Vec<DVector<f64>>,
    pub u_lat: Vec<DVector<f64>>,
    pub ddz: Vec<DVector<f64>>,
    pub drift: Vec<DVector<f64>>,
    /// `d ddz / d (zeta, nu, mu)` at each node, in the program's variables, `latent_dim x 3 latent_dim`.
    pub slope: Vec<DMatrix<f64>>,
    pub root: DMatrix<f64>, // lower Cholesky factor of the input covariance: u_lat = prior + root mu
}

impl SeedPart<'_> {
    pub(crate) fn intervals(&self) -> usize {
        self.z.len() - 1
    }

    pub(crate) fn is_grounded(&self) -> bool {
        self.landmark.is_grounded()
    }
}

impl<'a> Seed<'a> {
    pub(crate) fn new(
        model: &'a ReducedModel,
        goal: &Goal,
        settings: &PlanSettings,
    ) -> Result<Self> {
        let prior = model.jump_prior()?;
        let mean = &prior.landmarks.start;
        let at_rest = || (mean.clone(), DVector::zeros(mean.len()));
        let start = goal.start.clone().unwrap_or_else(at_rest);
        let height = start.0[BODY_Z];
        goal.check_within(prior, height, settings.reach)?;
        let features = prior.features(goal.clipped(prior, height, settings.inset));
        let tangent = model.tangent(&start.0)?;
        let mut dynamics = CompiledModel::new(model)?;
        let parts = (0..prior.parts.len())
            .map(|part| seed_part(model, prior, part, &features, &mut dynamics))
            .collect();
        let zero = DVector::zeros(model.latent_dim());
        let latent = model.encode(&start.0)?;
        let start_lost = match goal.start {
            Some(_) => lost(&start.0, &model.decode(&latent)?),
            None => Vec::new(),
        };
        Ok(Self {
            start_lost,
            prior,
            rule: model.input_rule()?,
            latent_dim: model.latent_dim(),
            goal: goal.clone(),
            start: [latent, &tangent.encode * &start.1],
            decode: model.decoder_jacobian(&zero)?,
            decode_bias: model.decode(&zero)?,
            lift: tangent.lift,
            parts,
        })
    }

    pub(crate) fn decoded(&self, z: &DVector<f64>) -> [f64; STATE_DIM] {
        let x = &self.decode * z + &self.decode_bias;
        std::array::from_fn(|i| x[i])
    }
}

/// The three coordinates that encoding and decoding moves farthest beyond the limits.
fn lost(x: &DVector<f64>, decoded: &DVector<f64>) -> Vec<String> {
    let mut far: Vec<(f64, String)> = Vec::new();
    for (row, (&given, &held)) in x.iter().zip(decoded).enumerate() {
        let (name, unit, most) = match row.checked_sub(JOINT_DIM) {
            None => (JOINT_NAMES[row], "rad", LOST_ANGLE_RAD),
            Some(i) if i < 3 => (BODY_NAMES[i], "m", LOST_PLACE_M),
            Some(i) => (BODY_NAMES[i], "rad", LOST_ANGLE_RAD),
        };
        let share = (given - held).abs() / most;
        if share > 1.0 {
            let text = format!("{name} {given:.3} {unit} is planned as {held:.3} {unit}");
            far.push((share, text));
        }
    }
    far.sort_by(|a, b| b.0.total_cmp(&a.0));
    far.into_iter().map(|(_, text)| text).take(3).collect()
}

fn seed_part<'a>(
    model: &ReducedModel,
    prior: &'a JumpPrior,
    part: usize,
    features: &[f64; crate::model::FEATURE_DIM],
    dynamics: &mut CompiledModel,
) -> SeedPart<'a> {
    let (part, landmark) = (&prior.parts[part], &prior.landmarks.parts[part]);
    let phase = (model.phase_for(landmark.feet)).expect("invariant: checked with the model");
    let table = |rows: &DMatrix<f64>| -> Vec<DVector<f64>> {
        let nodes = 0..part.nodes();
        (nodes.map(|node| JumpPart::at(rows, node, features))).collect()
    };
    let (z, dz, u_lat) = (table(&part.z), table(&part.dz), table(&part.u_lat));
    let [least, most] = landmark.duration_range_s;
    let duration_s = part.duration(features).clamp(0.5 * least, 2.0 * most);
    let step = duration_s / (part.nodes() - 1) as f64;
    let rate = |rows: &[DVector<f64>], k: usize| (&rows[k + 1] - &rows[k]) / step;
    let mean = |k: usize| (&dz[k] + &dz[k + 1]) * 0.5;
    let intervals = 0..part.nodes() - 1;
    let ddz = intervals.clone().map(|k| rate(&dz, k)).collect();
    let drift = intervals.map(|k| rate(&z, k) - mean(k)).collect();
    let root = (part.input_covariance.clone().cholesky())
        .expect("invariant: checked with the model")
        .unpack();
    let d = model.latent_dim();
    let scales = scales(prior, &root, d);
    let slope = (0..part.nodes()).map(|node| {
        let by_latent = match &part.xi {
            Some(xi) => xi.transpose(),
            None => {
                let (mut value, mut jacobian) = (vec![0.0; d], DMatrix::zeros(d, 3 * d));
                let [z, dz, u_lat] = [&z[node], &dz[node], &u_lat[node]].map(|v| v.as_slice());
                dynamics.jacobian(phase, z, dz, u_lat, &mut value, &mut jacobian);
                jacobian
            }
        };
        by_latent * &scales
    });
    let slope = slope.collect();
    SeedPart {
        part,
        landmark,
        phase,
        duration_s,
        z,
        dz,
        u_lat,
        ddz,
        drift,
        slope,
        root,
    }
}

fn scales(prior: &JumpPrior, root: &DMatrix<f64>, d: usize) -> DMatrix<f64> {
    let mut scales = DMatrix::zeros(3 * d, 3 * d);
    for i in 0..2 * d {
        scales[(i, i)] = prior.state_std[i];
    }
    scales.view_mut((2 * d, 2 * d), (d, d)).copy_from(root);
    scales
}
