use std::borrow::Cow;

use super::aslip::AslipRollout;
use super::coordinates::LiftSums;
use super::*;
use crate::recording::mismatch::notes;

#[derive(Debug, Clone)]
pub struct SegmentRun<'a> {
    /// The recorded one, or a piece of it in the axes of its heading ([`Segment::by_heading`]).
    pub segment: Cow<'a, Segment>,
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
    /// The motions as they are recorded.
    pub recorded: Vec<&'a Segment>,
    pub runs: Vec<SegmentRun<'a>>,
    pub full: CoordinateSums,
    pub restarted: CoordinateSums,
    /// Residuals of a robot that keeps the velocity it has at the start, over whole segments and restarted.
    pub constant_velocity: [CoordinateSums; 2],
    /// The same of latent coordinates that keep their velocity.
    pub constant_latent_velocity: [CoordinateSums; 2],
    pub pointwise: PointwiseSums,
    /// Residuals of `decode(encode(x))`: of a prediction without any error of the dynamics.
    pub decoded: CoordinateSums,
    pub baselines: Vec<Baseline>,
    pub linearised: Vec<Option<LinearisedPhase>>,
    /// Of walks.
    pub stride: Option<StrideGrowth>,
    /// For walks: residuals of the model, of a constant velocity and of a constant latent velocity, restarted every
    /// stride.
    pub over_stride: Option<[CoordinateSums; 3]>,
    pub lift: LiftSums,
    pub active_terms: usize,
    pub remarks: Vec<String>,
}

#[derive(Debug, Clone)]
pub struct Horizon {
    pub name: String,
    /// Coordinates of the centre of mass in the model. Their errors follow those of the robot's coordinates.
    pub mass_centre: Vec<MassCentre>,
    /// The model, then baselines; errors in SI units. The rigid body has errors of the body alone.
    pub predictors: Vec<(&'static str, CoordinateSums)>,
}

impl<'a> Assessment<'a> {
    /// Simulates `model` over all segments of `recordings` and measures it.
    pub fn over(
        model: &ReducedModel,
        recordings: &'a [Recording],
        restart_every_s: f64,
    ) -> Result<Self> {
        let recorded: Vec<&Segment> = (recordings.iter())
            .flat_map(|recording| &recording.segments)
            .collect();
        let pieces: Vec<Cow<'a, Segment>> = (recorded.iter())
            .flat_map(|segment| segment.by_heading())
            .collect();
        let segments: Vec<&Segment> = pieces.iter().map(|piece| &**piece).collect();
        let compiled = CompiledModel::new(model)?;
        let (names, units) = match model.state() {
            Some(state) => (state.names.clone(), state.units.clone()),
            None => (Robot::state_names().to_vec(), Robot::state_units().to_vec()),
        };
        let full = CoordinateSums::new(model)?;
        let rule = model.input_rule()?;
        let stride = stride_s(recorded.iter().copied()).map(Restart::Every);
        let mut assessment = Self {
            names,
            units,
            restart_every_s,
            runs: Vec::with_capacity(segments.len()),
            recorded,
            restarted: full.clone(),
            constant_velocity: [full.clone(), full.clone()],
            constant_latent_velocity: [full.clone(), full.clone()],
            decoded: full.clone(),
            over_stride: stride.map(|_| [(); 3].map(|()| full.clone())),
            full,
            pointwise: PointwiseSums::new(model),
            baselines: Baseline::all(&rule, &segments)?,
            linearised: Vec::new(),
            stride: None,
            lift: LiftSums::default(),
            active_terms: model.phases().iter().map(|p| p.active_count()).sum(),
            remarks: Vec::new(),
        };
        let restart = Restart::Every(restart_every_s);
        for piece in pieces {
            let segment = &*piece;
            let latent = LatentSegment::encode(model, segment)?;
            let full = rollout(&compiled, &latent, Restart::Never);
            let restarted = rollout(&compiled, &latent, restart);
            (assessment.full).add_rollout(model, segment, &latent, &full)?;
            (assessment.restarted).add_rollout(model, segment, &latent, &restarted)?;
            let constant = assessment.constant_velocity.iter_mut();
            for (sums, rollout) in constant.zip([&full, &restarted]) {
                sums.add_constant_velocity(segment, &latent, rollout);
            }
            let constant = assessment.constant_latent_velocity.iter_mut();
            for (sums, rollout) in constant.zip([&full, &restarted]) {
                sums.add_constant_latent_velocity(model, segment, &latent, rollout)?;
            }
            if let Some((restart, [own, constant, in_latent])) =
                stride.zip(assessment.over_stride.as_mut())
            {
                let rollout = rollout(&compiled, &latent, restart);
                own.add_rollout(model, segment, &latent, &rollout)?;
                constant.add_constant_velocity(segment, &latent, &rollout);
                in_latent.add_constant_latent_velocity(model, segment, &latent, &rollout)?;
            }
            assessment.pointwise.add(model, segment, &latent)?;
            assessment.decoded.add_decoded(model, segment, &latent)?;
            assessment.lift.add(model, segment)?;
            let baselines = assessment.baselines.iter_mut();
            let baselines = baselines.map(|baseline| baseline.add(&rule, segment, restart));
            let baselines = baselines.collect::<Result<_, _>>()?;
            assessment.runs.push(SegmentRun {
                segment: piece,
                full,
                restarted,
                baselines,
                latent,
            });
        }
        let latent: Vec<&LatentSegment> = assessment.runs.iter().map(|run| &run.latent).collect();
        let linearised = linearise_phases(&compiled, &latent);
        assessment.stride = StrideGrowth::of(model, &linearised, &latent);
        assessment.linearised = linearised;
        assessment.remarks = remarks_of(model, recordings, &assessment.pointwise)?;
        Ok(assessment)
    }

