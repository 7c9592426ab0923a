//! Repair of segments whose time stamps disagree with their motion; and times since an epoch, exact to the nanosecond.
//! A logger that counts samples writes even time steps also where samples came late or were lost. Between two samples
//! the robot moved by velocity times elapsed time. If coordinates disagree on the elapsed time, the coordinates are
//! faulty.

use super::mismatch::falls_of;
use super::preprocess::resampled;
use super::*;

const LEAST_DISAGREEMENT: f64 = 0.03; // elapsed over stamped time from which a segment's clock is replaced
const JOINT_WEIGHT: f64 = 0.01; // weight of a joint's motion (rad/s)^2 relative to that of the body's position (m/s)^2
const STANDSTILL: f64 = 1e-3; // motion that counts as evidence of either clock, (m/s)^2
const AGREES: f64 = 0.25; // largest deviation of a coordinate's elapsed over stamped time from the median, relative
const COORDINATES: usize = JOINT_DIM + BODY_DIM / 2; // joints, body position: body angles are mended by themselves
const SAME_SAMPLE: f64 = 0.4; // samples closer than this share of a step are the same sample, logged again
const LOST_STEPS: f64 = 5.0; // steps between two samples from which the samples between them are lost rather than late
const RATE_DISAGREEMENT: f64 = 0.2; // of the trunk's angular rates with its angles, from which they are replaced
const EVEN: f64 = 0.01; // unevenness of time steps, relative, from which a segment is resampled

