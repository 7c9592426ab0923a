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
//! `^` binds to the right and more tightly than a sign: `-x^2 = -(x^2)`. Each rule is a function; nesting is limited.
//! Chains of sums and products are handed over whole, so time is near linear in the length of the text.

use super::*;

type Result<T, E = ParseError> = std::result::Result<T, E>;

/// Longest text, in bytes.
const MAX_LENGTH: usize = 65_536;
/// Most open parentheses and pending exponents.
const MAX_DEPTH: usize = 200;
/// Largest magnitude of a constant exponent.
const MAX_EXPONENT: u32 = 1_000;

type Literal<'p> = &'p dyn Fn(&mut ExprPool, &str) -> Option<ExprId>;

/// Why a text is not a term, and where.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("character {position}: {kind}")]
pub struct ParseError {
    /// Character of the text, counted from 1.
    pub position: usize,
    /// The text found and the expected one; texts are cut after 40 characters.
    pub kind: ParseErrorKind,
}

/// The fault at a place of a text.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ParseErrorKind {
    #[error("found `{}`, expected {}", .0.escape_debug(), spelling(*.0))]
    Character(char),
    #[error("found `{0}`, expected a finite number that floats hold (5e-324 to 1.8e308 in size)")]
    Number(String),
    #[error("`{0}` has no value")]
    NoValue(String),
    #[error("found {found}, expected {expected}")]
    Unexpected {
        found: String,
        expected: &'static str,
    },
    #[error("found the unknown name `{0}`")]
    UnknownName(String),
    #[error("found `{found}`, expected {expected}", found = .0, expected = function_names())]
    UnknownFunction(String),
    #[error("found a text of {found} bytes, expected at most {limit}")]
    TooLong { found: usize, limit: usize },
    #[error("found too many open parentheses and exponents, expected at most {0}")]
    TooDeep(usize),
    #[error("found the exponent {found}, expected at most {limit}")]
    Exponent { found: String, limit: u32 },
}

impl ParseErrorKind {
    fn at(self, text: &str, start: usize) -> ParseError {
        ParseError {
            position: text[..start].chars().count() + 1,
            kind: self,
        }
    }
}

/// Replacement for a character that the grammar does not have.
fn spelling(character: char) -> &'static str {
    match character {
        '²' | '³' | '⁴'..='⁹' | '⁻' => "a power such as `^2`",
        'ż' | '\u{307}' => "a velocity such as `dz1`",
        '₀'..='₉' => "digits such as `z1`",
        'π' => "3.141592653589793",
        _ => "numbers, names, functions and + - * / ^ ( )",
    }
}

fn function_names() -> String {
    let [names @ .., last] = Function::ALL.map(Function::name);
    format!("{} or {last}", names.join(", "))
}

fn short(token: &str) -> String {
    token.chars().take(40).collect()
}

impl ExprPool {
    /// Reads an expression over the names that `allowed` accepts; function names are never variables. The text printed
    /// by [`display`](ExprPool::display) reads back to the same id.
    ///
    /// # Errors
    /// [`ParseError`] with the position, the text found and the expected text.
    pub fn parse(&mut self, text: &str, allowed: &dyn Fn(&str) -> bool) -> Result<ExprId> {
        Parser::of(self, text, allowed, &|_, _| None)?.expression(TokenKind::End)
    }

    /// As [`parse`](ExprPool::parse), but refuses constant parts without a value, such as `0/0` or `0*log(0)`.
    /// `literal` gives expressions for the texts of numbers, such as their [`decimal`](ExprPool::decimal).
    ///
    /// # Errors
    /// As [`parse`](ExprPool::parse), and [`ParseErrorKind::NoValue`].
    pub fn parse_defined(
        &mut self,
        text: &str,
        allowed: &dyn Fn(&str) -> bool,
        literal: &dyn Fn(&mut ExprPool, &str) -> Option<ExprId>,
    ) -> Result<Reading> {
        let mut parser = Parser::of(self, text, allowed, literal)?;
        parser.needs_values = true;
        Ok(Reading {
            expr: parser.expression(TokenKind::End)?,
            guards: parser.guards.found,
        })
    }
}

struct Parser<'p> {
    pool: &'p mut ExprPool,
    allowed: &'p dyn Fn(&str) -> bool,
    /// Expression for the text of a number, if it is not the number's value.
    literal: Literal<'p>,
    text: &'p str,
    tokens: Vec<Token<'p>>,
    next: usize,
    depth: usize,
    /// Whether constant parts without a value are refused, and the expressions that must have a value.
    needs_values: bool,
    guards: Guards,
}

