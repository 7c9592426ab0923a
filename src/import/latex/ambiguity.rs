//! What reads in two ways in print, and is refused.

use super::reader::{Reader, has, is_blank};
use super::token::Kind;

impl Reader<'_> {
    /// Whether a row or column ends right before a place.
    pub(super) fn breaks_before(&self, at: usize) -> bool {
        let blanks = self.tokens[..at].iter().rev();
        (blanks.take_while(|token| is_blank(&token.kind)))
            .any(|token| matches!(token.kind, Kind::Align | Kind::Break))
    }

    /// Whether the number at a place was read with `\times 10^{-3}` behind it; goes back there if so.
    pub(super) fn number_takes_power_of_ten(&mut self, number: usize) -> bool {
        let behind = self.tokens[number + 1..self.at].iter();
        let takes = matches!(self.kind(number), Some(Kind::Number(_)))
            && behind
                .take_while(|token| token.kind != Kind::Superscript)
                .any(|token| token.is_command("times") || token.is_command("cdot"));
        if takes {
            self.at = number;
        }
        takes
    }

    /// Whether a fraction of two integers follows.
    pub(super) fn is_fraction_of_integers(&self) -> bool {
        let is_fraction = matches!(self.kind(self.at), Some(Kind::Command(name)) if has("frac dfrac tfrac cfrac", name));
        let braces = [Kind::Open, Kind::Close, Kind::Open, Kind::Close];
        let of_groups =
            [1, 3, 4, 6].map(|place| self.kind(self.at + place)) == braces.each_ref().map(Some);
        let places = if of_groups { [2, 5] } else { [1, 2] };
        is_fraction && places.iter().all(|&place| self.is_integer(self.at + place))
    }

    /// Whether the last thing that follows is an integer alone in parentheses, as equations are numbered by hand.
    pub(super) fn is_lone_integer(&self) -> bool {
        let is_one_of = |at: usize, all: &str| matches!(self.kind(at), Some(Kind::Character(c)) if all.contains(*c));
        let is_last = match self.kind(self.at + 3) {
            Some(Kind::Character(c)) => ".,".contains(*c),
            Some(kind) => kind.ends_term(),
            None => true,
        };
        is_one_of(self.at, "([")
            && self.is_integer(self.at + 1)
            && is_one_of(self.at + 2, ")]")
            && is_last
    }

    /// Whether the token at a place is a whole number.
    fn is_integer(&self, at: usize) -> bool {
        match self.kind(at) {
            Some(Kind::Number(text)) => text.bytes().all(|byte| byte.is_ascii_digit()),
            _ => false,
        }
    }
}
