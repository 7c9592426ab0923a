//! Where the feet are, and how they move with the latent position.

use nalgebra::{DMatrix, DVector, Vector3};

use super::seed::{PITCH, Seed};
use crate::robot::{BODY_X, BODY_Z, JOINT_DIM, Leg, STATE_DIM};

/// A foot's place along the floor and above it (m), and the derivatives by `z` (one row each).
pub struct FootPlace {
    pub at: [f64; 2],
    pub by_z: DMatrix<f64>,
}

/// The foot of a leg at a latent position; roll and yaw of a jump forwards are left out.
pub fn foot_place(seed: &Seed<'_>, leg: Leg, z: &DVector<f64>) -> FootPlace {
    let robot = seed.rule.robot();
    let x = seed.decoded(z);
    let joints: [f64; JOINT_DIM] = std::array::from_fn(|i| x[i]);
    let q = leg.of_joints(&joints);
    let (sin, cos) = x[PITCH].sin_cos();
    let foot = robot.foot_from_body(leg, &q);
    let along = |v: &Vector3<f64>| cos * v.x + sin * v.z;
    let above = |v: &Vector3<f64>| -sin * v.x + cos * v.z;
    let jacobian = robot.foot_jacobian(leg, &q);
    let mut by_x = DMatrix::zeros(2, STATE_DIM);
    for joint in 0..3 {
        let column = Vector3::from(jacobian.column(joint));
        let at = 3 * leg.index() + joint;
        by_x[(0, at)] = along(&column);
        by_x[(1, at)] = above(&column);
    }
    by_x[(0, BODY_X)] = 1.0;
    by_x[(1, BODY_Z)] = 1.0;
    by_x[(0, PITCH)] = above(&foot);
    by_x[(1, PITCH)] = -along(&foot);
    FootPlace {
        at: [x[BODY_X] + along(&foot), x[BODY_Z] + above(&foot)],
        by_z: by_x * &seed.decode,
    }
}
