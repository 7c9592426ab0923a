//! Tokens of LaTeX with their places, in the order in which TeX reads them from a file.

use std::collections::{HashSet, VecDeque};
use std::sync::LazyLock;

use super::*;

const MINUS: char = '\u{2212}';
const RAISED: &str = "⁰¹²³⁴⁵⁶⁷⁸⁹";
const LOWERED: &str = "₀₁₂₃₄₅₆₇₈₉";
/// Letters with dots above them in one character.
const DOTTED: [(char, char, &str); 5] = [
    ('ż', 'z', "dot"),
    ('ẋ', 'x', "dot"),
    ('ẏ', 'y', "dot"),
    ('ẍ', 'x', "ddot"),
    ('ÿ', 'y', "ddot"),
];

/// One token and where it starts: line and column, from 1.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Token {
    pub(super) kind: Kind,
    pub(super) place: Position,
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
    /// A token that TeX would follow and romc does not, and the accepted alternative.
    Unread(Box<str>, &'static str),
}

impl Kind {
    pub(super) fn command(name: &str) -> Self {
        Kind::Command(name.to_owned())
    }

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

    pub(super) fn digit(&self) -> Option<char> {
        match self {
            Kind::Character(c) => Some(*c).filter(char::is_ascii_digit),
            _ => None,
        }
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
        Self { kind, ..*self }
    }

    pub(super) fn quoted(&self) -> String {
        self.kind.quoted()
    }

    pub(super) fn is_command(&self, name: &str) -> bool {
        matches!(&self.kind, Kind::Command(command) if command == name)
    }

    /// The name of a command, empty for other tokens.
    pub(super) fn name(&self) -> &str {
        match &self.kind {
            Kind::Command(name) => name,
            _ => "",
        }
    }
}

static CLASSES: LazyLock<HashMap<&str, HashSet<&str>>> = LazyLock::new(|| {
    let lines = include_str!("words.txt").lines();
    let mut classes: HashMap<&str, HashSet<&str>> = HashMap::new();
    let mut class = "";
    for line in lines.filter(|line| !line.starts_with('#')) {
        let named = line.split_once(": ").filter(|_| !line.starts_with(' '));
        let (name, words) = named.unwrap_or((class, line));
        class = name;
        (classes.entry(class).or_default()).extend(words.split_whitespace());
    }
    classes
});

/// Whether a word is in a class of `words.txt`.
pub(super) fn is_in(class: &str, word: &str) -> bool {
    CLASSES[class].contains(word)
}

pub(super) fn has(list: &str, word: &str) -> bool {
    list.split_whitespace().any(|known| known == word)
}

pub(super) fn spelled<'t>(tokens: impl IntoIterator<Item = &'t Token>) -> String {
    let mut text = String::new();
    for token in tokens {
        if token.is_spaced && !text.is_empty() {
            text.push(' ');
        }
        match &token.kind {
            Kind::Command(name) => text.extend(["\\", name]),
            Kind::Character(character) => text.push(*character),
            kind => text.push_str(kind.quoted().trim_matches('`')),
        }
    }
    text
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
    pub(super) rest: &'t str,
    /// Line and column of the rest.
    place: Position,
    starts_line: bool,
    is_spaced: bool,
    /// Tokens of one character in addition to the last token.
    queued: VecDeque<Token>,
    pub(super) has_at_letters: bool,
}

impl Iterator for Lexer<'_> {
    type Item = Token;

    fn next(&mut self) -> Option<Token> {
        loop {
            if let Some(token) = self.queued.pop_front() {
                return Some(token);
            }
            let first = self.peek(0)?;
            if std::mem::take(&mut self.starts_line) {
                self.is_spaced = true;
                if self.line().trim().is_empty() {
                    self.queue(vec![Kind::Paragraph], self.place);
                    self.is_spaced = true;
                }
            } else if first == '\n' {
                self.next_line();
            } else if first.is_whitespace() {
                self.pass(first.len_utf8());
                self.is_spaced = true;
            } else {
                let place = self.place;
                let of_unicode = self.dotted().or_else(|| self.raised());
                let kinds = of_unicode.unwrap_or_else(|| vec![self.token(first)]);
                self.queue(kinds, place);
            }
        }
    }
}

impl<'t> Lexer<'t> {
    pub(super) fn new(text: &'t str) -> Self {
        Self::of_part(text, (1, 1))
    }

    /// The tokens of a part of a line that starts at `place`.
    pub(super) fn of_part(text: &'t str, place: Position) -> Self {
        Self {
            rest: text,
            place,
            starts_line: true,
            is_spaced: true,
            queued: VecDeque::new(),
            has_at_letters: false,
        }
    }

    fn queue(&mut self, kinds: Vec<Kind>, place: Position) {
        for kind in kinds {
            let is_spaced = std::mem::take(&mut self.is_spaced);
            self.queued.push_back(Token {
                kind,
                place,
                is_spaced,
            });
        }
    }

