//! A display being read: its tokens, groups, and the pieces made of it.

use super::numbers::around_digits;
use super::*;

const MAX_DEPTH: usize = 60;

/// The rounding of coefficients printed as integers, if a comment of the document states it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Digits {
    Decimals(usize),
    Significant(usize),
}

/// The last piece, as far as it decides whether a product may go on without a sign.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Last {
    Number,
    Other,
    /// A function whose argument had no parentheses.
    Bare,
    /// The same with a number as its argument.
    BareNumber,
}

pub(super) struct Reader<'a> {
    pub(super) file: &'a str,
    pub(super) names: &'a SymbolNames,
    /// Whether `z` and `u` need no subscript.
    pub(super) alone: bool,
    pub(super) digits: Option<Digits>,
    pub(super) tokens: Vec<Token>,
    /// For each opening brace, where it closes.
    pub(super) closing: Vec<usize>,
    pub(super) is_around: Vec<bool>,
    pub(super) at: usize,
    pub(super) end: usize,
    pub(super) depth: usize,
    /// Whether each open delimiter is a bar.
    pub(super) bars: Vec<bool>,
    pub(super) pieces: Vec<Piece>,
}

pub(super) const BARE: &str = "parentheses around the argument of the function before";

pub(super) fn is_blank(kind: &Kind) -> bool {
    match kind {
        Kind::Align | Kind::Break | Kind::Label(_) | Kind::Comment(_) | Kind::Paragraph => true,
        Kind::Character(character) => *character == '~',
        Kind::Command(name) => name == " " || is_in("invisible", name) || is_in("sizes", name),
        _ => false,
    }
}

impl<'a> Reader<'a> {
    pub(super) fn new(file: &'a str, names: &'a SymbolNames, tokens: &[Token]) -> Read<Self> {
        let tokens = without_split_delimiters(tokens);
        let end = tokens.len();
        let mut reader = Self {
            file,
            names,
            alone: false,
            digits: None,
            closing: vec![0; end],
            is_around: around_digits(&tokens),
            tokens,
            at: 0,
            end,
            depth: 0,
            bars: Vec::new(),
            pieces: Vec::new(),
        };
        let Some(place) = reader.link(0..end) else {
            return Ok(reader);
        };
        let token = &reader.tokens[place];
        let found = format!("{} without its partner", token.quoted());
        Err(ImportError::at(file, token.place, found, "braces in pairs"))
    }

    /// Finds where the braces between two places close; the first without a partner.
    pub(super) fn link(&mut self, places: Range<usize>) -> Option<usize> {
        let mut open = Vec::new();
        for place in places {
            match self.tokens[place].kind {
                Kind::Open => open.push(place),
                Kind::Close => match open.pop() {
                    Some(start) => self.closing[start] = place,
                    None => open.extend([place, place]),
                },
                _ => {}
            }
        }
        open.first().copied()
    }

    /// Skips tokens that print nothing; returns the next one, or none at the end.
    pub(super) fn peek(&mut self) -> Option<&Token> {
        while self.at < self.end {
            let after = match &self.tokens[self.at].kind {
                kind if is_blank(kind) => self.at + 1,
                Kind::Open if self.closing[self.at] == self.at + 1 => self.at + 2,
                Kind::Command(name) if is_in("invisible with argument", name) => {
                    let star = usize::from(self.kind(self.at + 1) == Some(&Kind::Character('*')));
                    self.after_argument(self.at + 1 + star)
                }
                _ => break,
            };
            self.at = after;
        }
        (self.at < self.end).then(|| &self.tokens[self.at])
    }

    pub(super) fn next_kind(&mut self) -> Option<Kind> {
        self.peek().map(|token| token.kind.clone())
    }

    pub(super) fn is_next(&mut self, wanted: &Kind) -> bool {
        self.peek().is_some_and(|token| token.kind == *wanted)
    }

