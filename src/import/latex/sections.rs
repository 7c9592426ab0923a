//! From a document's displays to sections of equations: one per phase.

use super::super::equations::{Section, Sections, complete, text_of};
use super::super::error::ImportError;
use super::document::{Item, LAYOUTS, WITH_COLUMNS, is_one_of, items, unread};
use super::markdown;
use super::names::SymbolNames;
use super::reader::{Digits, Reader, Symbol};
use super::token::{Kind, Token, group_length};

/// Environments that arrange lines only if whole equations are in them.
const DISTINCTIONS: &str = "cases dcases array";

/// Reads the equations of a document.
///
/// `known` are names of phases, which labels may end in; the phase of a comment `Phase NAME` (a
/// heading in Markdown) goes before that of a label.
pub(in crate::import) fn read(
    file: &str,
    bytes: &[u8],
    names: &SymbolNames,
    known: &[String],
) -> Result<Sections, ImportError> {
    let text = text_of(file, bytes)?;
    let is_markdown = file.ends_with(".md") || file.ends_with(".markdown");
    let items = match is_markdown {
        true => items(file, markdown::tokens(text), "")?,
        false => items(file, Vec::new(), text)?,
    };
    let mut document = Document {
        file,
        names,
        known,
        digits: None,
        phase: None,
        starts_phase: false,
        strange: None,
        sections: Vec::new(),
    };
    // In Markdown the sentence stands behind the equations.
    let stated = items.iter().find_map(|item| match item {
        Item::Comment(text) if is_markdown => stated_digits(text).flatten(),
        _ => None,
    });
    // Equations in the lines of the text count where there are no others.
    for in_lines in [false, true] {
        if !document.sections.is_empty() {
            refuse_others_in_lines(&document, &items)?;
            break;
        }
        (document.digits, document.phase, document.starts_phase) = (stated, None, false);
        let alone = !has_indexed_left_side(file, &items, in_lines);
        for item in &items {
            if let Item::Comment(text) = item {
                document.comment(text);
            }
            if let Some(tokens) = item.equations(in_lines) {
                document.display(tokens, alone)?;
            }
        }
    }
    if let (true, Some((token, found))) = (document.sections.is_empty(), document.strange) {
        let expected = format!("\\ddot z_1 and so on, with {}", names.expected());
        return Err(ImportError::at(file, token.place, found, expected));
    }
    let expected = match is_markdown {
        true => "an equation such as $$ \\ddot z_1 = 0.5 z_1 + u_1 $$",
        false => "an equation such as \\begin{align} \\ddot z_1 &= 0.5 z_1 + u_1 \\end{align}",
    };
    complete(file, document.sections, text.lines().count(), expected)
}

/// The left sides of a formula and the coordinates that they are of, if of any.
fn left_sides(file: &str, names: &SymbolNames, tokens: &[Token]) -> Vec<(Symbol, Option<usize>)> {
    let Ok(mut reader) = Reader::new(file, names, tokens) else {
        return Vec::new();
    };
    let found = reader.left_sides().into_iter();
    let with_output = |(_, symbol, _)| {
        let output = reader.output(&symbol);
        (symbol, output)
    };
    found.map(with_output).collect()
}

/// Refuses equations in the lines of the text for coordinates that no display has: they would be dropped.
fn refuse_others_in_lines(document: &Document<'_>, items: &[Item]) -> Result<(), ImportError> {
    let (file, names) = (document.file, document.names);
    let equations = document.sections.iter().flat_map(|s| &s.equations);
    let known: Vec<usize> = equations.map(|equation| equation.output).collect();
    let in_lines = items.iter().filter_map(|item| item.equations(true));
    let mut found = in_lines.flat_map(|tokens| left_sides(file, names, tokens));
    match found.find(|(_, output)| output.is_some_and(|output| !known.contains(&output))) {
        None => Ok(()),
        Some((symbol, _)) => {
            let found = format!("{} in a line of the text", symbol.quoted());
            let expected = "a display for it, as for the other equations";
            Err(ImportError::at(file, symbol.place, found, expected))
        }
    }
}

/// Whether a left side `\ddot z_1` has an index, so that `z` alone is no coordinate.
fn has_indexed_left_side(file: &str, items: &[Item], in_lines: bool) -> bool {
    let names = SymbolNames::default();
    let formulas = items.iter().filter_map(|item| item.equations(in_lines));
    let mut found = formulas.flat_map(|tokens| left_sides(file, &names, tokens));
    found.any(|(_, output)| output.is_some())
}

