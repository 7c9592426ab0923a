//! The legs of a robot as constants of the controller in C.

use super::numbers::{Numbers, integers, nested};
use crate::robot::{ChainLeg, Leg, LegGeometry, PlanarLeg, Robot};

/// Initialisers for the four legs, in the order of [`Leg::ALL`]; a leg of one kind is zeros in the table of the other.
pub(super) struct Legs {
    pub has_planar: bool,
    pub has_chain: bool,
    pub is_chain: String,
    pub planar: String,
    pub axes: String,
    pub links: String,
    pub least_levers: String,
    pub volumes: String,
    pub hips: String,
}

impl Legs {
    pub(super) fn of(robot: &Robot, numbers: Numbers) -> Self {
        let legs = Leg::ALL.map(|leg| robot.geometry(leg));
        let planar = legs.map(|leg| match leg {
            LegGeometry::Planar(leg) => {
                let PlanarLeg {
                    hip_m,
                    thigh_m,
                    calf_m,
                    foot_forward_m,
                } = *leg;
                [hip_m, thigh_m, calf_m, foot_forward_m]
            }
            LegGeometry::Chain(_) => [0.0; 4],
        });
        let chains = legs.map(|leg| match leg {
            LegGeometry::Planar(_) => [[[0.0; 3]; 3]; 2],
            LegGeometry::Chain(ChainLeg { axes, links }) => [*axes, *links],
        });
        let is_chain = legs.map(|leg| matches!(leg, LegGeometry::Chain(_)));
        let table = |part: usize| nested(chains.map(|chain| numbers.matrix(chain[part])));
        Self {
            has_planar: is_chain.contains(&false),
            has_chain: is_chain.contains(&true),
            is_chain: integers(is_chain.map(i64::from)),
            planar: numbers.matrix(planar),
            axes: table(0),
            links: table(1),
            least_levers: numbers.matrix(legs.map(LegGeometry::least_levers)),
            volumes: numbers.vector(legs.map(LegGeometry::volume_m3)),
            hips: numbers.matrix(Leg::ALL.map(|leg| {
                let hip = robot.hip_position(leg);
                [hip.x, hip.y, hip.z]
            })),
        }
    }
}
