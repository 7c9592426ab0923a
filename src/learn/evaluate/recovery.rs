//! Pushed, and back to the recording: the controller's feedback in a closed loop that no model has a part in.
//!
//! Along a recording the measured state is the reference, so that feedback has nothing to do and a command is the
//! lifted reference input whatever the dynamics are. Here the trunk gets a push and moves on by Newton's law under what
//! the commanded torques differ from the recorded ones:
//!
//! ```text
//! m dv' = sum_k R F_k(tau_command - tau_recorded),   F_k = -J_k^-T tau_k for each foot k on the ground,   dp' = dv,
//! J_k dq_k = -R^T dp
//! ```
//!
//! with the recording's postures, the robot's own geometry and mass, feet that stay where they stand and an attitude
//! that stays the recorded one. The controller measures the recorded state plus this deviation.

use nalgebra::Vector3;

use super::along_recording::{ReferenceInput, control_samples, set_reference};
use super::coordinates::Mean;
use crate::mpc::{Controller, Measurement, MpcError};
use crate::recording::{Recording, Segment};
use crate::robot::input_rule::rotation;
use crate::robot::{JOINT_DIM, Leg, Robot, STATE_DIM};

/// Speed of a push, m/s.
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
    /// The controller, given the state with the deviation.
    Feedback,
    /// The controller, given the recorded state.
    NoFeedback,
    Replay,
}

/// Mean squares over times and pushes.
#[derive(Default)]
pub(super) struct Recovery {
    /// Of the body's deviation from the recording, m.
    pub deviations: Mean,
    /// Of planned minus reference positions, in standard deviations of the reference.
    pub planned: Mean,
}

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
        // Every foot that is on the ground stays there for the time of a window.
        let stands = |window: &&[usize]| {
            let feet = &segment.feet[window[0]..=window[window_steps]];
            feet[0].contains(&true) && feet.iter().all(|other| *other == feet[0])
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
            let jacobian = robot.foot_jacobian(leg, &leg.of_joints(&joints));
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
        robot: &Robot,
        difference_nm: &[f64; JOINT_DIM],
    ) {
        let step_s = segment.time_s[sample + 1] - segment.time_s[sample];
        let (x, feet) = (segment.state(sample), segment.feet[sample]);
        let wrench = robot.body_wrench(&segment.joints(sample), difference_nm, feet);
        let force = wrench.map_or(Vector3::zeros(), |all| all.fixed_rows::<3>(0).into_owned());
        let force = rotation([x[15], x[16], x[17]]) * force;
        self.velocity_m_s += force * (step_s / robot.mass_kg());
        self.position_m += self.velocity_m_s * step_s;
    }
}
