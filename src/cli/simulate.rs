//! `romc simulate`: rollouts over recordings, in full and restarted.

use std::fmt::Write as _;

use serde_json::{Value, json};

use super::Answer;
use super::args::SimulateArguments;
use super::output::{Table, check_output, read_recordings, significant, spinner, write_file};
use super::trajectory::TrajectoryTable;
use crate::evaluate::{CoordinateSums, Fit, FitSums, PointwiseSums};
use crate::files::Overwrite;
use crate::model::ReducedModel;
use crate::recording::{Recording, Segment};
use crate::sim::{CompiledModel, IntegrationOptions, LatentSegment, Restart, rollout};
use crate::{Error, artifact};

/// Rolls the model out over every segment of every recording.
///
/// # Errors
/// Whatever reading, encoding or integrating refuses; [`Error::Exists`] for the output file.
pub fn run(arguments: &SimulateArguments) -> Result<Answer, Error> {
    let overwrite = Overwrite::when_forced(arguments.force);
    check_output(arguments.output.as_deref(), overwrite)?;
    let model = artifact::read(&arguments.model)?;
    let recordings = read_recordings(&arguments.recordings)?;
    let progress = spinner("simulating");
    let evaluation = Evaluation::over(&model, &recordings, arguments.restart_every)?;
    progress.finish_and_clear();
    if let Some(path) = &arguments.output {
        write_file(path, evaluation.trajectories.as_bytes(), overwrite)?;
    }
    Ok(Answer {
        text: evaluation.text(arguments),
        json: json!({
            "command": "simulate",
            "model": arguments.model.display().to_string(),
            "rollouts": evaluation.json(arguments.restart_every),
            "output": arguments.output.as_ref().map(|path| path.display().to_string()),
        }),
    })
}

/// What simulating a model over recordings showed.
#[derive(Debug)]
pub struct Evaluation {
    names: Vec<String>,
    units: Vec<String>,
    phase_names: Vec<String>,
    segments: usize,
    /// Rollouts over whole segments.
    pub full: CoordinateSums,
    /// Rollouts restarted from the recorded state.
    pub restarted: CoordinateSums,
    /// Decoder and latent accelerations.
    pub pointwise: PointwiseSums,
    trajectories: TrajectoryTable,
}

impl Evaluation {
    /// Simulates `model` over all segments of `recordings`.
    ///
    /// # Errors
    /// Whatever reading, encoding or integrating refuses.
    pub fn over(
        model: &ReducedModel,
        recordings: &[Recording],
        restart_every_s: f64,
    ) -> Result<Self, Error> {
        let state_names = crate::robot::Robot::state_names().to_vec();
        let state_units = crate::robot::Robot::state_units().to_vec();
        let signals = model.state();
        let mut evaluation = Self {
            names: signals.map_or(state_names, |state| state.names.clone()),
            units: signals.map_or(state_units, |state| state.units.clone()),
            phase_names: model.phases().iter().map(|p| p.name.clone()).collect(),
            segments: 0,
            full: CoordinateSums::new(model)?,
            restarted: CoordinateSums::new(model)?,
            pointwise: PointwiseSums::new(model),
            trajectories: TrajectoryTable::new(model),
        };
        let compiled = CompiledModel::new(model)?;
        for segment in recordings.iter().flat_map(|recording| &recording.segments) {
            evaluation.add(model, &compiled, segment, Restart::Every(restart_every_s))?;
        }
        Ok(evaluation)
    }

    fn add(
        &mut self,
        model: &ReducedModel,
        compiled: &CompiledModel,
        segment: &Segment,
        restart: Restart,
    ) -> Result<(), Error> {
        let latent = LatentSegment::encode(model, segment)?;
        let options = IntegrationOptions::default();
        let full = rollout(compiled, &latent, Restart::Never, &options)?;
        let restarted = rollout(compiled, &latent, restart, &options)?;
        self.full.add_rollout(model, segment, &full)?;
        self.restarted.add_rollout(model, segment, &restarted)?;
        self.pointwise.add(model, segment, &latent)?;
        (self.trajectories).add(model, self.segments, segment, &latent, &full, &restarted)?;
        self.segments += 1;
        Ok(())
    }

