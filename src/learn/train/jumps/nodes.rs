//! A part of a jump at equal shares of its duration.

use nalgebra::DMatrix;

use super::super::dataset::Jump;
use super::super::latent::Latent;
use super::landmarks::Cut;

/// Time between nodes that is aimed at, s.
const NODE_STEP_S: f64 = 0.014;
/// Fewest and most intervals of a part.
const INTERVALS: [usize; 2] = [10, 60];

/// Nodes of one part of one jump; one row per node, scaled units.
pub(super) struct PartNodes {
    pub duration_s: f64,
    pub z: DMatrix<f64>,
    pub dz: DMatrix<f64>,
    /// Latent inputs, averaged over half an interval to each side.
    pub u_lat: DMatrix<f64>,
}

impl PartNodes {
    /// Time between two nodes, s.
    pub(super) fn step_s(&self) -> f64 {
        self.duration_s / (self.z.nrows() - 1) as f64
    }
}

/// How many intervals a part of this mean duration has.
pub(super) fn intervals(mean_duration_s: f64) -> usize {
    let [least, most] = INTERVALS;
    ((mean_duration_s / NODE_STEP_S).round() as usize).clamp(least, most)
}

pub(super) fn sample(
    jump: &Jump,
    latent: &Latent,
    cut: &Cut,
    part: usize,
    count: usize,
) -> PartNodes {
    let samples = cut.samples(part);
    let times = &jump.time_s[samples.clone()];
    let (first, duration_s) = (times[0], cut.duration_s(part));
    let step = duration_s / count as f64;
    let d = latent.z.nrows();
    let at_nodes = |rows: &DMatrix<f64>| {
        DMatrix::from_fn(count + 1, d, |node, i| {
            let time = first + step * node as f64;
            let after = times
                .partition_point(|t| *t <= time)
                .clamp(1, times.len() - 1);
            let (a, b) = (times[after - 1], times[after]);
            let share = ((time - a) / (b - a)).clamp(0.0, 1.0);
            let value = |k: usize| rows[(i, samples.start + k)];
            value(after - 1) + share * (value(after) - value(after - 1))
        })
    };
    let averaged = |rows: &DMatrix<f64>| {
        DMatrix::from_fn(count + 1, d, |node, i| {
            let time = first + step * node as f64;
            let inside = |t: &f64| (t - time).abs() <= 0.5 * step + 1e-9;
            // The last sample is the next part's first, if there is one.
            let own = times[..times.len() - 1].iter().enumerate();
            let near = own.filter(|(_, t)| inside(t));
            let (sum, n) = near.fold((0.0, 0), |(sum, n), (k, _)| {
                (sum + rows[(i, samples.start + k)], n + 1)
            });
            match n {
                0 => rows[(i, samples.start + times.len() - 2)],
                _ => sum / f64::from(n),
            }
        })
    };
    PartNodes {
        duration_s,
        z: at_nodes(&latent.z),
        dz: at_nodes(&latent.dz),
        u_lat: averaged(&latent.u_lat),
    }
}
