//! The displays of a document, macros expanded.

use std::collections::HashMap;

use super::super::equations::refused;
use super::super::error::ImportError;
use super::derivatives::with_dots;
use super::reader::has;
use super::token::{Kind, Token, group_length};

/// Most tokens that macros may make of one display.
const MAX_EXPANDED: usize = 200_000;
/// Environments that arrange lines of mathematics, in a display of their own or inside one.
pub(super) const LAYOUTS: &str = "equation align gather multline eqnarray flalign alignat displaymath dmath \
    dgroup aligned alignedat split gathered IEEEeqnarray";
/// Environments that are displays of their own as well.
const CASES: &str = "cases dcases";
/// Environments that begin with an argument: a number of columns, or what each column is.
pub(super) const WITH_COLUMNS: &str = "alignat alignedat array IEEEeqnarray";
/// Environments whose contents are no LaTeX.
const VERBATIM: &str = "verbatim Verbatim lstlisting minted comment filecontents";

/// What of a document matters, in its order.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Item {
    /// A comment, or a heading in Markdown.
    Comment(String),
    /// The tokens between the ends of a display.
    Display(Vec<Token>),
    /// The tokens of mathematics inside a paragraph.
    Inline(Vec<Token>),
}

impl Item {
    /// The tokens in which equations are looked for: of a display, or of mathematics in a line.
    pub(super) fn equations(&self, in_lines: bool) -> Option<&[Token]> {
        match self {
            Item::Display(tokens) if !in_lines => Some(tokens),
            Item::Inline(tokens) if in_lines => Some(tokens),
            Item::Comment(_) | Item::Display(_) | Item::Inline(_) => None,
        }
    }
}

/// A macro; without a body if its definition has a form that is not read.
struct Macro {
    parameters: usize,
    body: Option<Vec<Token>>,
}

/// Whether `list` has the word `name`, its star aside.
pub(super) fn is_one_of(list: &str, name: &str) -> bool {
    has(list, name.trim_end_matches('*'))
}

/// Finds the displays.
pub(super) fn items(file: &str, tokens: &[Token]) -> Result<Vec<Item>, ImportError> {
    let mut scanner = Scanner {
        file,
        tokens,
        at: 0,
        macros: HashMap::new(),
    };
    let mut items = Vec::new();
    while let Some(token) = scanner.next() {
        let end = match &token.kind {
            Kind::Comment(text) => {
                items.push(Item::Comment(text.clone()));
                continue;
            }
            Kind::Begin(name) if is_one_of(LAYOUTS, name) || is_one_of(CASES, name) => {
                if is_one_of(WITH_COLUMNS, name) && scanner.peek() == Some(&Kind::Open) {
                    scanner.argument();
                }
                Kind::End(name.clone())
            }
            Kind::Begin(name) if is_one_of(VERBATIM, name) => {
                scanner.until(token, &Kind::End(name.clone()), None)?;
                continue;
            }
            Kind::Command(name) if name == "[" => Kind::Command("]".to_owned()),
            Kind::Display => Kind::Display,
            Kind::Dollar => {
                items.extend(scanner.inline(&Kind::Dollar));
                continue;
            }
            Kind::Command(name) if name == "(" => {
                items.extend(scanner.inline(&Kind::Command(")".to_owned())));
                continue;
            }
            Kind::Command(name) => {
                scanner.definition(name);
                continue;
            }
            _ => continue,
        };
        let nested = matches!(token.kind, Kind::Begin(_)).then_some(&token.kind);
        let display = scanner.until(token, &end, nested)?;
        items.push(Item::Display(with_dots(&scanner.expanded(display)?)));
    }
    Ok(items)
}

struct Scanner<'t> {
    file: &'t str,
    tokens: &'t [Token],
    at: usize,
    macros: HashMap<String, Macro>,
}

