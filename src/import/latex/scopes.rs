//! What commands mean, and until where: the end of the group, environment, formula or cell that they are defined in.
//!
//! Conditionals: the branch that is printed where that is known, and nothing where it does not matter.

use std::collections::{BTreeSet, HashMap};
use std::rc::Rc;

use super::super::ImportError;
use super::definitions::{DEFINITIONS, UNREAD};
use super::expander::Expander;
use super::reader::has;
use super::sections::{CASES, LAYOUTS, is_one_of};
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

const CONDITIONALS: &str = "if ifcat ifnum ifdim ifodd ifvmode ifhmode ifmmode ifinner ifvoid ifhbox ifvbox ifx ifeof \
    iftrue iffalse ifcase ifdefined ifcsname iffontchar ifincsname ifpdf ifxetex ifluatex ifPDFTeX ifXeTeX ifLuaTeX";
/// Commands that begin as conditionals do and take arguments, or none.
const WITH_ARGUMENTS: &str =
    "ifdef ifundef ifdefempty ifdefvoid ifdefstring ifdefmacro ifdefequal ifdefcounter";
/// Commands that keep their arguments, for elsewhere or for a condition of their own.
const KEEPING: &str = "AtBeginDocument AtEndDocument AtEndPreamble sbox savebox setbox";
const FOLLOWED: &str =
    "`\\iftrue`, `\\iffalse` or a switch of `\\newif`, or the printed branch alone";

const CONDITION: Refusal = (", a conditional that is not followed", FOLLOWED);
const KEPT: Refusal = (
    ", which keeps mathematics for another place",
    "equations where they are printed",
);
const UNDECIDED: Refusal = (", a macro that is defined under a condition", FOLLOWED);

impl Expander<'_> {
    pub(super) fn condition(&mut self, token: Token) -> Result<Option<Token>, ImportError> {
        let is_negated = std::mem::take(&mut self.is_negated);
        let value = match token.name() {
            "fi" if self.branches > 0 => {
                self.branches -= 1;
                return Ok(None);
            }
            "else" | "or" if self.branches > 0 => {
                self.branches -= 1;
                return self.skip(&token, false).map(|_| None);
            }
            "fi" | "else" => {
                let expected = "conditionals in pairs with `\\fi`";
                return self.refuse(&token, " without its conditional", expected);
            }
            "iftrue" => true,
            "iffalse" => false,
            "ifmmode" if self.scopes.in_mathematics().is_some() => {
                self.scopes.in_mathematics() == Some(true)
            }
            name if has(KEEPING, name) => return self.undecided_arguments(&token, KEPT),
            name if name.starts_with("If")
                || name.starts_with("@if")
                || has(WITH_ARGUMENTS, name) =>
            {
                return self.undecided_arguments(&token, CONDITION);
            }
            name if !name.starts_with("if") || name == "iff" => return Ok(Some(token)),
            name if !has(CONDITIONALS, name) && self.is_brace_next() => {
                return self.undecided_arguments(&token, CONDITION);
            }
            _ => {
                let branches = self.skip(&token, false)?;
                return self.undecided(&token, &branches, CONDITION);
            }
        };
        match value == is_negated {
            true => self.skip(&token, true).map(|_| None),
            false => {
                self.branches += 1;
                Ok(None)
            }
        }
    }

    pub(super) fn is_brace_next(&mut self) -> bool {
        let next = self.code();
        let is_brace = next.as_ref().is_some_and(|token| token.kind == Kind::Open);
        self.pending.extend(next);
        is_brace
    }

    /// Passes a branch up to its `\fi`, or to an `\else`, whose branch is then read; what is passed.
    fn skip(&mut self, start: &Token, stops_at_else: bool) -> Result<Vec<Token>, ImportError> {
        let mut passed = Vec::new();
        let mut depth = 0;
        while let Some(token) = self.raw() {
            let name = match self.scopes.meaning(token.name()) {
                None => token.name(),
                Some(Meaning::Same(Kind::Command(same))) => same,
                Some(_) => "",
            };
            let is_known = has(CONDITIONALS, name);
            let is_unknown =
                name.starts_with("if") && !is_known && name != "iff" && !has(WITH_ARGUMENTS, name);
            match name {
                "fi" if depth == 0 => return Ok(passed),
                "else" if depth == 0 && stops_at_else => {
                    self.branches += 1;
                    return Ok(passed);
                }
                "fi" => depth -= 1,
                _ => depth += usize::from(is_known),
            }
            if is_unknown && !self.is_brace_next() {
                let expected = "`\\newif` for it before, or conditionals of TeX";
                return self.refuse(&token, " in text that is not printed", expected);
            }
            passed.push(token);
        }
        self.refuse(start, " without its end", "`\\fi`")
    }

    /// What conditions decide is not followed, nor are macros that are defined in it.
    fn undecided(
        &mut self,
        token: &Token,
        tokens: &[Token],
        refusal: Refusal,
    ) -> Result<Option<Token>, ImportError> {
        let mut open = vec![tokens.to_vec()];
        let mut seen = BTreeSet::new();
        while let Some(tokens) = open.pop() {
            let mut defines = false;
            for token in &tokens {
                let Kind::Command(name) = &token.kind else {
                    defines &= matches!(token.kind, Kind::Open | Kind::Character('*'));
                    continue;
                };
                if defines {
                    let matters = self.matters(std::slice::from_ref(token));
                    let meaning = Meaning::Unread(UNDECIDED, matters);
                    self.scopes.define(name.clone(), meaning, true);
                }
                defines = !defines && (has(DEFINITIONS, name) || has(UNREAD, name));
                if let Some(Meaning::Macro(found)) = self.scopes.meaning(name)
                    && seen.insert(name.clone())
                {
                    open.push(found.body.clone());
                }
            }
        }
        let matters = self.matters(tokens);
        self.unread(token, refusal, matters)
    }

    fn undecided_arguments(
        &mut self,
        token: &Token,
        why: Refusal,
    ) -> Result<Option<Token>, ImportError> {
        let is_kept = why == KEPT;
        match self.following_groups(if is_kept { 16 } else { 6 }) {
            Some(passed) if !is_kept || !passed.iter().any(|token| token.is_command("bgroup")) => {
                self.undecided(token, &passed, why)
            }
            None if !is_kept => Ok(Some(token.clone())),
            _ => self.refuse(token, why.0, why.1),
        }
    }

    /// The groups that follow, behind at most so many other tokens; nothing is passed if there is none.
    pub(super) fn following_groups(&mut self, most: usize) -> Option<Vec<Token>> {
        let mut before = Vec::new();
        while !self.is_brace_next() {
            let token = self.code();
            let is_last = before.len() == most || token.is_none();
            before.extend(token);
            if is_last {
                self.pending.extend(before.into_iter().rev());
                return None;
            }
        }
        while self.is_brace_next() {
            before.extend(self.argument().unwrap_or_default());
        }
        Some(before)
    }
}
