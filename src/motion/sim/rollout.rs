//! Rollouts: the hybrid model integrated over the recorded inputs, equation (24).
//!
//! Phases switch as recorded; the latent state is carried through the switch. Between samples the
//! latent input is interpolated linearly.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::integrate::{Integration, IntegrationOptions, OdeSystem, integrate};
use super::latent::LatentSegment;
use crate::lower::CompiledModel;
use crate::recording::segment::stretches;

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

    /// `z` and `dz` at each of the `n` samples of the segment; `None` where no window arrived.
    pub fn states(&self, n: usize) -> Vec<Option<(DVector<f64>, DVector<f64>)>> {
        let mut states = vec![None; n];
        for (sample, window, column) in self.predictions() {
            let [z, dz] = [&window.z, &window.dz].map(|rows| rows.column(column).into_owned());
            states[sample] = Some((z, dz));
        }
        states
    }

    /// First time at which a window diverged.
    pub fn diverged_at_s(&self) -> Option<f64> {
        self.windows.iter().find_map(|window| window.diverged_at_s)
    }
}

/// Rolls the model out over a segment, from its recorded latent state at each start.
pub fn rollout(model: &CompiledModel, recorded: &LatentSegment, restart: Restart) -> Rollout {
    let mut dynamics = PhaseDynamics {
        model: model.clone(),
        recorded,
        phase: 0,
        u_lat: vec![0.0; model.latent_dim()],
        ddz: vec![0.0; model.latent_dim()],
        partials: DMatrix::zeros(model.latent_dim(), 3 * model.latent_dim()),
    };
    let windows = restart_windows(&recorded.time_s, restart).into_iter();
    let options = &at_scale(recorded);
    Rollout {
        windows: windows
            .map(|samples| roll_window(&mut dynamics, samples, options))
            .collect(),
    }
}

/// The default options with tolerance and bound moved for a model whose scaled coordinates are far from one, so that
/// rollouts do not depend on its scale factors.
fn at_scale(recorded: &LatentSegment) -> IntegrationOptions {
    /// Largest coordinates between which the options are taken as they are.
    const USUAL: [f64; 2] = [1e-3, 1e3];
    let options = IntegrationOptions::default();
    match recorded.z.amax() {
        largest if largest > 0.0 && largest < USUAL[0] => IntegrationOptions {
            absolute_tolerance: options.absolute_tolerance * (largest / USUAL[0]),
            ..options
        },
        largest if largest > USUAL[1] => IntegrationOptions {
            divergence_bound: options.divergence_bound * (largest / USUAL[1]),
            ..options
        },
        _ => options,
    }
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
pub fn integrate_stretches(
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{FeetRule, Library, Phase, ReducedModel};

    /// A damped, driven oscillator in contact; constant acceleration in flight.
    fn compiled() -> CompiledModel {
        let terms = ["1", "z1", "dz1", "u1"].map(str::to_owned);
        let library = Library::from_terms(1, &terms).expect("terms parse");
        let phase = |name: &str, feet, xi: [f64; 4]| Phase {
            name: name.to_owned(),
            feet,
            xi: DMatrix::from_column_slice(4, 1, &xi),
        };
        let model = ReducedModel::builder("hopper", library)
            .phase(phase("contact", FeetRule::Any, [0.0, -40.0, -0.5, 3.0]))
            .phase(phase("flight", FeetRule::None, [-9.81, 0.0, 0.0, 0.0]))
            .build()
            .expect("a valid model");
        CompiledModel::new(&model).expect("lowers")
    }

    /// Samples every 2 ms; flight from 40 on; a latent record that the model does not follow.
    fn recorded(count: usize) -> LatentSegment {
        let row = |f: &dyn Fn(f64) -> f64| DMatrix::from_fn(1, count, |_, k| f(0.002 * k as f64));
        LatentSegment {
            time_s: (0..count).map(|k| 0.002 * k as f64).collect(),
            z: row(&|t| 0.3 + t),
            dz: row(&|_| 1.0),
            ddz: row(&|_| 0.0),
            u_lat: row(&|t| (20.0 * t).sin()),
            phase: (0..count).map(|k| usize::from(k >= 40)).collect(),
        }
    }

    #[test]
    fn rollout_in_flight_is_the_parabola_from_the_switch() {
        let recorded = recorded(101);
        let whole = rollout(&compiled(), &recorded, Restart::Never);
        let window = &whole.windows[0];
        assert_eq!((whole.windows.len(), window.z.ncols()), (1, 101));
        let (z, dz) = (window.z[(0, 40)], window.dz[(0, 40)]);
        for k in 40..101 {
            let t = 0.002 * (k - 40) as f64;
            let expected = z + dz * t - 0.5 * 9.81 * t * t;
            assert!((window.z[(0, k)] - expected).abs() < 1e-8, "sample {k}");
        }
    }

    #[test]
    fn rollout_in_contact_agrees_with_fine_runge_kutta_steps() {
        let recorded = recorded(41);
        let mut model = compiled();
        let whole = rollout(&model, &recorded, Restart::Never);
        let window = &whole.windows[0];
        let (mut z, mut dz, mut u) = ([recorded.z[(0, 0)]], [recorded.dz[(0, 0)]], [0.0]);
        let h = 1e-6;
        for step in 0..80_000 {
            // the input at the middle of a step makes holding it second order accurate
            recorded.input_at((step as f64 + 0.5) * h, &mut u);
            model.rk4_step(0, &mut z, &mut dz, &u, h);
        }
        assert!(
            (window.z[(0, 40)] - z[0]).abs() < 1e-7,
            "{} {}",
            window.z[(0, 40)],
            z[0]
        );
        assert!((window.dz[(0, 40)] - dz[0]).abs() < 1e-6);
    }

    #[test]
    fn restarts_begin_at_the_recorded_state_and_cover_every_sample_once() {
        let recorded = recorded(101);
        let restarted = rollout(&compiled(), &recorded, Restart::Every(0.05));
        let starts: Vec<usize> = restarted.windows.iter().map(|w| w.samples.start).collect();
        assert_eq!(starts, [0, 25, 50, 75, 100]);
        for window in &restarted.windows {
            assert_eq!(window.z[(0, 0)], recorded.z[(0, window.samples.start)]);
        }
        let covered: Vec<usize> = restarted
            .predictions()
            .map(|(sample, _, _)| sample)
            .collect();
        assert_eq!(covered, (0..101).collect::<Vec<_>>());
    }

    #[test]
    fn input_between_samples_is_linear_and_held_outside() {
        let recorded = recorded(3);
        let mut u = [0.0];
        recorded.input_at(0.003, &mut u);
        let between = 0.5 * (recorded.u_lat[(0, 1)] + recorded.u_lat[(0, 2)]);
        assert!((u[0] - between).abs() < 1e-15);
        recorded.input_at(9.0, &mut u);
        assert_eq!(u[0], recorded.u_lat[(0, 2)]);
        recorded.input_at(-1.0, &mut u);
        assert_eq!(u[0], recorded.u_lat[(0, 0)]);
    }
}
