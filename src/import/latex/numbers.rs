//! Numbers (literals, powers of ten, `\num`) and roots (`\sqrt{z_1}`, `\sqrt[3]{z_1}`). Braces, fonts and the ends of
//! macros do not print: `0.12{345}` is 0.12345, `1{,}5` is 1.5. Where TeX reads a single digit as an argument (`x^12`,
//! `\frac12`), the number ends behind it.

use super::definitions::changes_digits;
use super::*;

/// Most pieces under an odd root, which are written twice, and so again in each root around it.
const MAX_ODD_RADICAND: usize = 1000;

impl Reader<'_> {
    /// The literal of a number with its power of ten; a rounded integer gets a point or an exponent.
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
        let text = self.characters(self.at..behind);
        self.at = behind;
        text.parse().ok()
    }

    /// The characters in a range, braces and fonts aside, and `?` for anything else.
    pub(super) fn characters(&self, places: Range<usize>) -> String {
        let characters = places.filter_map(|at| match &self.tokens[at].kind {
            Kind::Open | Kind::Close | Kind::Comment(_) => None,
            Kind::Command(name) if is_in("fonts", name) => None,
            Kind::Character(character) => Some(*character),
            _ => Some('?'),
        });
        characters.collect()
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
    pub(super) fn macro_number(&mut self, place: Position) -> Read<Last> {
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
        let text = self.characters(first..behind);
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

    /// A root at its command. Even ones have no value below zero; odd ones are `abs(x)^(1/3)*sign(x)`.
    pub(super) fn root(&mut self, place: Position) -> Read<Last> {
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

/// Digits with at most one point, or comma in braces, and an exponent as in `1.2e-3`.
pub(super) struct Number {
    pub(super) text: String,
    pub(super) first: usize,
    pub(super) behind: usize,
}

/// Of each token whether it is a brace or font around digits alone, which does not print.
pub(super) fn around_digits(tokens: &[Token]) -> Vec<bool> {
    let mut is_around = vec![false; tokens.len()];
    // Braces that are open: place, font before it, and whether only digits and points are in it so far.
    let mut open: Vec<(usize, Option<usize>, bool)> = Vec::new();
    let mut font = None;
    for (at, token) in tokens.iter().enumerate() {
        let font_before = font.take();
        let is_numeric = match &token.kind {
            Kind::Comment(_) => {
                font = font_before;
                true
            }
            Kind::Command(name) if is_in("fonts", name) && !is_in("spaced fonts", name) => {
                font = Some(at);
                font_before.is_none()
            }
            Kind::Open => {
                open.push((at, font_before, true));
                continue;
            }
            Kind::Close => match open.pop() {
                Some((start, font, true)) if font.is_none() || at > start + 1 => {
                    (is_around[start], is_around[at]) = (true, true);
                    is_around[font.unwrap_or(at)] = true;
                    true
                }
                _ => false,
            },
            kind if kind.digit().is_some() || *kind == Kind::Character('.') => {
                is_around[font_before.unwrap_or(at)] = font_before.is_some();
                true
            }
            _ => false,
        };
        if let (false, Some((_, _, is_numeric))) = (is_numeric, open.last_mut()) {
            *is_numeric = false;
        }
    }
    is_around
}

/// The tokens without braces around a lone operator or point, such as `{\times}` for less space around the sign.
pub(super) fn without_operator_braces(tokens: Vec<Token>) -> Vec<Token> {
    let is_lone = |at: usize| match &tokens[at..tokens.len().min(at + 3)] {
        [open, inside, close] if open.kind == Kind::Open && close.kind == Kind::Close => {
            let is_argument = at > 0 && takes_argument(&tokens[at - 1].kind);
            !is_argument && is_operator(&inside.kind, &tokens[at + 3..])
        }
        _ => false,
    };
    let is_dropped = |at: usize| is_lone(at) || at > 1 && is_lone(at - 2);
    let kept = (0..tokens.len()).filter(|at| !is_dropped(*at));
    kept.map(|at| tokens[at].clone()).collect()
}

fn takes_argument(kind: &Kind) -> bool {
    match kind {
        Kind::Superscript | Kind::Subscript => true,
        Kind::Command(name) => {
            let mut lists = ["fonts", "text", "invisible with argument", "one argument"].iter();
            lists.any(|list| is_in(list, name))
                || name.ends_with("frac")
                || function(name).is_some()
        }
        _ => false,
    }
}

/// Whether a token is an operator also without the space around it: `0{\cdot}5` may be a decimal fraction.
fn is_operator(kind: &Kind, behind: &[Token]) -> bool {
    let digit = |at: usize| behind.get(at).and_then(|token| token.kind.digit());
    match kind {
        Kind::Character(c) => "+-*/=.".contains(*c),
        Kind::Command(name) if name == "cdot" => {
            digit(0).is_none() || [0, 1, 2].map(digit) == [Some('1'), Some('0'), None]
        }
        Kind::Command(name) => has("times ast", name),
        _ => false,
    }
}

impl Reader<'_> {
    pub(super) fn number_at(&self, at: usize) -> Option<Number> {
        let (_, first) =
            (self.character_at(at)).filter(|(c, _)| c.is_ascii_digit() || *c == '.')?;
        let mut number = Number {
            text: String::new(),
            first,
            behind: at,
        };
        self.digits(&mut number);
        let behind_point = match self.character_at(number.behind) {
            Some(('.', point)) => Some(point + 1),
            // 0{,}36 is a decimal fraction; 1{,}500 may be a large number, and is none.
            _ => (self.behind_comma(number.behind))
                .filter(|behind| number.text == "0" || self.run(*behind) != 3)
                .filter(|_| !number.text.is_empty()),
        };
        if let Some(behind) = behind_point.filter(|behind| self.run(*behind) > 0) {
            number.text.push('.');
            number.behind = behind;
            self.digits(&mut number);
        }
        let is_number = !number.text.is_empty();
        self.exponent(&mut number);
        is_number.then_some(number)
    }

    pub(super) fn behind_integer(&self, at: usize) -> Option<usize> {
        let number = self.number_at(at)?;
        let is_integer = number.text.bytes().all(|byte| byte.is_ascii_digit());
        is_integer.then_some(number.behind)
    }

    /// The next character that prints, if nothing else comes before it, and its place.
    fn character_at(&self, from: usize) -> Option<(char, usize)> {
        let is_unseen =
            |at: &usize| self.is_around[*at] || matches!(self.tokens[*at].kind, Kind::Comment(_));
        let at = (from..self.end).find(|at| !is_unseen(at))?;
        match self.tokens[at].kind {
            Kind::Character(character) => Some((character, at)),
            _ => None,
        }
    }

    fn digit(&self, from: usize) -> Option<(char, usize)> {
        self.character_at(from).filter(|(c, _)| c.is_ascii_digit())
    }

    fn digits(&self, number: &mut Number) {
        while let Some((digit, at)) = self.digit(number.behind) {
            number.text.push(digit);
            let behind = (at + 1..self.end).find(|at| !self.is_around[*at]);
            number.behind = behind.unwrap_or(self.end);
        }
    }

    /// How many digits there are from a place on, at most four.
    fn run(&self, from: usize) -> usize {
        let digits = std::iter::successors(self.digit(from), |(_, at)| self.digit(at + 1));
        digits.take(4).count()
    }

    fn behind_comma(&self, at: usize) -> Option<usize> {
        let comma = [Kind::Open, Kind::Character(','), Kind::Close];
        let next = self.tokens[..self.end].get(at..at + 3)?;
        let is_comma = next.iter().map(|token| &token.kind).eq(&comma);
        is_comma.then_some(at + 3)
    }

    fn exponent(&self, number: &mut Number) {
        let typed = |at: usize, accepted: &str| {
            let next = self.character_at(at);
            next.filter(|(c, at)| accepted.contains(*c) && !self.tokens[*at].is_spaced)
        };
        let Some((_, mark)) = typed(number.behind, "eE") else {
            return;
        };
        let sign = typed(mark + 1, "+-");
        let from = sign.map_or(mark, |(_, at)| at) + 1;
        if typed(from, "0123456789").is_some() {
            let is_negative = sign.is_some_and(|(sign, _)| sign == '-');
            number.text.push_str(if is_negative { "e-" } else { "e" });
            number.behind = from;
            self.digits(number);
        }
    }
}
