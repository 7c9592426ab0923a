//! Values of the C interface: a trajectory and measurements in, a command out.

use crate::robot::{JOINT_DIM, Robot};

/// What a robot's low-level interface takes, as C has it; `D` latent coordinates.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RawCommand<const D: usize> {
    /// Feed-forward torques, N m.
    pub torque: [f64; JOINT_DIM],
    /// Desired joint positions, rad.
    pub joint_position: [f64; JOINT_DIM],
    /// Desired joint velocities, rad/s.
    pub joint_velocity: [f64; JOINT_DIM],
    /// Latent input behind the torques.
    pub u_lat: [f64; D],
    /// How the step ended.
    pub status: i32,
    /// Interior-point iterations.
    pub iterations: i32,
    /// Wall time of the step, µs.
    pub solve_us: f64,
}

impl<const D: usize> RawCommand<D> {
    /// No torque, at the middle of the joints' ranges: what is commanded when nothing is known.
    pub fn at_rest(robot: &Robot, status: i32) -> Self {
        Self {
            torque: [0.0; JOINT_DIM],
            joint_position: robot
                .joint_limit_rad()
                .map(|(lower, upper)| 0.5 * (lower + upper)),
            joint_velocity: [0.0; JOINT_DIM],
            u_lat: [0.0; D],
            status,
            iterations: 0,
            solve_us: 0.0,
        }
    }
}

/// A trajectory as it comes through the interface; see [`ReferenceSamples`](super::super::ReferenceSamples).
#[derive(Debug, Clone, Copy)]
pub struct RawReference<'a> {
    /// Time of each sample, s.
    pub time_s: Option<&'a [f64]>,
    /// States, 18 values per sample.
    pub x: Option<&'a [f64]>,
    /// Velocities, 18 values per sample.
    pub dx: Option<&'a [f64]>,
    /// Inputs, 18 values per sample, unless there are none; the inner `None` is a bad pointer.
    pub u: Option<Option<&'a [f64]>>,
    /// Feet in contact, 4 values per sample, zero in the air.
    pub feet: Option<&'a [u8]>,
}

/// A measurement as it comes through the interface.
#[derive(Debug, Clone, Copy)]
pub struct RawMeasurement<'a> {
    /// Time, s.
    pub time_s: f64,
    /// State, 18 values.
    pub x: Option<&'a [f64]>,
    /// Velocity, 18 values.
    pub dx: Option<&'a [f64]>,
    /// Feet in contact, 4 values, zero in the air.
    pub feet: Option<&'a [u8]>,
}
