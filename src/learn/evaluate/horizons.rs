//! Prediction errors of all coordinates over several horizons, compared with two baselines: a constant velocity and a
//! robot at rest.

use std::ops::Range;

use super::coordinates::coasted;
use super::*;
use crate::recording::{CHATTER_SAMPLES, PhaseRule, Stance};
use crate::sim::{restart_windows, rollout_over};

/// Times between restarts, s.
const RESTARTS_S: [f64; 3] = [0.1, 0.2, 0.3];

impl Horizon {
    /// Predictions with restarts every 0.1, 0.2 and 0.3 s, all samples; and from each take-off, the sample of the
    /// touchdown only.
    pub fn all(model: &ReducedModel, assessment: &Assessment<'_>) -> Result<Vec<Self>> {
        let names = ["model", "constant velocity", "at rest"];
        let compiled = CompiledModel::new(model)?;
        let sums = CoordinateSums::new(model)?;
        let restarts = RESTARTS_S.map(|time_s| (format!("{time_s} s"), Restart::Every(time_s)));
        let flights = ("take-off to touchdown".to_owned(), Restart::Never);
        let all = restarts.into_iter().chain([flights]);
        all.map(|(name, restart)| {
            let mut horizon = Self {
                name,
                predictors: names.map(|name| (name, sums.clone())),
            };
            for SegmentRun {
                segment, latent, ..
            } in &assessment.runs
            {
                horizon.add(model, &compiled, (segment, latent), restart)?;
            }
            Ok(horizon)
        })
        .collect()
    }

    fn add(
        &mut self,
        model: &ReducedModel,
        compiled: &CompiledModel,
        (segment, latent): (&Segment, &LatentSegment),
        restart: Restart,
    ) -> Result<()> {
        let is_flight = restart == Restart::Never;
        let windows = match is_flight {
            true => flights(segment)?,
            false => restart_windows(&latent.time_s, restart),
        };
        let rollout = rollout_over(compiled, latent, windows);
        let [(_, own), (_, constant), (_, rest)] = &mut self.predictors;
        for (sample, window, column) in rollout.predictions() {
            let Range { start, end } = window.samples;
            if is_flight && sample + 1 < end {
                continue;
            }
            let phase = latent.phase[sample];
            let x = model.decode(&window.z.column(column).into_owned())?;
            own.add(segment, sample, phase, &x);
            constant.add(segment, sample, phase, &coasted(segment, start, sample));
            rest.add(
                segment,
                sample,
                phase,
                &segment.x.column(start).into_owned(),
            );
        }
        let diverged = rollout.windows.iter();
        own.diverged += diverged.filter(|w| w.diverged_at_s.is_some()).count();
        own.windows += rollout.windows.len();
        Ok(())
    }
}

/// Samples from each take-off to the touchdown after it, both counted.
fn flights(segment: &Segment) -> Result<Vec<Range<usize>>> {
    let rule = PhaseRule::two_phase().with_min_samples(CHATTER_SAMPLES);
    let spans = rule.spans(segment)?.into_iter();
    Ok(spans
        .filter(|span| span.kind == Stance::Flight)
        .filter(|span| span.range.start > 0 && span.range.end < segment.len())
        .map(|span| span.range.start..span.range.end + 1)
        .collect())
}
