//! The shape of one leg: the usual one in its short formulas, or any chain of three joints.

use nalgebra::{Matrix3, Vector3};

use super::chain::ChainLeg;
use super::kinematics::{self, PlanarLeg};

/// The shape of one leg. Both forms agree where both apply; the planar one has fewer operations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LegGeometry {
    /// Abduction about x, flexion and knee about y, links straight down.
    Planar(PlanarLeg),
    /// Any axes and links.
    Chain(ChainLeg),
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

/// Axes of a planar leg: x, y, y.
const USUAL_AXES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

impl LegGeometry {
    /// The simplest form of a chain.
    pub fn of_chain(chain: ChainLeg) -> Self {
        let [hip, thigh, calf] = chain.links;
        let is_usual = chain.axes == USUAL_AXES
            && (hip[0], hip[2]) == (0.0, 0.0)
            && (thigh[0], thigh[1]) == (0.0, 0.0)
            && calf[1] == 0.0
            && thigh[2] < 0.0
            && calf[2] < 0.0;
        match is_usual {
            false => LegGeometry::Chain(chain),
            true => LegGeometry::Planar(PlanarLeg {
                hip_m: hip[1],
                thigh_m: -thigh[2],
                calf_m: -calf[2],
                foot_forward_m: calf[0],
            }),
        }
    }

    /// The leg as a chain.
    pub fn chain(&self) -> ChainLeg {
        match self {
            LegGeometry::Chain(chain) => *chain,
            LegGeometry::Planar(leg) => ChainLeg {
                axes: USUAL_AXES,
                links: [
                    [0.0, leg.hip_m, 0.0],
                    [0.0, 0.0, -leg.thigh_m],
                    [leg.foot_forward_m, 0.0, -leg.calf_m],
                ],
            },
        }
    }

    /// Foot position from the first joint, in the body's axes, m, at joint angles `q` in rad.
    pub(crate) fn foot_position(&self, q: &[f64; 3]) -> Vector3<f64> {
        match self {
            LegGeometry::Planar(leg) => leg.foot_position(q),
            LegGeometry::Chain(leg) => leg.foot_position(q),
        }
    }

    /// Position of the third joint from the first, in the body's axes, m.
    pub fn knee_position(&self, q: &[f64; 3]) -> Vector3<f64> {
        match self {
            LegGeometry::Planar(leg) => PlanarLeg {
                calf_m: 0.0,
                foot_forward_m: 0.0,
                ..*leg
            }
            .foot_position(q),
            LegGeometry::Chain(leg) => {
                let [hip, thigh, _] = leg.links;
                let links = [hip, thigh, [0.0; 3]];
                ChainLeg { links, ..*leg }.foot_position(q)
            }
        }
    }

    /// Jacobian of `Self::foot_position`: `J[i][j] = d p_i / d q_j`, in m.
    pub fn foot_jacobian(&self, q: &[f64; 3]) -> Matrix3<f64> {
        match self {
            LegGeometry::Planar(leg) => leg.foot_jacobian(q),
            LegGeometry::Chain(leg) => leg.foot_jacobian(q),
        }
    }

    /// Lengths of thigh and calf, in m.
    pub fn lengths(&self) -> [f64; 2] {
        match self {
            LegGeometry::Planar(leg) => [leg.thigh_m, leg.calf_m],
            LegGeometry::Chain(leg) => leg.lengths(),
        }
    }

    /// The volume that bounds `|det J|`: thigh times calf times their sum.
    pub fn volume_m3(&self) -> f64 {
        kinematics::volume_m3(self.lengths())
    }

    /// `|det J| / volume`: 0 at full extension or with the foot on the axis of the first joint, at most about 1.
    pub fn manipulability(&self, q: &[f64; 3]) -> f64 {
        match self {
            LegGeometry::Planar(leg) => leg.manipulability(q),
            LegGeometry::Chain(leg) => leg.foot_jacobian(q).determinant().abs() / self.volume_m3(),
        }
    }

    /// Below which the area that thigh and calf span (m^2) and the height of the foot in the plane of the leg (m) are
    /// damped.
    pub fn least_levers(&self) -> [f64; 2] {
        kinematics::least_levers(self.lengths())
    }

    /// Span of thigh and calf over the product of their lengths, and height of the foot over the length of the
    /// stretched leg, as absolute values: what [`LEAST_SPAN`](super::kinematics::LEAST_SPAN) and
    /// [`LEAST_HEIGHT`](super::kinematics::LEAST_HEIGHT) are compared with.
    pub fn spans(&self, q: &[f64; 3]) -> [f64; 2] {
        let [area, lever] = match self {
            LegGeometry::Planar(leg) => leg.levers(q),
            LegGeometry::Chain(leg) => leg.levers(q),
        };
        let [thigh, calf] = self.lengths();
        [area.abs() / (thigh * calf), lever.abs() / (thigh + calf)]
    }

    /// `-J^-T` with levers that are never shorter than [`Self::least_levers`]; none where neither is that short.
    pub fn damped_force_map(&self, q: &[f64; 3]) -> Option<Matrix3<f64>> {
        match self {
            LegGeometry::Planar(leg) => leg.damped_force_map(q),
            LegGeometry::Chain(leg) => leg.damped_force_map(q),
        }
    }

    /// Directions and lengths at the zero posture. The foot's offset from a straight calf is left out of a planar leg.
    pub fn links(&self) -> LegLinks {
        let mut chain = self.chain();
        if let LegGeometry::Planar(_) = self {
            chain.links[2][0] = 0.0;
        }
        let [abduction, flexion, _] = chain.axes.map(Vector3::from);
        let [hip, thigh, calf] = chain.links.map(Vector3::from);
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
