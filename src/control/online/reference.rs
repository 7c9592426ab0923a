//! The trajectory that the controller follows, in latent coordinates.

use super::control_model::ControlModel;
use super::dense::first_undefined;
use super::error::ControlError;
use super::settings::MpcSettings;
use super::trajectory::{EARLY_S, Instant, NO_PHASE, Trajectory, write_between, write_still};
use super::walk::Walk;
use crate::robot::{BODY_X, ContactFlags, FOOT_DIM, JOINT_DIM, STATE_DIM, YAW};

const PLACE: [usize; 3] = [BODY_X, BODY_X + 1, YAW];

/// A trajectory in SI units as its user has it: samples one after the other.
#[derive(Debug, Clone, Copy)]
pub struct ReferenceSamples<'a> {
    /// Time of each sample, s, increasing.
    pub time_s: &'a [f64],
    /// States, 18 values per sample.
    pub x: &'a [f64],
    /// Velocities, 18 values per sample.
    pub dx: &'a [f64],
    /// Generalised inputs (12 torques, force, moment), 18 values per sample, if they are known; the controller
    /// estimates them if not.
    pub u: Option<&'a [f64]>,
    /// Feet in contact.
    pub feet: &'a [ContactFlags],
}

/// An encoded trajectory that can be sampled at any time.
///
/// Between samples positions and velocities are interpolated linearly; before the first sample and after the last the
/// end is held at rest.
#[derive(Debug, Clone)]
pub struct Reference {
    latent_dim: usize,
    time_s: Vec<f64>,
    /// `(z, dz)` a sample.
    state: Vec<f64>,
    /// Latent input of each sample, the trajectory's own or an estimate.
    pub(super) input: Option<Vec<f64>>,
    /// Phase of each sample's feet.
    phase: Vec<usize>,
    feet: Vec<ContactFlags>,
    /// Robot states and their rates, 18 per sample.
    x: Vec<f64>,
    dx: Vec<f64>,
    /// Torques at the links, 12 per sample, N m, if the trajectory has an input of its own.
    torque_nm: Option<Vec<f64>>,
    deviation: Vec<f64>,
    /// Whether it is the window of a walk.
    pub(super) is_walk: bool,
}

impl Reference {
    /// Encodes a trajectory.
    pub(crate) fn new(
        plant: &ControlModel,
        samples: ReferenceSamples<'_>,
        settings: &MpcSettings,
    ) -> Result<Self, ControlError> {
        check(plant, &samples)?;
        let d = plant.latent_dim();
        let count = samples.time_s.len();
        let mut state = vec![0.0; count * 2 * d];
        for (sample, encoded) in state.chunks_exact_mut(2 * d).enumerate() {
            let (z, dz) = encoded.split_at_mut(d);
            plant.encode(row(samples.x, sample), z);
            plant.encode_velocity(row(samples.x, sample), row(samples.dx, sample), dz);
        }
        let phase = |&feet| plant.phase_for(feet).expect("phases were checked");
        let mut reference = Self {
            latent_dim: d,
            is_walk: false,
            deviation: vec![0.0; 2 * d],
            state,
            input: samples.u.map(|u| project_all(plant, samples.x, u)),
            time_s: samples.time_s.to_vec(),
            phase: samples.feet.iter().map(phase).collect(),
            feet: samples.feet.to_vec(),
            x: samples.x.to_vec(),
            dx: samples.dx.to_vec(),
            torque_nm: samples.u.map(|u| {
                let rows = u.chunks_exact(STATE_DIM);
                rows.flat_map(|u| &u[..JOINT_DIM]).copied().collect()
            }),
        };
        let [lower, upper] = plant.joint_limits();
        let decoder = plant.decoder.rows(0, JOINT_DIM).transpose();
        let (mut still, mut deviation) = (vec![0.0; 2 * d], vec![0.0; 2 * d]);
        write_still(decoder.as_slice(), &lower, &upper, d, &mut still);
        reference.write_deviations(&still, &mut deviation);
        let place = PLACE.map(|row| plant.encoder.column(row));
        let place: Vec<f64> = (0..d).flat_map(|k| place.map(|of| of[k])).collect();
        let [place_m, heading_rad] =
            [settings.place_scale_m, settings.heading_scale_rad].map(Option::unwrap_or_default);
        reference.write_place_scales(&place, place_m, heading_rad, &mut deviation);
        reference.deviation = deviation;
        Ok(reference)
    }

