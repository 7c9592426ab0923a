//! Reads candidate terms: `+ - * / ^`, unary signs, parentheses, numbers, names, functions.
//!
//! ```text
//! expression = term { ("+" | "-") term }
//! term       = signed { ("*" | "/") signed }
//! signed     = { "+" | "-" } power
//! power      = atom [ "^" signed ]
//! atom       = number | name | function "(" expression ")" | "(" expression ")"
//! ```
//!
//! `^` binds to the right and more tightly than a sign: `-x^2 = -(x^2)`. The parser keeps its own
//! stack, so nesting is limited by [`ParseLimits`] and never by the machine's; chains of sums and
//! products are handed over whole, so time is near linear in the length of the text.

use super::defined::{Guards, Reading};
use super::lexer::{Token, TokenKind, tokenize};
use super::node::{ExprId, Function};
use super::order::Exponent;
use super::pool::ExprPool;

/// How large a text may be and become.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ParseLimits {
    /// Longest text, in bytes.
    pub length: usize,
    /// Most open parentheses and pending exponents.
    pub depth: usize,
    /// Largest magnitude of a constant exponent.
    pub exponent: u32,
}

impl Default for ParseLimits {
    fn default() -> ParseLimits {
        ParseLimits {
            length: 65_536,
            depth: 200,
            exponent: 1_000,
        }
    }
}

/// Why a text is not a term, and where.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("character {position}: {kind}")]
pub struct ParseError {
    /// Character of the text, counted from 1.
    pub position: usize,
    /// What is there and what could be; texts are cut after 40 characters.
    pub kind: ParseErrorKind,
}

/// The fault at a place of a text.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs, reason = "each variant's message names its fields")]
pub enum ParseErrorKind {
    /// A character that the grammar does not have.
    #[error("found `{}`, expected {}", .0.escape_debug(), spelling(*.0))]
    Character(char),
    /// A number that cannot be read, or is too large or too small for a float.
    #[error("found `{0}`, expected a finite number that floats hold (5e-324 to 1.8e308 in size)")]
    Number(String),
    /// A part that has no value, such as `1/0` or `log(-2)`.
    #[error("`{0}` has no value")]
    NoValue(String),
    /// A token in quotes, or `end of text`, in the wrong place.
    #[error("found {found}, expected {expected}")]
    Unexpected {
        found: String,
        expected: &'static str,
    },
    /// A variable that is not allowed here.
    #[error("found the unknown name `{0}`")]
    UnknownName(String),
    /// A call of something that is not a function.
    #[error("found `{0}`, expected sin, cos, tan, tanh, exp, log, sqrt, abs or sign")]
    UnknownFunction(String),
    /// The text is longer than allowed.
    #[error("found a text of {found} bytes, expected at most {limit}")]
    TooLong { found: usize, limit: usize },
    /// Too many open parentheses and exponents.
    #[error("found too many open parentheses and exponents, expected at most {0}")]
    TooDeep(usize),
    /// A constant exponent is larger than allowed.
    #[error("found the exponent {found}, expected at most {limit}")]
    Exponent { found: String, limit: u32 },
}

impl ParseErrorKind {
    pub(super) fn at(self, position: usize) -> ParseError {
        ParseError {
            position,
            kind: self,
        }
    }
}

/// What is written instead of a character that the grammar does not have.
fn spelling(character: char) -> &'static str {
    match character {
        '²' | '³' | '⁴'..='⁹' | '⁻' => "a power such as `^2`",
        'ż' | '\u{307}' => "a velocity such as `dz1`",
        '₀'..='₉' => "digits such as `z1`",
        'π' => "3.141592653589793",
        _ => "numbers, names, functions and + - * / ^ ( )",
    }
}

/// The start of a token, for messages.
pub(super) fn short(token: &str) -> String {
    token.chars().take(40).collect()
}

