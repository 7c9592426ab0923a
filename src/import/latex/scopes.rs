//! What commands mean, and until where: the end of the group, environment, formula or cell that they are defined in.

use std::collections::HashMap;
use std::rc::Rc;

use super::super::ImportError;
use super::document::{CASES, LAYOUTS, is_one_of};
use super::token::{Kind, Token};

/// Environments whose rows are not divided into cells.
const WITHOUT_CELLS: &str = "equation displaymath dmath dgroup";
/// Environments with cells besides those that arrange equations.
const WITH_CELLS: &str = "array tabular tabularx longtable matrix pmatrix bmatrix Bmatrix vmatrix Vmatrix smallmatrix \
    subarray substack align";

#[derive(Debug, PartialEq)]
pub(super) struct Macro {
    pub(super) parameters: usize,
    /// The first argument, where it may be left out.
    pub(super) default: Option<Vec<Token>>,
    pub(super) body: Vec<Token>,
    /// Whether mathematics may be in it.
    pub(super) matters: bool,
}

/// Why something is not read, behind its name, and what would be.
pub(super) type Refusal = (&'static str, &'static str);

/// What a command means that the document defines.
#[derive(Clone, Debug)]
pub(super) enum Meaning {
    Macro(Rc<Macro>),
    /// The meaning that a command or character had when `\let` named it.
    Same(Kind),
    /// A definition that is not read, and whether mathematics may be in it.
    Unread(Refusal, bool),
    Verbatim,
}

struct Scope {
    opener: Token,
    /// What ends it; nothing for a cell, which ends with its column, row or environment.
    closer: Option<Kind>,
    has_at_letters: bool,
    /// What it changed: names with their earlier meaning and the level of that.
    earlier: Vec<(String, Option<(Meaning, usize)>)>,
}

#[derive(Default)]
pub(super) struct Scopes {
    /// With the number of scopes that were open where each was defined.
    meanings: HashMap<String, (Meaning, usize)>,
    open: Vec<Scope>,
    /// How many scopes are open around the formula that is read.
    pub(super) formula: Option<usize>,
    /// Whether `@` is a letter of commands.
    pub(super) has_at_letters: bool,
    /// Whether something was defined for all the rest among the rows of a formula, which amsmath reads twice.
    pub(super) has_changed_rows: bool,
}

impl Scopes {
    pub(super) fn depth(&self) -> usize {
        self.open.len()
    }

    pub(super) fn formula_around(&self) -> usize {
        let is_formula = |scope: &Scope| scope.closer.is_some();
        self.open.iter().rposition(is_formula).unwrap_or(0)
    }

    /// Whether mathematics is read; unknown in a group inside a formula, which may be text.
    pub(super) fn in_mathematics(&self) -> Option<bool> {
        let Some(around) = self.formula else {
            return Some(false);
        };
        let is_row = |scope: &Scope| scope.closer.is_none();
        (self.open[around..].iter().skip(1).all(is_row)).then_some(true)
    }

    pub(super) fn meaning(&self, name: &str) -> Option<&Meaning> {
        let found = self.meanings.get(name).filter(|_| !name.is_empty());
        found.map(|(meaning, _)| meaning)
    }

    /// Gives a meaning to a name until the innermost scope ends, or for all the rest.
    pub(super) fn define(&mut self, name: String, meaning: Meaning, for_all: bool) {
        let level = if for_all { 0 } else { self.open.len() };
        let formula = &self.open[self.formula.unwrap_or(self.open.len())..];
        self.has_changed_rows |= for_all && formula.iter().any(|scope| scope.closer.is_none());
        let before = self.meanings.insert(name.clone(), (meaning, level));
        let is_outer = before.as_ref().is_none_or(|(_, earlier)| *earlier < level);
        if let (true, false, Some(scope)) = (is_outer, for_all, self.open.last_mut()) {
            scope.earlier.push((name, before));
        }
    }

