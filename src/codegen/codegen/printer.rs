//! The one place that owns precedence, parentheses, indentation and line width.

use super::code::{Expr, Index};
use super::dialect::Dialect;
use super::ident::Ident;
use crate::ir::{Binary, Unary};

/// Longest line before an expression is broken, in characters.
const WIDTH: usize = 100;

/// How tightly the outermost operation of an expression binds.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Precedence {
    Sum,
    Product,
    Sign,
    Atom,
}

/// Prints statements in one dialect, at a depth of indentation.
pub(crate) struct Printer<'a> {
    pub dialect: &'a dyn Dialect,
    /// Function that sums with a product are printed with.
    multiply_add: Option<&'static str>,
    depth: usize,
    text: String,
}

impl<'a> Printer<'a> {
    /// For the statements of a function or, `in_loop`, of a loop's body.
    pub(crate) fn new(dialect: &'a dyn Dialect, depth: usize, in_loop: bool) -> Self {
        Self {
            dialect,
            multiply_add: dialect.spelling().multiply_add.filter(|_| in_loop),
            depth,
            text: String::new(),
        }
    }

    pub(crate) fn into_text(self) -> String {
        self.text
    }

    pub(crate) fn let_scalar(&mut self, name: &Ident, value: &Expr) {
        let value = self.expression(value);
        self.line(&self.dialect.let_scalar(&name.to_string(), &value));
    }

    pub(crate) fn let_array(&mut self, name: &Ident, elements: &[Expr]) {
        let elements: Vec<_> = elements.iter().map(|e| self.expression(e)).collect();
        self.line(&self.dialect.let_array(&name.to_string(), &elements));
    }

    /// An array that is assigned later.
    pub(crate) fn declare(&mut self, name: &Ident, len: usize) {
        self.line(&self.dialect.declare(&name.to_string(), len));
    }

    pub(crate) fn assign(&mut self, target: &Expr, value: &Expr) {
        self.assign_by(" = ", target, value);
    }

    /// `target += value`
    pub(crate) fn add_assign(&mut self, target: &Expr, value: Expr) {
        let is_fused = self.multiply_add.is_some() && product(&value).is_some();
        match is_fused || !self.dialect.spelling().adds_in_place {
            true => self.assign(target, &Expr::infix(Binary::Add, target.clone(), value)),
            false => self.assign_by(" += ", target, &value),
        }
    }

    /// Sine and cosine of one argument by the kernel's core, see [`Dialect::sin_cos_lane`].
    pub(crate) fn sin_cos_lane(&mut self, argument: &Expr, names: &[Ident; 2], used: [bool; 2]) {
        let argument = self.expression(argument);
        let names = names.each_ref().map(Ident::to_string);
        for line in self.dialect.sin_cos_lane(&argument, &names, used) {
            self.line(&line);
        }
    }

    fn assign_by(&mut self, op: &str, target: &Expr, value: &Expr) {
        let [target, value] = [target, value].map(|expr| self.expression(expr));
        let end = self.dialect.spelling().terminator;
        self.line(&format!("{target}{op}{value}{end}"));
    }

    /// A loop of the variable from 0 to below the count.
    pub(crate) fn looped(&mut self, variable: &Ident, count: usize, body: impl FnOnce(&mut Self)) {
        let (open, close) = self.dialect.spelling().loop_ends;
        let head = self.dialect.for_loop(&variable.to_string(), count);
        self.line(&format!("{head}{open}"));
        let outer = std::mem::replace(&mut self.multiply_add, self.dialect.spelling().multiply_add);
        self.depth += 1;
        body(self);
        self.depth -= 1;
        self.multiply_add = outer;
        if let Some(close) = close {
            self.line(close);
        }
    }

    /// Adds a line, broken at spaces if it is too wide.
    pub(crate) fn line(&mut self, line: &str) {
        let mut indent = 4 * self.depth;
        let mut rest = line;
        loop {
            self.text.extend(std::iter::repeat_n(' ', indent));
            let room = WIDTH.saturating_sub(indent);
            let cut = if rest.len() > room {
                let within = rest[..=room].rfind(' ');
                within.or_else(|| rest.find(' '))
            } else {
                None
            };
            let Some(cut) = cut.filter(|&cut| cut > 0) else {
                self.text.push_str(rest);
                self.text.push('\n');
                return;
            };
            self.text.push_str(&rest[..cut]);
            self.text.push_str(self.dialect.spelling().continuation);
            self.text.push('\n');
            rest = &rest[cut + 1..];
            indent = 4 * self.depth + 4;
        }
    }

