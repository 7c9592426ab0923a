//! Quaternions to roll, pitch and yaw; angular velocities to the rates of these angles.

use nalgebra::{DMatrix, Matrix3, Vector3};
use std::f64::consts::{PI, TAU};

use super::map::Frame;
use crate::robot::input_rule::rotation;

const UPRIGHT: f64 = 1e-6; // cosine of the pitch below which roll and yaw cannot be told apart

/// Roll, pitch and yaw of quaternions (w, x, y, z), R = Rz Ry Rx; the length of a quaternion does not matter.
pub(in crate::recording) fn angles_of_quaternions(quaternions: &DMatrix<f64>) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(3, quaternions.ncols());
    for (mut angles, q) in out.column_iter_mut().zip(quaternions.column_iter()) {
        let norm = q.norm();
        let (w, x, y, z) = (q[0] / norm, q[1] / norm, q[2] / norm, q[3] / norm);
        let sine = 2.0 * (w * y - x * z);
        let (forward, side) = (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z));
        angles[0] = (2.0 * (y * z + w * x)).atan2(1.0 - 2.0 * (x * x + y * y));
        angles[1] = sine.atan2(forward.hypot(side));
        angles[2] = side.atan2(forward);
    }
    out
}

/// Takes whole turns off rows of angles where they jump by more than half a turn; whether any did.
pub(super) fn unwrap(angles: &mut DMatrix<f64>) -> bool {
    let mut any = false;
    for mut row in angles.row_iter_mut() {
        let mut turns = 0.0;
        for i in 1..row.len() {
            let now = row[i] + turns;
            let jump = now - row[i - 1];
            if jump.abs() > PI {
                turns -= TAU * (jump / TAU).round();
                any = true;
            }
            row[i] += turns;
        }
    }
    any
}

/// Velocities in the world of velocities along the body's own axes, at these angles.
pub(super) fn in_world(angles: &DMatrix<f64>, velocities: &DMatrix<f64>) -> DMatrix<f64> {
    let mut out = velocities.clone();
    for (i, mut velocity) in out.column_iter_mut().enumerate() {
        let turn: Matrix3<f64> = rotation([angles[(0, i)], angles[(1, i)], angles[(2, i)]]);
        velocity.copy_from(&(turn * velocities.fixed_view::<3, 1>(0, i)));
    }
    out
}

/// Rates of roll, pitch and yaw from an angular velocity about the body's or the world's axes, or from themselves. An
/// error is the first sample at which the trunk points straight up or down.
pub(super) fn angle_rates(
    angles: &DMatrix<f64>,
    angular: &DMatrix<f64>,
    frame: Frame,
) -> Result<DMatrix<f64>, usize> {
    let mut out = DMatrix::zeros(3, angular.ncols());
    for i in 0..angular.ncols() {
        let [roll, pitch, yaw] = [angles[(0, i)], angles[(1, i)], angles[(2, i)]];
        let omega = Vector3::new(angular[(0, i)], angular[(1, i)], angular[(2, i)]);
        let (s_p, c_p) = pitch.sin_cos();
        if c_p.abs() < UPRIGHT {
            return Err(i);
        }
        // Columns of the matrices one below the other.
        let map = match frame {
            Frame::Body => {
                let (s_r, c_r) = roll.sin_cos();
                let tangent = s_p / c_p;
                Matrix3::from([
                    [1.0, 0.0, 0.0],
                    [s_r * tangent, c_r, s_r / c_p],
                    [c_r * tangent, -s_r, c_r / c_p],
                ])
            }
            Frame::World => {
                let (s_y, c_y) = yaw.sin_cos();
                Matrix3::from([
                    [c_y / c_p, -s_y, c_y * s_p / c_p],
                    [s_y / c_p, c_y, s_y * s_p / c_p],
                    [0.0, 0.0, 1.0],
                ])
            }
            Frame::Angles => return Ok(angular.clone()),
        };
        out.set_column(i, &(map * omega));
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ATTITUDES: [[f64; 3]; 4] = [
        [0.1, -0.2, 0.3],
        [-1.0, 1.2, -3.0],
        [0.0, -1.5, 2.0],
        [3.0, 0.4, 0.0],
    ];

    #[test]
    fn angle_rates_agree_with_the_derivative_of_the_rotation() {
        let rates = [0.7, -1.1, 0.4];
        for angles in ATTITUDES {
            let turned = |h: f64| rotation(std::array::from_fn(|i| angles[i] + h * rates[i]));
            let (h, r) = (1e-6, rotation(angles));
            let derivative = (turned(h) - turned(-h)) / (2.0 * h);
            for (frame, spin) in [
                (Frame::Body, r.transpose() * derivative),
                (Frame::World, derivative * r.transpose()),
            ] {
                let omega = [spin[(2, 1)], spin[(0, 2)], spin[(1, 0)]];
                let column = |values: &[f64; 3]| DMatrix::from_column_slice(3, 1, values);
                let found = angle_rates(&column(&angles), &column(&omega), frame).unwrap();
                let error = (&found - column(&rates)).amax();
                assert!(error < 1e-8, "{frame:?} {angles:?}: {found}");
            }
        }
        let upright = DMatrix::from_column_slice(3, 1, &[0.0, PI / 2.0, 0.0]);
        assert_eq!(
            angle_rates(&upright, &DMatrix::zeros(3, 1), Frame::Body),
            Err(0)
        );
    }
}
