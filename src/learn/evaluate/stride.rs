//! Growth of deviations over a stride: the phases of a walk one after the other, again and again.

use std::collections::BTreeMap;
use std::ops::Range;

use super::*;

const LEAST_STRIDES: usize = 3; // of one motion, by which phases count as repeated

/// The usual stride of a walk, and the growth of small deviations over it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StrideGrowth {
    /// Names of its phases and their mean durations in s.
    pub phases: Vec<(String, f64)>,
    /// The largest magnitude of the Floquet multipliers, the eigenvalues of `e^(A_k T_k) ... e^(A_1 T_1)` with `A` of
    /// each phase at its mean state. It is the factor by which the fastest deviation grows.
    pub largest_multiplier: Option<f64>,
}

impl StrideGrowth {
    /// None where phases do not repeat, or a phase of the stride is not linearised.
    pub(super) fn of(
        model: &ReducedModel,
        linearised: &[Option<LinearisedPhase>],
        segments: &[&LatentSegment],
    ) -> Option<Self> {
        let spans = segments.iter().map(|segment| {
            let alike = |a: usize, b: usize| segment.phase[a] == segment.phase[b];
            let spans = stretches(0..segment.phase.len(), alike).into_iter();
            let lasts_s = |span: &Range<usize>| {
                let end = span.end.min(segment.time_s.len() - 1);
                segment.time_s[end] - segment.time_s[span.start]
            };
            spans
                .map(|span| (segment.phase[span.start], lasts_s(&span)))
                .collect()
        });
        let stride = usual_stride(&spans.collect::<Vec<_>>())?;
        let transitions = stride.iter().map(|&(phase, duration_s)| {
            Some(transition(&linearised[phase].as_ref()?.rates, duration_s))
        });
        let product = transitions.reduce(|before, next| Some(next? * before?))??;
        let multipliers = eigenvalues(product);
        let largest = |all: Vec<Complex<f64>>| all.iter().map(|of| of.norm()).fold(0.0, f64::max);
        let name = |phase: usize| model.phases()[phase].name.clone();
        Some(Self {
            phases: stride
                .iter()
                .map(|&(phase, time_s)| (name(phase), time_s))
                .collect(),
            largest_multiplier: multipliers.map(largest),
        })
    }

    pub fn words(&self) -> String {
        let phases = self
            .phases
            .iter()
            .map(|(name, time_s)| format!("{name} {time_s:.3} s"));
        let phases = phases.collect::<Vec<_>>().join(", ");
        let factor = (self.largest_multiplier).map_or("-".to_owned(), |of| format!("{of:.3}"));
        format!(
            "over a stride ({phases}) the fastest deviation is multiplied by {factor} (largest Floquet multiplier)"
        )
    }
}

/// `e^(A T)` of a phase with `d ddz / d (z, dz)` (`d x 2d`).
pub(crate) fn transition(rates: &DMatrix<f64>, duration_s: f64) -> DMatrix<f64> {
    (state_matrix(rates) * duration_s).exp()
}

/// The most frequent sequence of phases from one beginning of the longest phase to its next, with mean durations in s.
/// `motions` are spans of phases with their durations. None unless a motion has [`LEAST_STRIDES`] of them.
pub(crate) fn usual_stride(motions: &[Vec<(usize, f64)>]) -> Option<Vec<(usize, f64)>> {
    let mut total_s: BTreeMap<usize, f64> = BTreeMap::new();
    for (phase, duration_s) in motions.iter().flatten() {
        *total_s.entry(*phase).or_default() += duration_s;
    }
    let (&first, _) = total_s.iter().max_by(|a, b| a.1.total_cmp(b.1))?;
    let mut found: BTreeMap<Vec<usize>, (usize, Vec<f64>)> = BTreeMap::new();
    let mut most = 0;
    for spans in motions {
        let starts: Vec<usize> = (0..spans.len()).filter(|&i| spans[i].0 == first).collect();
        most = most.max(starts.len().saturating_sub(1));
        for pair in starts.windows(2) {
            let stride = &spans[pair[0]..pair[1]];
            let order = stride.iter().map(|(phase, _)| *phase).collect();
            let (strides, sums) = found.entry(order).or_insert((0, vec![0.0; stride.len()]));
            *strides += 1;
            for (sum, (_, duration_s)) in sums.iter_mut().zip(stride) {
                *sum += duration_s;
            }
        }
    }
    let (order, (strides, sums)) = found.into_iter().max_by_key(|(_, (strides, _))| *strides)?;
    let mean_s = sums.iter().map(|sum| sum / strides as f64);
    (most >= LEAST_STRIDES).then(|| order.into_iter().zip(mean_s).collect())
}
