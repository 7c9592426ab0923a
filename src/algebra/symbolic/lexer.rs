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
