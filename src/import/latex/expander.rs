//! What TeX makes of a document before it prints: macros replaced, definitions followed, branches of conditionals
//! chosen, text that is not printed left out.

use std::rc::Rc;

use super::super::ImportError;
use super::reader::has;
use super::scopes::{Macro, Meaning, Refusal, Scopes};
use super::sections::is_one_of;
use super::token::{Kind, Lexer, Token};

const MAX_EXPANDED: usize = 500_000;
const VERBATIM: &str =
    "verbatim Verbatim BVerbatim LVerbatim lstlisting minted comment filecontents";
/// Environments that old documents begin by their commands: `\let\be\equation`.
const BY_COMMAND: &str = "equation eqnarray displaymath";
/// Commands whose argument takes room and prints nothing, and commands whose argument does not print.
const PHANTOMS: &str = "phantom hphantom vphantom";
const NOT_PRINTED: &str = "index typeout message hypersetup pdfbookmark nocite @gobble";
/// Commands after which the text reads in another way than is followed here.
const NOT_FOLLOWED: &str =
    "globaldefs aftergroup afterassignment scantokens mathcode everymath everydisplay";
const OTHER_FILES: &str = "input include subfile subfileinclude subinputfrom import subimport inputfrom includefrom \
    InputIfFileExists @input";

pub(super) struct Expander<'t> {
    pub(super) file: &'t str,
    pub(super) lexer: Lexer<'t>,
    /// Tokens before those of the lexer, the next one last.
    pub(super) pending: Vec<Token>,
    pub(super) scopes: Scopes,
    /// How many branches of conditionals are being read.
    pub(super) branches: usize,
    budget: usize,
    /// Whether `\global` or `\unless` stand before the command that is read.
    pub(super) is_global: bool,
    pub(super) is_negated: bool,
}

impl<'t> Expander<'t> {
    pub(super) fn new(file: &'t str, mut tokens: Vec<Token>, text: &'t str) -> Self {
        tokens.reverse();
        Self {
            file,
            lexer: Lexer::new(text),
            pending: tokens,
            scopes: Scopes::default(),
            branches: 0,
            budget: MAX_EXPANDED,
            is_global: false,
            is_negated: false,
        }
    }

    /// The next token that is printed, or opens or closes a group.
    pub(super) fn next(&mut self) -> Result<Option<Token>, ImportError> {
        while let Some(token) = self.raw() {
            let printed = match self.scopes.meaning(token.name()).cloned() {
                Some(Meaning::Macro(found)) => self.expand(&token, &found).map(|()| None)?,
                Some(Meaning::Unread(refusal, matters)) => self.unread(&token, refusal, matters)?,
                Some(Meaning::Same(kind)) => self.primitive(token.with(kind))?,
                // The end of an environment that the document defines, behind what its end printed.
                _ if matches!(token.kind, Kind::End(_)) => {
                    self.scopes.pass(self.file, &token)?;
                    None
                }
                Some(Meaning::Verbatim) | None => self.primitive(token)?,
            };
            if let Some(token) = printed {
                (self.is_global, self.is_negated) = (false, false);
                self.scopes.pass(self.file, &token)?;
                return Ok(Some(token));
            }
        }
        Ok(None)
    }

    pub(super) fn raw(&mut self) -> Option<Token> {
        self.pending.pop().or_else(|| {
            self.lexer.has_at_letters = self.scopes.has_at_letters;
            self.lexer.next()
        })
    }

    pub(super) fn code(&mut self) -> Option<Token> {
        loop {
            let token = self.raw()?;
            if !matches!(token.kind, Kind::Comment(_) | Kind::Paragraph) {
                return Some(token);
            }
        }
    }

    pub(super) fn takes(&mut self, wanted: &Kind) -> bool {
        let next = self.code();
        let found = next.as_ref().is_some_and(|token| token.kind == *wanted);
        self.pending.extend(next.filter(|_| !found));
        found
    }

    pub(super) fn refuse<T>(
        &self,
        token: &Token,
        why: &str,
        expected: &str,
    ) -> Result<T, ImportError> {
        let found = format!("{}{why}", token.quoted());
        Err(ImportError::at(self.file, token.place, found, expected))
    }

    /// What is not followed here: in a formula a token that says so, in text nothing, unless mathematics may be in it.
    pub(super) fn unread(
        &self,
        token: &Token,
        (why, expected): Refusal,
        matters: bool,
    ) -> Result<Option<Token>, ImportError> {
        if self.scopes.formula.is_some() {
            let found = format!("{}{why}", token.quoted());
            return Ok(Some(token.with(Kind::Unread(found.into(), expected))));
        }
        match matters {
            true => self.refuse(token, why, expected),
            false => Ok(None),
        }
    }

