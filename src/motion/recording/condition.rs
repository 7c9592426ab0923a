//! Recordings made ready for training: implausible samples are found and,
//! when asked, left out; accelerations are recomputed and rows smoothed, when asked.

use clap::ValueEnum;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use super::check::{Finding, without};
use super::error::{RecordingError, RecordingFault};
use super::preprocess::differences;
use super::segment::{Recording, Segment};
use super::smoothing::SavitzkyGolay;

/// What becomes of samples that a robot cannot have done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ImplausibleSamples {
    /// They stay.
    #[default]
    Keep,
    /// They go, and the segment is divided there.
    LeaveOut,
}

/// Where accelerations come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Accelerations {
    /// The recording's own columns, differences where it has none.
    #[default]
    Recorded,
    /// Differences of the recorded velocities.
    Differences,
}

/// Rows that a filter is applied to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SmoothedRows {
    /// Accelerations only.
    #[default]
    Accelerations,
    /// State, velocities, accelerations and torques.
    All,
}

/// The steps of [`condition`]; by default the recording stays as it is.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ConditionOptions {
    /// What becomes of implausible samples.
    pub implausible: ImplausibleSamples,
    /// Shortest piece between samples left out that is kept; shorter ones go too.
    pub least_samples: usize,
    /// Where accelerations come from.
    pub accelerations: Accelerations,
    /// Filter over whole segments.
    pub smoothing: Option<(SavitzkyGolay, SmoothedRows)>,
}

/// Applies the steps in the order of [`ConditionOptions`] to a recording with these findings; returns it with the
/// number of samples left out: implausible ones and pieces between them that are too short.
///
/// # Errors
/// [`RecordingFault::TooShort`] if nothing long enough remains, or a segment is shorter than the filter.
pub fn condition(
    recording: Recording,
    findings: &[Finding],
    options: &ConditionOptions,
) -> Result<(Recording, usize), RecordingError> {
    let n_samples = recording.sample_count();
    let mut kept = match options.implausible {
        ImplausibleSamples::LeaveOut if !findings.is_empty() => {
            long_enough(without(&recording, findings)?.0, options.least_samples)?
        }
        ImplausibleSamples::LeaveOut | ImplausibleSamples::Keep => recording,
    };
    let left_out = n_samples - kept.sample_count();
    for segment in &mut kept.segments {
        match options.accelerations {
            Accelerations::Recorded => {}
            Accelerations::Differences => {
                segment.ddx = differences(&segment.time_s, &segment.dx);
            }
        }
        if let Some((filter, rows)) = &options.smoothing {
            smooth(segment, filter, *rows)?;
        }
    }
    Ok((kept, left_out))
}

/// Smooths a segment along time.
fn smooth(
    segment: &mut Segment,
    filter: &SavitzkyGolay,
    rows: SmoothedRows,
) -> Result<(), RecordingError> {
    if segment.len() < filter.window() {
        let fault = RecordingFault::too_short(segment.len(), filter.window());
        return Err(fault.at(&segment.path, segment.row(0)));
    }
    let smooth = |m: &DMatrix<f64>| filter.smooth(m).expect("invariant: a window of samples");
    match rows {
        SmoothedRows::Accelerations => segment.ddx = smooth(&segment.ddx),
        SmoothedRows::All => {
            let (time_s, feet) = (segment.time_s.clone(), segment.feet.clone());
            *segment = segment.remade(time_s, feet, smooth);
        }
    }
    Ok(())
}

