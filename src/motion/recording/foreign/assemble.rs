//! Quantities of a log, each with its clock, to the segments of a recording.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use nalgebra::DMatrix;

use super::attitude::{angle_rates, angles_of_quaternions, in_world, unwrap};
use super::elements::{QUATERNION, Quantity};
use super::interpolate::{Between, at_times};
use super::log::Log;
use super::map::{ColumnMap, Frame, Origin};
use super::signal::{Signal, Source};
use crate::recording::error::{RecordingError, RecordingFault};
use crate::recording::preprocess::differences;
use crate::recording::segment::Recording;
use crate::recording::segments::{DERIVED_DDX, EPOCH_S, Sample, SegmentBuilder, begins_segment};
use crate::robot::FOOT_DIM;

/// Largest distance between samples of a topic that is interpolated, in s.
const MAX_GAP_S: f64 = 0.05;
/// How far the length of a quaternion may be from one.
const QUATERNION_TOLERANCE: f64 = 0.05;
/// Most samples of a recording that is resampled.
const MAX_RESAMPLED: usize = 10_000_000;

/// A recording made of a log, and what was done besides copying.
#[derive(Debug, Clone)]
pub struct Assembled {
    /// The recording.
    pub recording: Recording,
    /// What was derived, resampled, turned or cut, in words.
    pub notes: Vec<String>,
}

/// Makes a recording of the logs as the map says.
///
/// # Errors
/// [`RecordingError`] with the map's key, or with file, row and column.
pub(in crate::recording) fn assemble(
    path: &Path,
    logs: &[Log],
    map: &ColumnMap,
) -> Result<Assembled, RecordingError> {
    let find = |quantity| Source::find(logs, map, quantity);
    let epoch_s = match find(Quantity::JointPosition)? {
        Some(source) => source.epoch_s()?,
        None => None,
    };
    let mut signals = Signals::default();
    for quantity in Quantity::ALL {
        if let Some(source) = find(quantity)? {
            let signal = source.take(epoch_s.unwrap_or(0))?;
            signals.all.insert(quantity, signal);
        }
    }
    let mut notes = Vec::new();
    signals.angles(path, &mut notes)?;
    signals.contacts(map, logs, path)?;
    let base = signals.base();
    let (mut times_s, first_row) = (base.times_s.clone(), base.first_row);
    let own_clocks = (signals.all.values()).any(|signal| signal.times_s != times_s);
    let ranges;
    if own_clocks || map.time.resample_s.is_some() {
        times_s = signals.common_times(path, map, &mut notes)?;
        signals.resample(path, map, &times_s)?;
        ranges = std::iter::once(0..times_s.len()).collect();
    } else {
        ranges = ranges_of(path, first_row, &times_s)?;
    }
    if epoch_s.is_some_and(|epoch| epoch as f64 >= EPOCH_S) {
        let start = times_s[0];
        times_s.iter_mut().for_each(|time| *time -= start);
        notes.push("times count from the first sample".to_owned());
    }
    let mut rows = Rows {
        path,
        first_row,
        times_s,
        ranges,
        signals,
        notes,
    };
    rows.to_world(map)?;
    rows.derive_velocities();
    rows.shift_origin(map);
    rows.recording(map, logs)
}

/// The quantities that the log has.
#[derive(Default)]
struct Signals {
    all: BTreeMap<Quantity, Signal>,
}

impl Signals {
    /// The quantity whose clock the recording has.
    fn base(&self) -> &Signal {
        (self.all.get(&Quantity::JointPosition)).expect("a map has the joints' positions")
    }

