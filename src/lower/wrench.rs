//! Generalised inputs from what a robot measures: joint angles, joint torques and contacts.
//!
//! The same forces and moments as [`Robot::body_wrench`], in closed form. With `fwd` and `up` the
//! foot in the plane of the leg, `c_fwd` and `c_up` the calf's share of them, `h` the signed hip
//! offset, and the axes `e = (0, sin hx, -cos hx)`, `n = (0, cos hx, sin hx)`, the leg's Jacobian
//! has the columns `-h e - up n`, `up x + fwd e` and `c_up x + c_fwd e`, and the foot is at
//! `p = fwd x - up e + h n`. From `J^T F = -tau` (equation 4) follow the force and its moment
//!
//! ```text
//! F_x = (fwd tau_2 - c_fwd tau_1) / det        (p x F)_x = -tau_0
//! F_e = (c_up tau_1 - up tau_2) / det          (p x F)_e = h F_x - fwd F_n
//! F_n = (tau_0 - h F_e) / up                   (p x F)_n = -tau_1
//! det = up c_fwd - fwd c_up
//! ```

use super::error::LowerError;
use crate::ir::{Binary, Program, ProgramBuilder, Unary, ValueId};
use crate::model::ReducedModel;
use crate::robot::joints::LEG_JOINT_DIM;
use crate::robot::{BODY_DIM, FOOT_DIM, JOINT_DIM, Leg, LegGeometry, Robot, STATE_DIM};

/// `u = [tau; sum F_k; sum p_k x F_k]` over the feet on the ground (equations 4 to 7, 22 and 23):
/// inputs `x` (18 robot coordinates), `tau` (12, N m), `feet` (4, order of [`Leg::ALL`]: 1 on the
/// ground, 0 in the air); output `u` (18, N m and N). `None` for a model that is not over the
/// 18 coordinates of a robot that romc knows.
///
/// A foot's force and moment are multiplied with its element of `feet`; at 0 they are zero in every
/// posture. On the ground, a fully stretched leg divides by zero.
///
/// # Errors
/// [`LowerError::Program`] if the program breaks one of its promises.
pub fn generalised_input(model: &ReducedModel) -> Result<Option<Program>, LowerError> {
    match (model.robot(), model.state_dim()) {
        (Ok(robot), Some(STATE_DIM)) => of_robot(robot).map(Some),
        _ => Ok(None),
    }
}

fn of_robot(robot: &Robot) -> Result<Program, LowerError> {
    let mut builder = ProgramBuilder::new("generalised_input");
    let x = builder.input("x", STATE_DIM);
    let tau = builder.input("tau", JOINT_DIM);
    let feet = builder.input("feet", FOOT_DIM);
    let joint = |kind: usize| (0..FOOT_DIM).map(move |leg| LEG_JOINT_DIM * leg + kind);
    // Abductions, then flexions, then the angles of the calves: flexion plus knee.
    let mut angles: Vec<ValueId> = joint(0).chain(joint(1)).map(|k| x[k]).collect();
    for k in joint(1) {
        angles.push(builder.binary(Binary::Add, x[k], x[k + 1]));
    }
    let (sines, cosines) = builder.sin_cos(&angles);
    let of_legs: Vec<[ValueId; BODY_DIM]> = Leg::ALL
        .into_iter()
        .map(|leg| {
            let k = leg.index();
            let at = |group: usize| (sines[FOOT_DIM * group + k], cosines[FOOT_DIM * group + k]);
            let angles = LegAngles {
                abduction: at(0),
                thigh: at(1),
                calf: at(2),
            };
            let torques = std::array::from_fn(|i| tau[LEG_JOINT_DIM * k + i]);
            let mut steps = Steps(&mut builder);
            steps.leg_wrench(robot.geometry(), leg.side(), angles, torques, feet[k])
        })
        .collect();
    let mut steps = Steps(&mut builder);
    let wrench = (0..BODY_DIM).map(|i| {
        let front = steps.add(of_legs[0][i], of_legs[1][i]);
        let rear = steps.add(of_legs[2][i], of_legs[3][i]);
        steps.add(front, rear)
    });
    let u: Vec<ValueId> = tau.iter().copied().chain(wrench).collect();
    builder.output("u", &u);
    Ok(builder.finish()?)
}

/// Sine and cosine of each angle of a leg.
struct LegAngles {
    abduction: (ValueId, ValueId),
    thigh: (ValueId, ValueId),
    /// Flexion plus knee.
    calf: (ValueId, ValueId),
}

/// The builder, with operations by name.
struct Steps<'b>(&'b mut ProgramBuilder);

