//! What the joints take from a motor's torque before it moves a leg.
//!
//! A motor that commands `tau` turns a link with the net torque
//! `tau - b dq - c tanh(dq / v) - I ddq`: viscous friction, dry friction, and
//! the rotor's inertia seen through the gear (the armature). The dry part is
//! smooth around standstill, with `v` = [`DRY_SPEED_RAD_S`].

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

    /// What the joints take at velocities `dq` (rad/s) and accelerations `ddq`
    /// (rad/s^2), in N m: `b dq + c tanh(dq / v) + I ddq`.
    #[must_use]
    pub fn losses(&self, dq: &[f64; JOINT_DIM], ddq: &[f64; JOINT_DIM]) -> [f64; JOINT_DIM] {
        std::array::from_fn(|i| {
            self.viscous[i] * dq[i]
                + self.dry[i] * (dq[i] / DRY_SPEED_RAD_S).tanh()
                + self.armature[i] * ddq[i]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unusable_names_the_array_and_joint_of_a_negative_value() {
        let mut actuators = Actuators::of_leg([1.0, 0.6, 0.6], [0.2; 3], [0.01; 3]);
        assert_eq!((actuators.viscous[3], actuators.viscous[5]), (1.0, 0.6));
        assert_eq!(actuators.unusable(), None);
        actuators.dry[7] = -0.1;
        assert_eq!(actuators.unusable(), Some(("dry", 7, -0.1)));
    }

    #[test]
    fn losses_oppose_the_motion_and_are_dry_friction_alone_when_slow() {
        let actuators = Actuators {
            viscous: [0.6; JOINT_DIM],
            dry: [0.2; JOINT_DIM],
            armature: [0.01; JOINT_DIM],
        };
        let losses = actuators.losses(&[-2.0; JOINT_DIM], &[30.0; JOINT_DIM]);
        assert!((losses[0] - (-1.2 - 0.2 + 0.3)).abs() < 1e-12);
        let slow = actuators.losses(&[0.5; JOINT_DIM], &[0.0; JOINT_DIM])[3];
        assert!((slow - 0.5).abs() < 1e-8, "{slow}");
    }
}