    /// Mean square of `decode(encode(x)) - x` over all coordinates, in scaled units (equation 16).
    pub fn decoder_mean_square(&self) -> Option<f64> {
        self.pointwise.decoder.fit().map(|fit| fit.rms.powi(2))
    }

    pub fn combined_loss(&self) -> Option<f64> {
        combined_loss(self.decoder_mean_square()?, self.active_terms, LAMBDA)
    }

    pub fn fit(&self, sums: &CoordinateSums, name: &str) -> Option<Fit> {
        let index = self.names.iter().position(|known| known == name)?;
        sums.fits()[index]
    }
}

/// Reasons against a model on these recordings: another robot ([`notes`]) or unexplained accelerations.
pub fn remarks(model: &ReducedModel, recordings: &[Recording]) -> Result<Vec<String>> {
    let mut pointwise = PointwiseSums::new(model);
    let segments = recordings.iter().flat_map(|recording| &recording.segments);
    for piece in segments.flat_map(Segment::by_heading) {
        let latent = LatentSegment::encode(model, &piece)?;
        pointwise.add(model, &piece, &latent)?;
    }
    remarks_of(model, recordings, &pointwise)
}

fn remarks_of(
    model: &ReducedModel,
    recordings: &[Recording],
    pointwise: &PointwiseSums,
) -> Result<Vec<String>> {
    let robot = model.robot()?;
    let of_recordings = (recordings.iter()).flat_map(|recording| notes(recording, robot));
    Ok((of_recordings.chain(unexplained(model, pointwise))).collect())
}

/// `R^2` of accelerations below that of the training; single jumps of another controller are up to 1.6 below.
const BELOW_TRAINING: f64 = 2.0;

/// Accelerations explained worse than by their mean and than in training; in flight they hardly vary.
fn unexplained(model: &ReducedModel, pointwise: &PointwiseSums) -> Vec<String> {
    let accelerations = pointwise.acceleration.iter().map(FitSums::r2);
    let phases = model.phases().iter().zip(accelerations).enumerate();
    let unlike = phases.filter_map(|(index, (phase, r2))| {
        let bound = training_r2(model, index).map_or(0.0, |r2| (r2 - BELOW_TRAINING).min(0.0));
        let r2 = r2?;
        (!phase.feet.matches([false; 4]) && r2 < bound).then(|| {
            format!(
                "in {} the model's latent accelerations have a larger error than their mean (R^2 {r2:.2}). Either its \
                 coefficients are wrong, or the recordings are of another robot, signs, axes or kind of motion than \
                 those of the training. Do not rely on predictions or torques there",
                phase.name
            )
        })
    });
    unlike.collect()
}

/// Refinement by rollouts may have traded it for predictions.
fn training_r2(model: &ReducedModel, phase: usize) -> Option<f64> {
    let training = model.provenance().get("report")?.get("training")?;
    training.get("ddz_r2")?.get(phase)?.as_f64()
}

#[derive(Debug, thiserror::Error)]
pub enum EvaluateError {
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    Lower(#[from] LowerError),
    #[error(transparent)]
    Recording(#[from] RecordingError),
    #[error(transparent)]
    Sim(#[from] SimError),
    #[error(transparent)]
    Control(#[from] MpcError),
}
