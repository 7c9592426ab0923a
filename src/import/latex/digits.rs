//! Numbers, of the digits that print next to each other.
//!
//! Braces, fonts and the ends of macros do not print: `0.12{345}` is 0.12345, `1{,}5` is 1.5. Where TeX takes a single
//! digit as an argument (`x^12`, `\frac12`), that digit is a number of its own.

use super::expression::WORDS;
use super::reader::{FONTS, INVISIBLE_WITH_ARGUMENT, has};
use super::token::{Kind, Token};
use super::variables::function;

/// Entries of [`FONTS`] that put space around what they hold.
const SPACED: &str = "operatorname mathop mathbin mathopen mathclose mathinner";

/// The tokens with numbers in place of their digits.
pub(super) fn with_numbers(tokens: Vec<Token>) -> Vec<Token> {
    joined(&without_braces(tokens))
}

/// The arguments that what was read last still wants.
#[derive(Clone, Copy, Default)]
struct Wanted {
    count: usize,
    /// Whether they need braces, such as that of `\sin`, which takes none in TeX.
    in_braces: bool,
    /// The command, where it is a font that is no argument itself.
    font: Option<usize>,
}

impl Wanted {
    fn by(name: &str, place: usize, is_argument: bool) -> Self {
        let is_font = has(FONTS, name) && !has(SPACED, name);
        let count = match name {
            _ if name.ends_with("frac") => 2,
            "sqrt" | "dot" | "ddot" | "dddot" | "abs" | "num" => 1,
            _ if has(FONTS, name) || has(WORDS, name) || has(INVISIBLE_WITH_ARGUMENT, name) => 1,
            _ => usize::from(function(name).is_some()),
        };
        Self {
            count,
            in_braces: function(name).is_some(),
            font: (is_font && !is_argument).then_some(place),
        }
    }

    fn take(&mut self) -> bool {
        let is_wanted = self.count > 0;
        self.count = self.count.saturating_sub(1);
        is_wanted
    }
}

struct Group {
    start: usize,
    is_brace: bool,
    behind: Wanted,
    is_argument: bool,
    font: Option<usize>,
    /// Whether only digits and points are in it so far.
    is_numeric: bool,
}

impl Group {
    fn new(start: usize, mut behind: Wanted, is_brace: bool) -> Self {
        let font = behind.font.filter(|_| is_brace);
        Self {
            start,
            is_brace,
            is_argument: is_brace && behind.take(),
            behind,
            font,
            is_numeric: is_brace,
        }
    }
}

/// The tokens without the braces and fonts around digits, and with the digits that are arguments as numbers.
fn without_braces(mut tokens: Vec<Token>) -> Vec<Token> {
    let mut is_kept = vec![true; tokens.len()];
    let mut open: Vec<Group> = Vec::new();
    let mut wanted = Wanted::default();
    for at in 0..tokens.len() {
        let before = std::mem::take(&mut wanted);
        let mut is_numeric = false;
        let is_optional =
            at > 0 && (tokens[at - 1].is_command("sqrt") || tokens[at - 1].is_command("num"));
        match &tokens[at].kind {
            Kind::Command(name) => wanted = Wanted::by(name, at, before.count > 0),
            Kind::Superscript | Kind::Subscript => wanted.count = 1,
            Kind::Comment(_) => (wanted, is_numeric) = (before, true),
            Kind::Character('*') if at > 0 && matches!(tokens[at - 1].kind, Kind::Command(_)) => {
                wanted = before
            }
            Kind::Open => {
                open.push(Group::new(at, before, true));
                continue;
            }
            Kind::Character('[') if is_optional => {
                open.push(Group::new(at, before, false));
                continue;
            }
            Kind::Character(']') if open.last().is_some_and(|group| !group.is_brace) => {
                wanted = open.pop().map_or(wanted, |group| group.behind);
                continue;
            }
            Kind::Close => {
                // A bracket without its end.
                while open.pop_if(|group| !group.is_brace).is_some() {}
                let Some(group) = open.pop() else { continue };
                is_numeric = group.is_numeric
                    && before.count == 0
                    && (!group.is_argument || group.font.is_some() && at > group.start + 1);
                if is_numeric {
                    (is_kept[group.start], is_kept[at]) = (false, false);
                    is_kept[group.font.unwrap_or(at)] = false;
                }
                // `{\times}`, for less space around the sign.
                let is_alone = group.start + 2 == at && !group.is_argument;
                if is_alone && is_operator(&tokens[at - 1].kind, &tokens[at + 1..]) {
                    (is_kept[group.start], is_kept[at]) = (false, false);
                }
                wanted = group.behind;
            }
            Kind::Character(c) if c.is_ascii_digit() || *c == '.' => {
                match before.font.filter(|_| before.count > 0) {
                    Some(font) => (is_kept[font], is_numeric) = (false, true),
                    None if before.count > 0 && !before.in_braces => {
                        tokens[at].kind = Kind::Number(c.to_string());
                        wanted = before;
                        wanted.take();
                    }
                    None => is_numeric = true,
                }
            }
            _ => {}
        }
        if let (false, Some(group)) = (is_numeric, open.last_mut()) {
            // The command of a font is in question until its argument ends.
            group.is_numeric &= wanted.font.is_some() && wanted.count > 0;
        }
    }
    let mut is_kept = is_kept.into_iter();
    tokens.retain(|_| is_kept.next() == Some(true));
    tokens
}

