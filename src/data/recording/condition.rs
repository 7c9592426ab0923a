//! Recordings made ready for training: implausible samples are found and, when asked, left out; accelerations are
//! recomputed and rows smoothed, when asked.

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
/// [`RecordingFault::Unexpected`] if nothing long enough remains, or a segment is shorter than the filter.
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
        if options.accelerations == Accelerations::Differences {
            segment.ddx = differences(&segment.time_s, &segment.dx);
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