impl<'t> Scanner<'t> {
    fn next(&mut self) -> Option<&'t Token> {
        let token = self.tokens.get(self.at);
        self.at += 1;
        token
    }

    fn peek(&self) -> Option<&'t Kind> {
        self.tokens.get(self.at).map(|token| &token.kind)
    }

    /// The tokens up to `end`, which is passed; `nested` opens another of the same.
    fn until(
        &mut self,
        start: &Token,
        end: &Kind,
        nested: Option<&Kind>,
    ) -> Result<&'t [Token], ImportError> {
        let first = self.at;
        let mut depth = 0;
        while let Some(token) = self.next() {
            if token.kind == *end {
                if depth == 0 {
                    return Ok(&self.tokens[first..self.at - 1]);
                }
                depth -= 1;
            } else if Some(&token.kind) == nested {
                depth += 1;
            }
        }
        let found = format!("{} without its end", start.quoted());
        Err(refused(self.file, start.place, found, end.quoted()))
    }

    /// Mathematics inside a paragraph, up to its end, which is passed, with its macros replaced; none whose macros are
    /// not read, since it may be no equation.
    fn inline(&mut self, end: &Kind) -> Option<Item> {
        let rest = &self.tokens[self.at..];
        let is_end = |token: &Token| token.kind == *end || token.kind == Kind::Paragraph;
        let length = rest.iter().position(is_end).unwrap_or(rest.len());
        self.at += length + 1;
        let expanded = self.expanded(&rest[..length]).ok()?;
        Some(Item::Inline(with_dots(&expanded)))
    }

    /// The tokens of a group, or one token; none at the end, or of a group without one, which passes all that is left.
    fn argument(&mut self) -> Option<&'t [Token]> {
        let first = self.at;
        if self.next()?.kind != Kind::Open {
            return Some(&self.tokens[first..=first]);
        }
        let length = group_length(self.tokens[first..].iter());
        self.at = length.map_or(self.tokens.len(), |length| first + length);
        length.map(|_| &self.tokens[first + 1..self.at - 1])
    }

    /// Keeps the macro that a command defines, if it defines one.
    fn definition(&mut self, command: &str) {
        let is_operator = command == "DeclareMathOperator";
        let is_new = matches!(command, "newcommand" | "renewcommand" | "providecommand");
        if !is_operator && !is_new && command != "def" {
            return;
        }
        if self.peek() == Some(&Kind::Character('*')) {
            self.at += 1;
        }
        let Some([token]) = self.argument() else {
            return;
        };
        let Kind::Command(name) = &token.kind else {
            return;
        };
        let parameters = if is_new {
            self.bracketed_count()
        } else {
            self.listed_count()
        };
        let has_default = self.peek() == Some(&Kind::Character('['));
        let Some(body) = self.argument() else { return };
        let body = match is_operator {
            false => body.to_vec(),
            true => {
                let last = &self.tokens[self.at - 1];
                let name = Kind::Command("operatorname".to_owned());
                let mut operator = vec![last.with(name), last.with(Kind::Open)];
                operator.extend_from_slice(body);
                operator.push(last.with(Kind::Close));
                operator
            }
        };
        let is_plain = !has_default && parameters.is_some();
        let entry = Macro {
            parameters: parameters.unwrap_or(0),
            body: is_plain.then_some(body),
        };
        self.macros.insert(name.clone(), entry);
    }

    /// The number in `[2]`; none is zero.
    fn bracketed_count(&mut self) -> Option<usize> {
        if self.peek() != Some(&Kind::Character('[')) {
            return Some(0);
        }
        self.at += 1;
        let count = match self.peek()? {
            Kind::Number(text) => text.parse().ok().filter(|count| *count <= 9),
            _ => None,
        };
        self.at += 2;
        count
    }

    /// How many parameters `\def\name#1#2{` lists; nothing for other text before the brace.
    fn listed_count(&mut self) -> Option<usize> {
        let mut count = Some(0);
        while let Some(kind) = self.peek().filter(|kind| **kind != Kind::Open) {
            count = match kind {
                Kind::Parameter(number) if count.is_some_and(|c| c + 1 == *number) => Some(*number),
                _ => None,
            };
            self.at += 1;
        }
        count
    }

    /// The tokens of a display with its macros replaced; what a macro makes stands at its place.
    fn expanded(&self, display: &[Token]) -> Result<Vec<Token>, ImportError> {
        let mut expanded = Vec::with_capacity(display.len());
        let mut pending: Vec<Token> = display.iter().rev().cloned().collect();
        let mut budget = MAX_EXPANDED;
        while let Some(token) = pending.pop() {
            let found = match &token.kind {
                Kind::Command(name) => self.macros.get(name),
                _ => None,
            };
            let Some(found) = found else {
                expanded.push(token);
                continue;
            };
            let refuse = |found: &str, expected: &str| {
                let found = format!("{}, {found}", token.quoted());
                Err(refused(self.file, token.place, found, expected))
            };
            let Some(body) = &found.body else {
                let form = "a macro with optional or delimited arguments";
                return refuse(form, "a macro with plain arguments");
            };
            let arguments = (0..found.parameters).map(|_| take_argument(&mut pending));
            let Some(arguments) = arguments.collect::<Option<Vec<_>>>() else {
                let expected = "an argument for each parameter";
                return refuse("a macro without its arguments", expected);
            };
            let parts = body.iter().rev().flat_map(|part| match &part.kind {
                Kind::Parameter(number) => match arguments.get(number.wrapping_sub(1)) {
                    Some(argument) => argument.iter().rev().cloned().collect(),
                    None => Vec::new(),
                },
                kind => vec![token.with(kind.clone())],
            });
            let before = pending.len();
            pending.extend(parts.take(budget + 1));
            let passed: usize = arguments.iter().map(Vec::len).sum();
            budget = match budget.checked_sub(1 + passed + pending.len() - before) {
                Some(rest) => rest,
                None => return refuse("a macro that expands without end", "macros that end"),
            };
        }
        Ok(expanded)
    }
}

/// Takes a group without its braces, or one token, from the end of a reversed list.
fn take_argument(pending: &mut Vec<Token>) -> Option<Vec<Token>> {
    if pending.last()?.kind != Kind::Open {
        return pending.pop().map(|token| vec![token]);
    }
    let length = group_length(pending.iter().rev())?;
    let mut group = pending.split_off(pending.len() - length);
    group.reverse();
    Some(group[1..length - 1].to_vec())
}
