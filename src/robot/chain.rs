//! One leg of three joints with any axes: a chain of rotations and links.
//!
//! At the zero posture the axes `a_0, a_1, a_2` and the links `l_1` (first to second joint), `l_2` (second to third)
//! and `l_3` (third to foot) are given along the body's axes. With the turn `R_i = R(a_i, q_i)` of each joint the foot
//! is at `p = R_0 (l_1 + R_1 (l_2 + R_2 l_3))` from the first joint. The last two axes are parallel: both joints move
//! the foot in one plane.
//!
//! One leg of the usual shape: hip abduction about x, hip flexion and knee about y.
//!
//! The hip frame has its origin in the leg's hip joint and axes parallel to the body's: x forward, y left, z up. A
//! positive flexion swings the thigh backwards, a negative knee angle bends the leg.

use core::ops::{Add, Mul, Sub};

use nalgebra::{Matrix3, Vector3};

/// Axes and links of a leg at its zero posture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChainLeg {
    /// Unit vectors of the joints' axes, from the trunk to the foot.
    pub axes: [[f64; 3]; 3],
    /// From each joint to the next and from the last to the foot, in m.
    pub links: [[f64; 3]; 3],
}

/// Where the foot is and how each joint moves it.
pub struct Moved<T> {
    /// Foot position from the first joint, m.
    pub foot: [T; 3],
    /// Velocity of the foot per joint velocity.
    pub columns: [[T; 3]; 3],
    /// Axis of the second joint: the normal of the plane in which the last two move the foot.
    pub normal: [T; 3],
}

/// A number of the formulas: a float, or a value of a program that is being built.
pub trait Value: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {}

impl<T: Copy + Add<Output = T> + Sub<Output = T> + Mul<Output = T>> Value for T {}

impl<T: Value> Moved<T> {
    /// Of axes and links at sine and cosine of each joint's angle; `one` is the number 1.
    pub fn new(axes: [[T; 3]; 3], links: [[T; 3]; 3], angles: [(T, T); 3], one: T) -> Self {
        // `v cos + (a x v) sin + a (a . v) (1 - cos)`
        let turned = |joint: usize, vector: [T; 3]| {
            let (axis, (sin, cos)) = (axes[joint], angles[joint]);
            let across = cross(axis, vector);
            let along = dot(axis, vector) * (one - cos);
            core::array::from_fn(|i| vector[i] * cos + across[i] * sin + axis[i] * along)
        };
        let [hip, thigh, calf] = links;
        let beyond_knee = turned(0, turned(1, turned(2, calf)));
        let beyond_second = sum(turned(0, turned(1, thigh)), beyond_knee);
        let foot = sum(turned(0, hip), beyond_second);
        let normal = turned(0, axes[1]);
        let knee_axis = turned(0, turned(1, axes[2]));
        Self {
            foot,
            columns: [
                cross(axes[0], foot),
                cross(normal, beyond_second),
                cross(knee_axis, beyond_knee),
            ],
            normal,
        }
    }

    /// See `ChainLeg::levers`.
    pub fn levers(&self) -> [T; 2] {
        let [first, second, third] = self.columns;
        let area = dot(cross(second, third), self.normal);
        [area, dot(first, self.normal)]
    }
}

/// `a + b`
pub fn sum<T: Value>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    core::array::from_fn(|i| a[i] + b[i])
}

/// `a . b`
pub fn dot<T: Value>(a: [T; 3], b: [T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `a x b`
pub fn cross<T: Value>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    core::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        a[j] * b[k] - a[k] * b[j]
    })
}

impl ChainLeg {
    /// Foot position from the first joint, in m, at joint angles `q` in rad.
    pub fn foot_position(&self, q: &[f64; 3]) -> Vector3<f64> {
        self.moved(q).foot.into()
    }

    /// Jacobian of [`Self::foot_position`]: column `j` is `axis_j x (foot - joint_j)`, in m.
    pub fn foot_jacobian(&self, q: &[f64; 3]) -> Matrix3<f64> {
        Matrix3::from_columns(&self.moved(q).columns.map(Vector3::from))
    }

    fn moved(&self, q: &[f64; 3]) -> Moved<f64> {
        Moved::new(self.axes, self.links, q.map(f64::sin_cos), 1.0)
    }

    /// Lengths of thigh and calf across the second joint's axis, in m.
    pub fn lengths(&self) -> [f64; 2] {
        let axis = Vector3::from(self.axes[1]);
        [1, 2].map(|link: usize| axis.cross(&Vector3::from(self.links[link])).norm())
    }

