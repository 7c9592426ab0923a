//! Roots: `\sqrt{z_1}`, `\sqrt[3]{z_1}`.

use super::reader::{Last, Read, Reader};
use super::token::Kind;

/// Most pieces under an odd root, which are written twice, and so again in each root around it.
const MAX_ODD_RADICAND: usize = 1000;

impl Reader<'_> {
    /// A root at its command. Even ones have no value below zero, as powers do not; odd ones are `abs(x)^(1/3)*sign(x)`.
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
        self.powers(place)?;
        Ok(Last::Other)
    }

    /// The index in brackets; 2 without.
    fn index(&mut self) -> Read<u32> {
        if !self.character('[') {
            return Ok(2);
        }
        let index = match self.peek().map(|token| &token.kind) {
            Some(Kind::Number(text)) => text.parse().ok(),
            Some(_) | None => None,
        };
        let Some(index @ 2..=99) = index else {
            return self.unexpected("the index of the root, 2 to 99");
        };
        self.at += 1;
        match self.character(']') {
            true => Ok(index),
            false => self.unexpected("`]`"),
        }
    }
}
