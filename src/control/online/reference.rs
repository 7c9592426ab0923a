//! The trajectory that the controller follows, in latent coordinates.

use super::control_model::ControlModel;
use super::error::ControlError;
use super::estimate::{Motion, estimate_input};
use super::linearise::LatentDynamics;
use crate::robot::{ContactFlags, FOOT_DIM, STATE_DIM};

/// A trajectory in SI units as its user has it: samples one after the other.
#[derive(Debug, Clone, Copy)]
pub struct ReferenceSamples<'a> {
    /// Time of each sample, s, increasing.
    pub time_s: &'a [f64],
    /// States, 18 values per sample.
    pub x: &'a [f64],
    /// Velocities, 18 values per sample.
    pub dx: &'a [f64],
    /// Generalised inputs (12 torques, force, moment), 18 values per sample, if they are known; the
    /// controller estimates them if not.
    pub u: Option<&'a [f64]>,
    /// Feet in contact.
    pub feet: &'a [ContactFlags],
}

/// An encoded trajectory that can be sampled at any time.
///
/// Between samples positions and velocities are interpolated linearly; before the first sample and
/// after the last the end is held at rest.
#[derive(Debug, Clone)]
pub struct Reference {
    latent_dim: usize,
    time_s: Vec<f64>,
    /// `(z, dz)` a sample.
    state: Vec<f64>,
    /// Latent input of each sample.
    input: Option<Vec<f64>>,
    feet: Vec<ContactFlags>,
    /// Robot states, 18 per sample.
    x: Vec<f64>,
    deviation: Vec<f64>,
}

/// Smallest standard deviation against the largest of the same kind.
pub const DEVIATION_FLOOR: f64 = 1e-2;
/// Share of a joint's half range within which a trajectory stands still.
pub const STILL_SHARE: f64 = 0.02;
/// Time in which one that stands still might cover that, s.
pub const STILL_TIME_S: f64 = 0.1;

impl Reference {
    /// Encodes a trajectory.
    ///
    /// # Errors
    /// [`ControlError::ReferenceLen`] below two samples, [`ControlError::ReferenceShape`] if array lengths
    /// disagree, [`ControlError::ReferenceValue`] for values that are not finite,
    /// [`ControlError::ReferenceTime`] if time does not increase and [`ControlError::ReferencePhase`] if a
    /// foot pattern selects no phase.
    pub fn new(plant: &ControlModel, samples: ReferenceSamples<'_>) -> Result<Self, ControlError> {
        check(plant, &samples)?;
        let d = plant.latent_dim();
        let count = samples.time_s.len();
        let mut state = vec![0.0; count * 2 * d];
        for (sample, encoded) in state.chunks_exact_mut(2 * d).enumerate() {
            let (z, dz) = encoded.split_at_mut(d);
            plant.encode(row(samples.x, sample), z);
            plant.encode_velocity(row(samples.x, sample), row(samples.dx, sample), dz);
        }
        Ok(Self {
            latent_dim: d,
            deviation: deviations(&state, &still_deviations(plant)),
            state,
            input: samples.u.map(|u| project_all(plant, samples.x, u)),
            time_s: samples.time_s.to_vec(),
            feet: samples.feet.to_vec(),
            x: samples.x.to_vec(),
        })
    }

    /// Gives a trajectory that comes without its input the one that the model finds behind its
    /// accelerations.
    pub(super) fn estimate_input(
        &mut self,
        plant: &ControlModel,
        dynamics: &mut dyn LatentDynamics,
    ) {
        let phases = self.feet.iter().map(|&feet| plant.phase_for(feet));
        let phases = phases.map(|phase| phase.expect("phases were checked"));
        let motion = Motion {
            time_s: &self.time_s,
            state: &self.state,
            phase: &phases.collect::<Vec<_>>(),
        };
        self.input = Some(estimate_input(plant, dynamics, &motion));
    }

    /// Whether the trajectory has an input, its own or an estimate.
    pub fn has_input(&self) -> bool {
        self.input.is_some()
    }

    /// First and last time, s.
    pub(super) fn time_range_s(&self) -> (f64, f64) {
        (self.time_s[0], self.time_s[self.time_s.len() - 1])
    }

    /// Standard deviation of each of `(z, dz)` over the trajectory, never below a hundredth of
    /// the largest position's or velocity's; for one that stands still, the scale of a small
    /// motion of the joints.
    pub fn deviation(&self) -> &[f64] {
        &self.deviation
    }

    /// The largest `row · z` along the trajectory.
    pub fn farthest(&self, row: &[f64]) -> f64 {
        let states = self.state.chunks_exact(2 * self.latent_dim);
        let products = states.map(|state| state.iter().zip(row).map(|(z, r)| z * r).sum::<f64>());
        products.fold(f64::NEG_INFINITY, f64::max)
    }

    /// Writes `(z, dz)` at a time into `out`.
    pub fn state_at(&self, time_s: f64, out: &mut [f64]) {
        let width = 2 * self.latent_dim;
        let (before, share) = self.locate(time_s);
        let earlier = &self.state[before * width..(before + 1) * width];
        if before + 1 == self.time_s.len() {
            out.copy_from_slice(earlier);
        } else {
            let later = &self.state[(before + 1) * width..(before + 2) * width];
            for ((out, earlier), later) in out.iter_mut().zip(earlier).zip(later) {
                *out = earlier + share * (later - earlier);
            }
        }
        let (first, last) = self.time_range_s();
        if time_s < first || time_s > last {
            out[self.latent_dim..].fill(0.0);
        }
    }