    /// Area that thigh and calf span, with its sign, in m^2, and lever of the first joint along the normal of their
    /// plane, in m; their product is `det J`.
    pub(crate) fn levers(&self, q: &[f64; 3]) -> [f64; 2] {
        self.moved(q).levers()
    }

    /// `-J^-T` with levers that are never shorter than the damping lets them be, or none where neither is that short.
    ///
    /// With the columns `c_j` of the Jacobian, the normal `n`, the area `A = (c_1 x c_2) . n` and the lever `u = c_0 .
    /// n` the columns of `J^-T` are
    ///
    /// ```text
    /// n / u
    /// (c_2 x n) / A + n (n . (c_2 x c_0)) / (A u)
    /// (n x c_1) / A + n (n . (c_0 x c_1)) / (A u)
    /// ```
    ///
    /// in which `1 / d` of both becomes `d / max(d^2, least^2)`.
    pub(super) fn damped_force_map(&self, q: &[f64; 3]) -> Option<Matrix3<f64>> {
        let moved = self.moved(q);
        let [area, lever] = moved.levers();
        let [least_area, least_lever] = least_levers(self.lengths());
        if area.abs() >= least_area && lever.abs() >= least_lever {
            return None;
        }
        let reciprocal = |d: f64, least: f64| d / (d * d).max(least * least);
        let (of_area, of_lever) = (reciprocal(area, least_area), reciprocal(lever, least_lever));
        let [first, second, third] = &moved.columns.map(Vector3::from);
        let normal = Vector3::from(moved.normal);
        let column = |in_plane: Vector3<f64>, share: f64| {
            -(in_plane * of_area + normal * (share * of_area * of_lever))
        };
        Some(Matrix3::from_columns(&[
            -normal * of_lever,
            column(third.cross(&normal), normal.dot(&third.cross(first))),
            column(normal.cross(second), normal.dot(&first.cross(second))),
        ]))
    }
}

/// Smallest `|det J|`, divided by [`LegGeometry::volume_m3`](super::LegGeometry::volume_m3), at which torques still
/// give a foot force: a knee about 1e-3 rad from full extension.
pub const SINGULAR_BOUND: f64 = 1e-3;

/// Smallest area that thigh and calf span, over the product of their lengths (about the sine of the knee), at which
/// torques are turned into forces without damping.
pub const LEAST_SPAN: f64 = 0.3;

/// Smallest height of the foot above or below its hip in the plane of the leg, over the length of the stretched leg, at
/// which torques are turned into forces without damping.
pub const LEAST_HEIGHT: f64 = 0.12;

/// Link lengths of a leg.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanarLeg {
    /// From the hip's abduction axis to the plane of the leg, along y, in m: negative on the right.
    pub hip_m: f64,
    /// From hip flexion to knee, in m.
    pub thigh_m: f64,
    /// From knee to foot along the calf, in m.
    pub calf_m: f64,
    /// Offset of the foot in front of the calf, in m.
    pub foot_forward_m: f64,
}

impl PlanarLeg {
    /// Foot position in the hip frame, in m, at `q` = abduction, flexion, knee.
    ///
    /// With `h` the hip offset and `r` the height of the foot in the plane of the leg, `p = (p_x, h cos hx - r sin hx,
    /// h sin hx + r cos hx)`.
    pub fn foot_position(&self, q: &[f64; 3]) -> Vector3<f64> {
        let plane = self.in_plane(q);
        let hip = self.hip_m;
        let (sin, cos) = q[0].sin_cos();
        Vector3::new(
            plane.forward,
            hip * cos - plane.up * sin,
            hip * sin + plane.up * cos,
        )
    }

    /// Jacobian of [`Self::foot_position`]: `J[i][j] = d p_i / d q_j`, in m.
    pub fn foot_jacobian(&self, q: &[f64; 3]) -> Matrix3<f64> {
        let plane = self.in_plane(q);
        let hip = self.hip_m;
        let (sin, cos) = q[0].sin_cos();
        // d(forward)/d(flexion) = up, d(up)/d(flexion) = -forward; the knee moves only the calf's share of both.
        Matrix3::new(
            0.0,
            plane.up,
            plane.calf_up,
            -hip * sin - plane.up * cos,
            plane.forward * sin,
            plane.calf_forward * sin,
            hip * cos - plane.up * sin,
            -plane.forward * cos,
            -plane.calf_forward * cos,
        )
    }

