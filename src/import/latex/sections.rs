//! From a document's displays to sections of equations: one per phase.

use super::derivatives::with_dots;
use super::numbers::without_operator_braces;
use super::*;

/// Reads a document's equations; comments `Phase NAME` or `Phases NAME, NAME` and headings rank before labels that end in `known` phases.
pub(in crate::import) fn read(
    file: &str,
    bytes: &[u8],
    names: &SymbolNames,
    known: &[String],
) -> Read<Sections> {
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
        others: Vec::new(),
        starts_phase: false,
        strange: None,
        sections: Vec::new(),
        copies: Vec::new(),
    };
    let plain = SymbolNames::default();
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
        // Where a left side has an index, `z` alone is no coordinate.
        let mut indexed = left_sides(file, &plain, &items, in_lines);
        let alone = !indexed.any(|side| side.output.is_some());
        for item in &items {
            if let Item::Comment(text) = item {
                document.comment(text);
            }
            if let Some(tokens) = item.equations(in_lines) {
                document.display(tokens, alone)?;
            }
        }
    }
    if let (true, Some((place, found))) = (document.sections.is_empty(), document.strange.take()) {
        let expected = format!("\\ddot z_1 and so on, with {}", names.expected());
        return Err(ImportError::at(file, place, found, expected));
    }
    let expected = match is_markdown {
        true => "an equation such as $$ \\ddot z_1 = 0.5 z_1 + u_1 $$",
        false => "an equation such as \\begin{align} \\ddot z_1 &= 0.5 z_1 + u_1 \\end{align}",
    };
    complete(file, document.with_copies(), text.lines().count(), expected)
}

/// The left sides of the formulas, in which all names of latent coordinates have an index.
fn left_sides(
    file: &str,
    names: &SymbolNames,
    items: &[Item],
    in_lines: bool,
) -> impl Iterator<Item = LeftSide> {
    let formulas = items
        .iter()
        .filter_map(move |item| item.equations(in_lines));
    formulas.flat_map(move |tokens| match Reader::new(file, names, tokens) {
        Ok(mut reader) => reader.left_sides(),
        Err(_) => Vec::new(),
    })
}

/// Refuses equations in the lines of the text for coordinates that no display has: they would be dropped.
fn refuse_others_in_lines(document: &Document<'_>, items: &[Item]) -> Read<()> {
    let equations = document.sections.iter().flat_map(|s| &s.equations);
    let known: Vec<usize> = equations.map(|equation| equation.output).collect();
    let is_other = |side: &LeftSide| side.output.is_some_and(|output| !known.contains(&output));
    match left_sides(document.file, document.names, items, true).find(is_other) {
        None => Ok(()),
        Some(LeftSide { symbol, .. }) => {
            let found = format!("{} in a line of the text", symbol.quoted());
            let expected = "a display for it, as for the other equations";
            Err(ImportError::at(
                document.file,
                symbol.place,
                found,
                expected,
            ))
        }
    }
}