impl ExprPool {
    /// Reads an expression over the names that `allowed` accepts, within the default limits.
    ///
    /// Function names are never variables. What [`display`](ExprPool::display) prints reads back
    /// to the same id.
    ///
    /// # Errors
    /// [`ParseError`] with the position, what was found and what was expected.
    pub fn parse(
        &mut self,
        text: &str,
        allowed: &dyn Fn(&str) -> bool,
    ) -> Result<ExprId, ParseError> {
        self.parse_within(text, allowed, &|_| None, ParseLimits::default())
    }

    /// As [`parse`](ExprPool::parse), within given limits and with symbols for numbers: where
    /// `literal` gives a name for the text of a number, it is the symbol of that name, so that it is
    /// never rounded or folded.
    ///
    /// # Errors
    /// As [`parse`](ExprPool::parse).
    pub fn parse_within(
        &mut self,
        text: &str,
        allowed: &dyn Fn(&str) -> bool,
        literal: &dyn Fn(&str) -> Option<String>,
        limits: ParseLimits,
    ) -> Result<ExprId, ParseError> {
        let reading = self.read_within(text, allowed, literal, limits, None)?;
        Ok(reading.expr)
    }

    /// As [`parse_within`](ExprPool::parse_within), for texts that users write: constant parts that have no value, such
    /// as `0/0` or `0*log(0)`, are refused.
    ///
    /// # Errors
    /// As [`parse`](ExprPool::parse), and [`ParseErrorKind::NoValue`].
    pub fn parse_defined(
        &mut self,
        text: &str,
        allowed: &dyn Fn(&str) -> bool,
        literal: &dyn Fn(&str) -> Option<String>,
        limits: ParseLimits,
    ) -> Result<Reading, ParseError> {
        self.read_within(text, allowed, literal, limits, Some(Guards::default()))
    }

    fn read_within(
        &mut self,
        text: &str,
        allowed: &dyn Fn(&str) -> bool,
        literal: &dyn Fn(&str) -> Option<String>,
        limits: ParseLimits,
        guards: Option<Guards>,
    ) -> Result<Reading, ParseError> {
        if text.len() > limits.length {
            let (found, limit) = (text.len(), limits.length);
            return Err(ParseErrorKind::TooLong { found, limit }.at(1));
        }
        let mut parser = Parser {
            pool: self,
            allowed,
            literal,
            limits,
            text,
            tokens: tokenize(text)?,
            next: 0,
            groups: vec![Group::default()],
            depth: 0,
            guards,
        };
        loop {
            if let Some(operand) = parser.read_operand()?
                && let Some(expr) = parser.after_operand(operand)?
            {
                let guards = parser.guards.map(|guards| guards.found);
                let guards = guards.unwrap_or_default();
                return Ok(Reading { expr, guards });
            }
        }
    }
}

/// What a group of terms was opened by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Opener {
    #[default]
    Text,
    Parenthesis,
    Call(Function),
}

/// An expression being read: finished terms, the factors of the current term, and the operand
/// being read, which may be an exponent of pending powers.
#[derive(Default)]
struct Group {
    opener: Opener,
    /// Where the group, the current term and the current operand start; 0 before their first token.
    start: usize,
    term_start: usize,
    operand_start: usize,
    terms: Vec<ExprId>,
    factors: Vec<ExprId>,
    /// The current term is subtracted.
    subtract: bool,
    /// The current operand divides.
    divide: bool,
    /// The current operand has a minus before it.
    negative: bool,
    /// Bases whose exponent is being read, each with its own sign.
    powers: Vec<(ExprId, bool)>,
}

struct Parser<'p> {
    pool: &'p mut ExprPool,
    allowed: &'p dyn Fn(&str) -> bool,
    /// The symbol that stands for the text of a number.
    literal: &'p dyn Fn(&str) -> Option<String>,
    limits: ParseLimits,
    text: &'p str,
    tokens: Vec<Token<'p>>,
    /// Index of the token that is read next.
    next: usize,
    groups: Vec<Group>,
    /// Open groups and pending powers.
    depth: usize,
    /// What has to have a value, where that is asked.
    guards: Option<Guards>,
}