    /// `|det J| / volume`: 0 at full extension or with the foot on the axis of abduction, at most about 1.
    ///
    /// `|det J|` is the area that thigh and calf span times the height of the foot in the plane of the leg; the hip
    /// offset does not enter.
    pub(crate) fn manipulability(&self, q: &[f64; 3]) -> f64 {
        let plane = self.in_plane(q);
        let area = plane.forward * plane.calf_up - plane.up * plane.calf_forward;
        (area * plane.up).abs() / volume_m3([self.thigh_m, self.calf_m])
    }

    /// `-J^-T` with levers that are never shorter than the damping lets them be, or none where neither knee nor foot is
    /// that near a singularity.
    ///
    /// In the axes `x`, `e = (0, sin hx, -cos hx)`, `n = (0, cos hx, sin hx)` the Jacobian has the columns `-h e - up
    /// n`, `up x + fwd e` and `c_up x + c_fwd e`, so that `J^T F = -tau` gives
    ///
    /// ```text
    /// F_x = (fwd tau_2 - c_fwd tau_1) / det     F_e = (c_up tau_1 - up tau_2) / det
    /// F_n = (tau_0 - h F_e) / up                det = up c_fwd - fwd c_up
    /// ```
    ///
    /// Of both divisors `1 / d` becomes `d / max(d^2, least^2)`: equal outside, continuous, and at most `1 / least`,
    /// with [`LEAST_SPAN`] thigh calf for `det` and [`LEAST_HEIGHT`] (thigh + calf) for `up`.
    pub(super) fn damped_force_map(&self, q: &[f64; 3]) -> Option<Matrix3<f64>> {
        let plane = self.in_plane(q);
        let det = plane.determinant();
        let [least_det, least_up] = least_levers([self.thigh_m, self.calf_m]);
        if det.abs() >= least_det && plane.up.abs() >= least_up {
            return None;
        }
        let reciprocal = |d: f64, least: f64| d / (d * d).max(least * least);
        let (of_det, of_up) = (reciprocal(det, least_det), reciprocal(plane.up, least_up));
        let hip = self.hip_m;
        let along_x = Vector3::new(0.0, -plane.calf_forward, plane.forward) * of_det;
        let along_e = Vector3::new(0.0, plane.calf_up, -plane.up) * of_det;
        let along_n = (Vector3::x() - along_e * hip) * of_up;
        let (sin, cos) = q[0].sin_cos();
        let across = along_e * sin + along_n * cos;
        let up = along_n * sin - along_e * cos;
        Some(Matrix3::from_rows(&[
            along_x.transpose(),
            across.transpose(),
            up.transpose(),
        ]))
    }

    /// Area that thigh and calf span, with its sign, in m^2, and height of the foot in the plane of the leg, in m.
    pub(super) fn levers(&self, q: &[f64; 3]) -> [f64; 2] {
        let plane = self.in_plane(q);
        [plane.determinant(), plane.up]
    }

    fn in_plane(&self, q: &[f64; 3]) -> InPlane {
        let (thigh_sin, thigh_cos) = q[1].sin_cos();
        let (calf_sin, calf_cos) = (q[1] + q[2]).sin_cos();
        let calf_forward = -self.calf_m * calf_sin + self.foot_forward_m * calf_cos;
        let calf_up = -self.calf_m * calf_cos - self.foot_forward_m * calf_sin;
        InPlane {
            forward: -self.thigh_m * thigh_sin + calf_forward,
            up: -self.thigh_m * thigh_cos + calf_up,
            calf_forward,
            calf_up,
        }
    }
}

/// The foot in the plane of the leg, before abduction turns that plane.
struct InPlane {
    forward: f64,
    up: f64,
    calf_forward: f64,
    calf_up: f64,
}

impl InPlane {
    fn determinant(&self) -> f64 {
        self.up * self.calf_forward - self.forward * self.calf_up
    }
}

/// The volume that bounds `|det J|`: thigh times calf times their sum.
pub(super) fn volume_m3([thigh, calf]: [f64; 2]) -> f64 {
    thigh * calf * (thigh + calf)
}

/// Below which the area that thigh and calf span (m^2) and the height of the foot (m) are damped.
pub fn least_levers([thigh, calf]: [f64; 2]) -> [f64; 2] {
    [LEAST_SPAN * thigh * calf, LEAST_HEIGHT * (thigh + calf)]
}
