//! The figures of one motion: recorded and predicted, baselines, robots as sticks.

use nalgebra::DVector;

use super::introduction::best_template;
use super::tables::file_name;
use super::*;
use crate::sim::Rollout;

const FRAMES: usize = 10;
const FARTHEST_M: f64 = 1.0; // from the recorded body, at which a predicted robot is drawn

pub(crate) fn modelled(model: &ReducedModel, run: &SegmentRun<'_>) -> Result<Vec<bool>> {
    let weights = model.encoder_jacobian(&run.segment.x.column(0).into_owned())?;
    Ok((weights.column_iter().map(|column| column.amax() != 0.0)).collect())
}

pub(super) struct JumpName {
    pub suffix: String,
    pub words: String,
}

impl JumpName {
    pub(crate) fn of_recording(index: usize, path: &Path) -> Self {
        let name = file_name(path);
        let stem = name.trim_end_matches(".gz").trim_end_matches(".csv");
        Self {
            suffix: (index + 1).to_string(),
            words: stem.to_owned(),
        }
    }

    pub(super) fn id(&self, what: &str) -> String {
        format!("{what}_{}", self.suffix)
    }
}

type Samples = Vec<Option<DVector<f64>>>;

fn predicted(
    run: &SegmentRun<'_>,
    rollout: &Rollout,
    value: impl Fn(usize, &DVector<f64>, &DVector<f64>) -> Result<DVector<f64>>,
) -> Result<Samples> {
    let states = rollout.states(run.latent.time_s.len()).into_iter();
    let value = |(sample, state): (usize, Option<(DVector<f64>, DVector<f64>)>)| {
        state.map(|(z, dz)| value(sample, &z, &dz)).transpose()
    };
    states.enumerate().map(value).collect()
}

pub(super) struct Jump<'a> {
    pub model: &'a ReducedModel,
    pub assessment: &'a Assessment<'a>,
    pub run: &'a SegmentRun<'a>,
    pub place: JumpName,
    full: Samples,
    restarted: Samples,
    modelled: Vec<bool>,
}

impl<'a> Jump<'a> {
    fn new(content: &Content<'a>, index: usize, run: &'a SegmentRun<'a>) -> Result<Self> {
        let (model, assessment, path) = (content.model, content.assessment, &run.segment.path);
        let mut place = JumpName::of_recording(index, path);
        let same = assessment.runs.iter().filter(|of| of.segment.path == *path);
        if same.count() > 1 {
            place.words += &format!(", from row {}", run.segment.first_row);
        }
        let decoded = |rollout| predicted(run, rollout, |_, z, _| model.decode(z));
        Ok(Self {
            full: decoded(&run.full)?,
            restarted: decoded(&run.restarted)?,
            modelled: modelled(model, run)?,
            model,
            assessment,
            run,
            place,
        })
    }

    pub(super) fn all(content: &Content<'a>) -> Result<Vec<Self>> {
        let runs = content.assessment.runs.iter().enumerate();
        (runs.map(|(index, run)| Self::new(content, index, run))).collect()
    }

    /// As a strip and as an animation; none without a robot.
    pub(crate) fn motion(&self, plan: Option<&Segment>) -> Option<(Figure, Film)> {
        let robot = self.model.robot().ok()?;
        let segment = &*self.run.segment;
        let predicted = Motion {
            role: Role::Full,
            words: "model, whole motion".to_owned(),
            states: self.states(),
        };
        let mut motions = vec![Motion::recorded(segment), predicted];
        motions.extend(plan.map(|plan| Motion::planned(plan, segment)));
        let caption = match plan {
            Some(_) => "planned, recorded, and predicted over the whole motion",
            None => "recorded, and predicted over the whole motion",
        };
        let caption = format!("{}: {caption}.", self.place.words);
        let names = (self.place.id("motion"), caption);
        let from = (segment.x[(STATE_DIM - 1, 0)], floor_m(robot, segment));
        let motions = (segment.time_s.as_slice(), motions.as_slice());
        Some((
            film_strip(robot, names, motions, from, FRAMES),
            film(robot, motions, from),
        ))
    }

    /// Predicted states near the recording; coordinates that the model does not encode stay as recorded.
    fn states(&self) -> Samples {
        let recorded = &self.run.segment.x;
        let mut states = self.full.clone();
        for (sample, of_sample) in states.iter_mut().enumerate() {
            let distance_m = |state: &DVector<f64>| {
                let [x, z] = [BODY_X, BODY_Z].map(|row| state[row] - recorded[(row, sample)]);
                x.hypot(z)
            };
            *of_sample = of_sample.take_if(|state| distance_m(state) < FARTHEST_M);
            let Some(state) = of_sample else { continue };
            for row in (0..STATE_DIM).filter(|&row| !self.modelled[row]) {
                state[row] = recorded[(row, sample)];
            }
        }
        states
    }

    fn series(&self, role: Role, value: impl Fn(usize) -> Option<f64>) -> Series {
        Series::over(role, &self.run.latent.time_s, value)
    }

    fn panel(&self, title: impl Into<String>, series: Vec<Series>) -> Panel {
        Panel::shaded(title, series, self.flights())
    }

    fn flights(&self) -> Vec<(f64, f64)> {
        let Segment { time_s, feet, .. } = &*self.run.segment;
        let in_air = |sample: usize| !feet[sample].contains(&true);
        let spans = stretches(0..feet.len(), |a, b| in_air(a) == in_air(b)).into_iter();
        let flights = spans.filter(|span| in_air(span.start));
        (flights.map(|span| (time_s[span.start], time_s[span.end - 1]))).collect()
    }

