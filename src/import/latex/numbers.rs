//! Numbers: literals, powers of ten, `\num`.

use super::reader::{Digits, Last, Read, Reader};
use super::token::Kind;

impl Reader<'_> {
    /// The literal of a number: a power of ten behind it goes into it, and an integer that the
    /// document has rounded gets a point or an exponent, so that it counts as rounded.
    pub(super) fn literal(&mut self, text: &str, leads: bool) -> String {
        if let Some(exponent) = self.power_of_ten()
            && !text.contains(['e', 'E'])
        {
            return format!("{text}e{exponent}");
        }
        let is_integer = text.bytes().all(|byte| byte.is_ascii_digit());
        match self.digits {
            Some(digits) if leads && is_integer && text != "0" => match digits {
                Digits::Decimals(0) => format!("{text}."),
                Digits::Significant(count) if text.len() == count => format!("{text}."),
                Digits::Significant(count) if text.len() > count => {
                    let (kept, zeros) = text.split_at(count.max(1));
                    match zeros.bytes().all(|byte| byte == b'0') {
                        true => format!("{kept}e{}", zeros.len()),
                        false => text.to_owned(),
                    }
                }
                Digits::Decimals(_) | Digits::Significant(_) => text.to_owned(),
            },
            _ => text.to_owned(),
        }
    }

    /// Passes `\times 10^{-3}`, and gives its exponent.
    pub(super) fn power_of_ten(&mut self) -> Option<i32> {
        let start = self.at;
        let found = (|| {
            if !self.command("times") && !self.command("cdot") {
                return None;
            }
            if self.peek()?.kind != Kind::Number("10".to_owned()) {
                return None;
            }
            self.at += 1;
            if self.peek()?.kind != Kind::Superscript {
                return None;
            }
            self.at += 1;
            let behind = self.after_argument(self.at);
            let text: String = (self.tokens[self.at..behind].iter())
                .map(|token| match &token.kind {
                    Kind::Open | Kind::Close => String::new(),
                    Kind::Character(sign @ ('+' | '-')) => sign.to_string(),
                    Kind::Number(text) => text.clone(),
                    _ => "?".to_owned(),
                })
                .collect();
            let is_one_token = behind == self.at + 1;
            let exponent: i32 = text
                .parse()
                .ok()
                .filter(|e: &i32| !is_one_token || *e < 10)?;
            self.at = behind;
            Some(exponent)
        })();
        if found.is_none() {
            self.at = start;
        }
        found
    }

    /// `\num{-1.2e-3}`.
    pub(super) fn macro_number(&mut self, place: (usize, usize)) -> Read<Last> {
        self.at += 1;
        if self.character('[') {
            while !self.character(']') {
                if self.peek().is_none() {
                    return self.unexpected("`]`");
                }
                self.at += 1;
            }
        }
        let text = self.inside(|reader| {
            let is_negative = reader.character('-');
            if !is_negative {
                reader.character('+');
            }
            match reader.peek().map(|token| token.kind.clone()) {
                Some(Kind::Number(text)) => {
                    reader.at += 1;
                    Ok(if is_negative {
                        format!("(-{text})")
                    } else {
                        text
                    })
                }
                _ => reader.unexpected("a number such as 1.2e-3"),
            }
        })?;
        let is_negative = text.starts_with('(');
        self.push(place, text);
        if is_negative
            && self
                .peek()
                .is_some_and(|token| token.kind == Kind::Superscript)
        {
            return self.unexpected("parentheses around the negative number");
        }
        self.powers(place)?;
        Ok(Last::Number)
    }
}
