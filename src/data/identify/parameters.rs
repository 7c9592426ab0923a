//! Columns of the regression. All but gravity stand in the equations divided by the robot's mass.

use super::*;

pub(crate) const PARAMETER_DIM: usize = 23;

pub(crate) const GRAVITY: usize = 0; // m/s^2
pub(crate) const INVERSE_MASS: usize = 1; // 1/kg
pub(crate) const VISCOUS: usize = 2; // first of three viscous frictions (hx, hy, kn), N m s/rad
pub(crate) const DRY: usize = 5; // first of three dry frictions, N m
pub(crate) const ARMATURE: usize = 8; // first of three, kg m^2
pub(crate) const TRUNK_FORWARD: usize = 11; // first moment of the trunk along its x axis, kg m
pub(crate) const TRUNK_UP: usize = 12; // along its z axis
pub(crate) const LEG_SIDE: usize = 13; // first moment of a leg sideways from its axis of abduction, kg m
pub(crate) const THIGH: usize = 14; // first moment along its length, with the calf's mass at the knee, kg m
pub(crate) const THIGH_SECOND: usize = 15; // second moment of the same, kg m^2
pub(crate) const CALF: usize = 16; // first moment along its length, kg m
pub(crate) const CALF_SECOND: usize = 17; // second moment of the same, kg m^2
pub(crate) const THIGH_FRONT: usize = 18; // first moment in front of its length, kg m
pub(crate) const CALF_FRONT: usize = 19;
pub(crate) const FOOT_RADIUS: usize = 20; // height of the foot's centre above its point of contact, m
pub(crate) const ROLLING: usize = 21; // arm of the normal force about a rolling foot, m
pub(crate) const DELAY: usize = 22; // change of the time by which torques run ahead of the motion, s

pub(crate) fn not_negative() -> impl Iterator<Item = usize> {
    (VISCOUS..TRUNK_FORWARD).chain([THIGH_SECOND, CALF_SECOND, ROLLING])
}

/// A wide deviation of a linear combination about zero: it matters where the recordings leave a direction open.
pub(crate) struct Prior {
    pub terms: Vec<(usize, f64)>, // coefficients by unknown
    pub deviation: f64,
}

const LEG_SHARE: f64 = 0.13;
const LEAST_SIDE: f64 = 0.1;
const ROD: f64 = 2.0 / 3.0; // second moment of a uniform rod over length times first moment
/// Relative deviation of a hip's loss from that of the thigh joint, and the smallest loss that it counts from.
const HIP_LIKE_THIGH: [(usize, f64, f64); 3] = [
    (VISCOUS, 1.0, 0.05),
    (DRY, 0.5, 0.05),
    (ARMATURE, 0.3, 1e-3),
];

/// Prior knowledge of any quadruped of this size and mass (kg). `losses` are present estimates, SI.
pub(crate) fn priors(
    geometry: &LegGeometry,
    mass_kg: f64,
    losses: &[f64; PARAMETER_DIM],
) -> Vec<Prior> {
    let [thigh, calf] = geometry.lengths_m;
    let side = geometry.links().hip.norm().max(LEAST_SIDE * thigh);
    let leg = LEG_SHARE * mass_kg;
    let singles = [
        (TRUNK_FORWARD, 0.07 * (thigh + calf) * mass_kg),
        (TRUNK_UP, 0.07 * (thigh + calf) * mass_kg),
        (LEG_SIDE, leg * side),
        (THIGH, leg * thigh),
        (THIGH_SECOND, leg * thigh * thigh),
        (CALF, leg * calf),
        (CALF_SECOND, leg * calf * calf),
        (THIGH_FRONT, 0.1 * leg * thigh),
        (CALF_FRONT, 0.1 * leg * calf),
        (FOOT_RADIUS, 0.02),
        (ROLLING, 0.01),
        (DELAY, 0.01),
    ];
    let rods = [
        (THIGH_SECOND, THIGH, thigh, 0.005),
        (CALF_SECOND, CALF, calf, 0.003),
    ];
    let singles = singles.map(|(index, deviation)| (vec![(index, 1.0)], deviation));
    let rods = rods.map(|(second, first, length, share)| {
        let terms = vec![(second, 1.0), (first, -ROD * length)];
        (terms, share * mass_kg * length * length)
    });
    let hips = HIP_LIKE_THIGH.map(|(first, relative, smallest)| {
        let terms = vec![(first, 1.0), (first + 1, -1.0)];
        (terms, relative * losses[first + 1].max(smallest))
    });
    let all = singles.into_iter().chain(rods).chain(hips);
    (all.map(|(terms, deviation)| Prior { terms, deviation })).collect()
}
