//! Rollouts: the hybrid model integrated over the recorded inputs, equation (24). Phases switch as recorded; between
//! samples the latent input is interpolated linearly.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::integrate::{Integration, IntegrationOptions, OdeSystem, integrate};
use crate::lower::CompiledModel;
use crate::model::{InputStatistics, ModelError, ReducedModel};
use crate::recording::{CHATTER_SAMPLES, PhasePattern};
use crate::recording::{PhaseRule, RecordingError, Segment};
use crate::recording::{between, stretches};

/// When a rollout starts again from the recorded latent state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Restart {
    Never,
    /// Period in s.
    Every(f64),
}

#[derive(Debug, Clone, PartialEq)]
pub struct Window {
    pub samples: Range<usize>,
    /// Predicted `z`, `latent_dim x reached`: the first `reached` samples of the window.
    pub z: DMatrix<f64>,
    pub dz: DMatrix<f64>,
    /// Time at which the state left every bound, if it did; later samples have no prediction.
    pub diverged_at_s: Option<f64>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Rollout {
    pub windows: Vec<Window>,
}

impl Rollout {
    /// Every predicted sample: its index in the segment, and its column of `z` and `dz`.
    pub fn predictions(&self) -> impl Iterator<Item = (usize, &Window, usize)> {
        self.windows.iter().flat_map(|window| {
            (0..window.z.ncols()).map(move |column| (window.samples.start + column, window, column))
        })
    }

    /// `z` and `dz` at each of the `n` samples of the segment; `None` where no window arrived.
    pub fn states(&self, n: usize) -> Vec<Option<(DVector<f64>, DVector<f64>)>> {
        let mut states = vec![None; n];
        for (sample, window, column) in self.predictions() {
            let [z, dz] = [&window.z, &window.dz].map(|rows| rows.column(column).into_owned());
            states[sample] = Some((z, dz));
        }
        states
    }

