//! Arithmetic of the consistent lift: the optimum without rows, the rows, and their change of variables. This file is
//! translated to C.
//!
//! In: the parts of the program in `lift`, matrices row-major. Out: torques and rows, written into the caller's arrays.
//! Read `lift` first, which states the program, then [`free_optimum`].

use super::dense::{
    MOST_LATENT, MOST_SQUARE, Real, add_scaled, factorise, greater, smaller, solve_lower,
    solve_upper,
};
use super::stage::SQRT_HALF;

/// Torques that are kept are so far inside the limits, as a share, that rounding does not put them beyond.
const INSIDE: Real = 0.999;

/// Writes `m + C y`.
pub(super) fn write_torque(mean: &[Real], deviation: &[Real], y: &[Real], torque: &mut [Real]) {
    for i in 0..12 {
        torque[i] = mean[i];
        for j in i..12 {
            torque[i] += deviation[12 * i + j] * y[j];
        }
    }
}

/// Writes `row C`.
fn by_deviation(row: &[Real], deviation: &[Real], out: &mut [Real]) {
    for j in 0..12 {
        out[j] = 0.0;
        for k in 0..=j {
            out[j] += row[k] * deviation[12 * k + j];
        }
    }
}

/// Writes `A` and `y₀`; false if a number is not finite. `wrench` is `G`; matrices are row-major.
pub(super) fn free_optimum(
    projection: &[Real],
    wrench: &[Real],
    mean: &[Real],
    deviation: &[Real],
    u_lat: &[Real],
    prior_weight: Real,
    d: usize,
    scaled_map: &mut [Real],
    y: &mut [Real],
) -> bool {
    let scale = 1.0 / prior_weight.sqrt();
    let mut row: [Real; 12] = [0.0; 12];
    let mut residual: [Real; MOST_LATENT] = [0.0; MOST_LATENT];
    let mut square: [Real; MOST_SQUARE] = [0.0; MOST_SQUARE];
    for i in 0..d {
        let own = &projection[18 * i..];
        let mut left: Real = u_lat[i];
        for j in 0..12 {
            let mut by_wrench: Real = 0.0;
            for axis in 0..6 {
                by_wrench += wrench[12 * axis + j] * own[12 + axis];
            }
            row[j] = own[j] + by_wrench;
            left -= row[j] * mean[j];
        }
        by_deviation(&row, deviation, &mut scaled_map[12 * i..]);
        for j in 0..12 {
            scaled_map[12 * i + j] *= scale;
        }
        residual[i] = scale * left;
    }
    for i in 0..d {
        for j in 0..=i {
            let mut sum: Real = if i == j { 1.0 } else { 0.0 };
            for k in 0..12 {
                sum += scaled_map[12 * i + k] * scaled_map[12 * j + k];
            }
            square[i * d + j] = sum;
        }
    }
    if !factorise(&mut square, d) {
        return false;
    }
    solve_lower(&square, d, &mut residual);
    solve_upper(&square, d, &mut residual);
    for j in 0..12 {
        y[j] = 0.0;
    }
    for i in 0..d {
        add_scaled(residual[i], &scaled_map[12 * i..], 12, y);
    }
    true
}

/// Legs in the air get the torques of the reference, or zero at the links if it has none, clamped to the limits.
pub(super) fn keep_swing(
    is_down: &[bool],
    is_known: bool,
    limit_nm: &[Real],
    losses_nm: &[Real],
    mean: &mut [Real],
    deviation: &mut [Real],
) {
    for joint in 0..12 {
        if !is_down[joint / 3] {
            let least = -INSIDE * limit_nm[joint] - losses_nm[joint];
            let most = INSIDE * limit_nm[joint] - losses_nm[joint];
            let kept: Real = if is_known { mean[joint] } else { 0.0 };
            mean[joint] = smaller(greater(kept, least), most);
            for k in 0..12 {
                deviation[12 * joint + k] = 0.0;
            }
        }
    }
}

/// Writes both sides of the torque limits as rows on the torques, and the room that `torque` leaves.
pub(super) fn write_limits(
    limit_nm: &[Real],
    losses_nm: &[Real],
    torque: &[Real],
    rows: &mut [Real],
    bounds: &mut [Real],
) {
    for number in 0..24 {
        let joint = number % 12;
        let sign: Real = if number < 12 { 1.0 } else { -1.0 };
        for j in 0..12 {
            rows[12 * number + j] = 0.0;
        }
        rows[12 * number + joint] = sign / limit_nm[joint];
        bounds[number] = 1.0 - sign * ((torque[joint] + losses_nm[joint]) / limit_nm[joint]);
    }
}

/// Moves torques that are with the losses beyond the limits to these.
pub(super) fn keep_limits(limit_nm: &[Real], losses_nm: &[Real], torque: &mut [Real]) {
    for i in 0..12 {
        let least = -limit_nm[i] - losses_nm[i];
        let most = limit_nm[i] - losses_nm[i];
        torque[i] = if torque[i] < least { least } else { torque[i] };
        torque[i] = if torque[i] > most { most } else { torque[i] };
    }
}

/// Writes the pyramid `|F_x|, |F_y| <= μ F_z / √2` of a foot with its force by the leg's torques, `3 × 3` row-major.
pub(super) fn write_foot(
    force: &[Real],
    friction: Real,
    weight_n: Real,
    torque: &[Real],
    leg: usize,
    rows: &mut [Real],
    bounds: &mut [Real],
) {
    for side in 0..4 {
        let sign: Real = if side % 2 == 0 { 1.0 } else { -1.0 };
        let mut room: Real = 0.0;
        for j in 0..12 {
            rows[12 * side + j] = 0.0;
        }
        for k in 0..3 {
            let within = friction * force[6 + k] * SQRT_HALF;
            let entry = (sign * force[3 * (side / 2) + k] - within) / weight_n;
            rows[12 * side + 3 * leg + k] = entry;
            room -= entry * torque[3 * leg + k];
        }
        bounds[side] = room;
    }
}

/// Writes `L`; false if a number is not finite.
pub(super) fn write_hessian(scaled_map: &[Real], d: usize, hessian: &mut [Real]) -> bool {
    for i in 0..12 {
        for j in 0..=i {
            let mut sum: Real = if i == j { 1.0 } else { 0.0 };
            for k in 0..d {
                sum += scaled_map[12 * k + i] * scaled_map[12 * k + j];
            }
            hessian[12 * i + j] = sum;
        }
    }
    factorise(hessian, 12)
}

/// Rows on the torques become rows on `v`.
pub(super) fn change_rows(hessian: &[Real], deviation: &[Real], count: usize, rows: &mut [Real]) {
    let mut changed: [Real; 12] = [0.0; 12];
    for row in 0..count {
        by_deviation(&rows[12 * row..], deviation, &mut changed);
        solve_lower(hessian, 12, &mut changed);
        for j in 0..12 {
            rows[12 * row + j] = changed[j];
        }
    }
}
