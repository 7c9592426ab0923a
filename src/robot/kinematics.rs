//! One leg of the usual shape: hip abduction about x, hip flexion and knee about y.
//!
//! The hip frame has its origin in the leg's hip joint and axes parallel to the body's: x forward, y left, z up. A
//! positive flexion swings the thigh backwards, a negative knee angle bends the leg.

use nalgebra::{Matrix3, Vector3};

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
