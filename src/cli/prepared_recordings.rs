//! Recordings on their way into a training: divided into sets, checked, made ready.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::args::{TrainArguments, TrainSettings};
use super::inspect_recording::finding_json;
use super::output::read_recordings;
use super::train_settings;
use crate::Error;
use crate::recording::check::Finding;
use crate::recording::{ConditionOptions, ImplausibleSamples, Recording, condition};
use crate::robot::Robot;

/// The recordings of a training as the files have them.
pub struct RecordedSets {
    /// What the model is fitted to.
    pub training: Vec<Recording>,
    /// What chooses between candidates.
    pub validation: Vec<Recording>,
    /// What nothing sees before the end.
    pub test: Vec<Recording>,
}

impl RecordedSets {
    /// Reads what the arguments name, divided by their shares if they have any.
    ///
    /// # Errors
    /// [`Error::Recording`] for a file, [`Error::Train`] for fewer jumps than sets.
    pub fn read(arguments: &TrainArguments, seed: u64) -> Result<Self, Error> {
        let training = read_recordings(&arguments.recordings)?;
        let Some(split) = arguments.split else {
            return Ok(Self {
                training,
                validation: read_recordings(&arguments.validation)?,
                test: read_recordings(&arguments.test)?,
            });
        };
        let sets = split.of(&training, seed)?;
        Ok(Self {
            training: sets.training,
            validation: sets.validation,
            test: sets.test,
        })
    }

    /// Which jumps came into which set: file and first row of each.
    pub fn json(&self) -> Value {
        let places = |set: &[Recording]| -> Vec<Value> {
            let jumps = set.iter().flat_map(|recording| &recording.segments);
            jumps
                .map(|jump| json!({ "file": jump.path.display().to_string(), "row": jump.first_row }))
                .collect()
        };
        json!({
            "training": places(&self.training),
            "validation": places(&self.validation),
            "test": places(&self.test),
        })
    }
}

/// Makes recordings ready as the settings say, and keeps what it found.
pub struct Intake {
    robot: &'static Robot,
    options: ConditionOptions,
    findings: Vec<(PathBuf, Finding)>,
    left_out: usize,
}

impl Intake {
    /// An intake that has seen nothing yet.
    ///
    /// # Errors
    /// [`Error::Train`] for a filter that does not exist.
    pub fn new(settings: &TrainSettings, robot: &'static Robot) -> Result<Self, Error> {
        Ok(Self {
            robot,
            options: train_settings::conditioning(settings)?,
            findings: Vec::new(),
            left_out: 0,
        })
    }

    /// The recordings of one set, made ready.
    ///
    /// # Errors
    /// [`Error::Recording`] where too little remains.
    pub fn take(&mut self, set: &[Recording]) -> Result<Vec<Recording>, Error> {
        let mut ready = Vec::with_capacity(set.len());
        for recording in set {
            let conditioned = condition(recording, self.robot, &self.options)?;
            let found = conditioned.findings.into_iter();
            self.findings
                .extend(found.map(|finding| (recording.path.clone(), finding)));
            self.left_out += conditioned.left_out;
            ready.push(conditioned.recording);
        }
        Ok(ready)
    }

    /// Tells on stderr which files have implausible samples, and what became of them.
    pub fn tell(&self) {
        let mut files: Vec<&Path> = Vec::new();
        for (file, _) in &self.findings {
            if !files.contains(&file.as_path()) {
                files.push(file);
            }
        }
        for file in files {
            let of_file = self.findings.iter().filter(|(path, _)| path == file);
            let runs: Vec<&Finding> = of_file.map(|(_, finding)| finding).collect();
            eprintln!(
                "note: {}: {} implausible runs of samples, such as {}",
                file.display(),
                runs.len(),
                runs[0]
            );
        }
        match self.options.implausible {
            ImplausibleSamples::LeaveOut if self.left_out > 0 => {
                eprintln!("note: {} samples are left out", self.left_out);
            }
            ImplausibleSamples::Keep if !self.findings.is_empty() => eprintln!(
                "note: they stay; `romc inspect` lists them, --leave-out-implausible leaves them out"
            ),
            ImplausibleSamples::LeaveOut | ImplausibleSamples::Keep => {}
        }
    }

    /// Every finding with its place, and how many samples were left out.
    pub fn json(&self) -> Value {
        let findings = self.findings.iter().map(|(file, finding)| {
            let mut value = finding_json(finding);
            value["file"] = json!(file.display().to_string());
            value
        });
        json!({ "implausible": findings.collect::<Vec<_>>(), "left_out": self.left_out })
    }
}
