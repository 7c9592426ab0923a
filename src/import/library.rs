//! The candidate terms of imported coefficients, as PySINDy and its relatives name them: `z1 z2`, `x0 u0`, `z1**2`.

use super::equations::plain_name;
use super::run::{check_size, read_file};
use super::*;

const MAX_TERMS_BYTES: u64 = 32 << 20;

pub(super) fn dim(choice: &LibraryChoice, latent_dim: usize) -> Option<usize> {
    match choice {
        LibraryChoice::Standard(standard) => standard.term_count(latent_dim),
        LibraryChoice::Terms(terms) => Some(terms.len()),
    }
}

/// The library at a latent dimension; a standard one in romc's order.
pub(super) fn build(file: &str, choice: &LibraryChoice, latent_dim: usize) -> Read<Library> {
    let choice = match choice {
        LibraryChoice::Terms(terms) => LibraryChoice::Terms(
            readable(terms, latent_dim)
                .map_err(|(found, expected)| ImportError::option("--library", found, expected))?,
        ),
        LibraryChoice::Standard(_) => choice.clone(),
    };
    Library::of(latent_dim, choice).map_err(|source| ImportError::unusable(file, source))
}

/// The order of a file's terms: as stated, or the only one that there is.
pub(super) fn order(
    standard: StandardLibrary,
    latent_dim: usize,
    stated: Option<LibraryOrder>,
) -> Read<LibraryOrder> {
    let texts = |order: &LibraryOrder| standard.texts_in(*order, latent_dim);
    let orders: Result<Vec<Vec<String>>, _> = LibraryOrder::NAMED.iter().map(texts).collect();
    let orders = orders.map_err(|source| ImportError::unusable("", source))?;
    if let Some(stated) = stated {
        return Ok(stated);
    }
    let differs = |(a, b): (usize, usize)| {
        let mut rows = orders[a].iter().zip(&orders[b]);
        rows.position(|(a, b)| a != b)
    };
    let pairs = [(0, 1), (0, 2), (1, 2)].into_iter();
    let rows: BTreeSet<usize> = pairs.filter_map(differs).collect();
    if rows.is_empty() {
        return Ok(LibraryOrder::ROMC);
    }
    let choice = |(order, texts): (&LibraryOrder, &Vec<String>)| {
        let term = |row: &usize| format!("{} in row {}", texts[*row], row + 1);
        let terms: Vec<String> = rows.iter().map(term).collect();
        Some(format!(
            "--library-order {} ({})",
            order.name()?,
            terms.join(", ")
        ))
    };
    let choices = LibraryOrder::NAMED.iter().zip(&orders).filter_map(choice);
    let choices = choices.collect::<Vec<String>>().join(", ");
    let expected = format!("one of {choices}: the order of the rows of Xi, counted from 1");
    let found = format!("no order of the terms of {}", standard_text(standard));
    Err(ImportError::option("--library-order", found, expected))
}

pub(super) fn standards_with(term_count: usize, latent_dim: usize) -> Vec<String> {
    let fits = |standard: &StandardLibrary| standard.term_count(latent_dim) == Some(term_count);
    let fitting = StandardLibrary::small().filter(fits);
    fitting.map(standard_text).collect()
}

/// Reads a list of terms: JSON, alone or under `library`, or one per line (`#` starts a comment); faults have a place.
pub(crate) fn read_terms(path: &Path) -> Read<Vec<String>> {
    let (file, bytes) = read_file(path, MAX_TERMS_BYTES)?;
    check_size(&file, &bytes, MAX_TERMS_BYTES)?;
    parse_terms(&file, &String::from_utf8_lossy(&bytes))
}

fn parse_terms(file: &str, text: &str) -> Read<Vec<String>> {
    let text = text.trim_start_matches('\u{feff}');
    let refused = |place: (usize, usize), found: &str, expected: &str| {
        ImportError::at(file, place, found, expected)
    };
    if !text.trim_start().starts_with(['[', '{']) {
        let lines = (text.lines()).map(|line| line.split('#').next().unwrap_or("").trim());
        let lines = lines.filter(|line| !line.is_empty());
        let terms: Vec<String> = lines.map(str::to_owned).collect();
        return match terms.is_empty() {
            true => Err(refused((1, 1), "no term", "one term per line")),
            false => Ok(terms),
        };
    }
    let value: Value = serde_json::from_str(text).map_err(|error| {
        let expected = "a list of terms such as [\"1\", \"z1\", \"sin(z1)\"]";
        refused((error.line(), error.column()), "no JSON", expected)
    })?;
    let list = value.get("library").unwrap_or(&value);
    let expected = "a list of terms, or an object with such a list under `library`";
    let list = (list.as_array()).ok_or_else(|| refused((1, 1), kind_of(list), expected))?;
    let texts = list.iter().enumerate().map(|(index, term)| {
        let found = || format!("{} at [{index}]", kind_of(term));
        let text = term.as_str().map(str::to_owned);
        text.ok_or_else(|| refused((1, 1), &found(), "a term as text"))
    });
    texts.collect()
}

