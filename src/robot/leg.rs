//! One leg of three joints with any axes, of which the last two are parallel.
//!
//! The frame of the leg's plane is (forward, normal, up): the normal is the axis of the second joint, and the first
//! joint turns the frame as a whole. In it thigh and calf are `(forward, up)`, turned by the second angle and by the
//! sum of the last two. Let `(l_f, l_u)` be their sum, `(c_f, c_u)` the calf's share, and `(m_f, m_n, m_u)` the first
//! joint's axis times the foot. Then the Jacobian has the columns `m`, `(l_u, 0, -l_f)` and `(c_u, 0, -c_f)`, and
//! `J^T F = -tau` (equation 4) gives
//!
//! ```text
//! F_f = (l_f tau_2 - c_f tau_1) / area     area  = l_u c_f - l_f c_u
//! F_u = (l_u tau_2 - c_u tau_1) / area     lever = -m_n
//! F_n = (tau_0 + m_f F_f + m_u F_u) / lever
//! ```
//!
//! Near a singularity `1 / d` of both divisors is replaced by `d / max(d^2, least^2)`: equal outside, continuous, and
//! at most `1 / least`. `romc-translate` generates the legs of the controller in C from this file.

use core::ops::{Add, Mul, Neg, Sub};

pub(crate) type Real = f64;

/// Smallest `|det J|`, divided by [`LegShape::volume`], at which torques still give a foot force: a knee about 1e-3 rad
/// from full extension.
pub(crate) const SINGULAR_BOUND: Real = 1e-3;

/// Smallest area that thigh and calf span, over the product of their lengths (about the sine of the knee), at which
/// torques are turned into forces without damping.
pub const LEAST_SPAN: f64 = 0.3;

/// Smallest height of the foot above or below its hip in the plane of the leg, over the length of the stretched leg, at
/// which torques are converted to forces without damping.
pub const LEAST_HEIGHT: f64 = 0.12;

/// Error of pitch beyond which legs turn no further, rad.
const MOST_TURN_RAD: Real = 0.3;

/// A leg in the frame of its plane at the zero posture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LegShape {
    /// Shares of forward, normal and up, in the body's axes, that stay as the first joint turns.
    pub fixed: [[Real; 3]; 3],
    /// Shares that its cosine multiplies.
    pub cosine: [[Real; 3]; 3],
    /// Shares that its sine multiplies.
    pub sine: [[Real; 3]; 3],
    /// Axis of the first joint.
    pub axis: [Real; 3],
    /// From the first joint to the foot, without thigh and calf in the plane, m.
    pub hip: [Real; 3],
    /// Forward and up, m.
    pub thigh: [Real; 2],
    /// Forward and up, m.
    pub calf: [Real; 2],
    /// 1 where the third joint turns as the second does, -1 where it turns against it.
    pub knee: Real,
    /// Area that thigh and calf span (m^2) and height of the foot (m) below which they are damped.
    pub least: [Real; 2],
    /// Thigh times calf times their sum, m^3, which bounds `|det J|`.
    pub volume: Real,
}

/// Where the foot is and how the joints move it, in the frame of the leg's plane.
#[derive(Debug, Clone, Copy)]
pub struct Posture<T = f64> {
    /// The frame in the body's axes.
    pub frame: [[T; 3]; 3],
    /// Foot from the first joint, m.
    pub foot: [T; 3],
    /// Velocity of the foot per velocity of the first joint.
    pub by_first: [T; 3],
    /// From the second joint to the foot: forward and up.
    pub limb: [T; 2],
    /// From the third joint to the foot.
    pub calf: [T; 2],
}