    /// Uses the samples of a walk, of which the last ones are new.
    pub(super) fn take_window(&mut self, plant: &ControlModel, walk: &Walk, new: usize) {
        let (d, count, walker) = (self.latent_dim, self.time_s.len(), &walk.walker);
        self.is_walk = true;
        self.time_s.copy_from_slice(&walker.time_s);
        self.x.copy_from_slice(&walker.x);
        self.dx.copy_from_slice(&walker.dx);
        self.state.copy_within(2 * d * new.min(count).., 0);
        // The velocity of the last of the other samples has changed as well.
        for sample in count.saturating_sub(new + 1)..count {
            let (x, dx) = (row(&walker.x, sample), row(&walker.dx, sample));
            let (z, rate) = self.state[2 * d * sample..][..2 * d].split_at_mut(d);
            plant.encode(x, z);
            plant.encode_velocity(x, dx, rate);
        }
        for sample in 0..count {
            self.feet[sample] = walk.feet(sample);
            self.phase[sample] = plant.phase_for(self.feet[sample]).unwrap_or(NO_PHASE);
            let u = row(&walker.u, sample);
            if let Some(input) = &mut self.input {
                plant.project(row(&walker.x, sample), u, &mut input[d * sample..][..d]);
            }
            if let Some(torque) = &mut self.torque_nm {
                torque[JOINT_DIM * sample..][..JOINT_DIM].copy_from_slice(&u[..JOINT_DIM]);
            }
        }
    }

    /// Standard deviation of each of `(z, dz)` over the trajectory, at least a hundredth of the largest one of
    /// positions or velocities. For a trajectory that stands still, the scale of a small motion of the joints.
    pub(crate) fn deviation(&self) -> &[f64] {
        &self.deviation
    }

    /// Writes `(z, dz)` at a time into `out`.
    pub fn state_at(&self, time_s: f64, out: &mut [f64]) {
        Trajectory::state_at(self, time_s, out);
    }

    /// The robot's state at a time, between samples on the line from one to the next.
    pub(super) fn robot_state_at(&self, time_s: f64) -> [f64; STATE_DIM] {
        self.between(&self.x, time_s)
    }

    /// Its rate, zero before the first sample and after the last.
    pub(super) fn robot_rate_at(&self, time_s: f64) -> [f64; STATE_DIM] {
        match time_s < self.start_s() || self.is_over(time_s) {
            true => [0.0; STATE_DIM],
            false => self.between(&self.dx, time_s),
        }
    }

    /// Feet on the ground at a time.
    pub(super) fn feet_at(&self, time_s: f64) -> ContactFlags {
        self.feet[self.locate(time_s).sample]
    }

    /// The measured feet on the ground that are also on the ground in the trajectory, now or soon. A foot that should
    /// swing but still drags must not carry weight.
    pub(super) fn carrying(&self, time_s: f64, measured: ContactFlags) -> ContactFlags {
        let [now, soon] = [time_s, time_s + EARLY_S].map(|time_s| self.feet_at(time_s));
        std::array::from_fn(|foot| measured[foot] && (now[foot] || soon[foot]))
    }

    /// The torques at the links, N m, if they are known.
    pub(super) fn torque_at(&self, time_s: f64) -> Option<[f64; JOINT_DIM]> {
        Some(self.between(self.torque_nm.as_ref()?, time_s))
    }

    fn between<const N: usize>(&self, values: &[f64], time_s: f64) -> [f64; N] {
        let Instant { sample, share } = self.locate(time_s);
        let later = (sample + 1).min(self.time_s.len() - 1);
        let [earlier, later] = [sample, later].map(|sample| &values[sample * N..][..N]);
        let mut state = [0.0; N];
        write_between(earlier, later, share, N, &mut state);
        state
    }

