//! Metrics of a controller's run along a recording; those that depend on the dynamics are compared with baselines.

use super::along_recording::{control_samples, set_reference};
use super::prediction::{prediction_error, recorded_stages, uninformed};
use super::verdict::failure;
use super::*;
use crate::mpc::problem::has_links_or_cones;
use crate::mpc::{Bounds, Legs, structured::MAX_STRUCTURED_DIM};

#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct StepTimes {
    pub p50: f64,
    pub p99: f64,
    pub max: f64,
}

#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Summary {
    pub steps: usize,
    pub solved: usize,
    /// Steps with a checked plan that leaves joint limits.
    pub softened: usize,
    pub failed: usize,
    pub step_us: StepTimes,
    /// Of [`Controller::prepare`](crate::mpc::Controller::prepare), which no command waits for.
    pub prepare_us: StepTimes,
    pub torque_r2: ByContact,
    /// Of the lift alone: recorded inputs projected and lifted.
    pub lift_r2: ByContact,
    pub torque_rms_nm: Option<f64>,
    /// Of planned minus reference positions, in standard deviations of the reference.
    pub tracking_rms: Option<f64>,
    pub limit_violations: usize,
    /// None if the controller constrains no friction cone.
    pub friction_violations: Option<usize>,
    /// Mean of `|F_lift − G τ| / |F_lift|` over the steps where it is defined.
    pub inconsistency: Option<f64>,
    #[serde(rename = "implausible_steps")]
    pub implausible: usize,
}

#[derive(Debug, Clone, Default)]
pub(super) struct Tally {
    pub(super) summary: Summary,
    times_us: Vec<f64>,
    pub(super) preparations_us: Vec<f64>,
    inconsistency: Mean,
    pub(super) torque: Comparison,
    pub(super) lift: Comparison,
    pub(super) tracking: Mean,
}

impl Tally {
    pub(super) fn count(&mut self, command: &Command) {
        let counts = &mut self.summary;
        counts.steps += 1;
        match command.status {
            Status::Softened => counts.softened += 1,
            status if status.has_plan() => counts.solved += 1,
            _ => counts.failed += 1,
        }
        self.times_us.push(command.solve_us);
        if let Some(value) = command.inconsistency {
            self.inconsistency.add(value);
        }
    }

    pub(super) fn summary(self) -> Summary {
        Summary {
            step_us: step_times(self.times_us),
            prepare_us: step_times(self.preparations_us),
            torque_r2: self.torque.r2(),
            lift_r2: self.lift.r2(),
            torque_rms_nm: self.torque.rms(),
            tracking_rms: self.tracking.root(),
            inconsistency: self.inconsistency.get(),
            ..self.summary
        }
    }
}

