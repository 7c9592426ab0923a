//! Derivatives with respect to time, however they are written, as dots.

use super::variables::is_greek;
use super::*;

const MAX_DOTS: usize = 3;
/// Longest group that is looked at: a variable or a differential.
const MAX_GROUP: usize = 32;

/// The tokens with `z_1''`, `z_1^{\prime\prime}`, `\frac{d^2 z_1}{dt^2}`, `\frac{d^2}{dt^2} z_1` as `\ddot{z_1}`.
pub(super) fn with_dots(tokens: &[Token]) -> Vec<Token> {
    with_each(&with_each(tokens, fraction), primed)
}

/// A derivative: its order, its variable, and the place behind it.
type Derivative = (usize, Vec<Token>, usize);

/// The tokens with dots for each derivative that `find` finds at a place.
fn with_each(tokens: &[Token], find: fn(&[Token], usize) -> Option<Derivative>) -> Vec<Token> {
    let mut dotted = Vec::with_capacity(tokens.len());
    let mut at = 0;
    while at < tokens.len() {
        match find(tokens, at) {
            Some((dots, variable, behind)) => {
                dotted.extend(under_dots(&tokens[at], dots, &variable));
                at = behind;
            }
            None => {
                dotted.push(tokens[at].clone());
                at += 1;
            }
        }
    }
    dotted
}

fn fraction(tokens: &[Token], at: usize) -> Option<Derivative> {
    has("frac dfrac tfrac", tokens[at].name()).then_some(())?;
    let (top, after_top) = group(tokens, at + 1)?;
    let (bottom, behind) = group(tokens, after_top)?;
    let (order, of_variable) = power(top, differential(top, 0)?);
    let time = differential(bottom, 0)?;
    let is_time = bottom.get(time)?.kind == Kind::Character('t');
    let (of_time, end) = power(bottom, time + 1);
    if !is_time || of_time != order || end != bottom.len() || !(1..=MAX_DOTS).contains(&order) {
        return None;
    }
    if of_variable < top.len() {
        let end = variable_end(top, of_variable)?;
        return (end == top.len()).then(|| (order, top[of_variable..].to_vec(), behind));
    }
    let end = variable_end(tokens, behind)?;
    ends_product(&tokens[end..]).then(|| (order, tokens[behind..end].to_vec(), end))
}

/// Whether neither a power nor a further factor follows, which a derivative in front might also include.
fn ends_product(tokens: &[Token]) -> bool {
    let mut rest = tokens
        .iter()
        .skip_while(|token| is_in("invisible", token.name()));
    match rest.next().map(|token| &token.kind) {
        None => true,
        // The time of `z_1(t)`.
        Some(Kind::Character('(')) => rest
            .next()
            .is_some_and(|token| token.kind == Kind::Character('t')),
        Some(Kind::Character(mark)) => "+-=,.;)]/:*&|".contains(*mark),
        Some(Kind::Command(name)) => is_in("behind derivatives", name),
        Some(kind) => kind.ends_term() || matches!(kind, Kind::End(_)),
    }
}

/// The place behind the `d` of a differential, upright or not, or its `\partial`.
fn differential(tokens: &[Token], at: usize) -> Option<usize> {
    let is_d = |token: &Token| token.kind == Kind::Character('d') || token.is_command("partial");
    let first = tokens.get(at)?;
    if is_in("fonts", first.name()) {
        let (inside, behind) = argument(tokens, at + 1)?;
        return matches!(inside, [sign] if is_d(sign)).then_some(behind);
    }
    is_d(first).then_some(at + 1)
}

/// A whole power at `at`, 1 without, and the place behind it.
fn power(tokens: &[Token], at: usize) -> Position {
    let found = || {
        (tokens.get(at)?.kind == Kind::Superscript).then_some(())?;
        let (inside, behind) = argument(tokens, at + 1)?;
        let digits = inside.iter().map(|token| token.kind.digit());
        Some((digits.collect::<Option<String>>()?.parse().ok()?, behind))
    };
    found().unwrap_or((1, at))
}

/// The tokens in the braces that open at `at`, and the place behind them.
fn group(tokens: &[Token], at: usize) -> Option<(&[Token], usize)> {
    if tokens.get(at)?.kind != Kind::Open {
        return None;
    }
    let behind = at + group_length(tokens[at..].iter().take(MAX_GROUP))?;
    Some((&tokens[at + 1..behind - 1], behind))
}

/// The tokens of a group, or one token, and the place behind it.
fn argument(tokens: &[Token], at: usize) -> Option<(&[Token], usize)> {
    group(tokens, at).or_else(|| Some((tokens.get(at..=at)?, at + 1)))
}

/// The place behind the letter or word at `at` with its dots and subscript.
fn variable_end(tokens: &[Token], at: usize) -> Option<usize> {
    let end = letter_end(tokens, at)?;
    Some(subscript_end(tokens, end).unwrap_or(end))
}

fn letter_end(tokens: &[Token], at: usize) -> Option<usize> {
    match &tokens.get(at)?.kind {
        Kind::Character(letter) if letter.is_ascii_alphabetic() => Some(at + 1),
        Kind::Command(name) if is_greek(name) => Some(at + 1),
        Kind::Command(name) if is_in("fonts", name) || has("dot ddot", name) => {
            Some(argument(tokens, at + 1)?.1)
        }
        Kind::Open => {
            let (inside, behind) = group(tokens, at)?;
            (variable_end(inside, 0)? == inside.len()).then_some(behind)
        }
        _ => None,
    }
}

fn subscript_end(tokens: &[Token], at: usize) -> Option<usize> {
    (tokens.get(at)?.kind == Kind::Subscript).then_some(())?;
    Some(argument(tokens, at + 1)?.1)
}

fn primed(tokens: &[Token], at: usize) -> Option<Derivative> {
    let letter = letter_end(tokens, at)?;
    let subscript = subscript_end(tokens, letter);
    let end = subscript.unwrap_or(letter);
    let (dots, behind) = primes(tokens, end)?;
    let mut variable = tokens[at..end].to_vec();
    // Primes may stand before the subscript.
    let after = match subscript {
        None => subscript_end(tokens, behind).unwrap_or(behind),
        Some(_) => behind,
    };
    variable.extend_from_slice(&tokens[behind..after]);
    Some((dots, variable, after))
}

/// How many primes stand at `at`, at most as many as there are dots, and the place behind them.
fn primes(tokens: &[Token], at: usize) -> Option<Position> {
    let is_prime = |token: &Token| token.is_command("prime");
    let is_mark = |token: &&Token| matches!(token.kind, Kind::Character('\'' | '′' | '’'));
    let marks = tokens[at..].iter().take_while(is_mark).count();
    let (count, behind) = match tokens.get(at).map(|token| &token.kind) {
        Some(Kind::Superscript) => match argument(tokens, at + 1)? {
            (inside, behind) if inside.iter().all(is_prime) => (inside.len(), behind),
            _ => return None,
        },
        _ => (marks, at + marks),
    };
    (1..=MAX_DOTS).contains(&count).then_some((count, behind))
}

/// `\ddot{z_1}` at the place of `first`.
fn under_dots(first: &Token, dots: usize, variable: &[Token]) -> Vec<Token> {
    let command = Kind::command(["dot", "ddot", "dddot"][dots - 1]);
    let mut dotted = vec![first.with(command), first.with(Kind::Open)];
    dotted.extend_from_slice(match group(variable, 0) {
        Some((inside, behind)) if behind == variable.len() => inside,
        _ => variable,
    });
    dotted.push(first.with(Kind::Close));
    dotted
}