impl<T> Posture<T>
where
    T: Copy + Neg<Output = T> + Sub<Output = T>,
    T: Add<Output = T> + Mul<Output = T> + Add<Real, Output = T> + Mul<Real, Output = T>,
{
    /// All numbers the same, before a turn.
    pub fn filled(value: T) -> Self {
        Self {
            frame: [[value; 3]; 3],
            foot: [value; 3],
            by_first: [value; 3],
            limb: [value; 2],
            calf: [value; 2],
        }
    }

    /// Updates a leg from its joint angles, where the foot's offset along the normal is already set. The third sine and
    /// cosine are those of the calf's angle, the sum of the second and third joint's.
    pub fn turn(&mut self, leg: &LegShape, sine: &[T; 3], cosine: &[T; 3]) {
        for k in 0..3 {
            for i in 0..3 {
                let turned = cosine[0] * leg.cosine[k][i] + sine[0] * leg.sine[k][i];
                self.frame[k][i] = turned + leg.fixed[k][i];
            }
        }
        self.calf[0] = sine[2] * leg.calf[1] + cosine[2] * leg.calf[0];
        self.calf[1] = cosine[2] * leg.calf[1] - sine[2] * leg.calf[0];
        self.limb[0] = sine[1] * leg.thigh[1] + cosine[1] * leg.thigh[0] + self.calf[0];
        self.limb[1] = cosine[1] * leg.thigh[1] - sine[1] * leg.thigh[0] + self.calf[1];
        self.foot[0] = self.limb[0] + leg.hip[0];
        self.foot[2] = self.limb[1] + leg.hip[2];
        self.by_first[0] = self.foot[2] * leg.axis[1] - self.foot[1] * leg.axis[2];
        self.by_first[1] = self.foot[0] * leg.axis[2] - self.foot[2] * leg.axis[0];
        self.by_first[2] = self.foot[1] * leg.axis[0] - self.foot[0] * leg.axis[1];
    }

    /// Area that thigh and calf span, with its sign, m^2.
    pub fn area(&self) -> T {
        self.limb[1] * self.calf[0] - self.limb[0] * self.calf[1]
    }

    /// Lever of the first joint along the normal, m; times the area it is `det J`, up to the sign.
    pub fn lever(&self) -> T {
        -self.by_first[1]
    }

    /// Writes a vector of the frame in the body's axes.
    pub fn write_in_body(&self, vector: &[T; 3], out: &mut [T; 3]) {
        for i in 0..3 {
            out[i] = self.frame[0][i] * vector[0]
                + self.frame[1][i] * vector[1]
                + self.frame[2][i] * vector[2];
        }
    }
}

impl Posture {
    /// A leg at the angles of its joints, rad.
    pub(crate) fn bent(leg: &LegShape, q: &[Real]) -> Self {
        let mut posture: Self = Self {
            frame: [[0.0; 3]; 3],
            foot: [0.0; 3],
            by_first: [0.0; 3],
            limb: [0.0; 2],
            calf: [0.0; 2],
        };
        posture.bend(leg, q);
        posture
    }

    /// Turns a leg by the angles of its joints, rad.
    fn bend(&mut self, leg: &LegShape, q: &[Real]) {
        let calf = q[1] + leg.knee * q[2];
        let sine: [Real; 3] = [q[0].sin(), q[1].sin(), calf.sin()];
        let cosine: [Real; 3] = [q[0].cos(), q[1].cos(), calf.cos()];
        self.foot[1] = leg.hip[1];
        self.turn(leg, &sine, &cosine);
    }

    /// Writes `J[i][j] = d p_i / d q_j` of the foot in the body's axes, m.
    pub(crate) fn write_jacobian(&self, leg: &LegShape, jacobian: &mut [[Real; 3]; 3]) {
        let mut first: [Real; 3] = [0.0; 3];
        self.write_in_body(&self.by_first, &mut first);
        for i in 0..3 {
            let forward = self.frame[0][i];
            let up = self.frame[2][i];
            jacobian[i][0] = first[i];
            jacobian[i][1] = forward * self.limb[1] - up * self.limb[0];
            jacobian[i][2] = leg.knee * (forward * self.calf[1] - up * self.calf[0]);
        }
    }

    /// Writes `-J^-T` with damped levers.
    fn write_damped(&self, leg: &LegShape, map: &mut [[Real; 3]; 3]) {
        let of_area = damped_reciprocal(self.area(), leg.least[0]);
        let of_lever = damped_reciprocal(self.lever(), leg.least[1]);
        let calf = -of_area;
        let limb = leg.knee * of_area;
        let forward: [Real; 3] = [0.0, self.calf[0] * calf, self.limb[0] * limb];
        let up: [Real; 3] = [0.0, self.calf[1] * calf, self.limb[1] * limb];
        for j in 0..3 {
            let own: Real = if j == 0 { 1.0 } else { 0.0 };
            let by_plane = self.by_first[0] * forward[j] + self.by_first[2] * up[j];
            let force: [Real; 3] = [forward[j], (own + by_plane) * of_lever, up[j]];
            let mut column: [Real; 3] = [0.0; 3];
            self.write_in_body(&force, &mut column);
            for i in 0..3 {
                map[i][j] = column[i];
            }
        }
    }
}

/// `1 / d`, but `d / least^2` where `|d|` is below the least.
fn damped_reciprocal(d: Real, least: Real) -> Real {
    let square = d * d;
    let smallest = least * least;
    d / if square > smallest { square } else { smallest }
}

