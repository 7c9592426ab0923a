//! Names and order of joints, legs and body coordinates, used everywhere. Legs: front right, front left, rear right,
//! rear left. Joints of a leg: hip abduction, hip flexion, knee. Then the body's position and its roll, pitch and yaw.

use std::fmt;

/// Number of actuated joints.
pub const JOINT_DIM: usize = 12;
/// Number of body coordinates, and of entries of a body wrench.
pub const BODY_DIM: usize = 6;
/// Number of coordinates of the state `x`, and of entries of the input `u`.
pub const STATE_DIM: usize = JOINT_DIM + BODY_DIM;
/// Row of the body's position along x in the state; y and z follow.
pub const BODY_X: usize = JOINT_DIM;
/// Row of the body's height in the state.
pub const BODY_Z: usize = JOINT_DIM + 2;
/// Row of the body's yaw in the state.
pub const YAW: usize = JOINT_DIM + 5;
/// Number of feet.
pub const FOOT_DIM: usize = 4;
/// Number of joints of a leg.
pub const LEG_JOINT_DIM: usize = 3;

/// Acceleration of free fall, in m/s^2.
pub const GRAVITY_M_S2: f64 = 9.81;

/// Which feet touch the ground, in the order of [`Leg::ALL`].
pub type ContactFlags = [bool; FOOT_DIM];

/// Joint names in the order of the state.
pub const JOINT_NAMES: [&str; JOINT_DIM] = [
    "fr.hx", "fr.hy", "fr.kn", "fl.hx", "fl.hy", "fl.kn", "rr.hx", "rr.hy", "rr.kn", "rl.hx",
    "rl.hy", "rl.kn",
];

/// Names of the body coordinates in the order of the state.
pub const BODY_NAMES: [&str; BODY_DIM] = [
    "body.x",
    "body.y",
    "body.z",
    "body.roll",
    "body.pitch",
    "body.yaw",
];

/// Names of the body wrench's entries, which follow the torques in the input.
pub(crate) const WRENCH_NAMES: [&str; BODY_DIM] = [
    "force.x", "force.y", "force.z", "moment.x", "moment.y", "moment.z",
];

/// A leg of the quadruped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Leg {
    /// `fr`
    FrontRight,
    /// `fl`
    FrontLeft,
    /// `rr`
    RearRight,
    /// `rl`
    RearLeft,
}

impl Leg {
    /// The legs in the order of joints, contact flags and columns.
    pub const ALL: [Leg; FOOT_DIM] = [
        Leg::FrontRight,
        Leg::FrontLeft,
        Leg::RearRight,
        Leg::RearLeft,
    ];

    /// The legs whose feet are on the ground.
    pub fn down(feet: ContactFlags) -> impl Iterator<Item = Leg> {
        Leg::ALL.into_iter().filter(move |leg| feet[leg.index()])
    }

    /// Position in [`Leg::ALL`].
    pub const fn index(self) -> usize {
        self as usize
    }

    /// Abbreviation used in joint names: `fr`, `fl`, `rr`, `rl`.
    pub const fn short_name(self) -> &'static str {
        match self {
            Leg::FrontRight => "fr",
            Leg::FrontLeft => "fl",
            Leg::RearRight => "rr",
            Leg::RearLeft => "rl",
        }
    }

    /// `front right`, `rear left`.
    pub const fn words(self) -> &'static str {
        match self {
            Leg::FrontRight => "front right",
            Leg::FrontLeft => "front left",
            Leg::RearRight => "rear right",
            Leg::RearLeft => "rear left",
        }
    }

    /// Sign of the leg's side along the body's y axis: +1 left, -1 right.
    pub const fn side(self) -> f64 {
        match self {
            Leg::FrontLeft | Leg::RearLeft => 1.0,
            Leg::FrontRight | Leg::RearRight => -1.0,
        }
    }

    /// Whether the leg is one of the front pair.
    pub const fn is_front(self) -> bool {
        matches!(self, Leg::FrontRight | Leg::FrontLeft)
    }

    /// The leg's three entries of a vector over all joints.
    pub fn of_joints(self, joints: &[f64; JOINT_DIM]) -> [f64; LEG_JOINT_DIM] {
        let first = LEG_JOINT_DIM * self.index();
        [joints[first], joints[first + 1], joints[first + 2]]
    }
}

impl fmt::Display for Leg {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.short_name())
    }
}
