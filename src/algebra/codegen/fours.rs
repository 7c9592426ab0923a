//! Sums of vectors of four numbers, of which several run side by side.

use std::ops::Range;

use super::code::{Expr, Index, Span, Stmt};
use super::ident::Ident;
use crate::ir::{Binary, QUAD, Quad, QuadSum, Table};

/// Sums that are added side by side: what the registers hold beside a weight.
pub(crate) const SUMS_AT_ONCE: usize = 12;

/// [`Statement::Quads`](crate::ir::Statement) where its numbers live.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Fours {
    /// The local array that the sums go to.
    pub array: Ident,
    pub sums: Vec<QuadSum>,
    pub weights: Span,
    /// The constant vectors, and what their table is called.
    pub table: (Table, Ident),
    /// Which numbers of each sum may be other than zero.
    pub filled: Vec<[bool; QUAD]>,
    /// Names of the sums of a block while they are added.
    pub names: Vec<Ident>,
    /// Sums that are added side by side.
    pub blocks: Vec<FourBlock>,
}

/// Neighbouring sums that do not need each other.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FourBlock {
    pub sums: Range<usize>,
    /// What is added to them, by weights as far as each sum's order allows.
    pub terms: Vec<Four>,
}

/// A vector times a weight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Four {
    /// The sum that it is added to.
    pub sum: usize,
    /// Position among the weights.
    pub weight: usize,
    pub vector: Quad,
}

impl FourBlock {
    /// Divides the sums of a statement.
    pub(crate) fn divide(sums: &[QuadSum]) -> Vec<Self> {
        let mut blocks = Vec::new();
        let mut first = 0;
        for end in 1..=sums.len() {
            let is_full = end - first == SUMS_AT_ONCE;
            if is_full || sums.get(end).is_none_or(|next| needs(next, first)) {
                blocks.push(Self::new(sums, first..end));
                first = end;
            }
        }
        blocks
    }

    fn new(all: &[QuadSum], sums: Range<usize>) -> Self {
        let mut waiting: Vec<_> = sums.clone().map(|sum| (sum, &all[sum].terms[..])).collect();
        let mut terms = Vec::new();
        while let Some(weight) = waiting.iter().filter_map(|(_, t)| Some(t.first()?.0)).min() {
            for (sum, rest) in &mut waiting {
                while let Some(((next, vector), others)) = rest.split_first() {
                    if *next != weight {
                        break;
                    }
                    *rest = others;
                    let (sum, vector) = (*sum, *vector);
                    terms.push(Four {
                        sum,
                        weight,
                        vector,
                    });
                }
            }
        }
        Self { sums, terms }
    }
}

/// Whether a sum reads one from `first` on.
fn needs(sum: &QuadSum, first: usize) -> bool {
    sum.vectors()
        .any(|vector| matches!(vector, Quad::Sum(earlier) if earlier >= first))
}

impl Fours {
    /// Which numbers of each sum may be other than zero.
    pub(crate) fn filled(table: &Table, sums: &[QuadSum]) -> Vec<[bool; QUAD]> {
        let mut filled: Vec<[bool; QUAD]> = Vec::new();
        for sum in sums {
            let mut lanes = [false; QUAD];
            for vector in sum.vectors() {
                let of_vector = filled_lanes(table, &filled, vector);
                lanes = std::array::from_fn(|l| lanes[l] || of_vector[l]);
            }
            filled.push(lanes);
        }
        filled
    }

    /// Which numbers of a vector may be other than zero.
    pub(crate) fn lanes(&self, vector: Quad) -> [bool; QUAD] {
        filled_lanes(&self.table.0, &self.filled, vector)
    }

    /// The statements for languages in which numbers are added one by one; products with coefficients of
    /// zero are left out.
    pub(crate) fn one_by_one(&self) -> Vec<Stmt> {
        let mut statements = Vec::new();
        for (position, sum) in self.sums.iter().enumerate() {
            for lane in 0..QUAD {
                let mut value = self.number(sum.start, lane);
                for &(weight, vector) in &sum.terms {
                    if self.lanes(vector)[lane] {
                        let number = self.number(vector, lane);
                        let at = Index::fixed(self.weights.offset + weight);
                        let weight = Expr::Element(self.weights.array.clone(), at);
                        let product = Expr::infix(Binary::Mul, number, weight);
                        value = Expr::infix(Binary::Add, value, product);
                    }
                }
                let target = self.number(Quad::Sum(position), lane);
                statements.push(Stmt::Assign(target, value));
            }
        }
        statements
    }

    fn number(&self, vector: Quad, lane: usize) -> Expr {
        match vector {
            Quad::Row(row) => Expr::Literal(self.table.0.row(row)[lane]),
            Quad::Sum(sum) => Expr::Element(self.array.clone(), Index::fixed(QUAD * sum + lane)),
        }
    }
}

fn filled_lanes(table: &Table, sums: &[[bool; QUAD]], vector: Quad) -> [bool; QUAD] {
    match vector {
        Quad::Row(row) => std::array::from_fn(|l| table.row(row)[l] != 0.0),
        Quad::Sum(sum) => sums[sum],
    }
}
