//! The fixture as a table of cells, to be damaged and written again.

use std::io::Write;

use flate2::Compression;
use flate2::write::GzEncoder;
use romc::recording::{Recording, RecordingError, read_from_bytes};

const LANDING: &str = include_str!("../fixtures/recordings/landing.csv");

/// Header and rows of cells with decimal commas.
#[derive(Clone)]
pub struct Sheet {
    pub rows: Vec<Vec<String>>,
    pub separator: &'static str,
}

impl Sheet {
    pub fn landing() -> Sheet {
        let rows = LANDING
            .lines()
            .map(|line| line.split(';').map(str::to_owned).collect())
            .collect();
        Sheet {
            rows,
            separator: ";",
        }
    }

    /// Place of a column, counted from 0.
    pub fn place(&self, column: &str) -> usize {
        let found = self.rows[0].iter().position(|name| name == column);
        found.unwrap_or_else(|| panic!("the fixture has no column {column}"))
    }

    /// Sets the cell of a row of the file (1 is the header).
    pub fn set(&mut self, row: usize, column: &str, cell: &str) {
        let place = self.place(column);
        self.rows[row - 1][place] = cell.to_owned();
    }

    pub fn remove_columns(&mut self, removed: impl Fn(&str) -> bool) {
        let keep: Vec<bool> = self.rows[0].iter().map(|name| !removed(name)).collect();
        for row in &mut self.rows {
            let mut place = 0..;
            row.retain(|_| keep[place.next().expect("an endless range")]);
        }
    }

    pub fn text(&self) -> String {
        let lines: Vec<String> = self
            .rows
            .iter()
            .map(|row| row.join(self.separator))
            .collect();
        lines.join("\n") + "\n"
    }

    pub fn read(&self) -> Result<Recording, RecordingError> {
        read_from_bytes("landing.csv", self.text().as_bytes())
    }
}

pub fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut packed = GzEncoder::new(Vec::new(), Compression::default());
    packed.write_all(bytes).unwrap();
    packed.finish().unwrap()
}