    /// Quaternions become angles, and angles do not jump by whole turns.
    ///
    /// # Errors
    /// [`RecordingFault::Number`] for a quaternion whose length is far from one.
    fn angles(&mut self, path: &Path, notes: &mut Vec<String>) -> Result<(), RecordingError> {
        let signal = self.all.get_mut(&Quantity::Orientation);
        let signal = signal.expect("a map has the orientation");
        if signal.values.nrows() == QUATERNION.len() {
            let norms = signal.values.column_iter().map(|q| q.norm());
            for (sample, norm) in norms.enumerate() {
                if norm.is_nan() || (1.0 - norm).abs() > QUATERNION_TOLERANCE {
                    let found = format!("a quaternion of length {norm:.3}");
                    let expected = "one of length 1";
                    let fault = RecordingFault::Number { found, expected };
                    return Err(fault.in_cell(path, signal.first_row + sample, "orientation"));
                }
            }
            signal.values = angles_of_quaternions(&signal.values);
        }
        if unwrap(&mut signal.values) {
            notes.push("angles of the trunk run on past half a turn".to_owned());
        }
        Ok(())
    }

    /// Forces become contact: down from the threshold on, up below the release.
    fn contacts(
        &mut self,
        map: &ColumnMap,
        logs: &[Log],
        path: &Path,
    ) -> Result<(), RecordingError> {
        let table = map.table(Quantity::Feet).expect("a map has the feet");
        let signal = self.all.get_mut(&Quantity::Feet);
        let signal = signal.expect("a map has the feet");
        let unit = table.unit.as_ref();
        let unit = unit.and_then(|unit| Quantity::Feet.dimension().factor(unit));
        let unit = unit.unwrap_or(1.0);
        for foot in 0..FOOT_DIM {
            let mut down = false;
            for sample in 0..signal.times_s.len() {
                let value = signal.values[(foot, sample)];
                down = match table.threshold {
                    Some(threshold) => {
                        let release = table.release.unwrap_or(threshold);
                        value >= unit * if down { release } else { threshold }
                    }
                    None if value == 0.0 || value == 1.0 => value == 1.0,
                    None => {
                        let file = logs
                            .iter()
                            .find(|log| Some(&log.name) == table.file.as_ref());
                        let path = file.map_or(path, |log| &log.path);
                        let row = signal.first_row + sample;
                        let name = Quantity::Feet.column(foot).name();
                        return Err(RecordingFault::Contact(value).in_cell(path, row, &name));
                    }
                };
                signal.values[(foot, sample)] = f64::from(u8::from(down));
            }
        }
        Ok(())
    }

    /// Times that every clock covers: those of the joints' positions, or even steps.
    fn common_times(
        &self,
        path: &Path,
        map: &ColumnMap,
        notes: &mut Vec<String>,
    ) -> Result<Vec<f64>, RecordingError> {
        let max_gap_s = map.time.max_gap_s.unwrap_or(MAX_GAP_S);
        let (mut start, mut end) = (f64::NEG_INFINITY, f64::INFINITY);
        for (quantity, signal) in &self.all {
            let times = &signal.times_s;
            let name = quantity.column(0).name();
            for i in 1..times.len() {
                let (found, previous) = (times[i], times[i - 1]);
                let row = signal.first_row + i;
                if found <= previous {
                    return Err(RecordingFault::Time { found, previous }.in_cell(path, row, &name));
                }
                if found - previous > max_gap_s {
                    let fault = RecordingFault::Gap {
                        found: found - previous,
                        expected: max_gap_s,
                    };
                    return Err(fault.in_cell(path, row, &name));
                }
            }
            start = start.max(times[0]);
            end = end.min(times[times.len() - 1]);
        }
        let base = &self.base().times_s;
        let margin = 1e-9 * (1.0 + end.abs());
        let within = |time: &f64| (start - margin..=end + margin).contains(time);
        let times: Vec<f64> = match map.time.resample_s {
            None => base.iter().copied().filter(within).collect(),
            Some(step) if end > start => {
                let steps = ((end - start + margin) / step).floor() as usize;
                if steps > MAX_RESAMPLED {
                    let found = format!("{step}, which makes {steps} samples");
                    let expected = format!("a step that makes at most {MAX_RESAMPLED}");
                    return Err(map.fault("time.resample_s", found, expected));
                }
                (0..=steps).map(|i| start + step * i as f64).collect()
            }
            Some(_) => Vec::new(),
        };
        if times.len() < 2 {
            return Err(RecordingFault::NoOverlap.of(path));
        }
        notes.push(match map.time.resample_s {
            Some(step) => format!("all quantities are brought to even steps of {step} s"),
            None => format!(
                "topics with clocks of their own are brought to that of the joints ({} of its {} samples)",
                times.len(),
                base.len()
            ),
        });
        Ok(times)
    }

