//! Recordings as training data: scaled, cut into the phases of the model.

use std::ops::Range;
use std::path::PathBuf;

use nalgebra::{DMatrix, DVector};

use super::error::TrainError;
use super::smooth::moving_average;
use crate::recording::phases::FeetPattern;
use crate::recording::{PhaseRule, Recording, Segment};
use crate::robot::{JOINT_DIM, Robot, STATE_DIM};

/// Fewest samples of a segment, and of a phase over all segments.
pub const MIN_SAMPLES: usize = 50;

/// Factors from SI to scaled units, one a coordinate.
#[derive(Clone, Debug, PartialEq)]
pub struct Scaling {
    /// Of the state, 18.
    pub state: DVector<f64>,
    /// Of the input, 18.
    pub input: DVector<f64>,
}

/// Factors from SI to scaled units by kind of quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScaleOptions {
    /// On all 18 states.
    pub state: f64,
    /// On joint torques.
    pub torque: f64,
    /// On linear body forces.
    pub force: f64,
    /// On body moments.
    pub moment: f64,
}

impl ScaleOptions {
    /// One factor for everything, as the paper has it.
    pub fn uniform(factor: f64) -> Self {
        Self {
            state: factor,
            torque: factor,
            force: factor,
            moment: factor,
        }
    }

    /// The factor of every coordinate.
    pub fn factors(&self) -> Scaling {
        let input = DVector::from_fn(STATE_DIM, |i, _| match i {
            0..JOINT_DIM => self.torque,
            i if i < JOINT_DIM + 3 => self.force,
            _ => self.moment,
        });
        Scaling {
            state: DVector::from_element(STATE_DIM, self.state),
            input,
        }
    }
}

impl Default for ScaleOptions {
    /// State and torques 0.1, forces 0.005, moments 0.05: all inputs then are of the size of the torques.
    fn default() -> Self {
        Self {
            state: 0.1,
            torque: 0.1,
            force: 0.005,
            moment: 0.05,
        }
    }
}

/// One continuous jump (a segment of a recording); samples are columns, all in scaled units.
#[derive(Clone, Debug)]
pub struct Jump {
    /// File it comes from.
    pub path: PathBuf,
    /// Time of every sample.
    pub time_s: Vec<f64>,
    /// States, `18 x n`.
    pub x: DMatrix<f64>,
    /// Velocities, `18 x n`.
    pub dx: DMatrix<f64>,
    /// Accelerations smoothed within each phase, `18 x n`.
    pub ddx: DMatrix<f64>,
    /// Inputs `[tau; F]`, `18 x n`.
    pub u: DMatrix<f64>,
    /// Index of the model's phase at every sample.
    pub phase: Vec<usize>,
    /// Maximal runs of one phase.
    pub spans: Vec<(usize, Range<usize>)>,
}

impl Jump {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.time_s.len()
    }

    /// Whether there is no sample.
    pub fn is_empty(&self) -> bool {
        self.time_s.is_empty()
    }
}

/// All jumps of a set of recordings, with the phases of the model.
#[derive(Clone, Debug)]
pub struct Dataset {
    /// Jumps in the order of the files and their segments.
    pub jumps: Vec<Jump>,
    /// Phases in the order of the model file.
    pub phases: PhaseRule,
    /// Units of everything in [`Self::jumps`].
    pub scaling: Scaling,
}

/// Which quantity of a [`Jump`] to gather.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// States.
    X,
    /// Velocities.
    Dx,
    /// Smoothed accelerations.
    Ddx,
    /// Inputs.
    U,
}