    pub(super) fn line(&self) -> &'t str {
        self.rest.lines().next().unwrap_or("")
    }

    /// Passes so many bytes of the line.
    fn pass(&mut self, length: usize) {
        let (passed, rest) = self.rest.split_at(length);
        self.place.1 += passed.chars().count();
        self.rest = rest;
    }

    fn next_line(&mut self) {
        self.rest = self.rest.split_once('\n').map_or("", |(_, rest)| rest);
        self.place = (self.place.0 + 1, 1);
        self.starts_line = true;
    }

    /// Passes `|...|` behind `\verb`, or a group without a look into it.
    pub(super) fn skip_verb(&mut self) {
        let line = self.line();
        let inside = line.trim_start_matches('*');
        let Some(open) = inside.chars().next() else {
            return;
        };
        let close = match open {
            '{' => '}',
            '[' => ']',
            other => other,
        };
        let start = line.len() - inside.len() + open.len_utf8();
        let length = line[start..].find(close);
        self.pass(length.map_or(line.len(), |length| start + length + close.len_utf8()));
    }

    /// Passes everything up to `\end{name}` and that; whether it is there.
    pub(super) fn skip_verbatim(&mut self, name: &str) -> bool {
        let end = format!("\\end{{{name}}}");
        while !self.rest.is_empty() {
            let line = self.line();
            if let Some(at) = line.find(&end) {
                self.pass(at + end.len());
                self.starts_line = false;
                return true;
            }
            self.next_line();
        }
        false
    }

    fn peek(&self, ahead: usize) -> Option<char> {
        self.rest.chars().nth(ahead)
    }

    fn take_while(&mut self, accepts: impl Fn(char) -> bool) -> &'t str {
        let text = self.rest;
        let length = text.find(|c| !accepts(c)).unwrap_or(text.len());
        self.pass(length);
        &text[..length]
    }

    fn token(&mut self, first: char) -> Kind {
        self.pass(first.len_utf8());
        match first {
            '\\' => self.command(),
            '%' => {
                let line = self.line();
                self.pass(line.len());
                Kind::Comment(line.trim().to_owned())
            }
            '{' => Kind::Open,
            '}' => Kind::Close,
            '^' => Kind::Superscript,
            '_' => Kind::Subscript,
            '&' => Kind::Align,
            '$' if self.rest.starts_with('$') => {
                self.pass(1);
                Kind::Display
            }
            '$' => Kind::Dollar,
            '#' => match self.peek(0).and_then(|c| c.to_digit(10)) {
                Some(digit) => {
                    self.pass(1);
                    Kind::Parameter(digit as usize)
                }
                None => Kind::Character('#'),
            },
            MINUS => Kind::Character('-'),
            '·' | '⋅' | '×' => Kind::command("cdot"),
            _ => Kind::Character(first),
        }
    }

    fn dotted(&mut self) -> Option<Vec<Kind>> {
        let first = self.peek(0)?;
        let whole = DOTTED.iter().find(|(dotted, ..)| *dotted == first);
        let (letter, dots, marks) = match (whole, self.peek(1)) {
            (Some((_, letter, dots)), _) => (*letter, *dots, 0),
            (None, Some('\u{307}')) => (first, "dot", '\u{307}'.len_utf8()),
            (None, Some('\u{308}')) => (first, "ddot", '\u{308}'.len_utf8()),
            _ => return None,
        };
        self.pass(first.len_utf8() + marks);
        Some(vec![Kind::command(dots), Kind::Character(letter)])
    }

    /// `²`, `⁻¹` and `₁₀` as powers and subscripts in braces.
    fn raised(&mut self) -> Option<Vec<Kind>> {
        let first = self.peek(0)?;
        let (digits, kind) = match LOWERED.contains(first) {
            true => (LOWERED, Kind::Subscript),
            false => (RAISED, Kind::Superscript),
        };
        let mut kinds = vec![kind, Kind::Open];
        if first == '⁻' && self.peek(1).is_some_and(|c| RAISED.contains(c)) {
            self.pass(first.len_utf8());
            kinds.push(Kind::Character('-'));
        }
        let number = self.take_while(|c| digits.contains(c)).chars();
        let values = number.filter_map(|c| digits.chars().position(|d| d == c));
        let digits = values.filter_map(|value| char::from_digit(value as u32, 10));
        kinds.extend(digits.map(Kind::Character));
        kinds.push(Kind::Close);
        (kinds.len() > 3).then_some(kinds)
    }

    fn command(&mut self) -> Kind {
        let has_at_letters = self.has_at_letters;
        let name = self.take_while(|c| c.is_ascii_alphabetic() || has_at_letters && c == '@');
        let symbol = self.line().chars().next();
        match (name, symbol) {
            ("newline", _) => Kind::Break,
            ("", None) => Kind::command(" "),
            ("", Some(symbol)) => {
                self.pass(symbol.len_utf8());
                if symbol != '\\' {
                    return Kind::Command(symbol.to_string());
                }
                self.skip_distance();
                Kind::Break
            }
            _ => Kind::command(name),
        }
    }

    /// The star and the distance in brackets that may follow `\\`.
    fn skip_distance(&mut self) {
        self.pass(usize::from(self.rest.starts_with('*')));
        let start = self.rest.trim_start_matches(' ');
        let inside = start.strip_prefix('[').unwrap_or("");
        let is_part = |c: char| c.is_ascii_alphanumeric() || " .-\\".contains(c);
        let distance = inside.split(|c| !is_part(c)).next().unwrap_or("");
        if inside[distance.len()..].starts_with(']')
            && distance.ends_with(|c: char| c.is_ascii_alphabetic())
        {
            self.pass(self.rest.len() - inside.len() + distance.len() + 1);
        }
    }
}