impl<'p> Parser<'p> {
    fn of(
        pool: &'p mut ExprPool,
        text: &'p str,
        allowed: &'p dyn Fn(&str) -> bool,
        literal: Literal<'p>,
    ) -> Result<Self> {
        if text.len() > MAX_LENGTH {
            let (found, limit) = (text.len(), MAX_LENGTH);
            return Err(ParseErrorKind::TooLong { found, limit }.at(text, 0));
        }
        Ok(Parser {
            tokens: tokenize(text)?,
            pool,
            allowed,
            literal,
            text,
            next: 0,
            depth: 0,
            needs_values: false,
            guards: Guards::default(),
        })
    }

    fn peek(&self) -> Token<'p> {
        self.tokens[self.next]
    }

    fn token(&mut self) -> Token<'p> {
        self.next += 1;
        self.tokens[self.next - 1]
    }

    /// A sum of terms up to a closing parenthesis or the end, which is read too.
    fn expression(&mut self, end: TokenKind) -> Result<ExprId> {
        let (mut terms, mut is_subtracted) = (Vec::new(), false);
        loop {
            let term = self.term()?;
            terms.push(self.pool.negated_if(is_subtracted, term));
            let token = self.token();
            is_subtracted = match token.kind {
                TokenKind::Sign('+') => false,
                TokenKind::Sign('-') => true,
                kind if kind == end => return Ok(self.pool.sum(&terms)),
                _ if end == TokenKind::End => {
                    return Err(self.unexpected(token, "an operator or the end"));
                }
                _ => return Err(self.unexpected(token, "an operator or `)`")),
            };
        }
    }

    fn term(&mut self) -> Result<ExprId> {
        let start = self.peek().start;
        let mut factors = vec![self.signed(start)?];
        loop {
            let is_divisor = match self.peek().kind {
                TokenKind::Sign('*') => false,
                TokenKind::Sign('/') => true,
                _ => return Ok(self.pool.product(&factors)),
            };
            self.next += 1;
            let operand_start = self.peek().start;
            let mut value = self.signed(operand_start)?;
            if is_divisor {
                self.guarded(start, |guards, pool| guards.division(pool, value))?;
                let dividend = factors.pop().expect("a divisor follows a factor");
                value = self.pool.div(dividend, value);
            }
            factors.push(value);
        }
    }

    fn signed(&mut self, start: usize) -> Result<ExprId> {
        let mut is_negative = false;
        while let TokenKind::Sign(sign @ ('+' | '-')) = self.peek().kind {
            self.next += 1;
            is_negative ^= sign == '-';
        }
        let mut value = self.atom()?;
        let caret = self.peek();
        if caret.kind == TokenKind::Sign('^') {
            self.next += 1;
            self.deepen(caret)?;
            let exponent = self.signed(start)?;
            self.depth -= 1;
            value = self.checked_pow(value, exponent, start)?;
        }
        Ok(self.pool.negated_if(is_negative, value))
    }

    fn atom(&mut self) -> Result<ExprId> {
        let token = self.token();
        match token.kind {
            TokenKind::Number(number) => {
                let literal = (self.literal)(self.pool, token.text);
                Ok(literal.unwrap_or_else(|| self.pool.constant(number)))
            }
            TokenKind::Sign('(') => self.parenthesis(token),
            TokenKind::Name => self.name(token),
            _ => Err(self.unexpected(token, "a number, a name, `(` or a sign")),
        }
    }

    fn name(&mut self, token: Token<'p>) -> Result<ExprId> {
        let (name, after) = (token.text, self.peek());
        let is_called = after.kind == TokenKind::Sign('(');
        let refused = match Function::by_name(name) {
            Some(function) if is_called => {
                self.next += 1;
                let argument = self.parenthesis(token)?;
                self.guarded(token.start, |guards, pool| {
                    guards.call(pool, function, argument)
                })?;
                return Ok(self.pool.apply(function, argument));
            }
            Some(_) => return Err(self.unexpected(after, "`(` after a function")),
            None if is_called => ParseErrorKind::UnknownFunction(short(name)),
            None if (self.allowed)(name) => return Ok(self.pool.symbol(name)),
            None => ParseErrorKind::UnknownName(short(name)),
        };
        Err(refused.at(self.text, token.start))
    }

    /// The expression between parentheses; the first is read, and is reported with `opener` if it is one too many.
    fn parenthesis(&mut self, opener: Token<'p>) -> Result<ExprId> {
        self.deepen(opener)?;
        let expr = self.expression(TokenKind::Sign(')'))?;
        self.depth -= 1;
        Ok(expr)
    }

    fn deepen(&mut self, token: Token) -> Result<()> {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return Err(ParseErrorKind::TooDeep(MAX_DEPTH).at(self.text, token.start));
        }
        Ok(())
    }

    /// Refuses the text from `start` up to the next token if it has no value.
    fn guarded(
        &mut self,
        start: usize,
        has_value: impl FnOnce(&mut Guards, &mut ExprPool) -> bool,
    ) -> Result<()> {
        let end = self.peek().start;
        if !self.needs_values || has_value(&mut self.guards, self.pool) {
            return Ok(());
        }
        let found = self.text[start..end].trim_end();
        Err(ParseErrorKind::NoValue(short(found)).at(self.text, start))
    }

    fn checked_pow(&mut self, base: ExprId, exponent: ExprId, start: usize) -> Result<ExprId> {
        let (text, limit, after) = (self.text, MAX_EXPONENT, self.peek().start);
        let too_large = |found: Number| {
            if found.to_f64().abs() > f64::from(limit) {
                let found = found.to_string();
                return Err(ParseErrorKind::Exponent { found, limit }.at(text, after));
            }
            Ok(())
        };
        if let Some(number) = self.pool.as_number(exponent) {
            too_large(number)?;
        }
        self.guarded(start, |guards, pool| guards.power(pool, base, exponent))?;
        let power = self.pool.pow(base, exponent);
        for factor in self.pool.factors_of(power) {
            if let (_, Exponent::Number(number)) = self.pool.base_and_exponent(*factor) {
                too_large(number)?;
            }
        }
        Ok(power)
    }

    fn unexpected(&self, token: Token, expected: &'static str) -> ParseError {
        let found = match token.kind {
            TokenKind::End => "end of text".to_owned(),
            _ => format!("`{}`", short(token.text)),
        };
        ParseErrorKind::Unexpected { found, expected }.at(self.text, token.start)
    }
}