/// Writes `-J^-T` by cofactors; false if there is none.
fn minus_inverse_transpose(j: &[[Real; 3]; 3], out: &mut [[Real; 3]; 3]) -> bool {
    let minor_0 = j[1][1] * j[2][2] - j[1][2] * j[2][1];
    let minor_1 = j[0][1] * j[2][2] - j[0][2] * j[2][1];
    let minor_2 = j[0][1] * j[1][2] - j[0][2] * j[1][1];
    let det = j[0][0] * minor_0 - j[1][0] * minor_1 + j[2][0] * minor_2;
    if det == 0.0 || !det.is_finite() {
        return false;
    }
    out[0][0] = -(minor_0 / det);
    out[1][0] = minor_1 / det;
    out[2][0] = -(minor_2 / det);
    out[0][1] = -((j[1][2] * j[2][0] - j[1][0] * j[2][2]) / det);
    out[0][2] = -((j[1][0] * j[2][1] - j[1][1] * j[2][0]) / det);
    out[1][1] = -((j[2][2] * j[0][0] - j[2][0] * j[0][2]) / det);
    out[1][2] = -((j[2][0] * j[0][1] - j[2][1] * j[0][0]) / det);
    out[2][1] = -((j[0][2] * j[1][0] - j[0][0] * j[1][2]) / det);
    out[2][2] = -((j[0][0] * j[1][1] - j[0][1] * j[1][0]) / det);
    true
}

/// Writes `-J^-T` of a leg, which maps its torques (N m) to its force on the body (N), and the position of the foot
/// relative to the first joint, m. Levers are never shorter than the least; in the exact variant the result is false if
/// the leg is stretched.
pub(crate) fn write_force_map(
    leg: &LegShape,
    q: &[Real],
    is_exact: bool,
    map: &mut [[Real; 3]; 3],
    foot: &mut [Real; 3],
) -> bool {
    let posture = Posture::bent(leg, q);
    posture.write_in_body(&posture.foot, foot);
    let area = posture.area().abs();
    let lever = posture.lever().abs();
    if is_exact && area * lever / leg.volume < SINGULAR_BOUND {
        return false;
    }
    if is_exact || (area >= leg.least[0] && lever >= leg.least[1]) {
        let mut jacobian: [[Real; 3]; 3] = [[0.0; 3]; 3];
        posture.write_jacobian(leg, &mut jacobian);
        return minus_inverse_transpose(&jacobian, map);
    }
    posture.write_damped(leg, map);
    true
}

/// Height of a leg's foot at a state of the robot, m; `q` are the leg's angles.
pub fn foot_height(leg: &LegShape, hip: &[Real], x: &[Real], q: &[Real]) -> Real {
    let posture = Posture::bent(leg, q);
    let mut foot: [Real; 3] = [0.0; 3];
    posture.write_in_body(&posture.foot, &mut foot);
    let aside = x[15].sin() * (hip[1] + foot[1]);
    let above = x[15].cos() * (hip[2] + foot[2]);
    x[14] - x[16].sin() * (hip[0] + foot[0]) + x[16].cos() * (aside + above)
}

/// Adds force and moment on the body of a leg's torques to a wrench, with the moment about the origin of the
/// hip's position vector. False if the torques are not finite or the leg has no force map. The angles must be finite.
pub(crate) fn add_wrench(
    leg: &LegShape,
    hip: &[Real],
    q: &[Real],
    torque: &[Real],
    wrench: &mut [Real],
) -> bool {
    let mut map: [[Real; 3]; 3] = [[0.0; 3]; 3];
    let mut arm: [Real; 3] = [0.0; 3];
    let is_finite = torque[0].is_finite() && torque[1].is_finite() && torque[2].is_finite();
    if !is_finite || !write_force_map(leg, q, false, &mut map, &mut arm) {
        return false;
    }
    let mut force: [Real; 3] = [0.0; 3];
    for i in 0..3 {
        force[i] = map[i][0] * torque[0] + map[i][1] * torque[1] + map[i][2] * torque[2];
    }
    let mut moment: [Real; 3] = [0.0; 3];
    write_moment(hip, &arm, &force, &mut moment);
    for i in 0..3 {
        wrench[i] += force[i];
        wrench[3 + i] += moment[i];
    }
    true
}

/// Writes force and moment on the body by each torque of a leg into its columns of a matrix of twelve; false if the leg
/// has no force map. The angles must be finite.
pub(crate) fn write_wrench_map(leg: &LegShape, hip: &[Real], q: &[Real], out: &mut [Real]) -> bool {
    let mut map: [[Real; 3]; 3] = [[0.0; 3]; 3];
    let mut arm: [Real; 3] = [0.0; 3];
    if !write_force_map(leg, q, false, &mut map, &mut arm) {
        return false;
    }
    for j in 0..3 {
        let force: [Real; 3] = [map[0][j], map[1][j], map[2][j]];
        let mut moment: [Real; 3] = [0.0; 3];
        write_moment(hip, &arm, &force, &mut moment);
        for i in 0..3 {
            out[12 * i + j] = force[i];
            out[12 * (3 + i) + j] = moment[i];
        }
    }
    true
}