/// A segment at even time steps, and the repairs of its clock.
#[derive(Debug, Clone)]
pub(crate) struct Timed {
    /// At even steps.
    pub segment: Segment,
    pub mended: Mended,
    /// Samples that stand in for lost ones: straight lines across more than five steps.
    pub lost: Vec<bool>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mended {
    /// Where times were rebuilt, time that passed by the motion over time that passed by the stamps.
    pub elapsed_ratio: Option<f64>,
    /// Whether steps were uneven and the segment is resampled.
    pub resampled: bool,
    /// Whether the trunk's angular rates are differences of its angles, because those of the file disagree with them.
    pub rates_replaced: bool,
}

/// The segment at even time steps, with the repairs of [`Clocks::Repaired`](crate::recording::Clocks::Repaired).
///
/// # Errors
/// [`RecordingFault::Unexpected`](crate::recording::RecordingFault::Unexpected) if fewer than two samples remain.
pub(crate) fn timed(segment: &Segment) -> Outcome<Timed> {
    let (elapsed, elapsed_ratio) = elapsed(segment);
    let rebuilt = (elapsed_ratio - 1.0).abs() > LEAST_DISAGREEMENT
        && elapsed_ratio > 0.0
        && !falls_freely(segment, elapsed_ratio);
    let chosen = match rebuilt {
        true => by_motion(segment, &elapsed),
        false => segment.clone(),
    };
    let step_s = segment.mean_step_s();
    let even_s = chosen.mean_step_s();
    let mut steps = chosen.time_s.windows(2).map(|pair| pair[1] - pair[0]);
    let is_uneven = steps.any(|step| (step - even_s).abs() > EVEN * even_s);
    let rows = (chosen.duration_s() / step_s).round() as usize + 1;
    let mut segment = match is_uneven {
        false => chosen.clone(),
        true => resampled(&chosen, rows)?,
    };
    let lost = lost(&chosen.time_s, &segment.time_s, step_s);
    let rates_replaced = replace_angular_rates(&mut segment);
    if rebuilt || rates_replaced {
        segment.ddx = differences(&segment.time_s, &segment.dx);
    }
    Ok(Timed {
        segment,
        mended: Mended {
            elapsed_ratio: rebuilt.then_some(elapsed_ratio),
            resampled: is_uneven,
            rates_replaced,
        },
        lost,
    })
}

/// Whether the body falls more nearly as bodies do by the stamps than in the time that passed by the motion.
fn falls_freely(segment: &Segment, elapsed_ratio: f64) -> bool {
    let falls = falls_of(segment);
    if falls.is_empty() {
        return false;
    }
    let fall = median(falls.into_iter());
    let off = |fall: f64| (fall + GRAVITY_M_S2).abs();
    off(fall) < off(fall / elapsed_ratio.powi(2))
}

/// Intervals by the motion of coordinates that agree, and the time that passed by them over that by the stamps.
pub(crate) fn elapsed(segment: &Segment) -> (Vec<Interval>, f64) {
    let elapsed = Interval::all(segment, &agreeing_coordinates(segment));
    let ratio = ratio(&elapsed, 0.0).unwrap_or(1.0);
    (elapsed, ratio)
}

/// The coordinates that agree on how fast time passes; none if a third disagrees, or the joints with the body.
fn agreeing_coordinates(segment: &Segment) -> Vec<usize> {
    let least = STANDSTILL * segment.duration_s();
    let ratio = |row: usize| ratio(&Interval::all(segment, &[row]), least);
    let ratios: Vec<Option<f64>> = (0..COORDINATES).map(ratio).collect();
    let agrees = |ratio: f64, with: f64| (ratio - with).abs() <= AGREES * with.abs();
    let middle = |ratios: &[Option<f64>]| {
        let moving: Vec<f64> = ratios.iter().flatten().copied().collect();
        (!moving.is_empty()).then(|| median(moving.into_iter()))
    };
    let (joints, body) = ratios.split_at(JOINT_DIM);
    let median = match (middle(joints), middle(body)) {
        (None, None) => return (0..COORDINATES).collect(),
        (Some(joints), Some(body)) if !agrees(joints, body) => return Vec::new(),
        (Some(median), _) | (None, Some(median)) => median,
    };
    let moving = || ratios.iter().flatten();
    let count = moving().filter(|ratio| agrees(**ratio, median)).count();
    if 3 * count < 2 * moving().count() {
        return Vec::new();
    }
    let all = 0..COORDINATES;
    all.filter(|&row| ratios[row].is_none_or(|ratio| agrees(ratio, median)))
        .collect()
}

/// Time that passed by the motion over time that passed by the stamps, if by the stamps more moved than `least`.
fn ratio(intervals: &[Interval], least: f64) -> Option<f64> {
    let moved: f64 = intervals.iter().map(|i| i.moved).sum();
    let stamped: f64 = intervals.iter().map(|i| i.speed * i.stamped_s).sum();
    (stamped > least).then(|| moved / stamped)
}

fn lost(samples_s: &[f64], time_s: &[f64], step_s: f64) -> Vec<bool> {
    let mut right = 1;
    let of = |time: &f64| {
        while right + 1 < samples_s.len() && samples_s[right] < *time {
            right += 1;
        }
        right < samples_s.len() && samples_s[right] - samples_s[right - 1] > LOST_STEPS * step_s
    };
    time_s.iter().map(of).collect()
}

/// The samples at times computed from their motion, without those that were logged twice.
fn by_motion(segment: &Segment, elapsed: &[Interval]) -> Segment {
    let least_s = SAME_SAMPLE * segment.mean_step_s();
    let mut now = segment.time_s[0];
    let (mut time_s, mut kept) = (vec![now], vec![0]);
    for (interval, right) in elapsed.iter().zip(1..) {
        now += interval.elapsed_s();
        if now - time_s[time_s.len() - 1] > least_s {
            time_s.push(now);
            kept.push(right);
        }
    }
    let feet = kept.iter().map(|sample| segment.feet[*sample]).collect();
    let rows = segment.row(segment.len() - 1) - segment.row(0);
    Segment {
        row_stride: rows as f64 / kept.len().saturating_sub(1).max(1) as f64,
        ..segment.remade(time_s, feet, |m| m.select_columns(&kept))
    }
}

fn replace_angular_rates(segment: &mut Segment) -> bool {
    const FIRST: usize = JOINT_DIM + BODY_DIM / 2;
    let angles = segment.x.rows(FIRST, BODY_DIM / 2).into_owned();
    let rates = differences(&segment.time_s, &angles);
    let recorded = segment.dx.rows(FIRST, BODY_DIM / 2);
    let ratio = recorded.dot(&rates) / recorded.norm_squared();
    let disagree = (ratio - 1.0).abs() > RATE_DISAGREEMENT; // no motion is no disagreement
    if disagree {
        segment.dx.rows_mut(FIRST, BODY_DIM / 2).copy_from(&rates);
    }
    disagree
}

pub(crate) struct Interval {
    stamped_s: f64,
    speed: f64, // weighted square of the velocity
    moved: f64, // weighted product of velocity and displacement
}

impl Interval {
    fn all(segment: &Segment, coordinates: &[usize]) -> Vec<Self> {
        let of = |right: usize| {
            let (mut speed, mut moved) = (0.0, 0.0);
            for &row in coordinates {
                let weight = if row < JOINT_DIM { JOINT_WEIGHT } else { 1.0 };
                let velocity = (segment.dx[(row, right - 1)] + segment.dx[(row, right)]) / 2.0;
                let displacement = segment.x[(row, right)] - segment.x[(row, right - 1)];
                speed += weight * velocity * velocity;
                moved += weight * velocity * displacement;
            }
            let stamped_s = segment.time_s[right] - segment.time_s[right - 1];
            Self {
                stamped_s,
                speed,
                moved,
            }
        };
        (1..segment.len()).map(of).collect()
    }

