//! Equations as plain text for terminals and Python: aligned, wrapped at a number of characters.

use std::fmt::Write as _;

use super::tree::function_name;
use super::words::feet;
use super::*;

/// How equations are printed as text.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TextOptions {
    /// Rounding of coefficients; `None` is [`Rounding::PHYSICAL`] in physical units, otherwise the default.
    pub rounding: Option<Rounding>,
    pub symbols: SymbolTable,
    /// Longest line in characters; `None` is 80.
    pub columns: Option<usize>,
}

const TEXT_COLUMNS: usize = 80;

/// The equations of a model as text of at most 80 columns, in physical units where the model has them.
pub fn model_text(model: &ReducedModel) -> String {
    let equations = Equations::of(model);
    let physical = equations.in_physical_units();
    equations_text(
        physical.as_ref().unwrap_or(&equations),
        &TextOptions::default(),
    )
}

/// Names and units of the latent coordinates, then the equations of each phase; phases with equal equations are
/// printed once. Ends with one line end.
pub fn equations_text(equations: &Equations<'_>, options: &TextOptions) -> String {
    let mut text = legend(equations, &options.symbols);
    text += &phases_text(equations, options);
    text
}

/// The equations of each phase alone.
fn phases_text(equations: &Equations<'_>, options: &TextOptions) -> String {
    let rounding = options.rounding.unwrap_or(match equations.latent_units() {
        Some(_) => Rounding::PHYSICAL,
        None => Rounding::default(),
    });
    let typeset = Typeset::new(equations, &options.symbols, rounding);
    let columns = options.columns.unwrap_or(TEXT_COLUMNS);
    let mut text = String::new();
    for group in alike(&typeset.systems) {
        let phases = group.iter().map(|&at| &equations.phases[at]);
        let heads: Vec<String> = phases
            .map(|phase| format!("{} ({})", phase.name, feet(&phase.feet)))
            .collect();
        if !text.is_empty() {
            text.push('\n');
        }
        text += &joined(&heads, columns);
        for line in lines(&typeset.systems[group[0]], columns) {
            let _ = writeln!(text, "  {line}");
        }
    }
    text
}

/// Heads of phases as one list that is wrapped between them.
fn joined(heads: &[String], columns: usize) -> String {
    let mut text = String::new();
    let mut used = 0;
    for (place, head) in heads.iter().enumerate() {
        let head = match place + 1 == heads.len() {
            true => head.clone(),
            false => format!("{head},"),
        };
        let length = head.chars().count();
        match used {
            0 => {}
            used if used + 1 + length > columns => text.push('\n'),
            _ => text.push(' '),
        }
        let is_first_of_line = text.is_empty() || text.ends_with('\n');
        used = if is_first_of_line {
            length
        } else {
            used + 1 + length
        };
        text += &head;
    }
    text.push('\n');
    text
}

/// One line for each latent coordinate with its quantity, its unit and that of its input; nothing without words.
fn legend(equations: &Equations<'_>, symbols: &SymbolTable) -> String {
    let words = equations.latent_words();
    let names: Vec<String> = (0..words.len())
        .map(|index| symbol_text(&symbols.symbol(LatentVariable::Z(index))))
        .collect();
    let longest = names.iter().map(String::len).max().unwrap_or(0);
    let mut text = String::new();
    for (index, (name, words)) in names.iter().zip(&words).enumerate() {
        let _ = write!(text, "{name:longest$}  {words}");
        if let Some(units) = equations.latent_units() {
            let input = symbol_text(&symbols.symbol(LatentVariable::U(index)));
            let _ = write!(
                text,
                "; input {input} in {}",
                units.of(LatentVariable::U(index))
            );
        }
        text.push('\n');
    }
    if !words.is_empty() {
        text.push('\n');
    }
    text
}

/// The equations of a phase, equal signs below each other, continued lines indented.
fn lines(system: &EquationSystem, columns: usize) -> Vec<String> {
    let lefts: Vec<String> = (system.equations.iter())
        .map(|equation| symbol_text(&equation.left))
        .collect();
    let longest = lefts.iter().map(String::len).max().unwrap_or(0);
    let mut lines = Vec::new();
    for (equation, left) in system.equations.iter().zip(lefts) {
        let relation = if equation.is_approximate { "~" } else { "=" };
        let mut line = format!("{left:longest$} {relation}");
        if equation.terms.is_empty() {
            line += " 0";
        }
        for (place, term) in equation.terms.iter().enumerate() {
            let term = signed_text(term, place == 0);
            // Two characters of indentation are added by the caller.
            if place > 0 && line.len() + 1 + term.len() > columns.saturating_sub(2) {
                lines.push(std::mem::replace(&mut line, " ".repeat(longest + 2)));
            }
            line = line + " " + &term;
        }
        lines.push(line);
    }
    lines
}

fn signed_text(term: &Signed, is_first: bool) -> String {
    let text = math_text(&term.math);
    match (term.negative, is_first) {
        (true, true) => format!("-{text}"),
        (true, false) => format!("- {text}"),
        (false, true) => text,
        (false, false) => format!("+ {text}"),
    }
}

/// `z1`, `ddz1`, `F_lin,1`: digits follow the letter directly.
fn symbol_text(symbol: &Symbol) -> String {
    match symbol.subscript.as_slice() {
        [Glyph::Digits(digits)] => {
            format!("{}{}{digits}", "d".repeat(symbol.dots.into()), symbol.glyph)
        }
        _ => symbol.to_string(),
    }
}

fn math_text(math: &Math) -> String {
    match math {
        Math::Number(number) => number.to_string(),
        Math::Symbol(symbol) => symbol_text(symbol),
        Math::Sum(terms) => {
            let terms = terms.iter().enumerate();
            let terms: Vec<String> = terms
                .map(|(place, term)| signed_text(term, place == 0))
                .collect();
            terms.join(" ")
        }
        Math::Product(factors) => {
            let factors = factors.iter().filter(|factor| **factor != Math::Dot);
            factors.map(math_text).collect::<Vec<_>>().join(" ")
        }
        Math::Dot => String::new(),
        Math::Fraction(top, bottom) | Math::Slash(top, bottom) => {
            let top = match **top {
                Math::Product(_) => math_text(top),
                _ => operand(top),
            };
            format!("{top}/{}", operand(bottom))
        }
        Math::Power(base, exponent) => format!("{}^{}", operand(base), operand(exponent)),
        Math::Root(inner, None) => format!("sqrt({})", math_text(inner)),
        Math::Root(inner, Some(index)) => format!("({})^(1/{index})", math_text(inner)),
        Math::Function(name, power, argument) => {
            let power = power.as_ref().map(|power| format!("^{}", operand(power)));
            let power = power.unwrap_or_default();
            format!("{}({}){power}", function_name(*name), math_text(argument))
        }
        Math::Absolute(inner) => format!("|{}|", math_text(inner)),
        Math::Group(inner) => format!("({})", math_text(inner)),
    }
}

/// An operand of an operator: in parentheses unless it is a number, a name or a call.
fn operand(math: &Math) -> String {
    let text = math_text(math);
    match math {
        Math::Sum(_) | Math::Product(_) | Math::Dot | Math::Fraction(..) | Math::Slash(..) => {
            format!("({text})")
        }
        Math::Power(..) | Math::Root(_, Some(_)) => format!("({text})"),
        Math::Number(_) | Math::Symbol(_) | Math::Root(_, None) | Math::Function(..) => text,
        Math::Absolute(_) | Math::Group(_) => text,
    }
}
