//! The legs of a robot with all that is asked of one, its mass and its limits.

use nalgebra::{Matrix3, Vector3};

use super::input_rule::rotation;
use super::joints::{
    BODY_NAMES, FOOT_DIM, JOINT_DIM, JOINT_NAMES, LEG_JOINT_DIM, Leg, STATE_DIM, WRENCH_NAMES,
};
use super::leg::{LEAST_HEIGHT, LEAST_SPAN, LegShape, Posture, write_force_map};

/// A leg: axes and links at its zero posture in the body's axes, and quantities derived from them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LegGeometry {
    /// Unit vectors of the joints' axes, from the trunk to the foot; the last two are parallel.
    pub axes: [[f64; 3]; 3],
    /// From each joint to the next and from the last to the foot, in m.
    pub links: [[f64; 3]; 3],
    /// Lengths of thigh and calf, in m; see [`LegGeometry::new`].
    pub lengths_m: [f64; 2],
    /// The same leg in the frame of its plane.
    pub shape: LegShape,
}

/// Directions and lengths of a leg at its zero posture, in the body's axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LegLinks {
    /// Axis of the first joint.
    pub abduction: Vector3<f64>,
    /// Axis of the second and third joint.
    pub flexion: Vector3<f64>,
    /// From the first joint to the plane of the leg at its second joint, m.
    pub hip: Vector3<f64>,
    /// Along the thigh in the plane of the leg, m.
    pub thigh: Vector3<f64>,
    /// Along the calf in the plane of the leg, m.
    pub calf: Vector3<f64>,
}

const USUAL_AXES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

/// Whether a leg abducts about x, bends about y and hangs straight down but for its foot.
fn is_usual(axes: &[[f64; 3]; 3], [hip, thigh, calf]: &[[f64; 3]; 3]) -> bool {
    *axes == USUAL_AXES
        && (hip[0], hip[2]) == (0.0, 0.0)
        && (thigh[0], thigh[1]) == (0.0, 0.0)
        && calf[1] == 0.0
        && thigh[2] < 0.0
        && calf[2] < 0.0
}

impl LegGeometry {
    /// A leg of axes and links. Lengths are those across the second joint's axis. In a leg of the usual shape the foot
    /// may be a little before or behind the end of the calf; its lengths are along thigh and calf.
    pub fn new(axes: [[f64; 3]; 3], links: [[f64; 3]; 3]) -> Self {
        let [first, normal, third] = axes.map(Vector3::from);
        let [hip, thigh, calf] = links.map(Vector3::from);
        let [thigh_m, calf_m] = match is_usual(&axes, &links) {
            true => [-thigh.z, -calf.z],
            false => [thigh, calf].map(|link| normal.cross(&link).norm()),
        };
        let along_x = normal.x.abs() < 0.9;
        let near = if along_x { Vector3::x() } else { Vector3::z() };
        let forward = (near - normal * normal.dot(&near)).normalize();
        let frame = [forward, normal, forward.cross(&normal)];
        let along = |vector: Vector3<f64>| frame.map(|axis| axis.dot(&vector) + 0.0);
        let of_frame = |share: &dyn Fn(Vector3<f64>) -> Vector3<f64>| {
            frame.map(|axis| share(axis).map(|v| v + 0.0).into()) // no -0.0
        };
        let fixed = |axis: Vector3<f64>| first * first.dot(&axis);
        let in_plane = |link: Vector3<f64>| [along(link)[0], along(link)[2]];
        let mut to_plane = along(hip);
        to_plane[1] += along(thigh)[1] + along(calf)[1];
        Self {
            axes,
            links,
            lengths_m: [thigh_m, calf_m],
            shape: LegShape {
                fixed: of_frame(&fixed),
                cosine: of_frame(&|axis| axis - fixed(axis)),
                sine: of_frame(&|axis| first.cross(&axis)),
                axis: along(first),
                hip: to_plane,
                thigh: in_plane(thigh),
                calf: in_plane(calf),
                knee: normal.dot(&third).signum(),
                least: [
                    LEAST_SPAN * thigh_m * calf_m,
                    LEAST_HEIGHT * (thigh_m + calf_m),
                ],
                volume: thigh_m * calf_m * (thigh_m + calf_m),
            },
        }
    }

    fn posture(&self, q: &[f64; 3]) -> Posture {
        Posture::bent(&self.shape, q)
    }