impl<'p> Parser<'p> {
    fn token(&mut self) -> Token<'p> {
        self.next += 1;
        self.tokens[self.next - 1]
    }

    /// Reads signs and one atom; `None` if it opened a group instead.
    fn read_operand(&mut self) -> Result<Option<ExprId>, ParseError> {
        let token = self.token();
        let group = self.group();
        for start in [&mut group.term_start, &mut group.operand_start] {
            if *start == 0 {
                *start = token.position;
            }
        }
        match token.kind {
            TokenKind::Plus => Ok(None),
            TokenKind::Minus => {
                let group = self.group();
                group.negative = !group.negative;
                Ok(None)
            }
            TokenKind::Number(number) => Ok(Some(match (self.literal)(token.text) {
                Some(name) => {
                    if let Some(guards) = &mut self.guards {
                        let symbol = self.pool.symbol_id(&name);
                        guards.decimals.insert(symbol, token.text.to_owned());
                    }
                    self.pool.symbol(&name)
                }
                None => self.pool.constant(number),
            })),
            TokenKind::Open => self.open(Opener::Parenthesis, &token).map(|()| None),
            TokenKind::Name(name) => {
                let after = self.tokens[self.next];
                let called = after.kind == TokenKind::Open;
                match Function::by_name(name) {
                    Some(function) if called => {
                        self.next += 1;
                        self.open(Opener::Call(function), &token).map(|()| None)
                    }
                    Some(_) => Err(unexpected(&after, "`(` after a function")),
                    None if called => {
                        Err(ParseErrorKind::UnknownFunction(short(name)).at(token.position))
                    }
                    None if (self.allowed)(name) => Ok(Some(self.pool.symbol(name))),
                    None => Err(ParseErrorKind::UnknownName(short(name)).at(token.position)),
                }
            }
            TokenKind::Times
            | TokenKind::Divide
            | TokenKind::Caret
            | TokenKind::Close
            | TokenKind::End => Err(unexpected(&token, "a number, a name, `(` or a sign")),
        }
    }

    /// Reads what follows an operand, closing groups as long as they end; the finished
    /// expression at the end of the text.
    fn after_operand(&mut self, mut operand: ExprId) -> Result<Option<ExprId>, ParseError> {
        loop {
            let token = &self.token();
            if token.kind == TokenKind::Caret {
                self.deepen(token)?;
                let group = self.group();
                let negative = std::mem::take(&mut group.negative);
                group.powers.push((operand, negative));
                return Ok(None);
            }
            self.finish_operand(operand, token)?;
            let group = self.group();
            match (token.kind, group.opener) {
                (TokenKind::Times, _) => return Ok(None),
                (TokenKind::Divide, _) => {
                    group.divide = true;
                    return Ok(None);
                }
                (TokenKind::Plus | TokenKind::Minus, _) => {
                    self.finish_term();
                    self.group().subtract = token.kind == TokenKind::Minus;
                    return Ok(None);
                }
                (TokenKind::Close, Opener::Parenthesis | Opener::Call(_)) => {
                    operand = self.close(token)?;
                }
                (TokenKind::End, Opener::Text) => {
                    self.finish_term();
                    let terms = std::mem::take(&mut self.group().terms);
                    return Ok(Some(self.pool.sum(&terms)));
                }
                (_, Opener::Text) => return Err(unexpected(token, "an operator or the end")),
                (_, _) => return Err(unexpected(token, "an operator or `)`")),
            }
        }
    }

    fn group(&mut self) -> &mut Group {
        self.groups
            .last_mut()
            .expect("the outermost group is never closed")
    }

    fn deepen(&mut self, token: &Token) -> Result<(), ParseError> {
        self.depth += 1;
        if self.depth > self.limits.depth {
            return Err(ParseErrorKind::TooDeep(self.limits.depth).at(token.position));
        }
        Ok(())
    }

    fn open(&mut self, opener: Opener, token: &Token) -> Result<(), ParseError> {
        self.deepen(token)?;
        self.groups.push(Group {
            opener,
            start: token.position,
            ..Group::default()
        });
        Ok(())
    }

    /// Ends the innermost group and gives its value.
    fn close(&mut self, token: &Token) -> Result<ExprId, ParseError> {
        self.finish_term();
        let group = self.groups.pop().expect("a group with an opener is open");
        self.depth -= 1;
        let sum = self.pool.sum(&group.terms);
        match group.opener {
            Opener::Call(function) => {
                let end = token.position + token.text.len();
                self.guarded(group.start, end, |guards, pool| {
                    guards.call(pool, function, sum)
                })?;
                Ok(self.pool.apply(function, sum))
            }
            Opener::Parenthesis | Opener::Text => Ok(sum),
        }
    }

    /// Refuses the part of the text from `start` up to `end` if it has no value.
    fn guarded(
        &mut self,
        start: usize,
        end: usize,
        has_value: impl FnOnce(&mut Guards, &mut ExprPool) -> bool,
    ) -> Result<(), ParseError> {
        let Some(guards) = &mut self.guards else {
            return Ok(());
        };
        if has_value(guards, self.pool) {
            return Ok(());
        }
        let found = self.text[start - 1..end - 1].trim_end();
        Err(ParseErrorKind::NoValue(short(found)).at(start))
    }

    /// Applies pending powers and signs, and puts the operand among the factors.
    fn finish_operand(&mut self, atom: ExprId, token: &Token) -> Result<(), ParseError> {
        let mut value = atom;
        loop {
            let negative = std::mem::take(&mut self.group().negative);
            value = self.pool.negated_if(negative, value);
            let Some((base, negative)) = self.group().powers.pop() else {
                break;
            };
            self.depth -= 1;
            value = self.checked_pow(base, value, token)?;
            self.group().negative = negative;
        }
        if std::mem::take(&mut self.group().divide) {
            let start = self.group().term_start;
            self.guarded(start, token.position, |guards, pool| {
                guards.division(pool, value)
            })?;
            let dividend = self.group().factors.pop();
            let dividend = dividend.expect("a divisor follows a factor");
            value = self.pool.div(dividend, value);
        }
        self.group().factors.push(value);
        self.group().operand_start = 0;
        Ok(())
    }

    fn checked_pow(
        &mut self,
        base: ExprId,
        exponent: ExprId,
        token: &Token,
    ) -> Result<ExprId, ParseError> {
        let limit = self.limits.exponent;
        let too_large = |found: super::Number| {
            if found.to_f64().abs() > f64::from(limit) {
                let found = found.to_string();
                return Err(ParseErrorKind::Exponent { found, limit }.at(token.position));
            }
            Ok(())
        };
        if let Some(number) = self.pool.as_number(exponent) {
            too_large(number)?;
        }
        let start = self.group().operand_start;
        self.guarded(start, token.position, |guards, pool| {
            guards.power(pool, base, exponent)
        })?;
        let power = self.pool.pow(base, exponent);
        for factor in self.pool.factors_of(power) {
            if let (_, Exponent::Number(number)) = self.pool.base_and_exponent(*factor) {
                too_large(number)?;
            }
        }
        Ok(power)
    }

    fn finish_term(&mut self) {
        let group = self.group();
        let factors = std::mem::take(&mut group.factors);
        let subtract = std::mem::take(&mut group.subtract);
        group.term_start = 0;
        let term = self.pool.product(&factors);
        let term = self.pool.negated_if(subtract, term);
        self.group().terms.push(term);
    }
}

fn unexpected(token: &Token, expected: &'static str) -> ParseError {
    let found = match token.kind {
        TokenKind::End => "end of text".to_owned(),
        _ => format!("`{}`", short(token.text)),
    };
    ParseErrorKind::Unexpected { found, expected }.at(token.position)
}

#[cfg(test)]
#[path = "parse_tests.rs"]
mod tests;
