//! Tokens of LaTeX with their places, line by line.

/// The minus of Unicode.
const MINUS: char = '\u{2212}';

/// One token and where it starts: line and column, from 1.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Token {
    pub(super) kind: Kind,
    pub(super) place: (usize, usize),
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Kind {
    /// `\frac`, `\,`; without its backslash.
    Command(String),
    /// `\begin{...}`.
    Begin(String),
    /// `\end{...}`.
    End(String),
    /// `\label{...}`.
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
    /// Digits with at most one point, and an exponent as in `1.2e-3`.
    Number(String),
    /// `#1`.
    Parameter(usize),
    /// The text after `%`; a heading in Markdown.
    Comment(String),
    /// An empty line.
    Paragraph,
    Character(char),
}

impl Kind {
    /// A token of the kind in quotes, for messages.
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
            Kind::Number(text) => text.clone(),
            Kind::Parameter(number) => format!("#{number}"),
            Kind::Comment(_) => "%".to_owned(),
            Kind::Paragraph => return "an empty line".to_owned(),
            Kind::Character(c) if c.is_control() => c.escape_debug().to_string(),
            Kind::Character(character) => character.to_string(),
        };
        let short: String = text.chars().take(40).collect();
        format!("`{short}`")
    }

    /// Whether it ends every term that it stands behind.
    pub(super) fn ends_term(&self) -> bool {
        match self {
            Kind::Align
            | Kind::Break
            | Kind::Close
            | Kind::Label(_)
            | Kind::Comment(_)
            | Kind::Paragraph => true,
            Kind::Command(_)
            | Kind::Begin(_)
            | Kind::End(_)
            | Kind::Open
            | Kind::Superscript
            | Kind::Subscript
            | Kind::Dollar
            | Kind::Display
            | Kind::Number(_)
            | Kind::Parameter(_)
            | Kind::Character(_) => false,
        }
    }
}

