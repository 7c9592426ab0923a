//! The mathematics of a Markdown file as tokens.

use super::*;

/// Regions over several lines, with their ends: displays, and text that is not printed as mathematics.
const STRETCHES: [(&str, &str); 6] = [
    ("$$", "$$"),
    ("\\[", "\\]"),
    ("<!--", "-->"),
    ("<pre", "</pre>"),
    ("<code", "</code>"),
    ("<script", "</script>"),
];

/// Tokens of displays (`math` fences, `$$`, `\[`) and of mathematics in lines (`$`, `\(`), with headings and text as
/// comments. Code, comments, references and metadata are passed over.
pub(super) fn tokens(text: &str) -> Vec<Token> {
    let mut lines = text.lines().map(str::trim_end);
    let has_metadata = lines.next() == Some("---") && lines.next().is_some_and(|l| l.contains(':'));
    let metadata = has_metadata.then(|| lines.position(|line| line == "---"));
    let first = metadata.flatten().map_or(0, |length| length + 3);
    let mut markdown = Markdown::default();
    for (index, line) in text.lines().enumerate().skip(first) {
        markdown.line(line, index + 1);
    }
    markdown.tokens
}

#[derive(Default)]
struct Markdown {
    tokens: Vec<Token>,
    /// The mark and length of an open fence, and whether mathematics is in it.
    fence: Option<(char, usize, bool)>,
    /// The end of the open region: `$$` of a display, `-->` of a comment.
    skips: Option<&'static str>,
    is_behind_text: bool,
    is_in_list: bool,
}

impl Markdown {
    fn push(&mut self, kind: Kind, place: Position) {
        self.tokens.push(Token {
            kind,
            place,
            is_spaced: true,
        });
    }

    fn mathematics(&mut self, text: &str, place: Position) {
        self.tokens.extend(Lexer::of_part(text, place));
    }

    fn text(&mut self, text: &str, place: Position) {
        if !text.trim().is_empty() {
            self.push(Kind::Comment(text.to_owned()), place);
        }
    }

    fn line(&mut self, line: &str, number: usize) {
        let place = (number, 1);
        let content = line.trim();
        let mark = content.chars().next().filter(|c| "`~".contains(*c));
        let length = content.chars().take_while(|c| Some(*c) == mark).count();
        let rest = content[length..].trim();
        if let Some((open, shortest, is_math)) = self.fence {
            let closes = mark == Some(open) && length >= shortest && rest.is_empty();
            match (closes, is_math) {
                (true, true) => self.push(Kind::Display, place),
                (false, true) => self.mathematics(line, place),
                (_, false) => {}
            }
            self.fence.take_if(|_| closes);
        } else if self.skips.is_some() {
            self.printed(line, number);
        } else if length >= 3 && !rest.contains('`') {
            let is_math = matches!(rest, "math" | "{math}");
            self.fence = mark.map(|mark| (mark, length, is_math));
            if is_math {
                self.push(Kind::Display, place);
            }
        } else if content.starts_with('#') {
            let heading = content.trim_start_matches('#').trim();
            self.push(Kind::Comment(unescaped(heading)), place);
        } else if !self.is_code(line) && !is_reference(content) {
            self.printed(line, number);
        }
    }

    /// Whether a line is code by its indentation, outside of lists.
    fn is_code(&mut self, line: &str) -> bool {
        let content = line.trim_start();
        let is_indented = line.starts_with("    ") || line.starts_with('\t');
        if content.is_empty() {
            self.is_behind_text = false;
            return false;
        }
        if is_indented && !self.is_behind_text && !self.is_in_list {
            return true;
        }
        let number = content.trim_start_matches(|c: char| c.is_ascii_digit());
        let is_item = ["- ", "* ", "+ "]
            .iter()
            .any(|mark| content.starts_with(mark))
            || number.len() < content.len() && number.starts_with(['.', ')']);
        let goes_on = self.is_in_list && (self.is_behind_text || line.starts_with([' ', '\t']));
        self.is_in_list = is_item || goes_on;
        self.is_behind_text = true;
        false
    }

