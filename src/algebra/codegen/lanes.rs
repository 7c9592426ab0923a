//! One row of a matrix of functions: its sum and its slopes, column by column or in lanes.

use std::ops::Range;

use super::code::{Expr, Index, Span, Stmt};
use super::ident::Ident;
use super::storage::MatrixStorage;
use crate::ir::{Binary, Group, LANES, Slopes, Unary};

/// One row of [`Statement::Separable`](crate::ir::Statement) where its numbers live.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Row {
    /// The variable for the row.
    pub row: Ident,
    /// Names for a column, a block of columns, a lane, the terms of all columns and the sums of the lanes.
    pub names: [Ident; 5],
    /// The functions.
    pub groups: Vec<Group<Ident, Span>>,
    /// What the slopes begin with, as many a row as the rows are apart.
    pub base: Option<MatrixStorage>,
    /// Where the slopes go.
    pub slopes: MatrixStorage,
    /// Number of columns with a slope.
    pub n_slopes: usize,
    /// What is added to the lanes' total.
    pub start: Expr,
    /// Where the sum goes.
    pub sum: Expr,
}

impl Row {
    /// Runs of blocks of [`LANES`] columns, one after the other, whose columns have terms alike.
    pub(crate) fn runs(&self) -> Vec<Range<usize>> {
        let ends = self.groups.iter().map(|group| group.values.len);
        let mut ends: Vec<usize> = ends
            .chain(self.base.iter().map(|base| base.stride))
            .collect();
        ends.sort_unstable();
        ends.dedup();
        let begins = std::iter::once(0).chain(ends.iter().copied());
        let runs = begins.zip(&ends);
        runs.map(|(from, to)| from / LANES..to / LANES).collect()
    }

    /// The term of a column of a run, where its slope goes, and its slope.
    pub(crate) fn column(&self, run: &Range<usize>, at: &Index) -> [Expr; 3] {
        let from = LANES * run.start;
        let base = self.base.as_ref().filter(|base| base.stride > from);
        let mut slope = base.map(|base| base.element(&self.row, at));
        let mut term = None;
        for group in self.groups.iter().filter(|group| group.values.len > from) {
            let entry = || Expr::Entry(group.table.clone(), Index::variable(&self.row), at.clone());
            let times = |span: &Span| {
                let element = Expr::Element(span.array.clone(), at.clone().shifted(span.offset));
                Expr::infix(Binary::Mul, entry(), element)
            };
            term = Some(joined(term, Binary::Add, times(&group.values)));
            slope = Some(match &group.slopes {
                Slopes::One => joined(slope, Binary::Add, entry()),
                Slopes::Plus(span) => joined(slope, Binary::Add, times(span)),
                Slopes::Minus(span) => joined(slope, Binary::Sub, times(span)),
            });
        }
        let target = self.slopes.element(&self.row, at);
        let invariant = "one group has a part in every column";
        [term.expect(invariant), target, slope.expect(invariant)]
    }

    /// Statements that take column after column, then add what the lanes would.
    pub(crate) fn in_columns(&self) -> Vec<Stmt> {
        let [column, _, lane, terms, sums] = &self.names;
        let width = self.n_slopes.next_multiple_of(LANES);
        // Without lanes arrays are declared as zeros, also behind the last column.
        let mut body = vec![Stmt::Declare(terms.clone(), width)];
        for run in self.runs() {
            let (first, end) = (LANES * run.start, LANES * run.end);
            let at = Index::variable(column).shifted(first);
            let [term, target, slope] = self.column(&run, &at);
            let term = Stmt::Assign(Expr::Element(terms.clone(), at), term);
            let n = end.min(self.n_slopes) - first;
            let columns = vec![Stmt::Assign(target, slope), term];
            body.push(Stmt::For(column.clone(), n, columns));
        }
        let lane_sum = (0..width / LANES)
            .map(|k| Expr::Element(terms.clone(), Index::variable(lane).shifted(LANES * k)))
            .reduce(|sum, term| Expr::infix(Binary::Add, sum, term));
        let p = |index: Index| Expr::Element(sums.clone(), index);
        let lane_sum = lane_sum.expect("a row has columns");
        let assign = Stmt::Assign(p(Index::variable(lane)), lane_sum);
        body.push(Stmt::Declare(sums.clone(), LANES));
        body.push(Stmt::For(lane.clone(), LANES, vec![assign]));
        let pair = |a: Expr, b: Expr| Expr::infix(Binary::Add, a, b);
        let half = |l: usize| pair(p(Index::fixed(l)), p(Index::fixed(l + LANES / 2)));
        let total = pair(pair(half(0), half(2)), pair(half(1), half(3)));
        let total = Expr::infix(Binary::Add, self.start.clone(), total);
        body.push(Stmt::Assign(self.sum.clone(), total));
        body
    }
}

/// `a op b`, or `b` alone (negated for a difference) if there is no `a`.
fn joined(a: Option<Expr>, op: Binary, b: Expr) -> Expr {
    match (a, op) {
        (Some(a), op) => Expr::infix(op, a, b),
        (None, Binary::Sub) => Expr::Unary(Unary::Neg, Box::new(b)),
        (None, Binary::Add | Binary::Mul | Binary::Div | Binary::Pow) => b,
    }
}