impl Token {
    /// Another kind of token at the same place.
    pub(super) fn with(&self, kind: Kind) -> Self {
        let place = self.place;
        Self { kind, place }
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

/// Tokens of a TeX file.
pub(super) fn of_tex(text: &str) -> Vec<Token> {
    let mut tokens = Vec::new();
    for (index, line) in text.lines().enumerate() {
        Line::new(line, index + 1, 1).read(&mut tokens);
    }
    tokens
}

/// Tokens of the displays in a Markdown file (`math` fences and `$$`), with its headings as
/// comments; other text gives comments only where it speaks of the coefficients' digits.
pub(super) fn of_markdown(text: &str) -> Vec<Token> {
    let mut tokens = Vec::new();
    let mut fence: Option<bool> = None;
    let mut in_display = false;
    for (index, line) in text.lines().enumerate() {
        let number = index + 1;
        let mut push = |kind| {
            let place = (number, 1);
            tokens.push(Token { kind, place });
        };
        let content = line.trim();
        let opens = content.strip_prefix("```");
        let opens = opens.filter(|_| fence.is_none() && !in_display);
        if opens.is_some() || fence.is_some() && content == "```" {
            let is_math = opens.map_or(fence == Some(true), |language| language.trim() == "math");
            fence = opens.map(|_| is_math);
            if is_math {
                push(Kind::Display);
            }
            continue;
        }
        if let Some(is_math) = fence {
            if is_math {
                Line::new(line, number, 1).read(&mut tokens);
            }
            continue;
        }
        if !in_display && content.starts_with('#') {
            let heading = content.trim_start_matches('#').trim();
            push(Kind::Comment(unescaped(heading)));
            continue;
        }
        let mut column = 1;
        for (index, part) in line.split("$$").enumerate() {
            let place = (number, column);
            if index > 0 {
                in_display = !in_display;
                let (kind, place) = (Kind::Display, (number, column - 2));
                tokens.push(Token { kind, place });
            }
            if in_display {
                Line::new(part, number, column).read(&mut tokens);
            } else if !part.trim().is_empty() {
                let kind = Kind::Comment(part.to_owned());
                tokens.push(Token { kind, place });
            }
            column += part.chars().count() + 2;
        }
    }
    tokens
}

/// Markdown's backslashes before punctuation taken away.
fn unescaped(text: &str) -> String {
    let mut plain = String::new();
    let mut characters = text.chars().peekable();
    while let Some(character) = characters.next() {
        let escapes =
            character == '\\' && characters.peek().is_some_and(char::is_ascii_punctuation);
        if !escapes {
            plain.push(character);
        } else if let Some(next) = characters.next() {
            plain.push(next);
        }
    }
    plain
}

/// One line being read.
struct Line {
    characters: Vec<char>,
    next: usize,
    number: usize,
    /// Column of the first character.
    start: usize,
}

impl Line {
    fn new(text: &str, number: usize, start: usize) -> Self {
        Self {
            characters: text.chars().collect(),
            next: 0,
            number,
            start,
        }
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

    fn read(mut self, tokens: &mut Vec<Token>) {
        if self.characters.iter().all(|c| c.is_whitespace()) {
            let (kind, place) = (Kind::Paragraph, (self.number, self.start));
            tokens.push(Token { kind, place });
        }
        while let Some(first) = self.peek(0) {
            let place = (self.number, self.start + self.next);
            if first.is_whitespace() {
                self.next += 1;
                continue;
            }
            let of_unicode = self.dotted_or_raised(first);
            let kinds = of_unicode.unwrap_or_else(|| vec![self.token(first)]);
            tokens.extend(kinds.into_iter().map(|kind| Token { kind, place }));
        }
    }

    fn token(&mut self, first: char) -> Kind {
        let starts_decimal = first == '.' && self.peek(1).is_some_and(|c| c.is_ascii_digit());
        if first.is_ascii_digit() || starts_decimal {
            return self.number();
        }
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
        let number: String = values.map(|value| value.to_string()).collect();
        kinds.extend([Kind::Number(number.clone()), Kind::Close]);
        (!number.is_empty()).then_some(kinds)
    }

    /// Digits, a point (or comma in braces) with digits after it, and an exponent with digits.
    fn number(&mut self) -> Kind {
        let digit = |c: char| c.is_ascii_digit();
        let mut text = self.take_while(digit);
        let decimals = |from: usize| {
            let rest = self.characters.iter().skip(self.next + from);
            rest.take_while(|c| digit(**c)).count()
        };
        // 0{,}36 is a decimal fraction; 1{,}500 may be a large number, and is none.
        let is_decimal = text == "0" || decimals(3) != 3;
        let point = match [0, 1, 2].map(|ahead| self.peek(ahead)) {
            [Some('.'), ..] => 1,
            [Some('{'), Some(','), Some('}')] if is_decimal => 3,
            _ => 0,
        };
        if point > 0 && self.peek(point).is_some_and(digit) {
            self.next += point;
            text = format!("{text}.{}", self.take_while(digit));
        }
        let sign = usize::from(matches!(self.peek(1), Some('+' | '-' | MINUS)));
        if matches!(self.peek(0), Some('e' | 'E')) && self.peek(1 + sign).is_some_and(digit) {
            let exponent = match self.peek(1) {
                Some('-' | MINUS) => "e-",
                _ => "e",
            };
            self.next += 1 + sign;
            text = format!("{text}{exponent}{}", self.take_while(digit));
        }
        Kind::Number(text)
    }

    fn command(&mut self) -> Kind {
        let name = self.take_while(|c| c.is_ascii_alphabetic());
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
        let kind: fn(String) -> Kind = match name.as_str() {
            "begin" => Kind::Begin,
            "end" => Kind::End,
            "label" => Kind::Label,
            "newline" => return Kind::Break,
            _ => return Kind::Command(name),
        };
        let rest = &self.characters[self.next..];
        let open = rest.iter().take_while(|c| **c == ' ').count();
        match (rest.get(open), rest.iter().position(|c| *c == '}')) {
            (Some('{'), Some(close)) => {
                let inside: String = rest[open + 1..close].iter().collect();
                self.next += close + 1;
                kind(inside.trim().to_owned())
            }
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
