//! Equations of the latent accelerations as text.
//!
//! ```text
//! [contact]
//! ddz1 = 0.36 - 0.16*dz1 - 0.91*dz2
//!        - 0.75*sin(dz1) + 0.11*u1      # a comment; the line continues the one before
//! ddz2 = 0
//! ```
//!
//! Each section is a phase with `ddz1` to `ddzd`; a text without sections is one phase (`--phase`). `ddz_1` is `ddz1`.

use super::library::tokens;
use super::*;

pub(super) const MAX_TEXT_BYTES: u64 = 4 << 20;

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Section {
    /// The phase, if the file names it.
    pub phase: Option<String>,
    /// Line of its start, from 1.
    pub line: usize,
    /// In the order of their left sides.
    pub equations: Vec<Equation>,
}

impl Section {
    pub(super) fn new(phase: Option<String>, line: usize) -> Self {
        Self {
            phase,
            line,
            equations: Vec::new(),
        }
    }
}

/// The right side of one equation and where it came from.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Equation {
    /// Latent coordinate, from 0.
    pub output: usize,
    /// Line of the left side, from 1.
    pub line: usize,
    pub(super) pieces: Vec<Piece>,
}

/// A piece of a right side: line and column of its first character, and its text.
pub(super) type Piece = (Position, String);

/// Line and column, from 1.
pub(super) type Position = (usize, usize);

/// The equations of a text or LaTeX file in sections, every one with the same left sides.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Sections {
    pub latent_dim: usize,
    /// In the file's order.
    pub sections: Vec<Section>,
}

pub(super) fn read(file: &str, bytes: &[u8]) -> Read<Sections> {
    let text = text_of(file, bytes)?;
    let sections = Vec::new();
    let mut reader = Reader { file, sections };
    for (index, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or("");
        let indent = line.len() - line.trim_start().len();
        let column = line[..indent].chars().count() + 1;
        reader.line((index + 1, column), line.trim())?;
    }
    let expected = "equations such as `ddz1 = 0.5*z1 + u1`";
    complete(file, reader.sections, text.lines().count(), expected)
}

pub(super) fn text_of<'b>(file: &str, bytes: &'b [u8]) -> Read<&'b str> {
    let text = std::str::from_utf8(bytes).map_err(|error| {
        let before = String::from_utf8_lossy(&bytes[..error.valid_up_to()]);
        let place = Place::of_byte(&before, before.len());
        ImportError::at(file, place, "bytes that are no text", "equations in UTF-8")
    })?;
    Ok(text.strip_prefix('\u{feff}').unwrap_or(text))
}

fn quote(text: &str) -> String {
    let short: String = text.chars().take(40).collect();
    format!("`{}`", short.escape_debug())
}

struct Reader<'f> {
    file: &'f str,
    sections: Vec<Section>,
}

impl Reader<'_> {
    fn refused<T>(&self, place: Position, found: &str, expected: &str) -> Read<T> {
        Err(ImportError::at(self.file, place, found, expected))
    }

    fn line(&mut self, place: Position, content: &str) -> Read<()> {
        if content.is_empty() {
            return Ok(());
        }
        if content.starts_with('[') {
            return self.header(place, content);
        }
        if let Some((left, right)) = content.split_once('=') {
            let start = (place.0, place.1 + left.chars().count() + 1);
            return self.equation(place, left.trim(), pieces(start, right));
        }
        let open = self.sections.last_mut();
        match open.and_then(|section| section.equations.last_mut()) {
            Some(equation) => {
                equation.pieces.extend(pieces(place, content));
                Ok(())
            }
            None => {
                let expected =
                    "a phase such as `[contact]` or an equation such as `ddz1 = 0.5*z1 + u1`";
                self.refused(place, &quote(content), expected)
            }
        }
    }

    fn header(&mut self, place: Position, content: &str) -> Read<()> {
        let name = (content.strip_prefix('[')).and_then(|rest| rest.strip_suffix(']'));
        let Some(name) = name.map(str::trim).filter(|name| !name.is_empty()) else {
            let expected = "the name of a phase in brackets, such as `[contact]`";
            return self.refused(place, &quote(content), expected);
        };
        for Section { phase, line, .. } in &self.sections {
            if phase.is_none() {
                let expected = "the name of its phase in brackets before the first equation";
                return self.refused((*line, 1), "an equation", expected);
            }
            if phase.as_deref() == Some(name) {
                let found = format!("`[{name}]` again, as in line {line}");
                return self.refused(place, &found, "each phase once");
            }
        }
        let section = Section::new(Some(name.to_owned()), place.0);
        self.sections.push(section);
        Ok(())
    }

    fn equation(&mut self, place: Position, left: &str, pieces: Vec<Piece>) -> Read<()> {
        let name = plain_name(left).unwrap_or_else(|| left.to_owned());
        let variable = (name.strip_prefix('d'))
            .and_then(|name| LatentVariable::from_name(name, MAX_LATENT_DIM));
        let Some(LatentVariable::Dz(output)) = variable else {
            let expected = format!("the left side `ddz1` to `ddz{MAX_LATENT_DIM}`");
            return self.refused(place, &quote(left), &expected);
        };
        let line = place.0;
        if self.sections.is_empty() {
            self.sections.push(Section::new(None, line));
        }
        let open = self.sections.last_mut();
        let open = open.expect("one was just made if there was none");
        let mut earlier = open.equations.iter();
        if let Some(earlier) = earlier.find(|other| other.output == output) {
            let found = format!("`{left}` again, as in line {}", earlier.line);
            return self.refused(place, &found, "each left side once per phase");
        }
        open.equations.push(Equation {
            output,
            line,
            pieces,
        });
        Ok(())
    }
}

