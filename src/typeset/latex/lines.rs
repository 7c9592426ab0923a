//! Equations as lines of a `cases` or `align` environment.

use crate::typeset::{
    EQUALS, Equation, EquationSystem, Form, PrintOptions, break_lines, symbol_width,
};

use super::math::{TexMath, TexSymbol, TexTerms};

/// Longest line unless chosen, in em.
const WIDTH_EM: f64 = 32.0;
/// What a continued line is set in by, in em: `\qquad` and the empty group
/// before its sign.
const INDENT: f64 = 2.3;
/// What the brace of `cases` takes of the line, in em.
const BRACE: f64 = 1.0;
/// Lines from which [`Form::Automatic`] prefers an environment that breaks across pages.
const CASES_LINES: usize = 30;

/// The lines of one phase and whether they are for `align`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Block {
    /// Whether the lines belong into `align` rather than `cases`.
    pub aligned: bool,
    /// The lines with `\\` where they need it.
    pub lines: Vec<String>,
}

/// Spells the equations of one phase; `label` is the stem of its labels.
pub(super) fn block(system: &EquationSystem, label: &str, options: &PrintOptions) -> Block {
    let printer = Printer { options, label };
    let equations: Vec<Vec<String>> = system
        .equations
        .iter()
        .map(|equation| printer.right_sides(equation))
        .collect();
    let count: usize = equations.iter().map(Vec::len).sum();
    let aligned = match options.form {
        Form::Automatic => count > CASES_LINES,
        Form::Cases => false,
        Form::Align => true,
    };
    let mut lines = Vec::with_capacity(count);
    for (place, (equation, sides)) in system.equations.iter().zip(&equations).enumerate() {
        let is_last = place + 1 == system.equations.len();
        let equation = Row {
            equation,
            sides,
            number: place + 1,
            is_last,
            is_spaced: count > system.equations.len(),
        };
        if aligned {
            printer.align(&equation, &mut lines);
        } else {
            printer.cases(&equation, &mut lines);
        }
    }
    Block { aligned, lines }
}

/// One phase as a bare `cases` environment, for a place that is in math mode already.
pub fn tex_cases(system: &EquationSystem, width_em: f64) -> String {
    let options = PrintOptions {
        form: Form::Cases,
        width_em: Some(width_em),
        ..PrintOptions::default()
    };
    let lines = block(system, "", &options).lines.join("\n  ");
    format!("\\begin{{cases}}\n  {lines}\n\\end{{cases}}")
}

struct Printer<'a> {
    options: &'a PrintOptions,
    label: &'a str,
}

/// One equation, broken into lines, and its place in the phase.
struct Row<'a> {
    equation: &'a Equation,
    sides: &'a [String],
    number: usize,
    is_last: bool,
    /// Whether the equations of the phase stand apart, because one of them is broken.
    is_spaced: bool,
}

impl Printer<'_> {
    /// The right side of an equation, one entry a line.
    fn right_sides(&self, equation: &Equation) -> Vec<String> {
        let numbers = self.options.numbers;
        if equation.terms.is_empty() {
            let zero = equation.right();
            let math = &zero;
            return vec![TexMath { math, numbers }.to_string()];
        }
        let available = self.options.width_em.unwrap_or(WIDTH_EM) - BRACE;
        let first = symbol_width(&equation.left) + EQUALS;
        break_lines(&equation.terms, available, first, INDENT)
            .into_iter()
            .enumerate()
            .map(|(line, terms)| {
                TexTerms {
                    terms,
                    numbers,
                    continues: line > 0,
                }
                .to_string()
            })
            .collect()
    }

    fn cases(&self, row: &Row<'_>, lines: &mut Vec<String>) {
        // `cases` sets its lines in text style, in which fractions shrink.
        let style = if row.equation.is_tall() {
            r"\displaystyle "
        } else {
            ""
        };
        for (line, side) in row.sides.iter().enumerate() {
            let start = if line == 0 {
                format!("{style}{} = ", TexSymbol(&row.equation.left))
            } else {
                format!(r"{style}\qquad ")
            };
            let ends_equation = line + 1 == row.sides.len();
            let is_tall = row.equation.is_tall();
            let end = match (ends_equation, row.is_last) {
                (true, true) => "",
                (true, false) if is_tall || row.is_spaced => r" \\[1ex]",
                (false, _) if is_tall => r" \\[0.5ex]",
                (_, _) => r" \\",
            };
            lines.push(format!("{start}{side}{end}"));
        }
    }

    fn align(&self, row: &Row<'_>, lines: &mut Vec<String>) {
        for (line, side) in row.sides.iter().enumerate() {
            let start = if line == 0 {
                format!("{} &= ", TexSymbol(&row.equation.left))
            } else {
                r"&\qquad ".to_owned()
            };
            let end = if line + 1 < row.sides.len() {
                r" \notag \\".to_owned()
            } else {
                let stop = if row.is_last { "" } else { r" \\" };
                format!(r" \label{{{}:{}}}{stop}", self.label, row.number)
            };
            lines.push(format!("{start}{side}{end}"));
        }
    }
}
