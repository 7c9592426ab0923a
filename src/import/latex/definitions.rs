//! Definitions of macros and environments.

use std::rc::Rc;

use super::super::ImportError;
use super::expander::{Expander, spelled};
use super::reader::has;
use super::scopes::{Macro, Meaning, Refusal};
use super::sections::{CASES, LAYOUTS, is_one_of};
use super::token::{Kind, Token};

/// Commands that LaTeX and amsmath define, so that `\providecommand` leaves them as they are.
const KERNEL: &str = "sin cos tan cot sec csc sinh cosh tanh exp log ln frac dfrac tfrac sqrt dot ddot dddot left right \
    cdot times lvert rvert vert text mathrm operatorname prime partial alpha beta gamma delta epsilon zeta eta theta \
    iota kappa lambda mu nu xi pi rho sigma tau upsilon phi chi psi omega";
pub(super) const DEFINITIONS: &str = "newcommand renewcommand providecommand DeclareRobustCommand def gdef edef xdef let DeclareMathOperator newif";
/// Definitions of macros whose form is not read: the macro that comes next is unknown from there on.
pub(super) const UNREAD: &str = "chardef mathchardef font DeclarePairedDelimiter DeclarePairedDelimiterX DeclareMathSymbol \
    DeclareMathAccent newcommandx renewcommandx LetLtxMacro letcs patchcmd xpatchcmd appto gappto eappto xappto preto \
    gpreto apptocmd pretocmd robustify csdef csgdef csedef csxdef @namedef g@addto@macro NewDocumentCommand \
    RenewDocumentCommand ProvideDocumentCommand DeclareDocumentCommand NewExpandableDocumentCommand NewEnviron \
    RenewEnviron NewDocumentEnvironment RenewDocumentEnvironment";
/// Definitions of environments whose contents are not read.
const VERBATIM: &str =
    "excludecomment excludeversion lstnewenvironment DefineVerbatimEnvironment newverbatim";
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

