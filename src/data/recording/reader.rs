//! From files to recordings: by romc's own names or a map of columns, with clocks as stamped or repaired. romc's own
//! text has `;` or tabs with decimal comma or point, or `,` with decimal point; the header decides. Columns are
//! identified by name in any order, gzip by the first two bytes. Memory is bounded by the samples kept.

use std::sync::Arc;

use super::clock::timed;
use super::decimals::{broken_angle, restored};
use super::delays::{BODY_RATES, RateFault, faulty_rates, mend_place, replace_rates};
use super::foreign::guess::guess_of;
use super::foreign::{TextFormat, assemble, is_mcap, read_lines, read_mcap, read_texts};
use super::lines::Lines;
use super::*;

/// Treatment of clocks that disagree with the motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Clocks {
    /// Times, steps and angular rates stay as recorded
    #[default]
    Recorded,
    /// Times that disagree with the motion are rebuilt from it, uneven steps are resampled, and rates that contradict
    /// the angles become their slopes. Lost decimal points and a late body position are also repaired
    Repaired,
}

/// Reads files of one kind.
#[derive(Debug, Clone, Default)]
pub struct Reader {
    map: Option<Arc<ColumnMap>>,
    robot: Option<&'static Robot>,
    pub(super) clocks: Clocks,
    held: Arc<[Recording]>,
}

/// A recording and the changes made to it while reading.
#[derive(Debug, Clone)]
pub struct Reading {
    /// In SI units.
    pub recording: Recording,
    /// Quantities derived, resampled, turned or cut, in words.
    pub notes: Vec<String>,
    /// The repairs, segment by segment; empty with [`Clocks::Recorded`].
    pub mended: Vec<Mended>,
}

impl Reader {
    /// A reader by a map of columns, or romc's own names, with this treatment of clocks.
    pub fn new(map: Option<ColumnMap>, clocks: Clocks) -> Self {
        Self {
            map: map.map(Arc::new),
            robot: None,
            clocks,
            held: Arc::default(),
        }
    }

    /// A reader that uses these recordings, unchanged, instead of files at their paths.
    pub fn with_held(self, held: Arc<[Recording]>) -> Self {
        Self { held, ..self }
    }

    /// The reader for recordings of a robot, whose joint names it needs; the default is the Go1.
    pub fn for_robot(self, robot: &'static Robot) -> Self {
        let robot = Some(robot);
        Self { robot, ..self }
    }

    /// Reads a file, or with a map a folder of files that are one recording; errors name row and column or map's key.
    pub fn read(&self, path: &Path) -> Outcome<Reading> {
        if let Some(held) = self.held.iter().find(|held| held.path == path) {
            return Ok(Reading {
                recording: held.clone(),
                notes: Vec::new(),
                mended: Vec::new(),
            });
        }
        let mut reading = match &self.map {
            Some(map) if is_mcap(path) => assemble(path, &read_mcap(path)?, map)?,
            Some(map) => assemble(path, &read_texts(path, map)?, map)?,
            None if is_mcap(path) => {
                let go1 = || crate::robot_file::by_name("go1").expect("a known robot");
                by_guess(path, self.robot.unwrap_or_else(go1))?
            }
            None if path.is_dir() => {
                let expected = "a file, or `--columns` with a map that names the folder's files";
                return Err(unexpected("a folder", expected).of(path));
            }
            None => read_noted(path, Lines::open(path)?)?,
        };
        if self.clocks == Clocks::Repaired {
            self.repair(&mut reading)?;
        }
        Ok(reading)
    }

    fn repair(&self, reading: &mut Reading) -> Outcome<()> {
        restore_points(reading);
        let (mut faults, mut delays_ms) = (Vec::new(), Vec::new());
        for segment in &mut reading.recording.segments {
            let faulty = faulty_rates(segment);
            let mut groups: Vec<&str> = faulty.iter().map(|(name, _)| *name).collect();
            replace_rates(segment, &groups);
            let timed = timed(segment)?;
            *segment = timed.segment;
            groups.extend(timed.mended.rates_replaced.then_some(BODY_RATES));
            if timed.mended.elapsed_ratio.is_some() || timed.mended.rates_replaced {
                replace_rates(segment, &groups);
            }
            reading.mended.push(timed.mended);
            faults.extend(faulty);
            let delay_s = self.robot.and_then(|robot| mend_place(segment, robot));
            delays_ms.extend(delay_s.map(|delay_s| 1e3 * delay_s));
        }
        reading.notes.extend(rate_notes(&faults));
        if let Some((least, most)) = range(delays_ms.iter().copied()) {
            let range = RateFault::Late(most).words(least, most);
            reading.notes.push(format!(
                "the body's places {range}, compared with the joints: they are advanced, so that feet on the ground stay"
            ));
        }
        Ok(())
    }
}