    fn expression(&self, expr: &Expr) -> String {
        match expr {
            Expr::Literal(literal) => self.dialect.literal(*literal),
            Expr::Name(name) => name.to_string(),
            Expr::Element(array, index) => self.dialect.element(&array.to_string(), index),
            Expr::Entry(table, row, col) => self.dialect.entry(&table.to_string(), row, col),
            Expr::Unary(Unary::Neg, a) => format!("-{}", self.operand(a, Precedence::Atom)),
            Expr::Unary(function, a) => self.dialect.apply(*function, &self.expression(a)),
            Expr::Select(operands) => {
                let operands = operands.each_ref().map(|operand| self.expression(operand));
                self.dialect.select(operands)
            }
            Expr::Infix(Binary::Pow, a, b) => {
                self.dialect.power(&self.expression(a), &self.expression(b))
            }
            Expr::Infix(op, a, b) => {
                if let Some(fused) = self.multiply_added(*op, a, b) {
                    return fused;
                }
                // Sums and products group to the left; a right operand of the same kind keeps
                // its parentheses, because floating-point sums do not associate.
                let (own, right) = match op {
                    Binary::Add | Binary::Sub => (Precedence::Sum, Precedence::Product),
                    Binary::Mul | Binary::Div | Binary::Pow => {
                        (Precedence::Product, Precedence::Atom)
                    }
                };
                let right = if starts_with_minus(b) {
                    Precedence::Atom
                } else {
                    right
                };
                let [add, sub, mul, div] = self.dialect.spelling().operators;
                let operator = match op {
                    Binary::Add => add,
                    Binary::Sub => sub,
                    Binary::Mul => mul,
                    Binary::Div | Binary::Pow => div,
                };
                let left = self.operand(a, own);
                format!("{left}{operator}{}", self.operand(b, right))
            }
        }
    }

    /// `a*b + c` and its like by the dialect's function, if it has one; the same two roundings, unless
    /// the target can fuse them.
    fn multiply_added(&self, op: Binary, a: &Expr, b: &Expr) -> Option<String> {
        let name = self.multiply_add?;
        let (first, second, rest) = match (op, product(a), product(b)) {
            (Binary::Add, _, Some((x, y))) => (self.expression(x), y, self.expression(a)),
            (Binary::Add, Some((x, y)), None) => (self.expression(x), y, self.expression(b)),
            (Binary::Sub, _, Some((x, y))) => {
                let negated = format!("-{}", self.operand(x, Precedence::Atom));
                (negated, y, self.expression(a))
            }
            (Binary::Sub, Some((x, y)), None) => {
                let negated = format!("-{}", self.operand(b, Precedence::Atom));
                (self.expression(x), y, negated)
            }
            (Binary::Add | Binary::Sub, None, None)
            | (Binary::Mul | Binary::Div | Binary::Pow, ..) => {
                return None;
            }
        };
        Some(format!(
            "{name}({first}, {}, {rest})",
            self.expression(second)
        ))
    }

    fn operand(&self, expr: &Expr, at_least: Precedence) -> String {
        let text = self.expression(expr);
        if precedence(expr) >= at_least {
            text
        } else {
            format!("({text})")
        }
    }
}

fn precedence(expr: &Expr) -> Precedence {
    match expr {
        Expr::Literal(value) if value.is_sign_negative() => Precedence::Sign,
        Expr::Unary(Unary::Neg, _) => Precedence::Sign,
        Expr::Literal(_)
        | Expr::Name(_)
        | Expr::Element(..)
        | Expr::Entry(..)
        | Expr::Unary(..)
        | Expr::Select(_)
        | Expr::Infix(Binary::Pow, ..) => Precedence::Atom,
        Expr::Infix(Binary::Add | Binary::Sub, ..) => Precedence::Sum,
        Expr::Infix(Binary::Mul | Binary::Div, ..) => Precedence::Product,
    }
}

fn product(expr: &Expr) -> Option<(&Expr, &Expr)> {
    match expr {
        Expr::Infix(Binary::Mul, a, b) => Some((a, b)),
        _ => None,
    }
}

/// Whether the printed expression begins with a minus that would follow an operator.
fn starts_with_minus(expr: &Expr) -> bool {
    match expr {
        Expr::Literal(value) => value.is_sign_negative(),
        Expr::Unary(op, _) => *op == Unary::Neg,
        Expr::Infix(Binary::Mul | Binary::Div, a, _) => starts_with_minus(a),
        Expr::Infix(Binary::Add | Binary::Sub | Binary::Pow, ..)
        | Expr::Select(_)
        | Expr::Name(_)
        | Expr::Element(..)
        | Expr::Entry(..) => false,
    }
}

/// A subscript such as `4*i + 3`.
pub(crate) fn subscript(index: &Index) -> String {
    let terms = index.terms.iter().filter(|(stride, _)| *stride != 0);
    let terms = terms.map(|(stride, name)| match stride {
        1 => name.to_string(),
        _ => format!("{stride}*{name}"),
    });
    let offset = (index.offset != 0).then(|| index.offset.to_string());
    let parts: Vec<String> = terms.chain(offset).collect();
    match parts.as_slice() {
        [] => "0".to_owned(),
        parts => parts.join(" + "),
    }
}
