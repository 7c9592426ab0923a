//! Rollouts: the hybrid model integrated over the recorded inputs, equation (24).
//!
//! Phases switch as recorded; the latent state is carried through the switch. Between samples the latent input is
//! interpolated linearly.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::integrate::{Integration, IntegrationOptions, OdeSystem, integrate};
use super::latent::LatentSegment;
use crate::lower::CompiledModel;
use crate::recording::segment::stretches;

/// When a rollout starts again from the recorded latent state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Restart {
    Never,
    /// After this many seconds, over and over.
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

/// A segment's rollout: windows in the order of time.
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
    let windows = restart_windows(&recorded.time_s, restart).into_iter();
    let windows = windows.map(|samples| roll_window(&mut dynamics, samples, &options));
    Rollout {
        windows: windows.collect(),
    }
}

/// The default options with tolerance and bound moved for a model whose scaled coordinates are far from one, so that
/// rollouts do not depend on its scale factors.
fn at_scale(recorded: &LatentSegment) -> IntegrationOptions {
    /// Largest coordinates between which the options are taken as they are.
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

/// States of a window of samples from `initial` at its first one, stretch after stretch of like samples, as far as they
/// are reached, and when they left every bound, if they did.
///
/// `of_stretch` integrates one from a state over its times, which end at the first sample of the next.
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