fn range(numbers: impl Iterator<Item = f64> + Clone) -> Option<(f64, f64)> {
    Some((numbers.clone().reduce(f64::min)?, numbers.reduce(f64::max)?))
}

/// One note for each group of rates and each fault.
fn rate_notes(faults: &[(&'static str, RateFault)]) -> Vec<String> {
    let alike = |a: &(&str, RateFault), b: &(&str, RateFault)| {
        a.0 == b.0 && std::mem::discriminant(&a.1) == std::mem::discriminant(&b.1)
    };
    let is_first = |at: &usize| !faults[..*at].iter().any(|of| alike(of, &faults[*at]));
    let note = |at: usize| {
        let (name, fault) = faults[at];
        let numbers = faults.iter().filter(|of| alike(of, &faults[at]));
        let (least, most) = range(numbers.map(|of| of.1.number()))?;
        let words = fault.words(least, most);
        Some(format!(
            "{name} {words}: slopes of the angles over 30 ms replace them"
        ))
    };
    (0..faults.len())
        .filter(is_first)
        .filter_map(note)
        .collect()
}

/// Reads a recording, plain or gzip; errors name file, row and column.
pub fn read(path: &Path) -> Outcome<Recording> {
    read_noted(path, Lines::open(path)?).map(|reading| reading.recording)
}

/// [`read`] from memory; `name` stands for the file in messages. No bytes make it panic.
pub fn read_from_bytes(name: &str, bytes: &[u8]) -> Outcome<Recording> {
    let path = Path::new(name);
    read_noted(path, Lines::of(path, bytes, u64::MAX)?).map(|reading| reading.recording)
}

fn read_noted(path: &Path, lines: Lines<'_>) -> Outcome<Reading> {
    let (own, other) = (true, TextFormat::default());
    let log = read_lines(path, lines, &TextFormat { own, ..other })?;
    let columns = Column::arranged(path, &log.names())?;
    let time = columns.iter().position(|c| *c == Some(Column::Time));
    let time = time.expect("invariant: an arranged header has the time");
    let mut whole = Segment::still(path, log.columns[time].times());
    whole.first_row = log.first_row;
    let has_acceleration = columns.contains(&Some(Column::Acceleration(0)));
    let mut ignored_columns = Vec::new();
    for (column, channel) in columns.into_iter().zip(log.columns) {
        match column {
            Some(Column::Time) => {}
            Some(column) => whole.set(column, channel.values.into_iter()),
            None if channel.name.is_empty() => {}
            None => ignored_columns.push(channel.name),
        }
    }
    let recording = Recording {
        path: path.to_owned(),
        segments: divided(whole, has_acceleration)?,
        ignored_columns,
    };
    let derived = (!has_acceleration).then(|| DERIVED_DDX.to_owned());
    Ok(Reading {
        recording,
        notes: Vec::from_iter(derived),
        mended: Vec::new(),
    })
}

/// Restores the decimal points of numbers; segments that stay broken are left out if others remain.
fn restore_points(reading: &mut Reading) {
    let segments = std::mem::take(&mut reading.recording.segments);
    let (mut whole, mut broken) = (Vec::new(), Vec::new());
    let (mut largest, mut numbers, mut restored_count) = (0.0_f64, 0, 0);
    let mut steps_ms = Vec::new();
    for segment in segments {
        let Some(angle) = broken_angle(&segment) else {
            whole.push(segment);
            continue;
        };
        largest = largest.max(angle);
        match restored(&segment) {
            Some(of) => {
                numbers += of.numbers;
                restored_count += 1;
                steps_ms.extend(of.resampled.then(|| 1e3 * of.segment.mean_step_s()));
                whole.push(of.segment);
            }
            None => broken.push(segment),
        }
    }
    if restored_count > 0 {
        let mut words = format!(
            "decimal points are lost (a joint angle of {largest:.0} rad): {numbers} numbers of magnitude 1 or more are read \
             with the point where the motion goes on, in {restored_count} segments"
        );
        if let Some(step_ms) = steps_ms.iter().copied().reduce(f64::max) {
            let count = steps_ms.len();
            words += &format!(
                "; rows of {count} of them are a cubic spline through samples {step_ms:.0} ms apart, which replace them"
            );
        }
        reading.notes.push(words);
    }
    for segment in &broken {
        let row = segment.first_row;
        let fate = if whole.is_empty() {
            "stays as it is"
        } else {
            "is left out"
        };
        reading.notes.push(format!(
            "the segment from row {row} {fate}: joint angles beyond a full turn, and no decimal points mend them"
        ));
    }
    reading.recording.segments = if whole.is_empty() { broken } else { whole };
}

const TO_COMPLETE: &str =
    "; `romc inspect --guess LOG` writes a map for --columns, to be completed";

fn by_guess(path: &Path, robot: &Robot) -> Outcome<Reading> {
    let logs = read_mcap(path)?;
    let guess = guess_of(path, &logs, robot)?;
    if !guess.missing.is_empty() {
        let topics = logs.iter().map(|log| match &log.fault {
            None => format!("`{}` with {}", log.name, log.summary()),
            Some(fault) => format!("`{}` ({fault})", log.name),
        });
        let topics = topics.collect::<Vec<_>>().join("; ");
        let found = format!("no {} among {topics}", guess.missing.join(", "));
        let own = &robot.joint_names[0];
        let names = format!("joints named as fr.hx, FR_hip_joint, LF_HAA or {own}");
        let expected = format!("topics of the robot: {names}{TO_COMPLETE}");
        return Err(unexpected(found, expected).of(path));
    }
    if !guess.open.is_empty() {
        let expected = format!("one reading by names{TO_COMPLETE}");
        return Err(unexpected(guess.open.join("; "), expected).of(path));
    }
    let map = ColumnMap::parse(&format!("{}: the guessed map", path.display()), &guess.text)?;
    let mut reading = assemble(path, &logs, &map)?;
    let note = "topics are identified by their names (`romc inspect --guess` prints the map)";
    reading.notes.push(note.to_owned());
    reading.notes.extend(guess.notes);
    Ok(reading)
}

const REBUILT: &str = "times are rebuilt from the motion, which lasts {} s per recorded second";
const EVENED: &str = "uneven steps are resampled";
const REPLACED: &str = "angular rates, which disagree with the angles, are slopes of these";
/// Repairs of clocks, in words; `{}` is the range of [`Mended::elapsed_ratio`].
const REPAIRS: [(fn(&Mended) -> bool, &str); 3] = [
    (|m| m.elapsed_ratio.is_some(), REBUILT),
    (|m| m.elapsed_ratio.is_none() && m.resampled, EVENED),
    (|m| m.rates_replaced, REPLACED),
];

/// The changes made to several recordings while reading.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReadingNotes {
    recordings: usize,
    ratios: Vec<f64>,
    repaired: [usize; 3],
    others: Vec<(String, usize)>,
}

impl ReadingNotes {
    pub fn add(&mut self, reading: &Reading) {
        self.recordings += 1;
        for (count, (is_made, _)) in self.repaired.iter_mut().zip(REPAIRS) {
            *count += usize::from(reading.mended.iter().any(is_made));
        }
        (self.ratios).extend(reading.mended.iter().filter_map(|m| m.elapsed_ratio));
        for note in &reading.notes {
            match self.others.iter_mut().find(|(known, _)| known == note) {
                Some((_, count)) => *count += 1,
                None => self.others.push((note.clone(), 1)),
            }
        }
    }

    /// The notes as lines: one for clocks and rates, one for each other note.
    pub fn lines(&self) -> Vec<String> {
        let counted = |note: &str, count: usize| match self.recordings {
            1 => note.to_owned(),
            all => format!("{note} in {count} of {all} recordings"),
        };
        let end = |of: fn(f64, f64) -> f64| self.ratios.iter().copied().reduce(of).unwrap_or(1.0);
        let [least, most] = [end(f64::min), end(f64::max)].map(|ratio| format!("{ratio:.2}"));
        let range = match least == most {
            true => most,
            false => format!("{least} to {most}"),
        };
        let repairs = self.repaired.iter().zip(REPAIRS);
        let repairs = repairs.filter(|(count, _)| **count > 0);
        let words = repairs.map(|(n, (_, words))| counted(&words.replace("{}", &range), *n));
        let repairs = words.collect::<Vec<_>>().join("; ");
        let repairs = Some(repairs).filter(|repairs| !repairs.is_empty());
        let repairs = repairs.map(|repairs| repairs + " (--clock recorded: as recorded)");
        let others = (self.others.iter()).map(|(note, count)| counted(note, *count));
        repairs.into_iter().chain(others).collect()
    }
}

/// The quantity in a column, in SI units; indices follow the state, the wrench and the feet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Column {
    Time,
    Position(usize),
    Velocity(usize),
    Acceleration(usize),
    Torque(usize),
    Force(usize), // entry of the body wrench
    Foot(usize),
}

