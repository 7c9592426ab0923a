//! The constant tables of a generated file.

use super::ident::{Ident, Namer};
use crate::ir::Table;

/// The constant tables of a file in the order of their first use; equal tables are stored once.
#[derive(Debug)]
pub(crate) struct Tables {
    namer: Namer,
    base: String,
    pub known: Vec<(Ident, Table)>,
}

impl Tables {
    pub(crate) fn new(namer: Namer, base: &str) -> Self {
        Self {
            namer,
            base: base.to_owned(),
            known: Vec::new(),
        }
    }

    /// The name of a table, which is stored if it is new.
    pub(crate) fn name(&mut self, table: &Table) -> Ident {
        if let Some((name, _)) = self.known.iter().find(|(_, known)| known == table) {
            return name.clone();
        }
        let wanted = format!("{}_{}", self.base, self.known.len());
        let name = self.namer.mint(&wanted);
        self.known.push((name.clone(), table.clone()));
        name
    }
}