impl Dataset {
    /// Takes the samples of `recordings`, cut into `phases`.
    ///
    /// `smoothing` is the window of the moving average over accelerations, in samples.
    ///
    /// # Errors
    /// [`TrainError::TooFewSamples`] for a segment under 50 samples; [`TrainError::Recording`] where no phase
    /// matches or a leg in contact is singular.
    pub fn new(
        recordings: &[Recording],
        robot: &Robot,
        phases: &PhaseRule,
        scaling: &Scaling,
        smoothing: usize,
    ) -> Result<Self, TrainError> {
        let source = Source {
            robot,
            phases,
            scaling,
            smoothing,
        };
        let segments = recordings.iter().flat_map(|recording| &recording.segments);
        let jumps = segments
            .map(|segment| source.jump(segment))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            jumps,
            phases: phases.clone(),
            scaling: scaling.clone(),
        })
    }

    /// Samples of one quantity side by side, of one phase or of all, `18 x samples`.
    pub fn gather(&self, quantity: Quantity, phase: Option<usize>) -> DMatrix<f64> {
        let total = self.samples(phase);
        let mut gathered = DMatrix::zeros(STATE_DIM, total);
        let mut at = 0;
        for jump in &self.jumps {
            let source = match quantity {
                Quantity::X => &jump.x,
                Quantity::Dx => &jump.dx,
                Quantity::Ddx => &jump.ddx,
                Quantity::U => &jump.u,
            };
            for (index, range) in &jump.spans {
                if phase.is_none_or(|wanted| wanted == *index) {
                    gathered
                        .columns_mut(at, range.len())
                        .copy_from(&source.columns(range.start, range.len()));
                    at += range.len();
                }
            }
        }
        gathered
    }

    /// Number of samples of one phase or of all.
    pub fn samples(&self, phase: Option<usize>) -> usize {
        self.jumps
            .iter()
            .flat_map(|jump| &jump.spans)
            .filter(|(index, _)| phase.is_none_or(|wanted| wanted == *index))
            .map(|(_, range)| range.len())
            .sum()
    }

    /// Complains unless there are jumps and enough samples of every phase.
    ///
    /// # Errors
    /// [`TrainError::NoRecording`] without a jump, [`TrainError::PhaseSamples`] for a phase under 50 samples.
    pub fn check_for_training(&self) -> Result<(), TrainError> {
        if self.jumps.is_empty() {
            return Err(TrainError::NoRecording { set: "training" });
        }
        for (index, phase) in self.phases.patterns.iter().enumerate() {
            let found = self.samples(Some(index));
            if found < MIN_SAMPLES {
                let needed = match phase.feet {
                    FeetPattern::None => "all feet leave the ground",
                    FeetPattern::Any | FeetPattern::OneOf(_) => "these feet touch the ground",
                };
                return Err(TrainError::PhaseSamples {
                    phase: phase.name.clone(),
                    found,
                    expected: MIN_SAMPLES,
                    needed,
                });
            }
        }
        Ok(())
    }
}

/// What turns a segment into a jump.
struct Source<'a> {
    robot: &'a Robot,
    phases: &'a PhaseRule,
    scaling: &'a Scaling,
    smoothing: usize,
}

impl Source<'_> {
    fn jump(&self, segment: &Segment) -> Result<Jump, TrainError> {
        let n = segment.len();
        if n < MIN_SAMPLES {
            return Err(TrainError::TooFewSamples {
                path: segment.path.clone(),
                row: segment.first_row,
                found: n,
                expected: MIN_SAMPLES,
            });
        }
        let mut phase = vec![0; n];
        let mut spans = Vec::new();
        let mut ddx = DMatrix::zeros(STATE_DIM, n);
        for span in self.phases.spans(segment)? {
            phase[span.range.clone()].fill(span.phase);
            let smooth = moving_average(
                &segment.ddx.columns_range(span.range.clone()).into_owned(),
                self.smoothing,
            );
            ddx.columns_range_mut(span.range.clone()).copy_from(&smooth);
            spans.push((span.phase, span.range));
        }
        Ok(Jump {
            path: segment.path.clone(),
            time_s: segment.time_s.clone(),
            x: scaled(segment.x.clone(), &self.scaling.state),
            dx: scaled(segment.dx.clone(), &self.scaling.state),
            ddx: scaled(ddx, &self.scaling.state),
            u: scaled(segment.input(self.robot)?, &self.scaling.input),
            phase,
            spans,
        })
    }
}

/// Every row times its factor.
fn scaled(mut rows: DMatrix<f64>, factors: &DVector<f64>) -> DMatrix<f64> {
    rows.row_iter_mut()
        .zip(factors.iter())
        .for_each(|(mut row, factor)| row *= *factor);
    rows
}
