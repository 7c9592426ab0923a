//! The one place that owns precedence, parentheses, indentation and line width.

use super::code::{Expr, Function, Index, Stmt};
use super::dialect::{Dialect, Lines};
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

/// Prints statements in one dialect.
#[derive(Clone, Copy)]
pub(crate) struct Printer<'a> {
    dialect: &'a dyn Dialect,
    /// Function that sums with a product are printed with.
    multiply_add: Option<&'static str>,
}

impl<'a> Printer<'a> {
    /// A printer for a dialect.
    pub(crate) fn new(dialect: &'a dyn Dialect) -> Self {
        Self {
            dialect,
            multiply_add: None,
        }
    }

    /// A function behind its head, with a mention of each parameter that nothing reads; ends without
    /// a newline.
    pub(crate) fn function(
        &self,
        head: &str,
        mention: impl Fn(&Ident) -> String,
        function: &Function,
    ) -> String {
        let mut text = format!("{head} {{\n");
        for parameter in &function.unused {
            self.line(&mention(parameter), 1, &mut text);
        }
        self.block(&function.body, 1, &mut text);
        text.push('}');
        text
    }

    /// This printer for the bodies of loops.
    fn in_loop(&self) -> Self {
        Self {
            multiply_add: self.dialect.multiply_add(),
            ..*self
        }
    }

    /// Statements of a loop's body at a depth of indentation; ends with a newline.
    pub(crate) fn statements(&self, statements: &[Stmt], depth: usize) -> String {
        let mut text = String::new();
        self.in_loop().block(statements, depth, &mut text);
        text
    }

    fn block(&self, statements: &[Stmt], depth: usize, text: &mut String) {
        for statement in statements {
            let line = match statement {
                Stmt::For(variable, count, body) => {
                    let head = self.dialect.for_loop(&variable.to_string(), *count);
                    self.in_loop().looped(&head, body, depth, text);
                    continue;
                }
                Stmt::Row(row) => {
                    let lines = self.dialect.row(row);
                    self.side_by_side(lines, || row.in_columns(), depth, text);
                    continue;
                }
                Stmt::Fours(fours) => {
                    let blocks = fours.blocks.iter();
                    let blocks = blocks.map(|block| self.dialect.four_block(fours, block));
                    let lines = blocks.collect::<Option<Vec<_>>>().map(|all| all.concat());
                    self.side_by_side(lines, || fours.one_by_one(), depth, text);
                    continue;
                }
                Stmt::SinCosLane {
                    argument,
                    sine,
                    cosine,
                    is_used,
                } => {
                    let argument = self.expression(argument);
                    let names = [sine.to_string(), cosine.to_string()];
                    for line in self.dialect.sin_cos_lane(&argument, &names, *is_used) {
                        self.line(&line, depth, text);
                    }
                    continue;
                }
                Stmt::Let(name, value) => {
                    let value = self.expression(value);
                    self.dialect.let_scalar(&name.to_string(), &value)
                }
                Stmt::LetArray(name, elements) => {
                    let elements: Vec<_> = elements.iter().map(|e| self.expression(e)).collect();
                    self.dialect.let_array(&name.to_string(), &elements)
                }
                Stmt::Declare(name, len) => self.dialect.declare(&name.to_string(), *len),
                Stmt::Assign(target, value) => self.assign(target, " = ", value),
                Stmt::AddAssign(target, value) => {
                    let is_product = matches!(value, Expr::Infix(Binary::Mul, ..));
                    let is_fused = self.multiply_add.is_some() && is_product;
                    match is_fused || !self.dialect.adds_in_place() {
                        true => {
                            let sum = Expr::infix(Binary::Add, target.clone(), value.clone());
                            self.assign(target, " = ", &sum)
                        }
                        false => self.assign(target, " += ", value),
                    }
                }
                Stmt::Call {
                    callee,
                    read,
                    written,
                } => {
                    let callee = callee.as_ref().map(Ident::to_string);
                    self.dialect.call(callee.as_deref(), read, written)
                }
            };
            self.line(&line, depth, text);
        }
    }

    /// A loop whose body this printer prints.
    fn looped(&self, head: &str, body: &[Stmt], depth: usize, text: &mut String) {
        let (open, close) = self.dialect.loop_ends();
        self.line(&format!("{head}{open}"), depth, text);
        self.block(body, depth + 1, text);
        if let Some(close) = close {
            self.line(close, depth, text);
        }
    }

    /// Lines as they are, or statements where a language has none.
    fn side_by_side(
        &self,
        lines: Option<Lines>,
        one_by_one: impl FnOnce() -> Vec<Stmt>,
        depth: usize,
        text: &mut String,
    ) {
        let Some(lines) = lines else {
            return self.block(&one_by_one(), depth, text);
        };
        for (inner, line) in lines {
            self.line(&line, depth + inner, text);
        }
    }

    fn assign(&self, target: &Expr, op: &str, value: &Expr) -> String {
        let [target, value] = [target, value].map(|expr| self.expression(expr));
        format!("{target}{op}{value}{}", self.dialect.terminator())
    }

    /// Adds a line, broken at spaces if it is too wide.
    fn line(&self, line: &str, depth: usize, text: &mut String) {
        let mut indent = 4 * depth;
        let mut rest = line;
        loop {
            text.extend(std::iter::repeat_n(' ', indent));
            let room = WIDTH.saturating_sub(indent);
            let cut = if rest.len() > room {
                let within = rest[..=room].rfind(' ');
                within.or_else(|| rest.find(' '))
            } else {
                None
            };
            let Some(cut) = cut.filter(|&cut| cut > 0) else {
                text.push_str(rest);
                text.push('\n');
                return;
            };
            text.push_str(&rest[..cut]);
            text.push_str(self.dialect.continuation());
            text.push('\n');
            rest = &rest[cut + 1..];
            indent = 4 * depth + 4;
        }
    }

    /// An expression.
    pub fn expression(&self, expr: &Expr) -> String {
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
                let left = self.operand(a, own);
                let operator = self.dialect.operator(*op);
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
