//! Recordings for a training: divided into sets, checked, conditioned.

use super::inspect::finding_json;
use super::*;

/// A jump of a divided set: its file, its segment there, and the first row.
type DividedJump = (PathBuf, usize, usize);

const SETS: [&str; 3] = ["training", "validation", "test"];

pub(super) struct RecordedSets {
    /// Empty before [`Self::read`].
    pub sets: [RecordingSet; 3],
    files: [Vec<RecordingFile>; 3],
    robot: &'static Robot,
    reader: Reader,
    pub divided: Option<[Vec<DividedJump>; 3]>,
    options: ConditionOptions,
}

impl RecordedSets {
    pub(super) fn new(
        arguments: &TrainArguments,
        settings: &TrainSettings,
        robot: &'static Robot,
        seed: u64,
    ) -> Result<Self> {
        let (training, validation) = (&arguments.recordings, &arguments.validation);
        let paths = [training.as_slice(), validation, &arguments.test];
        let mut recorded = Self::whole(paths, &arguments.reading, settings, robot)?;
        if let Some(split) = arguments.split {
            let jumps = jumps_of(training, &recorded.reader)?;
            let jump = |jump: usize| jumps[jump].clone();
            let sets = split.of(jumps.len(), seed)?;
            let sets = sets.map(|set| set.into_iter().map(jump).collect::<Vec<_>>());
            recorded.files = sets.each_ref().map(|set| chosen_segments(set));
            recorded.divided = Some(sets);
        }
        Ok(recorded)
    }

    /// Whole files. Clocks are repaired by default, except with the settings of the paper.
    pub(super) fn whole(
        paths: [&[PathBuf]; 3],
        reading: &ReadingArguments,
        settings: &TrainSettings,
        robot: &'static Robot,
    ) -> Result<Self> {
        let clocks = match settings.paper {
            true => Clocks::Recorded,
            false => Clocks::Repaired,
        };
        let whole = |path: &PathBuf| RecordingFile {
            path: path.clone(),
            segments: None,
        };
        Ok(Self {
            sets: Default::default(),
            files: paths.map(|paths| paths.iter().map(whole).collect()),
            robot,
            reader: reader(reading, clocks, None)?,
            divided: None,
            options: settings.conditioning(),
        })
    }

    pub(super) fn first(&self, count: usize) -> Result<Vec<Recording>, RecordingError> {
        let files = &self.files[0];
        as_recorded(&files[..count.min(files.len())], self.robot, &self.reader)
    }

    pub(super) fn read(&mut self) -> Result<(), RecordingError> {
        let progress = spinner("reading recordings");
        let read = [2, 0, 1].into_iter().try_for_each(|set| {
            let files = &self.files[set];
            self.sets[set].read(files, self.robot, &self.options, &self.reader)
        });
        progress.finish_and_clear();
        read
    }

    /// The set of each jump, with file and first row, if they were divided: in words and as JSON.
    pub(super) fn division(&self) -> Option<(String, Value)> {
        let (mut text, mut json) = (String::new(), Map::new());
        for (name, places) in SETS.into_iter().zip(self.divided.as_ref()?) {
            let of_jump = |(path, _, row): &DividedJump| {
                let file = path.display().to_string();
                let words = format!("{file} (row {row})");
                (words, json!({ "file": file, "row": row }))
            };
            let (jumps, rows): (Vec<_>, Vec<_>) = places.iter().map(of_jump).unzip();
            let count = counted(jumps.len(), "motion");
            text += &format!("{name}, {count}: {}\n", jumps.join(", "));
            json.insert(name.to_owned(), rows.into());
        }
        Some((text, Value::Object(json)))
    }

