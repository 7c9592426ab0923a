//! Recordings as training data: scaled, cut into the phases of the model, divided into sets.

use super::*;
use crate::evaluate::is_plausible;
use crate::recording::Segment;
use crate::recording::preprocess::moving_average;
use crate::robot::ContactFlags;

/// Fewest samples of a segment, and of a phase over all segments.
pub const MIN_SAMPLES: usize = 50;
const LEAST_SPANS: usize = 6; // of a motion in the mean, from which on it counts as a walk

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Scaling {
    pub state: DVector<f64>,
    pub input: DVector<f64>,
}

/// Factors from SI to scaled units by kind of quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScaleOptions {
    pub state: f64,
    pub torque: f64,
    pub force: f64,
    pub moment: f64,
}

impl ScaleOptions {
    pub(crate) fn uniform(factor: f64) -> Self {
        Self {
            state: factor,
            torque: factor,
            force: factor,
            moment: factor,
        }
    }

    /// State and torques 0.1, forces 0.005, moments 0.05 in the body's axes, so that all have similar sizes. In the
    /// world's axes moments of a jump nearly cancel, and the remainder is the least exact part of the input: 0.02.
    pub fn in_frame(frame: WrenchFrame) -> Self {
        Self {
            state: 0.1,
            torque: 0.1,
            force: 0.005,
            moment: match frame {
                WrenchFrame::Body => 0.05,
                WrenchFrame::World | WrenchFrame::Ground => 0.02,
            },
        }
    }

