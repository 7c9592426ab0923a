//! Names of columns and the header that arranges them.

use std::path::Path;

use super::error::{RecordingError, RecordingFault};
use crate::robot::{BODY_DIM, FOOT_DIM, JOINT_DIM, JOINT_NAMES, Leg, STATE_DIM};

/// The quantity in a column; indices follow the state, the wrench and the feet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Column {
    /// `Time`, in s.
    Time,
    /// Coordinate of the state.
    Position(usize),
    /// Its rate.
    Velocity(usize),
    /// Its acceleration.
    Acceleration(usize),
    /// Joint torque, in N m.
    Torque(usize),
    /// Entry of the body wrench, in N or N m.
    Force(usize),
    /// Contact flag.
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

    /// The columns of a file, with or without accelerations and the body wrench, in the order in which they are
    /// written.
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

    /// The columns that the cells of a header name, none for unknown names. Case and runs of blanks do not matter.
    ///
    /// Accelerations and forces may be absent, but only all of them.
    pub(super) fn arranged(
        path: &Path,
        names: &[String],
    ) -> Result<Vec<Option<Column>>, RecordingError> {
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
                let fault = RecordingFault::DuplicateColumn { first, second };
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
        if !missing.is_empty() {
            let (columns, found) = (missing, names.to_vec());
            return Err(RecordingFault::MissingColumns { columns, found }.at(path, 1));
        }
        Ok(columns)
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

/// A name without capitals and runs of blanks.
pub(super) fn folded(name: &str) -> String {
    let words: Vec<&str> = name.split_whitespace().collect();
    words.join(" ").to_lowercase()
}