    /// Foot position from the first joint, in the body's axes, m, at joint angles `q` in rad.
    pub fn foot_position(&self, q: &[f64; 3]) -> Vector3<f64> {
        let (posture, mut foot) = (self.posture(q), [0.0; 3]);
        posture.write_in_body(&posture.foot, &mut foot);
        foot.into()
    }

    /// Position of the third joint from the first, in the body's axes, m.
    pub fn knee_position(&self, q: &[f64; 3]) -> Vector3<f64> {
        let [hip, thigh, _] = self.links;
        Self::new(self.axes, [hip, thigh, [0.0; 3]]).foot_position(q)
    }

    /// Jacobian of [`Self::foot_position`]: `J[i][j] = d p_i / d q_j`, in m.
    pub fn foot_jacobian(&self, q: &[f64; 3]) -> Matrix3<f64> {
        let mut jacobian = [[0.0; 3]; 3];
        self.posture(q).write_jacobian(&self.shape, &mut jacobian);
        matrix(&jacobian)
    }

    /// `|det J| / volume`: 0 at full extension or with the foot on the axis of the first joint, at most about 1.
    pub fn manipulability(&self, q: &[f64; 3]) -> f64 {
        let posture = self.posture(q);
        (posture.area() * posture.lever()).abs() / self.shape.volume
    }

    /// Span of thigh and calf over the product of their lengths, and height of the foot over the length of the
    /// stretched leg, both as absolute values. Their lower bounds are [`LEAST_SPAN`] and [`LEAST_HEIGHT`].
    pub fn spans(&self, q: &[f64; 3]) -> [f64; 2] {
        let (posture, [thigh, calf]) = (self.posture(q), self.lengths_m);
        let [area, lever] = [posture.area(), posture.lever()].map(f64::abs);
        [area / (thigh * calf), lever / (thigh + calf)]
    }

    /// `-J^-T`, from torques to the force on the body: with levers that are never shorter than the least of
    /// [`LegShape`], or exact. None where there is none.
    pub fn force_map(&self, q: &[f64; 3], is_exact: bool) -> Option<Matrix3<f64>> {
        let (mut map, mut foot) = ([[0.0; 3]; 3], [0.0; 3]);
        write_force_map(&self.shape, q, is_exact, &mut map, &mut foot).then(|| matrix(&map))
    }

    /// Axes and links at the zero posture, without the foot's offset from a straight calf in the usual shape.
    pub fn links(&self) -> LegLinks {
        let mut links = self.links;
        if is_usual(&self.axes, &self.links) {
            links[2][0] = 0.0;
        }
        let [abduction, flexion, _] = self.axes.map(Vector3::from);
        let [hip, thigh, calf] = links.map(Vector3::from);
        let aside = flexion * (flexion.dot(&thigh) + flexion.dot(&calf));
        let in_plane = |link: Vector3<f64>| link - flexion * flexion.dot(&link);
        LegLinks {
            abduction,
            flexion,
            hip: hip + aside,
            thigh: in_plane(thigh),
            calf: in_plane(calf),
        }
    }
}

fn matrix(rows: &[[f64; 3]; 3]) -> Matrix3<f64> {
    Matrix3::from_fn(|row, column| rows[row][column])
}

/// A quadruped with abduction, flexion, knee per leg, read by `romc_model::robot_file`; arrays in the state's order.
#[derive(Debug, Clone, PartialEq)]
pub struct Robot {
    /// Name in model files and on the command line.
    pub name: &'static str,
    /// Mass of body and legs.
    pub mass_kg: f64,
    /// Shapes of the legs.
    pub legs: [LegGeometry; FOOT_DIM],
    /// Hips in the body's frame.
    pub hip_position_m: [[f64; 3]; FOOT_DIM],
    /// Its maker's names.
    pub joint_names: [&'static str; JOINT_DIM],
    /// Largest torques.
    pub torque_limit_nm: [f64; JOINT_DIM],
    /// Lowest and highest angles.
    pub joint_limit_rad: [(f64, f64); JOINT_DIM],
    /// Largest speeds, in rad/s.
    pub joint_speed_limit_rad_s: [f64; JOINT_DIM],
}

impl Robot {
    /// Mass of body and legs, in kg.
    pub fn mass_kg(&self) -> f64 {
        self.mass_kg
    }

