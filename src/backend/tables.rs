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
        if let Some((_, known)) = self.known.iter().find(|(known, _)| known == table) {
            return known.name.clone();
        }
        let name = self
            .namer
            .mint(&format!("{}_{}", self.base, self.known.len()));
        let literal = |&value| Literal::new(value).expect("tables of programs are finite");
        let printed = ConstTable {
            name: name.clone(),
            rows: table.rows(),
            cols: table.cols(),
            entries: table.entries().iter().map(literal).collect(),
        };
        self.known.push((table.clone(), printed));
        name
    }
}