impl Expander<'_> {
    pub(super) fn follows_definition(&mut self, token: &Token) -> Result<bool, ImportError> {
        let is_definition = self.defines(token);
        match self.scopes.has_changed_rows {
            true => self.refuse(
                token,
                " for all rows among them",
                "a definition before the formula",
            ),
            false => Ok(is_definition),
        }
    }

    fn defines(&mut self, token: &Token) -> bool {
        let command = token.name();
        match command {
            "newcommand" | "renewcommand" | "providecommand" | "DeclareRobustCommand" => {
                self.new_command(command);
            }
            "def" | "gdef" | "edef" | "xdef" => self.plain_definition(command),
            "let" => self.same_meaning(),
            "DeclareMathOperator" => self.operator(token),
            "newif" => self.switch(token),
            "newenvironment" | "renewenvironment" => self.environment(command),
            "sisetup" => {
                let options = self.argument().unwrap_or_default();
                if changes_digits(&options) {
                    self.define("num".to_owned(), Meaning::Unread(CHANGED_DIGITS, false));
                }
            }
            _ if has(VERBATIM, command) => {
                if let Some(name) = self.argument() {
                    self.define(spelled(&name), Meaning::Verbatim);
                }
            }
            _ if has(UNREAD, command) => {
                let Some(name) = self.target() else {
                    return true;
                };
                let body = self.following_groups(1).unwrap_or_default();
                let earlier = token.with(Kind::command(&name));
                let matters =
                    command.contains("Environ") || self.matters(&body) || self.matters(&[earlier]);
                self.define(name, Meaning::Unread(UNREAD_FORM, matters));
            }
            _ => return false,
        }
        true
    }

    fn define(&mut self, name: String, meaning: Meaning) {
        let is_global = std::mem::take(&mut self.is_global);
        self.scopes.define(name, meaning, is_global);
    }

    /// The name of the macro that is defined, behind a star: `\k`, `{\k}`, `\csname k\endcsname`, or a name as text.
    fn target(&mut self) -> Option<String> {
        self.takes(&Kind::Character('*'));
        let argument = self.argument()?;
        match argument.as_slice() {
            [token] if token.is_command("csname") => Some(self.name_to("endcsname")),
            [
                Token {
                    kind: Kind::Command(name),
                    ..
                },
            ] => Some(name.clone()),
            _ => Some(spelled(&argument)),
        }
    }

    fn is_defined(&self, name: &str) -> bool {
        match self.scopes.meaning(name) {
            Some(Meaning::Same(Kind::Command(old))) => {
                !matches!(old.as_str(), "relax" | "undefined" | "@undefined")
            }
            Some(_) => true,
            None => has(KERNEL, name),
        }
    }

    /// `\newcommand{\k}[2][default]{...}` and its kin.
    fn new_command(&mut self, command: &str) {
        let Some(name) = self.target() else { return };
        let Some(meaning) = self.bracketed_definition() else {
            return;
        };
        self.is_global = false;
        match (command, self.is_defined(&name)) {
            ("providecommand", true) => {}
            ("newcommand", true) => {
                let matters = matches!(&meaning, Meaning::Macro(found) if found.matters);
                self.define(name, Meaning::Unread(DEFINED_TWICE, matters));
            }
            _ => self.define(name, meaning),
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

    fn plain_macro(
        &self,
        parameters: usize,
        default: Option<Vec<Token>>,
        body: Vec<Token>,
    ) -> Meaning {
        Meaning::Macro(Rc::new(Macro {
            parameters,
            default: default.filter(|_| parameters > 0),
            matters: self.matters(&body),
            body,
        }))
    }

    /// `\def\k#1#2{...}`.
    fn plain_definition(&mut self, command: &str) {
        let Some(name) = self.target() else { return };
        let mut count = Some(0);
        while !self.is_brace_next() {
            let Some(token) = self.code() else { return };
            count = match token.kind {
                Kind::Parameter(number) if count.is_some_and(|count| count + 1 == number) => {
                    Some(number)
                }
                _ => None,
            };
        }
        let Some(body) = self.argument() else { return };
        let matters = self.matters(&body);
        let expands = |token: &Token| {
            let meaning = self.scopes.meaning(token.name());
            !matches!(meaning, None | Some(Meaning::Same(_)))
        };
        let is_expanded = matches!(command, "edef" | "xdef") && body.iter().any(expands);
        let meaning = match count {
            None => Meaning::Unread(DELIMITED, matters),
            Some(_) if is_expanded => Meaning::Unread(EXPANDED, matters),
            Some(parameters) => self.plain_macro(parameters, None, body),
        };
        self.is_global |= command.starts_with(['g', 'x']);
        self.define(name, meaning);
    }

    /// `\let\k=\dot`.
    fn same_meaning(&mut self) {
        let Some(name) = self.target() else { return };
        self.takes(&Kind::Character('='));
        let Some(token) = self.code() else { return };
        let earlier = self.scopes.meaning(token.name()).cloned();
        self.define(name, earlier.unwrap_or(Meaning::Same(token.kind)));
    }

    /// `\DeclareMathOperator{\sgn}{sgn}`.
    fn operator(&mut self, token: &Token) {
        let (Some(name), Some(text)) = (self.target(), self.argument()) else {
            return;
        };
        let operator = token.with(Kind::command("operatorname"));
        let mut body = vec![operator, token.with(Kind::Open)];
        body.extend(text);
        body.push(token.with(Kind::Close));
        let meaning = match self.is_defined(&name) {
            true => Meaning::Unread(DEFINED_TWICE, false),
            false => self.plain_macro(0, None, body),
        };
        self.define(name, meaning);
    }

    /// `\newif\ifdraft`, with `\drafttrue` and `\draftfalse`.
    fn switch(&mut self, token: &Token) {
        let Some(name) = self.target() else { return };
        let command = |name: &str| token.with(Kind::command(name));
        let stem = name.strip_prefix("if").unwrap_or(&name).to_owned();
        for value in ["true", "false"] {
            let body = ["let", &name, &format!("if{value}")].map(command).to_vec();
            let meaning = self.plain_macro(0, None, body);
            self.define(format!("{stem}{value}"), meaning);
        }
        self.define(name, Meaning::Same(Kind::command("iffalse")));
    }

    /// `\newenvironment{name}[2][default]{begin}{end}`.
    fn environment(&mut self, command: &str) {
        self.takes(&Kind::Character('*'));
        let Some(name) = self.argument() else { return };
        let name = spelled(&name);
        let (Some(begin), Some(end)) = (self.bracketed_definition(), self.argument()) else {
            return;
        };
        let begin = match command {
            "newenvironment" if self.scopes.meaning(&name).is_some() => {
                Meaning::Unread(DEFINED_TWICE, true)
            }
            _ => begin,
        };
        let end = self.plain_macro(0, None, end);
        self.define(format!("end{name}"), end);
        self.define(name, begin);
    }

    /// Whether mathematics, or the end of the document, may be in what tokens print.
    pub(super) fn matters(&self, tokens: &[Token]) -> bool {
        let mut rest = tokens.iter();
        while let Some(token) = rest.next() {
            let found = match (self.scopes.meaning(token.name()), token.name()) {
                _ if matches!(token.kind, Kind::Dollar | Kind::Display) => true,
                (Some(Meaning::Macro(found)), _) => found.matters,
                (Some(Meaning::Unread(_, matters)), _) => *matters,
                (Some(Meaning::Same(_) | Meaning::Verbatim), _) => true,
                (None, "[" | "(" | "ddot" | "endinput" | "stop" | "bye") => true,
                (None, "begin" | "end") => {
                    let near = rest.as_slice().iter().take(31);
                    let inside = near.take_while(|token| token.kind != Kind::Close);
                    let name = spelled(inside.skip(1));
                    let mut lists = [LAYOUTS, CASES, "math document"].into_iter();
                    self.scopes.meaning(&name).is_some() || lists.any(|list| is_one_of(list, &name))
                }
                (None, name) => has("equation eqnarray displaymath", name),
            };
            if found {
                return true;
            }
        }
        false
    }
}

/// Whether options of siunitx print other digits than are written.
pub(super) fn changes_digits(options: &[Token]) -> bool {
    let text = spelled(options);
    let keys = "round input parse drop fixed-exponent exponent-base evaluate";
    keys.split(' ').any(|key| text.contains(key))
}