    /// Shape of a leg.
    pub fn geometry(&self, leg: Leg) -> &LegGeometry {
        &self.legs[leg.index()]
    }

    /// Sign of a joint's angle on the right in a mirrored motion. It is 1 if both sides turn with the same sign (the
    /// usual flexions), and -1 if with opposite signs (abductions about the same axis).
    pub fn mirror_sign(&self, joint: usize) -> f64 {
        let of_pair = |leg: Leg| self.geometry(leg).axes[joint % LEG_JOINT_DIM];
        let (left, right) = match joint / LEG_JOINT_DIM < 2 {
            true => (of_pair(Leg::FrontLeft), of_pair(Leg::FrontRight)),
            false => (of_pair(Leg::RearLeft), of_pair(Leg::RearRight)),
        };
        // A turn's axis mirrored at the plane y = 0.
        let mirrored = [-left[0], left[1], -left[2]];
        let along: f64 = mirrored.iter().zip(&right).map(|(a, b)| a * b).sum();
        if along < 0.0 { -1.0 } else { 1.0 }
    }

    /// Where a state coordinate, or the input along it, of the mirror image at the plane `y = 0` comes from: that
    /// coordinate, and the sign. Right and left legs exchange; y, roll and yaw change sign.
    pub fn mirrored(&self, coordinate: usize) -> (usize, f64) {
        match coordinate.checked_sub(JOINT_DIM) {
            None => {
                let (leg, joint) = (coordinate / LEG_JOINT_DIM, coordinate % LEG_JOINT_DIM);
                let other = LEG_JOINT_DIM * (leg ^ 1) + joint;
                (other, self.mirror_sign(coordinate))
            }
            Some(1 | 3 | 5) => (coordinate, -1.0),
            Some(_) => (coordinate, 1.0),
        }
    }

    /// Origin of a leg's hip frame in the body frame, in m.
    pub fn hip_position(&self, leg: Leg) -> Vector3<f64> {
        Vector3::from(self.hip_position_m[leg.index()])
    }

    /// Largest torque of each joint, in N m, in the order of the state.
    pub fn torque_limit_nm(&self) -> &[f64; JOINT_DIM] {
        &self.torque_limit_nm
    }

    /// Lowest and highest angle of each joint, in rad.
    pub fn joint_limit_rad(&self) -> &[(f64, f64); JOINT_DIM] {
        &self.joint_limit_rad
    }

    /// Foot position of a leg from the body's origin, along the body's axes, in m.
    pub fn foot_from_body(&self, leg: Leg, q: &[f64; 3]) -> Vector3<f64> {
        self.hip_position(leg) + self.geometry(leg).foot_position(q)
    }

    /// The same in the world, at a state `x` of the robot.
    pub fn foot_in_world(&self, leg: Leg, x: &[f64; STATE_DIM]) -> Vector3<f64> {
        let joints = x.first_chunk().expect("joints come first");
        let [.., x, y, z, roll, pitch, yaw] = *x;
        let foot = self.foot_from_body(leg, &leg.of_joints(joints));
        Vector3::new(x, y, z) + rotation([roll, pitch, yaw]) * foot
    }

    /// Names of the state: joints `fr.hx` to `rl.kn`, then `body.x` to `body.yaw` (equation 1).
    pub fn state_names() -> [String; STATE_DIM] {
        joined(&JOINT_NAMES, &BODY_NAMES)
    }

    /// Units of the state: rad, with m for the body's position.
    pub fn state_units() -> [String; STATE_DIM] {
        joined(&["rad"; JOINT_DIM], &["m", "m", "m", "rad", "rad", "rad"])
    }

    /// Names of the input: joint torques under the joints' names, then `force.x` to `moment.z` (equation 23).
    pub fn input_names() -> [String; STATE_DIM] {
        joined(&JOINT_NAMES, &WRENCH_NAMES)
    }

    /// Units of the input: N m, with N for the linear force.
    pub fn input_units() -> [String; STATE_DIM] {
        joined(&["N m"; JOINT_DIM], &["N", "N", "N", "N m", "N m", "N m"])
    }
}

fn joined(joints: &[&str; JOINT_DIM], body: &[&str; 6]) -> [String; STATE_DIM] {
    std::array::from_fn(|i| match i.checked_sub(JOINT_DIM) {
        None => joints[i].to_owned(),
        Some(j) => body[j].to_owned(),
    })
}
