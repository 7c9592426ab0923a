//! The mathematics of a Markdown file as tokens.

use super::token::{Kind, Lexer, Token};

/// Tokens of the displays (`math` fences and `$$`) and of the mathematics in the lines (`$`), with headings and the
/// text around as comments. Code, and comments of HTML, are passed over.
pub(super) fn tokens(text: &str) -> Vec<Token> {
    let mut markdown = Markdown::default();
    // The mark and length of an open fence, and whether mathematics is in it.
    let mut fence: Option<(char, usize, bool)> = None;
    for (index, line) in text.lines().enumerate() {
        let place = (index + 1, 1);
        let content = line.trim();
        let mark = content.chars().next().filter(|c| "`~".contains(*c));
        let length = content.chars().take_while(|c| Some(*c) == mark).count();
        let rest = content[length..].trim();
        match fence {
            Some((open, shortest, is_math)) => {
                let closes = mark == Some(open) && length >= shortest && rest.is_empty();
                match (closes, is_math) {
                    (true, true) => markdown.push(Kind::Display, place),
                    (false, true) => markdown.mathematics(line, place),
                    (_, false) => {}
                }
                fence = fence.filter(|_| !closes);
            }
            None if markdown.skips.is_none() && length >= 3 && !rest.contains('`') => {
                let is_math = rest == "math";
                fence = mark.map(|mark| (mark, length, is_math));
                if is_math {
                    markdown.push(Kind::Display, place);
                }
            }
            None if markdown.skips.is_none() && content.starts_with('#') => {
                let heading = content.trim_start_matches('#').trim();
                markdown.push(Kind::Comment(unescaped(heading)), place);
            }
            None => markdown.line(line, place),
        }
    }
    markdown.tokens
}

#[derive(Default)]
struct Markdown {
    tokens: Vec<Token>,
    /// The end of what is open: `$$` of a display, `-->` of a comment.
    skips: Option<&'static str>,
}

impl Markdown {
    fn push(&mut self, kind: Kind, place: (usize, usize)) {
        let is_spaced = true;
        self.tokens.push(Token {
            kind,
            place,
            is_spaced,
        });
    }

    fn mathematics(&mut self, text: &str, place: (usize, usize)) {
        self.tokens.extend(Lexer::of_part(text, place));
    }

    /// One line outside fences.
    fn line(&mut self, line: &str, (number, _): (usize, usize)) {
        // Places are asked for from left to right.
        let mut counted = (0, 1);
        let mut place = |at: usize| {
            counted = (at, counted.1 + line[counted.0..at].chars().count());
            (number, counted.1)
        };
        let (mut at, mut text_from) = (0, 0);
        while at < line.len() {
            let rest = &line[at..];
            if let Some(end) = self.skips {
                let length = rest.find(end).unwrap_or(rest.len());
                let is_closed = length < rest.len();
                if end == "$$" {
                    self.mathematics(&rest[..length], place(at));
                    if is_closed {
                        self.push(Kind::Display, place(at + length));
                    }
                }
                self.skips = self.skips.filter(|_| !is_closed);
                at = (at + length + end.len()).min(line.len());
                text_from = at;
                continue;
            }
            let first = rest.chars().next().map_or(1, char::len_utf8);
            let span = code_or_escape(rest);
            let (open, inline) = (["$$", "<!--"], inline(rest));
            let opened = open.into_iter().find(|open| rest.starts_with(open));
            if span.is_none() && (opened.is_some() || inline.is_some()) {
                self.text(&line[text_from..at], place(text_from));
            }
            match (span, opened, inline) {
                (Some(length), ..) => at += length,
                (None, Some("$$"), _) => {
                    self.push(Kind::Display, place(at));
                    self.skips = Some("$$");
                    at += 2;
                }
                (None, Some(open), _) => {
                    self.skips = Some("-->");
                    at += open.len();
                }
                (None, None, Some((inside, behind))) => {
                    self.push(Kind::Dollar, place(at));
                    self.mathematics(&rest[inside.clone()], place(at + inside.start));
                    self.push(Kind::Dollar, place(at + behind - 1));
                    at += behind;
                    text_from = at;
                }
                (None, None, None) => at += first,
            }
        }
        if self.skips.is_none() {
            self.text(&line[text_from..], place(text_from));
        }
    }

    fn text(&mut self, text: &str, place: (usize, usize)) {
        if !text.trim().is_empty() {
            self.push(Kind::Comment(text.to_owned()), place);
        }
    }
}

/// The length of what begins with a backslash, of a span of code, or of its marks alone, at the start of `text`.
fn code_or_escape(text: &str) -> Option<usize> {
    if let Some(escaped) = text.strip_prefix('\\') {
        return Some(1 + escaped.chars().next().map_or(0, char::len_utf8));
    }
    let length = text.len() - text.trim_start_matches('`').len();
    let rest = &text[length..];
    if length == 0 {
        return None;
    }
    let mut from = 0;
    loop {
        let Some(next) = rest[from..].find('`') else {
            return Some(length);
        };
        let start = from + next;
        let run = rest[start..].len() - rest[start..].trim_start_matches('`').len();
        from = start + run;
        if run == length {
            return Some(length + from);
        }
    }
}

/// Where mathematics in a line is that opens at the start of `text`, and the place behind its end: `$z_1$`, `` $`z_1`$ ``.
/// As on GitHub, spaces are not inside next to the marks, and no digit follows (`$5 and $6`).
fn inline(text: &str) -> Option<(std::ops::Range<usize>, usize)> {
    let inside = text.strip_prefix('$')?;
    if let Some(inside) = inside.strip_prefix('`') {
        let length = inside.find("`$")?;
        return Some((2..2 + length, length + 4));
    }
    let mut from = 0;
    loop {
        let close = from + inside[from..].find('$')?;
        let before = inside[..close].chars().next_back()?;
        let is_followed = inside[close + 1..].starts_with(|c: char| c.is_ascii_digit());
        if before != '\\' {
            let is_open = !inside.starts_with(char::is_whitespace);
            let ends = is_open && !before.is_whitespace() && !is_followed;
            return ends.then_some((1..1 + close, close + 2));
        }
        from = close + 1;
    }
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
