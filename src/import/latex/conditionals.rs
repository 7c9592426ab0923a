//! Conditionals: the branch that is printed where that is known, and nothing where it does not matter.

use std::collections::BTreeSet;

use super::super::ImportError;
use super::definitions::{DEFINITIONS, UNREAD};
use super::expander::Expander;
use super::reader::has;
use super::scopes::{Meaning, Refusal};
use super::token::{Kind, Token};

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
