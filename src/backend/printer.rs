//! The one place that owns precedence, parentheses, indentation and line width.

use super::code::{Argument, ConstTable, Expr, Function, Index, Infix, Stmt};
use super::dialect::Dialect;

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
pub struct Printer<'a> {
    dialect: &'a dyn Dialect,
}

impl<'a> Printer<'a> {
    /// A printer for a dialect.
    pub fn new(dialect: &'a dyn Dialect) -> Self {
        Self { dialect }
    }

    /// A function with its documentation; ends without a newline.
    pub fn function(&self, function: &Function) -> String {
        let mut text = self.dialect.docs(&function.docs);
        text.push_str(&self.dialect.signature(function));
        text.push_str(" {\n");
        for parameter in &function.unused {
            self.line(&self.dialect.discard(&parameter.to_string()), 1, &mut text);
        }
        self.block(&function.body, 1, &mut text);
        text.push('}');
        text
    }

    /// A constant table.
    pub fn table(&self, table: &ConstTable) -> String {
        self.dialect.table(table)
    }

    fn block(&self, statements: &[Stmt], depth: usize, text: &mut String) {
        for statement in statements {
            match statement {
                Stmt::For(variable, count, body) => {
                    let head = self.dialect.for_loop(&variable.to_string(), *count);
                    self.line(&format!("{head} {{"), depth, text);
                    self.block(body, depth + 1, text);
                    self.line("}", depth, text);
                }
                Stmt::Let(name, value) => {
                    let value = self.expression(value);
                    self.line(
                        &self.dialect.let_scalar(&name.to_string(), &value),
                        depth,
                        text,
                    );
                }
                Stmt::LetArray(name, elements) => {
                    let elements: Vec<String> =
                        elements.iter().map(|e| self.expression(e)).collect();
                    self.line(
                        &self.dialect.let_array(&name.to_string(), &elements),
                        depth,
                        text,
                    );
                }
                Stmt::Declare(name, len) => {
                    self.line(&self.dialect.declare(&name.to_string(), *len), depth, text);
                }
                Stmt::Assign(target, value) => self.assign(target, " = ", value, depth, text),
                Stmt::AddAssign(target, value) => self.assign(target, " += ", value, depth, text),
                Stmt::SinCos {
                    arguments,
                    sines,
                    cosines,
                } => {
                    let arguments = [
                        Argument::Read(arguments.clone()),
                        Argument::Write(sines.clone()),
                        Argument::Write(cosines.clone()),
                    ];
                    self.line(&self.dialect.call(None, &arguments), depth, text);
                }
                Stmt::Call(callee, arguments) => {
                    let call = self.dialect.call(Some(&callee.to_string()), arguments);
                    self.line(&call, depth, text);
                }
            }
        }
    }

    fn assign(&self, target: &Expr, op: &str, value: &Expr, depth: usize, text: &mut String) {
        let line = format!("{}{op}{};", self.expression(target), self.expression(value));
        self.line(&line, depth, text);
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
            text.push('\n');
            rest = &rest[cut + 1..];
            indent = 4 * depth + 4;
        }
    }

    /// An expression.
    pub fn expression(&self, expr: &Expr) -> String {
        match expr {
            Expr::Literal(literal) => literal.to_string(),
            Expr::Name(name) => name.to_string(),
            Expr::Element(array, index) => format!("{array}[{}]", subscript(index)),
            Expr::Entry(table, row, col) => {
                format!("{table}[{}][{}]", subscript(row), subscript(col))
            }
            Expr::Negate(a) => format!("-{}", self.operand(a, Precedence::Atom)),
            Expr::Infix(op, a, b) => {
                // Sums and products group to the left; a right operand of the same kind keeps
                // its parentheses, because floating-point sums do not associate.
                let (own, right) = match op {
                    Infix::Add | Infix::Sub => (Precedence::Sum, Precedence::Product),
                    Infix::Mul | Infix::Div => (Precedence::Product, Precedence::Atom),
                };
                let right = if starts_with_minus(b) {
                    Precedence::Atom
                } else {
                    right
                };
                let left = self.operand(a, own);
                let operator = match op {
                    Infix::Add => " + ",
                    Infix::Sub => " - ",
                    Infix::Mul => "*",
                    Infix::Div => "/",
                };
                format!("{left}{operator}{}", self.operand(b, right))
            }
            Expr::Apply(function, a) => self.dialect.apply(*function, &self.expression(a)),
        }
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
        Expr::Literal(literal) if literal.is_negative() => Precedence::Sign,
        Expr::Literal(_)
        | Expr::Name(_)
        | Expr::Element(..)
        | Expr::Entry(..)
        | Expr::Apply(..) => Precedence::Atom,
        Expr::Negate(_) => Precedence::Sign,
        Expr::Infix(Infix::Add | Infix::Sub, ..) => Precedence::Sum,
        Expr::Infix(Infix::Mul | Infix::Div, ..) => Precedence::Product,
    }
}

/// Whether the printed expression begins with a minus that would follow an operator.
fn starts_with_minus(expr: &Expr) -> bool {
    match expr {
        Expr::Literal(literal) => literal.is_negative(),
        Expr::Negate(_) => true,
        Expr::Infix(Infix::Mul | Infix::Div, a, _) => starts_with_minus(a),
        Expr::Infix(Infix::Add | Infix::Sub, ..)
        | Expr::Name(_)
        | Expr::Element(..)
        | Expr::Entry(..)
        | Expr::Apply(..) => false,
    }
}

/// A subscript such as `4*i + 3`.
pub fn subscript(index: &Index) -> String {
    let mut text = String::new();
    for (stride, name) in index.terms.iter().filter(|(stride, _)| *stride != 0) {
        if !text.is_empty() {
            text.push_str(" + ");
        }
        if *stride == 1 {
            text.push_str(&name.to_string());
        } else {
            text.push_str(&format!("{stride}*{name}"));
        }
    }
    if text.is_empty() {
        return index.offset.to_string();
    }
    if index.offset != 0 {
        text.push_str(&format!(" + {}", index.offset));
    }
    text
}