/// The tokens without environments that arrange lines and the brace that `\left\{` puts before them.
fn flattened(file: &str, tokens: &[Token]) -> Read<Vec<Token>> {
    let mut flat: Vec<Token> = Vec::with_capacity(tokens.len());
    let mut open: Vec<&Token> = Vec::new();
    let refused = |token: &Token, why: &str, expected: &str| {
        let found = format!("{}{why}", token.quoted());
        Err(ImportError::at(file, token.place, found, expected))
    };
    let is_distinction = |token: &Token| matches!(&token.kind, Kind::Begin(name) | Kind::End(name) if is_one_of("distinctions", name));
    let mut rest = tokens;
    while let Some((token, behind)) = rest.split_first() {
        rest = behind;
        match &token.kind {
            Kind::Begin(name)
                if is_layout(name) || is_distinction(token) && has_left_side(rest, name) =>
            {
                open.push(token);
                if flat.len() >= 2 && flat[flat.len() - 2].is_command("left") {
                    flat.truncate(flat.len() - 2);
                }
                if rest
                    .first()
                    .is_some_and(|next| next.kind == Kind::Character('['))
                {
                    // A vertical position such as [t].
                    rest = &rest[rest.len().min(3)..];
                }
                let is_group = rest.first().is_some_and(|next| next.kind == Kind::Open);
                if is_group && is_one_of("with columns", name) {
                    rest = &rest[group_length(rest.iter()).unwrap_or(rest.len())..];
                }
            }
            Kind::End(name)
                if is_layout(name)
                    || is_distinction(token)
                        && open.last().is_some_and(|open| is_distinction(open)) =>
            {
                if open
                    .pop()
                    .is_none_or(|open| open.kind != Kind::Begin(name.clone()))
                {
                    let expected = "environments that end in the order in which they begin";
                    return refused(token, "", expected);
                }
                if rest.first().is_some_and(|next| next.is_command("right")) {
                    rest = &rest[rest.len().min(2)..];
                }
            }
            _ => flat.push(token.clone()),
        }
    }
    match open.first() {
        None => Ok(flat),
        Some(token) => {
            let expected = "environments that end inside their display";
            refused(token, " without its end", expected)
        }
    }
}

/// Whether an environment only arranges lines; `subequations` holds displays and text between them.
fn is_layout(name: &str) -> bool {
    is_one_of("layouts", name) || is_one_of("around displays", name)
}

/// Whether the environment whose contents begin here holds equations: it is then no matrix and no right side.
fn has_left_side(contents: &[Token], name: &str) -> bool {
    let end = Kind::End(name.to_owned());
    let mut inside = contents.iter().take_while(|token| token.kind != end);
    inside.any(|token| token.is_command("ddot"))
}

/// The digits that a comment states; none for any other comment.
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
    /// More phases with the equations of `phase`, where a comment names several.
    others: Vec<String>,
    starts_phase: bool,
    /// The first left side of a variable that is not known, and its place.
    strange: Option<(Position, String)>,
    sections: Vec<Section>,
    /// Places of sections, and other phases with the same equations.
    copies: Vec<(usize, String)>,
}

