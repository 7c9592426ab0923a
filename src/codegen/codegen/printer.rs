//! The one place that owns precedence, parentheses, indentation and line width.

use super::*;

const WIDTH: usize = 100;

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Precedence {
    Sum,
    Product,
    Sign,
    Atom,
}

#[derive(Clone)]
pub(crate) struct Text {
    pub text: String,
    binds: Precedence,
    pub depth: usize,
    pub place: Option<(Ident, usize)>, // of an element: its array and its position
    /// Of a product that may be fused with a sum: its factors, and the first negated.
    factors: Option<Box<[String; 3]>>,
}

impl Text {
    fn new(text: String, binds: Precedence, depth: usize) -> Self {
        Self {
            text,
            binds,
            depth,
            place: None,
            factors: None,
        }
    }

    pub(crate) fn atom(text: String) -> Self {
        Self::new(text, Precedence::Atom, 0)
    }

    fn operand(&self, at_least: Precedence) -> String {
        match self.binds >= at_least {
            true => self.text.clone(),
            false => format!("({})", self.text),
        }
    }

    fn negated(&self) -> String {
        format!("-{}", self.operand(Precedence::Atom))
    }
}

impl Dialect {
    pub(crate) fn constant(&self, value: f64) -> Text {
        let binds = match value.is_sign_negative() {
            true => Precedence::Sign,
            false => Precedence::Atom,
        };
        Text::new(self.literal(value), binds, 0)
    }

    pub(crate) fn element(&self, array: &Ident, index: &Index) -> Text {
        let words = [("name", array.as_str()), ("i", &self.subscript(index))];
        let place = (array.clone(), index.offset);
        Text {
            place: Some(place).filter(|_| index.terms.is_empty()),
            ..Text::atom(self.fill(self.spelling.element, &words))
        }
    }

    pub(crate) fn entry(&self, table: &Ident, row: &Index, col: &Index) -> Text {
        let [row, col] = [row, col].map(|index| self.subscript(index));
        let words = [("name", table.as_str()), ("i", &row), ("j", &col)];
        Text::atom(self.fill(self.spelling.entry, &words))
    }

    fn subscript(&self, index: &Index) -> String {
        let terms = index.terms.iter().filter(|(stride, _)| *stride != 0);
        let terms = terms.map(|(stride, name)| match stride {
            1 => name.to_string(),
            _ => format!("{stride}*{name}"),
        });
        let offset = index.offset + self.spelling.first_index;
        let offset = (offset != 0).then(|| offset.to_string());
        let parts: Vec<String> = terms.chain(offset).collect();
        match parts.as_slice() {
            [] => "0".to_owned(),
            parts => parts.join(" + "),
        }
    }

    pub(crate) fn unary(&self, op: Unary, a: &Text) -> Text {
        let (text, binds) = match op {
            Unary::Neg => (a.negated(), Precedence::Sign),
            _ => {
                let mut functions = self.spelling.functions.iter();
                let own = functions.find(|(known, _)| *known == op);
                let pattern = own.map_or(self.spelling.function, |(_, pattern)| pattern);
                let words = [("name", op.name()), ("a", &a.text)];
                (self.fill(pattern, &words), Precedence::Atom)
            }
        };
        Text::new(text, binds, a.depth + 1)
    }

    pub(crate) fn select(&self, operands: &[Text; 3]) -> Text {
        let [test, zero, other] = operands.each_ref().map(|operand| operand.text.as_str());
        let words = [("test", test), ("zero", zero), ("other", other)];
        let text = self.fill(self.spelling.select, &words);
        let depth = operands.iter().map(|operand| operand.depth).max();
        Text::new(text, Precedence::Atom, depth.unwrap_or(0) + 1)
    }

    /// `in_loop`, a sum with a product is printed with a function, if the language has one.
    pub(crate) fn binary(&self, op: Binary, a: &Text, b: &Text, in_loop: bool) -> Text {
        let depth = a.depth.max(b.depth) + 1;
        let multiply_add = self.spelling.multiply_add.filter(|_| in_loop);
        if let (Some(name), Some([x, y, rest])) = (multiply_add, multiply_added(op, a, b)) {
            return Text::new(format!("{name}({x}, {y}, {rest})"), Precedence::Atom, depth);
        }
        let [add, sub, mul, div] = self.spelling.operators;
        // Sums and products group to the left; a right operand of the same kind keeps its parentheses, because
        // floating-point sums do not associate.
        let (operator, own, right) = match op {
            Binary::Add => (add, Precedence::Sum, Precedence::Product),
            Binary::Sub => (sub, Precedence::Sum, Precedence::Product),
            Binary::Mul => (mul, Precedence::Product, Precedence::Atom),
            Binary::Div => (div, Precedence::Product, Precedence::Atom),
            Binary::Pow => {
                let words = [("a", a.text.as_str()), ("b", &b.text)];
                let text = self.fill(self.spelling.power, &words);
                return Text::new(text, Precedence::Atom, depth);
            }
        };
        // No operator before a minus.
        let right = match b.text.starts_with('-') {
            true => Precedence::Atom,
            false => right,
        };
        let text = format!("{}{operator}{}", a.operand(own), b.operand(right));
        let is_fusible = multiply_add.is_some() && op == Binary::Mul;
        let factors = || Box::new([a.text.clone(), b.text.clone(), a.negated()]);
        Text {
            factors: is_fusible.then(factors),
            ..Text::new(text, own, depth)
        }
    }
}

