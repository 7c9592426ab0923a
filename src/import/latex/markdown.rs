//! The mathematics of a Markdown file as tokens.

use super::token::{Kind, Lexer, Token};

/// What stretches over lines, with its ends: displays, and what is not printed as mathematics.
const STRETCHES: [(&str, &str); 6] = [
    ("$$", "$$"),
    ("\\[", "\\]"),
    ("<!--", "-->"),
    ("<pre", "</pre>"),
    ("<code", "</code>"),
    ("<script", "</script>"),
];

/// Tokens of the displays (`math` fences, `$$`, `\[`) and of the mathematics in the lines (`$`, `\(`), with headings and
/// the text around as comments. Code, comments, references and what stands before the text are passed over.
pub(super) fn tokens(text: &str) -> Vec<Token> {
    let mut markdown = Markdown::default();
    // The mark and length of an open fence, and whether mathematics is in it.
    let mut fence: Option<(char, usize, bool)> = None;
    let mut indented = Indented::default();
    let mut lines = text.lines().map(str::trim_end);
    let has_metadata = lines.next() == Some("---") && lines.next().is_some_and(|l| l.contains(':'));
    let metadata = if has_metadata {
        lines.position(|line| line == "---")
    } else {
        None
    };
    let first = metadata.map_or(0, |length| length + 3);
    for (index, line) in text.lines().enumerate().skip(first) {
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
                let is_math = matches!(rest, "math" | "{math}");
                fence = mark.map(|mark| (mark, length, is_math));
                if is_math {
                    markdown.push(Kind::Display, place);
                }
            }
            None if markdown.skips.is_none() && content.starts_with('#') => {
                let heading = content.trim_start_matches('#').trim();
                markdown.push(Kind::Comment(unescaped(heading)), place);
            }
            None if markdown.skips.is_none()
                && (indented.is_code(line) || is_reference(content)) => {}
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

    fn line(&mut self, line: &str, (number, _): (usize, usize)) {
        // Places are asked for from left to right.
        let mut counted = (0, 1);
        let mut place = |at: usize| {
            counted = (at, counted.1 + line[counted.0..at].chars().count());
            (number, counted.1)
        };
        let (mut at, mut text_from) = (0, 0);
        let [last_round, last_square] = ["\\)", "\\]"].map(|end| line.rfind(end));
        while at < line.len() {
            let rest = &line[at..];
            if let Some(end) = self.skips {
                let length = rest.find(end).unwrap_or(rest.len());
                let is_closed = length < rest.len();
                if is_display(end) {
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
            // Ends are looked for once, so that long lines stay cheap.
            let inline = match rest.starts_with("\\(") && last_round <= Some(at) {
                true => None,
                false => inline(rest),
            };
            let opened = STRETCHES.into_iter().find(|(open, _)| {
                let inside = rest.strip_prefix(open);
                // A bracket with a backslash may also be one that is printed.
                let is_end = |inside: &str| last_square > Some(at) || inside.trim().is_empty();
                inside.is_some_and(|inside| *open != "\\[" || is_end(inside))
            });
            let span = match opened.is_some() || inline.is_some() {
                true => None,
                false => code_or_escape(rest),
            };
            if opened.is_some() || inline.is_some() {
                self.text(&line[text_from..at], place(text_from));
            }
            match (span, opened, inline) {
                (Some(length), ..) => at += length,
                (None, Some((open, end)), _) => {
                    if is_display(end) {
                        self.push(Kind::Display, place(at));
                    }
                    self.skips = Some(end);
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

fn is_display(end: &str) -> bool {
    matches!(end, "$$" | "\\]")
}

/// A line such as `[name]: address`, which prints nothing.
fn is_reference(content: &str) -> bool {
    content.starts_with('[')
        && content
            .split_once("]:")
            .is_some_and(|(name, _)| !name[1..].contains('['))
}

/// Finds code by its indentation, outside of lists.
#[derive(Default)]
struct Indented {
    is_behind_text: bool,
    is_in_list: bool,
}

impl Indented {
    fn is_code(&mut self, line: &str) -> bool {
        let content = line.trim_start();
        let is_indented = line.starts_with("    ") || line.starts_with('\t');
        if content.is_empty() {
            self.is_behind_text = false;
            return false;
        }
        let number = content.trim_start_matches(|c: char| c.is_ascii_digit());
        let is_item = ["- ", "* ", "+ "]
            .iter()
            .any(|mark| content.starts_with(mark))
            || number.len() < content.len() && number.starts_with(['.', ')']);
        let is_code = is_indented && !self.is_behind_text && !self.is_in_list;
        if !is_code {
            let goes_on = self.is_in_list && (self.is_behind_text || line.starts_with([' ', '\t']));
            self.is_in_list = is_item || goes_on;
            self.is_behind_text = true;
        }
        is_code
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
/// As on GitHub, spaces are not inside next to the marks, and no digit follows (`$5 and $6`). `\(z_1\)` as well.
fn inline(text: &str) -> Option<(std::ops::Range<usize>, usize)> {
    if let Some(inside) = text.strip_prefix("\\(") {
        let length = inside.find("\\)")?;
        return Some((2..2 + length, length + 4));
    }
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