    fn printed(&mut self, line: &str, number: usize) {
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
                self.skips.take_if(|_| is_closed);
                at = (at + length + end.len()).min(line.len());
                text_from = at;
                continue;
            }
            let opened = STRETCHES.into_iter().find(|(open, _)| {
                let inside = rest.strip_prefix(open);
                // A bracket with a backslash may also be one that is printed.
                let is_end = |inside: &str| last_square > Some(at) || inside.trim().is_empty();
                inside.is_some_and(|inside| *open != "\\[" || is_end(inside))
            });
            // Ends are looked for once, so that long lines stay cheap.
            let is_unclosed = rest.starts_with("\\(") && last_round <= Some(at);
            let inline = if is_unclosed { None } else { inline(rest) };
            if let Some((open, end)) = opened {
                self.text(&line[text_from..at], place(text_from));
                if is_display(end) {
                    self.push(Kind::Display, place(at));
                }
                self.skips = Some(end);
                at += open.len();
            } else if let Some((inside, behind)) = inline {
                self.text(&line[text_from..at], place(text_from));
                self.push(Kind::Dollar, place(at));
                self.mathematics(&rest[inside.clone()], place(at + inside.start));
                self.push(Kind::Dollar, place(at + behind - 1));
                at += behind;
                text_from = at;
            } else {
                let first = rest.chars().next().map_or(1, char::len_utf8);
                at += code_or_escape(rest).unwrap_or(first);
            }
        }
        if self.skips.is_none() {
            self.text(&line[text_from..], place(text_from));
        }
    }
}

fn is_display(end: &str) -> bool {
    matches!(end, "$$" | "\\]")
}

/// A line such as `[name]: address`, which prints nothing.
fn is_reference(content: &str) -> bool {
    let name = content
        .strip_prefix('[')
        .and_then(|rest| rest.split_once("]:"));
    name.is_some_and(|(name, _)| !name.contains('['))
}

/// The length of an escape with a backslash, of a span of code, or of its marks alone, at the start of `text`.
fn code_or_escape(text: &str) -> Option<usize> {
    if let Some(escaped) = text.strip_prefix('\\') {
        return Some(1 + escaped.chars().next().map_or(0, char::len_utf8));
    }
    let marks = |text: &str| text.len() - text.trim_start_matches('`').len();
    let length = marks(text);
    let mut behind = length;
    while let Some(next) = text[behind..].find('`').filter(|_| length > 0) {
        let run = marks(&text[behind + next..]);
        behind += next + run;
        if run == length {
            return Some(behind);
        }
    }
    (length > 0).then_some(length)
}

/// Where mathematics in a line is that opens at the start of `text`, and the place behind its end: `$z_1$`, `` $`z_1`$
/// ``. As on GitHub, spaces are not inside next to the marks, and no digit follows (`$5 and $6`). `\(z_1\)` as well.
fn inline(text: &str) -> Option<(Range<usize>, usize)> {
    for (open, end) in [("\\(", "\\)"), ("$`", "`$")] {
        if let Some(inside) = text.strip_prefix(open) {
            let length = inside.find(end)?;
            return Some((2..2 + length, length + 4));
        }
    }
    let inside = text.strip_prefix('$')?;
    let is_end = |(at, _): &(usize, &str)| !inside[..*at].ends_with('\\');
    let (close, _) = inside.match_indices('$').find(is_end)?;
    let is_followed = inside[close + 1..].starts_with(|c: char| c.is_ascii_digit());
    let is_tight = close > 0
        && !inside.starts_with(char::is_whitespace)
        && !inside[..close].ends_with(char::is_whitespace);
    (is_tight && !is_followed).then_some((1..1 + close, close + 2))
}

fn unescaped(text: &str) -> String {
    let mut plain = String::new();
    let mut characters = text.chars().peekable();
    while let Some(character) = characters.next() {
        let escaped = characters.next_if(|next| character == '\\' && next.is_ascii_punctuation());
        plain.push(escaped.unwrap_or(character));
    }
    plain
}