/// The arguments of `f(x, y, rest) = x*y + rest` for a sum with a product; rounded twice unless the target can fuse.
fn multiply_added(op: Binary, a: &Text, b: &Text) -> Option<[String; 3]> {
    let (a_factors, b_factors) = (a.factors.as_deref(), b.factors.as_deref());
    let (x, y, rest) = match (op, a_factors, b_factors) {
        (Binary::Add, _, Some([x, y, _])) => (x, y, a.text.clone()),
        (Binary::Add, Some([x, y, _]), None) => (x, y, b.text.clone()),
        (Binary::Sub, _, Some([_, y, negated])) => (negated, y, a.text.clone()),
        (Binary::Sub, Some([x, y, _]), None) => (x, y, b.negated()),
        _ => return None,
    };
    Some([x.clone(), y.clone(), rest])
}

pub(crate) struct Printer<'a> {
    pub dialect: &'a Dialect,
    depth: usize,
    text: String,
}

impl<'a> Printer<'a> {
    pub(crate) fn new(dialect: &'a Dialect, depth: usize) -> Self {
        Self {
            dialect,
            depth,
            text: String::new(),
        }
    }

    pub(crate) fn into_text(self) -> String {
        self.text
    }

    fn statement(&mut self, pattern: &str, words: &[(&str, &str)]) {
        self.line(&self.dialect.fill(pattern, words));
    }

    pub(crate) fn let_scalar(&mut self, name: &Ident, value: &Text) {
        let words = [("name", name.as_str()), ("value", &value.text)];
        self.statement(self.dialect.spelling.scalar, &words);
    }

    pub(crate) fn let_array(&mut self, name: &Ident, elements: &[Text]) {
        let values: Vec<&str> = elements.iter().map(|e| e.text.as_str()).collect();
        let (n, value) = (elements.len().to_string(), values.join(", "));
        let words = [("name", name.as_str()), ("n", &n), ("value", &value)];
        self.statement(self.dialect.spelling.array, &words);
    }

    pub(crate) fn declare(&mut self, name: &Ident, len: usize) {
        let words = [("name", name.as_str()), ("n", &len.to_string())];
        self.statement(self.dialect.spelling.declaration, &words);
    }

    pub(crate) fn assign(&mut self, target: &Text, value: &Text) {
        let words = [("name", target.text.as_str()), ("value", &value.text)];
        self.statement(self.dialect.spelling.assignment, &words);
    }

    pub(crate) fn add_assign(&mut self, target: &Text, value: &Text) {
        match self
            .dialect
            .spelling
            .addition
            .filter(|_| value.factors.is_none())
        {
            Some(addition) => {
                let words = [("name", target.text.as_str()), ("value", &value.text)];
                self.statement(addition, &words);
            }
            None => {
                let sum = self.dialect.binary(Binary::Add, target, value, true);
                self.assign(target, &sum);
            }
        }
    }

    pub(crate) fn sin_cos_lane(&mut self, argument: &Text, names: &[Ident; 2], used: [bool; 2]) {
        let spelling = self.dialect.spelling;
        let [sine, cosine] = [0, 1].map(|which| match spelling.unused_lane {
            Some(unused) if !used[which] => unused,
            _ => names[which].as_str(),
        });
        let words = [
            ("a", argument.text.as_str()),
            ("sine", sine),
            ("cosine", cosine),
        ];
        for pattern in spelling.sin_cos_lane {
            self.statement(pattern, &words);
        }
    }

    pub(crate) fn looped(&mut self, variable: &Ident, count: usize, body: impl FnOnce(&mut Self)) {
        let spelling = self.dialect.spelling;
        let [n, last] = [count, count - 1].map(|bound| bound.to_string());
        let words = [("name", variable.as_str()), ("n", &n), ("last", &last)];
        self.statement(spelling.loop_head, &words);
        self.depth += 1;
        body(self);
        self.depth -= 1;
        if let Some(end) = spelling.loop_end {
            self.line(end);
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
            self.text.push_str(self.dialect.spelling.continuation);
            self.text.push('\n');
            rest = &rest[cut + 1..];
            indent = 4 * self.depth + 4;
        }
    }
}
