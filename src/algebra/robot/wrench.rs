//! From joint torques to the force and moment on the body.
//!
//! Equation 4 with the sign of a reaction: the feet push the ground with
//! `J^-T tau`, the ground pushes the body with `F_k = -J_k^-T tau_k`. Forces are
//! expressed in axes parallel to the body's, and the arm `x_k` of the moment is
//! the foot in its own hip frame, as in the recordings the method was published
//! with; the moment is `x_k x F_k` (the paper prints `F_k x x_k`).

use nalgebra::{Matrix3, SMatrix, Vector3, Vector6};

use super::error::RobotError;
use super::input_rule::WrenchFrame;
use super::joints::{ContactFlags, JOINT_DIM, LEG_JOINT_DIM, Leg};
use super::kinematics::SINGULAR_BOUND;
use super::registry::Robot;

impl Robot {
    /// Force of a leg in contact on the body, in N: `F = -J^-T tau` (equation 4).
    ///
    /// `q` in rad, `tau` in N m: abduction, flexion, knee.
    ///
    /// # Errors
    /// [`RobotError::SingularLeg`] at full extension (see
    /// [`SINGULAR_BOUND`]),
    /// [`RobotError::NotFinite`] for NaN or infinite arguments.
    pub fn foot_force(
        &self,
        leg: Leg,
        q: &[f64; 3],
        tau: &[f64; 3],
    ) -> Result<Vector3<f64>, RobotError> {
        let map = self.foot_force_map(leg, q)?;
        self.require_finite(leg, "torque", tau)?;
        Ok(map * Vector3::from(*tau))
    }

    /// The matrix `-J^-T` that takes a leg's torques (N m) to its force on the
    /// body (N).
    ///
    /// # Errors
    /// As [`Robot::foot_force`].
    pub fn foot_force_map(&self, leg: Leg, q: &[f64; 3]) -> Result<Matrix3<f64>, RobotError> {
        self.require_finite(leg, "joint angle", q)?;
        let singular = |determinant| RobotError::SingularLeg {
            robot: self.name().to_owned(),
            leg,
            joints_rad: *q,
            determinant,
            bound: SINGULAR_BOUND,
        };
        let determinant = self.geometry(leg).manipulability(q);
        if determinant < SINGULAR_BOUND {
            return Err(singular(determinant));
        }
        match self.foot_jacobian(leg, q).transpose().try_inverse() {
            Some(inverse) => Ok(-inverse),
            None => Err(singular(determinant)),
        }
    }

    /// As [`Robot::foot_force_map`], for any posture.
    ///
    /// Near a singularity small torques would mean any force: a stretched knee, or a foot at the
    /// height of its hip, where the abduction has no lever. There the levers are kept from getting
    /// shorter than [`LEAST_SPAN`](super::kinematics::LEAST_SPAN) thigh calf over the distance of the
    /// foot and [`LEAST_HEIGHT`](super::kinematics::LEAST_HEIGHT) (thigh + calf), on a Go1 some 3 and
    /// 5 cm; everywhere else the matrix is the exact one.
    ///
    /// # Errors
    /// [`RobotError::NotFinite`] for NaN or infinite joint angles.
    pub fn damped_force_map(&self, leg: Leg, q: &[f64; 3]) -> Result<Matrix3<f64>, RobotError> {
        self.require_finite(leg, "joint angle", q)?;
        match self.geometry(leg).damped_force_map(q) {
            Some(map) => Ok(map),
            None => self.foot_force_map(leg, q),
        }
    }

    /// Force and moment on the body `[F_lin; F_ang]`, in N and N m (equations 5
    /// to 7, 22): sums of `F_k` and of `x_k x F_k` over the feet in contact.
    ///
    /// # Errors
    /// As [`Robot::damped_force_map`], for a leg in contact; the others do not count.
    pub fn body_wrench(
        &self,
        joints: &[f64; JOINT_DIM],
        torque: &[f64; JOINT_DIM],
        contact: ContactFlags,
    ) -> Result<Vector6<f64>, RobotError> {
        self.wrench_by_arms(WrenchFrame::Body, joints, torque, contact)
    }

    /// The same with the moments by the arms of a frame, in axes parallel to the body's.
    pub(super) fn wrench_by_arms(
        &self,
        frame: WrenchFrame,
        joints: &[f64; JOINT_DIM],
        torque: &[f64; JOINT_DIM],
        contact: ContactFlags,
    ) -> Result<Vector6<f64>, RobotError> {
        let mut wrench = Vector6::zeros();
        for leg in Leg::down(contact) {
            let q = leg.of_joints(joints);
            let tau = leg.of_joints(torque);
            self.require_finite(leg, "torque", &tau)?;
            let force = self.damped_force_map(leg, &q)? * Vector3::from(tau);
            let moment = self.arm(frame, leg, &q).cross(&force);
            for axis in 0..3 {
                wrench[axis] += force[axis];
                wrench[3 + axis] += moment[axis];
            }
        }
        Ok(wrench)
    }

    /// The 6 x 12 matrix `G` of `[F_lin; F_ang] = G tau` at a posture and contact, by the arms of a frame, in axes
    /// parallel to the body's; columns of legs in the air are zero.
    pub(super) fn map_by_arms(
        &self,
        frame: WrenchFrame,
        joints: &[f64; JOINT_DIM],
        contact: ContactFlags,
    ) -> Result<SMatrix<f64, 6, JOINT_DIM>, RobotError> {
        let mut map = SMatrix::<f64, 6, JOINT_DIM>::zeros();
        for leg in Leg::down(contact) {
            let q = leg.of_joints(joints);
            let force = self.damped_force_map(leg, &q)?;
            let moment = self.arm(frame, leg, &q).cross_matrix() * force;
            let first = LEG_JOINT_DIM * leg.index();
            map.fixed_view_mut::<3, 3>(0, first).copy_from(&force);
            map.fixed_view_mut::<3, 3>(3, first).copy_from(&moment);
        }
        Ok(map)
    }

