//! Everything that a model and recordings show together, in one pass.

use super::aslip::AslipRollout;
use super::baseline::Baseline;
use super::coordinates::{CoordinateSums, PointwiseSums};
use super::error::EvaluateError;
use super::lift::{LAMBDA, LiftSums, combined_loss};
use super::linearised::{LinearisedPhase, linearise_phases};
use super::metrics::Fit;
use super::remarks::remarks;
use crate::lower::CompiledModel;
use crate::model::ReducedModel;
use crate::recording::{Recording, Segment};
use crate::robot::Robot;
use crate::sim::{LatentSegment, Restart, Rollout, rollout};

#[derive(Debug, Clone)]
pub struct SegmentRun<'a> {
    pub segment: &'a Segment,
    pub latent: LatentSegment,
    pub full: Rollout,
    pub restarted: Rollout,
    /// The baselines' rollouts over the whole segment, in the order of [`Assessment::baselines`].
    pub baselines: Vec<AslipRollout>,
}

#[derive(Debug, Clone)]
pub struct Assessment<'a> {
    pub names: Vec<String>,
    pub units: Vec<String>,
    pub restart_every_s: f64,
    pub runs: Vec<SegmentRun<'a>>,
    pub full: CoordinateSums,
    pub restarted: CoordinateSums,
    /// Residuals of a robot that keeps the velocity it has at the start, over whole segments and restarted.
    pub constant_velocity: [CoordinateSums; 2],
    pub pointwise: PointwiseSums,
    pub baselines: Vec<Baseline>,
    pub linearised: Vec<Option<LinearisedPhase>>,
    pub lift: LiftSums,
    pub active_terms: usize,
    pub remarks: Vec<String>,
}

impl<'a> Assessment<'a> {
    /// Simulates `model` over all segments of `recordings` and measures it.
    ///
    /// # Errors
    /// [`EvaluateError::Model`] for a latent-only model, [`EvaluateError::Sim`] and [`EvaluateError::Recording`] for samples
    /// that cannot be encoded or integrated.
    pub fn over(
        model: &ReducedModel,
        recordings: &'a [Recording],
        restart_every_s: f64,
    ) -> Result<Self, EvaluateError> {
        let segments: Vec<&Segment> = (recordings.iter())
            .flat_map(|recording| &recording.segments)
            .collect();
        let compiled = CompiledModel::new(model)?;
        let (names, units) = match model.state() {
            Some(state) => (state.names.clone(), state.units.clone()),
            None => (Robot::state_names().to_vec(), Robot::state_units().to_vec()),
        };
        let full = CoordinateSums::new(model)?;
        let rule = model.input_rule()?;
        let mut assessment = Self {
            names,
            units,
            restart_every_s,
            runs: Vec::with_capacity(segments.len()),
            restarted: full.clone(),
            constant_velocity: [full.clone(), full.clone()],
            full,
            pointwise: PointwiseSums::new(model),
            baselines: Baseline::all(&rule, &segments)?,
            linearised: Vec::new(),
            lift: LiftSums::default(),
            active_terms: model.phases().iter().map(|p| p.active_count()).sum(),
            remarks: remarks(model, recordings)?,
        };
        let restart = Restart::Every(restart_every_s);
        for segment in segments {
            let latent = LatentSegment::encode(model, segment)?;
            let full = rollout(&compiled, &latent, Restart::Never);
            let restarted = rollout(&compiled, &latent, restart);
            (assessment.full).add_rollout(model, segment, &latent, &full)?;
            (assessment.restarted).add_rollout(model, segment, &latent, &restarted)?;
            for (sums, rollout) in
                (assessment.constant_velocity.iter_mut()).zip([&full, &restarted])
            {
                sums.add_constant_velocity(segment, &latent, rollout);
            }
            assessment.pointwise.add(model, segment, &latent)?;
            assessment.lift.add(model, segment)?;
            let baselines = assessment.baselines.iter_mut();
            let baselines = baselines.map(|baseline| baseline.add(&rule, segment, restart));
            assessment.runs.push(SegmentRun {
                segment,
                full,
                restarted,
                baselines: baselines.collect::<Result<_, _>>()?,
                latent,
            });
        }
        let latent: Vec<&LatentSegment> = assessment.runs.iter().map(|run| &run.latent).collect();
        assessment.linearised = linearise_phases(&compiled, &latent);
        Ok(assessment)
    }

    /// Mean square of `decode(encode(x)) - x` over all coordinates, in scaled units (equation 16).
    pub fn decoder_mean_square(&self) -> Option<f64> {
        self.pointwise.decoder.fit().map(|fit| fit.rms.powi(2))
    }

    /// The combined loss of equation (29).
    pub fn combined_loss(&self) -> Option<f64> {
        combined_loss(self.decoder_mean_square()?, self.active_terms, LAMBDA)
    }

    pub fn fit(&self, sums: &CoordinateSums, name: &str) -> Option<Fit> {
        let index = self.names.iter().position(|known| known == name)?;
        sums.fits()[index]
    }
}
