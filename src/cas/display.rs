//! Prints expressions in the grammar they are read from.

use super::*;

/// The text of an expression; made by [`ExprPool::display`].
pub struct Display<'p> {
    pool: &'p ExprPool,
    expr: ExprId,
}

impl ExprPool {
    /// The text of `expr`, terms in canonical order, floats in full: [`parse`](ExprPool::parse) reads back the same id.
    pub fn display(&self, expr: ExprId) -> Display<'_> {
        Display { pool: self, expr }
    }
}

/// A piece of text still to be written; the printer keeps a stack of these, so that it need not recurse deeply.
enum Piece<'p> {
    Text(&'p str),
    Number(Number),
    Expr(ExprId),
    Power(ExprId, Exponent),
    /// An expression in parentheses unless it is a single word.
    Operand(ExprId),
    Term(Number, ExprId),
}

impl fmt::Display for Display<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut stack = vec![Piece::Expr(self.expr)];
        while let Some(piece) = stack.pop() {
            let pieces = match piece {
                Piece::Text(text) => {
                    formatter.write_str(text)?;
                    continue;
                }
                Piece::Number(number) => {
                    write!(formatter, "{number}")?;
                    continue;
                }
                Piece::Expr(expr) => self.of_expr(expr),
                Piece::Term(coefficient, rest) => self.of_term(coefficient, rest),
                Piece::Power(base, exponent) => self.of_power(base, exponent),
                Piece::Operand(expr) => self.of_operand(expr),
            };
            stack.extend(pieces.into_iter().rev());
        }
        Ok(())
    }
}

impl<'p> Display<'p> {
    fn of_expr(&self, expr: ExprId) -> Vec<Piece<'p>> {
        match self.pool.node(expr) {
            Node::Number(number) => vec![Piece::Number(*number)],
            Node::Symbol(symbol) => vec![Piece::Text(self.pool.symbol_name(*symbol))],
            Node::Sum(_) => self.of_sum(expr),
            Node::Apply(function, argument) if self.pool.base_and_exponent(expr).0 == expr => vec![
                Piece::Text(function.name()),
                Piece::Text("("),
                Piece::Expr(*argument),
                Piece::Text(")"),
            ],
            Node::Product(_) | Node::Power(..) | Node::Apply(..) => {
                let (coefficient, rest) = self.pool.split(expr);
                self.of_term(coefficient, rest)
            }
        }
    }

    fn of_sum(&self, expr: ExprId) -> Vec<Piece<'p>> {
        let mut pieces = Vec::new();
        for (index, (coefficient, rest)) in self.pool.terms_of(expr).into_iter().enumerate() {
            match (index, coefficient.is_negative()) {
                (0, _) => pieces.push(Piece::Term(coefficient, rest)),
                (_, false) => pieces.extend([Piece::Text(" + "), Piece::Term(coefficient, rest)]),
                (_, true) => pieces.extend([Piece::Text(" - "), Piece::Term(-coefficient, rest)]),
            }
        }
        pieces
    }

    /// A product as one fraction: `-0.5*x*y/(z*w^2)`.
    fn of_term(&self, coefficient: Number, rest: ExprId) -> Vec<Piece<'p>> {
        let mut numerator = Vec::new();
        let mut denominator = Vec::new();
        for &factor in self.pool.factors_of(rest) {
            if factor == ExprId::ONE {
                continue;
            }
            let (base, exponent) = self.pool.base_and_exponent(factor);
            match exponent {
                // `1/0^2` would read as `1/0`: powers of constants keep a negative exponent.
                Exponent::Number(number)
                    if number.is_negative() && self.pool.as_number(base).is_none() =>
                {
                    denominator.push(Piece::Power(base, Exponent::Number(-number)));
                }
                _ => numerator.push(Piece::Power(base, exponent)),
            }
        }
        let mut pieces = Vec::new();
        if coefficient == Number::MINUS_ONE && !numerator.is_empty() {
            pieces.push(Piece::Text("-"));
        } else if !coefficient.is_one() || numerator.is_empty() {
            numerator.insert(0, Piece::Number(coefficient));
        }
        join(&mut pieces, numerator);
        if denominator.len() == 1 {
            pieces.push(Piece::Text("/"));
            pieces.extend(denominator);
        } else if denominator.len() > 1 {
            pieces.push(Piece::Text("/("));
            join(&mut pieces, denominator);
            pieces.push(Piece::Text(")"));
        }
        pieces
    }

    fn of_power(&self, base: ExprId, exponent: Exponent) -> Vec<Piece<'p>> {
        let mut pieces = vec![Piece::Operand(base), Piece::Text("^")];
        let number = match exponent {
            Exponent::Expr(exponent) => {
                pieces.push(Piece::Operand(exponent));
                return pieces;
            }
            Exponent::Number(number) => number,
        };
        let exact_root = || self.pool.as_number(base)?.checked_root(2);
        pieces.extend(match number.as_rational() {
            Some((1, 1)) => return vec![Piece::Operand(base)],
            // `sqrt(36)` would read as 6, though the power itself is beyond every float; `sqrt(0)` as zero, though its
            // negative powers are not.
            Some((halves, 2)) if exact_root().is_none() => {
                let mut root = vec![Piece::Text("sqrt("), Piece::Expr(base), Piece::Text(")")];
                if halves != 1 {
                    root.extend([Piece::Text("^"), Piece::Number(Number::integer(halves))]);
                }
                return root;
            }
            Some((_, 1)) => vec![Piece::Number(number)],
            None if !number.is_negative() => vec![Piece::Number(number)],
            Some(_) | None => vec![Piece::Text("("), Piece::Number(number), Piece::Text(")")],
        });
        pieces
    }

    fn of_operand(&self, expr: ExprId) -> Vec<Piece<'p>> {
        let is_word = match self.pool.node(expr) {
            Node::Symbol(_) | Node::Apply(..) => true,
            Node::Number(number) => {
                !number.is_negative() && (number.as_integer().is_some() || !number.is_exact())
            }
            Node::Sum(_) | Node::Product(_) | Node::Power(..) => false,
        };
        match is_word {
            true => vec![Piece::Expr(expr)],
            false => vec![Piece::Text("("), Piece::Expr(expr), Piece::Text(")")],
        }
    }
}

fn join<'p>(pieces: &mut Vec<Piece<'p>>, factors: Vec<Piece<'p>>) {
    for (index, factor) in factors.into_iter().enumerate() {
        if index > 0 {
            pieces.push(Piece::Text("*"));
        }
        pieces.push(factor);
    }
}