    /// Brings every quantity to these times.
    fn resample(
        &mut self,
        path: &Path,
        map: &ColumnMap,
        times_s: &[f64],
    ) -> Result<(), RecordingError> {
        let old = Signals {
            all: self.all.clone(),
        };
        for (quantity, signal) in &mut self.all {
            if signal.times_s.len() < 2 {
                let (found, expected) = (signal.times_s.len(), 2);
                let fault = RecordingFault::TooShort { found, expected };
                return Err(fault.at(path, signal.first_row));
            }
            let between = match quantity {
                Quantity::Feet => Between::Nearest,
                Quantity::JointTorque => Between::Straight,
                _ => Between::Smooth,
            };
            let rates = old
                .known_rates(*quantity, map)
                .filter(|rates| rates.times_s == signal.times_s);
            signal.values = at_times(
                &signal.times_s,
                &signal.values,
                rates.map(|rates| &rates.values),
                times_s,
                between,
            );
            signal.times_s = times_s.to_vec();
        }
        Ok(())
    }

    /// The derivatives of a quantity's very elements, if the log has them.
    fn known_rates(&self, quantity: Quantity, map: &ColumnMap) -> Option<&Signal> {
        let frame = |quantity| map.table(quantity).and_then(|table| table.frame);
        let rate = match quantity {
            Quantity::JointPosition => Quantity::JointVelocity,
            Quantity::JointVelocity => Quantity::JointAcceleration,
            Quantity::BodyPosition if frame(Quantity::BodyVelocity) != Some(Frame::Body) => {
                Quantity::BodyVelocity
            }
            Quantity::Orientation
                if matches!(frame(Quantity::AngularVelocity), None | Some(Frame::Angles)) =>
            {
                Quantity::AngularVelocity
            }
            _ => return None,
        };
        self.all.get(&rate)
    }
}

/// All quantities at the times of the recording.
struct Rows<'a> {
    path: &'a Path,
    first_row: usize,
    times_s: Vec<f64>,
    ranges: Vec<Range<usize>>,
    signals: Signals,
    notes: Vec<String>,
}

