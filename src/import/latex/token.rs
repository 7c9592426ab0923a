//! Tokens of LaTeX with their places, as TeX takes them from a file: one after the other.

use std::collections::VecDeque;
use std::str::Lines;

const MINUS: char = '\u{2212}';

/// One token and where it starts: line and column, from 1.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Token {
    pub(super) kind: Kind,
    pub(super) place: (usize, usize),
    /// Whether a space or the start of a line is before it.
    pub(super) is_spaced: bool,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Kind {
    /// `\frac`, `\,`; without its backslash.
    Command(String),
    /// `\begin{...}`; it and the next two are made of tokens that follow each other.
    Begin(String),
    End(String),
    Label(String),
    Open,
    Close,
    Superscript,
    Subscript,
    Align,
    /// `\\` with its optional star and distance.
    Break,
    Dollar,
    /// `$$`, or a fence of mathematics in Markdown.
    Display,
    Parameter(usize),
    Comment(String),
    Paragraph,
    Character(char),
    /// What TeX would follow and romc does not, and what could be there.
    Unread(Box<str>, &'static str),
}

impl Kind {
    pub(super) fn quoted(&self) -> String {
        let text = match self {
            Kind::Command(name) => format!("\\{name}"),
            Kind::Begin(name) => format!("\\begin{{{name}}}"),
            Kind::End(name) => format!("\\end{{{name}}}"),
            Kind::Label(name) => format!("\\label{{{name}}}"),
            Kind::Open => "{".to_owned(),
            Kind::Close => "}".to_owned(),
            Kind::Superscript => "^".to_owned(),
            Kind::Subscript => "_".to_owned(),
            Kind::Align => "&".to_owned(),
            Kind::Break => "\\\\".to_owned(),
            Kind::Dollar => "$".to_owned(),
            Kind::Display => "$$".to_owned(),
            Kind::Parameter(number) => format!("#{number}"),
            Kind::Comment(_) => "%".to_owned(),
            Kind::Paragraph => return "an empty line".to_owned(),
            Kind::Unread(found, _) => return found.to_string(),
            Kind::Character(c) if c.is_control() => c.escape_debug().to_string(),
            Kind::Character(character) => character.to_string(),
        };
        let short: String = text.chars().take(40).collect();
        format!("`{short}`")
    }

    /// Whether it ends every term that it stands behind.
    pub(super) fn ends_term(&self) -> bool {
        use Kind::{Align, Break, Close, Comment, Label, Paragraph};
        matches!(
            self,
            Align | Break | Close | Label(_) | Comment(_) | Paragraph
        )
    }
}

impl Token {
    pub(super) fn with(&self, kind: Kind) -> Self {
        let (place, is_spaced) = (self.place, self.is_spaced);
        Self {
            kind,
            place,
            is_spaced,
        }
    }

    pub(super) fn quoted(&self) -> String {
        self.kind.quoted()
    }

    pub(super) fn is_command(&self, name: &str) -> bool {
        matches!(&self.kind, Kind::Command(command) if command == name)
    }
}

/// How many tokens there are to the brace that closes the first, an opening one; none without.
pub(super) fn group_length<'t>(tokens: impl Iterator<Item = &'t Token>) -> Option<usize> {
    let mut depth = 0;
    for (place, token) in tokens.enumerate() {
        match token.kind {
            Kind::Open => depth += 1,
            Kind::Close => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return Some(place + 1);
        }
    }
    None
}

pub(super) struct Lexer<'t> {
    /// The lines after the one that is read.
    lines: Lines<'t>,
    characters: Vec<char>,
    next: usize,
    number: usize,
    start: usize,
    is_spaced: bool,
    /// What one character made besides the last token.
    queued: VecDeque<Token>,
    /// Whether `@` is a letter of commands.
    pub(super) has_at_letters: bool,
}

