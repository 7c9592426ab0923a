//! Recordings that are read when they are needed: memory holds a few of them, however many there are.

use std::path::PathBuf;
use std::sync::mpsc::sync_channel;
use std::sync::{Arc, OnceLock};

use super::check::{Finding, check};
use super::condition::{ConditionOptions, ImplausibleSamples, SmoothedRows, condition};
use super::error::{RecordingError, RecordingFault};
use super::mismatch::{Balance, Mismatch, MismatchKind, contradiction, mismatches};
use super::reader::{Clocks, Reader, Reading, ReadingNotes};
use super::segment::{Recording, Segment};
use super::smoothing::SavitzkyGolay;
use crate::robot::Robot;

/// Half the window over which rows of late samples are smoothed, in s.
const HALF_SMOOTHING_S: f64 = 0.015;
/// Degree of the polynomials that smooth them.
const SMOOTHING_ORDER: usize = 3;

/// Recordings, held in memory or read from their files again each time.
#[derive(Clone, Debug)]
pub enum Source<'a> {
    /// Held in memory.
    Held(&'a [Recording]),
    /// Read when they are needed.
    Files(Arc<RecordingFiles>),
}

impl<'a, R: AsRef<[Recording]> + ?Sized> From<&'a R> for Source<'a> {
    fn from(recordings: &'a R) -> Self {
        Self::Held(recordings.as_ref())
    }
}

impl From<Arc<RecordingFiles>> for Source<'_> {
    fn from(files: Arc<RecordingFiles>) -> Self {
        Self::Files(files)
    }
}

impl Source<'_> {
    /// Passes every recording to `take`, in order.
    ///
    /// # Errors
    /// The first that reading, conditioning or `take` has.
    pub fn for_each<E: From<RecordingError>>(
        &self,
        mut take: impl FnMut(&Recording) -> Result<(), E>,
    ) -> Result<(), E> {
        match self {
            Self::Held(recordings) => recordings.iter().try_for_each(take),
            Self::Files(files) => files.for_each(|recording| take(&recording)),
        }
    }
}

/// Files of recordings, checked and conditioned each time they are read.
#[derive(Debug)]
pub struct RecordingFiles {
    files: Vec<RecordingFile>,
    robot: &'static Robot,
    options: ConditionOptions,
    reader: Reader,
    notes: OnceLock<Notes>,
}

/// A file, or some of its segments.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordingFile {
    /// Where it is.
    pub path: PathBuf,
    /// The segments to take, each as a recording of its own; `None` for the whole file as one recording.
    pub segments: Option<Vec<usize>>,
}

/// What the checks found in recordings; for files, when they were first read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Notes {
    /// Implausible runs of samples with their files.
    pub findings: Vec<(PathBuf, Finding)>,
    /// What cannot be true of the robot, with the files.
    pub mismatches: Vec<(PathBuf, Mismatch)>,
    /// Number of samples that were left out.
    pub left_out: usize,
    /// What reading did besides reading.
    pub reading: ReadingNotes,
    /// What forces and accelerations of each recording come to, with its file.
    balances: Vec<(PathBuf, Balance)>,
}

impl Notes {
    /// Adds what was found in other recordings, but not what reading them did.
    pub fn add(&mut self, other: Self) {
        self.findings.extend(other.findings);
        self.mismatches.extend(other.mismatches);
        self.left_out += other.left_out;
        self.balances.extend(other.balances);
    }
}

impl RecordingFiles {
    /// Files of recordings of `robot` for this reader; nothing is read yet.
    pub fn new(
        files: Vec<RecordingFile>,
        robot: &'static Robot,
        options: ConditionOptions,
        reader: Reader,
    ) -> Self {
        Self {
            files,
            robot,
            options,
            reader: reader.for_robot(robot),
            notes: OnceLock::new(),
        }
    }

    /// The files.
    pub fn files(&self) -> &[RecordingFile] {
        &self.files
    }

    /// Whether there is no file.
    pub fn is_empty(&self) -> bool {
        self.files.is_empty()
    }

