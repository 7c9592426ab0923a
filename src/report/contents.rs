//! The figures of a report, from an assessment and the controller's runs.

use nalgebra::DVector;

use super::complexity::study_figures;
use super::control::{latent_inputs, torques};
use super::figures::{Figure, HeatMap, LinePlot, Motion, Panel, Role, Series, film_strip, floor_m};
use super::place::Place;
use super::tables::NamedRun;
use crate::evaluate::{Assessment, SegmentRun};
use crate::model::{ModelError, ReducedModel};
use crate::mpc::Lift;
use crate::recording::Segment;
use crate::robot::{JOINT_DIM, STATE_DIM};
use crate::sim::Rollout;
use crate::study::Summary;

/// Segments that get figures of their own; tables cover all.
const MAX_SEGMENTS: usize = 3;

/// The model and results that a report shows.
#[derive(Debug, Clone, Copy)]
pub struct Content<'a> {
    /// The model.
    pub model: &'a ReducedModel,
    /// The model compared with the recordings.
    pub assessment: &'a Assessment<'a>,
    /// The controller along each recording with the plain lift; empty if it did not run.
    pub plain: &'a [NamedRun],
    /// The same with the lift that keeps torques and forces consistent.
    pub consistent: &'a [NamedRun],
    /// A study over the latent dimension, if there is one.
    pub study: Option<&'a Summary>,
}

/// Figures by section of the page.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct AllFigures {
    /// The encoder's weights.
    pub encoder: Vec<Figure>,
    /// The robot as a stick figure, recorded and predicted.
    pub motion: Vec<Figure>,
    /// Joints and body beside the recording.
    pub coordinates: Vec<Figure>,
    /// Latent accelerations.
    pub accelerations: Vec<Figure>,
    /// The model beside the template models.
    pub baselines: Vec<Figure>,
    /// Torques commanded by the controller, and its latent trajectory.
    pub control: Vec<Figure>,
    /// Accuracy against complexity.
    pub study: Vec<Figure>,
}

impl AllFigures {
    /// All figures, in the order of the page.
    pub fn iter(&self) -> impl Iterator<Item = &Figure> {
        (self.encoder.iter())
            .chain(&self.motion)
            .chain(&self.coordinates)
            .chain(&self.accelerations)
            .chain(&self.baselines)
            .chain(&self.control)
            .chain(&self.study)
    }
}

/// The figures of a report.
///
/// # Errors
/// [`ModelError`] for a model without encoder or decoder.
pub fn all_figures(content: &Content<'_>) -> Result<AllFigures, ModelError> {
    let mut figures = AllFigures::default();
    let Content {
        model, assessment, ..
    } = *content;
    if let Some(run) = assessment.runs.first() {
        figures.encoder.push(encoder(model, assessment, run)?);
    }
    for (index, run) in assessment.runs.iter().take(MAX_SEGMENTS).enumerate() {
        let jump = Jump {
            model,
            assessment,
            run,
            place: Place::of_segment(index, run),
        };
        figures.motion.extend(jump.film_strip()?);
        figures.coordinates.extend(jump.coordinates()?);
        figures.accelerations.push(jump.accelerations()?);
        figures.baselines.push(jump.baselines()?);
    }
    for (index, (path, run)) in content.consistent.iter().take(MAX_SEGMENTS).enumerate() {
        let place = Place::of_recording(index, path);
        let torques = torques(model, Lift::Consistent, run, &place);
        (figures.control).extend([torques, latent_inputs(model, run, &place)]);
    }
    if let Some(summary) = content.study {
        figures.study = study_figures(summary);
    }
    Ok(figures)
}

/// Figures 6, 9 and 15 of the paper.
fn encoder(
    model: &ReducedModel,
    assessment: &Assessment<'_>,
    run: &SegmentRun<'_>,
) -> Result<Figure, ModelError> {
    let x = run.segment.x.column(0).into_owned();
    // d z / d x in SI units; without the scaling it is W_e of a linear encoder
    let weights = model.encoder_jacobian(&x)?;
    let factors = model.state_factors()?;
    let rows = assessment.names.len();
    let d = model.latent_dim();
    let at = |row: usize, column: usize| weights[(column, row)] / factors[row];
    let values = (0..rows * d).map(|k| at(k / d, k % d)).collect();
    let what = if model.is_linear() {
        "Magnitudes of the encoder's weights"
    } else {
        "Magnitudes of the encoder's Jacobian at the first sample"
    };
    Ok(Figure {
        id: "encoder".to_owned(),
        caption: format!("{what}: how much of each coordinate a latent one takes (scaled units)."),
        x_label: String::new(),
        panel_size: (120.0 + 40.0 * d.min(18) as f64, 330.0),
        columns: 1,
        panels: vec![Panel::Heat(HeatMap {
            title: format!("{rows} coordinates, {d} latent"),
            rows: assessment.names.clone(),
            columns: (1..=d).map(|index| format!("z{index}")).collect(),
            values,
        })],
        legend: Vec::new(),
    })
}

