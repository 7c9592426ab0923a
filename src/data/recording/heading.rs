//! Motions in the axes of their heading: equations of a linear encoder hold for a robot that looks along x.

use std::borrow::Cow;

use super::*;

const LARGEST_TURN_RAD: f64 = 0.25; // from the heading at the start of a piece
const LEAST_SWING_S: f64 = 0.06; // of a foot; shorter ones are chatter of its contact
const LEAST_PIECE: usize = 50; // samples, as a training needs them

impl Segment {
    /// The motion, cut where it has turned by 0.25 rad, in pieces of 50 samples or more. Each piece is turned about the
    /// vertical through the world's origin, so that it begins with yaw 0. A motion that never leaves +-0.25 rad stays
    /// unchanged.
    pub fn by_heading(&self) -> Vec<Cow<'_, Segment>> {
        let yaw = self.x.row(YAW);
        if yaw.iter().all(|yaw| yaw.abs() <= LARGEST_TURN_RAD) {
            return vec![Cow::Borrowed(self)];
        }
        let mut starts = vec![0];
        for sample in 1..self.len() {
            let first = starts[starts.len() - 1];
            let turns = (yaw[sample] - yaw[first]).abs() > LARGEST_TURN_RAD;
            let shortest = (sample - first).min(self.len() - sample);
            if turns && shortest >= LEAST_PIECE {
                starts.push(sample);
            }
        }
        let ends = starts.iter().skip(1).copied().chain([self.len()]);
        let pieces = starts.iter().copied().zip(ends);
        pieces
            .map(|(start, end)| Cow::Owned(self.slice(start..end).in_its_heading()))
            .collect()
    }

    /// The motion in the axes of its heading at the start.
    pub fn in_its_heading(&self) -> Segment {
        self.turned(-self.x[(YAW, 0)])
    }

    /// The motion turned about the vertical through the world's origin, by an angle in rad.
    fn turned(&self, angle_rad: f64) -> Segment {
        let mut turned = self.clone();
        for rows in [&mut turned.x, &mut turned.dx, &mut turned.ddx] {
            for mut column in rows.column_iter_mut() {
                let place = about_vertical([column[BODY_X], column[BODY_X + 1]], angle_rad);
                [column[BODY_X], column[BODY_X + 1]] = place;
            }
        }
        turned.x.row_mut(YAW).add_scalar_mut(angle_rad);
        turned
    }
}

/// Two numbers along x and y, turned about the vertical by an angle in rad.
pub fn about_vertical([x, y]: [f64; 2], angle_rad: f64) -> [f64; 2] {
    let (sine, cosine) = angle_rad.sin_cos();
    [cosine * x - sine * y, sine * x + cosine * y]
}

/// Mean time from one touchdown of a foot to its next, in s; none unless feet touch down three times each in a motion,
/// on average.
pub fn stride_s<'a>(motions: impl Iterator<Item = &'a Segment>) -> Option<f64> {
    let (mut total_s, mut strides, mut feet) = (0.0, 0, 0);
    for segment in motions {
        for foot in 0..FOOT_DIM {
            feet += 1;
            let (mut lifted_s, mut touches) = (f64::INFINITY, Vec::new());
            for sample in 1..segment.len() {
                let [before, now] = [sample - 1, sample].map(|sample| segment.feet[sample][foot]);
                let now_s = segment.time_s[sample];
                match (before, now) {
                    (true, false) => lifted_s = now_s,
                    (false, true) if now_s - lifted_s >= LEAST_SWING_S => touches.push(now_s),
                    _ => {}
                }
            }
            if let [first, .., last] = touches[..] {
                total_s += last - first;
                strides += touches.len() - 1;
            }
        }
    }
    (strides >= 2 * feet && feet > 0).then(|| total_s / strides as f64)
}
