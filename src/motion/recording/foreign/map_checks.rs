//! What a map may not say, whatever the log.

use super::elements::Quantity;
use super::map::{ColumnMap, Factors, Frame, Name, Table, range};
use crate::recording::error::RecordingError;

/// Most columns that a range stands for.
const MAX_COLUMNS: usize = 10_000;

impl ColumnMap {
    /// # Errors
    /// [`RecordingFault::Unexpected`](crate::recording::RecordingFault::Unexpected) with the key.
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