    pub fn diverged_at_s(&self) -> Option<f64> {
        self.windows.iter().find_map(|window| window.diverged_at_s)
    }
}

/// Rolls the model out over a segment, from its recorded latent state at each start.
pub fn rollout(model: &CompiledModel, recorded: &LatentSegment, restart: Restart) -> Rollout {
    rollout_over(model, recorded, restart_windows(&recorded.time_s, restart))
}

/// The same over certain ranges of samples.
pub(crate) fn rollout_over(
    model: &CompiledModel,
    recorded: &LatentSegment,
    windows: Vec<Range<usize>>,
) -> Rollout {
    let d = model.latent_dim();
    let mut dynamics = PhaseDynamics {
        model: model.clone(),
        recorded,
        phase: 0,
        u_lat: vec![0.0; d],
        ddz: vec![0.0; d],
        partials: DMatrix::zeros(d, 3 * d),
    };
    let options = at_scale(recorded);
    let windows = windows
        .into_iter()
        .map(|samples| roll_window(&mut dynamics, samples, &options));
    Rollout {
        windows: windows.collect(),
    }
}

/// Tolerance and bound for models whose coordinates are far from one, so that rollouts do not depend on their scale.
fn at_scale(recorded: &LatentSegment) -> IntegrationOptions {
    /// Range of largest coordinates in which the options are used unchanged.
    const USUAL: [f64; 2] = [1e-3, 1e3];
    let mut options = IntegrationOptions::default();
    let largest = recorded.z.amax();
    if largest > 0.0 && largest < USUAL[0] {
        options.absolute_tolerance *= largest / USUAL[0];
    } else if largest > USUAL[1] {
        options.divergence_bound *= largest / USUAL[1];
    }
    options
}

/// Ranges of samples between restarts; a restart falls on the first sample not before its time.
pub(crate) fn restart_windows(time_s: &[f64], restart: Restart) -> Vec<Range<usize>> {
    let interval_s = match restart {
        Restart::Never => f64::INFINITY,
        Restart::Every(interval_s) => interval_s,
    };
    // half a microsecond forgives the rounding of times such as 0.1 written in decimal
    const ROUNDING_S: f64 = 5e-7;
    let mut out = Vec::new();
    let mut start = 0;
    while start < time_s.len() {
        let next = time_s[start] + interval_s - ROUNDING_S;
        let end = start + time_s[start..].partition_point(|&time| time < next).max(1);
        out.push(start..end);
        start = end;
    }
    out
}

fn roll_window(
    dynamics: &mut PhaseDynamics,
    samples: Range<usize>,
    options: &IntegrationOptions,
) -> Window {
    let recorded = dynamics.recorded;
    let d = recorded.z.nrows();
    let initial: Vec<f64> = (recorded.z.column(samples.start).iter())
        .chain(recorded.dz.column(samples.start).iter())
        .copied()
        .collect();
    let phase = &recorded.phase;
    let (states, diverged_at_s) = integrate_stretches(
        &initial,
        &recorded.time_s,
        samples.clone(),
        |a, b| phase[a] == phase[b],
        |stretch, state, times| {
            dynamics.phase = phase[stretch.start];
            integrate(dynamics, state, times, options)
        },
    );
    Window {
        samples,
        z: states.rows(0, d).into_owned(),
        dz: states.rows(d, d).into_owned(),
        diverged_at_s,
    }
}

/// States from `initial`, stretch after stretch of similar samples, as far as they are reached, and the time at which
/// they left every bound. `of_stretch` integrates one stretch over its times, which end at the first sample of the
/// next.
pub(crate) fn integrate_stretches(
    initial: &[f64],
    time_s: &[f64],
    window: Range<usize>,
    alike: impl Fn(usize, usize) -> bool,
    mut of_stretch: impl FnMut(Range<usize>, &[f64], &[f64]) -> Integration,
) -> (DMatrix<f64>, Option<f64>) {
    let mut states = DMatrix::zeros(initial.len(), window.len());
    states.column_mut(0).copy_from_slice(initial);
    let (mut reached, mut diverged_at_s) = (1, None);
    for stretch in stretches(window.clone(), alike) {
        let times = &time_s[stretch.start..(stretch.end + 1).min(window.end)];
        let first = stretch.start - window.start;
        let state = states.column(first).into_owned();
        let part = of_stretch(stretch, state.as_slice(), times);
        reached = first + part.states.ncols();
        let mut to = states.columns_mut(first, part.states.ncols());
        to.copy_from(&part.states);
        diverged_at_s = part.diverged_at_s;
        if diverged_at_s.is_some() {
            break;
        }
    }
    (states.columns(0, reached).into_owned(), diverged_at_s)
}

/// `y = [z; dz]` under one phase and the recorded input.
struct PhaseDynamics<'a> {
    model: CompiledModel,
    recorded: &'a LatentSegment,
    phase: usize,
    u_lat: Vec<f64>,
    ddz: Vec<f64>,
    partials: DMatrix<f64>,
}

impl OdeSystem for PhaseDynamics<'_> {
    fn rate(&mut self, time_s: f64, y: &[f64], dy: &mut [f64]) {
        self.recorded.input_at(time_s, &mut self.u_lat);
        let (z, dz) = y.split_at(self.ddz.len());
        let (velocity, acceleration) = dy.split_at_mut(self.ddz.len());
        velocity.copy_from_slice(dz);
        (self.model).ddz(self.phase, z, dz, &self.u_lat, acceleration);
    }

    fn jacobian(&mut self, time_s: f64, y: &[f64], jacobian: &mut DMatrix<f64>) {
        self.recorded.input_at(time_s, &mut self.u_lat);
        let d = self.ddz.len();
        let (z, dz) = y.split_at(d);
        let (ddz, partials) = (&mut self.ddz, &mut self.partials);
        (self.model).jacobian(self.phase, z, dz, &self.u_lat, ddz, partials);
        jacobian.fill(0.0);
        jacobian.view_mut((0, d), (d, d)).fill_with_identity();
        (jacobian.rows_mut(d, d)).copy_from(&self.partials.columns(0, 2 * d));
    }
}

#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SimError {
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    Recording(#[from] RecordingError),
}

