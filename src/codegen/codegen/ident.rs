//! Names in generated code, and the constant tables that are called by them.

use std::fmt;

use super::*;

/// A name that is an identifier of the target and unique in its scope; minted by [`Namer`].
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Ident(String);

impl Ident {
    pub(crate) fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for Ident {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

pub(crate) struct Namer {
    used: HashMap<String, usize>, // names, with the last number appended to each, 1 before any
}

impl Namer {
    /// A scope in which names of functions and the `reserved` words of the target, separated by blanks, are in use.
    pub(crate) fn new(reserved: &str) -> Self {
        let used = reserved.split_whitespace().chain(FUNCTIONS);
        let used = used.map(|name| (name.to_owned(), 1)).collect();
        Self { used }
    }

    /// The wanted name, with underscores for other characters, and with the first free number if it is already in use.
    pub(crate) fn mint(&mut self, wanted: &str) -> Ident {
        let mut base: String = wanted
            .chars()
            .map(|c| if c.is_ascii_alphanumeric() { c } else { '_' })
            .collect();
        if !base.starts_with(|c: char| c.is_ascii_alphabetic()) {
            base.insert(0, 'v');
        }
        let mut name = base.clone();
        let mut number = self.used.get(&base).copied().unwrap_or(1);
        while self.used.contains_key(&name) {
            number += 1;
            name = format!("{base}{number}");
        }
        self.used.insert(base, number);
        self.used.entry(name.clone()).or_insert(1);
        Ident(name)
    }
}

/// The constant tables of a file in the order of their first use; equal tables are stored once.
pub(crate) struct Tables {
    namer: Namer,
    base: String,
    pub known: Vec<(Ident, Table)>,
}

impl Tables {
    pub(crate) fn new(reserved: &str, base: String) -> Self {
        Self {
            namer: Namer::new(reserved),
            base,
            known: Vec::new(),
        }
    }

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

#[cfg(test)]
#[path = "../../../tests/units/codegen_codegen_ident.rs"]
mod tests;
