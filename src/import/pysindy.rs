//! Candidate terms as PySINDy and its relatives name them: `z1 z2`, `sin(1 z1)`, `x0 u0`, `z1**2`.

use super::equations::plain_name;
use crate::symbolic::Function;

/// A list of terms in romc's grammar; terms that are in it already stay as they are.
///
/// Operands with a space between them are multiplied. Where a list has names `x0`, `x1`, ..., as PySINDy has, these are
/// the latent coordinates and then their velocities, and `u0` is `u1`; where they end in `x{2d}`, they and `u1` are
/// counted from one. Else what was found and expected.
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
