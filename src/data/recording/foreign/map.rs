//! The map of a log: which column is what, in which unit, sign and order; a TOML file.
//!
//! ```toml
//! [time]
//! column = "stamp"
//! unit = "ms"
//!
//! [joint.position]
//! columns = "{leg}_{joint}_joint/position"
//! unit = "deg"
//! ```
//!
//! `docs/logs.md` describes every key.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;

use super::elements::Quantity;
use crate::files::read_toml;
use crate::recording::error::{RecordingError, RecordingFault};

/// Most columns that a range stands for.
const MAX_COLUMNS: usize = 10_000;

/// A map as its file states it.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ColumnMap {
    pub(super) text: TextFormat,
    /// The clock of all tables that have none of their own.
    pub(super) time: TimeMap,
    pub(super) names: Names,
    joint: JointTables,
    body: BodyTables,
    feet: Option<Table>,
    /// The file that the map was read from, for messages.
    #[serde(skip)]
    pub(super) file: String,
}

/// How text files are laid out; what is absent is found from the file.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(in crate::recording) struct TextFormat {
    pub delimiter: Option<Delimiter>,
    /// Whether the first line has names.
    pub header: Option<bool>,
    /// Lines before the first that counts.
    pub skip: usize,
    /// Empty cells and NaN are samples that a quantity does not have, where topics share one table.
    pub blank: bool,
    /// First and last sample to keep, counted from 1.
    pub rows: Option<[usize; 2]>,
    /// romc's own columns: none is left to guess, and each cell that is read has a finite number.
    #[serde(skip)]
    pub own: bool,
}

/// Separator of cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(in crate::recording) enum Delimiter {
    Tab,
    /// Any number of blanks or tabs.
    Blank,
    Comma,
    Semicolon,
}

#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct TimeMap {
    /// Absent with `sample_time_s`.
    pub column: Option<Name>,
    /// [default: s]; dates and times of day are found by themselves.
    pub unit: Option<String>,
    /// Distance of samples without a clock.
    pub sample_time_s: Option<f64>,
    /// Even steps to bring the recording to.
    pub resample_s: Option<f64>,
    /// Largest distance between samples of a topic that is interpolated [default: 0.05].
    pub max_gap_s: Option<f64>,
}

/// Words that stand for `{leg}`, `{joint}`, `{axis}` in patterns of names, in romc's order.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Names {
    pub legs: [String; 4],
    pub joints: [String; 3],
    pub axes: [String; 3],
}

impl Default for Names {
    fn default() -> Self {
        Self {
            legs: ["fr", "fl", "rr", "rl"].map(str::to_owned),
            joints: ["hx", "hy", "kn"].map(str::to_owned),
            axes: ["x", "y", "z"].map(str::to_owned),
        }
    }
}

#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct JointTables {
    position: Option<Table>,
    velocity: Option<Table>,
    acceleration: Option<Table>,
    torque: Option<Table>,
}

#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct BodyTables {
    position: Option<Table>,
    orientation: Option<Table>,
    velocity: Option<Table>,
    angular_velocity: Option<Table>,
    acceleration: Option<Table>,
    angular_acceleration: Option<Table>,
}

/// Where one quantity stands: `value = sign x unit x raw + offset`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Table {
    /// Names, numbers from 1, ranges such as `"4..6"`, or one pattern.
    pub columns: Columns,
    /// The file or topic that they are in [default: the only one].
    #[serde(alias = "topic")]
    pub file: Option<String>,
    /// Column of a clock of their own.
    pub time: Option<Name>,
    pub time_unit: Option<String>,
    /// Added to the clock.
    #[serde(default)]
    pub time_offset_s: f64,
    /// [default: SI]
    pub unit: Option<String>,
    /// 1 or -1.
    pub sign: Option<Factors>,
    /// Added after sign and unit, in SI units.
    pub offset: Option<Factors>,
    /// What each column is [default: romc's order].
    pub order: Option<Words>,
    /// Axes of velocities [default: `world`]; of angular velocities [default: `angles`].
    pub frame: Option<Frame>,
    pub origin: Option<Origin>,
    /// Force from which a foot is on the ground, in the table's unit; absent for flags.
    pub threshold: Option<f64>,
    /// Force below which it is in the air again [default: the threshold].
    pub release: Option<f64>,
}

/// A column: its name, or its number from 1.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(untagged)]
pub(super) enum Name {
    Number(usize),
    Text(String),
}

#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(untagged)]
pub(super) enum Columns {
    /// One name, range or pattern.
    One(Name),
    Many(Vec<Name>),
}

/// Words, also in one text with blanks between them.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(untagged)]
pub(super) enum Words {
    One(String),
    Many(Vec<String>),
}

