//! The unknowns of the regression, in the order of the columns.
//!
//! All but gravity stand in the equations divided by the robot's mass.

use crate::robot::LegGeometry;

/// Number of unknowns.
pub const PARAMETER_DIM: usize = 23;

/// Gravity, m/s^2.
pub const GRAVITY: usize = 0;
/// 1 over the mass, 1/kg.
pub const INVERSE_MASS: usize = 1;
/// First of three viscous frictions (hx, hy, kn), N m s/rad.
pub const VISCOUS: usize = 2;
/// First of three dry frictions, N m.
pub const DRY: usize = 5;
/// First of three armatures, kg m^2.
pub const ARMATURE: usize = 8;
/// First moment of the trunk along its x axis, kg m.
pub const TRUNK_FORWARD: usize = 11;
/// First moment of the trunk along its z axis, kg m.
pub(crate) const TRUNK_UP: usize = 12;
/// First moment of a leg beside its axis of abduction, kg m.
pub const LEG_SIDE: usize = 13;
/// First moment of a thigh along its length, with the calf's mass at the knee, kg m.
pub const THIGH: usize = 14;
/// Second moment of the same, kg m^2.
pub const THIGH_SECOND: usize = 15;
/// First moment of a calf along its length, kg m.
pub const CALF: usize = 16;
/// Second moment of the same, kg m^2.
pub const CALF_SECOND: usize = 17;
/// First moment of a thigh in front of its length, kg m.
pub(crate) const THIGH_FRONT: usize = 18;
/// First moment of a calf in front of its length, kg m.
pub(crate) const CALF_FRONT: usize = 19;
/// Height of the foot's centre above its point of contact, m.
pub(crate) const FOOT_RADIUS: usize = 20;
/// Rolling resistance: arm of the normal force about a rolling foot, m.
pub(crate) const ROLLING: usize = 21;
/// Change of the time by which torques run ahead of the motion, s.
pub(crate) const DELAY: usize = 22;

/// Unknowns that cannot be negative: losses, second moments, rolling resistance.
pub(crate) const NOT_NEGATIVE: [usize; 12] = [
    VISCOUS,
    VISCOUS + 1,
    VISCOUS + 2,
    DRY,
    DRY + 1,
    DRY + 2,
    ARMATURE,
    ARMATURE + 1,
    ARMATURE + 2,
    THIGH_SECOND,
    CALF_SECOND,
    ROLLING,
];

/// Standard deviation of a linear combination of the unknowns about zero, known beforehand.
///
/// These are wide: they matter only where the recordings leave a direction open.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Prior {
    /// Coefficients by unknown.
    pub terms: Vec<(usize, f64)>,
    /// Standard deviation of the sum, in the unknowns' units.
    pub deviation: f64,
}

/// Share of the robot's mass in the moving part of one leg, by order of magnitude.
const LEG_SHARE: f64 = 0.13;
/// Least distance of a leg from its axis of abduction that counts, over the thigh's length.
const LEAST_SIDE: f64 = 0.1;
/// Second moment of a uniform rod over length times first moment.
const ROD: f64 = 2.0 / 3.0;
/// Deviation of a hip's loss from that of the thigh joint of the same leg, relative, and the smallest loss that it
/// counts from.
const HIP_LIKE_THIGH: [(usize, f64, f64); 3] = [
    (VISCOUS, 1.0, 0.05),
    (DRY, 0.5, 0.05),
    (ARMATURE, 0.3, 1e-3),
];

/// What is known of any quadruped of this size and mass (kg). `losses` are present estimates, SI.
pub(crate) fn priors(
    geometry: &LegGeometry,
    mass_kg: f64,
    losses: &[f64; PARAMETER_DIM],
) -> Vec<Prior> {
    let [thigh, calf] = geometry.lengths();
    let leg = LEG_SHARE * mass_kg;
    let single = |index: usize, deviation: f64| Prior {
        terms: vec![(index, 1.0)],
        deviation,
    };
    let rod = |second: usize, first: usize, length: f64, share: f64| Prior {
        terms: vec![(second, 1.0), (first, -ROD * length)],
        deviation: share * mass_kg * length * length,
    };
    let mut priors = vec![
        single(TRUNK_FORWARD, 0.07 * (thigh + calf) * mass_kg),
        single(TRUNK_UP, 0.07 * (thigh + calf) * mass_kg),
        single(
            LEG_SIDE,
            leg * geometry.links().hip.norm().max(LEAST_SIDE * thigh),
        ),
        single(THIGH, leg * thigh),
        single(THIGH_SECOND, leg * thigh * thigh),
        single(CALF, leg * calf),
        single(CALF_SECOND, leg * calf * calf),
        single(THIGH_FRONT, 0.1 * leg * thigh),
        single(CALF_FRONT, 0.1 * leg * calf),
        single(FOOT_RADIUS, 0.02),
        single(ROLLING, 0.01),
        single(DELAY, 0.01),
        rod(THIGH_SECOND, THIGH, thigh, 0.005),
        rod(CALF_SECOND, CALF, calf, 0.003),
    ];
    for (first, relative, smallest) in HIP_LIKE_THIGH {
        priors.push(Prior {
            terms: vec![(first, 1.0), (first + 1, -1.0)],
            deviation: relative * losses[first + 1].max(smallest),
        });
    }
    priors
}