/// The tokens without `\begin` and `\end` of environments that arrange lines, and without the
/// brace that `\left\{` puts before them.
fn flattened(file: &str, tokens: &[Token]) -> Result<Vec<Token>, ImportError> {
    let mut flat: Vec<Token> = Vec::with_capacity(tokens.len());
    let mut open: Vec<&Token> = Vec::new();
    let mut at = 0;
    while let Some(token) = tokens.get(at) {
        at += 1;
        match &token.kind {
            Kind::Begin(name)
                if is_layout(name)
                    || is_one_of(DISTINCTIONS, name) && has_left_side(&tokens[at..], name) =>
            {
                open.push(token);
                if flat.len() >= 2 && flat[flat.len() - 2].is_command("left") {
                    flat.truncate(flat.len() - 2);
                }
                let kind = |at: usize| tokens.get(at).map(|token| &token.kind);
                if kind(at) == Some(&Kind::Character('[')) {
                    // A vertical position such as [t].
                    at += 3;
                }
                if is_one_of(WITH_COLUMNS, name) && kind(at) == Some(&Kind::Open) {
                    let rest = &tokens[at..];
                    at += group_length(rest.iter()).unwrap_or(rest.len());
                }
            }
            Kind::End(name)
                if is_layout(name)
                    || is_one_of(DISTINCTIONS, name) && open.last().is_some_and(is_distinction) =>
            {
                if open.pop().map(|begin| &begin.kind) != Some(&Kind::Begin(name.clone())) {
                    let expected = "environments that end in the order in which they begin";
                    return Err(ImportError::at(file, token.place, token.quoted(), expected));
                }
                let next = tokens.get(at);
                if next.is_some_and(|token| token.is_command("right")) {
                    at += 2;
                }
            }
            _ => flat.push(token.clone()),
        }
    }
    match open.first() {
        None => Ok(flat),
        Some(token) => {
            let found = format!("{} without its end", token.quoted());
            let expected = "environments that end inside their display";
            Err(ImportError::at(file, token.place, found, expected))
        }
    }
}

/// Whether an environment only arranges lines. `subequations` is none of [`LAYOUTS`], which begin displays: it holds
/// displays, and text between them.
fn is_layout(name: &str) -> bool {
    is_one_of(LAYOUTS, name) || is_one_of("subequations", name)
}

fn is_distinction(token: &&Token) -> bool {
    matches!(&token.kind, Kind::Begin(name) if is_one_of(DISTINCTIONS, name))
}

/// Whether the environment of this name whose contents begin here has equations in it: it is then no matrix, and on no
/// right side, where it would tell cases apart.
fn has_left_side(contents: &[Token], name: &str) -> bool {
    let end = Kind::End(name.to_owned());
    let mut inside = contents.iter().take_while(|token| token.kind != end);
    inside.any(|token| token.is_command("ddot"))
}

/// The digits that a comment states, none in what is no such comment.
fn stated_digits(comment: &str) -> Option<Option<Digits>> {
    let rest = comment.trim().strip_prefix("Coefficients have ")?;
    let mut words = rest.split_whitespace();
    let count = words.next().and_then(|word| word.parse().ok());
    Some(match (count, words.next()) {
        (Some(count), Some("significant")) => Some(Digits::Significant(count)),
        (Some(count), Some("decimals.")) => Some(Digits::Decimals(count)),
        _ => None,
    })
}

struct Document<'d> {
    file: &'d str,
    names: &'d SymbolNames,
    known: &'d [String],
    digits: Option<Digits>,
    phase: Option<String>,
    starts_phase: bool,
    /// The first left side of a variable that is not known.
    strange: Option<(Token, String)>,
    sections: Vec<Section>,
}