    /// The tokens of a group, or one token; none at the end of the text or of the group around.
    pub(super) fn argument(&mut self) -> Option<Vec<Token>> {
        let first = self.code()?;
        match first.kind {
            Kind::Open => self.until(&Kind::Close),
            Kind::Close => {
                self.pending.push(first);
                None
            }
            _ => Some(vec![first]),
        }
    }

    pub(super) fn skip_group(&mut self) {
        if self.takes(&Kind::Open) {
            self.until(&Kind::Close);
        }
    }

    pub(super) fn optional(&mut self) -> Option<Vec<Token>> {
        let is_next = self.takes(&Kind::Character('['));
        is_next.then(|| self.until(&Kind::Character(']'))).flatten()
    }

    /// The tokens up to `end` outside of braces, which is passed.
    fn until(&mut self, end: &Kind) -> Option<Vec<Token>> {
        let mut tokens = Vec::new();
        let mut depth = 0;
        loop {
            let token = self.raw()?;
            match token.kind {
                _ if depth == 0 && token.kind == *end => return Some(tokens),
                Kind::Open => depth += 1,
                Kind::Close => depth -= 1,
                Kind::Comment(_) => continue,
                _ => {}
            }
            tokens.push(token);
        }
    }

    /// Puts the body of a macro, with its arguments, before what comes next; it stands at the place of `token`.
    fn expand(&mut self, token: &Token, found: &Rc<Macro>) -> Result<(), ImportError> {
        let mut arguments = Vec::with_capacity(found.parameters);
        if let Some(default) = &found.default {
            arguments.push(self.optional().unwrap_or_else(|| default.clone()));
        }
        while arguments.len() < found.parameters {
            let Some(argument) = self.argument() else {
                let why = ", a macro without its arguments";
                return self.refuse(token, why, "an argument for each parameter");
            };
            arguments.push(argument);
        }
        let before = self.pending.len();
        let mut parts = found.body.iter().rev().peekable();
        let is_sign = |part: &&Token| part.kind == Kind::Character('#');
        while let Some(part) = parts.next() {
            match &part.kind {
                // `##1` is the parameter of a definition inside.
                Kind::Parameter(_) if parts.next_if(is_sign).is_some() => {
                    self.pending.push(part.clone());
                }
                Kind::Parameter(number) => {
                    let argument = arguments.get(number.wrapping_sub(1)).into_iter().flatten();
                    self.pending.extend(argument.rev().cloned());
                }
                _ => {
                    let place = token.place;
                    self.pending.push(Token {
                        place,
                        ..part.clone()
                    });
                }
            }
            if self.pending.len() - before > self.budget {
                break;
            }
        }
        let made = 1 + self.pending.len() - before;
        let Some(rest) = self.budget.checked_sub(made) else {
            return self.refuse(
                token,
                ", a macro that expands without end",
                "macros that end",
            );
        };
        self.budget = rest;
        Ok(())
    }

    fn primitive(&mut self, token: Token) -> Result<Option<Token>, ImportError> {
        let name = token.name();
        match name {
            "" => return Ok(Some(token)),
            "begin" => return self.begin(token),
            "end" => return self.end(token),
            "label" => return Ok(Some(self.named(token, Kind::Label))),
            "begingroup" | "endgroup" => self.scopes.pass(self.file, &token)?,
            "bgroup" => return Ok(Some(token.with(Kind::Open))),
            "egroup" => return Ok(Some(token.with(Kind::Close))),
            "global" => self.is_global = true,
            "unless" => self.is_negated = true,
            "long" | "outer" | "protected" | "expandafter" | "protect" | "ensuremath" => {}
            "textcolor" | "mathcolor" => {
                self.optional();
                self.argument();
            }
            "makeatletter" | "makeatother" => self.scopes.has_at_letters = name == "makeatletter",
            "catcode" => return self.category(token).map(|()| None),
            "csname" => {
                let name = self.name_to("endcsname");
                self.pending.push(token.with(Kind::Command(name)));
            }
            "verb" | "lstinline" if self.pending.is_empty() => self.lexer.skip_verb(),
            "url" | "href" | "nolinkurl"
                if self.lexer.rest.starts_with('{') && self.pending.is_empty() =>
            {
                self.lexer.skip_verb();
            }
            "endinput" => self.lexer.rest = self.lexer.line(),
            "stop" | "bye" => self.stop(),
            _ if has(NOT_FOLLOWED, name) => {
                return self.refuse(&token, "", "definitions where they hold");
            }
            _ if has(OTHER_FILES, name) => {
                let whole = format!("latexpand {} > whole.tex", self.file);
                let expected = format!("the document in one file: {whole}");
                return self.refuse(&token, ", which prints a file that is not read", &expected);
            }
            _ if has(PHANTOMS, name) => {
                self.argument();
                return Ok(Some(token.with(Kind::command(","))));
            }
            _ if has(NOT_PRINTED, name) => drop(self.argument()),
            _ if has(BY_COMMAND, name) => {
                return Ok(Some(token.with(Kind::Begin(name.to_owned()))));
            }
            _ => match name.strip_prefix("end") {
                Some(name) if has(BY_COMMAND, name) => {
                    return Ok(Some(token.with(Kind::End(name.to_owned()))));
                }
                _ if self.follows_definition(&token)? => {}
                _ => return self.condition(token),
            },
        }
        Ok(None)
    }