/// Latent samples of one recorded segment, in columns; of a nonlinear encoder its Jacobian at `x` stands for `W_e`, and
/// accelerations have the term `dJ/dt dx`.
#[derive(Debug, Clone, PartialEq)]
pub struct LatentSegment {
    pub time_s: Vec<f64>,
    /// Latent positions `z = W_e (s_x x) + b_e` (equation 9).
    pub z: DMatrix<f64>,
    /// Latent velocities `dz = W_e (s_x dx)` (equation 11).
    pub dz: DMatrix<f64>,
    /// Latent accelerations `ddz = W_e (s_x ddx)` (equation 12).
    pub ddz: DMatrix<f64>,
    /// Latent inputs `u_lat = pinv(W_e^T) (s_u u)` (equation 13).
    pub u_lat: DMatrix<f64>,
    /// Index of the phase of every sample, by spans of the recorded feet.
    pub phase: Vec<usize>,
}

impl LatentSegment {
    pub fn encode(model: &ReducedModel, segment: &Segment) -> Result<Self, SimError> {
        let input = segment.input(&model.input_rule()?)?;
        let samples = |map: &dyn Fn(usize) -> Result<DVector<f64>, SimError>| {
            let mut out = DMatrix::zeros(model.latent_dim(), segment.x.ncols());
            for (sample, mut to) in out.column_iter_mut().enumerate() {
                to.copy_from(&map(sample)?);
            }
            Ok::<_, SimError>(out)
        };
        let [x, dx, ddx, u] = [&segment.x, &segment.dx, &segment.ddx, &input]
            .map(|rows| |k: usize| rows.column(k).into_owned());
        Ok(Self {
            time_s: segment.time_s.clone(),
            z: samples(&|k| Ok(model.encode(&x(k))?))?,
            dz: samples(&|k| Ok(model.encoder_jacobian(&x(k))? * dx(k)))?,
            ddz: samples(&|k| Ok(model.encode_acceleration(&x(k), &dx(k), &ddx(k))?))?,
            u_lat: samples(&|k| Ok(model.tangent(&x(k))?.project * u(k)))?,
            phase: phases(model, segment)?,
        })
    }

    /// Latent input at a time between samples, interpolated linearly; held outside the record.
    pub(crate) fn input_at(&self, time_s: f64, u_lat: &mut [f64]) {
        let (left, right, share) = between(&self.time_s, time_s);
        for (row, value) in u_lat.iter_mut().enumerate() {
            let (from, to) = (self.u_lat[(row, left)], self.u_lat[(row, right)]);
            *value = from + share * (to - from);
        }
    }
}

fn phases(model: &ReducedModel, segment: &Segment) -> Result<Vec<usize>, SimError> {
    let mut phases = vec![0; segment.len()];
    for span in phase_rule(model).spans(segment)? {
        phases[span.range].fill(span.phase);
    }
    Ok(phases)
}

/// The rule by which training and evaluation assign samples to the phases of a model.
pub(crate) fn phase_rule(model: &ReducedModel) -> PhaseRule {
    let patterns = model.phases().iter().map(|phase| PhasePattern {
        name: phase.name.clone(),
        feet: phase.feet.clone(),
    });
    PhaseRule::new(patterns.collect()).with_min_samples(CHATTER_SAMPLES)
}

/// The model with the statistics of the recorded inputs (SI, by its rule) in the phases that have samples.
pub fn with_input_statistics(
    model: ReducedModel,
    segments: &[&Segment],
) -> Result<ReducedModel, SimError> {
    let rule = model.input_rule()?;
    let mut of_phases = vec![Vec::new(); model.phases().len()];
    for segment in segments {
        let input = segment.input(&rule)?;
        for (sample, phase) in phases(&model, segment)?.into_iter().enumerate() {
            of_phases[phase].push(input.column(sample).into_owned());
        }
    }
    let mut builder = model.clone().into_builder();
    for (phase, samples) in model.phases().iter().zip(of_phases) {
        if !samples.is_empty() {
            let statistics = InputStatistics::of_samples(&DMatrix::from_columns(&samples));
            builder = builder.input_statistics(&phase.name, statistics);
        }
    }
    Ok(builder.build()?)
}