impl Rows<'_> {
    fn values(&self, quantity: Quantity) -> Option<&DMatrix<f64>> {
        self.signals.all.get(&quantity).map(|signal| &signal.values)
    }

    /// Velocities about the body's own axes become the derivatives of position and angles.
    #[allow(clippy::wrong_self_convention)] // turns what it holds
    fn to_world(&mut self, map: &ColumnMap) -> Result<(), RecordingError> {
        let angles = self.values(Quantity::Orientation);
        let angles = angles.expect("a map has the orientation").clone();
        let frame = |quantity| map.table(quantity).and_then(|table| table.frame);
        if frame(Quantity::BodyVelocity) == Some(Frame::Body)
            && let Some(signal) = self.signals.all.get_mut(&Quantity::BodyVelocity)
        {
            signal.values = in_world(&angles, &signal.values);
        }
        let frame = frame(Quantity::AngularVelocity).unwrap_or(Frame::Angles);
        if let Some(signal) = self.signals.all.get_mut(&Quantity::AngularVelocity) {
            let turned = angle_rates(&angles, &signal.values, frame);
            signal.values = turned.map_err(|sample| {
                let row = self.first_row + sample;
                RecordingFault::Upright.at(self.path, row)
            })?;
        }
        Ok(())
    }

    /// Velocities that the log does not have are differences of positions.
    fn derive_velocities(&mut self) {
        for (velocity, of) in [
            (Quantity::JointVelocity, Quantity::JointPosition),
            (Quantity::BodyVelocity, Quantity::BodyPosition),
            (Quantity::AngularVelocity, Quantity::Orientation),
        ] {
            if self.derive(velocity, of) {
                let (velocity, of) = (velocity.key(), of.key());
                self.notes
                    .push(format!("{velocity} are differences of {of}"));
            }
        }
    }

    /// Makes a quantity that the log does not have of differences of another; whether it had to be made.
    fn derive(&mut self, quantity: Quantity, of: Quantity) -> bool {
        let is_absent = self.values(quantity).is_none();
        if is_absent {
            let signal = Signal {
                values: self.differences(of),
                times_s: Vec::new(),
                first_row: self.first_row,
            };
            self.signals.all.insert(quantity, signal);
        }
        is_absent
    }

    /// Slopes of a quantity within each range.
    fn differences(&self, of: Quantity) -> DMatrix<f64> {
        let values = self.values(of).expect("invariant: a required quantity");
        let mut out = DMatrix::zeros(values.nrows(), values.ncols());
        for range in &self.ranges {
            let own = values.columns(range.start, range.len()).into_owned();
            let slopes = differences(&self.times_s[range.clone()], &own);
            out.columns_mut(range.start, range.len()).copy_from(&slopes);
        }
        out
    }

    /// Lets x and y count from the first sample of each range, where the map asks for it.
    fn shift_origin(&mut self, map: &ColumnMap) {
        let table = map.table(Quantity::BodyPosition);
        if table.and_then(|table| table.origin) != Some(Origin::Start) {
            return;
        }
        let signal = self.signals.all.get_mut(&Quantity::BodyPosition);
        let values = &mut signal.expect("a map has the body's position").values;
        for range in &self.ranges {
            for axis in 0..2 {
                let start = values[(axis, range.start)];
                let mut row = values.row_mut(axis);
                range.clone().for_each(|i| row[i] -= start);
            }
        }
    }

    /// The segments.
    fn recording(mut self, map: &ColumnMap, logs: &[Log]) -> Result<Assembled, RecordingError> {
        let kept = match map.text.rows {
            None => 0..self.times_s.len(),
            Some([first, last]) => {
                let end = last.min(self.times_s.len());
                let start = first.saturating_sub(1);
                if first == 0 || start + 2 > end {
                    let found = format!("{first} to {last}");
                    let expected = format!("two or more of {} samples", self.times_s.len());
                    return Err(map.fault("text.rows", found, expected));
                }
                start..end
            }
        };
        let accelerations = [
            (Quantity::JointAcceleration, Quantity::JointVelocity),
            (Quantity::BodyAcceleration, Quantity::BodyVelocity),
            (Quantity::AngularAcceleration, Quantity::AngularVelocity),
        ];
        let has_acceleration = (accelerations.iter()).any(|(own, _)| self.values(*own).is_some());
        if has_acceleration {
            for (acceleration, velocity) in accelerations {
                self.derive(acceleration, velocity);
            }
        } else {
            (self.notes).push(DERIVED_DDX.to_owned());
        }
        let mut builder = SegmentBuilder::new(self.path, has_acceleration, false);
        for i in kept {
            let mut sample = Sample {
                time_s: self.times_s[i],
                ..Sample::default()
            };
            for (quantity, signal) in &self.signals.all {
                for (element, value) in signal.values.column(i).iter().enumerate() {
                    sample.set(quantity.column(element), *value);
                }
            }
            builder.push(self.first_row + i, &sample)?;
        }
        let columns = logs.iter().map(|log| log.columns.len()).sum();
        Ok(Assembled {
            recording: Recording {
                path: self.path.to_owned(),
                segments: builder.finish(columns)?,
                ignored_columns: Vec::new(),
            },
            notes: self.notes,
        })
    }
}

/// Stretches of increasing time.
fn ranges_of(
    path: &Path,
    first_row: usize,
    times_s: &[f64],
) -> Result<Vec<Range<usize>>, RecordingError> {
    let mut ranges = Vec::new();
    let mut start = 0;
    for i in 1..times_s.len() {
        if begins_segment(&times_s[start..i], times_s[i])
            .map_err(|fault| fault.in_cell(path, first_row + i, "Time"))?
        {
            ranges.push(start..i);
            start = i;
        }
    }
    ranges.push(start..times_s.len());
    Ok(ranges)
}