/// Percentiles: the smallest value that so many percent do not exceed.
fn step_times(mut times_us: Vec<f64>) -> StepTimes {
    times_us.sort_by(f64::total_cmp);
    let [p50, p99, max] = [0.5, 0.99, 1.0].map(|share| {
        let rank = (share * times_us.len() as f64).ceil() as usize;
        times_us.get(rank.max(1) - 1).copied().unwrap_or(0.0)
    });
    StepTimes { p50, p99, max }
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ControlMetrics {
    /// Predictions one stage ahead with the recorded input; none if no stage lies within one phase.
    pub prediction_rms: Option<PredictionError>,
    /// Agreement of commanded and recorded torques where the controller has to find the input itself.
    pub torque_r2: ByContact,
    pub torque_rms_nm: Option<f64>,
    /// Mean of `|F_lift - G tau| / |F_lift|` over the steps of the same run where it is defined.
    pub inconsistency: Option<f64>,
    /// Deviation of the body after pushes, m; none where the robot nowhere stands for long enough.
    pub recovery_rms_m: Option<f64>,
    /// Planned minus reference positions after the pushes, in standard deviations of the reference.
    pub tracking_rms: Option<f64>,
    pub baseline: Baselines,
    pub unplanned_share: f64,
    /// The counted rows of the [verdict](super::Verdict) that fail along this recording, in words.
    pub failure: Option<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Baselines {
    /// The same controller on a copy of the model with `ddz = g u_lat`, `g` fitted to this very recording.
    pub no_dynamics: NoDynamics,
    /// The same controller, given the recorded state after the pushes.
    pub feedback_off: Pushed,
    pub replay: Pushed,
    pub constant_velocity: ConstantVelocity,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NoDynamics {
    pub prediction_rms: Option<PredictionError>,
    pub torque_r2: ByContact,
    pub torque_rms_nm: Option<f64>,
    pub recovery_rms_m: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Pushed {
    pub recovery_rms_m: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ConstantVelocity {
    pub prediction_rms: Option<PredictionError>,
}

/// Uses the structured solver where it accepts the whole program: there are some thirty times as many as in one run.
pub fn control_metrics(
    model: &ReducedModel,
    recording: &Recording,
    mut settings: MpcSettings,
) -> Result<ControlMetrics> {
    if model.latent_dim() <= MAX_STRUCTURED_DIM && !has_links_or_cones(&settings) {
        settings.solver = Solver::Riccati;
    }
    // The plant is the model: nothing stands or falls.
    settings.bounds = Bounds::OFF;
    let stages = recorded_stages(model, recording, settings.step_s)?;
    let predicted = |dynamics: Option<&ReducedModel>| prediction_error(model, dynamics, &stages);
    let blind = uninformed(model, &stages)?;
    let mut controller = crate::mpc::controller(model, settings)?;
    let mut blind_controller = crate::mpc::controller(&blind, settings)?;
    let own_input = |controller: &mut Controller| {
        along_recording(controller, recording, ReferenceInput::None, |_, _| {})
    };
    let run = own_input(&mut controller)?.summary;
    let blind_run = own_input(&mut blind_controller)?.summary;
    let feedback = recovery(&mut controller, recording, Driver::Feedback)?;
    let pushed = |controller: &mut Controller, driver| {
        let recovery_rms_m = recovery(controller, recording, driver)?.deviations.root();
        Ok::<_, MpcError>(Pushed { recovery_rms_m })
    };
    let mut metrics = ControlMetrics {
        prediction_rms: predicted(Some(model))?,
        torque_r2: run.torque_r2,
        torque_rms_nm: run.torque_rms_nm,
        inconsistency: run.inconsistency,
        recovery_rms_m: feedback.deviations.root(),
        tracking_rms: feedback.planned.root(),
        unplanned_share: run.failed as f64 / run.steps as f64,
        baseline: Baselines {
            no_dynamics: NoDynamics {
                prediction_rms: predicted(Some(&blind))?,
                torque_r2: blind_run.torque_r2,
                torque_rms_nm: blind_run.torque_rms_nm,
                recovery_rms_m: pushed(&mut blind_controller, Driver::Feedback)?.recovery_rms_m,
            },
            feedback_off: pushed(&mut controller, Driver::NoFeedback)?,
            replay: pushed(&mut controller, Driver::Replay)?,
            constant_velocity: ConstantVelocity {
                prediction_rms: predicted(None)?,
            },
        },
        failure: None,
    };
    metrics.failure = failure(&metrics);
    Ok(metrics)
}

/// Settings of a walk for a model with strides, otherwise the default ones. If a recording has fewer samples than a
/// default stage, the stage has the time step of the slowest recording.
pub fn usual_settings(model: &ReducedModel, recordings: &[Recording]) -> MpcSettings {
    let default = crate::mpc::settings_for(model);
    let segments = recordings.iter().flat_map(|recording| &recording.segments);
    let steps = segments.filter(|segment| segment.len() >= 2);
    let slowest_s = steps.map(Segment::mean_step_s).fold(0.0, f64::max);
    let is_slow = default.step_s < STEP_SLACK * slowest_s;
    MpcSettings {
        step_s: if is_slow { slowest_s } else { default.step_s },
        ..default
    }
}

const PUSH_M_S: f64 = 0.1;
const PUSHES: [[f64; 3]; 4] = [
    [1.0, 0.0, 0.0],
    [-1.0, 0.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.0, 0.0, -1.0],
];
/// Times from a push to the end, and from one push to the next, s.
const WINDOW_S: f64 = 0.2;
const BETWEEN_S: f64 = 0.1;
const MOST_WINDOWS: usize = 50;
const LARGEST_M: f64 = 0.1;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Driver {
    Feedback,   // measures the recorded state with the deviation
    NoFeedback, // measures the recorded state
    Replay,
}

/// Mean squares over times and pushes.
#[derive(Default)]
pub(super) struct Recovery {
    pub deviations: Mean, // of the body from the recording, m
    pub planned: Mean, // planned minus reference positions, in standard deviations of the reference
}

/// The controller's feedback in a closed loop without a model: along a recording the measured state is the reference,
/// so that feedback has nothing to do. Here a pushed trunk moves by Newton's law under the difference of commanded and
/// recorded torques, `m dv' = sum_k R F_k(tau_command - tau_recorded)` with `F_k = -J_k^-T tau_k` for each foot `k` on
/// the ground, `dp' = dv`, `J_k dq_k = -R^T dp`. The controller measures the recorded state plus this deviation.
pub(super) fn recovery(
    controller: &mut Controller,
    recording: &Recording,
    driver: Driver,
) -> Result<Recovery, MpcError> {
    let (mut recovery, step_s) = (Recovery::default(), controller.settings().step_s);
    let [window_steps, steps_between] =
        [WINDOW_S, BETWEEN_S].map(|time_s| ((time_s / step_s).round() as usize).max(1));
    for segment in recording.segments.iter().filter(|s| s.len() >= 2) {
        set_reference(controller, segment, ReferenceInput::Recorded)?;
        let samples = control_samples(&segment.time_s, step_s);
        // Every foot that is on the ground stays there for the time of a window; a walk changes its feet.
        let walks = controller.settings().legs == Legs::Reference;
        let stands = |window: &&[usize]| {
            let feet = &segment.feet[window[0]..=window[window_steps]];
            feet[0].contains(&true) && (walks || feet.iter().all(|other| *other == feet[0]))
        };
        let windows = samples.windows(window_steps + 1).step_by(steps_between);
        let windows: Vec<&[usize]> = windows.filter(stands).collect();
        let every = windows.len().div_ceil(MOST_WINDOWS).max(1);
        for window in windows.into_iter().step_by(every) {
            for push in PUSHES {
                controller.reset();
                let pushed = Deviation {
                    position_m: Vector3::zeros(),
                    velocity_m_s: Vector3::from(push) * PUSH_M_S,
                };
                run(controller, segment, window, pushed, driver, &mut recovery);
            }
        }
    }
    Ok(recovery)
}

fn run(
    controller: &mut Controller,
    segment: &Segment,
    window: &[usize],
    mut deviation: Deviation,
    driver: Driver,
    recovery: &mut Recovery,
) {
    let robot = controller.plant().robot();
    let limits = robot.torque_limit_nm();
    for pair in window.windows(2) {
        let (start, end) = (pair[0], pair[1]);
        let seen = match driver {
            Driver::Feedback => Some(deviation),
            Driver::NoFeedback => Some(Deviation::default()),
            Driver::Replay => None,
        };
        let command = seen.map(|seen| {
            let (x, dx) = seen.measured(segment, start, robot);
            let command = controller.step(Measurement {
                time_s: segment.time_s[start],
                x: &x,
                dx: &dx,
                feet: segment.feet[start],
            });
            if command.status.has_plan() {
                for planned in controller.planned_deviations() {
                    recovery.planned.add(planned * planned);
                }
            }
            command.torque_nm
        });
        for sample in start..end {
            let recorded = segment.torque(sample);
            let recorded: [f64; JOINT_DIM] =
                std::array::from_fn(|i| recorded[i].clamp(-limits[i], limits[i]));
            let torque = command.unwrap_or(recorded);
            let difference = std::array::from_fn(|i| torque[i] - recorded[i]);
            deviation.advance(segment, sample, robot, &difference);
            let square = deviation.position_m.norm_squared();
            recovery.deviations.add(square.min(LARGEST_M * LARGEST_M));
        }
    }
}

#[derive(Debug, Clone, Copy, Default)]
struct Deviation {
    position_m: Vector3<f64>,
    velocity_m_s: Vector3<f64>,
}

impl Deviation {
    fn measured(
        &self,
        segment: &Segment,
        sample: usize,
        robot: &Robot,
    ) -> ([f64; STATE_DIM], [f64; STATE_DIM]) {
        let mut x = segment.state(sample);
        let mut dx: [f64; STATE_DIM] = std::array::from_fn(|i| segment.dx[(i, sample)]);
        let attitude = rotation([x[15], x[16], x[17]]);
        let joints = segment.joints(sample);
        for leg in Leg::ALL {
            let jacobian = robot.geometry(leg).foot_jacobian(&leg.of_joints(&joints));
            let inverse = jacobian.try_inverse();
            if let Some(inverse) = inverse.filter(|_| segment.feet[sample][leg.index()]) {
                let turn = -inverse * attitude.transpose();
                let (dq, ddq) = (turn * self.position_m, turn * self.velocity_m_s);
                for joint in 0..3 {
                    x[3 * leg.index() + joint] += dq[joint];
                    dx[3 * leg.index() + joint] += ddq[joint];
                }
            }
        }
        for axis in 0..3 {
            x[JOINT_DIM + axis] += self.position_m[axis];
            dx[JOINT_DIM + axis] += self.velocity_m_s[axis];
        }
        (x, dx)
    }

    fn advance(
        &mut self,
        segment: &Segment,
        sample: usize,
        robot: &'static Robot,
        difference_nm: &[f64; JOINT_DIM],
    ) {
        let step_s = segment.time_s[sample + 1] - segment.time_s[sample];
        let (x, feet) = (segment.state(sample), segment.feet[sample]);
        let wrench = InputRule::published(robot).wrench(&x, difference_nm, feet);
        let force = wrench.map_or(Vector3::zeros(), |all| all.fixed_rows::<3>(0).into_owned());
        let force = rotation([x[15], x[16], x[17]]) * force;
        self.velocity_m_s += force * (step_s / robot.mass_kg());
        self.position_m += self.velocity_m_s * step_s;
    }
}
