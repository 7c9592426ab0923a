//! Splits the text of a term into tokens.

use super::number::Number;
use super::parse::{ParseError, ParseErrorKind, short};

/// A token and where it starts.
#[derive(Clone, Copy)]
pub(super) struct Token<'a> {
    pub(super) kind: TokenKind<'a>,
    /// 1 for the first character.
    pub(super) position: usize,
    /// The text of the token.
    pub(super) text: &'a str,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum TokenKind<'a> {
    Number(Number),
    Name(&'a str),
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
    let mut rest = text;
    let mut position = 1;
    while let Some(first) = rest.chars().next() {
        let (kind, length) = match first {
            ' ' | '\t' | '\n' | '\r' => {
                rest = &rest[1..];
                position += 1;
                continue;
            }
            '0'..='9' | '.' => {
                let length = number_length(rest);
                let number = &rest[..length];
                let refused = || ParseErrorKind::Number(short(number)).at(position);
                let value = read_number(number).ok_or_else(refused)?;
                (TokenKind::Number(value), length)
            }
            'a'..='z' | 'A'..='Z' | '_' => {
                let length = name_length(rest);
                (TokenKind::Name(&rest[..length]), length)
            }
            '+' => (TokenKind::Plus, 1),
            '-' => (TokenKind::Minus, 1),
            '*' if rest.starts_with("**") => (TokenKind::Caret, 2),
            '*' => (TokenKind::Times, 1),
            '\u{2212}' => (TokenKind::Minus, first.len_utf8()),
            '·' | '⋅' | '×' => (TokenKind::Times, first.len_utf8()),
            '/' => (TokenKind::Divide, 1),
            '^' => (TokenKind::Caret, 1),
            '(' => (TokenKind::Open, 1),
            ')' => (TokenKind::Close, 1),
            _ => return Err(ParseErrorKind::Character(first).at(position)),
        };
        let (text, after) = rest.split_at(length);
        tokens.push(Token {
            kind,
            position,
            text,
        });
        position += text.chars().count();
        rest = after;
    }
    tokens.push(Token {
        kind: TokenKind::End,
        position,
        text: "",
    });
    Ok(tokens)
}

/// Digits, a point, digits, and an exponent with at least one digit.
fn number_length(text: &str) -> usize {
    let bytes = text.as_bytes();
    let digits = |from: usize| {
        let count = bytes[from..]
            .iter()
            .take_while(|b| b.is_ascii_digit())
            .count();
        from + count
    };
    let mut end = digits(0);
    if bytes.get(end) == Some(&b'.') {
        end = digits(end + 1);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let exponent_end = digits((end + 1 + sign).min(bytes.len()));
        if exponent_end > end + 1 + sign {
            end = exponent_end;
        }
    }
    end
}

/// Letters, digits and underscores; parts may be joined by points, as in `body.x`.
fn name_length(text: &str) -> usize {
    let bytes = text.as_bytes();
    let is_word = |byte: &u8| byte.is_ascii_alphanumeric() || *byte == b'_';
    let mut end = 0;
    loop {
        end += bytes[end..].iter().take_while(|byte| is_word(byte)).count();
        let joins = bytes.get(end) == Some(&b'.')
            && bytes
                .get(end + 1)
                .is_some_and(|byte| byte.is_ascii_alphabetic() || *byte == b'_');
        if !joins {
            return end;
        }
        end += 1;
    }
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
