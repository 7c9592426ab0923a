//! One row of a matrix of functions: its sum and its slopes, column by column or in lanes.

use std::ops::Range;

use super::code::{Expr, Index, Stmt};
use super::ident::Ident;
use crate::ir::{Binary, LANES};

/// One row of [`Statement::Separable`](crate::ir::Statement); expressions are in terms of the variable
/// `column`.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The variable for a column.
    pub column: Ident,
    /// Names for a block of columns, a lane, the terms of all columns and the sums of the lanes.
    pub names: [Ident; 4],
    /// Runs of blocks whose columns have terms alike, one after the other.
    pub runs: Vec<Run>,
    /// The array that the slopes go to.
    pub slopes: Ident,
    /// Where in it the slope of a column goes.
    pub slope_at: Index,
    /// Number of columns with a slope.
    pub n_slopes: usize,
    /// What is added to the lanes' total.
    pub start: Expr,
    /// Where the sum goes.
    pub sum: Expr,
}

/// Blocks of [`LANES`] columns whose terms are alike.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// The blocks.
    pub blocks: Range<usize>,
    /// A column's term of the sum.
    pub term: Expr,
    /// A column's slope.
    pub slope: Expr,
}

impl Row {
    /// Where the slope of a column goes, and what it is.
    pub fn slope(&self, run: &Run, at: &Index) -> [Expr; 2] {
        let place = self.slope_at.with(&self.column, at);
        let target = Expr::Element(self.slopes.clone(), place);
        [target, run.slope.with(&self.column, at)]
    }

    /// Statements that take column after column, then add what the lanes would.
    pub fn in_columns(&self) -> Vec<Stmt> {
        let [_, lane, terms, sums] = &self.names;
        let width = self.n_slopes.next_multiple_of(LANES);
        // Without lanes arrays are declared as zeros, also behind the last column.
        let mut body = vec![Stmt::Declare(terms.clone(), width)];
        for run in &self.runs {
            let (first, end) = (LANES * run.blocks.start, LANES * run.blocks.end);
            let at = Index::variable(&self.column).shifted(first);
            let term = Expr::Element(terms.clone(), at.clone());
            let [target, slope] = self.slope(run, &at);
            let columns = vec![
                Stmt::Assign(target, slope),
                Stmt::Assign(term, run.term.with(&self.column, &at)),
            ];
            let n = end.min(self.n_slopes) - first;
            body.push(Stmt::For(self.column.clone(), n, columns));
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