impl Document<'_> {
    fn comment(&mut self, text: &str) {
        let text = text.trim();
        let several = text
            .strip_prefix("Phases ")
            .filter(|names| names.contains(", "));
        if let Some(names) = text.strip_prefix("Phase ").or(several) {
            let names = names.split(": ").next().unwrap_or(names);
            let names = names.trim().trim_end_matches([':', '.']).trim();
            let mut names = match several {
                Some(_) => names.split(", ").map(str::to_owned).collect(),
                None => vec![names.to_owned()],
            };
            names.retain(|name| !name.is_empty());
            self.others = names.split_off(names.len().min(1));
            self.phase = names.pop();
            self.starts_phase = self.phase.is_some();
        }
        if let Some(digits) = stated_digits(text) {
            self.digits = digits;
        }
    }

    fn display(&mut self, tokens: &[Token], alone: bool) -> Read<()> {
        let Some(dotted) = tokens.iter().find(|token| token.is_command("ddot")) else {
            return Ok(());
        };
        let file = self.file;
        let refuse = |place: Position, found: String, expected: &str| {
            Err(ImportError::at(file, place, found, expected))
        };
        if let Some((token, expected)) = unread(tokens) {
            return refuse(token.place, token.quoted(), expected);
        }
        let flat = flattened(file, tokens);
        let mut reader = Reader::new(file, self.names, flat.as_deref().unwrap_or(tokens))?;
        (reader.alone, reader.digits) = (alone, self.digits);
        let found = reader.left_sides();
        if let Some(token) = reader.in_text(&found) {
            let found = format!("an equation in {}", token.quoted());
            return refuse(token.place, found, "equations in the formula itself");
        }
        let mut strange = found.iter().filter(|side| side.output.is_none());
        let strange = (strange.next()).map(|side| (side.symbol.place, side.symbol.quoted()));
        let known = found.iter().filter_map(|side| Some((side.output?, side)));
        let known: Vec<(usize, &LeftSide)> = known.collect();
        let Some((_, first)) = known.first() else {
            let unequal = "a second derivative without `=` behind its variable";
            let found = strange.unwrap_or((dotted.place, unequal.to_owned()));
            self.strange.get_or_insert(found);
            return Ok(());
        };
        flat?;
        if let Some((place, found)) = strange {
            return refuse(place, found, &self.names.expected());
        }
        if let Some(token) = reader.printed_before(first.at) {
            let expected = "a left side such as `\\ddot z_1 =`";
            return refuse(token.place, token.quoted(), expected);
        }
        let shared = self.label(&reader.tokens[..first.at]);
        let mut before = 0;
        for (index, (output, side)) in known.iter().enumerate() {
            let total = reader.tokens.len();
            let end = known.get(index + 1).map_or(total, |(_, next)| next.at);
            let own = || self.label(&reader.tokens[side.after..end]);
            let label = shared.clone().or_else(own);
            for token in &reader.tokens[before..side.after] {
                if let Kind::Comment(text) = &token.kind {
                    self.comment(text);
                }
            }
            before = side.after;
            let place = side.symbol.place;
            let equation = reader.equation(*output, place.0, side.after, end)?;
            let section = self.section(*output, place, label)?;
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
        let stem = stem.strip_suffix(':').unwrap_or(label);
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

    /// Refuses a phase that there is already.
    fn check_new(&self, name: &String, place: Position) -> Read<()> {
        let of_copy = |at: usize| self.copies.iter().any(|copy| copy == &(at, name.clone()));
        let mut sections = self.sections.iter().enumerate();
        let is_same = |(at, section): &(usize, &Section)| {
            section.phase.as_ref() == Some(name) || of_copy(*at)
        };
        match sections.find(is_same) {
            None => Ok(()),
            Some((_, earlier)) => {
                let found = format!("phase `{name}` again, as in line {}", earlier.line);
                Err(ImportError::at(self.file, place, found, "each phase once"))
            }
        }
    }

    /// All sections, those of phases with the same equations behind each other.
    fn with_copies(self) -> Vec<Section> {
        let mut all = Vec::new();
        for (place, section) in self.sections.into_iter().enumerate() {
            let copies = self.copies.iter().filter(|(of, _)| *of == place);
            let copies = copies.map(|(_, name)| Section {
                phase: Some(name.clone()),
                ..section.clone()
            });
            let copies: Vec<Section> = copies.collect();
            all.push(section);
            all.extend(copies);
        }
        all
    }

    /// The open section, or a new one for another phase or a left side that is there already.
    fn section(
        &mut self,
        output: usize,
        place: Position,
        label: Option<String>,
    ) -> Read<&mut Section> {
        let starts_phase = std::mem::take(&mut self.starts_phase);
        let named = self.phase.clone().filter(|_| starts_phase);
        let has_phase = self.phase.is_some();
        let is_known = |name: &String| self.known.contains(name);
        let is_new = self.sections.last().is_none_or(|open| {
            let mut equations = open.equations.iter();
            let repeats = equations.any(|equation| equation.output == output);
            let is_other = label.as_ref().is_some_and(is_known) && label != open.phase;
            named.is_some() || repeats || !has_phase && is_other
        });
        if is_new {
            let others = match named {
                Some(_) => std::mem::take(&mut self.others),
                None => Vec::new(),
            };
            let named = named.or(label.clone().filter(|_| !has_phase));
            for name in named.iter().chain(&others) {
                self.check_new(name, place)?;
            }
            let copies = others.into_iter().map(|name| (self.sections.len(), name));
            self.copies.extend(copies);
            self.sections.push(Section::new(named, place.0));
        }
        let section = (self.sections.last_mut()).expect("one was just made if there was none");
        if !has_phase && label.is_some() && label != section.phase {
            // Labels that name single equations do not name their phase.
            section.phase.take_if(|name| !is_known(name));
        }
        Ok(section)
    }
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Item {
    /// A comment, or a heading in Markdown.
    Comment(String),
    Display(Vec<Token>),
    Inline(Vec<Token>),
}

impl Item {
    /// The tokens in which equations are looked for: of a display, or of mathematics in a line.
    pub(super) fn equations(&self, in_lines: bool) -> Option<&[Token]> {
        match self {
            Item::Display(tokens) if !in_lines => Some(tokens),
            Item::Inline(tokens) if in_lines => Some(tokens),
            Item::Comment(_) | Item::Display(_) | Item::Inline(_) => None,
        }
    }
}

/// Whether a word is in a class, its star aside.
pub(super) fn is_one_of(class: &str, name: &str) -> bool {
    is_in(class, name.trim_end_matches('*'))
}

/// Finds the displays of the tokens, and of the text behind them.
pub(super) fn items(file: &str, tokens: Vec<Token>, text: &str) -> Read<Vec<Item>> {
    let mut expander = Expander::new(file, tokens, text);
    let mut items = Vec::new();
    while let Some(token) = expander.next()? {
        match (&token.kind, token.name()) {
            (Kind::Comment(text), _) => items.push(Item::Comment(text.clone())),
            (Kind::Begin(name), _) if name == "document" => begin_document(file, &mut items)?,
            (Kind::Begin(name), _) if is_one_of("layouts", name) || is_one_of("cases", name) => {
                if is_one_of("with columns", name) {
                    let _ = expander.is_brace_next() && expander.argument().is_some();
                }
                items.push(display(&mut expander, &token)?);
            }
            (Kind::Display, _) | (_, "[") => items.push(display(&mut expander, &token)?),
            (Kind::Begin(name), _) if name == "math" => items.extend(inline(&mut expander)?),
            (Kind::Dollar, _) | (_, "(") => items.extend(inline(&mut expander)?),
            _ => {}
        }
    }
    Ok(items)
}

/// Only comments count before `\begin{document}`; equations there are refused.
fn begin_document(file: &str, items: &mut Vec<Item>) -> Read<()> {
    for item in &*items {
        let (Item::Display(tokens) | Item::Inline(tokens)) = item else {
            continue;
        };
        if let Some(token) = tokens.iter().find(|token| token.is_command("ddot")) {
            let found = format!("{} before `\\begin{{document}}`", token.quoted());
            let expected = "equations behind it, where they are printed";
            return Err(ImportError::at(file, token.place, found, expected));
        }
    }
    items.retain(|item| matches!(item, Item::Comment(_)));
    Ok(())
}

fn display(expander: &mut Expander, start: &Token) -> Read<Item> {
    let Some(tokens) = expander.formula(|_| false)? else {
        return expander.refuse(start, " without its end", "the end of the display");
    };
    match unread(&tokens) {
        Some((token, expected)) => expander.refuse(token, "", expected),
        None => Ok(Item::Display(plain(tokens))),
    }
}

fn inline(expander: &mut Expander) -> Read<Option<Item>> {
    let tokens = expander.formula(|token| token.kind == Kind::Paragraph)?;
    Ok(tokens.map(|tokens| Item::Inline(plain(tokens))))
}

/// The first token that is not read, and the accepted alternative.
pub(super) fn unread(tokens: &[Token]) -> Option<(&Token, &'static str)> {
    tokens.iter().find_map(|token| match &token.kind {
        Kind::Unread(_, expected) => Some((token, *expected)),
        _ => None,
    })
}

fn plain(tokens: Vec<Token>) -> Vec<Token> {
    with_dots(&without_operator_braces(tokens))
}
