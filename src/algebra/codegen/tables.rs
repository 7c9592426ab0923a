//! The constant tables of a generated file.

use super::code::ConstTable;
use super::ident::Namer;
use crate::ir::Table;

/// The constant tables of a file; equal tables are stored once.
#[derive(Debug)]
pub(crate) struct Tables {
    namer: Namer,
    base: String,
    known: Vec<ConstTable>,
}

impl Tables {
    /// No table yet; names begin with `base`.
    pub(crate) fn new(namer: Namer, base: &str) -> Self {
        Self {
            namer,
            base: base.to_owned(),
            known: Vec::new(),
        }
    }

    /// All tables, in the order of their first use.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &ConstTable> {
        self.known.iter()
    }

    /// A table, which is stored if it is new.
    pub(crate) fn stored(&mut self, table: &Table) -> &mut ConstTable {
        let known = self.known.iter().position(|known| known.values == *table);
        let place = known.unwrap_or_else(|| {
            let place = self.known.len();
            self.known.push(ConstTable {
                name: self.namer.mint(&format!("{}_{place}", self.base)),
                values: table.clone(),
                is_in_lanes: false,
                is_entered: false,
            });
            place
        });
        &mut self.known[place]
    }
}