    fn elapsed_s(&self) -> f64 {
        let time = (self.moved + STANDSTILL * self.stamped_s) / (self.speed + STANDSTILL);
        time.max(0.0)
    }
}

/// A time as whole units and the rest, so that nanoseconds since 1970 lose nothing in differences.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Instant {
    pub whole: i64,
    pub rest: f64,
}

impl Instant {
    pub(crate) fn of(value: f64) -> Option<Self> {
        let (whole, rest) = (value.floor() as i64, value - value.floor());
        (value.floor().abs() < 9e18).then_some(Instant { whole, rest })
    }

    pub(crate) fn since(self, start: Instant) -> f64 {
        (self.whole - start.whole) as f64 + (self.rest - start.rest)
    }

    pub(crate) fn value(self) -> f64 {
        self.whole as f64 + self.rest
    }

    /// A decimal number of any length, with a decimal point; `None` for other text.
    pub(crate) fn from_decimal(text: &str) -> Option<Self> {
        let (whole, rest) = text.split_once('.').unwrap_or((text, "0"));
        let is_fraction = !rest.is_empty() && rest.bytes().all(|b| b.is_ascii_digit());
        let fraction = || format!("0.{rest}").parse().ok();
        let (whole, rest) = (self::whole(whole)?, is_fraction.then(fraction)??);
        Some(Instant { whole, rest })
    }

    /// A date and time as ISO 8601 writes it, or a time of day alone, in s since 1970; also with blanks and commas.
    pub(crate) fn from_iso(text: &str) -> Option<Self> {
        if !text.contains(':') {
            return None;
        }
        let (days, time) = match text.split_once(['T', 't', ' ']) {
            Some((date, time)) => (days_since_1970(date)?, time.trim_start()),
            None => (0, text),
        };
        let (clock, zone_s) = without_zone(time)?;
        let mut parts = clock.split(':');
        let (hour, minute) = (whole(parts.next()?)?, whole(parts.next()?)?);
        let second = Instant::from_decimal(&parts.next().unwrap_or("0").replace(',', "."))?;
        if parts.next().is_some() || hour > 24 || minute > 59 || second.whole > 60 {
            return None;
        }
        let whole = days * 86_400 + hour * 3600 + minute * 60 + second.whole - zone_s;
        Some(Instant { whole, ..second })
    }
}

/// The time of day, and the offset of its zone from Greenwich, in s.
fn without_zone(time: &str) -> Option<(&str, i64)> {
    if let Some(clock) = time.strip_suffix(['Z', 'z']) {
        return Some((clock, 0));
    }
    let Some(place) = time.rfind(['+', '-']) else {
        return Some((time, 0));
    };
    let (clock, zone) = time.split_at(place);
    let digits = zone[1..].replace(':', "");
    let minutes = match (digits.len(), whole(&digits)?) {
        (2, hours) => hours * 60,
        (4, both) => both / 100 * 60 + both % 100,
        _ => return None,
    };
    let sign = if zone.starts_with('-') { -60 } else { 60 };
    Some((clock, sign * minutes))
}

fn whole(text: &str) -> Option<i64> {
    let is_number = text.bytes().all(|b| b.is_ascii_digit());
    text.parse().ok().filter(|_| is_number)
}

fn days_since_1970(date: &str) -> Option<i64> {
    let parts = date.trim().split(['-', '/']).map(whole);
    let [year, month, day] = parts.collect::<Option<Vec<_>>>()?[..] else {
        return None;
    };
    if !(1..=12).contains(&month) || !(1..=31).contains(&day) || year >= 10_000 {
        return None;
    }
    let year = year - i64::from(month < 3); // years that begin in March end with the leap day
    let leap_days = year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400);
    let day_of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    Some(365 * year + leap_days + day_of_year - 719_468)
}