/// A number for all columns, for each in their order, or by the names of elements (`*.kn`).
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
pub(super) enum Factors {
    All(f64),
    Each(Vec<f64>),
    Named(BTreeMap<String, f64>),
}

/// Axes of a velocity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Frame {
    World,
    /// The trunk's own.
    Body,
    /// Rates of roll, pitch and yaw.
    Angles,
}

/// Where positions count from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Origin {
    /// The first sample, for x and y.
    Start,
    /// As logged.
    Log,
}

impl ColumnMap {
    /// Reads a map.
    ///
    /// # Errors
    /// [`RecordingFault::MapSyntax`] with line, key and what was expected; [`RecordingFault::Unexpected`] for
    /// a key that does not apply to its table.
    pub fn read(path: &Path) -> Result<Self, RecordingError> {
        let text = read_toml(path)
            .map_err(|source| RecordingFault::unreadable("read", source).of(path))?;
        Self::parse(&path.display().to_string(), &text)
    }

    /// [`Self::read`] of a text; `file` stands for the file in messages.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn parse(file: &str, text: &str) -> Result<Self, RecordingError> {
        let mut map: Self = toml::from_str(text).map_err(|error| {
            let message = error.to_string().trim_end().to_owned();
            RecordingFault::MapSyntax(message).of(Path::new(file))
        })?;
        map.file = file.to_owned();
        map.require_applicable()?;
        Ok(map)
    }

    /// Where a quantity stands.
    pub(super) fn table(&self, quantity: Quantity) -> Option<&Table> {
        let (joint, body) = (&self.joint, &self.body);
        match quantity {
            Quantity::JointPosition => &joint.position,
            Quantity::JointVelocity => &joint.velocity,
            Quantity::JointAcceleration => &joint.acceleration,
            Quantity::JointTorque => &joint.torque,
            Quantity::BodyPosition => &body.position,
            Quantity::Orientation => &body.orientation,
            Quantity::BodyVelocity => &body.velocity,
            Quantity::AngularVelocity => &body.angular_velocity,
            Quantity::BodyAcceleration => &body.acceleration,
            Quantity::AngularAcceleration => &body.angular_acceleration,
            Quantity::Feet => &self.feet,
        }
        .as_ref()
    }

    /// The files or topics that the map names, each once, in its order.
    pub fn files(&self) -> Vec<&str> {
        let mut out: Vec<&str> = Vec::new();
        let tables = Quantity::ALL.iter().filter_map(|q| self.table(*q));
        for file in tables.filter_map(|table| table.file.as_deref()) {
            if !out.contains(&file) {
                out.push(file);
            }
        }
        out
    }

    /// The fault of a key.
    pub(super) fn fault(
        &self,
        key: &str,
        found: impl Into<String>,
        expected: impl Into<String>,
    ) -> RecordingError {
        let place = crate::files::Place::Entry(format!("`{key}`").into());
        RecordingError::new(
            &self.file,
            place,
            RecordingFault::unexpected(found, expected),
        )
    }
}

impl Table {
    /// Its columns as the file has them.
    pub(super) fn entries(&self) -> &[Name] {
        match &self.columns {
            Columns::One(name) => std::slice::from_ref(name),
            Columns::Many(names) => names,
        }
    }

    /// Its columns, patterns and ranges written out.
    pub(super) fn columns(&self, names: &Names, quantity: Quantity) -> Vec<Name> {
        let mut out = Vec::new();
        for entry in self.entries() {
            match entry {
                Name::Number(number) => out.push(Name::Number(*number)),
                Name::Text(text) => match range(text) {
                    Some(numbers) => out.extend(numbers.map(Name::Number)),
                    None => {
                        let texts = pattern(text, names, quantity);
                        out.extend(texts.into_iter().map(Name::Text));
                    }
                },
            }
        }
        out
    }
}

/// `4..6`, both ends included.
pub(super) fn range(text: &str) -> Option<std::ops::RangeInclusive<usize>> {
    let (first, last) = text.split_once("..")?;
    Some(first.trim().parse().ok()?..=last.trim().parse().ok()?)
}

