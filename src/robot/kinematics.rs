//! One leg: hip abduction about x, hip flexion and knee about y.
//!
//! The hip frame has its origin in the leg's hip joint and axes parallel to
//! the body's: x forward, y left, z up. A positive flexion swings the thigh
//! backwards, a negative knee angle bends the leg.

use nalgebra::{Matrix3, Vector3};

use super::joints::Leg;

/// Smallest `|det J|`, divided by [`LegGeometry::volume_m3`], at which torques
/// still give a foot force: a knee about 1e-3 rad from full extension.
pub const SINGULAR_BOUND: f64 = 1e-3;

/// Link lengths of a leg.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LegGeometry {
    /// Distance from the hip's abduction axis to the plane of the leg, in m.
    pub hip_m: f64,
    /// From hip flexion to knee, in m.
    pub thigh_m: f64,
    /// From knee to foot along the calf, in m.
    pub calf_m: f64,
    /// Offset of the foot in front of the calf, in m.
    pub foot_forward_m: f64,
}

impl LegGeometry {
    /// Foot position in the hip frame, in m, at `q` = abduction, flexion, knee.
    ///
    /// With `h` the signed hip offset and `r` the height of the foot in the
    /// plane of the leg, `p = (p_x, h cos hx - r sin hx, h sin hx + r cos hx)`.
    pub fn foot_position(&self, leg: Leg, q: &[f64; 3]) -> Vector3<f64> {
        let plane = self.in_plane(q);
        let hip = leg.side() * self.hip_m;
        let (sin, cos) = q[0].sin_cos();
        Vector3::new(
            plane.forward,
            hip * cos - plane.up * sin,
            hip * sin + plane.up * cos,
        )
    }

    /// Jacobian of [`Self::foot_position`]: `J[i][j] = d p_i / d q_j`, in m.
    pub fn foot_jacobian(&self, leg: Leg, q: &[f64; 3]) -> Matrix3<f64> {
        let plane = self.in_plane(q);
        let hip = leg.side() * self.hip_m;
        let (sin, cos) = q[0].sin_cos();
        // d(forward)/d(flexion) = up, d(up)/d(flexion) = -forward; the knee
        // moves only the calf's share of both.
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

    /// The volume that bounds `|det J|`: thigh times calf times their sum.
    pub fn volume_m3(&self) -> f64 {
        self.thigh_m * self.calf_m * (self.thigh_m + self.calf_m)
    }

    /// `|det J| / volume`: 0 at full extension or with the foot on the axis of
    /// abduction, at most about 1.
    ///
    /// `|det J|` is the area that thigh and calf span times the height of the
    /// foot in the plane of the leg; the hip offset does not enter.
    pub fn manipulability(&self, q: &[f64; 3]) -> f64 {
        let plane = self.in_plane(q);
        let area = plane.forward * plane.calf_up - plane.up * plane.calf_forward;
        (area * plane.up).abs() / self.volume_m3()
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

#[cfg(test)]
mod tests {
    use super::*;

    const LEG: LegGeometry = LegGeometry {
        hip_m: 0.08,
        thigh_m: 0.213,
        calf_m: 0.21,
        foot_forward_m: 0.0,
    };
    const BENT: LegGeometry = LegGeometry {
        foot_forward_m: -0.03,
        ..LEG
    };

    fn postures() -> Vec<[f64; 3]> {
        let mut out = Vec::new();
        for hx in [-0.8, -0.1, 0.0, 0.6] {
            for hy in [-0.6, 0.3, 1.2, 3.0] {
                for kn in [-2.7, -1.5, -0.9] {
                    out.push([hx, hy, kn]);
                }
            }
        }
        out
    }

    #[test]
    fn foot_position_stretched_leg_hangs_below_hip_offset() {
        let p = LEG.foot_position(Leg::FrontLeft, &[0.0; 3]);
        assert!((p - Vector3::new(0.0, 0.08, -0.423)).norm() < 1e-15);
        let p = LEG.foot_position(Leg::RearRight, &[0.0; 3]);
        assert!((p - Vector3::new(0.0, -0.08, -0.423)).norm() < 1e-15);
    }

    #[test]
    fn foot_position_thigh_turned_back_by_a_right_angle_points_backwards() {
        let quarter = std::f64::consts::FRAC_PI_2;
        let p = LEG.foot_position(Leg::FrontLeft, &[0.0, quarter, -quarter]);
        assert!((p - Vector3::new(-0.213, 0.08, -0.21)).norm() < 1e-15);
    }

    #[test]
    fn foot_position_abduction_keeps_distance_to_the_hip() {
        let plain = LEG.foot_position(Leg::FrontLeft, &[0.0, 0.4, -1.0]);
        let turned = LEG.foot_position(Leg::FrontLeft, &[0.7, 0.4, -1.0]);
        assert!((plain.norm() - turned.norm()).abs() < 1e-15);
        // Abduction of a left leg lifts its foot outwards.
        assert!(turned.y > plain.y && turned.z > plain.z);
    }

    #[test]
    fn foot_jacobian_agrees_with_central_differences() {
        let step = 1e-6;
        for (leg, geometry) in Leg::ALL
            .into_iter()
            .flat_map(|leg| [(leg, LEG), (leg, BENT)])
        {
            for q in postures() {
                let exact = geometry.foot_jacobian(leg, &q);
                for joint in 0..3 {
                    let (mut lower, mut upper) = (q, q);
                    lower[joint] -= step;
                    upper[joint] += step;
                    let slope = (geometry.foot_position(leg, &upper)
                        - geometry.foot_position(leg, &lower))
                        / (2.0 * step);
                    let error = (exact.column(joint) - slope).norm();
                    assert!(error < 1e-9, "{leg} {q:?} joint {joint}: {error:e}");
                }
            }
        }
    }

    #[test]
    fn manipulability_is_the_normalised_determinant() {
        for (leg, geometry) in Leg::ALL
            .into_iter()
            .flat_map(|leg| [(leg, LEG), (leg, BENT)])
        {
            for q in postures() {
                let determinant = geometry.foot_jacobian(leg, &q).determinant();
                let expected = determinant.abs() / geometry.volume_m3();
                assert!(
                    (geometry.manipulability(&q) - expected).abs() < 1e-13,
                    "{q:?}"
                );
            }
        }
    }
}
