//! Numbers (literals, powers of ten, `\num`) and roots (`\sqrt{z_1}`, `\sqrt[3]{z_1}`).

use super::definitions::changes_digits;
use super::reader::{Digits, Last, Read, Reader};
use super::token::Kind;

/// Most pieces under an odd root, which are written twice, and so again in each root around it.
const MAX_ODD_RADICAND: usize = 1000;

impl Reader<'_> {
    /// The literal of a number: a power of ten behind it goes into it, and an integer that the document has rounded
    /// gets a point or an exponent, so that it counts as rounded.
    pub(super) fn literal(&mut self, text: &str, leads: bool) -> String {
        if let Some(exponent) = self.power_of_ten()
            && !text.contains(['e', 'E'])
        {
            return format!("{text}e{exponent}");
        }
        let is_integer = text.bytes().all(|byte| byte.is_ascii_digit());
        match self.digits.filter(|_| leads && is_integer && text != "0") {
            Some(Digits::Decimals(0)) => return format!("{text}."),
            Some(Digits::Significant(count)) if text.len() == count => return format!("{text}."),
            Some(Digits::Significant(count)) if text.len() > count => {
                let (kept, zeros) = text.split_at(count.max(1));
                if zeros.bytes().all(|byte| byte == b'0') {
                    return format!("{kept}e{}", zeros.len());
                }
            }
            _ => {}
        }
        text.to_owned()
    }

    /// Passes `\times 10^{-3}`, and gives its exponent.
    pub(super) fn power_of_ten(&mut self) -> Option<i32> {
        let start = self.at;
        let exponent = self.behind_power_of_ten();
        if exponent.is_none() {
            self.at = start;
        }
        exponent
    }

    fn behind_power_of_ten(&mut self) -> Option<i32> {
        let is_product = self.command("times") || self.command("cdot");
        self.peek();
        let ten = self.number_at(self.at);
        let ten = ten.filter(|number| is_product && number.text == "10")?;
        self.at = ten.behind;
        self.takes(&Kind::Superscript).then_some(())?;
        let behind = self.after_argument(self.at);
        let seen = (self.at..behind).filter(|at| !self.is_around[*at]);
        let characters = seen.filter_map(|at| match &self.tokens[at].kind {
            Kind::Open | Kind::Close => None,
            Kind::Character(c) => Some(*c),
            _ => Some('?'),
        });
        let text: String = characters.collect();
        self.at = behind;
        text.parse().ok()
    }

    pub(super) fn number(&mut self, expected: &str) -> Read<String> {
        self.peek();
        match self.number_at(self.at) {
            Some(number) => {
                self.at = number.behind;
                Ok(number.text)
            }
            None => self.unexpected(expected),
        }
    }

    /// `\num{-1.2e-3}`, with the options and spellings of siunitx that print the number as it is.
    pub(super) fn macro_number(&mut self, place: (usize, usize)) -> Read<Last> {
        self.at += 1;
        if self.is_next(&Kind::Character('[')) {
            let options = &self.tokens[self.at..self.end];
            let mut options = options.split(|token| token.kind == Kind::Character(']'));
            let options = options.next().unwrap_or_default();
            if changes_digits(options) {
                return self.unexpected(
                    "the number as it is printed, without options that change its digits",
                );
            }
            self.at += options.len();
            if !self.character(']') {
                return self.unexpected("`]`");
            }
        }
        self.peek();
        let first = self.at;
        let behind = self.after_argument(first);
        let parts = self.tokens[first..behind]
            .iter()
            .map(|token| match &token.kind {
                Kind::Open | Kind::Close | Kind::Comment(_) => Some(String::new()),
                Kind::Character(character) => Some(character.to_string()),
                _ => None,
            });
        let text = parts.collect::<Option<String>>().unwrap_or_default();
        let text = text.replace(',', ".").replace(['d', 'D', 'E'], "e");
        let is_negative = text.starts_with('-');
        let digits = text.trim_start_matches(['-', '+']);
        let is_number = digits.starts_with(|c: char| c.is_ascii_digit() || c == '.')
            && text.len() - digits.len() < 2
            && digits.parse::<f64>().is_ok();
        if !is_number {
            self.at = first + usize::from(self.kind(first) == Some(&Kind::Open));
            return self.unexpected("a number such as 1.2e-3");
        }
        self.at = behind;
        let literal = match is_negative {
            true => format!("(-{digits})"),
            false => digits.to_owned(),
        };
        self.push(place, literal);
        if is_negative && self.is_next(&Kind::Superscript) {
            return self.unexpected("parentheses around the negative number");
        }
        Ok(Last::Number)
    }

    /// A root at its command. Even ones have no value below zero, as powers do not; odd ones are
    /// `abs(x)^(1/3)*sign(x)`.
    pub(super) fn root(&mut self, place: (usize, usize)) -> Read<Last> {
        self.at += 1;
        let index = self.index()?;
        let is_odd = index % 2 == 1;
        self.push(place, if is_odd { "(abs(" } else { "((" });
        let radicand = self.pieces.len();
        self.inside(|reader| reader.sum(false))?;
        let radicand = radicand..self.pieces.len();
        self.push(place, format!(")^(1/{index})"));
        if is_odd {
            if radicand.len() > MAX_ODD_RADICAND {
                return self.unexpected("a shorter sum in the odd root before");
            }
            self.push(place, "*sign(");
            self.pieces.extend_from_within(radicand);
            self.push(place, ")");
        }
        self.push(place, ")");
        Ok(Last::Other)
    }

    fn index(&mut self) -> Read<u32> {
        if !self.character('[') {
            return Ok(2);
        }
        const EXPECTED: &str = "the index of the root, 2 to 99";
        let start = self.at;
        let Ok(index @ 2..=99) = self.number(EXPECTED)?.parse() else {
            self.at = start;
            return self.unexpected(EXPECTED);
        };
        match self.character(']') {
            true => Ok(index),
            false => self.unexpected("`]`"),
        }
    }
}
