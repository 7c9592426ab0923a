//! The map of a log: the columns of each quantity with unit, sign and order; a TOML file, described by `docs/reference/column-maps.md`.
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

use super::*;
use crate::files::size::read_toml;

const MOST: usize = 10_000; // most columns that a range stands for

/// A map as its file states it.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ColumnMap {
    pub(super) text: TextFormat,
    pub(super) time: TimeMap, // the clock of all tables that have none of their own
    pub(super) names: Names,
    joint: BTreeMap<String, Table>,
    body: BTreeMap<String, Table>,
    feet: Option<Table>,
    #[serde(skip)]
    pub(super) file: String, // that the map was read from, for messages
}

/// The layout of text files; absent entries are determined from the file.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct TextFormat {
    pub delimiter: Option<Delimiter>,
    pub header: Option<bool>,
    pub skip: usize,
    pub blank: bool, // empty cells and NaN are samples that a quantity does not have, where topics share one table
    pub rows: Option<[usize; 2]>, // first and last sample to keep, counted from 1
    #[serde(skip)]
    pub own: bool, // romc's own columns: none is left to guess, and each cell that is read has a finite number
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
#[repr(u8)]
pub(crate) enum Delimiter {
    Tab = b'\t',
    Blank = b' ',
    Comma = b',',
    Semicolon = b';',
}

#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct TimeMap {
    pub column: Option<Name>,
    pub unit: Option<String>,
    pub sample_time_s: Option<f64>,
    pub resample_s: Option<f64>,
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

/// Where one quantity stands: `value = sign x unit x raw + offset`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Table {
    pub columns: List<Name>,
    #[serde(alias = "topic")]
    pub file: Option<String>,
    pub time: Option<Name>,
    pub time_unit: Option<String>,
    #[serde(default)]
    pub time_offset_s: f64,
    pub unit: Option<String>, // [default: SI]
    pub sign: Option<Factors>,
    pub offset: Option<Factors>, // added after sign and unit, in SI units
    pub order: Option<List<String>>,
    pub frame: Option<Frame>,
    pub origin: Option<Origin>,
    pub threshold: Option<f64>, // force from which a foot is on the ground, in the table's unit; absent for flags
    pub release: Option<f64>,   // force below which it is in the air again [default: the threshold]
}

/// A column: its name, or its number from 1.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(untagged)]
pub(crate) enum Name {
    Number(usize),
    Text(String),
}

/// One or several of a kind; several words also in one text with blanks between them.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(untagged)]
pub(super) enum List<T> {
    One(T),
    Many(Vec<T>),
}

impl<T> List<T> {
    pub(super) fn entries(&self) -> &[T] {
        match self {
            List::One(one) => std::slice::from_ref(one),
            List::Many(all) => all,
        }
    }
}

