//! Definitions of macros and environments.

use super::expander::Macro;
use super::*;

const UNREAD_FORM: Refusal = (
    ", a macro of a form that is not read",
    "`\\newcommand` with plain arguments",
);
const DEFINED_TWICE: Refusal = (
    ", a macro that is defined already where it is defined",
    "`\\renewcommand` for its second definition",
);
const DELIMITED: Refusal = (
    ", a macro with delimited arguments",
    "a macro with plain arguments",
);
const CHANGED_DIGITS: Refusal = (
    ", with options of siunitx that change its digits",
    "numbers as they are printed",
);
const EXPANDED: Refusal = (
    ", a macro whose body is expanded where it is defined",
    "`\\def` or `\\newcommand`",
);
/// A name and its meaning from there on; none where the text ends early.
type Definition = (String, Meaning);

impl Expander<'_> {
    pub(super) fn definition(&mut self, token: &Token) {
        let found = match token.name() {
            "newcommand" | "renewcommand" | "providecommand" | "DeclareRobustCommand" => {
                self.new_command(token.name())
            }
            "def" | "gdef" | "edef" | "xdef" => self.plain_definition(token.name()),
            "let" => self.same_meaning(),
            "DeclareMathOperator" => self.operator(token),
            "newif" => self.switch(token),
            "newenvironment" | "renewenvironment" => self.environment(token.name()),
            "sisetup" => {
                let options = self.argument().unwrap_or_default();
                let changed = ("num".to_owned(), Meaning::Unread(CHANGED_DIGITS, false));
                changes_digits(&options).then_some(changed)
            }
            name if is_in("verbatim definitions", name) => {
                let name = self.argument();
                name.map(|name| (spelled(&name), Meaning::Verbatim))
            }
            _ => self.unread_definition(token),
        };
        if let Some((name, meaning)) = found {
            self.define(name, meaning);
        }
    }

    /// The name of the macro that is defined, behind a star: `\k`, `{\k}`, `\csname k\endcsname`, or a name as text.
    fn target(&mut self) -> Option<String> {
        self.takes(&Kind::Character('*'));
        let argument = self.argument()?;
        match argument.as_slice() {
            [token] if token.is_command("csname") => Some(self.name_to("endcsname")),
            [token] if !token.name().is_empty() => Some(token.name().to_owned()),
            _ => Some(spelled(&argument)),
        }
    }

    fn is_defined(&self, name: &str) -> bool {
        match self.meaning(name) {
            Some(Meaning::Same(Kind::Command(old))) => !has("relax undefined @undefined", old),
            Some(_) => true,
            None => is_in("kernel", name),
        }
    }

    /// `\newcommand{\k}[2][default]{...}` and its kin.
    fn new_command(&mut self, command: &str) -> Option<Definition> {
        let name = self.target()?;
        let meaning = self.bracketed_definition()?;
        self.is_global = false;
        match (command, self.is_defined(&name)) {
            ("providecommand", true) => None,
            ("newcommand", true) => {
                let matters = matches!(&meaning, Meaning::Macro(found) if found.matters);
                Some((name, Meaning::Unread(DEFINED_TWICE, matters)))
            }
            _ => Some((name, meaning)),
        }
    }

    /// `[2][default]{...}`.
    fn bracketed_definition(&mut self) -> Option<Meaning> {
        let count = self.optional().map(|count| spelled(&count).parse());
        let default = count.as_ref().and_then(|_| self.optional());
        let body = self.argument()?;
        Some(match count.unwrap_or(Ok(0)) {
            Ok(parameters @ 0..=9) => self.plain_macro(parameters, default, body),
            _ => Meaning::Unread(UNREAD_FORM, self.matters(&body)),
        })
    }

    fn plain_macro(&self, count: usize, default: Option<Vec<Token>>, body: Vec<Token>) -> Meaning {
        Meaning::Macro(Rc::new(Macro {
            parameters: count,
            default: default.filter(|_| count > 0),
            matters: self.matters(&body),
            body,
        }))
    }

    /// `\def\k#1#2{...}`.
    fn plain_definition(&mut self, command: &str) -> Option<Definition> {
        let name = self.target()?;
        let mut count = Some(0);
        while !self.is_brace_next() {
            count = match (self.code()?.kind, count) {
                (Kind::Parameter(number), Some(count)) if count + 1 == number => Some(number),
                _ => None,
            };
        }
        let body = self.argument()?;
        let matters = self.matters(&body);
        let expands = |token: &Token| {
            let meaning = self.meaning(token.name());
            !matches!(meaning, None | Some(Meaning::Same(_)))
        };
        let is_expanded = has("edef xdef", command) && body.iter().any(expands);
        let meaning = match count {
            None => Meaning::Unread(DELIMITED, matters),
            Some(_) if is_expanded => Meaning::Unread(EXPANDED, matters),
            Some(parameters) => self.plain_macro(parameters, None, body),
        };
        self.is_global |= command.starts_with(['g', 'x']);
        Some((name, meaning))
    }

    /// `\let\k=\dot`.
    fn same_meaning(&mut self) -> Option<Definition> {
        let name = self.target()?;
        self.takes(&Kind::Character('='));
        let token = self.code()?;
        let earlier = self.meaning(token.name()).cloned();
        Some((name, earlier.unwrap_or(Meaning::Same(token.kind))))
    }

    /// `\DeclareMathOperator{\sgn}{sgn}`.
    fn operator(&mut self, token: &Token) -> Option<Definition> {
        let (name, text) = (self.target()?, self.argument()?);
        let operator = [Kind::command("operatorname"), Kind::Open].map(|kind| token.with(kind));
        let body = operator
            .into_iter()
            .chain(text)
            .chain([token.with(Kind::Close)]);
        let meaning = match self.is_defined(&name) {
            true => Meaning::Unread(DEFINED_TWICE, false),
            false => self.plain_macro(0, None, body.collect()),
        };
        Some((name, meaning))
    }

    /// `\newif\ifdraft`, with `\drafttrue` and `\draftfalse`.
    fn switch(&mut self, token: &Token) -> Option<Definition> {
        let name = self.target()?;
        let stem = name.strip_prefix("if").unwrap_or(&name).to_owned();
        for value in ["true", "false"] {
            let body =
                ["let", &name, &format!("if{value}")].map(|name| token.with(Kind::command(name)));
            let meaning = self.plain_macro(0, None, body.to_vec());
            self.define(format!("{stem}{value}"), meaning);
        }
        Some((name, Meaning::Same(Kind::command("iffalse"))))
    }

    /// `\newenvironment{name}[2][default]{begin}{end}`.
    fn environment(&mut self, command: &str) -> Option<Definition> {
        self.takes(&Kind::Character('*'));
        let name = spelled(&self.argument()?);
        let (mut begin, end) = (self.bracketed_definition()?, self.argument()?);
        if command == "newenvironment" && self.meaning(&name).is_some() {
            begin = Meaning::Unread(DEFINED_TWICE, true);
        }
        let end = self.plain_macro(0, None, end);
        self.define(format!("end{name}"), end);
        Some((name, begin))
    }

    fn unread_definition(&mut self, token: &Token) -> Option<Definition> {
        let name = self.target()?;
        let mut body = self.following_groups(1).unwrap_or_default();
        body.push(token.with(Kind::command(&name)));
        let matters = token.name().contains("Environ") || self.matters(&body);
        Some((name, Meaning::Unread(UNREAD_FORM, matters)))
    }

    /// Whether the printed tokens may contain mathematics, or the end of the document.
    pub(super) fn matters(&self, tokens: &[Token]) -> bool {
        let is_layout = |name: &str| {
            let mut lists = ["layouts", "cases", "documents"].into_iter();
            self.meaning(name).is_some() || lists.any(|list| is_one_of(list, name))
        };
        let matters =
            |(at, token): (usize, &Token)| match (self.meaning(token.name()), token.name()) {
                _ if matches!(token.kind, Kind::Dollar | Kind::Display) => true,
                (Some(Meaning::Macro(found)), _) => found.matters,
                (Some(Meaning::Unread(_, matters)), _) => *matters,
                (Some(Meaning::Same(_) | Meaning::Verbatim), _) => true,
                (None, "[" | "(" | "ddot" | "endinput" | "stop" | "bye") => true,
                (None, "begin" | "end") => {
                    let near = tokens[at + 1..].iter().take(31);
                    let inside = near.take_while(|token| token.kind != Kind::Close);
                    is_layout(&spelled(inside.skip(1)))
                }
                (None, name) => is_in("by command", name),
            };
        tokens.iter().enumerate().any(matters)
    }
}

/// Whether options of siunitx print other digits than are written.
pub(super) fn changes_digits(options: &[Token]) -> bool {
    let text = spelled(options);
    let keys = "round input parse drop fixed-exponent exponent-base evaluate";
    keys.split(' ').any(|key| text.contains(key))
}
