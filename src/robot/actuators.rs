//! What the joints take from a motor's torque before it moves a leg.
//!
//! A motor that commands `tau` turns a link with the net torque `tau - b dq - c tanh(dq / v) - I ddq`: viscous
//! friction, dry friction, and the rotor's inertia seen through the gear (the armature). The dry part is smooth around
//! standstill, with `v` = [`DRY_SPEED_RAD_S`].

use super::joints::{JOINT_DIM, LEG_JOINT_DIM};

/// Joint speed within which dry friction changes its sign, in rad/s.
pub const DRY_SPEED_RAD_S: f64 = 0.05;

/// Losses of the twelve joints, in the order of [`JOINT_NAMES`](super::JOINT_NAMES).
#[derive(Debug, Clone, PartialEq)]
pub struct Actuators {
    /// Viscous friction `b`, in N m s/rad.
    pub viscous: [f64; JOINT_DIM],
    /// Dry friction `c`, in N m.
    pub dry: [f64; JOINT_DIM],
    /// Armature `I`, in kg m^2.
    pub armature: [f64; JOINT_DIM],
}

impl Actuators {
    /// The same three values, of abduction, flexion and knee, for every leg.
    #[must_use]
    pub fn of_leg(viscous: [f64; 3], dry: [f64; 3], armature: [f64; 3]) -> Self {
        let each = |leg: [f64; 3]| std::array::from_fn(|i| leg[i % LEG_JOINT_DIM]);
        Self {
            viscous: each(viscous),
            dry: each(dry),
            armature: each(armature),
        }
    }

    /// The three arrays with their names.
    #[must_use]
    pub fn named(&self) -> [(&'static str, &[f64; JOINT_DIM]); 3] {
        [
            ("viscous", &self.viscous),
            ("dry", &self.dry),
            ("armature", &self.armature),
        ]
    }

    /// The first value that is negative or not finite: its array's name, joint and value.
    #[must_use]
    pub fn unusable(&self) -> Option<(&'static str, usize, f64)> {
        self.named().into_iter().find_map(|(name, values)| {
            let joint = values.iter().position(|v| !(v.is_finite() && *v >= 0.0))?;
            Some((name, joint, values[joint]))
        })
    }

    /// What the joints take at velocities `dq` (rad/s) and accelerations `ddq` (rad/s^2), in N m: `b dq + c tanh(dq /
    /// v) + I ddq`.
    #[must_use]
    pub fn losses(&self, dq: &[f64; JOINT_DIM], ddq: &[f64; JOINT_DIM]) -> [f64; JOINT_DIM] {
        std::array::from_fn(|i| {
            self.viscous[i] * dq[i]
                + self.dry[i] * (dq[i] / DRY_SPEED_RAD_S).tanh()
                + self.armature[i] * ddq[i]
        })
    }
}
