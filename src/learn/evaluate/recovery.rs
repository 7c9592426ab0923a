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
/// Most pushes along one segment, times the directions: longer segments are pushed less often.
const MOST_WINDOWS: usize = 50;
/// Deviation beyond which a run counts with this one, m: the linear geometry ends there.
const LARGEST_M: f64 = 0.1;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Driver {
    /// The controller, given the state with the deviation.
    Feedback,
    /// The controller, given the recorded state.
    NoFeedback,
    Replay,
}

#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Recovery {
    deviations: Mean,
    planned: Mean,
}

impl Recovery {
    /// Root mean square of the body's deviation from the recording after pushes of 0.1 m/s, over times and pushes, m.
    pub(super) fn rms_m(&self) -> Option<f64> {
        self.deviations.get().map(f64::sqrt)
    }

    /// Root mean square of planned minus reference positions, in standard deviations of the reference.
    pub(super) fn tracking_rms(&self) -> Option<f64> {
        self.planned.get().map(f64::sqrt)
    }
}

/// Pushes the robot at many times of a recording, with every foot that is on the ground staying there for the time of a
/// window.
pub(super) fn recovery(
    controller: &mut Controller,
    recording: &Recording,
    driver: Driver,
) -> Result<Recovery, MpcError> {
    let mut recovery = Recovery::default();
    let step_s = controller.settings().step_s;
    let [window_steps, steps_between] =
        [WINDOW_S, BETWEEN_S].map(|time_s| ((time_s / step_s).round() as usize).max(1));
    for segment in recording.segments.iter().filter(|s| s.len() >= 2) {
        set_reference(controller, segment, ReferenceInput::Recorded)?;
        let samples = control_samples(&segment.time_s, step_s);
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
                    velocity_m_s: Vector3::from(push) * PUSH_M_S,
                    ..Deviation::default()
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

/// Where the trunk is beside the recording.
#[derive(Debug, Clone, Copy, Default)]
struct Deviation {
    position_m: Vector3<f64>,
    velocity_m_s: Vector3<f64>,
}

impl Deviation {
    /// State and velocity of the robot, joints such that feet on the ground stay where they are.
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
        let x = segment.state(sample);
        let joints = segment.joints(sample);
        let feet = segment.feet[sample];
        let force = (robot.body_wrench(&joints, difference_nm, feet))
            .map_or(Vector3::zeros(), |wrench| {
                wrench.fixed_rows::<3>(0).into_owned()
            });
        let force = rotation([x[15], x[16], x[17]]) * force;
        self.velocity_m_s += force * (step_s / robot.mass_kg());
        self.position_m += self.velocity_m_s * step_s;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::shipped_model;
    use crate::mpc::MpcSettings;

    #[test]
    fn replay_moves_on_at_the_speed_of_the_push_and_feedback_does_not() {
        let model = shipped_model("go1-d6");
        let jump = crate::evaluate::shipped("go1/test_01");
        let mut controller =
            crate::mpc::controller(&model, MpcSettings::default()).expect("complete");
        // after k of 100 samples of 2 ms the body is 0.1 m/s k 2 ms away, whatever the control step
        let mean_square = (1..=100).map(|k| f64::from(k * k)).sum::<f64>() / 100.0;
        for step_s in [0.002, 0.02] {
            let settings = MpcSettings {
                step_s,
                ..MpcSettings::default()
            };
            let mut controller = crate::mpc::controller(&model, settings).expect("complete");
            let replay = recovery(&mut controller, &jump, Driver::Replay).expect("a sound jump");
            let replay = replay.rms_m().expect("the robot stands");
            let expected = 0.1 * 0.002 * mean_square.sqrt();
            assert!((replay - expected).abs() < 1e-9, "{step_s}: {replay}");
        }
        let mut pushed = |driver| recovery(&mut controller, &jump, driver).expect("a sound jump");
        let feedback = pushed(Driver::Feedback);
        let none = pushed(Driver::NoFeedback);
        assert!(feedback.rms_m() < none.rms_m(), "{feedback:?} {none:?}");
        assert!(feedback.tracking_rms() > none.tracking_rms());
    }
}