/// Instants of a film strip.
const FRAMES: usize = 10;

/// Yaw at the first sample, in rad.
pub(super) fn heading_rad(segment: &Segment) -> f64 {
    segment.x[(STATE_DIM - 1, 0)]
}

/// Whether each coordinate of the robot enters a latent one at the state `x` (18).
///
/// # Errors
/// [`ModelError`] for a model without encoder.
pub fn modelled(model: &ReducedModel, x: DVector<f64>) -> Result<Vec<bool>, ModelError> {
    let weights = model.encoder_jacobian(&x)?;
    let columns = weights.column_iter();
    Ok(columns.map(|column| column.amax() != 0.0).collect())
}

/// A value of every sample; none where a rollout did not arrive.
type Samples = Vec<Option<DVector<f64>>>;

/// One segment of a recording beside its rollouts.
struct Jump<'a> {
    model: &'a ReducedModel,
    assessment: &'a Assessment<'a>,
    run: &'a SegmentRun<'a>,
    place: Place,
}

impl Jump<'_> {
    /// The robot as it moved and as the model predicts it over the whole jump; none for a model without a robot.
    fn film_strip(&self) -> Result<Option<Figure>, ModelError> {
        let Ok(robot) = self.model.robot() else {
            return Ok(None);
        };
        let segment = self.run.segment;
        let motions = self.motions()?;
        let names = (
            format!("motion_{}", self.place.suffix),
            format!(
                "{}: recorded, and predicted over the whole jump.",
                self.place.words
            ),
        );
        let from = (heading_rad(segment), floor_m(robot, segment));
        let motions = (segment.time_s.as_slice(), motions.as_slice());
        Ok(Some(film_strip(robot, names, motions, from, FRAMES)))
    }

    /// What was recorded, and the rollout over the whole jump; coordinates that the model does not
    /// encode stay as recorded.
    fn motions(&self) -> Result<[Motion; 2], ModelError> {
        let recorded = &self.run.segment.x;
        let modelled = modelled(self.model, recorded.column(0).into_owned())?;
        let mut states = self.decoded(&self.run.full)?;
        for (sample, state) in states.iter_mut().enumerate() {
            let Some(state) = state else { continue };
            for row in (0..STATE_DIM).filter(|&row| !modelled[row]) {
                state[row] = recorded[(row, sample)];
            }
        }
        let predicted = Motion {
            role: Role::Full,
            words: "model, whole jump".to_owned(),
            states,
        };
        Ok([Motion::recorded(self.run.segment), predicted])
    }

    /// A function's value at every predicted sample.
    fn predicted(
        &self,
        rollout: &Rollout,
        value: impl Fn(usize, &DVector<f64>, &DVector<f64>) -> Result<DVector<f64>, ModelError>,
    ) -> Result<Samples, ModelError> {
        let states = rollout
            .states(self.run.latent.len())
            .into_iter()
            .enumerate();
        states
            .map(|(sample, state)| state.map(|(z, dz)| value(sample, &z, &dz)).transpose())
            .collect()
    }

    /// Coordinates of the robot along a rollout.
    fn decoded(&self, rollout: &Rollout) -> Result<Samples, ModelError> {
        self.predicted(rollout, |_, z, _| self.model.decode(z))
    }

    fn series(&self, role: Role, value: impl Fn(usize) -> Option<f64>) -> Series {
        let times = self.run.latent.time_s.iter().enumerate();
        Series {
            role,
            points: times.map(|(k, &time)| (time, value(k))).collect(),
        }
    }

    /// Lines over the samples; flight is shaded.
    fn panel(&self, title: String, series: Vec<Series>) -> Panel {
        Panel::Lines(LinePlot {
            title,
            series,
            shaded: self.flights(),
        })
    }

    /// Times without a foot down.
    fn flights(&self) -> Vec<(f64, f64)> {
        let time = &self.run.segment.time_s;
        let mut spans: Vec<(f64, f64)> = Vec::new();
        let mut airborne = false;
        for (sample, feet) in self.run.segment.feet.iter().enumerate() {
            let in_air = !feet.contains(&true);
            match (spans.last_mut(), in_air, airborne) {
                (Some(span), true, true) => span.1 = time[sample],
                (_, true, _) => spans.push((time[sample], time[sample])),
                (_, false, _) => {}
            }
            airborne = in_air;
        }
        spans
    }

    /// A figure of rollouts beside the recording; `id` gets the number of the jump.
    fn rollout_figure(&self, id: &str, caption: String, panels: Vec<Panel>) -> Figure {
        let every = self.assessment.restart_every_s;
        let restarted = format!("model, restarted every {every} s");
        let legend = [
            (Role::Recorded, "recorded"),
            (Role::Full, "model, whole jump"),
            (Role::Restarted, &restarted),
        ];
        let id = format!("{id}_{}", self.place.suffix);
        Figure::over_time(id, caption, panels, &legend)
    }

    /// A recorded line with the two of the rollouts.
    fn beside_rollouts(
        &self,
        title: String,
        recorded: impl Fn(usize) -> f64,
        [full, restarted]: [&Samples; 2],
        row: usize,
    ) -> Panel {
        let of = |samples: &Samples, k: usize| samples[k].as_ref().map(|values| values[row]);
        let series = vec![
            self.series(Role::Recorded, |k| Some(recorded(k))),
            self.series(Role::Full, |k| of(full, k)),
            self.series(Role::Restarted, |k| of(restarted, k)),
        ];
        self.panel(title, series)
    }

    /// Figures 7, 13 and 14 of the paper: joints, then body.
    fn coordinates(&self) -> Result<[Figure; 2], ModelError> {
        let (names, units) = (&self.assessment.names, &self.assessment.units);
        let full = self.decoded(&self.run.full)?;
        let restarted = self.decoded(&self.run.restarted)?;
        let panel = |row: usize| {
            let title = format!("{}, {}", names[row], units[row]);
            let recorded = |k| self.run.segment.x[(row, k)];
            self.beside_rollouts(title, recorded, [&full, &restarted], row)
        };
        let figure = |id: &str, what: &str, rows: std::ops::Range<usize>| {
            let caption = format!(
                "{what} of {}: recorded, and decoded from the model's rollouts. Grey: flight.",
                self.place.words
            );
            self.rollout_figure(id, caption, rows.map(panel).collect())
        };
        let body = JOINT_DIM..names.len();
        Ok([
            figure("joints", "Joint angles", 0..JOINT_DIM),
            figure("body", "Body position and orientation", body),
        ])
    }

    /// Figure 12 of the paper.
    fn accelerations(&self) -> Result<Figure, ModelError> {
        let latent = &self.run.latent;
        let ddz = |k: usize, z: &DVector<f64>, dz: &DVector<f64>| {
            let u_lat = latent.u_lat.column(k).into_owned();
            self.model.ddz(latent.phase[k], z, dz, &u_lat)
        };
        let full = self.predicted(&self.run.full, ddz)?;
        let restarted = self.predicted(&self.run.restarted, ddz)?;
        let panel = |row: usize| {
            let title = format!("d²z{}/dt²", row + 1);
            let recorded = |k| latent.ddz[(row, k)];
            self.beside_rollouts(title, recorded, [&full, &restarted], row)
        };
        let caption = format!(
            "Latent accelerations of {} (scaled units): encoded from the recording, and by the model along its rollouts.",
            self.place.words
        );
        let panels = (0..self.model.latent_dim()).map(panel).collect();
        Ok(self.rollout_figure("latent_accelerations", caption, panels))
    }

    /// Figure 8 of the paper, with the fitted pendulum beside the published one.
    fn baselines(&self) -> Result<Figure, ModelError> {
        let run = self.run;
        let full = self.decoded(&run.full)?;
        let roles = [Role::Baseline, Role::SecondBaseline];
        let panel = |row: usize, axis: usize, title: &str| {
            let mut lines = vec![
                self.series(Role::Recorded, |k| Some(run.segment.x[(row, k)])),
                self.series(Role::Full, |k| full[k].as_ref().map(|x| x[row])),
            ];
            lines.extend(
                roles
                    .into_iter()
                    .zip(&run.baselines)
                    .map(|(role, rollout)| {
                        let position =
                            |k: usize| rollout.position_m[k].map(|position| position[axis]);
                        self.series(role, position)
                    }),
            );
            self.panel(title.to_owned(), lines)
        };
        let mut legend = vec![
            (Role::Recorded, "recorded"),
            (Role::Full, "model, whole jump"),
        ];
        let names = self.assessment.baselines.iter().map(|b| b.name);
        legend.extend(roles.into_iter().zip(names));
        let caption = format!(
            "Body position of {}: the learned model and the pendulum under the same recorded forces.",
            self.place.words
        );
        let panels = vec![
            panel(JOINT_DIM, 0, "body.x, m"),
            panel(JOINT_DIM + 2, 1, "body.z, m"),
        ];
        Ok(Figure {
            panel_size: (360.0, 210.0),
            columns: 2,
            ..Figure::over_time(
                format!("aslip_{}", self.place.suffix),
                caption,
                panels,
                &legend,
            )
        })
    }
}