    /// `\catcode`\@=11`, which makes `@` a letter; other characters stay what they are here.
    fn category(&mut self, token: Token) -> Result<(), ImportError> {
        self.takes(&Kind::Character('`'));
        let is_at = |token: Token| token.is_command("@") || token.kind == Kind::Character('@');
        if !self.code().is_some_and(is_at) {
            let expected = "characters as LaTeX reads them; `\\makeatletter` for `@`";
            return self.refuse(&token, "", expected);
        }
        self.takes(&Kind::Character('='));
        let [first, second] = ['1', '1'].map(|digit| self.takes(&Kind::Character(digit)));
        self.takes(&Kind::Character('2'));
        self.scopes.has_at_letters = first && second;
        Ok(())
    }

    fn stop(&mut self) {
        self.pending.clear();
        self.lexer.rest = "";
    }

    /// Reads `{name}` behind a command and makes its kind of token of it.
    fn named(&mut self, token: Token, kind: fn(String) -> Kind) -> Token {
        match self.takes(&Kind::Open) {
            true => {
                let name = self.until(&Kind::Close).unwrap_or_default();
                token.with(kind(spelled(&name)))
            }
            false => token,
        }
    }

    /// Whether the document defines an environment with contents that are read.
    fn is_environment(&self, name: &str) -> bool {
        let meaning = self.scopes.meaning(name);
        matches!(meaning, Some(Meaning::Macro(_) | Meaning::Unread(..)))
    }

    fn begin(&mut self, token: Token) -> Result<Option<Token>, ImportError> {
        let token = self.named(token, Kind::Begin);
        let Kind::Begin(name) = &token.kind else {
            return Ok(Some(token));
        };
        let is_verbatim = match self.scopes.meaning(name) {
            None => is_one_of(VERBATIM, name),
            Some(meaning) => matches!(meaning, Meaning::Verbatim),
        };
        if is_verbatim {
            if !self.pending.is_empty() || !self.lexer.skip_verbatim(name) {
                let expected = Kind::End(name.clone()).quoted();
                return self.refuse(&token, " without its end", &expected);
            }
            return match name == "comment" && !self.lexer.line().trim().is_empty() {
                true => {
                    let expected = "`\\end{comment}` in a line of its own";
                    self.refuse(&token, " with text behind its end", expected)
                }
                false => Ok(None),
            };
        }
        if name == "lrbox" {
            return self.refuse(&token, "", "text that is printed where it stands");
        }
        if self.is_environment(name) {
            let end = Kind::End(name.clone());
            self.pending.push(token.with(Kind::command(name)));
            self.scopes.enter(token, Some(end));
            return Ok(None);
        }
        Ok(Some(token))
    }

    fn end(&mut self, token: Token) -> Result<Option<Token>, ImportError> {
        let token = self.named(token, Kind::End);
        match &token.kind {
            Kind::End(name) if name == "document" => {
                self.stop();
                Ok(None)
            }
            Kind::End(name) if self.is_environment(name) => {
                let end = format!("end{name}");
                let is_defined = self.scopes.meaning(&end).is_some();
                let end = token.with(Kind::Command(end));
                self.pending.push(token);
                self.pending.extend(is_defined.then_some(end));
                Ok(None)
            }
            _ => Ok(Some(token)),
        }
    }

    /// What is spelled before the command `end`, which is passed.
    pub(super) fn name_to(&mut self, end: &str) -> String {
        let tokens = std::iter::from_fn(|| self.code().filter(|token| !token.is_command(end)));
        spelled(&tokens.collect::<Vec<_>>())
    }
}

pub(super) fn spelled<'t>(tokens: impl IntoIterator<Item = &'t Token>) -> String {
    let mut text = String::new();
    for token in tokens {
        if token.is_spaced && !text.is_empty() {
            text.push(' ');
        }
        match &token.kind {
            Kind::Command(name) => text.extend(["\\", name]),
            Kind::Character(character) => text.push(*character),
            kind => text.push_str(kind.quoted().trim_matches('`')),
        }
    }
    text
}
