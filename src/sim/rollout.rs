//! Rollouts: the hybrid model integrated over the recorded inputs, equation (24).
//!
//! Phases switch as recorded; the latent state is carried through the switch. Between samples the
//! latent input is interpolated linearly.

use std::cell::RefCell;
use std::ops::Range;

use nalgebra::DMatrix;

use super::compiled::CompiledModel;
use super::error::SimError;
use super::integrate::{Integration, IntegrationMethod, IntegrationOptions, integrate};
use super::latent::LatentSegment;

/// When a rollout starts again from the recorded latent state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Restart {
    /// Never: one rollout over the whole segment.
    Never,
    /// After this many seconds, over and over.
    Every(f64),
}

/// A rollout between two restarts.
#[derive(Debug, Clone, PartialEq)]
pub struct Window {
    /// Samples of the segment that the window covers.
    pub samples: Range<usize>,
    /// Predicted `z`, `latent_dim x reached`: the first `reached` samples of the window.
    pub z: DMatrix<f64>,
    /// Predicted `dz`, as `z`.
    pub dz: DMatrix<f64>,
    /// Time at which the state left every bound, if it did; later samples have no prediction.
    pub diverged_at_s: Option<f64>,
    /// Whether the stiff method was needed.
    pub stiff: bool,
}

/// A segment's rollout: windows in the order of time.
#[derive(Debug, Clone, PartialEq)]
pub struct Rollout {
    /// One window, or one a restart.
    pub windows: Vec<Window>,
}

impl Rollout {
    /// Every predicted sample: its index in the segment, and its column of `z` and `dz`.
    pub fn predictions(&self) -> impl Iterator<Item = (usize, &Window, usize)> {
        self.windows.iter().flat_map(|window| {
            (0..window.z.ncols()).map(move |column| (window.samples.start + column, window, column))
        })
    }

    /// First time at which a window diverged.
    pub fn diverged_at_s(&self) -> Option<f64> {
        self.windows.iter().find_map(|window| window.diverged_at_s)
    }
}

/// Rolls the model out over a segment, from its recorded latent state at each start.
///
/// # Errors
/// [`SimError::Solver`] if the integrator refuses the problem.
pub fn rollout(
    model: &CompiledModel,
    recorded: &LatentSegment,
    restart: Restart,
    options: &IntegrationOptions,
) -> Result<Rollout, SimError> {
    restart_windows(&recorded.time_s, restart)
        .into_iter()
        .map(|samples| roll_window(model, recorded, samples, options))
        .collect::<Result<_, _>>()
        .map(|windows| Rollout { windows })
}

/// Ranges of samples between restarts; a restart falls on the first sample not before its time.
pub fn restart_windows(time_s: &[f64], restart: Restart) -> Vec<Range<usize>> {
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
        let end = start + time_s[start..].partition_point(|&time| time < next);
        out.push(start..end.max(start + 1));
        start = end.max(start + 1);
    }
    out
}

fn roll_window(
    model: &CompiledModel,
    recorded: &LatentSegment,
    samples: Range<usize>,
    options: &IntegrationOptions,
) -> Result<Window, SimError> {
    let d = recorded.z.nrows();
    let mut state: Vec<f64> = (recorded.z.column(samples.start).iter())
        .chain(recorded.dz.column(samples.start).iter())
        .copied()
        .collect();
    let mut states = DMatrix::zeros(2 * d, samples.len());
    states.column_mut(0).copy_from_slice(&state);
    let mut reached = 1;
    let mut window_end = (None, false);
    for span in spans(&recorded.phase, &samples) {
        // the last step of a span ends on the first sample of the next
        let times = &recorded.time_s[span.start..(span.end + 1).min(samples.end)];
        let phase = recorded.phase[span.start];
        let result = integrate_phase(model, recorded, phase, &state, times, options)?;
        for column in 1..result.states.ncols() {
            let sample = span.start + column - samples.start;
            states
                .column_mut(sample)
                .copy_from(&result.states.column(column));
            reached = sample + 1;
        }
        window_end.1 |= result.method == IntegrationMethod::BackwardDifferentiation;
        if result.diverged_at_s.is_some() {
            window_end.0 = result.diverged_at_s;
            break;
        }
        state.copy_from_slice(states.column(reached - 1).as_slice());
    }
    Ok(Window {
        z: states.view((0, 0), (d, reached)).into_owned(),
        dz: states.view((d, 0), (d, reached)).into_owned(),
        samples,
        diverged_at_s: window_end.0,
        stiff: window_end.1,
    })
}

/// `[z; dz]` at `times` under one phase, from `state` at the first of them.
fn integrate_phase(
    model: &CompiledModel,
    recorded: &LatentSegment,
    phase: usize,
    state: &[f64],
    times: &[f64],
    options: &IntegrationOptions,
) -> Result<Integration, SimError> {
    let d = model.latent_dim();
    // the integrator takes shared closures, the interpreter writes into its own registers
    let evaluation = RefCell::new((
        model.clone(),
        vec![0.0; d],
        vec![0.0; d],
        DMatrix::zeros(d, 3 * d),
    ));
    integrate(
        |time, y, dy| {
            let (model, u_lat, _, _) = &mut *evaluation.borrow_mut();
            recorded.input_at(time, u_lat);
            let (z, dz) = y.split_at(d);
            let (velocity, acceleration) = dy.split_at_mut(d);
            velocity.copy_from_slice(dz);
            model.ddz(phase, z, dz, u_lat, acceleration);
        },
        |time, y, v, jv| {
            let (model, u_lat, ddz, jacobian) = &mut *evaluation.borrow_mut();
            recorded.input_at(time, u_lat);
            let (z, dz) = y.split_at(d);
            model.jacobian(phase, z, dz, u_lat, ddz, jacobian);
            let (velocity, acceleration) = jv.split_at_mut(d);
            velocity.copy_from_slice(&v[d..]);
            for (row, value) in acceleration.iter_mut().enumerate() {
                *value = (0..2 * d).map(|col| jacobian[(row, col)] * v[col]).sum();
            }
        },
        state,
        times,
        options,
    )
}

/// Runs of samples with one phase.
fn spans(phase: &[usize], samples: &Range<usize>) -> Vec<Range<usize>> {
    let mut out: Vec<Range<usize>> = Vec::new();
    for sample in samples.clone() {
        match out.last_mut() {
            Some(span) if phase[span.start] == phase[sample] => span.end = sample + 1,
            _ => out.push(sample..sample + 1),
        }
    }
    out
}