    fn arm(&self, frame: WrenchFrame, leg: Leg, q: &[f64; 3]) -> Vector3<f64> {
        match frame {
            WrenchFrame::Body => self.foot_position(leg, q),
            WrenchFrame::World => self.foot_from_body(leg, q),
        }
    }

    fn require_finite(
        &self,
        leg: Leg,
        quantity: &'static str,
        values: &[f64; 3],
    ) -> Result<(), RobotError> {
        match values.iter().find(|value| !value.is_finite()) {
            None => Ok(()),
            Some(found) => Err(RobotError::NotFinite {
                robot: self.name().to_owned(),
                leg,
                quantity,
                found: *found,
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn go1() -> &'static Robot {
        Robot::by_name("go1").unwrap()
    }

    fn stand() -> [f64; JOINT_DIM] {
        std::array::from_fn(|i| [0.05, 0.7, -1.3][i % 3] + 0.01 * i as f64)
    }

    fn torques() -> [f64; JOINT_DIM] {
        std::array::from_fn(|i| 3.0 - 0.7 * i as f64 + 0.2 * (i * i) as f64)
    }

    #[test]
    fn foot_force_of_a_leg_beyond_the_singular_bound_is_an_error_with_leg_and_angles() {
        let force = |knee: f64| go1().foot_force(Leg::RearLeft, &[0.0, 0.2, knee], &[1.0; 3]);
        for knee in [0.0, -1e-4] {
            let Err(RobotError::SingularLeg {
                leg, joints_rad, ..
            }) = force(knee)
            else {
                panic!("{knee}: {:?}", force(knee));
            };
            assert_eq!((leg, joints_rad), (Leg::RearLeft, [0.0, 0.2, knee]));
        }
        let text = force(0.0).unwrap_err().to_string();
        assert!(text.contains("go1: leg rl is singular"), "{text}");
        assert!(text.contains("kn 0.0000"), "{text}");
        assert!(force(-2e-2).is_ok());
    }

    #[test]
    fn foot_force_not_finite_argument_is_an_error() {
        let (q, nan) = ([0.0, 0.7, -1.4], f64::NAN);
        for (q, tau, said) in [
            (q, [0.0, nan, 0.0], "leg fr has the torque NaN"),
            ([f64::INFINITY, 0.7, -1.4], [0.0; 3], "joint angle inf"),
        ] {
            let error = go1().foot_force(Leg::FrontRight, &q, &tau).unwrap_err();
            assert!(error.to_string().contains(said), "{error}");
        }
    }

    #[test]
    fn body_wrench_without_contact_is_zero_even_at_a_singular_posture() {
        let wrench = go1()
            .body_wrench(&[0.0; 12], &torques(), [false; 4])
            .unwrap();
        assert_eq!(wrench, Vector6::zeros());
        for frame in WrenchFrame::ALL {
            let map = go1().map_by_arms(frame, &[0.0; 12], [false; 4]).unwrap();
            assert!(map.iter().all(|entry| *entry == 0.0));
        }
    }

    #[test]
    fn damped_force_map_is_the_exact_one_away_from_singularities() {
        for leg in Leg::ALL {
            for q in [[0.1, 0.8, -1.6], [-0.3, 1.2, -2.4], [0.0, 0.3, -0.4]] {
                let exact = go1().foot_force_map(leg, &q).unwrap();
                assert_eq!(go1().damped_force_map(leg, &q).unwrap(), exact);
            }
        }
    }

    #[test]
    fn damped_force_map_is_continuous_and_bounded_through_both_singularities() {
        // Down to a stretched knee, and a folded leg that swings its foot past the hip's height.
        let stretch = |t: f64| [0.1, 0.5, -0.6 * (1.0 - t)];
        let swing = |t: f64| [0.1, 1.6 + 1.6 * t, -2.6];
        let paths: [&dyn Fn(f64) -> [f64; 3]; 2] = [&stretch, &swing];
        let geometry = go1().geometry(Leg::RearLeft);
        for (path, singular) in paths.into_iter().zip([0, 1]) {
            let mut nearest = f64::INFINITY;
            let mut before = go1().damped_force_map(Leg::RearLeft, &path(0.0)).unwrap();
            for k in 1..=4000 {
                let q = path(f64::from(k) / 4000.0);
                let map = go1().damped_force_map(Leg::RearLeft, &q).unwrap();
                assert!((map - before).norm() < 0.2, "{q:?}: {map} {before}");
                // 30 N m of each joint: some 1 kN along a stretched leg, not more anywhere.
                assert!((map * Vector3::repeat(30.0)).norm() < 1500.0, "{q:?}");
                nearest = nearest.min(geometry.spans(&q)[singular]);
                before = map;
            }
            assert!(nearest < 1e-3, "the path passes the singularity: {nearest}");
        }
    }

    #[test]
    fn body_wrench_moment_is_arm_cross_force() {
        let contact = [false, true, false, false];
        let wrench = go1().body_wrench(&stand(), &torques(), contact).unwrap();
        let q = Leg::FrontLeft.of_joints(&stand());
        let arm = go1().foot_position(Leg::FrontLeft, &q);
        let force = Vector3::new(wrench[0], wrench[1], wrench[2]);
        let moment = Vector3::new(wrench[3], wrench[4], wrench[5]);
        assert!((moment - arm.cross(&force)).norm() < 1e-12 * moment.norm());
        assert!(moment.norm() > 1.0);
    }
}
