//! Expansion of a TeX document before it is printed: macros are replaced, definitions hold until their scope ends.

use super::*;

const MAX_EXPANDED: usize = 500_000;

#[derive(Debug)]
pub(super) struct Macro {
    pub(super) parameters: usize,
    /// The first argument, where it may be left out.
    pub(super) default: Option<Vec<Token>>,
    pub(super) body: Vec<Token>,
    /// Whether mathematics may be in it.
    pub(super) matters: bool,
}

/// Why something is not read, behind its name, and the accepted alternative.
pub(super) type Refusal = (&'static str, &'static str);

#[derive(Clone, Debug)]
pub(super) enum Meaning {
    Macro(Rc<Macro>),
    /// The meaning that a command or character had when `\let` named it.
    Same(Kind),
    /// A definition that is not read, and whether mathematics may be in it.
    Unread(Refusal, bool),
    Verbatim,
}

/// A group, environment, formula or cell that is open.
struct Scope {
    opener: Token,
    /// Its closing token; none for a cell, which ends with its column, row or environment.
    closer: Option<Kind>,
    has_at_letters: bool,
    /// The names that are defined until it ends.
    names: Vec<String>,
}

pub(super) struct Expander<'t> {
    pub(super) file: &'t str,
    pub(super) lexer: Lexer<'t>,
    /// Tokens before those of the lexer, the next one last.
    pub(super) pending: Vec<Token>,
    /// Of each name its meanings, the current one last, and how many scopes were open around each.
    meanings: HashMap<String, Vec<(usize, Meaning)>>,
    open: Vec<Scope>,
    /// How many scopes are open around the formula that is read.
    formula: Option<usize>,
    /// Whether something was defined for all the rest among the rows of a formula, which amsmath reads twice.
    pub(super) has_changed_rows: bool,
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
            meanings: HashMap::new(),
            open: Vec::new(),
            formula: None,
            has_changed_rows: false,
            branches: 0,
            budget: MAX_EXPANDED,
            is_global: false,
            is_negated: false,
        }
    }

    /// The next token that is printed, or opens or closes a group.
    pub(super) fn next(&mut self) -> Read<Option<Token>> {
        while let Some(token) = self.raw() {
            let printed = match self.meaning(token.name()).cloned() {
                Some(Meaning::Macro(found)) => self.expand(&token, &found).map(|()| None)?,
                Some(Meaning::Unread(refusal, matters)) => self.unread(&token, refusal, matters)?,
                Some(Meaning::Same(kind)) => self.command(token.with(kind))?,
                // The end of an environment that the document defines, behind the text printed by its end.
                _ if matches!(token.kind, Kind::End(_)) => {
                    self.pass(&token)?;
                    None
                }
                Some(Meaning::Verbatim) | None => self.command(token)?,
            };
            if let Some(token) = printed {
                (self.is_global, self.is_negated) = (false, false);
                self.pass(&token)?;
                return Ok(Some(token));
            }
        }
        Ok(None)
    }

    /// The tokens of a formula whose beginning was just read, up to its end or a token that `ends` it, which is passed.
    pub(super) fn formula(&mut self, ends: fn(&Token) -> bool) -> Read<Option<Vec<Token>>> {
        let around = self.open.iter().rposition(|scope| scope.closer.is_some());
        let around = around.unwrap_or(0);
        self.formula = Some(around);
        let mut tokens = Vec::new();
        while let Some(token) = self.next()? {
            if self.open.len() <= around || ends(&token) {
                self.leave_to(around);
                self.formula = None;
                return Ok(Some(tokens));
            }
            tokens.push(token);
        }
        Ok(None)
    }

    pub(super) fn raw(&mut self) -> Option<Token> {
        self.pending.pop().or_else(|| self.lexer.next())
    }

    pub(super) fn code(&mut self) -> Option<Token> {
        let is_code = |token: &Token| !matches!(token.kind, Kind::Comment(_) | Kind::Paragraph);
        std::iter::from_fn(|| self.raw()).find(is_code)
    }

    pub(super) fn takes(&mut self, wanted: &Kind) -> bool {
        let next = self.code();
        let found = next.as_ref().is_some_and(|token| token.kind == *wanted);
        self.pending.extend(next.filter(|_| !found));
        found
    }

    pub(super) fn is_brace_next(&mut self) -> bool {
        let next = self.code();
        let is_brace = next.as_ref().is_some_and(|token| token.kind == Kind::Open);
        self.pending.extend(next);
        is_brace
    }

    pub(super) fn refuse<T>(&self, token: &Token, why: &str, expected: &str) -> Read<T> {
        let found = format!("{}{why}", token.quoted());
        Err(ImportError::at(self.file, token.place, found, expected))
    }

    /// Text that is not read: in a formula it becomes a token with the reason. Elsewhere it is ignored, or refused if
    /// it may contain mathematics.
    pub(super) fn unread(
        &self,
        token: &Token,
        (why, expected): Refusal,
        matters: bool,
    ) -> Read<Option<Token>> {
        let found = || format!("{}{why}", token.quoted()).into();
        match self.formula.is_some() {
            true => Ok(Some(token.with(Kind::Unread(found(), expected)))),
            false if matters => self.refuse(token, why, expected),
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

    pub(super) fn optional(&mut self) -> Option<Vec<Token>> {
        let is_next = self.takes(&Kind::Character('['));
        is_next.then(|| self.until(&Kind::Character(']'))).flatten()
    }

    /// The tokens up to `end` outside of braces, which is passed.
    pub(super) fn until(&mut self, end: &Kind) -> Option<Vec<Token>> {
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

    /// Puts the body of a macro, with its arguments, before the following tokens; it has the place of `token`.
    fn expand(&mut self, token: &Token, found: &Macro) -> Read<()> {
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
        let (before, place) = (self.pending.len(), token.place);
        let mut parts = found.body.iter().rev().peekable();
        let is_sign = |part: &&Token| part.kind == Kind::Character('#');
        while let Some(part) = parts.next() {
            match part.kind {
                // `##1` is the parameter of a definition inside.
                Kind::Parameter(_) if parts.next_if(is_sign).is_some() => {
                    self.pending.push(part.clone());
                }
                Kind::Parameter(number) => {
                    let argument = arguments.get(number.wrapping_sub(1)).into_iter().flatten();
                    self.pending.extend(argument.rev().cloned());
                }
                _ => self.pending.extend([Token {
                    place,
                    ..part.clone()
                }]),
            }
            if self.pending.len() - before > self.budget {
                break;
            }
        }
        let made = 1 + self.pending.len() - before;
        let Some(rest) = self.budget.checked_sub(made) else {
            let why = ", a macro that expands without end";
            return self.refuse(token, why, "macros that end");
        };
        self.budget = rest;
        Ok(())
    }
}

/// Scopes: definitions hold until the group, environment, formula or cell around them ends.
impl Expander<'_> {
    pub(super) fn meaning(&self, name: &str) -> Option<&Meaning> {
        let found = self.meanings.get(name).filter(|_| !name.is_empty());
        found?.last().map(|(_, meaning)| meaning)
    }

    /// Whether mathematics is read; unknown in a group inside a formula, which may be text.
    pub(super) fn in_mathematics(&self) -> Option<bool> {
        let Some(around) = self.formula else {
            return Some(false);
        };
        let is_row = |scope: &Scope| scope.closer.is_none();
        (self.open[around..].iter().skip(1).all(is_row)).then_some(true)
    }

    /// Gives a meaning to a name until the innermost scope ends, or behind `\global` for all the rest.
    pub(super) fn define(&mut self, name: String, meaning: Meaning) {
        let for_all = std::mem::take(&mut self.is_global);
        let level = if for_all { 0 } else { self.open.len() };
        let formula = &self.open[self.formula.unwrap_or(self.open.len())..];
        self.has_changed_rows |= for_all && formula.iter().any(|scope| scope.closer.is_none());
        let meanings = self.meanings.entry(name.clone()).or_default();
        meanings.retain(|(earlier, _)| *earlier < level);
        meanings.push((level, meaning));
        if let (false, Some(scope)) = (for_all, self.open.last_mut()) {
            scope.names.push(name);
        }
    }

    pub(super) fn enter(&mut self, opener: Token, closer: Option<Kind>) {
        self.open.push(Scope {
            opener,
            closer,
            has_at_letters: self.lexer.has_at_letters,
            names: Vec::new(),
        });
    }

    fn leave_to(&mut self, depth: usize) {
        for scope in self.open.drain(depth.min(self.open.len())..).rev() {
            self.lexer.has_at_letters = scope.has_at_letters;
            for name in scope.names {
                let meanings = self.meanings.entry(name).or_default();
                meanings.pop_if(|(level, _)| *level > depth);
            }
        }
    }

    /// Opens and closes scopes as a printed token does. A token that closes another scope is refused; in a formula only
    /// with `\begingroup`, because its reader checks all other scopes.
    pub(super) fn pass(&mut self, token: &Token) -> Read<()> {
        let innermost = self.open.last();
        let is_open = innermost.is_some_and(|scope| scope.opener.kind == token.kind);
        let in_cell = innermost.is_some_and(|scope| scope.closer.is_none());
        let closer = match (&token.kind, token.name()) {
            (Kind::Open, _) => Kind::Close,
            (kind @ (Kind::Dollar | Kind::Display), _) if !is_open => kind.clone(),
            (Kind::Begin(name), _) => Kind::End(name.clone()),
            (_, "begingroup") => Kind::command("endgroup"),
            (_, "[") => Kind::command("]"),
            (_, "(") => Kind::command(")"),
            (_, "left") if self.formula.is_some() => Kind::command("right"),
            (_, "right") if self.formula.is_none() => return Ok(()),
            (Kind::Close | Kind::End(_) | Kind::Dollar | Kind::Display, _)
            | (_, "endgroup" | "]" | ")" | "right") => return self.leave(token),
            (Kind::Align | Kind::Break, _) if in_cell => {
                self.leave_to(self.open.len() - 1);
                self.enter(token.clone(), None);
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

    fn leave(&mut self, token: &Token) -> Read<()> {
        let closes = |scope: &Scope| scope.closer.as_ref() == Some(&token.kind);
        let is_group = |scope: &Scope| scope.opener.is_command("begingroup");
        let place = self.open.iter().rposition(closes);
        let innermost = self
            .open
            .iter()
            .rev()
            .find_map(|scope| Some((scope, scope.closer.as_ref()?)));
        let is_left_to_reader = match (place, self.formula) {
            (Some(place), Some(first)) => {
                place >= first && !self.open[place..].iter().any(is_group)
            }
            (None, Some(_)) => !token.is_command("endgroup"),
            (_, None) => false,
        };
        if !innermost.is_some_and(|(scope, _)| closes(scope)) && !is_left_to_reader {
            let expected = match innermost {
                Some((Scope { opener, .. }, closer)) => {
                    let line = opener.place.0;
                    format!("{} for {} in line {line}", closer.quoted(), opener.quoted())
                }
                None => format!("the opening of {} before it", token.quoted()),
            };
            return self.refuse(token, "", &expected);
        }
        if let Some(place) = place {
            self.leave_to(place);
        }
        Ok(())
    }
}

fn has_cells(name: &str) -> bool {
    let mut lists = ["layouts", "cases", "with cells"].into_iter();
    lists.any(|list| is_one_of(list, name)) && !is_one_of("without cells", name)
}