    pub(super) fn kind(&self, at: usize) -> Option<&Kind> {
        self.tokens[..self.end].get(at).map(|token| &token.kind)
    }

    pub(super) fn after_argument(&self, at: usize) -> usize {
        match self.kind(at) {
            Some(Kind::Open) => self.closing[at] + 1,
            Some(_) => at + 1,
            None => at,
        }
    }

    pub(super) fn takes(&mut self, wanted: &Kind) -> bool {
        let found = self.is_next(wanted);
        self.at += usize::from(found);
        found
    }

    pub(super) fn character(&mut self, wanted: char) -> bool {
        self.takes(&Kind::Character(wanted))
    }

    pub(super) fn command(&mut self, wanted: &str) -> bool {
        let found = self.peek().is_some_and(|token| token.is_command(wanted));
        self.at += usize::from(found);
        found
    }

    pub(super) fn unexpected<T>(&mut self, expected: &str) -> Read<T> {
        self.peek();
        let number = self.number_at(self.at);
        let (place, found) = match (number, self.tokens.get(self.at.min(self.end))) {
            (Some(number), _) => {
                let found = format!("`{}`", number.text);
                (self.tokens[number.first].place, found)
            }
            (None, Some(next)) => (next.place, next.quoted()),
            (None, None) => {
                let place = self.tokens.last().map_or((1, 1), |last| last.place);
                (place, "the end of the equation".to_owned())
            }
        };
        Err(ImportError::at(self.file, place, found, expected))
    }

    pub(super) fn here(&mut self) -> Position {
        self.peek().map_or((1, 1), |token| token.place)
    }

    pub(super) fn push(&mut self, place: Position, text: impl Into<String>) {
        self.pieces.push((place, text.into()));
    }

    pub(super) fn deepen(&mut self) -> Read<()> {
        self.depth += 1;
        match self.depth > MAX_DEPTH {
            true => self.unexpected(&format!("at most {MAX_DEPTH} nested groups")),
            false => Ok(()),
        }
    }

    /// Runs `read` on the group or token that comes next, which must be used up.
    pub(super) fn inside<T>(&mut self, read: impl FnOnce(&mut Self) -> Read<T>) -> Read<T> {
        if self.peek().is_none() {
            return self.unexpected("an argument");
        }
        self.deepen()?;
        let (at, after) = (self.at, self.after_argument(self.at));
        let is_digit = |at: usize| self.kind(at).is_some_and(|kind| kind.digit().is_some());
        let (first, end) = match &self.tokens[at].kind {
            Kind::Open => (at + 1, after - 1),
            // TeX would use the space as the argument.
            _ if is_blank(&self.tokens[at - 1].kind) && is_digit(at) && is_digit(at + 1) => {
                return self.unexpected("braces around an argument of several digits");
            }
            _ => (at, after),
        };
        let outer_end = std::mem::replace(&mut self.end, end);
        self.at = first;
        let bars = std::mem::take(&mut self.bars);
        let value = read(self)?;
        if self.peek().is_some() {
            return self.unexpected("an operator or the end of the group");
        }
        (self.bars, self.depth) = (bars, self.depth - 1);
        (self.at, self.end) = (after, outer_end);
        Ok(value)
    }
}