#[derive(Clone, Copy)]
struct Token<'a> {
    kind: TokenKind,
    start: usize,
    text: &'a str,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum TokenKind {
    Number(Number),
    Name,
    /// An operator or parenthesis in its plain spelling: one of `+-*/^()`.
    Sign(char),
    End,
}

/// All tokens, [`TokenKind::End`] last. Characters outside the grammar are found here, before anything is built.
fn tokenize(text: &str) -> Result<Vec<Token<'_>>> {
    let mut tokens = Vec::new();
    let mut start = 0;
    while let Some(first) = text[start..].chars().next() {
        let rest = &text[start..];
        let mut length = first.len_utf8();
        let kind = match first {
            ' ' | '\t' | '\n' | '\r' => {
                start += 1;
                continue;
            }
            '0'..='9' | '.' => {
                length = number_length(rest);
                let number = &rest[..length];
                let refused = || ParseErrorKind::Number(short(number)).at(text, start);
                TokenKind::Number(read_number(number).ok_or_else(refused)?)
            }
            'a'..='z' | 'A'..='Z' | '_' => {
                length = name_length(rest);
                TokenKind::Name
            }
            '*' if rest.starts_with("**") => {
                length = 2;
                TokenKind::Sign('^')
            }
            '-' | '\u{2212}' => TokenKind::Sign('-'),
            '*' | '·' | '⋅' | '×' => TokenKind::Sign('*'),
            '+' | '/' | '^' | '(' | ')' => TokenKind::Sign(first),
            _ => return Err(ParseErrorKind::Character(first).at(text, start)),
        };
        let text = &rest[..length];
        tokens.push(Token { kind, start, text });
        start += length;
    }
    tokens.push(Token {
        kind: TokenKind::End,
        start,
        text: "",
    });
    Ok(tokens)
}

fn number_length(text: &str) -> usize {
    let n_digits = |text: &str| text.bytes().take_while(u8::is_ascii_digit).count();
    let mut end = n_digits(text);
    if let Some(fraction) = text[end..].strip_prefix('.') {
        end += 1 + n_digits(fraction);
    }
    if let Some(exponent) = text[end..].strip_prefix(['e', 'E']) {
        let sign = usize::from(exponent.starts_with(['+', '-']));
        match n_digits(&exponent[sign..]) {
            0 => {}
            n => end += 1 + sign + n,
        }
    }
    end
}

/// Letters, digits and underscores; parts may be joined by points, as in `body.x`.
fn name_length(text: &str) -> usize {
    let is_word = |byte: &u8| byte.is_ascii_alphanumeric() || *byte == b'_';
    let is_start = |c: char| c.is_ascii_alphabetic() || c == '_';
    let word = |text: &str| text.bytes().take_while(is_word).count();
    let mut end = word(text);
    while let Some(part) = text[end..].strip_prefix('.')
        && part.starts_with(is_start)
    {
        end += 1 + word(part);
    }
    end
}

/// A number token's value, exact if a fitting integer; none if floats would represent it as infinity, or wrongly as
/// zero.
fn read_number(token: &str) -> Option<Number> {
    if token.bytes().all(|byte| byte.is_ascii_digit())
        && let Ok(integer) = token.parse::<i64>()
    {
        return Some(Number::integer(integer));
    }
    let value: f64 = token.parse().ok()?;
    let mantissa = token.split(['e', 'E']).next()?;
    let is_lost = value == 0.0 && mantissa.contains(|digit| ('1'..='9').contains(&digit));
    Number::from_f64(value).filter(|_| !is_lost)
}