/// The tokens with one number for digits that follow each other: digits with at most one point, or comma in braces, and
/// an exponent as in `1.2e-3`.
fn joined(tokens: &[Token]) -> Vec<Token> {
    let mut joined = Vec::with_capacity(tokens.len());
    let mut at = 0;
    while let Some(token) = tokens.get(at) {
        let mut number = Joiner {
            tokens,
            at,
            text: String::new(),
        };
        if matches!(token.kind, Kind::Character('0'..='9' | '.')) {
            number.read();
        }
        if number.text.is_empty() {
            joined.push(token.clone());
            at += 1;
            continue;
        }
        let comments = tokens[at..number.at].iter();
        joined.extend(comments.filter(|token| is_comment(token)).cloned());
        joined.push(token.with(Kind::Number(number.text)));
        at = number.at;
    }
    joined
}

/// Whether a token is an operator also without the space around it: `0{\cdot}5` may be a decimal fraction.
fn is_operator(kind: &Kind, behind: &[Token]) -> bool {
    let digit = |at: usize| match behind.get(at).map(|token| &token.kind) {
        Some(Kind::Character(c)) if c.is_ascii_digit() => Some(*c),
        _ => None,
    };
    match kind {
        Kind::Character(c) => "+-*/=".contains(*c),
        Kind::Command(name) if name == "cdot" => {
            digit(0).is_none() || [0, 1, 2].map(digit) == [Some('1'), Some('0'), None]
        }
        Kind::Command(name) => has("times ast", name),
        _ => false,
    }
}

fn is_comment(token: &Token) -> bool {
    matches!(token.kind, Kind::Comment(_))
}

struct Joiner<'t> {
    tokens: &'t [Token],
    at: usize,
    text: String,
}

impl Joiner<'_> {
    fn read(&mut self) {
        self.digits();
        let (point, behind) = match self.character(self.at) {
            Some(('.', point)) => (Some(point), point + 1),
            // 0{,}36 is a decimal fraction; 1{,}500 may be a large number, and is none.
            _ => match self.comma() {
                Some(behind) if self.text == "0" || self.run(behind) != 3 => (Some(behind), behind),
                _ => (None, self.at),
            },
        };
        if point.is_some() && self.run(behind) > 0 {
            self.text.push('.');
            self.at = behind;
            self.digits();
        }
        if !self.text.is_empty() {
            self.exponent();
        }
    }

    /// The next character that is no comment, from a place, and its place.
    fn character(&self, from: usize) -> Option<(char, usize)> {
        let mut rest = (from..self.tokens.len()).skip_while(|at| is_comment(&self.tokens[*at]));
        let at = rest.next()?;
        match self.tokens[at].kind {
            Kind::Character(character) => Some((character, at)),
            _ => None,
        }
    }

    fn digit(&self, from: usize) -> Option<(char, usize)> {
        self.character(from).filter(|(c, _)| c.is_ascii_digit())
    }

    /// The place behind `{,}`.
    fn comma(&self) -> Option<usize> {
        let kinds = [Kind::Open, Kind::Character(','), Kind::Close];
        let next = self.tokens.get(self.at..self.at + 3)?;
        let is_comma = !self.text.is_empty() && next.iter().map(|token| &token.kind).eq(&kinds);
        is_comma.then_some(self.at + 3)
    }

    /// How many digits there are from a place on, at most four.
    fn run(&self, from: usize) -> usize {
        let mut at = from;
        let digits = std::iter::from_fn(|| {
            let (_, digit) = self.digit(at)?;
            at = digit + 1;
            Some(())
        });
        digits.take(4).count()
    }

    fn digits(&mut self) {
        while let Some((digit, at)) = self.digit(self.at) {
            self.text.push(digit);
            self.at = at + 1;
        }
    }

    fn exponent(&mut self) {
        let typed = |at: usize, accepted: &str| match self.tokens.get(at) {
            Some(token) if !token.is_spaced => match token.kind {
                Kind::Character(c) => accepted.contains(c).then_some(c),
                _ => None,
            },
            _ => None,
        };
        let sign = typed(self.at + 1, "+-");
        let from = self.at + 1 + usize::from(sign.is_some());
        if typed(self.at, "eE").is_some() && typed(from, "0123456789").is_some() {
            self.text
                .push_str(if sign == Some('-') { "e-" } else { "e" });
            self.at = from;
            self.digits();
        }
    }
}