/// Ambiguous print, which is refused.
impl Reader<'_> {
    /// Whether a row or column ends right before a place.
    pub(super) fn breaks_before(&self, at: usize) -> bool {
        let is_passed = |at: &usize| self.is_around[*at] || is_blank(&self.tokens[*at].kind);
        let mut blanks = (0..at).rev().take_while(is_passed);
        blanks.any(|at| matches!(self.tokens[at].kind, Kind::Align | Kind::Break))
    }

    /// Whether the number at a place was read with `\times 10^{-3}` behind it; goes back there if so.
    pub(super) fn number_takes_power_of_ten(&mut self, number: usize) -> bool {
        let takes = self.number_at(number).is_some_and(|found| {
            let behind = self.tokens[found.behind..self.at].iter();
            let mut base = behind.take_while(|token| token.kind != Kind::Superscript);
            base.any(|token| token.is_command("times") || token.is_command("cdot"))
        });
        if takes {
            self.at = number;
        }
        takes
    }

    pub(super) fn is_number_next(&self) -> bool {
        let is_passed = |at: &usize| {
            let kind = &self.tokens[*at].kind;
            *kind == Kind::Open || is_blank(kind)
        };
        let next = (self.at..self.end).find(|at| !is_passed(at));
        let is_number = |at| self.number_at(at).is_some();
        is_number(self.at) || next.is_some_and(is_number)
    }

    /// The command for text in whose argument one of the left sides is, which are in their order.
    pub(super) fn in_text(&self, left_sides: &[LeftSide]) -> Option<&Token> {
        let mut commands = self.tokens.iter().enumerate();
        let found = commands.find(|(at, token)| {
            let is_text = is_in("text", token.name()) || is_in("notes", token.name());
            let star = usize::from(self.kind(at + 1) == Some(&Kind::Character('*')));
            let open = at + 1 + star;
            let inside = left_sides.partition_point(|side| side.at < open);
            let is_inside = |side: &LeftSide| side.at < self.after_argument(open);
            is_text && left_sides.get(inside).is_some_and(is_inside)
        });
        found.map(|(_, token)| token)
    }

    pub(super) fn is_fraction_of_integers(&self) -> bool {
        let behind_integer = |at: usize| {
            let behind = self.after_argument(at);
            let inside = match self.kind(at)? {
                Kind::Open => at + 1..behind - 1,
                _ => at..behind,
            };
            let mut seen = inside.filter(|at| !self.is_around[*at]).peekable();
            let is_digit = |at: usize| self.tokens[at].kind.digit().is_some();
            (seen.peek().is_some() && seen.all(is_digit)).then_some(behind)
        };
        matches!(self.kind(self.at), Some(Kind::Command(name)) if is_in("fractions", name))
            && (behind_integer(self.at + 1).and_then(behind_integer)).is_some()
    }

    /// Whether the last thing that follows is an integer alone in parentheses, as equations are numbered by hand.
    pub(super) fn is_lone_integer(&self) -> bool {
        let is_one_of = |at: usize, all: &str| matches!(self.kind(at), Some(Kind::Character(c)) if all.contains(*c));
        let behind = |at: usize| (at..self.end).find(|at| !self.is_around[*at]);
        let is_last = |at: usize| match behind(at).and_then(|at| self.kind(at)) {
            Some(Kind::Character(c)) => ".,".contains(*c),
            Some(kind) => kind.ends_term(),
            None => true,
        };
        let closer = self.behind_integer(self.at + 1);
        is_one_of(self.at, "([")
            && closer.is_some_and(|closer| is_one_of(closer, ")]") && is_last(closer + 1))
    }
}

/// The tokens without `\right.` and the next `\left.`, between which a line breaks inside other delimiters.
fn without_split_delimiters(tokens: &[Token]) -> Vec<Token> {
    let is_empty = |at: usize, name: &str| {
        let point = tokens.get(at + 1).map(|token| &token.kind);
        tokens[at].is_command(name) && point == Some(&Kind::Character('.'))
    };
    let mut joined = Vec::with_capacity(tokens.len());
    let mut at = 0;
    while at < tokens.len() {
        let next = || (at + 2..tokens.len()).find(|at| !is_blank(&tokens[*at].kind));
        let left = is_empty(at, "right").then(next).flatten();
        if let Some(left) = left.filter(|left| is_empty(*left, "left")) {
            joined.extend_from_slice(&tokens[at + 2..left]);
            at = left + 2;
        } else {
            joined.push(tokens[at].clone());
            at += 1;
        }
    }
    joined
}
