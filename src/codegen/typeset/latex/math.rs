//! The LaTeX spelling of the typeset tree, of equations in `cases` or `align`, and of text from outside.

use super::*;
use crate::typeset::tree::function_name;

pub(crate) fn tex(math: &Math, numbers: NumberStyle) -> String {
    let inner = |math: &Math| tex(math, numbers);
    // Exponents are structure, not measured values: no siunitx.
    let exponent_of = |math| script(tex(math, NumberStyle::Plain));
    // Delimiters grow only around something tall: `\left` and `\right` would put a space after the function's name.
    let delimited = |open: &str, close: &str, math: &Math| match math.is_tall() {
        true => format!(r"\left{open}{}\right{}", inner(math), close.trim_start()),
        false => format!("{open}{}{close}", inner(math)),
    };
    match math {
        Math::Number(number) => tex_number(number, numbers),
        Math::Symbol(symbol) => tex_symbol(symbol),
        Math::Sum(terms) => tex_terms(terms, numbers, false),
        Math::Product(factors) => {
            let mut text = String::new();
            for factor in factors {
                append(&mut text, &inner(factor));
            }
            text
        }
        Math::Dot => r" \cdot ".to_owned(),
        Math::Fraction(top, bottom) => format!(r"\frac{{{}}}{{{}}}", inner(top), inner(bottom)),
        Math::Slash(top, bottom) => format!("{}/{}", inner(top), inner(bottom)),
        Math::Power(base, exponent) => format!("{}^{}", inner(base), exponent_of(exponent)),
        Math::Root(radicand, None) => format!(r"\sqrt{{{}}}", inner(radicand)),
        Math::Root(radicand, Some(index)) => format!(r"\sqrt[{index}]{{{}}}", inner(radicand)),
        Math::Function(name, power, argument) => {
            let power = (power.as_ref()).map(|power| format!("^{}", exponent_of(power)));
            function(*name) + &power.unwrap_or_default() + &delimited("(", ")", argument)
        }
        Math::Absolute(argument) => delimited(r"\lvert ", r" \rvert", argument),
        Math::Group(argument) => delimited("(", ")", argument),
    }
}

/// Signed terms one after the other; the first sign may be an operator that continues a line above.
pub(crate) fn tex_terms(terms: &[Signed], numbers: NumberStyle, continues: bool) -> String {
    let mut text = String::new();
    for (place, term) in terms.iter().enumerate() {
        text.push_str(match (place, term.negative, continues) {
            (0, false, false) => "",
            (0, true, false) => "-",
            (0, false, true) => "{} + ",
            (0, true, true) => "{} - ",
            (_, false, _) => " + ",
            (_, true, _) => " - ",
        });
        text.push_str(&tex(&term.math, numbers));
    }
    text
}

pub(crate) fn tex_number(number: &Decimal, numbers: NumberStyle) -> String {
    match (numbers, number.exponent) {
        (NumberStyle::Plain, None) => number.to_string(),
        (NumberStyle::Plain, Some(exponent)) => {
            let sign = if number.negative { "-" } else { "" };
            format!(r"{sign}{} \times 10^{{{exponent}}}", number.digits)
        }
        (NumberStyle::Siunitx, _) => format!(r"\num{{{number}}}"),
    }
}

/// A symbol: `\ddot{z}_{10}`.
pub(crate) fn tex_symbol(symbol: &Symbol) -> String {
    let base = glyph(&symbol.glyph);
    let dotted = match symbol.dots {
        0 => base,
        1 => format!(r"\dot{{{base}}}"),
        2 => format!(r"\ddot{{{base}}}"),
        // amsmath has `\ddddot` as well; the latent model never needs more.
        _ => format!(r"\dddot{{{base}}}"),
    };
    if symbol.subscript.is_empty() {
        return dotted;
    }
    let parts: Vec<String> = symbol.subscript.iter().map(glyph).collect();
    format!("{dotted}_{}", script(parts.join(",")))
}

/// Appends `next`, with a space where a command such as `\theta` would swallow its first letter.
fn append(text: &mut String, next: &str) {
    let ends_in_command = text
        .trim_end_matches(|c: char| c.is_ascii_alphabetic())
        .ends_with('\\');
    let letters = text.ends_with(|c: char| c.is_ascii_alphabetic());
    if ends_in_command && letters && next.starts_with(|c: char| c.is_ascii_alphabetic()) {
        text.push(' ');
    }
    text.push_str(next);
}