    /// Time of the first sample, s.
    pub(super) fn start_s(&self) -> f64 {
        self.time_s[0]
    }

    /// Whether a time is after the last sample.
    pub(super) fn is_over(&self, time_s: f64) -> bool {
        time_s > self.time_s[self.time_s.len() - 1]
    }

    /// The robot's state at each sample.
    pub(super) fn robot_states(&self) -> impl Iterator<Item = &[f64]> {
        self.x.chunks_exact(STATE_DIM)
    }

    /// Roll and pitch, rad, of the last sample at or before the time.
    pub(super) fn attitude_at(&self, time_s: f64) -> [f64; 2] {
        let x = row(&self.x, self.locate(time_s).sample);
        [x[15], x[16]]
    }
}

impl Trajectory for Reference {
    fn latent_dim(&self) -> usize {
        self.latent_dim
    }

    fn count(&self) -> usize {
        self.time_s.len()
    }

    fn time_s(&self, sample: usize) -> f64 {
        self.time_s[sample]
    }

    fn phase(&self, sample: usize) -> usize {
        self.phase[sample]
    }

    fn write_position(&self, sample: usize, z: &mut [f64]) {
        let d = self.latent_dim;
        z[..d].copy_from_slice(&self.state[2 * sample * d..][..d]);
    }

    fn write_velocity(&self, sample: usize, dz: &mut [f64]) {
        let d = self.latent_dim;
        dz[..d].copy_from_slice(&self.state[(2 * sample + 1) * d..][..d]);
    }

    fn write_input(&self, sample: usize, input: &mut [f64]) {
        if let Some(known) = &self.input {
            let d = self.latent_dim;
            input[..d].copy_from_slice(&known[sample * d..][..d]);
        }
    }
}

fn row(values: &[f64], sample: usize) -> &[f64] {
    &values[sample * STATE_DIM..(sample + 1) * STATE_DIM]
}

fn project_all(plant: &ControlModel, x: &[f64], u: &[f64]) -> Vec<f64> {
    let d = plant.latent_dim();
    let mut latent = vec![0.0; u.len() / STATE_DIM * d];
    let samples = x.chunks_exact(STATE_DIM).zip(u.chunks_exact(STATE_DIM));
    for ((x, u), latent) in samples.zip(latent.chunks_exact_mut(d)) {
        plant.project(x, u, latent);
    }
    latent
}

fn check(plant: &ControlModel, samples: &ReferenceSamples<'_>) -> Result<(), ControlError> {
    let count = samples.time_s.len();
    if count < 2 {
        return Err(ControlError::ReferenceLen {
            found: count,
            expected: 2,
        });
    }
    let check_len = |name, found: usize, width: usize| match count * width {
        expected if found == expected => Ok(()),
        expected => Err(ControlError::ReferenceShape {
            name,
            found,
            expected,
        }),
    };
    let arrays = [("x", samples.x), ("dx", samples.dx)].into_iter();
    for (name, values) in arrays.chain(samples.u.map(|u| ("u", u))) {
        check_len(name, values.len(), STATE_DIM)?;
        check_finite(name, values, STATE_DIM)?;
    }
    check_len("feet", samples.feet.len() * FOOT_DIM, FOOT_DIM)?;
    check_finite("time_s", samples.time_s, 1)?;
    for (sample, pair) in samples.time_s.windows(2).enumerate() {
        if pair[1] <= pair[0] {
            return Err(ControlError::ReferenceTime {
                sample,
                before: pair[0],
                after: pair[1],
            });
        }
    }
    for (sample, &feet) in samples.feet.iter().enumerate() {
        if plant.phase_for(feet).is_none() {
            return Err(ControlError::ReferencePhase { sample, feet });
        }
    }
    Ok(())
}

fn check_finite(name: &'static str, values: &[f64], width: usize) -> Result<(), ControlError> {
    match first_undefined(values, values.len()) {
        index if index == values.len() => Ok(()),
        index => Err(ControlError::ReferenceValue {
            name,
            sample: index / width,
            coordinate: index % width,
            found: values[index],
        }),
    }
}
