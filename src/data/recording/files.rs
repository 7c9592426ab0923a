//! Sets of recordings: read once, checked and conditioned, held in memory. When asked, implausible samples are left
//! out, accelerations recomputed and rows smoothed.

use super::check::{Finding, without};
use super::mismatch::{Balance, Mismatch, contradiction, mismatches};
use super::preprocess::SavitzkyGolay;
use super::*;

const HALF_SMOOTHING_S: f64 = 0.015; // half the window over which rows of late samples are smoothed, in s
const SMOOTHING_ORDER: usize = 3; // degree of the polynomials that smooth them

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordingFile {
    /// Where it is.
    pub path: PathBuf,
    /// The segments to use, each as a recording of its own; `None` for the whole file as one recording.
    pub segments: Option<Vec<usize>>,
}

/// The recordings of several files, checked and conditioned, in their order, and notes on them.
#[derive(Clone, Debug, Default)]
pub struct RecordingSet {
    pub recordings: Vec<Recording>,
    pub findings: Vec<(PathBuf, Finding)>,
    pub mismatches: Vec<(PathBuf, Mismatch)>,
    pub left_out: usize, // samples
    pub reading: ReadingNotes,
    balances: Vec<(PathBuf, Balance)>,
}

impl RecordingSet {
    /// Reads recordings of `robot`, two at a time on two or more cores; `self` has those that were read before an
    /// error.
    ///
    /// # Errors
    /// The first fault in the order of the files, or a recording that contradicts physics or the others.
    pub fn read(
        &mut self,
        files: &[RecordingFile],
        robot: &'static Robot,
        options: &ConditionOptions,
        reader: &Reader,
    ) -> Outcome<()> {
        let reader = reader.clone().for_robot(robot);
        let read = |file| read_file(file, robot, options, &reader);
        let threads = std::thread::available_parallelism().map_or(1, |n| n.get().min(2));
        for files in files.chunks(threads) {
            let all: Vec<_> = std::thread::scope(|scope| {
                let started = Vec::from_iter(files.iter().map(|file| scope.spawn(|| read(file))));
                let ended = started.into_iter().map(|thread| thread.join());
                ended.map(|read| read.expect("no panic")).collect()
            });
            for read in all {
                let (set, reading) = read?;
                self.reading.add(&reading);
                self.append(set);
            }
        }
        let (paths, balances): (Vec<_>, Vec<_>) = self.balances.drain(..).unzip();
        match contradiction(&balances) {
            None => Ok(()),
            Some((at, found)) => Err(RecordingFault::contradiction(&found).of(&paths[at])),
        }
    }

    pub(crate) fn append(&mut self, other: Self) {
        self.recordings.extend(other.recordings);
        self.findings.extend(other.findings);
        self.mismatches.extend(other.mismatches);
        self.left_out += other.left_out;
        self.balances.extend(other.balances);
    }
}

/// The recordings of the first files as recorded: not checked, conditioned or mended; errors as [`Reader::read`].
pub fn as_recorded(
    files: &[RecordingFile],
    robot: &'static Robot,
    reader: &Reader,
) -> Outcome<Vec<Recording>> {
    let mut reader = reader.clone().for_robot(robot);
    reader.clocks = Clocks::Recorded;
    let mut recordings = Vec::new();
    for file in files {
        recordings.extend(chosen(file, reader.read(&file.path)?.recording));
    }
    Ok(recordings)
}