/// The recording without segments under `least` samples.
fn long_enough(mut recording: Recording, least: usize) -> Result<Recording, RecordingError> {
    let longest = recording.segments.iter().max_by_key(|part| part.len());
    let (row, found) = longest.map_or((1, 0), |part| (part.first_row, part.len()));
    recording.segments.retain(|segment| segment.len() >= least);
    if recording.segments.is_empty() {
        return Err(RecordingFault::too_short(found, least).at(&recording.path, row));
    }
    Ok(recording)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::check::check;
    use crate::robot::Robot;

    /// A robot that stands still, with noise on the accelerations, and one torque that no motor gives.
    fn recording() -> Recording {
        let n = 200;
        let mut torque_nm = DMatrix::from_element(12, n, 1.0);
        torque_nm[(4, 60)] = 900.0;
        torque_nm[(4, 70)] = 900.0;
        let standing = |i: usize, _| match i {
            0..12 => [0.0, 0.7, -1.4][i % 3],
            14 => 0.3,
            _ => 0.0,
        };
        Recording::from(Segment {
            x: DMatrix::from_fn(18, n, standing),
            ddx: DMatrix::from_fn(18, n, |_, j| if j % 2 == 0 { 0.5 } else { -0.5 }),
            torque_nm,
            ..Segment::still("stand.csv", (0..n).map(|i| 0.002 * i as f64).collect())
        })
    }

    /// [`condition`] of a recording with all that is found in it.
    fn conditioned(
        recording: &Recording,
        options: &ConditionOptions,
    ) -> Result<(Recording, usize), RecordingError> {
        let go1 = Robot::by_name("go1").expect("a known robot");
        condition(recording.clone(), &check(recording, go1), options)
    }

    #[test]
    fn condition_by_default_changes_nothing() {
        let out = conditioned(&recording(), &ConditionOptions::default()).expect("sound");
        assert_eq!(out, (recording(), 0));
    }

    #[test]
    fn condition_leaves_out_implausible_samples_and_pieces_too_short_to_learn_from() {
        let options = ConditionOptions {
            implausible: ImplausibleSamples::LeaveOut,
            least_samples: 50,
            ..ConditionOptions::default()
        };
        let (out, left_out) = conditioned(&recording(), &options).expect("sound");
        let pieces: Vec<_> = (out.segments.iter())
            .map(|piece| (piece.first_row, piece.len()))
            .collect();
        assert_eq!(pieces, [(2, 60), (73, 129)]);
        assert_eq!(left_out, 11);

        let options = ConditionOptions {
            least_samples: 150,
            ..options
        };
        let error = conditioned(&recording(), &options).expect_err("nothing remains");
        let expected = "row 73: found 129 consecutive samples, expected at least 150";
        assert!(error.to_string().ends_with(expected), "{error}");
    }

    #[test]
    fn condition_smooths_accelerations_or_takes_them_from_velocities() {
        let filter = SavitzkyGolay::new(11, 2).expect("a filter");
        let smooth = ConditionOptions {
            smoothing: Some((filter, SmoothedRows::Accelerations)),
            ..ConditionOptions::default()
        };
        let before = recording();
        let made = |options| conditioned(&before, options).expect("sound").0;
        let out = made(&smooth);
        let ddx = |recording: &Recording| recording.segments[0].ddx.clone();
        assert!(ddx(&out).norm() < 0.3 * ddx(&before).norm());
        assert_eq!(out.segments[0].torque_nm, before.segments[0].torque_nm);

        let differences = ConditionOptions {
            accelerations: Accelerations::Differences,
            ..ConditionOptions::default()
        };
        let out = made(&differences);
        assert_eq!(ddx(&out).amax(), 0.0);
    }

    #[test]
    fn smoothing_longer_than_a_segment_is_an_error() {
        let mut short = recording();
        short.segments[0] = short.segments[0].slice(0..5);
        let filter = SavitzkyGolay::new(11, 2).expect("a filter");
        let options = ConditionOptions {
            smoothing: Some((filter, SmoothedRows::All)),
            ..ConditionOptions::default()
        };
        let error = conditioned(&short, &options).expect_err("five samples");
        let expected = "found 5 consecutive samples, expected at least 11";
        assert!(error.to_string().ends_with(expected), "{error}");
    }
}