fn kind_of(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "true or false",
        Value::Number(_) => "a number",
        Value::String(_) => "a text",
        Value::Array(_) => "a list",
        Value::Object(_) => "an object",
    }
}

/// A list of terms in romc's grammar, with operands next to each other multiplied. Names `x0`, `x1`, ... are the latent
/// coordinates and then their velocities; where they end in `x{2d}`, they and `u1` count from one.
pub(super) fn readable(
    terms: &[String],
    latent_dim: usize,
) -> Result<Vec<String>, (String, String)> {
    let first = first_number(terms, latent_dim)?;
    let name = |token: &str| match (first, number_after_first(token)) {
        (Some(first), Some(('x', k))) => match k.checked_sub(first) {
            Some(k) if k < latent_dim => format!("z{}", k + 1),
            Some(k) if k < 2 * latent_dim => format!("dz{}", k - latent_dim + 1),
            _ => token.to_owned(),
        },
        (Some(first), Some(('u', k))) => format!("u{}", k + 1 - first),
        (None, None) => plain_name(token).unwrap_or_else(|| token.to_owned()),
        _ => token.to_owned(),
    };
    let terms = terms.iter().map(|term| readable_term(term, &name));
    Ok(terms.collect())
}

/// The number from which a list counts its names `x` and `u`; none without a name `x`.
fn first_number(terms: &[String], latent_dim: usize) -> Result<Option<usize>, (String, String)> {
    let names = terms.iter().flat_map(|term| tokens(term));
    let names: Vec<(char, usize)> = names.filter_map(number_after_first).collect();
    if !names.iter().any(|(kind, _)| *kind == 'x') {
        return Ok(None);
    }
    let state_dim = 2 * latent_dim;
    let has = |wanted: &[(char, usize)]| names.iter().any(|name| wanted.contains(name));
    let is_own = |term: &String| {
        tokens(term).any(|token| {
            let digits = token.strip_prefix("dz").or(token.strip_prefix('z'));
            digits.is_some_and(is_number)
        })
    };
    let from_zero = has(&[('x', 0), ('u', 0)]);
    let from_one = has(&[('x', state_dim), ('u', latent_dim)]);
    let found = match (from_zero, from_one) {
        _ if terms.iter().any(is_own) => "names x and z in one list".to_owned(),
        (true, false) => return Ok(Some(0)),
        (false, true) => return Ok(Some(1)),
        (true, true) => {
            format!("names from x0 or u0 on, and x{state_dim} or u{latent_dim}, one too many")
        }
        (false, false) => {
            format!("names x without x0 and x{state_dim}, which may be counted from 0 or from 1")
        }
    };
    let expected = format!(
        "z1 to z{latent_dim}, dz1 to dz{latent_dim} and u1 to u{latent_dim} in their places, in the \
         file or list of --library"
    );
    Err((found, expected))
}

fn readable_term(term: &str, name: &dyn Fn(&str) -> String) -> String {
    let mut text = String::with_capacity(term.len());
    let mut before = "";
    for token in tokens(term) {
        if token.trim().is_empty() {
            text.push_str(token);
            continue;
        }
        let is_separate = text.ends_with(char::is_whitespace);
        let is_call = token == "(" && Function::by_name(before).is_some();
        let ends_operand = (before == ")" || is_word(before)) && !is_call;
        if ends_operand && is_separate && (token == "(" || is_word(token)) {
            text.truncate(text.trim_end().len());
            text.push('*');
        }
        match token {
            "**" => text.push('^'),
            _ => text.push_str(&name(token)),
        }
        before = token;
    }
    text
}

fn is_word(token: &str) -> bool {
    token.starts_with(|c: char| c.is_ascii_alphanumeric() || c == '_' || c == '.')
}

fn is_number(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit())
}

/// `('x', 12)` of `x12`.
fn number_after_first(token: &str) -> Option<(char, usize)> {
    let first = token.chars().next()?;
    let digits = &token[first.len_utf8()..];
    let number = digits.parse().ok().filter(|_| is_number(digits))?;
    Some((first, number))
}

/// Names, digits with points (an exponent is tokens of its own), runs of white space, `**`, and single characters.
pub(super) fn tokens(text: &str) -> impl Iterator<Item = &str> {
    let mut rest = text;
    std::iter::from_fn(move || {
        let first = rest.chars().next()?;
        let is_letter = first.is_ascii_alphabetic() || first == '_';
        let belongs: &dyn Fn(char) -> bool = match first {
            _ if is_letter => &|c| c.is_ascii_alphanumeric() || c == '_',
            '0'..='9' | '.' => &|c| c.is_ascii_digit() || c == '.',
            _ if first.is_whitespace() => &char::is_whitespace,
            _ => &|_| false,
        };
        let run = rest.find(|c| !belongs(c)).unwrap_or(rest.len());
        let single = if rest.starts_with("**") {
            2
        } else {
            first.len_utf8()
        };
        let (token, after) = rest.split_at(run.max(single));
        rest = after;
        Some(token)
    })
}