impl Document<'_> {
    fn comment(&mut self, text: &str) {
        let text = text.trim();
        if let Some(name) = text.strip_prefix("Phase ") {
            let name = name.split(": ").next().unwrap_or(name);
            let name = name.trim().trim_end_matches([':', '.']).trim();
            self.phase = (!name.is_empty()).then(|| name.to_owned());
            self.starts_phase = self.phase.is_some();
        }
        if let Some(digits) = stated_digits(text) {
            self.digits = digits;
        }
    }

    fn display(&mut self, tokens: &[Token], alone: bool) -> Result<(), ImportError> {
        let Some(dotted) = tokens.iter().find(|token| token.is_command("ddot")) else {
            return Ok(());
        };
        if let Some((token, expected)) = unread(tokens) {
            return Err(ImportError::at(
                self.file,
                token.place,
                token.quoted(),
                expected,
            ));
        }
        let flat = flattened(self.file, tokens);
        let mut reader = match &flat {
            Ok(flat) => Reader::new(self.file, self.names, flat)?,
            Err(_) => Reader::new(self.file, self.names, tokens)?,
        };
        (reader.alone, reader.digits) = (alone, self.digits);
        let mut left_sides = Vec::new();
        let mut strange = None;
        let found = reader.left_sides();
        let places: Vec<usize> = found.iter().map(|(at, ..)| *at).collect();
        if let Some(token) = reader.in_text(&places) {
            let (place, found) = (token.place, format!("an equation in {}", token.quoted()));
            let expected = "equations in the formula itself";
            return Err(ImportError::at(self.file, place, found, expected));
        }
        for (at, symbol, after) in found {
            let token = reader.tokens[at].clone();
            match reader.output(&symbol) {
                Some(output) => left_sides.push((output, at, after, token)),
                None => {
                    strange.get_or_insert((token, symbol.quoted()));
                }
            }
        }
        if left_sides.is_empty() {
            let unequal = "a second derivative without `=` behind its variable";
            let found = strange.unwrap_or((dotted.clone(), unequal.to_owned()));
            self.strange.get_or_insert(found);
            return Ok(());
        }
        flat?;
        let refuse = |token: &Token, found: String, expected: &str| {
            Err(ImportError::at(self.file, token.place, found, expected))
        };
        if let Some((token, found)) = strange {
            return refuse(&token, found, &self.names.expected());
        }
        if let Some(token) = reader.printed(0, left_sides[0].1) {
            return refuse(&token, token.quoted(), "a left side such as `\\ddot z_1 =`");
        }
        let total = reader.tokens.len();
        let shared = self.label(&reader.tokens[..left_sides[0].1]);
        let mut before = 0;
        for (place, (output, _, after, token)) in left_sides.iter().enumerate() {
            let end = left_sides.get(place + 1).map_or(total, |next| next.1);
            let own = || self.label(&reader.tokens[*after..end]);
            let label = shared.clone().or_else(own);
            for token in &reader.tokens[before..*after] {
                if let Kind::Comment(text) = &token.kind {
                    self.comment(text);
                }
            }
            before = *after;
            let equation = reader.equation(*output, token.place.0, *after, end)?;
            let section = self.section(*output, token, label)?;
            section.equations.push(equation);
        }
        Ok(())
    }

    /// The phase that a label among `tokens` ends in.
    fn label(&self, tokens: &[Token]) -> Option<String> {
        let label = tokens.iter().find_map(|token| match &token.kind {
            Kind::Label(label) => Some(label.as_str()),
            _ => None,
        })?;
        // Rows of one system are numbered: eq:model:contact:2.
        let stem = label.trim_end_matches(|c: char| c.is_ascii_digit());
        let stem = (stem.strip_suffix(':'))
            .filter(|stem| *stem != label)
            .unwrap_or(label);
        let plain = |text: &str| text.replace(|c: char| !c.is_ascii_alphanumeric(), "-");
        let ends_in = |name: &&String| {
            let (name, texts) = (plain(name), [label, stem].map(plain));
            let rest = texts.iter().find_map(|text| text.strip_suffix(&name));
            !name.is_empty() && rest.is_some_and(|rest| rest.is_empty() || rest.ends_with('-'))
        };
        let known = (self.known.iter().filter(ends_in)).max_by_key(|name| name.len());
        let last = || stem.rsplit_once(':').map(|(_, last)| last.to_owned());
        (known.cloned().or_else(last))
            .filter(|name| !name.bytes().all(|byte| byte.is_ascii_digit()))
    }

    /// The section that an equation belongs to: the open one, or a new one where a comment or
    /// label names another phase, or where the left side is there already.
    fn section(
        &mut self,
        output: usize,
        token: &Token,
        label: Option<String>,
    ) -> Result<&mut Section, ImportError> {
        let starts_phase = std::mem::take(&mut self.starts_phase);
        let named = self.phase.clone().filter(|_| starts_phase);
        let is_known = |name: &String| self.known.contains(name);
        let is_new = self.sections.last().is_none_or(|open| {
            let mut equations = open.equations.iter();
            let repeats = equations.any(|equation| equation.output == output);
            let is_other = label.as_ref().is_some_and(is_known) && label != open.phase;
            named.is_some() || repeats || self.phase.is_none() && is_other
        });
        if is_new {
            let named = named.or(label.clone().filter(|_| self.phase.is_none()));
            if let Some(earlier) =
                (self.sections.iter()).find(|section| named.is_some() && section.phase == named)
            {
                let name = named.unwrap_or_default();
                let found = format!("phase `{name}` again, as in line {}", earlier.line);
                return Err(ImportError::at(
                    self.file,
                    token.place,
                    found,
                    "each phase once",
                ));
            }
            self.sections.push(Section::new(named, token.place.0));
        }
        let section = (self.sections.last_mut()).expect("one was just made if there was none");
        if self.phase.is_none() && label.is_some() && label != section.phase {
            // Labels that name single equations do not name their phase.
            section.phase.take_if(|name| !is_known(name));
        }
        Ok(section)
    }
}