    /// The robot's state at a time, between samples on the line from one to the next.
    pub(super) fn robot_state_at(&self, time_s: f64) -> [f64; STATE_DIM] {
        let (before, share) = self.locate(time_s);
        let earlier = row(&self.x, before);
        let later = row(&self.x, (before + 1).min(self.time_s.len() - 1));
        std::array::from_fn(|i| earlier[i] + share * (later[i] - earlier[i]))
    }

    /// Writes the mean latent input over `[time_s, time_s + duration_s]` into `out`, false if the
    /// trajectory has no input: between two samples their mean, beyond the ends the end's.
    pub fn mean_input(&self, time_s: f64, duration_s: f64, out: &mut [f64]) -> bool {
        let Some(input) = &self.input else {
            return false;
        };
        let d = self.latent_dim;
        let end_s = time_s + duration_s;
        let (first_s, last_s) = self.time_range_s();
        out.fill(0.0);
        let before_s = first_s.min(end_s) - time_s;
        if before_s > 0.0 {
            add_scaled(before_s, &input[..d], out);
        }
        let mut sample = self.locate(time_s).0;
        while sample + 1 < self.time_s.len() && self.time_s[sample] < end_s {
            let from_s = self.time_s[sample].max(time_s);
            let span_s = self.time_s[sample + 1].min(end_s) - from_s;
            if span_s > 0.0 {
                let half_s = 0.5 * span_s;
                add_scaled(half_s, &input[sample * d..][..d], out);
                add_scaled(half_s, &input[(sample + 1) * d..][..d], out);
            }
            sample += 1;
        }
        let after_s = end_s - last_s.max(time_s);
        if after_s > 0.0 {
            add_scaled(after_s, &input[input.len() - d..], out);
        }
        for out in out.iter_mut() {
            *out /= duration_s;
        }
        true
    }

    /// Feet in contact: those of the last sample at or before the time.
    pub(super) fn feet_at(&self, time_s: f64) -> ContactFlags {
        self.feet[self.locate(time_s).0]
    }

    /// Roll and pitch, rad, of the last sample at or before the time.
    pub(super) fn attitude_at(&self, time_s: f64) -> [f64; 2] {
        let x = row(&self.x, self.locate(time_s).0);
        [x[15], x[16]]
    }

    /// The last sample at or before a time and how far the time is on the way to the next one.
    fn locate(&self, time_s: f64) -> (usize, f64) {
        // Times that differ from a sample's by rounding belong to that sample.
        let tolerance = 1e-9;
        let after = (self.time_s).partition_point(|&sample| sample <= time_s + tolerance);
        let before = after.saturating_sub(1);
        if before + 1 == self.time_s.len() {
            return (before, 0.0);
        }
        let span = self.time_s[before + 1] - self.time_s[before];
        let share = (time_s - self.time_s[before]) / span;
        (before, share.clamp(0.0, 1.0))
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

/// `out += scale · values`.
fn add_scaled(scale: f64, values: &[f64], out: &mut [f64]) {
    for (out, value) in out.iter_mut().zip(values) {
        *out += scale * value;
    }
}

/// Scale of `(z, dz)` for a trajectory that stands still: the change of each latent alone that
/// moves some joint by `STILL_SHARE` of half its range, and that change within `STILL_TIME_S`.
fn still_deviations(plant: &ControlModel) -> Vec<f64> {
    let d = plant.latent_dim();
    let limits = plant.robot().joint_limit_rad();
    let positions = (0..d).map(|latent| {
        let shares = limits.iter().enumerate().map(|(joint, (lower, upper))| {
            plant.parts().decoder[(joint, latent)].abs() / (0.5 * (upper - lower))
        });
        let largest = shares.fold(0.0, f64::max);
        match largest > 0.0 {
            true => STILL_SHARE / largest,
            false => 1.0,
        }
    });
    let mut scale: Vec<f64> = positions.collect();
    scale.extend_from_within(..);
    for value in &mut scale[d..] {
        *value /= STILL_TIME_S;
    }
    scale
}

fn deviations(state: &[f64], still: &[f64]) -> Vec<f64> {
    let width = still.len();
    let count = (state.len() / width) as f64;
    let mut deviation: Vec<f64> = (0..width)
        .map(|column| {
            let values = || state.iter().skip(column).step_by(width);
            let mean = values().sum::<f64>() / count;
            (values().map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt()
        })
        .collect();
    let half = width / 2;
    if (0..half).all(|latent| deviation[latent] < still[latent]) {
        return still.to_vec();
    }
    for half in deviation.chunks_exact_mut(half) {
        let largest = half.iter().copied().fold(0.0, f64::max);
        let floor = match largest > 0.0 {
            true => DEVIATION_FLOOR * largest,
            false => 1.0,
        };
        for value in half {
            *value = value.max(floor);
        }
    }
    deviation
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
    match values.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(index) => Err(ControlError::ReferenceValue {
            name,
            sample: index / width,
            coordinate: index % width,
            found: values[index],
        }),
    }
}