    pub(super) fn sets_of(&self, path: &str) -> Vec<&'static str> {
        let sets = SETS.into_iter().zip(self.divided.iter().flatten());
        let is_of = |(file, ..): &DividedJump| file.display().to_string() == path;
        let with = sets.filter(|(_, places)| places.iter().any(is_of));
        with.map(|(name, _)| name).collect()
    }

    /// The files of each set; a file with jumps in several sets is listed in the first.
    pub(super) fn files(&self) -> [(&'static str, Vec<&Path>); 3] {
        let mut seen: Vec<&Path> = Vec::new();
        std::array::from_fn(|set| {
            let files = self.files[set].iter().map(|file| file.path.as_path());
            let new = files.filter(|path| self.divided.is_none() || !seen.contains(path));
            let new: Vec<&Path> = new.collect();
            seen.extend(&new);
            (SETS[set], new)
        })
    }

    pub(super) fn report_findings(&self) {
        let reading = self.sets[0].reading.lines();
        reading.iter().for_each(|line| note(line));
        for (file, mismatch) in self.sets.iter().flat_map(|set| &set.mismatches) {
            note(&format!("{}: {mismatch}", file.display()));
        }
        let findings = self.sets.iter().flat_map(|set| &set.findings);
        let (findings, singular): (Vec<_>, Vec<_>) =
            findings.partition(|(_, finding)| finding.kind.can_be_left_out());
        for runs in singular.chunk_by(|(one, _), (other, _)| one == other) {
            let samples: usize = runs.iter().map(|(_, finding)| finding.samples.len()).sum();
            let (file, first) = (runs[0].0.display(), &runs[0].1);
            note(&format!(
                "{file}: {samples} samples of legs on the ground near a singularity, where forces are damped, from {first}"
            ));
        }
        let mut files: Vec<(&Path, usize, &Finding)> = Vec::new();
        for (file, finding) in &findings {
            match files.iter_mut().find(|(known, ..)| known == file) {
                Some((_, runs, _)) => *runs += 1,
                None => files.push((file, 1, finding)),
            }
        }
        for (file, runs, first) in files {
            let file = file.display();
            note(&format!(
                "{file}: {runs} implausible runs of samples, such as {first}"
            ));
        }
        match (self.options.implausible, self.left_out()) {
            (ImplausibleSamples::LeaveOut, left_out @ 1..) => {
                note(&format!("{left_out} samples are left out"));
            }
            (ImplausibleSamples::Keep, _) if !findings.is_empty() => note(
                "they are used; `romc inspect` lists them, --leave-out-implausible leaves them out",
            ),
            (ImplausibleSamples::LeaveOut | ImplausibleSamples::Keep, _) => {}
        }
    }

    fn left_out(&self) -> usize {
        self.sets.iter().map(|set| set.left_out).sum()
    }

    pub(super) fn findings_json(&self) -> Value {
        let of_file = |file: &Path, mut value: Value| {
            value["file"] = json!(file.display().to_string());
            value
        };
        let findings = self.sets.iter().flat_map(|set| &set.findings);
        let findings = findings.map(|(file, found)| of_file(file, finding_json(found)));
        let unlike = self.sets.iter().flat_map(|set| &set.mismatches);
        let unlike = unlike.map(|(file, found)| of_file(file, json!(found)));
        json!({
            "implausible": findings.collect::<Vec<_>>(),
            "mismatches": unlike.collect::<Vec<_>>(),
            "left_out": self.left_out(),
        })
    }
}

fn jumps_of(paths: &[PathBuf], reader: &Reader) -> Result<Vec<DividedJump>> {
    let mut jumps = Vec::new();
    for path in paths {
        let recording = reader.read(path)?.recording;
        let segments = recording.segments.iter().enumerate();
        jumps.extend(segments.map(|(index, segment)| (path.clone(), index, segment.first_row)));
    }
    Ok(jumps)
}

/// The files of a set of jumps; neighbours in the same file are read together.
fn chosen_segments(jumps: &[DividedJump]) -> Vec<RecordingFile> {
    let mut files: Vec<RecordingFile> = Vec::new();
    for (path, segment, _) in jumps {
        match files.last_mut() {
            Some(file) if file.path == *path => {
                file.segments.get_or_insert_default().push(*segment);
            }
            Some(_) | None => files.push(RecordingFile {
                path: path.clone(),
                segments: Some(vec![*segment]),
            }),
        }
    }
    files
}