impl Steps<'_> {
    fn add(&mut self, a: ValueId, b: ValueId) -> ValueId {
        self.0.binary(Binary::Add, a, b)
    }

    fn sub(&mut self, a: ValueId, b: ValueId) -> ValueId {
        self.0.binary(Binary::Sub, a, b)
    }

    fn mul(&mut self, a: ValueId, b: ValueId) -> ValueId {
        self.0.binary(Binary::Mul, a, b)
    }

    fn div(&mut self, a: ValueId, b: ValueId) -> ValueId {
        self.0.binary(Binary::Div, a, b)
    }

    fn neg(&mut self, a: ValueId) -> ValueId {
        self.0.unary(Unary::Neg, a)
    }

    /// `a b - c d`.
    fn minor(&mut self, (a, b): (ValueId, ValueId), (c, d): (ValueId, ValueId)) -> ValueId {
        let (left, right) = (self.mul(a, b), self.mul(c, d));
        self.sub(left, right)
    }

    /// `factor value`; nothing is computed for a factor of zero.
    fn scaled(&mut self, factor: f64, value: ValueId) -> Option<ValueId> {
        (factor != 0.0).then(|| {
            let factor = self.0.constant(factor);
            self.mul(factor, value)
        })
    }

    /// `a value_a + b value_b`.
    fn combined(&mut self, (a, of_a): (f64, ValueId), (b, of_b): (f64, ValueId)) -> ValueId {
        match (self.scaled(a, of_a), self.scaled(b, of_b)) {
            (Some(a), Some(b)) => self.add(a, b),
            (Some(only), None) | (None, Some(only)) => only,
            (None, None) => self.0.constant(0.0),
        }
    }

    /// Force and moment of one leg, in axes parallel to the body's.
    fn leg_wrench(
        &mut self,
        geometry: &LegGeometry,
        side: f64,
        angles: LegAngles,
        torques: [ValueId; LEG_JOINT_DIM],
        foot: ValueId,
    ) -> [ValueId; BODY_DIM] {
        let (thigh, calf, forward) = (geometry.thigh_m, geometry.calf_m, geometry.foot_forward_m);
        let (calf_sin, calf_cos) = angles.calf;
        let calf_forward = self.combined((-calf, calf_sin), (forward, calf_cos));
        let calf_up = self.combined((-calf, calf_cos), (-forward, calf_sin));
        let thigh_forward = self.combined((-thigh, angles.thigh.0), (0.0, angles.thigh.0));
        let thigh_up = self.combined((-thigh, angles.thigh.1), (0.0, angles.thigh.1));
        let fwd = self.add(thigh_forward, calf_forward);
        let up = self.add(thigh_up, calf_up);
        // The same as up c_fwd - fwd c_up, without what cancels.
        let det = self.minor((thigh_up, calf_forward), (thigh_forward, calf_up));
        // One for a foot in the air: then no posture divides by zero, and zero torques give zero.
        let one = self.0.constant(1.0);
        let contact = self.0.unary(Unary::Sign, foot);
        let air = self.sub(one, contact);
        let (det, height) = (self.add(det, air), self.sub(up, air));

        let [tau_0, tau_1, tau_2] = torques.map(|torque| self.mul(foot, torque));
        let hip = self.0.constant(side * geometry.hip_m);
        let across = self.minor((fwd, tau_2), (calf_forward, tau_1));
        let f_x = self.div(across, det);
        let along = self.minor((calf_up, tau_1), (up, tau_2));
        let f_e = self.div(along, det);
        let of_hip = self.mul(hip, f_e);
        let rest = self.sub(tau_0, of_hip);
        let f_n = self.div(rest, height);
        let (m_x, m_n) = (self.neg(tau_0), self.neg(tau_1));
        let m_e = self.minor((hip, f_x), (fwd, f_n));

        let [f_y, f_z] = self.turned(angles.abduction, f_e, f_n);
        let [m_y, m_z] = self.turned(angles.abduction, m_e, m_n);
        [f_x, f_y, f_z, m_x, m_y, m_z]
    }

    /// The components along y and z of `a e + b n`.
    fn turned(&mut self, (s, c): (ValueId, ValueId), a: ValueId, b: ValueId) -> [ValueId; 2] {
        let (a_s, b_c) = (self.mul(a, s), self.mul(b, c));
        [self.add(a_s, b_c), self.minor((b, s), (a, c))]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::Interpreter;
    use crate::robot::ContactFlags;

    /// Numbers in [0, 1), the same in every run.
    struct Random(u64);

    impl Random {
        fn between(&mut self, low: f64, high: f64) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005);
            self.0 = self.0.wrapping_add(1_442_695_040_888_963_407);
            low + (high - low) * ((self.0 >> 11) as f64 / (1_u64 << 53) as f64)
        }
    }

    fn run(robot: &Robot, x: &[f64], tau: &[f64], feet: &[f64]) -> [f64; STATE_DIM] {
        let program = of_robot(robot).expect("lowers");
        let mut u = [f64::NAN; STATE_DIM];
        Interpreter::new(&program).run(&[x, tau, feet], &mut [&mut u]);
        u
    }

    fn contacts() -> impl Iterator<Item = ContactFlags> {
        (0..16_usize).map(|bits| std::array::from_fn(|k| bits >> k & 1 == 1))
    }

    fn assert_is_wrench(robot: &Robot, u: &[f64], tau: &[f64; JOINT_DIM], expected: &[f64]) {
        assert_eq!(u[..JOINT_DIM], tau[..]);
        for part in [0..3, 3..6] {
            let largest = expected[part.clone()]
                .iter()
                .fold(0.0, |m: f64, v| m.max(v.abs()));
            for i in part {
                let (found, expected) = (u[JOINT_DIM + i], expected[i]);
                assert!(
                    (found - expected).abs() <= 1e-12 * largest,
                    "{} {i}: {found} {expected}",
                    robot.name()
                );
            }
        }
    }

    #[test]
    fn generalised_input_of_every_robot_and_contact_is_torques_and_body_wrench() {
        let mut random = Random(11);
        for name in Robot::known_names() {
            let robot = Robot::by_name(name).expect("a known robot");
            for _ in 0..200 {
                let joints: [f64; JOINT_DIM] = std::array::from_fn(|k| match k % 3 {
                    0 => random.between(-0.8, 0.8),
                    1 => random.between(-0.3, 1.3),
                    _ => random.between(-2.6, -0.9),
                });
                let tau: [f64; JOINT_DIM] = std::array::from_fn(|_| random.between(-30.0, 30.0));
                let body: [f64; BODY_DIM] = std::array::from_fn(|_| random.between(-3.0, 3.0));
                let x = [joints.as_slice(), &body].concat();
                for contact in contacts() {
                    let feet = contact.map(|on| f64::from(u8::from(on)));
                    let wrench = robot.body_wrench(&joints, &tau, contact);
                    let wrench = wrench.expect("bent legs");
                    let u = run(robot, &x, &tau, &feet);
                    assert_is_wrench(robot, &u, &tau, wrench.as_slice());
                }
            }
        }
    }

    #[test]
    fn generalised_input_ignores_a_stretched_leg_in_the_air() {
        let go1 = Robot::by_name("go1").expect("a known robot");
        let (mut joints, tau) = ([0.0, 0.7, -1.4].repeat(4), [5.0; JOINT_DIM]);
        joints[2] = 0.0;
        joints[1] = 0.0;
        let contact = [false, true, true, true];
        let joints: [f64; JOINT_DIM] = joints.try_into().expect("12 joints");
        let wrench = go1.body_wrench(&joints, &tau, contact).expect("bent legs");
        let x = [joints.as_slice(), &[0.0; BODY_DIM]].concat();
        let u = run(go1, &x, &tau, &[0.0, 1.0, 1.0, 1.0]);
        assert_is_wrench(go1, &u, &tau, wrench.as_slice());
    }

    #[test]
    fn generalised_input_of_a_stretched_leg_on_the_ground_is_not_finite() {
        let go1 = Robot::by_name("go1").expect("a known robot");
        let u = run(go1, &[0.0; STATE_DIM], &[5.0; JOINT_DIM], &[1.0; FOOT_DIM]);
        assert!(
            u[JOINT_DIM..].iter().any(|value| !value.is_finite()),
            "{u:?}"
        );
    }

    #[test]
    fn generalised_input_weighs_a_foot_with_its_number() {
        let go1 = Robot::by_name("go1").expect("a known robot");
        let x = [[0.1, 0.7, -1.4].repeat(4), vec![0.0; BODY_DIM]].concat();
        let tau: [f64; JOINT_DIM] = std::array::from_fn(|k| k as f64 - 4.0);
        let full = run(go1, &x, &tau, &[1.0, 0.0, 0.0, 0.0]);
        let half = run(go1, &x, &tau, &[0.5, 0.0, 0.0, 0.0]);
        for i in JOINT_DIM..STATE_DIM {
            assert!((half[i] - 0.5 * full[i]).abs() < 1e-12, "{i}");
        }
    }
}