/// The grammar's spelling of `dz_1` and `pi`.
pub(super) fn plain_name(name: &str) -> Option<String> {
    if name == "pi" {
        return Some(format!("{:?}", std::f64::consts::PI));
    }
    let (stem, index) = name.split_once('_')?;
    let is_index = !index.is_empty() && index.bytes().all(|byte| byte.is_ascii_digit());
    (matches!(stem, "z" | "dz" | "ddz" | "u") && is_index).then(|| format!("{stem}{index}"))
}

/// A text that starts at a place, each name with another spelling in a piece of its own.
fn pieces((line, column): Position, text: &str) -> Vec<Piece> {
    let mut pieces = vec![((line, column), String::new())];
    let mut behind = column;
    for word in tokens(text) {
        let start = behind;
        behind += word.chars().count();
        match (plain_name(word), pieces.last_mut()) {
            (Some(name), _) => {
                pieces.extend([((line, start), name), ((line, behind), String::new())]);
            }
            (None, last) => last.into_iter().for_each(|(_, text)| text.push_str(word)),
        }
    }
    pieces
}

pub(super) fn complete(
    file: &str,
    mut sections: Vec<Section>,
    lines: usize,
    expected: &str,
) -> Read<Sections> {
    let outputs = sections.iter().flat_map(|section| &section.equations);
    let Some(last) = outputs.map(|equation| equation.output).max() else {
        let (place, found) = ((lines.max(1), 1), "the end of the text");
        return Err(ImportError::at(file, place, found, expected));
    };
    let latent_dim = last + 1;
    for section in &mut sections {
        section.equations.sort_by_key(|equation| equation.output);
        let has = |output| section.equations.iter().any(|e| e.output == output);
        if let Some(output) = (0..latent_dim).find(|&output| !has(output)) {
            let phase = section.phase.as_ref();
            let named = |phase: &String| format!("phase `[{phase}]`");
            let phase = phase.map_or("equations".to_owned(), named);
            let found = format!("{phase} without ddz{}", output + 1);
            let expected = format!("ddz1 to ddz{latent_dim} (`ddz{} = 0` if none)", output + 1);
            return Err(ImportError::at(file, (section.line, 1), found, expected));
        }
    }
    Ok(Sections {
        latent_dim,
        sections,
    })
}

impl Equation {
    pub(super) fn parse(&self, file: &str, latent_dim: usize, pool: &mut ExprPool) -> Read<ExprId> {
        let known = |name: &str| LatentVariable::from_name(name, latent_dim).is_some();
        let read = pool.parse_defined(&self.text(), &known, &|_, _| None);
        read.map(|reading| reading.expr).map_err(|error| {
            let place = self.place(error.position);
            match error.kind {
                ParseErrorKind::UnknownName(name) => {
                    let expected = match latent_dim {
                        1 => "z1, dz1 or u1".to_owned(),
                        d => format!("z1 to z{d}, dz1 to dz{d} or u1 to u{d}"),
                    };
                    ImportError::at(file, place, quote(&name), expected)
                }
                kind => ImportError::text(file, place, kind.to_string()),
            }
        })
    }

    /// The right side in the grammar of candidate terms, numbers as they are written.
    pub(crate) fn text(&self) -> String {
        let texts: Vec<&str> = self.pieces.iter().map(|(_, text)| text.as_str()).collect();
        texts.join("\n")
    }

    /// Line and column of a character of the right side, counted from 1 over all pieces.
    fn place(&self, position: usize) -> Position {
        let mut rest = position.saturating_sub(1);
        let mut place = (self.line, 1);
        for ((line, column), text) in &self.pieces {
            let length = text.chars().count();
            place = (*line, column + rest.min(length));
            if rest <= length {
                break;
            }
            // The line break between two pieces counts as well.
            rest -= length + 1;
        }
        place
    }
}
