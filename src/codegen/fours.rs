//! Sparse products of matrix and vector, four neighbouring columns side by side.

use super::code::{Expr, Index, Infix, Span, Stmt};
use super::ident::Ident;
use crate::ir::{QUAD, Table};

/// Groups of columns that are added together: what registers hold beside weights and entries.
const GROUPS_AT_ONCE: usize = 12;
/// Most terms of a group in one part: compilers lose sight of vectors in longer chains of scalars.
const LONGEST_CHAIN: usize = 10;

/// [`Statement::SparseProduct`](crate::ir::Statement) where its numbers live.
#[derive(Clone, Debug, PartialEq)]
pub struct Fours {
    /// The local array that the sums go to, and its length.
    pub sums: (Ident, usize),
    /// The weights.
    pub weights: Span,
    /// Table of all distinct groups of coefficients, one per row.
    pub table: Ident,
    /// The table's row that each group of sums begins with.
    pub starts: Vec<usize>,
    /// What is added, divided where functions may end.
    pub parts: Vec<Vec<Four>>,
    /// Loop variable over the columns of a group.
    pub lane: Ident,
}

/// A weight times the coefficients of a group.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Four {
    /// First column.
    pub at: usize,
    /// Row of the table.
    pub entry: usize,
    /// Position among the weights.
    pub weight: usize,
}

impl Fours {
    /// The terms of a table, with the table of its distinct groups; the association of each sum is the
    /// order of the table's rows.
    pub fn terms(table: &Table) -> (Table, Vec<usize>, Vec<Vec<Four>>) {
        let mut distinct: Vec<[f64; QUAD]> = Vec::new();
        let mut known = std::collections::HashMap::new();
        let mut entry = |row: usize, col: usize| {
            let group: [f64; QUAD] = std::array::from_fn(|l| table.row(row)[col + l]);
            *known.entry(group.map(f64::to_bits)).or_insert_with(|| {
                distinct.push(group);
                distinct.len() - 1
            })
        };
        let starts = (0..table.cols()).step_by(QUAD).map(|col| entry(0, col));
        let starts: Vec<usize> = starts.collect();
        let mut parts = Vec::new();
        for first in (0..starts.len()).step_by(GROUPS_AT_ONCE) {
            let here = QUAD * first..QUAD * (first + GROUPS_AT_ONCE);
            let mut lengths = vec![0; starts.len()];
            let mut part = Vec::new();
            for row in 1..table.rows() {
                for at in table.quads(row).filter(|at| here.contains(at)) {
                    if lengths[at / QUAD] == LONGEST_CHAIN {
                        parts.push(std::mem::take(&mut part));
                        lengths.fill(0);
                    }
                    lengths[at / QUAD] += 1;
                    let (entry, weight) = (entry(row, at), row - 1);
                    part.push(Four { at, entry, weight });
                }
            }
            parts.extend((!part.is_empty()).then_some(part));
        }
        let entries = distinct.concat();
        (Table::new(distinct.len(), QUAD, entries), starts, parts)
    }

    /// The coefficient of a column of a group.
    pub fn entry(&self, row: usize, lane: Index) -> Expr {
        Expr::Entry(self.table.clone(), Index::fixed(row), lane)
    }

    /// A weight.
    pub fn weight(&self, position: usize) -> Expr {
        let at = Index::fixed(self.weights.offset + position);
        Expr::Element(self.weights.array.clone(), at)
    }

    /// Beginning of the sums, column by column.
    pub fn start_in_loop(&self, at: usize, row: usize) -> Stmt {
        self.columns(at, |sum| Stmt::Assign(sum, self.entry(row, self.column())))
    }

    /// One term, column by column.
    pub fn term_in_loop(&self, four: Four) -> Stmt {
        let entry = self.entry(four.entry, self.column());
        let product = Expr::infix(Infix::Mul, entry, self.weight(four.weight));
        self.columns(four.at, |sum| Stmt::AddAssign(sum, product.clone()))
    }

    fn column(&self) -> Index {
        Index::variable(&self.lane)
    }

    fn columns(&self, at: usize, statement: impl Fn(Expr) -> Stmt) -> Stmt {
        let sum = Expr::Element(self.sums.0.clone(), self.column().shifted(at));
        Stmt::For(self.lane.clone(), QUAD, vec![statement(sum)])
    }
}
