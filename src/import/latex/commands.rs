//! The commands that TeX obeys instead of printing: conditionals, and text that is not printed.

use std::collections::BTreeSet;

use super::*;

type Printed = Read<Option<Token>>;

const FOLLOWED: &str =
    "`\\iftrue`, `\\iffalse` or a switch of `\\newif`, or the printed branch alone";
const CONDITION: Refusal = (", a conditional that is not followed", FOLLOWED);
const UNDECIDED: Refusal = (", a macro that is defined under a condition", FOLLOWED);
const KEPT: Refusal = (
    ", which keeps mathematics for another place",
    "equations where they are printed",
);

impl Expander<'_> {
    /// Obeys a command, or gives a token that is printed.
    pub(super) fn command(&mut self, token: Token) -> Printed {
        let printed = match token.name() {
            "" => return Ok(Some(token)),
            "begin" => return self.begin(token),
            "end" => return self.end(token),
            "label" => return Ok(Some(self.named(token, Kind::Label))),
            "bgroup" => Kind::Open,
            "egroup" => Kind::Close,
            // Old documents begin environments by their commands: `\let\be\equation`.
            name if is_in("by command", name) => Kind::Begin(name.to_owned()),
            name if is_in("by command", name.strip_prefix("end").unwrap_or("")) => {
                Kind::End(name["end".len()..].to_owned())
            }
            // These reserve space and print nothing.
            "phantom" | "hphantom" | "vphantom" => {
                self.argument();
                Kind::command(",")
            }
            _ => return self.silent(token),
        };
        Ok(Some(token.with(printed)))
    }

    fn silent(&mut self, token: Token) -> Printed {
        match token.name() {
            "begingroup" | "endgroup" => self.pass(&token)?,
            "global" => self.is_global = true,
            "unless" => self.is_negated = true,
            "long" | "outer" | "protected" | "expandafter" | "protect" | "ensuremath" => {}
            "textcolor" | "mathcolor" => {
                self.optional();
                self.argument();
            }
            "makeatletter" => self.lexer.has_at_letters = true,
            "makeatother" => self.lexer.has_at_letters = false,
            "catcode" => self.category(&token)?,
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
            name if is_in("not printed", name) => drop(self.argument()),
            name if is_in("not followed", name) => {
                return self.refuse(&token, "", "definitions where they hold");
            }
            name if is_in("other files", name) => {
                let whole = format!("latexpand {} > whole.tex", self.file);
                let expected = format!("the document in one file: {whole}");
                return self.refuse(&token, ", which prints a file that is not read", &expected);
            }
            name => {
                let is_definition = is_in("definitions", name);
                if is_definition {
                    self.definition(&token);
                }
                if self.has_changed_rows {
                    let expected = "a definition before the formula";
                    return self.refuse(&token, " for all rows among them", expected);
                }
                if !is_definition {
                    return self.condition(token);
                }
            }
        }
        Ok(None)
    }

    /// `\catcode`\@=11`, which makes `@` a letter; other characters keep their category.
    fn category(&mut self, token: &Token) -> Read<()> {
        self.takes(&Kind::Character('`'));
        let is_at = |token: Token| token.is_command("@") || token.kind == Kind::Character('@');
        if !self.code().is_some_and(is_at) {
            let expected = "characters as LaTeX reads them; `\\makeatletter` for `@`";
            return self.refuse(token, "", expected);
        }
        self.takes(&Kind::Character('='));
        let [first, second] = ['1', '1'].map(|digit| self.takes(&Kind::Character(digit)));
        self.takes(&Kind::Character('2'));
        self.lexer.has_at_letters = first && second;
        Ok(())
    }

    fn stop(&mut self) {
        self.pending.clear();
        self.lexer.rest = "";
    }

    /// Reads `{name}` behind a command and makes its kind of token of it.
    fn named(&mut self, token: Token, kind: fn(String) -> Kind) -> Token {
        if !self.takes(&Kind::Open) {
            return token;
        }
        let name = self.until(&Kind::Close).unwrap_or_default();
        token.with(kind(spelled(&name)))
    }

    /// The text spelled before the command `end`, which is consumed.
    pub(super) fn name_to(&mut self, end: &str) -> String {
        let tokens = std::iter::from_fn(|| self.code().filter(|token| !token.is_command(end)));
        spelled(&tokens.collect::<Vec<_>>())
    }

    /// Whether the document defines an environment with contents that are read.
    fn is_environment(&self, name: &str) -> bool {
        let meaning = self.meaning(name);
        matches!(meaning, Some(Meaning::Macro(_) | Meaning::Unread(..)))
    }

    fn begin(&mut self, token: Token) -> Printed {
        let token = self.named(token, Kind::Begin);
        let Kind::Begin(name) = &token.kind else {
            return Ok(Some(token));
        };
        let end = Kind::End(name.clone());
        let is_verbatim = match self.meaning(name) {
            None => is_one_of("verbatim environments", name),
            Some(meaning) => matches!(meaning, Meaning::Verbatim),
        };
        if is_verbatim {
            if !self.pending.is_empty() || !self.lexer.skip_verbatim(name) {
                return self.refuse(&token, " without its end", &end.quoted());
            }
            if name == "comment" && !self.lexer.line().trim().is_empty() {
                let expected = "`\\end{comment}` in a line of its own";
                return self.refuse(&token, " with text behind its end", expected);
            }
            return Ok(None);
        }
        if name == "lrbox" {
            return self.refuse(&token, "", "text that is printed where it stands");
        }
        if !self.is_environment(name) {
            return Ok(Some(token));
        }
        self.pending.push(token.with(Kind::command(name)));
        self.enter(token, Some(end));
        Ok(None)
    }

    fn end(&mut self, token: Token) -> Printed {
        let token = self.named(token, Kind::End);
        match &token.kind {
            Kind::End(name) if name == "document" => self.stop(),
            Kind::End(name) if self.is_environment(name) => {
                let end = format!("end{name}");
                let is_defined = self.meaning(&end).is_some();
                let end = token.with(Kind::Command(end));
                self.pending.push(token);
                self.pending.extend(is_defined.then_some(end));
            }
            _ => return Ok(Some(token)),
        }
        Ok(None)
    }
}

