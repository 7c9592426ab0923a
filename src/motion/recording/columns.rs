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

    /// The columns of a file, with or without accelerations and the body wrench, in the order in which they are written.
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

/// The quantities in the columns of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// One entry per column of the file; `None` is not read.
    pub columns: Vec<Option<Column>>,
    /// The header's cells.
    pub names: Vec<String>,
    /// Whether the file carries accelerations.
    pub has_acceleration: bool,
    /// Whether the file carries the body wrench.
    pub has_force: bool,
}

impl Layout {
    /// Arranges the cells of a header. Case and runs of blanks do not matter.
    ///
    /// Accelerations and forces may be absent, but only all of them.
    ///
    /// # Errors
    /// [`RecordingFault::MissingColumns`], [`RecordingFault::DuplicateColumn`].
    pub fn from_header(path: &Path, names: Vec<String>) -> Result<Layout, RecordingError> {
        let known: Vec<(String, Column)> = Column::all(true, true)
            .into_iter()
            .map(|column| (folded(&column.name()), column))
            .collect();
        let mut columns: Vec<Option<Column>> = Vec::with_capacity(names.len());
        for name in &names {
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
        let mut read = columns.iter().flatten();
        let has_acceleration = (read.clone()).any(|c| matches!(c, Column::Acceleration(_)));
        let has_force = read.any(|c| matches!(c, Column::Force(_)));
        let missing: Vec<String> = (Column::all(has_acceleration, has_force).into_iter())
            .filter(|column| !columns.contains(&Some(*column)))
            .map(Column::name)
            .collect();
        if !missing.is_empty() {
            let (columns, found) = (missing, names);
            return Err(RecordingFault::MissingColumns { columns, found }.at(path, 1));
        }
        Ok(Layout {
            columns,
            names,
            has_acceleration,
            has_force,
        })
    }

    /// Names of the columns that are not read.
    pub fn ignored(&self) -> Vec<String> {
        self.columns
            .iter()
            .zip(&self.names)
            .filter(|(column, name)| column.is_none() && !name.is_empty())
            .map(|(_, name)| name.clone())
            .collect()
    }
}

/// A name without capitals and runs of blanks.
pub(super) fn folded(name: &str) -> String {
    name.split_whitespace()
        .collect::<Vec<_>>()
        .join(" ")
        .to_lowercase()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header() -> Vec<String> {
        let columns = Column::all(true, false).into_iter();
        columns.map(Column::name).collect()
    }

    #[test]
    fn all_without_forces_are_the_71_columns_of_the_format() {
        let names = header();
        assert_eq!(names.len(), 71);
        assert_eq!(names[3], "fr.hx Acceleration");
        assert_eq!(names[37], "Body linear Position x");
        assert_eq!(names[54], "Body angular Acceleration z");
        assert_eq!(names[55], "fr.hx Torque");
        assert_eq!(names[70], "rl Foot");
    }

    #[test]
    fn from_header_any_order_and_case_is_arranged() {
        let mut names = header();
        names.reverse();
        names[0] = " RL   foot ".to_owned();
        names.push("Temperature".to_owned());
        names.push(String::new());
        let layout = Layout::from_header(Path::new("a.csv"), names).unwrap();
        assert_eq!(layout.columns[0], Some(Column::Foot(3)));
        assert_eq!(layout.columns[70], Some(Column::Time));
        assert_eq!(layout.ignored(), ["Temperature"]);
        assert!(layout.has_acceleration && !layout.has_force);
    }

    #[test]
    fn from_header_some_forces_lists_the_others() {
        let mut names = header();
        names.push(Column::Force(2).name());
        let error = Layout::from_header(Path::new("a.csv"), names).unwrap_err();
        let RecordingFault::MissingColumns { columns, .. } = &error.kind else {
            panic!("{error:?}");
        };
        assert_eq!(columns.len(), 5);
        assert_eq!(columns[0], "Body linear Force x");
    }
}