    pub(super) fn enter(&mut self, opener: Token, closer: Option<Kind>) {
        self.open.push(Scope {
            opener,
            closer,
            has_at_letters: self.has_at_letters,
            earlier: Vec::new(),
        });
    }

    pub(super) fn leave_to(&mut self, depth: usize) {
        while self.open.len() > depth {
            let Some(scope) = self.open.pop() else { return };
            self.has_at_letters = scope.has_at_letters;
            for (name, before) in scope.earlier.into_iter().rev() {
                let current = self.meanings.get(&name);
                match before {
                    // Defined for all the rest since.
                    _ if current.is_some_and(|(_, level)| *level == 0) => {}
                    Some(before) => drop(self.meanings.insert(name, before)),
                    None => drop(self.meanings.remove(&name)),
                }
            }
        }
    }

    /// Opens and closes what a printed token opens and closes.
    ///
    /// # Errors
    /// For what closes something else than what is open. Inside a formula that is left to its reader, but for
    /// `\begingroup`, which it does not see.
    pub(super) fn pass(&mut self, file: &str, token: &Token) -> Result<(), ImportError> {
        let innermost = self.open.last();
        let is_open = |kind: &Kind| innermost.is_some_and(|scope| scope.opener.kind == *kind);
        let closer = match (&token.kind, token.name()) {
            (Kind::Open, _) => Kind::Close,
            (kind @ (Kind::Dollar | Kind::Display), _) if !is_open(kind) => kind.clone(),
            (Kind::Begin(name), _) => Kind::End(name.clone()),
            (_, "begingroup") => Kind::command("endgroup"),
            (_, "[") => Kind::command("]"),
            (_, "(") => Kind::command(")"),
            (_, "left") if self.formula.is_some() => Kind::command("right"),
            (_, "right") if self.formula.is_none() => return Ok(()),
            (Kind::Close | Kind::End(_) | Kind::Dollar | Kind::Display, _)
            | (_, "endgroup" | "]" | ")" | "right") => return self.leave(file, token),
            (Kind::Align | Kind::Break, _) => {
                if innermost.is_some_and(|scope| scope.closer.is_none()) {
                    self.leave_to(self.open.len() - 1);
                    self.enter(token.clone(), None);
                }
                return Ok(());
            }
            _ => return Ok(()),
        };
        self.enter(token.clone(), Some(closer));
        if matches!(&token.kind, Kind::Begin(name) if has_cells(name)) {
            self.enter(token.clone(), None);
        }
        Ok(())
    }

    fn leave(&mut self, file: &str, token: &Token) -> Result<(), ImportError> {
        let closes = |scope: &Scope| scope.closer.as_ref() == Some(&token.kind);
        let place = self.open.iter().rposition(closes);
        let innermost = self.open.iter().rev().find(|scope| scope.closer.is_some());
        let is_group = |scope: &Scope| scope.opener.is_command("begingroup");
        let is_right = innermost.is_some_and(closes);
        let is_left_to_reader = match (place, self.formula) {
            (Some(place), Some(first)) => {
                place >= first && !self.open[place..].iter().any(is_group)
            }
            (None, Some(_)) => !token.is_command("endgroup"),
            (_, None) => false,
        };
        if !is_right && !is_left_to_reader {
            let expected = match innermost {
                Some(Scope {
                    opener,
                    closer: Some(closer),
                    ..
                }) => {
                    let line = opener.place.0;
                    format!("{} for {} in line {line}", closer.quoted(), opener.quoted())
                }
                _ => format!("what {} closes before it", token.quoted()),
            };
            return Err(ImportError::at(file, token.place, token.quoted(), expected));
        }
        if let Some(place) = place {
            self.leave_to(place);
        }
        Ok(())
    }
}

fn has_cells(name: &str) -> bool {
    let mut lists = [LAYOUTS, CASES, WITH_CELLS].into_iter();
    lists.any(|list| is_one_of(list, name)) && !is_one_of(WITHOUT_CELLS, name)
}