/// Conditionals: the branch that is printed where that is known, and nothing where it does not matter.
impl Expander<'_> {
    fn condition(&mut self, token: Token) -> Printed {
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
            "ifmmode" if self.in_mathematics().is_some() => self.in_mathematics() == Some(true),
            name if is_in("keeping arguments", name) => {
                return self.undecided_arguments(&token, KEPT);
            }
            name if name.starts_with("If")
                || name.starts_with("@if")
                || is_in("conditionals with arguments", name) =>
            {
                return self.undecided_arguments(&token, CONDITION);
            }
            name if !name.starts_with("if") || name == "iff" => return Ok(Some(token)),
            name if !is_in("conditionals", name) && self.is_brace_next() => {
                return self.undecided_arguments(&token, CONDITION);
            }
            _ => {
                let branches = self.skip(&token, false)?;
                return self.undecided(&token, &branches, CONDITION);
            }
        };
        if value == is_negated {
            return self.skip(&token, true).map(|_| None);
        }
        self.branches += 1;
        Ok(None)
    }

    /// Skips a branch up to its `\fi`, or to an `\else`, whose branch is then read. Returns the skipped tokens.
    fn skip(&mut self, start: &Token, stops_at_else: bool) -> Read<Vec<Token>> {
        let mut passed = Vec::new();
        let mut depth = 0;
        while let Some(token) = self.raw() {
            let name = match self.meaning(token.name()) {
                None => token.name(),
                Some(Meaning::Same(Kind::Command(same))) => same,
                Some(_) => "",
            };
            let is_known = is_in("conditionals", name);
            let is_unknown = name.starts_with("if")
                && !is_known
                && name != "iff"
                && !is_in("conditionals with arguments", name);
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

    /// Text that depends on conditions is not read, nor are macros that are defined in it.
    fn undecided(&mut self, token: &Token, tokens: &[Token], refusal: Refusal) -> Printed {
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
                    self.is_global = true;
                    self.define(name.clone(), Meaning::Unread(UNDECIDED, matters));
                }
                defines = !defines && is_in("definitions", name);
                if let Some(Meaning::Macro(found)) = self.meaning(name)
                    && seen.insert(name.clone())
                {
                    open.push(found.body.clone());
                }
            }
        }
        let matters = self.matters(tokens);
        self.unread(token, refusal, matters)
    }

    fn undecided_arguments(&mut self, token: &Token, why: Refusal) -> Printed {
        let is_kept = why == KEPT;
        match self.following_groups(if is_kept { 16 } else { 6 }) {
            Some(passed) if !is_kept || !passed.iter().any(|token| token.is_command("bgroup")) => {
                self.undecided(token, &passed, why)
            }
            None if !is_kept => Ok(Some(token.clone())),
            _ => self.refuse(token, why.0, why.1),
        }
    }
}
