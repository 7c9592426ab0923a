//! The constant tables of a generated file.

use super::code::ConstTable;
use super::ident::{Ident, Namer};
use super::literal::Literal;
use crate::ir::Table;

/// The constant tables of a file; equal tables are stored once.
#[derive(Debug)]
pub struct Tables {
    namer: Namer,
    base: String,
    known: Vec<(Table, ConstTable)>,
}

impl Tables {
    /// No table yet; names begin with `base`.
    pub fn new(namer: Namer, base: &str) -> Self {
        Self {
            namer,
            base: base.to_owned(),
            known: Vec::new(),
        }
    }

    /// All tables, in the order of their first use.
    pub fn iter(&self) -> impl Iterator<Item = &ConstTable> {
        self.known.iter().map(|(_, table)| table)
    }

    /// The name of a table, which is stored if it is new.
    pub fn name(&mut self, table: &Table) -> Ident {
        self.stored(table).name.clone()
    }

    /// The name of a table whose rows are read in lanes.
    pub fn name_in_lanes(&mut self, table: &Table) -> Ident {
        let table = self.stored(table);
        table.is_in_lanes = true;
        table.name.clone()
    }

    fn stored(&mut self, table: &Table) -> &mut ConstTable {
        if let Some(known) = self.known.iter().position(|(known, _)| known == table) {
            return &mut self.known[known].1;
        }
        let name = self
            .namer
            .mint(&format!("{}_{}", self.base, self.known.len()));
        let literal = |&value| Literal::new(value).expect("tables of programs are finite");
        let printed = ConstTable {
            name,
            rows: table.rows(),
            cols: table.cols(),
            entries: table.entries().iter().map(literal).collect(),
            is_in_lanes: false,
        };
        self.known.push((table.clone(), printed));
        let last = self.known.len() - 1;
        &mut self.known[last].1
    }
}
