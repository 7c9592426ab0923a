//! Times of clocks that count from an epoch, kept to the nanosecond.

use super::lines::count;

/// A time as whole units and the rest, so that nanoseconds since 1970 lose nothing in differences.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Instant {
    pub whole: i64,
    pub rest: f64,
}

impl Instant {
    /// A time of a clock whose values need no care.
    pub(crate) fn of(value: f64) -> Option<Self> {
        let whole = value.floor();
        (whole.abs() < 9e18).then_some(Instant {
            whole: whole as i64,
            rest: value - whole,
        })
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
        if !is_digits(rest) {
            return None;
        }
        Some(Instant {
            whole: self::whole(whole)?,
            rest: format!("0.{rest}").parse().ok()?,
        })
    }

    /// A date and time as ISO 8601 writes it, in s since 1970: `2026-03-01T12:00:00.002Z`, with a blank for the `T` and
    /// `+01:00` for the `Z` if need be; or a time of day alone, `12:00:00.002`.
    pub(crate) fn from_iso(text: &str) -> Option<Self> {
        if count(text, ':') == 0 {
            return None;
        }
        let (date, time) = match text.split_once(['T', 't', ' ']) {
            Some((date, time)) => (Some(date), time.trim_start()),
            None => (None, text),
        };
        let days = date.map_or(Some(0), days_since_1970)?;
        let (clock, zone_s) = without_zone(time)?;
        let mut parts = clock.split(':');
        let (hour, minute) = (whole(parts.next()?)?, whole(parts.next()?)?);
        let second = Instant::from_decimal(&parts.next().unwrap_or("0").replace(',', "."))?;
        if parts.next().is_some() || hour > 24 || minute > 59 || second.whole > 60 {
            return None;
        }
        Some(Instant {
            whole: days * 86_400 + hour * 3600 + minute * 60 + second.whole - zone_s,
            rest: second.rest,
        })
    }
}

fn without_zone(time: &str) -> Option<(&str, i64)> {
    if let Some(clock) = time.strip_suffix(['Z', 'z']) {
        return Some((clock, 0));
    }
    let Some(place) = time.rfind(['+', '-']) else {
        return Some((time, 0));
    };
    let (clock, zone) = time.split_at(place);
    let sign = if zone.starts_with('-') { -1 } else { 1 };
    let digits: String = zone[1..].chars().filter(|c| *c != ':').collect();
    let (hours, minutes) = match digits.len() {
        2 => (whole(&digits)?, 0),
        4 => (whole(&digits[..2])?, whole(&digits[2..])?),
        _ => return None,
    };
    Some((clock, sign * (hours * 3600 + minutes * 60)))
}

fn is_digits(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit())
}

fn whole(text: &str) -> Option<i64> {
    text.parse().ok().filter(|_| is_digits(text))
}

/// Days from 1970-01-01 to a date of the Gregorian calendar, `2026-03-01`.
fn days_since_1970(date: &str) -> Option<i64> {
    let mut parts = date.trim().split(['-', '/']);
    let mut next = || whole(parts.next()?);
    let (year, month, day) = (next()?, next()?, next()?);
    let valid = (1..=12).contains(&month) && (1..=31).contains(&day) && year < 10_000;
    if parts.next().is_some() || !valid {
        return None;
    }
    // Years that begin in March end with the leap day.
    let (year, month) = match month > 2 {
        true => (year, month - 3),
        false => (year - 1, month + 9),
    };
    let leap_days = year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400);
    let day_of_year = (153 * month + 2) / 5 + day - 1;
    Some(365 * year + leap_days + day_of_year - 719_468)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn iso(text: &str) -> f64 {
        Instant::from_iso(text).expect(text).value()
    }

    #[test]
    fn from_iso_dates_of_every_kind_are_seconds_since_1970() {
        assert_eq!(iso("1970-01-01T00:00:00Z"), 0.0);
        assert_eq!(iso("2000-02-29T12:00:00"), 951_825_600.0);
        assert_eq!(iso("2024-03-01 00:00:01,5"), 1_709_251_201.5);
        assert_eq!(iso("2024-03-01T02:00:00+02:00"), 1_709_251_200.0);
        assert_eq!(iso("2024-02-29T22:30:00-0130"), 1_709_251_200.0);
        assert_eq!(iso("00:01:02.25"), 62.25);
        for text in "12|2024-13-01T00:00:00|2024-01-01T|a:b|1:2:3:4|1:2:3+x".split('|') {
            assert_eq!(Instant::from_iso(text), None, "{text}");
        }
    }

    #[test]
    fn since_keeps_nanoseconds_of_an_epoch() {
        let at = |text| Instant::from_decimal(text).unwrap();
        let start = at("1700000000123456789");
        assert_eq!(at("1700000000125456790").since(start), 2_000_001.0);
        let start = at("1700000000.123456789");
        assert!((at("1700000000.125456790").since(start) - 0.002_000_001).abs() < 1e-15);
        assert_eq!(Instant::from_decimal("-1"), None);
        let (whole, rest) = (-1, 0.75);
        assert_eq!(Instant::of(-0.25), Some(Instant { whole, rest }));
    }
}