    /// What the first reading found, also if it ended early; empty before it.
    pub fn notes(&self) -> Notes {
        self.notes.get().cloned().unwrap_or_default()
    }

    /// The recordings of the first `count` files, neither checked nor conditioned, with clocks as recorded.
    ///
    /// # Errors
    /// As [`Reader::read`].
    pub fn first(&self, count: usize) -> Result<Vec<Recording>, RecordingError> {
        let mut recordings = Vec::new();
        let mut reader = self.reader.clone();
        reader.clocks = Clocks::Recorded;
        for file in self.files.iter().take(count) {
            let reading = reader.read(&file.path)?;
            recordings.extend(chosen(file, reading.recording));
        }
        Ok(recordings)
    }

    /// Reads all files and passes every recording to `take`, in order. Two files at a time are decoded on threads of
    /// their own where there are two cores.
    ///
    /// # Errors
    /// The first that reading, conditioning or `take` has; after the first pass [`RecordingFault::Contradiction`] for a
    /// recording that contradicts physics or the others.
    pub fn for_each<E: From<RecordingError>>(
        &self,
        mut take: impl FnMut(Recording) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut notes = Notes::default();
        let result = self.in_order::<E>(|ready| {
            let (recordings, reading) = ready?;
            notes.reading.add(&reading);
            for (recording, found) in recordings {
                notes.add(found);
                take(recording)?;
            }
            Ok(())
        });
        let (paths, balances): (Vec<_>, Vec<_>) = notes.balances.drain(..).unzip();
        self.notes.get_or_init(|| notes);
        result?;
        match contradiction(&balances) {
            None => Ok(()),
            Some((at, found)) => Err(RecordingFault::Contradiction(found).of(&paths[at]).into()),
        }
    }

    fn in_order<E: From<RecordingError>>(
        &self,
        mut take: impl FnMut(Result<Ready, RecordingError>) -> Result<(), E>,
    ) -> Result<(), E> {
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        let threads = threads.clamp(1, 2);
        if threads == 1 || self.files.len() < 2 {
            return (self.files.iter()).try_for_each(|file| take(self.read(file)));
        }
        std::thread::scope(|scope| {
            let readers = (0..threads).map(|first| {
                let (sender, receiver) = sync_channel(1);
                scope.spawn(move || {
                    let own = self.files.iter().skip(first).step_by(threads);
                    // nobody listens any more after an error
                    own.map(|file| sender.send(self.read(file)))
                        .find(Result::is_err)
                });
                receiver
            });
            let readers: Vec<_> = readers.collect();
            (0..self.files.len()).try_for_each(|index| {
                let next = readers[index % threads].recv();
                take(next.expect("invariant: a thread sends each of its files"))
            })
        })
    }

    /// The steps for one recording: where times were rebuilt, which is where samples came late or were lost, rows are
    /// smoothed unless a filter is asked for.
    fn options_for(&self, reading: &mut Reading) -> Result<ConditionOptions, RecordingError> {
        let mut options = self.options.clone();
        let rebuilt = (reading.mended.iter()).any(|mended| mended.elapsed_ratio.is_some());
        let segments = || reading.recording.segments.iter();
        let step_s = segments().map(Segment::mean_step_s).fold(0.0, f64::max);
        let half = (HALF_SMOOTHING_S / step_s).round();
        let window = match half.is_finite() {
            true => 2 * half as usize + 1,
            false => 1,
        };
        let fits = segments().all(|segment| segment.len() >= window);
        if options.smoothing.is_none() && rebuilt && window > SMOOTHING_ORDER && fits {
            let filter = SavitzkyGolay::new(window, SMOOTHING_ORDER)?;
            options.smoothing = Some((filter, SmoothedRows::All));
            reading.notes.push(format!(
                "rows are smoothed (--smooth {window},{SMOOTHING_ORDER} --smooth-rows all)"
            ));
        }
        Ok(options)
    }

