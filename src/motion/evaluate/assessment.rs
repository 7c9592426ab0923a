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

/// What was recorded and predicted for one segment.
#[derive(Debug, Clone)]
pub struct SegmentRun<'a> {
    /// The recorded samples.
    pub segment: &'a Segment,
    /// The same as the model sees them.
    pub latent: LatentSegment,
    /// The model's rollout over the whole segment.
    pub full: Rollout,
    /// The model's rollouts between restarts.
    pub restarted: Rollout,
    /// The baselines' rollouts over the whole segment, in the order of [`Assessment::baselines`].
    pub baselines: Vec<AslipRollout>,
}

/// A model compared with recordings.
#[derive(Debug, Clone)]
pub struct Assessment<'a> {
    /// Names of the robot's coordinates.
    pub names: Vec<String>,
    /// Their units.
    pub units: Vec<String>,
    /// Time between restarts, in s.
    pub restart_every_s: f64,
    /// Rollouts, a segment.
    pub runs: Vec<SegmentRun<'a>>,
    /// Residuals of rollouts over whole segments.
    pub full: CoordinateSums,
    /// Residuals of restarted rollouts.
    pub restarted: CoordinateSums,
    /// Residuals of a robot that keeps the velocity it has at the start, over whole segments and restarted.
    pub constant_velocity: [CoordinateSums; 2],
    /// Decoder and latent accelerations.
    pub pointwise: PointwiseSums,
    /// Template models under the same recorded forces.
    pub baselines: Vec<Baseline>,
    /// Linearisation of each phase.
    pub linearised: Vec<Option<LinearisedPhase>>,
    /// What the plain lift loses.
    pub lift: LiftSums,
    /// Active terms, all phases together.
    pub active_terms: usize,
    /// What speaks against using the model on these recordings.
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

    /// Fit of the coordinate with this name.
    pub fn fit(&self, sums: &CoordinateSums, name: &str) -> Option<Fit> {
        let index = self.names.iter().position(|known| known == name)?;
        sums.fits()[index]
    }
}