impl Column {
    /// Name in the header, such as `fr.hx Position` or `Body linear Velocity z`.
    pub fn name(self) -> String {
        match self {
            Column::Time => "Time".to_owned(),
            Column::Position(i) => coordinate(i, "Position"),
            Column::Velocity(i) => coordinate(i, "Velocity"),
            Column::Acceleration(i) => coordinate(i, "Acceleration"),
            Column::Torque(i) => format!("{} Torque", JOINT_NAMES[i]),
            Column::Force(i) => body(i, "Force"),
            Column::Foot(i) => format!("{} Foot", Leg::ALL[i]),
        }
    }

    /// The columns of a file, with or without accelerations and the body wrench, in the order of writing.
    pub fn all(accelerations: bool, force: bool) -> Vec<Column> {
        let mut out = vec![Column::Time];
        for i in 0..STATE_DIM {
            out.extend([Column::Position(i), Column::Velocity(i)]);
            out.extend(accelerations.then_some(Column::Acceleration(i)));
        }
        out.extend((0..JOINT_DIM).map(Column::Torque));
        out.extend((0..BODY_DIM).filter(|_| force).map(Column::Force));
        out.extend((0..FOOT_DIM).map(Column::Foot));
        out
    }

    /// The columns that the cells of a header name, none for unknown names; accelerations or forces may be absent.
    pub(super) fn arranged(path: &Path, names: &[String]) -> Outcome<Vec<Option<Column>>> {
        let known = Column::all(true, true).into_iter();
        let known: Vec<_> = (known.map(|column| (folded(&column.name()), column))).collect();
        let mut columns: Vec<Option<Column>> = Vec::with_capacity(names.len());
        for name in names {
            let name = folded(name);
            let column = known.iter().find(|(text, _)| *text == name).map(|k| k.1);
            if let Some(found) = column
                && let Some(first) = columns.iter().position(|c| *c == Some(found))
            {
                let (first, second) = (first + 1, columns.len() + 1);
                let fault = text(format!("occurs twice, as number {first} and {second}"));
                return Err(fault.in_cell(path, 1, &found.name()));
            }
            columns.push(column);
        }
        let has = |any: fn(&Column) -> bool| columns.iter().flatten().any(any);
        let acceleration = has(|column| matches!(column, Column::Acceleration(_)));
        let force = has(|column| matches!(column, Column::Force(_)));
        let expected = Column::all(acceleration, force).into_iter();
        let missing = expected.filter(|c| !columns.contains(&Some(*c)));
        let missing: Vec<String> = missing.map(Column::name).collect();
        let hint = match missing.len() {
            0 => return Ok(columns),
            1..30 => "",
            _ => {
                "; for a log of another program `romc inspect --guess LOG` writes a map for --columns"
            }
        };
        let (missing, found) = (listed(&missing, 8), listed(names, 3));
        let words = format!("missing {missing}; the header starts with {found}{hint}");
        Err(text(words).at(path, 1))
    }
}

fn coordinate(i: usize, quantity: &str) -> String {
    match i.checked_sub(JOINT_DIM) {
        None => format!("{} {quantity}", JOINT_NAMES[i]),
        Some(j) => body(j, quantity),
    }
}

fn body(i: usize, quantity: &str) -> String {
    let part = if i < 3 { "linear" } else { "angular" };
    format!("Body {part} {quantity} {}", ["x", "y", "z"][i % 3])
}

pub(super) fn folded(name: &str) -> String {
    let words: Vec<&str> = name.split_whitespace().collect();
    words.join(" ").to_lowercase()
}