/// Turns the foot of a leg about the body's origin by the opposite of an error `e` of pitch (rad). Nothing holds the
/// pitch of a body in the air, so its feet would otherwise land elsewhere than planned. To first order the joints
/// become `q + J^-1 (R_y(-e) - 1) (h + p(q))` with the hip `h`. A foot that cannot be moved stays.
pub(crate) fn turn_leg(leg: &LegShape, hip: &[Real], error: Real, q: &mut [Real]) {
    let mut map: [[Real; 3]; 3] = [[0.0; 3]; 3];
    let mut foot: [Real; 3] = [0.0; 3];
    if !write_force_map(leg, q, false, &mut map, &mut foot) {
        return;
    }
    let most = MOST_TURN_RAD;
    let limit = if error < 0.0 { -most } else { most };
    let turn = if error.abs() > most { limit } else { error };
    let sine = turn.sin();
    let shrunk = turn.cos() - 1.0;
    let x = hip[0] + foot[0];
    let z = hip[2] + foot[2];
    let forward = shrunk * x - sine * z;
    let up = sine * x + shrunk * z;
    for j in 0..3 {
        // The map is -J^-T.
        q[j] -= map[0][j] * forward + map[2][j] * up;
    }
}

/// Writes the moment of a force at a foot about where its hip is from.
fn write_moment(hip: &[Real], foot: &[Real], force: &[Real], moment: &mut [Real]) {
    let arm: [Real; 3] = [hip[0] + foot[0], hip[1] + foot[1], hip[2] + foot[2]];
    moment[0] = arm[1] * force[2] - arm[2] * force[1];
    moment[1] = arm[2] * force[0] - arm[0] * force[2];
    moment[2] = arm[0] * force[1] - arm[1] * force[0];
}

/// Writes rows of two maps at an attitude of roll, pitch and yaw (rad). The first is the rotation from the body's axes
/// to the world's. The second maps moments about the body's axes to the generalised moments of roll, pitch and yaw.
pub(crate) fn write_world_axes(
    attitude: &[Real],
    turned: &mut [[Real; 3]; 3],
    rates: &mut [[Real; 3]; 3],
) {
    let sr = attitude[0].sin();
    let cr = attitude[0].cos();
    let sp = attitude[1].sin();
    let cp = attitude[1].cos();
    let sy = attitude[2].sin();
    let cy = attitude[2].cos();
    turned[0][0] = cy * cp;
    turned[0][1] = cy * sp * sr - sy * cr;
    turned[0][2] = cy * sp * cr + sy * sr;
    turned[1][0] = sy * cp;
    turned[1][1] = sy * sp * sr + cy * cr;
    turned[1][2] = sy * sp * cr - cy * sr;
    turned[2][0] = -sp;
    turned[2][1] = cp * sr;
    turned[2][2] = cp * cr;
    rates[0][0] = 1.0;
    rates[0][1] = 0.0;
    rates[0][2] = 0.0;
    rates[1][0] = 0.0;
    rates[1][1] = cr;
    rates[1][2] = -sr;
    for i in 0..3 {
        rates[2][i] = turned[2][i];
    }
}

/// Turns `count` columns of forces and moments in the body's axes into generalised forces of position and of the
/// attitude, roll, pitch and yaw (rad). The result is `[R F; E^T M]`, where `E (d roll, d pitch, d yaw)` is the angular
/// velocity in the body's axes.
pub(crate) fn turn_to_world(attitude: &[Real], count: usize, wrench: &mut [Real]) {
    let mut turned: [[Real; 3]; 3] = [[0.0; 3]; 3];
    let mut rates: [[Real; 3]; 3] = [[0.0; 3]; 3];
    write_world_axes(attitude, &mut turned, &mut rates);
    for j in 0..count {
        let f: [Real; 3] = [wrench[j], wrench[count + j], wrench[2 * count + j]];
        let m: [Real; 3] = [
            wrench[3 * count + j],
            wrench[4 * count + j],
            wrench[5 * count + j],
        ];
        for i in 0..3 {
            wrench[i * count + j] = turned[i][0] * f[0] + turned[i][1] * f[1] + turned[i][2] * f[2];
            let moment = rates[i][0] * m[0] + rates[i][1] * m[1] + rates[i][2] * m[2];
            wrench[(3 + i) * count + j] = moment;
        }
    }
}