/// A number for all columns, for each in their order, or by the names of elements (`*.kn`).
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
pub(super) enum Factors {
    All(f64),
    Each(Vec<f64>),
    Named(BTreeMap<String, f64>),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Frame {
    World,
    Body,   // the trunk's own axes
    Angles, // rates of roll, pitch and yaw
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Origin {
    Start,
    Log,
}

impl ColumnMap {
    /// Reads a map; errors have the line or key, and the expected text.
    pub fn read(path: &Path) -> Outcome<Self> {
        let text = read_toml(path).map_err(|source| io_fault("read", source).of(path))?;
        Self::parse(&path.display().to_string(), &text)
    }

    /// [`Self::read`] of a text; `file` stands for the file in messages.
    pub fn parse(file: &str, toml: &str) -> Outcome<Self> {
        let mut map: Self = toml::from_str(toml).map_err(|error| {
            let message = error.to_string();
            text(format!("no map of columns: {}", message.trim_end())).of(Path::new(file))
        })?;
        map.file = file.to_owned();
        map.require_applicable()?;
        Ok(map)
    }

    pub(super) fn table(&self, quantity: Quantity) -> Option<&Table> {
        match quantity.key().split_once('.') {
            Some(("joint", name)) => self.joint.get(name),
            Some((_, name)) => self.body.get(name),
            None => self.feet.as_ref(),
        }
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

    pub(super) fn fault(
        &self,
        key: &str,
        found: impl Into<String>,
        expected: impl Into<String>,
    ) -> RecordingError {
        let place = format!("`{key}`").into();
        RecordingError::new(&self.file, place, unexpected(found, expected))
    }
}

impl Table {
    /// Its columns, patterns and ranges written out.
    pub(super) fn columns(&self, names: &Names, quantity: Quantity) -> Vec<Name> {
        let written_out = |entry: &Name| -> Vec<Name> {
            match entry {
                Name::Number(number) => vec![Name::Number(*number)],
                Name::Text(text) => match range(text) {
                    Some(numbers) => numbers.map(Name::Number).collect(),
                    None => pattern(text, names, quantity),
                },
            }
        };
        let entries = self.columns.entries().iter();
        entries.flat_map(written_out).collect()
    }

    /// A key that does not apply to the table of this quantity, and the accepted value.
    fn misplaced(&self, quantity: Quantity) -> Option<(&'static str, &'static str)> {
        let (frame, threshold, release) = (self.frame, self.threshold, self.release);
        let angular = quantity == Quantity::AngularVelocity;
        let of_rate = angular || quantity == Quantity::BodyVelocity;
        let shifted = self.origin.is_some() && quantity != Quantity::BodyPosition;
        let forceless = threshold.is_some() && quantity != Quantity::Feet;
        let turned = frame == Some(Frame::Angles) && !angular;
        let alone = release.is_some() && threshold.is_none();
        let no_frame = "none: only velocities of the body have one";
        let rules = [
            ("frame", frame.is_some() && !of_rate, no_frame),
            ("frame", turned, "`world` or `body`"),
            ("origin", shifted, "none: only `body.position` has one"),
            ("release", alone, "together with a `threshold`"),
            ("threshold", forceless, "none: only `feet` has one"),
            ("release", release > threshold, "at most the `threshold`"),
        ];
        let wrong = rules.into_iter().find(|(_, is_wrong, _)| *is_wrong);
        wrong.map(|(key, _, expected)| (key, expected))
    }
}

/// `4..6`, both ends included.
pub(super) fn range(text: &str) -> Option<std::ops::RangeInclusive<usize>> {
    let (first, last) = text.split_once("..")?;
    Some(first.trim().parse().ok()?..=last.trim().parse().ok()?)
}

/// The names that a pattern with `{leg}` and `{joint}`, `{axis}`, or numbers from `{0}` or `{1}` on stands for.
fn pattern(text: &str, names: &Names, quantity: Quantity) -> Vec<Name> {
    let from = |first: usize| -> Vec<String> {
        let count = quantity.elements().len();
        (first..first + count).map(|i| i.to_string()).collect()
    };
    let marks: [&[(&str, &[String])]; 4] = [
        &[("{leg}", &names.legs), ("{joint}", &names.joints)],
        &[("{axis}", &names.axes)],
        &[("{0}", &from(0))],
        &[("{1}", &from(1))],
    ];
    let has = |mark: &&(&str, &[String])| text.contains(mark.0);
    let used = marks.map(|marks| Vec::from_iter(marks.iter().filter(has)));
    let used = used.into_iter().find(|marks| !marks.is_empty());
    let mut out = vec![text.to_owned()];
    for (mark, words) in used.into_iter().flatten() {
        let each =
            |text: &String| Vec::from_iter(words.iter().map(|word| text.replace(mark, word)));
        out = out.iter().flat_map(each).collect();
    }
    out.into_iter().map(Name::Text).collect()
}

impl ColumnMap {
    fn require_applicable(&self) -> Outcome<()> {
        let known = Quantity::ALL.map(Quantity::key);
        for (group, tables) in [("joint", &self.joint), ("body", &self.body)] {
            let mut keys = tables.keys().map(|name| format!("{group}.{name}"));
            if let Some(key) = keys.find(|key| !known.contains(&&key[..])) {
                return Err(self.fault(&key, "a table", format!("one of {}", known.join(", "))));
            }
        }
        for quantity in Quantity::ALL {
            let Some(table) = self.table(quantity) else {
                if quantity.is_required() {
                    let expected = format!("the columns of {}", quantity.column(0).name());
                    return Err(self.fault(quantity.key(), "no such table", expected));
                }
                continue;
            };
            if let Some((key, expected)) = table.misplaced(quantity) {
                return Err(self.fault(&quantity.at(key), "a value", expected));
            }
            self.require_finite(quantity, table)?;
            self.require_distinct(quantity, table)?;
        }
        let time = &self.time;
        if time.column.is_some() && time.sample_time_s.is_some() {
            let expected = "either a column or `sample_time_s`";
            return Err(self.fault("time.sample_time_s", "a column too", expected));
        }
        let steps = [
            ("time.sample_time_s", time.sample_time_s),
            ("time.resample_s", time.resample_s),
            ("time.max_gap_s", time.max_gap_s),
        ];
        for (key, step) in steps {
            if let Some(step) = step.filter(|step| !(step.is_finite() && *step > 0.0)) {
                return Err(self.fault(key, step.to_string(), "more than 0 s"));
            }
        }
        Ok(())
    }

    fn require_finite(&self, quantity: Quantity, table: &Table) -> Outcome<()> {
        let one = |value: Option<f64>| value.into_iter().collect();
        let all = |factors: &Option<Factors>| match factors {
            None => Vec::new(),
            Some(Factors::All(value)) => vec![*value],
            Some(Factors::Each(values)) => values.clone(),
            Some(Factors::Named(values)) => values.values().copied().collect(),
        };
        let numbers: [(&str, Vec<f64>); 5] = [
            ("time_offset_s", vec![table.time_offset_s]),
            ("threshold", one(table.threshold)),
            ("release", one(table.release)),
            ("sign", all(&table.sign)),
            ("offset", all(&table.offset)),
        ];
        for (key, values) in numbers {
            if let Some(value) = values.iter().find(|value| !value.is_finite()) {
                return Err(self.fault(&quantity.at(key), value.to_string(), "a finite number"));
            }
        }
        Ok(())
    }

    /// No column of a table twice, and no range that no log could have.
    fn require_distinct(&self, quantity: Quantity, table: &Table) -> Outcome<()> {
        let refuse = |found: String, expected: &str| {
            Err(self.fault(&quantity.at("columns"), found, expected))
        };
        for entry in table.columns.entries() {
            if let Name::Text(text) = entry
                && range(text).is_some_and(|all| all.end().saturating_sub(*all.start()) >= MOST)
            {
                return refuse(format!("{text:?}"), &format!("at most {MOST} columns"));
            }
        }
        let columns = table.columns(&self.names, quantity);
        let repeated = (1..columns.len()).find(|at| columns[..*at].contains(&columns[*at]));
        match repeated.map(|at| &columns[at]) {
            None => Ok(()),
            Some(Name::Text(name)) => refuse(format!("{name:?} twice"), "each column once"),
            Some(Name::Number(number)) => refuse(format!("{number} twice"), "each column once"),
        }
    }
}