/// A superscript or subscript: bare for one character, in braces otherwise.
fn script(text: String) -> String {
    match text.chars().count() {
        1 => text,
        _ => format!("{{{text}}}"),
    }
}

fn glyph(glyph: &Glyph) -> String {
    match glyph {
        Glyph::Letter(letter) => letter.to_string(),
        Glyph::Greek(place) => format!(r"\{}", greek_letter(*place).0),
        Glyph::Digits(digits) => digits.clone(),
        Glyph::Word(word) => format!(r"\mathrm{{{word}}}"),
    }
}

fn function(function: Function) -> String {
    match function {
        Function::Sign => r"\mathop{\mathrm{sgn}}".to_owned(),
        named => format!(r"\{}", function_name(named)),
    }
}

/// A unit in upright letters: `\mathrm{m/s^{2}}`.
pub(crate) fn tex_unit(unit: Unit) -> String {
    let unit = unit.spelled(r"\,", |power| format!("^{{{power}}}"));
    format!(r"\mathrm{{{unit}}}")
}

pub(super) const WIDTH_EM: f64 = 30.5;
const INDENT: f64 = 2.3; // of a continued line, in em: `\qquad` and the empty group before its sign
const BRACE: f64 = 1.8; // of the brace of `cases`, in em
/// Lines from which [`Form::Automatic`] prefers an environment that breaks across pages: more leave no place for a table
/// above them.
pub(super) const CASES_LINES: usize = 24;

pub(super) struct Block {
    pub label: String,
    pub count: usize,
    /// Whether the lines belong in `align` rather than `cases`.
    pub aligned: bool,
    pub lines: Vec<String>, // with `\\` where they need it
}

impl Block {
    /// Labels for `\ref` and `\eqref`.
    pub(crate) fn labels(&self) -> String {
        let label = &self.label;
        match (self.aligned, self.count) {
            (true, 2..) => format!("{label}:1 to {label}:{}", self.count),
            (true, _) => format!("{label}:1"),
            (false, _) => label.clone(),
        }
    }
}

/// Spells the equations of one phase; `label` is the stem of its labels.
pub(super) fn block(system: &EquationSystem, label: String, options: &PrintOptions) -> Block {
    let all = |widest: Option<f64>| -> Vec<Vec<String>> {
        let equations = system.equations.iter();
        let sides = equations.map(|equation| right_sides(equation, widest, options));
        sides.collect()
    };
    let lines_of = |sides: &[Vec<String>]| sides.iter().map(Vec::len).sum::<usize>();
    let in_cases = all(None);
    let aligned = match options.form {
        Form::Automatic => lines_of(&in_cases) > CASES_LINES,
        Form::Cases => false,
        Form::Align => true,
    };
    let lefts = system.equations.iter().map(|equation| &equation.left);
    let sides = match aligned {
        true => all(Some(lefts.map(symbol_width).fold(0.0, f64::max))),
        false => in_cases,
    };
    let count = lines_of(&sides);
    // the equations of the phase are spaced if one of them is broken
    let is_spaced = count > sides.len();
    let mut lines = Vec::with_capacity(count);
    for (place, (equation, of_equation)) in system.equations.iter().zip(&sides).enumerate() {
        let is_tall = equation.is_tall();
        let (style, mark) = match (aligned, is_tall) {
            (true, _) => ("", "&"),
            // `cases` sets its lines in text style, in which fractions shrink.
            (false, true) => (r"\displaystyle ", ""),
            (false, false) => ("", ""),
        };
        let is_close = equation.is_approximate;
        let relation = if is_close { r"\approx" } else { "=" };
        let label = format!(r" \label{{{label}:{}}}", place + 1);
        for (line, side) in of_equation.iter().enumerate() {
            let start = match line {
                0 => format!("{} {mark}{relation} ", tex_symbol(&equation.left)),
                _ => format!(r"{mark}\qquad "),
            };
            // whether the equation and the phase end with this line
            let ends = [line + 1 == of_equation.len(), place + 1 == sides.len()];
            let end = match (aligned, ends) {
                (true, [false, _]) => r" \notag \\",
                (true, [true, true]) => &label,
                (true, [true, false]) => &format!(r"{label} \\"),
                (false, [true, true]) => "",
                (false, [true, false]) if is_tall || is_spaced => r" \\[1ex]",
                (false, [false, _]) if is_tall => r" \\[0.5ex]",
                (false, _) => r" \\",
            };
            lines.push(format!("{style}{start}{side}{end}"));
        }
    }
    Block {
        label,
        count: sides.len(),
        aligned,
        lines,
    }
}

