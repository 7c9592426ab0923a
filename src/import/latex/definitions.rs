//! Definitions of macros and environments, and conditionals.

use std::collections::BTreeSet;
use std::rc::Rc;

use super::super::error::ImportError;
use super::document::{CASES, LAYOUTS, is_one_of};
use super::expander::{Expander, spelled};
use super::reader::has;
use super::scopes::{Macro, Meaning};
use super::token::{Kind, Token};

/// Commands that LaTeX and amsmath define, so that `\providecommand` leaves them as they are.
const KERNEL: &str = "sin cos tan cot sec csc sinh cosh tanh exp log ln frac dfrac tfrac sqrt dot ddot dddot left right \
    cdot times lvert rvert vert text mathrm operatorname prime partial alpha beta gamma delta epsilon zeta eta theta \
    iota kappa lambda mu nu xi pi rho sigma tau upsilon phi chi psi omega";
/// Definitions of macros that are followed.
const DEFINITIONS: &str = "newcommand renewcommand providecommand DeclareRobustCommand def gdef edef xdef let DeclareMathOperator newif";
/// Definitions of macros whose form is not read: the macro that comes next is unknown from there on.
const UNREAD: &str = "chardef mathchardef font DeclarePairedDelimiter DeclarePairedDelimiterX DeclareMathSymbol \
    DeclareMathAccent newcommandx renewcommandx LetLtxMacro letcs patchcmd xpatchcmd appto gappto eappto xappto preto \
    gpreto apptocmd pretocmd robustify csdef csgdef csedef csxdef @namedef g@addto@macro NewDocumentCommand \
    RenewDocumentCommand ProvideDocumentCommand DeclareDocumentCommand NewExpandableDocumentCommand NewEnviron \
    RenewEnviron NewDocumentEnvironment RenewDocumentEnvironment";
/// Definitions of environments whose contents are not read.
const VERBATIM: &str =
    "excludecomment excludeversion lstnewenvironment DefineVerbatimEnvironment newverbatim";
/// TeX's conditionals.
const CONDITIONALS: &str = "if ifcat ifnum ifdim ifodd ifvmode ifhmode ifmmode ifinner ifvoid ifhbox ifvbox ifx ifeof \
    iftrue iffalse ifcase ifdefined ifcsname iffontchar ifincsname ifpdf ifxetex ifluatex ifPDFTeX ifXeTeX ifLuaTeX";
/// Commands that begin as conditionals do and take arguments, or none.
const WITH_ARGUMENTS: &str =
    "ifdef ifundef ifdefempty ifdefvoid ifdefstring ifdefmacro ifdefequal ifdefcounter";
/// Commands that keep their arguments, for elsewhere or for a condition of their own.
const KEEPING: &str = "AtBeginDocument AtEndDocument AtEndPreamble sbox savebox setbox";
const FOLLOWED: &str =
    "`\\iftrue`, `\\iffalse` or a switch of `\\newif`, or the printed branch alone";

/// Why a macro is not read.
const UNREAD_FORM: (&str, &str) = (
    ", a macro of a form that is not read",
    "`\\newcommand` with plain arguments",
);
const DEFINED_TWICE: (&str, &str) = (
    ", a macro that is defined already where it is defined",
    "`\\renewcommand` for its second definition",
);
const DELIMITED: (&str, &str) = (
    ", a macro with delimited arguments",
    "a macro with plain arguments",
);
const EXPANDED: (&str, &str) = (
    ", a macro whose body is expanded where it is defined",
    "`\\def` or `\\newcommand`",
);
const UNDECIDED: (&str, &str) = (", a macro that is defined under a condition", FOLLOWED);