/// The names that a pattern stands for: `{leg}` and `{joint}`, or `{axis}` for the words of `names`, or `{0}` or `{1}`
/// for numbers that count from 0 or 1; the name itself if it is no pattern.
fn pattern(text: &str, names: &Names, quantity: Quantity) -> Vec<String> {
    let numbers = |first: usize| {
        let count = quantity.elements().len();
        (first..first + count).map(|i| i.to_string()).collect()
    };
    let marks: [Vec<(&str, Vec<String>)>; 4] = [
        vec![
            ("{leg}", names.legs.to_vec()),
            ("{joint}", names.joints.to_vec()),
        ],
        vec![("{axis}", names.axes.to_vec())],
        vec![("{0}", numbers(0))],
        vec![("{1}", numbers(1))],
    ];
    let has = |(mark, _): &(&str, Vec<String>)| text.contains(mark);
    let used = marks.into_iter().find(|marks| marks.iter().any(has));
    let mut out = vec![text.to_owned()];
    for (mark, words) in used.into_iter().flatten().filter(has) {
        let filled = |text: &String| -> Vec<String> {
            words.iter().map(|word| text.replace(mark, word)).collect()
        };
        out = out.iter().flat_map(filled).collect();
    }
    out
}

/// What a map may not state, whatever the log.
impl ColumnMap {
    pub(super) fn require_applicable(&self) -> Result<(), RecordingError> {
        for quantity in Quantity::ALL {
            let Some(table) = self.table(quantity) else {
                if quantity.is_required() {
                    let expected = format!("the columns of {}", quantity.column(0).name());
                    return Err(self.fault(quantity.key(), "no such table", expected));
                }
                continue;
            };
            let refuse =
                |key: &str, expected: &str| Err(self.fault(&quantity.at(key), "a value", expected));
            let angular = quantity == Quantity::AngularVelocity;
            let velocity = quantity == Quantity::BodyVelocity;
            match table.frame {
                Some(_) if !angular && !velocity => {
                    return refuse("frame", "none: only velocities of the body have one");
                }
                Some(Frame::Angles) if !angular => return refuse("frame", "`world` or `body`"),
                Some(_) | None => {}
            }
            if table.origin.is_some() && quantity != Quantity::BodyPosition {
                return refuse("origin", "none: only `body.position` has one");
            }
            if table.release.is_some() && table.threshold.is_none() {
                return refuse("release", "a `threshold` beside it");
            }
            if table.threshold.is_some() && quantity != Quantity::Feet {
                return refuse("threshold", "none: only `feet` has one");
            }
            if table.release > table.threshold {
                return refuse("release", "at most the `threshold`");
            }
            self.require_finite(quantity, table)?;
            self.require_distinct(quantity, table)?;
        }
        let time = &self.time;
        if time.column.is_some() && time.sample_time_s.is_some() {
            let expected = "either a column or `sample_time_s`";
            return Err(self.fault("time.sample_time_s", "a column too", expected));
        }
        for (key, value) in [
            ("time.sample_time_s", time.sample_time_s),
            ("time.resample_s", time.resample_s),
            ("time.max_gap_s", time.max_gap_s),
        ] {
            if let Some(value) = value.filter(|value| !(value.is_finite() && *value > 0.0)) {
                return Err(self.fault(key, value.to_string(), "more than 0 s"));
            }
        }
        Ok(())
    }

    fn require_finite(&self, quantity: Quantity, table: &Table) -> Result<(), RecordingError> {
        let factors = |factors: &Option<Factors>| match factors {
            None => Vec::new(),
            Some(Factors::All(value)) => vec![*value],
            Some(Factors::Each(values)) => values.clone(),
            Some(Factors::Named(values)) => values.values().copied().collect(),
        };
        for (key, values) in [
            ("time_offset_s", vec![table.time_offset_s]),
            ("threshold", table.threshold.into_iter().collect()),
            ("release", table.release.into_iter().collect()),
            ("sign", factors(&table.sign)),
            ("offset", factors(&table.offset)),
        ] {
            if let Some(value) = values.into_iter().find(|value| !value.is_finite()) {
                let expected = "a finite number";
                return Err(self.fault(&quantity.at(key), value.to_string(), expected));
            }
        }
        Ok(())
    }

    /// No column of a table twice, and no range that no log could have.
    fn require_distinct(&self, quantity: Quantity, table: &Table) -> Result<(), RecordingError> {
        let refuse = |found: String, expected: &str| {
            Err(self.fault(&quantity.at("columns"), found, expected))
        };
        for entry in table.entries() {
            let Name::Text(text) = entry else { continue };
            if range(text).is_some_and(|all| all.end().saturating_sub(*all.start()) >= MAX_COLUMNS)
            {
                let expected = format!("at most {MAX_COLUMNS} columns");
                return refuse(format!("{text:?}"), &expected);
            }
        }
        let columns = table.columns(&self.names, quantity);
        let repeated = (1..columns.len()).find(|at| columns[..*at].contains(&columns[*at]));
        let name = match repeated.map(|at| &columns[at]) {
            None => return Ok(()),
            Some(Name::Text(name)) => format!("{name:?}"),
            Some(Name::Number(number)) => number.to_string(),
        };
        refuse(format!("{name} twice"), "each column once")
    }
}
