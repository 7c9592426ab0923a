//! The displays of a document as they are printed.

use super::super::ImportError;
use super::derivatives::with_dots;
use super::digits::without_operator_braces;
use super::expander::Expander;
use super::reader::has;
use super::token::{Kind, Token};

/// Environments that arrange lines of mathematics, in a display of their own or inside one.
pub(super) const LAYOUTS: &str = "equation align gather multline eqnarray flalign alignat displaymath dmath \
    dgroup aligned alignedat split gathered IEEEeqnarray";
pub(super) const CASES: &str = "cases dcases";
/// Environments that begin with an argument: a number of columns, or what each column is.
pub(super) const WITH_COLUMNS: &str = "alignat alignedat array IEEEeqnarray";
/// What of a document matters, in its order.
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

/// Whether `list` has the word `name`, its star aside.
pub(super) fn is_one_of(list: &str, name: &str) -> bool {
    has(list, name.trim_end_matches('*'))
}

/// Finds the displays of the tokens, and of the text behind them.
pub(super) fn items(file: &str, tokens: Vec<Token>, text: &str) -> Result<Vec<Item>, ImportError> {
    let mut expander = Expander::new(file, tokens, text);
    let mut items = Vec::new();
    while let Some(token) = expander.next()? {
        match (&token.kind, token.name()) {
            (Kind::Comment(text), _) => items.push(Item::Comment(text.clone())),
            (Kind::Begin(name), _) if name == "document" => begin_document(file, &mut items)?,
            (Kind::Begin(name), _) if is_one_of(LAYOUTS, name) || is_one_of(CASES, name) => {
                if is_one_of(WITH_COLUMNS, name) {
                    expander.skip_group();
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

/// Only comments count of what stands before `\begin{document}`; equations there are refused.
fn begin_document(file: &str, items: &mut Vec<Item>) -> Result<(), ImportError> {
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

/// The tokens of the formula that `start` opened, up to its end, which is passed.
fn display(expander: &mut Expander, start: &Token) -> Result<Item, ImportError> {
    let Some(tokens) = formula(expander, |_| false)? else {
        return expander.refuse(start, " without its end", "the end of the display");
    };
    match unread(&tokens) {
        Some((token, expected)) => expander.refuse(token, "", expected),
        None => Ok(Item::Display(tokens)),
    }
}

fn inline(expander: &mut Expander) -> Result<Option<Item>, ImportError> {
    let tokens = formula(expander, |token| token.kind == Kind::Paragraph)?;
    Ok(tokens.map(Item::Inline))
}

/// The first token of what is not followed, and what could be there.
pub(super) fn unread(tokens: &[Token]) -> Option<(&Token, &'static str)> {
    tokens.iter().find_map(|token| match &token.kind {
        Kind::Unread(_, expected) => Some((token, *expected)),
        _ => None,
    })
}

fn formula(
    expander: &mut Expander,
    ends: fn(&Token) -> bool,
) -> Result<Option<Vec<Token>>, ImportError> {
    let around = expander.scopes.formula_around();
    expander.scopes.formula = Some(around);
    let mut tokens = Vec::new();
    while let Some(token) = expander.next()? {
        if expander.scopes.depth() <= around || ends(&token) {
            expander.scopes.leave_to(around);
            expander.scopes.formula = None;
            return Ok(Some(with_dots(&without_operator_braces(tokens))));
        }
        tokens.push(token);
    }
    Ok(None)
}