fn read_file(
    file: &RecordingFile,
    robot: &Robot,
    options: &ConditionOptions,
    reader: &Reader,
) -> Outcome<(RecordingSet, Reading)> {
    let mut reading = reader.read(&file.path)?;
    let options = options_for(&mut reading, options)?;
    let segments = std::mem::take(&mut reading.recording.segments);
    let mut set = RecordingSet::default();
    for recording in chosen(file, reading.recording.with_segments(segments)) {
        let path = recording.path.clone();
        let findings = check(&recording, robot);
        for found in mismatches(&recording, robot) {
            if found.kind == "fallen" {
                return Err(RecordingFault::contradiction(&found.words).of(&path));
            }
            set.mismatches.push((path.clone(), found));
        }
        let balance = Balance::of(&recording, robot);
        let (recording, left_out) = condition(recording, &findings, &options)?;
        set.recordings.push(recording);
        set.left_out += left_out;
        let findings = findings.into_iter().map(|found| (path.clone(), found));
        set.findings.extend(findings);
        set.balances.push((path, balance));
    }
    Ok((set, reading))
}

/// The steps for one recording: where times were rebuilt, rows are smoothed unless a filter is asked for.
fn options_for(reading: &mut Reading, options: &ConditionOptions) -> Outcome<ConditionOptions> {
    let mut options = options.clone();
    let rebuilt = (reading.mended.iter()).any(|mended| mended.elapsed_ratio.is_some());
    let segments = || reading.recording.segments.iter();
    let step_s = segments().map(Segment::mean_step_s).fold(0.0, f64::max);
    let half = (HALF_SMOOTHING_S / step_s).round();
    let window = 1 + 2 * if half.is_finite() { half as usize } else { 0 };
    let fits = segments().all(|segment| segment.len() >= window);
    if options.smoothing.is_none() && rebuilt && window > SMOOTHING_ORDER && fits {
        let filter = SavitzkyGolay::new(window, SMOOTHING_ORDER)?;
        options.smoothing = Some((filter, SmoothedRows::All));
        let option = format!("--smooth {window},{SMOOTHING_ORDER} --smooth-rows all");
        reading.notes.push(format!("rows are smoothed ({option})"));
    }
    Ok(options)
}

fn chosen(file: &RecordingFile, mut recording: Recording) -> Vec<Recording> {
    let Some(chosen) = &file.segments else {
        return vec![recording];
    };
    let segments = (std::mem::take(&mut recording.segments).into_iter()).enumerate();
    let kept = segments.filter(|(index, _)| chosen.contains(index));
    kept.map(|(_, segment)| recording.with_segments(vec![segment]))
        .collect()
}

/// Treatment of physically impossible samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ImplausibleSamples {
    #[default]
    Keep,
    /// They go, and the segment is divided there.
    LeaveOut,
}

/// Where accelerations come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Accelerations {
    /// Columns of the recording, or differences if it has none
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
    pub implausible: ImplausibleSamples,
    /// Shortest piece between samples left out that is kept; shorter ones go too.
    pub least_samples: usize,
    pub accelerations: Accelerations,
    /// Filter over whole segments.
    pub smoothing: Option<(SavitzkyGolay, SmoothedRows)>,
}

/// Applies the steps in the order of [`ConditionOptions`] to a recording with these findings. Returns it with the
/// number of samples removed: implausible ones and pieces between them that are too short.
///
/// # Errors
/// [`RecordingFault::Unexpected`] if nothing long enough remains, or a segment is shorter than the filter.
pub fn condition(
    recording: Recording,
    findings: &[Finding],
    options: &ConditionOptions,
) -> Outcome<(Recording, usize)> {
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

fn smooth(segment: &mut Segment, filter: &SavitzkyGolay, rows: SmoothedRows) -> Outcome<()> {
    if segment.len() < filter.window {
        let fault = RecordingFault::too_short(segment.len(), filter.window);
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

fn long_enough(mut recording: Recording, least: usize) -> Outcome<Recording> {
    let longest = recording.segments.iter().max_by_key(|part| part.len());
    let (row, found) = longest.map_or((1, 0), |part| (part.first_row, part.len()));
    recording.segments.retain(|segment| segment.len() >= least);
    if recording.segments.is_empty() {
        return Err(RecordingFault::too_short(found, least).at(&recording.path, row));
    }
    Ok(recording)
}
