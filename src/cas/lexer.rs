//! Splits the text of a term into tokens.

use super::number::Number;
use super::parse::{ParseError, ParseErrorKind, short};

/// A token and the byte at which it starts.
#[derive(Clone, Copy)]
pub(super) struct Token<'a> {
    pub(super) kind: TokenKind,
    pub(super) start: usize,
    pub(super) text: &'a str,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum TokenKind {
    Number(Number),
    Name,
    Plus,
    Minus,
    Times,
    Divide,
    Caret,
    Open,
    Close,
    End,
}

/// All tokens of `text`, with [`TokenKind::End`] last. Characters outside the grammar are found
/// here, before anything is built.
pub(super) fn tokenize(text: &str) -> Result<Vec<Token<'_>>, ParseError> {
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
                TokenKind::Caret
            }
            '+' => TokenKind::Plus,
            '-' | '\u{2212}' => TokenKind::Minus,
            '*' | '·' | '⋅' | '×' => TokenKind::Times,
            '/' => TokenKind::Divide,
            '^' => TokenKind::Caret,
            '(' => TokenKind::Open,
            ')' => TokenKind::Close,
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

/// Digits, a point, digits, and an exponent with at least one digit.
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

/// The value of a number token: exact if it is written as an integer that fits; nothing for what floats hold as
/// infinity, or as zero although it is none.
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