    pub(super) fn factors(&self) -> Scaling {
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

/// One continuous jump (a segment of a recording), scaled units; samples are columns: `18 x n`, of the losses `12 x n`.
#[derive(Clone, Debug)]
pub(super) struct Jump {
    pub path: PathBuf,
    pub time_s: Vec<f64>,
    pub x: DMatrix<f64>,
    pub dx: DMatrix<f64>,
    pub ddx: DMatrix<f64>, // smoothed within each phase
    pub u: DMatrix<f64>,   // [tau; F; M]
    /// Joint friction and rotor inertia, which recorded torques have on top of `u`; none without actuators.
    pub losses: Option<DMatrix<f64>>,
    pub feet: Vec<ContactFlags>,
    pub phase: Vec<usize>,
    pub spans: Vec<(usize, Range<usize>)>, // maximal runs of one phase
    pub is_image: bool,                    // a mirror image of a recorded jump
    /// Samples whose recorded torques are no torques of the robot, see [`is_plausible`].
    pub implausible: Vec<usize>,
}

impl Jump {
    pub(super) fn samples(&self) -> usize {
        self.time_s.len()
    }
}

#[derive(Clone, Debug)]
pub(super) struct Dataset {
    pub jumps: Vec<Jump>, // in the order of the files and their segments
    pub phases: PhaseRule,
    pub scaling: Scaling,        // of the jumps
    pub(super) smoothing: usize, // window of the moving average over accelerations, samples
    pub(super) rule: InputRule,
}

impl Dataset {
    pub(super) fn new(
        recordings: &[Recording],
        rule: &InputRule,
        phases: &PhaseRule,
        scaling: &Scaling,
        smoothing: usize,
    ) -> Result<Self> {
        let mut dataset = Self {
            jumps: Vec::new(),
            phases: phases.clone(),
            scaling: scaling.clone(),
            smoothing,
            rule: rule.clone(),
        };
        for segment in recordings.iter().flat_map(|recording| &recording.segments) {
            for piece in segment.by_heading() {
                dataset.jumps.push(dataset.jump(&piece)?);
            }
        }
        Ok(dataset)
    }

    /// Adds the mirror images of recordings, after all other jumps.
    pub(super) fn add_mirror_images(&mut self, recordings: &[Recording]) -> Result<()> {
        let robot = self.rule.robot();
        for segment in recordings.iter().flat_map(|recording| &recording.segments) {
            for piece in segment.by_heading() {
                let image = self.jump(&piece.mirrored(robot))?;
                self.jumps.push(Jump {
                    is_image: true,
                    ..image
                });
            }
        }
        Ok(())
    }

    pub(super) fn median_step_s(&self) -> f64 {
        let pairs = self.jumps.iter().flat_map(|jump| jump.time_s.windows(2));
        let mut steps: Vec<f64> = pairs.map(|pair| pair[1] - pair[0]).collect();
        steps.sort_by(f64::total_cmp);
        // Recorded times carry rounding; a microsecond is below every sampling.
        let median = steps.get(steps.len() / 2);
        median.map_or(0.002, |step| (step * 1e6).round() / 1e6)
    }

    /// Whether feet change so often that the motions are walks.
    pub(super) fn walks(&self) -> bool {
        let spans: usize = self.jumps.iter().map(|motion| motion.spans.len()).sum();
        spans >= LEAST_SPANS * self.jumps.len()
    }

    /// One phase or all side by side, `18 x samples`; likewise the inputs.
    pub(super) fn states(&self, phase: Option<usize>) -> DMatrix<f64> {
        self.gather(phase, |jump| &jump.x)
    }

    pub(super) fn inputs(&self, phase: Option<usize>) -> DMatrix<f64> {
        self.gather(phase, |jump| &jump.u)
    }

    fn gather(&self, phase: Option<usize>, of: impl Fn(&Jump) -> &DMatrix<f64>) -> DMatrix<f64> {
        let mut all = DMatrix::zeros(STATE_DIM, self.samples(phase));
        let mut at = 0;
        for (jump, range) in self.spans(phase) {
            let samples = of(&self.jumps[jump]).columns_range(range);
            all.columns_mut(at, samples.ncols()).copy_from(&samples);
            at += samples.ncols();
        }
        all
    }

    pub(super) fn state_std(&self) -> DVector<f64> {
        let states = self.states(None);
        let share = 1.0 / states.ncols() as f64;
        let mut variance = mean(&states).map(|mean| -(mean * mean));
        for column in states.column_iter() {
            for (sum, value) in variance.iter_mut().zip(&column) {
                *sum += share * value * value;
            }
        }
        variance.map(f64::sqrt)
    }

    /// Covariance of the states and second moment of the inputs about zero, over all samples.
    pub(super) fn moments(&self) -> Moments {
        let (x, u) = (self.states(None), self.inputs(None));
        let (deviations, n) = (centred(&x, &mean(&x)), x.ncols().max(1) as f64);
        Moments {
            state: &deviations * deviations.transpose() / n,
            input: &u * u.transpose() / n,
        }
    }

    /// Mean and covariance of the SI inputs of one phase; all zero without a sample.
    pub(super) fn input_statistics(&self, phase: usize) -> InputStatistics {
        let mut u = self.inputs(Some(phase));
        for (mut row, factor) in u.row_iter_mut().zip(&self.scaling.input) {
            row /= *factor;
        }
        InputStatistics::of_samples(&u)
    }

    pub(super) fn samples(&self, phase: Option<usize>) -> usize {
        self.spans(phase).map(|(_, range)| range.len()).sum()
    }

    /// Maximal runs of one phase or of all, each with the index of its jump.
    pub(super) fn spans(
        &self,
        phase: Option<usize>,
    ) -> impl Iterator<Item = (usize, Range<usize>)> {
        let jumps = self.jumps.iter().enumerate();
        let all = jumps.flat_map(|(jump, of)| of.spans.iter().map(move |span| (jump, span)));
        let own = all.filter(move |(_, (of, _))| phase.is_none_or(|wanted| wanted == *of));
        own.map(|(jump, (_, range))| (jump, range.clone()))
    }

    pub(super) fn check_for_training(&self) -> Result<()> {
        if self.jumps.is_empty() {
            return Err(TrainError::NoRecording);
        }
        for (index, phase) in self.phases.patterns.iter().enumerate() {
            let found = self.samples(Some(index));
            if found < MIN_SAMPLES {
                let needed = match phase.feet {
                    FeetRule::None => "all feet leave the ground",
                    FeetRule::Any | FeetRule::Patterns(_) => "these feet touch the ground",
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

    fn jump(&self, segment: &Segment) -> Result<Jump> {
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
        for span in self.phases.spans(segment)? {
            phase[span.range.clone()].fill(span.phase);
            spans.push((span.phase, span.range));
        }
        let rule = &self.rule;
        Ok(Jump {
            path: segment.path.clone(),
            time_s: segment.time_s.clone(),
            x: scaled(segment.x.clone(), &self.scaling.state),
            dx: scaled(segment.dx.clone(), &self.scaling.state),
            ddx: scaled(self.smoothed(segment, &spans), &self.scaling.state),
            u: scaled(segment.input(rule)?, &self.scaling.input),
            losses: (rule.actuators().is_some())
                .then(|| scaled(segment.losses(rule), &self.scaling.input)),
            feet: segment.feet.clone(),
            phase,
            spans,
            is_image: false,
            implausible: (0..n)
                .filter(|&sample| !is_plausible(rule.robot(), &segment.torque(sample)))
                .collect(),
        })
    }

    fn smoothed(&self, segment: &Segment, spans: &[(usize, Range<usize>)]) -> DMatrix<f64> {
        let mut ddx = DMatrix::zeros(STATE_DIM, segment.len());
        for (_, range) in spans {
            let span = segment.ddx.columns_range(range.clone()).into_owned();
            ddx.columns_range_mut(range.clone())
                .copy_from(&moving_average(&span, self.smoothing));
        }
        ddx
    }
}

pub(super) fn mean(samples: &DMatrix<f64>) -> DVector<f64> {
    let mut mean = DVector::zeros(samples.nrows());
    for column in samples.column_iter() {
        mean.axpy(1.0 / samples.ncols() as f64, &column, 1.0);
    }
    mean
}

pub(super) fn scaled(mut rows: DMatrix<f64>, factors: &DVector<f64>) -> DMatrix<f64> {
    rows.row_iter_mut()
        .zip(factors.iter())
        .for_each(|(mut row, factor)| row *= *factor);
    rows
}

pub(super) fn centred(samples: &DMatrix<f64>, mean: &DVector<f64>) -> DMatrix<f64> {
    let mut centred = samples.clone();
    let columns = centred.column_iter_mut();
    columns.for_each(|mut column| column -= mean);
    centred
}

/// Shares of the jumps for training, validation and test, such as 14, 3 and 3: any unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Split {
    shares: [usize; 3],
}

impl FromStr for Split {
    type Err = String;

    /// Two or three whole numbers separated by commas; the first is not 0.
    fn from_str(text: &str) -> Result<Self, String> {
        let refused = || {
            format!(
                "found `{text}`, expected shares for training, validation and test such as 14,3,3"
            )
        };
        let numbers = text.split(',').map(|number| number.trim().parse::<usize>());
        let numbers: Vec<usize> = numbers.collect::<Result<_, _>>().map_err(|_| refused())?;
        let shares = match numbers[..] {
            [training, validation] => [training, validation, 0],
            [training, validation, test] => [training, validation, test],
            _ => return Err(refused()),
        };
        if shares[0] == 0 || shares.iter().any(|share| *share > 1_000_000) {
            return Err(refused());
        }
        Ok(Self { shares })
    }
}

impl fmt::Display for Split {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [training, validation, test] = self.shares;
        write!(f, "{training},{validation},{test}")
    }
}

impl Split {
    /// Draws the numbers of the jumps of each set, rising, by a random order that depends on `seed` and `jumps` alone.
    ///
    /// # Errors
    /// [`TrainError::Split`] if there are fewer jumps than sets.
    pub fn of(&self, jumps: usize, seed: u64) -> Result<[Vec<usize>; 3]> {
        let counts = self.counts(jumps)?;
        let order = shuffled(jumps, seed);
        let (training, rest) = order.split_at(counts[0]);
        let (validation, test) = rest.split_at(counts[1]);
        Ok([training, validation, test].map(|set| {
            let mut set = set.to_vec();
            set.sort_unstable();
            set
        }))
    }

    /// Jumps a set: in proportion, the largest remainders rounded up, at least one where the share is not 0.
    fn counts(&self, jumps: usize) -> Result<[usize; 3]> {
        let wanted = self.shares.iter().filter(|share| **share > 0).count();
        if jumps < wanted {
            return Err(TrainError::Split {
                found: jumps,
                expected: wanted,
            });
        }
        let total: usize = self.shares.iter().sum();
        let mut counts = self.shares.map(|share| match share {
            0 => 0,
            share => (share * jumps / total).max(1),
        });
        let owed = |counts: &[usize; 3], set: usize| {
            (self.shares[set] * jumps) as i64 - (counts[set] * total) as i64
        };
        while counts.iter().sum::<usize>() != jumps {
            let given: usize = counts.iter().sum();
            let sets = (0..3).filter(|set| self.shares[*set] > 0);
            // `max_by_key` returns the last of equals: reversed, training comes first.
            if given < jumps {
                let next = sets.rev().max_by_key(|set| owed(&counts, *set));
                counts[next.expect("invariant: a share is not 0")] += 1;
            } else {
                let next = sets
                    .filter(|set| counts[*set] > 1)
                    .min_by_key(|set| owed(&counts, *set));
                counts[next.expect("invariant: more jumps than sets")] -= 1;
            }
        }
        Ok(counts)
    }
}

/// The numbers below `count` in a random order (Fisher and Yates).
fn shuffled(count: usize, seed: u64) -> Vec<usize> {
    let mut random = Random::new(seed);
    let mut order: Vec<usize> = (0..count).collect();
    for last in (1..count).rev() {
        order.swap(last, random.below(last + 1));
    }
    order
}