impl Iterator for Lexer<'_> {
    type Item = Token;

    fn next(&mut self) -> Option<Token> {
        loop {
            if let Some(token) = self.queued.pop_front() {
                return Some(token);
            }
            let Some(first) = self.peek(0) else {
                self.next_line()?;
                continue;
            };
            if first.is_whitespace() {
                self.next += 1;
                self.is_spaced = true;
                continue;
            }
            let place = (self.number, self.start + self.next);
            let of_unicode = self.dotted_or_raised(first);
            for kind in of_unicode.unwrap_or_else(|| vec![self.token(first)]) {
                let is_spaced = std::mem::take(&mut self.is_spaced);
                self.queued.push_back(Token {
                    kind,
                    place,
                    is_spaced,
                });
            }
        }
    }
}

impl<'t> Lexer<'t> {
    pub(super) fn new(text: &'t str) -> Self {
        Self {
            lines: text.lines(),
            characters: Vec::new(),
            next: 0,
            number: 0,
            start: 1,
            is_spaced: true,
            queued: VecDeque::new(),
            has_at_letters: false,
        }
    }

    /// The tokens of a part of a line that starts at `place`.
    pub(super) fn of_part(text: &'t str, (number, start): (usize, usize)) -> Self {
        let mut lexer = Self::new(text);
        (lexer.number, lexer.start) = (number - 1, start);
        lexer
    }

    /// Goes to the next line; an empty one ends a paragraph.
    fn next_line(&mut self) -> Option<()> {
        let line = self.lines.next()?;
        self.number += 1;
        (self.characters, self.next, self.is_spaced) = (line.chars().collect(), 0, true);
        if line.trim().is_empty() {
            self.queued.push_back(Token {
                kind: Kind::Paragraph,
                place: (self.number, self.start),
                is_spaced: true,
            });
        }
        Some(())
    }

    /// Ends the text behind the line that is read.
    pub(super) fn end_after_line(&mut self) {
        self.lines = "".lines();
    }

    pub(super) fn end(&mut self) {
        self.end_after_line();
        self.next = self.characters.len();
    }

    pub(super) fn is_at(&self, character: char) -> bool {
        self.peek(0) == Some(character)
    }

    /// Passes `|...|` behind `\verb`, or a group without a look into it.
    pub(super) fn skip_verb(&mut self) {
        let rest = self.characters[self.next..].iter();
        let mut rest = rest.enumerate().skip_while(|(_, c)| **c == '*');
        let Some((_, open)) = rest.next() else { return };
        let close = match open {
            '{' => '}',
            '[' => ']',
            other => *other,
        };
        let behind = rest.find(|(_, c)| **c == close);
        self.next = behind.map_or(self.characters.len(), |(at, _)| self.next + at + 1);
    }

    /// Passes everything up to `\end{name}` and that; whether it is there.
    pub(super) fn skip_verbatim(&mut self, name: &str) -> bool {
        let end = format!("\\end{{{name}}}");
        loop {
            let rest: String = self.characters[self.next..].iter().collect();
            if let Some(at) = rest.find(&end) {
                self.next += rest[..at].chars().count() + end.chars().count();
                return true;
            }
            self.next = self.characters.len();
            if self.next_line().is_none() {
                return false;
            }
            self.queued.clear();
        }
    }

    pub(super) fn is_at_line_end(&self) -> bool {
        self.characters[self.next..]
            .iter()
            .all(|c| c.is_whitespace())
    }

    fn peek(&self, ahead: usize) -> Option<char> {
        self.characters.get(self.next + ahead).copied()
    }

    fn take_while(&mut self, accepts: impl Fn(char) -> bool) -> String {
        let start = self.next;
        while self.peek(0).is_some_and(&accepts) {
            self.next += 1;
        }
        self.characters[start..self.next].iter().collect()
    }