    fn text(&self, arguments: &SimulateArguments) -> String {
        let every = format!("restarted every {} s", arguments.restart_every);
        let mut table = Table::new(["coordinate", "unit", "full rms", "R^2", &every, "R^2"]);
        let (full, restarted) = (self.full.fits(), self.restarted.fits());
        for (index, name) in self.names.iter().enumerate() {
            let cells = |fit: Option<Fit>| {
                let rms = fit.map_or("-".to_owned(), |fit| significant(fit.rms));
                let r2 = fit.and_then(|fit| fit.r2);
                (rms, r2.map_or("-".to_owned(), |r2| format!("{r2:.3}")))
            };
            let (full, restarted) = (cells(full[index]), cells(restarted[index]));
            let unit = self.units[index].clone();
            table.row([name.clone(), unit, full.0, full.1, restarted.0, restarted.1]);
        }
        let mut text = format!(
            "{} over {} segments of {} recordings\n\n{table}\n",
            arguments.model.display(),
            self.segments,
            arguments.recordings.len()
        );
        for (kind, sums) in [("full", &self.full), ("restarted", &self.restarted)] {
            if sums.diverged > 0 {
                let _ = writeln!(
                    text,
                    "{} of {} {kind} rollouts diverged; the table covers them up to there",
                    sums.diverged, sums.windows
                );
            }
        }
        for (name, fit) in self.acceleration_fits() {
            let r2 = fit.and_then(|fit| fit.r2);
            let r2 = r2.map_or("-".to_owned(), |r2| format!("{r2:.3}"));
            let _ = writeln!(text, "latent accelerations in {name}: R^2 {r2}");
        }
        if let Some(fit) = self.pointwise.decoder.fit() {
            let mean_square = significant(fit.rms.powi(2));
            let _ = writeln!(text, "decoder mean square: {mean_square} (scaled units)");
        }
        if let Some(path) = &arguments.output {
            let _ = writeln!(text, "trajectories: {}", path.display());
        }
        text
    }

    fn acceleration_fits(&self) -> impl Iterator<Item = (&str, Option<Fit>)> {
        let fits = self.pointwise.acceleration.iter().map(FitSums::fit);
        self.phase_names.iter().map(String::as_str).zip(fits)
    }

    /// The figures as JSON.
    pub fn json(&self, restart_every_s: f64) -> Value {
        json!({
            "segments": self.segments,
            "restart_every_s": restart_every_s,
            "full": self.rollouts_json(&self.full),
            "restarted": self.rollouts_json(&self.restarted),
            "acceleration_r2": self.acceleration_fits()
                .map(|(name, fit)| (name.to_owned(), json!(fit.and_then(|fit| fit.r2))))
                .collect::<serde_json::Map<_, _>>(),
            "decoder_mean_square_scaled": self.pointwise.decoder.fit().map(|fit| fit.rms.powi(2)),
        })
    }

    /// Fit of the coordinate with this name.
    pub fn fit(&self, sums: &CoordinateSums, name: &str) -> Option<Fit> {
        let index = self.names.iter().position(|known| known == name)?;
        sums.fits()[index]
    }

    fn rollouts_json(&self, sums: &CoordinateSums) -> Value {
        let coordinates: serde_json::Map<_, _> = (self.names.iter().zip(&self.units))
            .zip(sums.fits())
            .map(|((name, unit), fit)| {
                let value = json!({
                    "unit": unit,
                    "rms": fit.map(|fit| fit.rms),
                    "r2": fit.and_then(|fit| fit.r2),
                });
                (name.clone(), value)
            })
            .collect();
        json!({ "rollouts": sums.windows, "diverged": sums.diverged, "coordinates": coordinates })
    }
}
