//! Quantities of a log, each with its clock, to the segments of a recording.

use super::map::Origin;
use super::signal::{Signal, Source};
use super::*;
use crate::recording::preprocess::{differences_within, place};
use crate::recording::segment::{DERIVED_DDX, EPOCH_S, divided, ranges};
use crate::robot::FOOT_DIM;

const MAX_GAP_S: f64 = 0.05; // largest distance between samples of a topic that is interpolated, in s
const QUATERNION_TOLERANCE: f64 = 0.05; // how far the length of a quaternion may be from one
const MAX_RESAMPLED: usize = 10_000_000; // most samples of a recording that is resampled

pub(crate) fn assemble(path: &Path, logs: &[Log], map: &ColumnMap) -> Outcome<Reading> {
    let (mut signals, mut notes, mut epoch_s) = (BTreeMap::new(), Vec::new(), None);
    for quantity in Quantity::ALL {
        let Some(source) = Source::find(logs, map, quantity)? else {
            continue;
        };
        if quantity == Quantity::JointPosition {
            epoch_s = source.epoch_s()?;
        }
        for note in &source.log.notes {
            if !notes.contains(note) {
                notes.push(note.clone());
            }
        }
        signals.insert(quantity, source.take(epoch_s.unwrap_or(0))?);
    }
    let base: &Signal = &signals[&Quantity::JointPosition];
    let mut rows = Assembly {
        path,
        logs,
        map,
        first_row: base.first_row,
        times_s: base.times_s.clone(),
        ranges: Vec::new(),
        signals,
        notes,
    };
    rows.angles()?;
    rows.contacts()?;
    rows.one_clock()?;
    if epoch_s.is_some_and(|epoch| epoch as f64 >= EPOCH_S) {
        let start = rows.times_s[0];
        rows.times_s.iter_mut().for_each(|time| *time -= start);
        (rows.notes).push("times count from the first sample".to_owned());
    }
    rows.to_world()?;
    for (velocity, of) in [
        (Quantity::JointVelocity, Quantity::JointPosition),
        (Quantity::BodyVelocity, Quantity::BodyPosition),
        (Quantity::AngularVelocity, Quantity::Orientation),
    ] {
        if rows.derive(velocity, of) {
            let note = format!("{} are differences of {}", velocity.key(), of.key());
            rows.notes.push(note);
        }
    }
    rows.shift_origin();
    rows.recording()
}

struct Assembly<'a> {
    path: &'a Path,
    logs: &'a [Log],
    map: &'a ColumnMap,
    first_row: usize,
    times_s: Vec<f64>, // times of the recording: those of the joints' positions unless all are brought to others
    ranges: Vec<Range<usize>>,
    signals: BTreeMap<Quantity, Signal>,
    notes: Vec<String>,
}