    fn token(&mut self, first: char) -> Kind {
        self.next += 1;
        match first {
            '\\' => self.command(),
            '%' => {
                let rest = self.characters[self.next..].iter().collect::<String>();
                self.next = self.characters.len();
                Kind::Comment(rest.trim().to_owned())
            }
            '{' => Kind::Open,
            '}' => Kind::Close,
            '^' => Kind::Superscript,
            '_' => Kind::Subscript,
            '&' => Kind::Align,
            '$' if self.peek(0) == Some('$') => {
                self.next += 1;
                Kind::Display
            }
            '$' => Kind::Dollar,
            '#' => match self.peek(0).and_then(|c| c.to_digit(10)) {
                Some(digit) => {
                    self.next += 1;
                    Kind::Parameter(digit as usize)
                }
                None => Kind::Character('#'),
            },
            MINUS => Kind::Character('-'),
            '·' | '⋅' | '×' => Kind::Command("cdot".to_owned()),
            _ => Kind::Character(first),
        }
    }

    /// The tokens of a letter with dots above it, or of raised or lowered digits.
    fn dotted_or_raised(&mut self, first: char) -> Option<Vec<Kind>> {
        const DOTTED: [(char, char, &str); 5] = [
            ('ż', 'z', "dot"),
            ('ẋ', 'x', "dot"),
            ('ẏ', 'y', "dot"),
            ('ẍ', 'x', "ddot"),
            ('ÿ', 'y', "ddot"),
        ];
        let precomposed = DOTTED.iter().find(|(dotted, ..)| *dotted == first);
        let (letter, dots, length) = match (precomposed, self.peek(1)) {
            (Some(&(_, letter, dots)), _) => (letter, dots, 1),
            (None, Some('\u{307}')) => (first, "dot", 2),
            (None, Some('\u{308}')) => (first, "ddot", 2),
            (None, _) => return self.raised(),
        };
        self.next += length;
        let dots = Kind::Command(dots.to_owned());
        Some(vec![dots, Kind::Character(letter)])
    }

    /// `²`, `⁻¹` and `₁₀` as powers and subscripts in braces.
    fn raised(&mut self) -> Option<Vec<Kind>> {
        const RAISED: &str = "⁰¹²³⁴⁵⁶⁷⁸⁹";
        const LOWERED: &str = "₀₁₂₃₄₅₆₇₈₉";
        let first = self.peek(0)?;
        let (digits, kind) = match LOWERED.contains(first) {
            true => (LOWERED, Kind::Subscript),
            false => (RAISED, Kind::Superscript),
        };
        let is_negative = first == '⁻' && self.peek(1).is_some_and(|c| RAISED.contains(c));
        let mut kinds = vec![kind, Kind::Open];
        if is_negative {
            self.next += 1;
            kinds.push(Kind::Character('-'));
        }
        let number = self.take_while(|c| digits.contains(c));
        let values = number
            .chars()
            .filter_map(|c| digits.chars().position(|d| d == c));
        let digits = values.filter_map(|value| char::from_digit(value as u32, 10));
        kinds.extend(digits.map(Kind::Character));
        kinds.push(Kind::Close);
        (!number.is_empty()).then_some(kinds)
    }

    fn command(&mut self) -> Kind {
        let has_at_letters = self.has_at_letters;
        let name = self.take_while(|c| c.is_ascii_alphabetic() || has_at_letters && c == '@');
        if name.is_empty() {
            let Some(symbol) = self.peek(0) else {
                return Kind::Command(" ".to_owned());
            };
            self.next += 1;
            if symbol == '\\' {
                self.skip_distance();
                return Kind::Break;
            }
            return Kind::Command(symbol.to_string());
        }
        match name.as_str() {
            "newline" => Kind::Break,
            _ => Kind::Command(name),
        }
    }

    /// The star and the distance in brackets that may follow `\\`.
    fn skip_distance(&mut self) {
        if self.peek(0) == Some('*') {
            self.next += 1;
        }
        let rest = &self.characters[self.next..];
        let open = rest.iter().take_while(|c| **c == ' ').count();
        let Some(close) = rest.iter().position(|c| *c == ']') else {
            return;
        };
        let is_distance = rest.get(open) == Some(&'[')
            && close > open + 1
            && (rest[open + 1..close].iter())
                .all(|c| c.is_ascii_alphanumeric() || " .-\\".contains(*c))
            && rest[close - 1].is_ascii_alphabetic();
        if is_distance {
            self.next += close + 1;
        }
    }
}