impl Expander<'_> {
    /// Follows a definition; whether the command is one.
    pub(super) fn follows_definition(&mut self, token: &Token) -> Result<bool, ImportError> {
        let Kind::Command(command) = &token.kind else {
            return Ok(false);
        };
        match command.as_str() {
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
                    let why = ", with options of siunitx that change its digits";
                    self.define(
                        "num".to_owned(),
                        unread((why, "numbers as they are printed"), false),
                    );
                }
            }
            _ if has(VERBATIM, command) => {
                if let Some(name) = self.argument() {
                    self.define(spelled(&name), Meaning::Verbatim);
                }
            }
            _ if has(UNREAD, command) => {
                self.takes(&Kind::Character('*'));
                let Some(name) = self.target() else {
                    return Ok(true);
                };
                let body = self.following_groups(1).unwrap_or_default();
                let earlier = token.with(Kind::Command(name.clone()));
                let matters =
                    command.contains("Environ") || self.matters(&body) || self.matters(&[earlier]);
                self.define(name, unread(UNREAD_FORM, matters));
            }
            _ => return Ok(false),
        }
        Ok(true)
    }

    fn define(&mut self, name: String, meaning: Meaning) {
        let is_global = std::mem::take(&mut self.is_global);
        self.scopes.define(name, meaning, is_global);
    }

    /// The name of the macro that is defined: `\k`, `{\k}`, `\csname k\endcsname`, or a name as text.
    fn target(&mut self) -> Option<String> {
        let argument = self.argument()?;
        match argument.as_slice() {
            [token] if token.is_command("csname") => Some(self.name_to("endcsname")),
            [token] => match &token.kind {
                Kind::Command(name) => Some(name.clone()),
                _ => Some(spelled(&argument)),
            },
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
        self.takes(&Kind::Character('*'));
        let Some(name) = self.target() else { return };
        let Some(meaning) = self.bracketed_definition() else {
            return;
        };
        self.is_global = false;
        match (command, self.is_defined(&name)) {
            ("providecommand", true) => {}
            ("newcommand", true) => {
                let matters = matches!(&meaning, Meaning::Macro(found) if found.matters);
                self.define(name, unread(DEFINED_TWICE, matters));
            }
            _ => self.define(name, meaning),
        }
    }

    /// `[2][default]{...}`.
    fn bracketed_definition(&mut self) -> Option<Meaning> {
        let count = self
            .optional()
            .map(|count| spelled(&count).parse::<usize>());
        let default = match count {
            Some(_) => self.optional(),
            None => None,
        };
        let body = self.argument()?;
        Some(match count.unwrap_or(Ok(0)) {
            Ok(parameters @ 0..=9) => self.plain_macro(parameters, default, body),
            _ => unread(UNREAD_FORM, self.matters(&body)),
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
        while let Some(token) = self.code() {
            count = match token.kind {
                Kind::Open => {
                    self.pending.push(token);
                    break;
                }
                Kind::Parameter(number) if count.is_some_and(|count| count + 1 == number) => {
                    Some(number)
                }
                _ => None,
            };
        }
        let Some(body) = self.argument() else { return };
        let matters = self.matters(&body);
        let expands = |token: &Token| match &token.kind {
            Kind::Command(name) => {
                !matches!(self.scopes.meaning(name), None | Some(Meaning::Same(_)))
            }
            _ => false,
        };
        let is_expanded = matches!(command, "edef" | "xdef") && body.iter().any(expands);
        let meaning = match count {
            None => unread(DELIMITED, matters),
            Some(_) if is_expanded => unread(EXPANDED, matters),
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
        let earlier = match &token.kind {
            Kind::Command(old) => self.scopes.meaning(old).cloned(),
            _ => None,
        };
        self.define(name, earlier.unwrap_or(Meaning::Same(token.kind)));
    }

    /// `\DeclareMathOperator{\sgn}{sgn}`.
    fn operator(&mut self, token: &Token) {
        self.takes(&Kind::Character('*'));
        let (Some(name), Some(text)) = (self.target(), self.argument()) else {
            return;
        };
        let operator = Kind::Command("operatorname".to_owned());
        let mut body = vec![token.with(operator), token.with(Kind::Open)];
        body.extend(text);
        body.push(token.with(Kind::Close));
        let meaning = match self.is_defined(&name) {
            true => unread(DEFINED_TWICE, false),
            false => self.plain_macro(0, None, body),
        };
        self.define(name, meaning);
    }

    /// `\newif\ifdraft`, with `\drafttrue` and `\draftfalse`.
    fn switch(&mut self, token: &Token) {
        let Some(name) = self.target() else { return };
        let command = |name: &str| token.with(Kind::Command(name.to_owned()));
        let stem = name.strip_prefix("if").unwrap_or(&name).to_owned();
        for value in ["true", "false"] {
            let body = ["let", &name, &format!("if{value}")].map(command).to_vec();
            let meaning = self.plain_macro(0, None, body);
            self.define(format!("{stem}{value}"), meaning);
        }
        self.define(name, Meaning::Same(Kind::Command("iffalse".to_owned())));
    }

    /// `\newenvironment{name}[2][default]{begin}{end}`.
    fn environment(&mut self, command: &str) {
        self.takes(&Kind::Character('*'));
        let Some(name) = self.argument() else { return };
        let name = spelled(&name);
        let (Some(begin), Some(end)) = (self.bracketed_definition(), self.argument()) else {
            return;
        };
        let is_again = command == "newenvironment" && self.scopes.meaning(&name).is_some();
        let begin = if is_again {
            unread(DEFINED_TWICE, true)
        } else {
            begin
        };
        let end = self.plain_macro(0, None, end);
        self.define(format!("end{name}"), end);
        self.define(name, begin);
    }

    /// Whether mathematics, or the end of the document, may be in what tokens print.
    pub(super) fn matters(&self, tokens: &[Token]) -> bool {
        tokens
            .iter()
            .enumerate()
            .any(|(at, token)| match &token.kind {
                Kind::Dollar | Kind::Display => true,
                Kind::Command(name) => match (self.scopes.meaning(name), name.as_str()) {
                    (Some(Meaning::Macro(found)), _) => found.matters,
                    (Some(Meaning::Unread { matters, .. }), _) => *matters,
                    (Some(Meaning::Same(_) | Meaning::Verbatim), _) => true,
                    (None, "[" | "(" | "ddot" | "endinput" | "stop" | "bye") => true,
                    (None, "begin" | "end") => {
                        let rest = &tokens[at + 1..tokens.len().min(at + 32)];
                        let end = rest.iter().position(|token| token.kind == Kind::Close);
                        let name = spelled(rest.get(1..end.unwrap_or(1)).unwrap_or_default());
                        let lists = [LAYOUTS, CASES, "math document"];
                        self.scopes.meaning(&name).is_some()
                            || lists.iter().any(|list| is_one_of(list, &name))
                    }
                    (None, name) => has("equation eqnarray displaymath", name),
                },
                _ => false,
            })
    }

    /// Follows a conditional, or gives the token back if it is none.
    pub(super) fn condition(&mut self, token: Token) -> Result<Option<Token>, ImportError> {
        let Kind::Command(name) = &token.kind else {
            return Ok(Some(token));
        };
        let is_negated = std::mem::take(&mut self.is_negated);
        let value = match name.as_str() {
            "fi" if self.branches > 0 => {
                self.branches -= 1;
                return Ok(None);
            }
            "else" | "or" if self.branches > 0 => {
                self.branches -= 1;
                self.skip(&token, false).map(drop)?;
                return Ok(None);
            }
            "fi" | "else" => {
                return self.refuse(
                    &token,
                    " without its conditional",
                    "conditionals in pairs with `\\fi`",
                );
            }
            "iftrue" => true,
            "iffalse" => false,
            "ifmmode" => self.scopes.formula.is_some(),
            name if has(KEEPING, name) || name.starts_with("If") || name.starts_with("@if") => {
                return self.undecided_arguments(&token);
            }
            name if has(WITH_ARGUMENTS, name) => return self.undecided_arguments(&token),
            name if !name.starts_with("if") || name == "iff" => return Ok(Some(token)),
            name if !has(CONDITIONALS, name) && self.is_brace_next() => {
                return self.undecided_arguments(&token);
            }
            _ => {
                let branches = self.skip(&token, false)?;
                return self.undecided(&token, &branches);
            }
        };
        if value != is_negated {
            self.branches += 1;
        } else {
            self.skip(&token, true).map(drop)?;
        }
        Ok(None)
    }

    fn is_brace_next(&mut self) -> bool {
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
            let Kind::Command(name) = &token.kind else {
                passed.push(token);
                continue;
            };
            let name = match self.scopes.meaning(name) {
                None => name.as_str(),
                Some(Meaning::Same(Kind::Command(same))) => same.as_str(),
                Some(_) => "",
            };
            match name {
                "fi" if depth == 0 => return Ok(passed),
                "else" if depth == 0 && stops_at_else => {
                    self.branches += 1;
                    return Ok(passed);
                }
                "fi" => depth -= 1,
                name if has(CONDITIONALS, name) => depth += 1,
                name if name.starts_with("if") && name != "iff" && !has(WITH_ARGUMENTS, name) => {
                    if !self.is_brace_next() {
                        let why = " in text that is not printed";
                        return self.refuse(
                            &token,
                            why,
                            "`\\newif` for it before, or conditionals of TeX",
                        );
                    }
                }
                _ => {}
            }
            passed.push(token);
        }
        self.refuse(start, " without its end", "`\\fi`")
    }

    /// Passes what prints under a condition that is not followed.
    fn undecided(&mut self, token: &Token, tokens: &[Token]) -> Result<Option<Token>, ImportError> {
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
                    self.scopes
                        .define(name.clone(), unread(UNDECIDED, matters), true);
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
        self.unread(
            token,
            ", a conditional that is not followed",
            FOLLOWED,
            matters,
        )
    }

    fn undecided_arguments(&mut self, token: &Token) -> Result<Option<Token>, ImportError> {
        match self.following_groups(6) {
            Some(arguments) => self.undecided(token, &arguments),
            None => Ok(Some(token.clone())),
        }
    }

    /// The groups that follow, behind at most so many other tokens; nothing is passed if there is none.
    fn following_groups(&mut self, most: usize) -> Option<Vec<Token>> {
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

fn unread((why, expected): (&'static str, &'static str), matters: bool) -> Meaning {
    Meaning::Unread {
        why,
        expected,
        matters,
    }
}

/// Whether options of siunitx print other digits than are written.
pub(super) fn changes_digits(options: &[Token]) -> bool {
    let text = spelled(options);
    ["round", "input", "parse", "drop", "fixed-exponent"]
        .iter()
        .any(|key| text.contains(key))
}