    /// The recordings of one file, and its reading without samples. Checks that only report are made once.
    fn read(&self, file: &RecordingFile) -> Result<Ready, RecordingError> {
        let mut reading = self.reader.read(&file.path)?;
        let options = self.options_for(&mut reading)?;
        let segments = std::mem::take(&mut reading.recording.segments);
        let recording = reading.recording.with_segments(segments);
        let keeps = self.options.implausible == ImplausibleSamples::Keep;
        let is_first = self.notes.get().is_none();
        let ready = chosen(file, recording).into_iter().map(|recording| {
            let findings = match keeps && !is_first {
                true => Vec::new(),
                false => check(&recording, self.robot),
            };
            let unlike = match is_first {
                true => mismatches(&recording, self.robot),
                false => Vec::new(),
            };
            if let Some(fallen) = unlike
                .iter()
                .find(|found| found.kind == MismatchKind::Fallen)
            {
                let fault = RecordingFault::Contradiction(fallen.words.clone());
                return Err(fault.of(&recording.path));
            }
            let balance =
                is_first.then(|| (recording.path.clone(), Balance::of(&recording, self.robot)));
            let (recording, left_out) = condition(recording, &findings, &options)?;
            let path = || recording.path.clone();
            let notes = Notes {
                findings: findings.into_iter().map(|found| (path(), found)).collect(),
                mismatches: unlike.into_iter().map(|found| (path(), found)).collect(),
                left_out,
                reading: ReadingNotes::default(),
                balances: balance.into_iter().collect(),
            };
            Ok::<_, RecordingError>((recording, notes))
        });
        Ok((ready.collect::<Result<_, _>>()?, reading))
    }
}

/// The recordings of one file, conditioned, each with what was found in it, and what reading did.
type Ready = (Vec<(Recording, Notes)>, Reading);

/// The whole recording of a file, or a recording for each segment that is asked for.
fn chosen(file: &RecordingFile, mut recording: Recording) -> Vec<Recording> {
    let Some(chosen) = &file.segments else {
        return vec![recording];
    };
    let segments = std::mem::take(&mut recording.segments);
    (segments.into_iter().enumerate())
        .filter(|(index, _)| chosen.contains(index))
        .map(|(_, segment)| recording.with_segments(vec![segment]))
        .collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn files(names: &[&str], segments: Option<Vec<usize>>) -> RecordingFiles {
        let folder =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/recordings/go1-noisy");
        let file = |name: &&str| RecordingFile {
            path: folder.join(name),
            segments: segments.clone(),
        };
        let go1 = Robot::by_name("go1").expect("known");
        let files = names.iter().map(file).collect();
        RecordingFiles::new(files, go1, ConditionOptions::default(), Reader::default())
    }

    #[test]
    fn recordings_come_in_the_order_of_their_files_and_are_the_same_again() {
        let names = [1, 2, 3, 4].map(|i| format!("train_0{i}.csv.gz"));
        let files = Arc::new(files(&names.each_ref().map(String::as_str), Some(vec![0])));
        let source = Source::from(files);
        let all = || {
            let mut all = Vec::new();
            let kept = source.for_each(|recording| {
                all.push(recording.clone());
                Ok::<_, RecordingError>(())
            });
            kept.expect("shipped recordings");
            all
        };
        let (first, second) = (all(), all());
        for (recording, name) in first.iter().zip(&names) {
            assert!(recording.path.ends_with(name));
            assert_eq!(recording.segments.len(), 1);
        }
        assert_eq!(first.len(), 4);
        assert_eq!(first, second);
    }

    #[test]
    fn a_file_that_cannot_be_read_ends_the_visit_at_its_place() {
        let files = files(&["train_01.csv.gz", "missing.csv", "train_02.csv.gz"], None);
        let mut seen = 0;
        let error = files.for_each(|_| {
            seen += 1;
            Ok::<_, RecordingError>(())
        });
        let error = error.expect_err("no such file");
        let error = error.to_string();
        assert!(error.ends_with("missing.csv: no such file"), "{error}");
        assert_eq!(seen, 1);
    }
}
