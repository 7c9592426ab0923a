//! Equations as lines of a `cases` or `align` environment.

use crate::typeset::{
    EQUALS, Equation, EquationSystem, Form, PrintOptions, break_lines, symbol_width,
};

use super::math::{tex, tex_symbol, tex_terms};

pub(super) const WIDTH_EM: f64 = 30.5;
/// What a continued line is set in by, in em: `\qquad` and the empty group
/// before its sign.
const INDENT: f64 = 2.3;
/// What the brace of `cases` takes of the line, in em.
const BRACE: f64 = 1.8;
/// Lines from which [`Form::Automatic`] prefers an environment that breaks across pages: no page holds many more.
pub(super) const CASES_LINES: usize = 30;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Block {
    pub label: String,
    pub count: usize,
    /// Whether the lines belong into `align` rather than `cases`.
    pub aligned: bool,
    /// The lines with `\\` where they need it.
    pub lines: Vec<String>,
}

impl Block {
    /// What `\ref` and `\eqref` can name.
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
    // the equations of the phase stand apart if one of them is broken
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
        let relation = match equation.is_approximate {
            true => r"\approx",
            false => "=",
        };
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

/// One phase as a bare `cases` environment, for a place that is in math mode already.
pub fn tex_cases(system: &EquationSystem, width_em: f64) -> String {
    let options = PrintOptions {
        form: Form::Cases,
        width_em: Some(width_em),
        ..PrintOptions::default()
    };
    let lines = block(system, String::new(), &options).lines.join("\n  ");
    format!("\\begin{{cases}}\n  {lines}\n\\end{{cases}}")
}

/// The right side of an equation, one entry per line. Lines are aligned behind the widest left side, in em,
/// or stand behind a brace, at the equation's own left side.
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