impl Assembly<'_> {
    fn required(&mut self, quantity: Quantity) -> &mut Signal {
        let signal = self.signals.get_mut(&quantity);
        signal.expect("a map has all required quantities")
    }

    fn frame(&self, quantity: Quantity) -> Option<Frame> {
        self.map.table(quantity).and_then(|table| table.frame)
    }

    /// Quaternions become angles, and angles do not jump by whole turns.
    fn angles(&mut self) -> Outcome<()> {
        let path = self.path;
        let signal = self.required(Quantity::Orientation);
        if signal.values.nrows() == QUATERNION.len() {
            for (sample, q) in signal.values.column_iter().enumerate() {
                let norm = q.norm();
                if norm.is_nan() || (1.0 - norm).abs() > QUATERNION_TOLERANCE {
                    let found = format!("a quaternion of length {norm:.3}");
                    let fault = RecordingFault::number(&found, "one of length 1");
                    return Err(fault.in_cell(path, signal.first_row + sample, "orientation"));
                }
            }
            signal.values = angles_of_quaternions(&signal.values);
        }
        if unwrap(&mut signal.values) {
            (self.notes).push("angles of the trunk run on past half a turn".to_owned());
        }
        Ok(())
    }

    /// Forces become contact: down from the threshold on, up below the release.
    fn contacts(&mut self) -> Outcome<()> {
        let (path, logs) = (self.path, self.logs);
        let table = self.map.table(Quantity::Feet).expect("a map has the feet");
        let signal = self.required(Quantity::Feet);
        let unit = |name: &String| Quantity::Feet.dimension().factor(name);
        let unit = table.unit.as_ref().and_then(unit).unwrap_or(1.0);
        for foot in 0..FOOT_DIM {
            let mut down = false;
            for sample in 0..signal.times_s.len() {
                let value = signal.values[(foot, sample)];
                down = match table.threshold {
                    Some(threshold) if !down => value >= unit * threshold,
                    Some(threshold) => value >= unit * table.release.unwrap_or(threshold),
                    None if value == 0.0 || value == 1.0 => value == 1.0,
                    None => {
                        let mut files = logs.iter();
                        let file = files.find(|log| Some(&log.name) == table.file.as_ref());
                        let path = file.map_or(path, |log| &log.path);
                        let (row, name) = (signal.first_row + sample, Column::Foot(foot).name());
                        return Err(RecordingFault::contact(value).in_cell(path, row, &name));
                    }
                };
                signal.values[(foot, sample)] = f64::from(u8::from(down));
            }
        }
        Ok(())
    }

    /// Brings quantities with clocks of their own to one, or all to even steps if the map asks for it.
    fn one_clock(&mut self) -> Outcome<()> {
        let mut signals = self.signals.values();
        let own_clocks = signals.any(|signal| signal.times_s != self.times_s);
        if own_clocks || self.map.time.resample_s.is_some() {
            self.times_s = self.common_times()?;
            self.resample()?;
            self.ranges.push(0..self.times_s.len());
            return Ok(());
        }
        self.ranges = ranges(&self.times_s)
            .map_err(|(at, fault)| fault.in_cell(self.path, self.first_row + at, "Time"))?;
        Ok(())
    }

    /// Times that every clock covers: those of the joints' positions, or even steps.
    fn common_times(&mut self) -> Outcome<Vec<f64>> {
        let time = &self.map.time;
        let max_gap_s = time.max_gap_s.unwrap_or(MAX_GAP_S);
        let (mut start, mut end) = (f64::NEG_INFINITY, f64::INFINITY);
        for (quantity, signal) in &self.signals {
            let times = &signal.times_s;
            for i in 1..times.len() {
                let step = times[i] - times[i - 1];
                let fault = match times[i] <= times[i - 1] {
                    true => RecordingFault::time(times[i], times[i - 1]),
                    false if step > max_gap_s => {
                        let expected = format!("at most {max_gap_s} s (`max_gap_s` in `[time]`)");
                        unexpected(format!("no sample for {step} s"), expected)
                    }
                    false => continue,
                };
                let (row, name) = (signal.first_row + i, quantity.column(0).name());
                return Err(fault.in_cell(self.path, row, &name));
            }
            start = start.max(times[0]);
            end = end.min(times[times.len() - 1]);
        }
        let base = &self.times_s;
        let margin = 1e-9 * (1.0 + end.abs());
        let within = |time: &f64| (start - margin..=end + margin).contains(time);
        let times: Vec<f64> = match time.resample_s {
            None => base.iter().copied().filter(within).collect(),
            Some(step) if end > start => {
                let steps = ((end - start + margin) / step).floor() as usize;
                if steps > MAX_RESAMPLED {
                    let found = format!("{step}, which makes {steps} samples");
                    let expected = format!("a step that makes at most {MAX_RESAMPLED}");
                    return Err(self.map.fault("time.resample_s", found, expected));
                }
                (0..=steps).map(|i| start + step * i as f64).collect()
            }
            Some(_) => Vec::new(),
        };
        if times.len() < 2 {
            let found = "clocks that do not overlap";
            return Err(unexpected(found, "topics of the same time").of(self.path));
        }
        self.notes.push(match time.resample_s {
            Some(step) => format!("all quantities are brought to even steps of {step} s"),
            None => format!(
                "topics with clocks of their own are brought to that of the joints ({} of its {} samples)",
                times.len(),
                base.len()
            ),
        });
        Ok(times)
    }

    fn resample(&mut self) -> Outcome<()> {
        let mut values = Vec::new();
        for (quantity, signal) in &self.signals {
            let own_s = &signal.times_s;
            if own_s.len() < 2 {
                let fault = RecordingFault::too_short(own_s.len(), 2);
                return Err(fault.at(self.path, signal.first_row));
            }
            let between = match quantity {
                Quantity::Feet => Between::Nearest,
                Quantity::JointTorque => Between::Straight,
                _ => Between::Smooth,
            };
            let rates = self.known_rates(*quantity);
            let slopes = (rates.filter(|rates| rates.times_s == *own_s)).map(|rates| &rates.values);
            values.push(at_times(signal, slopes, &self.times_s, between));
        }
        for (signal, values) in self.signals.values_mut().zip(values) {
            signal.values = values;
        }
        Ok(())
    }

    /// The derivatives of exactly this quantity's elements, if the log has them.
    fn known_rates(&self, quantity: Quantity) -> Option<&Signal> {
        let rate = match quantity {
            Quantity::JointPosition => Quantity::JointVelocity,
            Quantity::JointVelocity => Quantity::JointAcceleration,
            Quantity::BodyPosition => Quantity::BodyVelocity,
            Quantity::Orientation => Quantity::AngularVelocity,
            _ => return None,
        };
        let is_derivative = match (rate, self.frame(rate)) {
            (Quantity::BodyVelocity, frame) => frame != Some(Frame::Body),
            (_, frame) => matches!(frame, None | Some(Frame::Angles)),
        };
        self.signals.get(&rate).filter(|_| is_derivative)
    }

    /// Velocities about the body's own axes become the derivatives of position and angles.
    #[allow(clippy::wrong_self_convention)] // converts the fields in place
    fn to_world(&mut self) -> Outcome<()> {
        let angles = self.required(Quantity::Orientation).values.clone();
        let in_body = self.frame(Quantity::BodyVelocity) == Some(Frame::Body);
        let velocity = self.signals.get_mut(&Quantity::BodyVelocity);
        if let Some(signal) = velocity.filter(|_| in_body) {
            signal.values = in_world(&angles, &signal.values);
        }
        let frame = self.frame(Quantity::AngularVelocity);
        if let Some(signal) = self.signals.get_mut(&Quantity::AngularVelocity) {
            let turned = angle_rates(&angles, &signal.values, frame.unwrap_or(Frame::Angles));
            signal.values = turned.map_err(|sample| {
                let expected = "less where rates come from angular velocities";
                let fault = unexpected("a pitch of 90 degrees", expected);
                fault.at(self.path, self.first_row + sample)
            })?;
        }
        Ok(())
    }

    /// Computes a quantity missing in the log from differences of another; returns whether it was missing.
    fn derive(&mut self, quantity: Quantity, of: Quantity) -> bool {
        let is_absent = !self.signals.contains_key(&quantity);
        if is_absent {
            let signal = Signal {
                values: differences_within(&self.ranges, &self.times_s, &self.signals[&of].values),
                times_s: Vec::new(),
                first_row: self.first_row,
            };
            self.signals.insert(quantity, signal);
        }
        is_absent
    }

    /// Measures x and y from the first sample of each range, if the map requests it.
    fn shift_origin(&mut self) {
        let table = self.map.table(Quantity::BodyPosition);
        if table.and_then(|table| table.origin) != Some(Origin::Start) {
            return;
        }
        let ranges = self.ranges.clone();
        let values = &mut self.required(Quantity::BodyPosition).values;
        for range in ranges {
            let mut places = values.view_mut((0, range.start), (2, range.len()));
            let start = places.column(0).into_owned();
            for mut place in places.column_iter_mut() {
                place -= &start;
            }
        }
    }

    fn recording(mut self) -> Outcome<Reading> {
        let count = self.times_s.len();
        let [first, last] = self.map.text.rows.unwrap_or([1, count]);
        let kept = first.saturating_sub(1)..last.min(count);
        if self.map.text.rows.is_some() && (first == 0 || kept.start + 2 > kept.end) {
            let found = format!("{first} to {last}");
            let expected = format!("two or more of {count} samples");
            return Err(self.map.fault("text.rows", found, expected));
        }
        let is_known = |(own, _): &(Quantity, Quantity)| self.signals.contains_key(own);
        let has_acceleration = Quantity::ACCELERATIONS.iter().any(is_known);
        if has_acceleration {
            for (acceleration, velocity) in Quantity::ACCELERATIONS {
                self.derive(acceleration, velocity);
            }
        } else {
            (self.notes).push(DERIVED_DDX.to_owned());
        }
        let mut whole = Segment {
            first_row: self.first_row + kept.start,
            ..Segment::still(self.path, self.times_s[kept.clone()].to_vec())
        };
        for (quantity, signal) in &self.signals {
            for (element, row) in signal.values.row_iter().enumerate() {
                let values = row.iter().skip(kept.start).copied();
                whole.set(quantity.column(element), values);
            }
        }
        let recording = Recording {
            path: self.path.to_owned(),
            segments: divided(whole, has_acceleration)?,
            ignored_columns: Vec::new(),
        };
        Ok(Reading {
            recording,
            notes: self.notes,
            mended: Vec::new(),
        })
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Between {
    Smooth,   // cubic polynomials: motion
    Straight, // straight lines: torques, which may step
    Nearest,  // the nearest sample: contact
}

const SAME: f64 = 1e-6; // times within this share of a step are the same time

const STENCIL: usize = 5; // samples of a polynomial whose slope is that of its middle, or of its ends at a log's ends
const UNEVEN: f64 = 4.0; // longest over shortest step of a stencil: beyond, polynomials swing

/// Values at `times_s`, one column per time, of rows known at `own_s`, with these derivatives or [`slopes_of`] them.
fn at_times(own: &Signal, slopes: Option<&Rows>, times_s: &[f64], between: Between) -> Rows {
    let (own_s, values) = (&own.times_s, &own.values);
    let slopes = slopes.map_or_else(|| Cow::Owned(slopes_of(own_s, values)), Cow::Borrowed);
    let mut out = DMatrix::zeros(values.nrows(), times_s.len());
    for (column, &time) in times_s.iter().enumerate() {
        let (left, share) = place(own_s, time);
        let (step, share) = (own_s[left + 1] - own_s[left], share.clamp(0.0, 1.0));
        let (a, b) = (values.column(left), values.column(left + 1));
        let exact = match share {
            _ if share < SAME => Some(a),
            _ if share > 1.0 - SAME => Some(b),
            _ if between == Between::Nearest => Some(if share < 0.5 { a } else { b }),
            _ => None,
        };
        if let Some(exact) = exact {
            out.set_column(column, &exact);
            continue;
        }
        let line = a + (b - a) * share;
        if between == Between::Straight {
            out.set_column(column, &line);
            continue;
        }
        let rest = 1.0 - share;
        let bend = (slopes.column(left) * step - (b - a)) * (share * rest * rest)
            + ((b - a) - slopes.column(left + 1) * step) * (share * share * rest);
        out.set_column(column, &(line + bend));
    }
    out
}

fn slopes_of(own_s: &[f64], values: &DMatrix<f64>) -> DMatrix<f64> {
    let mut slopes = differences(own_s, values);
    let n = own_s.len();
    if n < STENCIL {
        return slopes;
    }
    for sample in 0..n {
        let first = sample.saturating_sub(STENCIL / 2).min(n - STENCIL);
        let times = &own_s[first..first + STENCIL];
        let steps = || times.windows(2).map(|pair| pair[1] - pair[0]);
        if steps().fold(0.0, f64::max) > UNEVEN * steps().fold(f64::INFINITY, f64::min) {
            continue;
        }
        let mut slope = slopes.column_mut(sample);
        slope.fill(0.0);
        for (k, weight) in slope_weights(times, sample - first).into_iter().enumerate() {
            slope.axpy(weight, &values.column(first + k), 1.0);
        }
    }
    slopes
}

/// Factors of the values at the times in the derivative of the polynomial through them, at one of the times.
fn slope_weights(times: &[f64], at: usize) -> [f64; STENCIL] {
    let others = |j: usize| (0..times.len()).filter(move |k| *k != j);
    std::array::from_fn(|j| {
        if j == at {
            return others(at).map(|k| 1.0 / (times[at] - times[k])).sum();
        }
        let above: f64 = ((others(at).filter(|k| *k != j)).map(|k| times[at] - times[k])).product();
        let below: f64 = others(j).map(|k| times[j] - times[k]).product();
        above / below
    })
}