/// One phase as a bare `cases` environment, to be used inside math mode.
pub fn tex_cases(system: &EquationSystem, width_em: f64) -> String {
    let options = PrintOptions {
        form: Form::Cases,
        width_em: Some(width_em),
        ..PrintOptions::default()
    };
    let lines = block(system, String::new(), &options).lines.join("\n  ");
    format!("\\begin{{cases}}\n  {lines}\n\\end{{cases}}")
}

/// The lines of a right side: aligned after the widest left side, in em, or after a brace at their own left side.
fn right_sides(equation: &Equation, aligned: Option<f64>, options: &PrintOptions) -> Vec<String> {
    let numbers = options.numbers;
    if equation.terms.is_empty() {
        return vec![tex(&equation.right(), numbers)];
    }
    let width = options.width_em.unwrap_or(WIDTH_EM);
    let (available, first, continued) = match aligned {
        None => (width - BRACE, symbol_width(&equation.left) + EQUALS, INDENT),
        Some(left) => (width, left + EQUALS, left + INDENT),
    };
    let lines = break_lines(&equation.terms, available, first, continued).into_iter();
    let side = |(line, terms)| tex_terms(terms, numbers, line > 0);
    lines.enumerate().map(side).collect()
}

/// Text from outside, printed so that TeX shows its characters and runs none of them: in one line, with commands for
/// special characters and code points for those that pdfTeX does not know.
pub(crate) fn tex_text(text: &str) -> String {
    let mut tex = String::new();
    let mut previous = ' ';
    for character in text.chars() {
        // Two of these in a row are a ligature.
        if character == previous && "-,".contains(character) {
            tex.push_str("{}");
        }
        previous = character;
        match escaped(character) {
            Some(command) => tex.push_str(command),
            None if is_plain(character) => tex.push(character),
            None => tex.push_str(&code_point(character)),
        }
    }
    tex
}

/// Text from outside for a `%` comment: on one line, without characters that hide others.
pub(crate) fn comment_text(text: &str) -> String {
    text.replace(is_invisible, " ")
}

/// Characters that TeX would not print as they are, and their commands.
const COMMANDS: &str = r#"
    \ \textbackslash{} { \{ } \} $ \$ & \& # \# % \% _ \_ ^ \textasciicircum{} ~ \textasciitilde{}
    < \textless{} > \textgreater{} | \textbar{} " \textquotedbl{} ' \textquotesingle{} ` \textasciigrave{}
    – \textendash{} — \textemdash{} ‘ \textquoteleft{} ’ \textquoteright{} “ \textquotedblleft{}
    ” \textquotedblright{} … \dots{} ° \textdegree{} µ \textmu{} ± \textpm{} × \texttimes{}
    · \textperiodcentered{} ² \texttwosuperior{} ³ \textthreesuperior{}
"#;

fn escaped(character: char) -> Option<&'static str> {
    if character.is_control() || character.is_whitespace() {
        return Some(" ");
    }
    let words = COMMANDS.split_whitespace();
    let mut pairs = words.clone().step_by(2).zip(words.skip(1).step_by(2));
    let known = pairs.find(|(plain, _)| plain.starts_with(character));
    known.map(|(_, command)| command)
}

/// ASCII letters, digits and harmless marks, and the Latin letters that the default fonts of pdfTeX carry.
fn is_plain(character: char) -> bool {
    character.is_ascii_alphanumeric()
        || "!()*+,-./:;=?@[] ".contains(character)
        || "ÀÁÂÃÄÅÆÇÈÉÊËÌÍÎÏÑÒÓÔÕÖØÙÚÛÜÝßàáâãäåæçèéêëìíîïñòóôõöøùúûüýÿČčĎďĚěŇňŘřŠšŤťŮůŽžŁłŃńŚśŹźŻżŐőŰű"
            .contains(character)
}

/// A name for a `\label` or a file: ASCII letters and digits, any other character replaced by a hyphen.
pub(crate) fn label(name: &str) -> String {
    name.chars()
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '-' })
        .collect()
}
