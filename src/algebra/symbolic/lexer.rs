//! Splits the text of a term into tokens.

use super::number::Number;
use super::parse::{ParseError, ParseErrorKind, short};

/// A token and where it starts.
#[derive(Clone, Debug, PartialEq)]
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
            '*' => (TokenKind::Times, 1),
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
        // Tokens are ASCII: bytes are characters.
        position += length;
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

/// The value of a number token: exact if it is written as an integer that fits.
fn read_number(token: &str) -> Option<Number> {
    if token.bytes().all(|byte| byte.is_ascii_digit())
        && let Ok(integer) = token.parse::<i64>()
    {
        return Some(Number::integer(integer));
    }
    Number::from_f64(token.parse().ok()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kinds(text: &str) -> Vec<TokenKind<'_>> {
        tokenize(text)
            .expect("test text has only known characters")
            .into_iter()
            .map(|token| token.kind)
            .collect()
    }

    fn float(value: f64) -> TokenKind<'static> {
        TokenKind::Number(Number::from_f64(value).expect("finite"))
    }

    #[test]
    fn numbers_read_in_all_spellings() {
        let numbers = ["0.36", ".36", "36e-2", "3.6E-1", "0.036e+1"];
        for text in numbers {
            assert_eq!(kinds(text), [float(0.36), TokenKind::End], "{text}");
        }
        assert_eq!(kinds("2."), [float(2.0), TokenKind::End]);
        assert_eq!(
            kinds("9007199254740993")[0],
            TokenKind::Number(Number::integer(9_007_199_254_740_993))
        );
    }

    #[test]
    fn exponent_without_digits_is_a_name() {
        let (two, name, end) = (float(2.0), TokenKind::Name("e"), TokenKind::End);
        assert_eq!(kinds("2e"), [two, name, end]);
        assert_eq!(kinds("2e+"), [two, name, TokenKind::Plus, end]);
    }

    #[test]
    fn names_may_have_dotted_parts() {
        assert_eq!(kinds("body.x"), [TokenKind::Name("body.x"), TokenKind::End]);
        assert_eq!(kinds("z_1"), [TokenKind::Name("z_1"), TokenKind::End]);
    }

    #[test]
    fn number_that_overflows_or_is_a_lone_point_is_refused() {
        for text in ["1e999", "."] {
            assert_eq!(
                tokenize(text),
                Err(ParseErrorKind::Number(text.to_owned()).at(1))
            );
        }
    }

    #[test]
    fn positions_count_characters() {
        let tokens = tokenize("a  + 12").expect("known characters");
        let positions: Vec<usize> = tokens.iter().map(|token| token.position).collect();
        assert_eq!(positions, [1, 4, 6, 8]);
        assert_eq!(tokenize("x é"), Err(ParseErrorKind::Character('é').at(3)));
    }
}