    fn rollout_figure(&self, id: &str, caption: String, panels: Vec<Panel>) -> Figure {
        let every = self.assessment.restart_every_s;
        let restarted = format!("model, restarted every {every} s");
        let legend = [
            (Role::Recorded, "recorded"),
            (Role::Full, "model, whole motion"),
            (Role::Restarted, &restarted),
        ];
        Figure::over_time(self.place.id(id), caption, panels, &legend)
    }

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
    pub(crate) fn coordinates(&self) -> [Figure; 2] {
        let (names, units) = (&self.assessment.names, &self.assessment.units);
        let rollouts = [&self.full, &self.restarted];
        let panel = |row: usize| {
            let recorded = |k| self.run.segment.x[(row, k)];
            let title = format!("{}, {}", names[row], units[row]);
            if self.modelled[row] {
                return self.beside_rollouts(title, recorded, rollouts, row);
            }
            let line = self.series(Role::Recorded, |k| Some(recorded(k)));
            self.panel(format!("{title} (not modelled)"), vec![line])
        };
        let figure = |id: &str, what: &str, rows: std::ops::Range<usize>| {
            let (of, words) = (&self.place.words, "recorded, and predicted by the model");
            let caption = format!("{what} of {of}: {words}. Grey: flight.");
            self.rollout_figure(id, caption, rows.map(panel).collect())
        };
        let body = JOINT_DIM..names.len();
        [
            figure("joints", "Joint angles", 0..JOINT_DIM),
            figure("body", "Body position and orientation", body),
        ]
    }

    /// Figure 12 of the paper.
    pub(crate) fn accelerations(&self) -> Result<Figure> {
        let latent = &self.run.latent;
        let ddz = |k: usize, z: &DVector<f64>, dz: &DVector<f64>| {
            let u_lat = latent.u_lat.column(k).into_owned();
            self.model.ddz(latent.phase[k], z, dz, &u_lat)
        };
        let full = predicted(self.run, &self.run.full, ddz)?;
        let restarted = predicted(self.run, &self.run.restarted, ddz)?;
        let panel = |row: usize| {
            let title = format!("d²z{}/dt²", subscript(row + 1));
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

    /// Body position of the recording, the model and baselines under the same recorded forces.
    fn body_path(&self, id: &str, shown: &[usize]) -> Figure {
        let (run, every) = (self.run, &self.assessment.baselines);
        let roles = [Role::Baseline, Role::SecondBaseline].into_iter();
        let baselines: Vec<(Role, usize)> = roles.zip(shown.iter().copied()).collect();
        let panel = |row: usize, axis: usize, title: &str| {
            let mut lines = vec![
                self.series(Role::Recorded, |k| Some(run.segment.x[(row, k)])),
                self.series(Role::Full, |k| self.full[k].as_ref().map(|x| x[row])),
            ];
            let others = baselines.iter().map(|&(role, index)| {
                let rollout = &run.baselines[index];
                self.series(role, |k| rollout[k].map(|at| at[axis]))
            });
            lines.extend(others);
            self.panel(title, lines)
        };
        let model = match run.full.diverged_at_s() {
            Some(time_s) => format!("model: diverges at {time_s:.2} s"),
            None => "model".to_owned(),
        };
        let mut legend = vec![(Role::Recorded, "recorded"), (Role::Full, &model)];
        legend.extend(
            baselines
                .iter()
                .map(|&(role, index)| (role, every[index].name)),
        );
        let meanings = shown.iter().map(|&index| meaning(&every[index]));
        let caption = format!(
            "{}: body position predicted from the first sample with the recorded torques. {}Grey: flight.",
            self.place.words,
            meanings.collect::<String>()
        );
        let (x, z) = ("forward position, m", "body height, m");
        let panels = vec![panel(BODY_X, 0, x), panel(BODY_Z, 1, z)];
        Figure::over_time(id, caption, panels, &legend)
    }

    /// Figure 8 of the paper, with fitted constants next to the published ones.
    pub(crate) fn baselines(&self) -> Figure {
        let every: Vec<usize> = (0..self.assessment.baselines.len()).collect();
        let figure = self.body_path(&self.place.id("aslip"), &every);
        figure.in_columns(2, (360.0, 180.0))
    }

    /// The same with the best baseline only, as used on the first screen.
    pub(super) fn overview(&self) -> Figure {
        let best = best_template(self.assessment);
        let mut figure = self.body_path("overview", best.as_slice());
        figure.panels.reverse();
        figure.in_columns(1, (330.0, 140.0))
    }

    /// Root mean square errors in body x and z over the whole motion.
    pub(crate) fn body_rms(&self) -> [String; 2] {
        let of = |row: usize| {
            let mut sums = FitSums::default();
            let states = self.full.iter().enumerate();
            for (sample, state) in states.filter_map(|(k, state)| Some((k, state.as_ref()?))) {
                sums.add(self.run.segment.x[(row, sample)], state[row]);
            }
            let diverged = self.run.full.diverged_at_s().map(|_| f64::INFINITY);
            let rms = diverged.or(sums.fit().map(|fit| fit.rms));
            rms.map_or("-".to_owned(), |rms| with_unit(rms, "m"))
        };
        [BODY_X, BODY_Z].map(of)
    }
}

/// A line about a baseline that has the recorded forces.
pub(super) fn meaning(baseline: &Baseline) -> String {
    let kind = match baseline.template.stiffness_n_m {
        0.0 => "a mass under gravity and the recorded forces of the feet",
        _ => "a mass on a spring leg under gravity and the recorded forces of the feet",
    };
    let mut name = baseline.name.to_owned();
    name[..1].make_ascii_uppercase();
    format!("{name}: {kind}. ")
}
