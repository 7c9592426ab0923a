//! Sparse Jacobians and Hessians.

use super::node::{ExprId, SymbolId};
use super::pool::ExprPool;

/// A structural nonzero of a matrix of expressions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MatrixEntry {
    /// Row, from 0.
    pub row: usize,
    /// Column, from 0.
    pub column: usize,
    /// What stands there; never the exact zero.
    pub value: ExprId,
}

impl ExprPool {
    /// The structural nonzeros of `d outputs / d symbols` in row-major order: row `i` belongs to
    /// `outputs[i]`, column `j` to `symbols[j]`.
    pub fn jacobian(&mut self, outputs: &[ExprId], symbols: &[SymbolId]) -> Vec<MatrixEntry> {
        let mut entries = Vec::new();
        for (row, &output) in outputs.iter().enumerate() {
            for (column, &symbol) in symbols.iter().enumerate() {
                let value = self.derivative(output, symbol);
                if value != ExprId::ZERO {
                    entries.push(MatrixEntry { row, column, value });
                }
            }
        }
        entries
    }

    /// The structural nonzeros of the lower triangle (`column <= row`) of
    /// `d^2 output / d symbols^2`, in row-major order. The matrix is symmetric.
    pub fn hessian(&mut self, output: ExprId, symbols: &[SymbolId]) -> Vec<MatrixEntry> {
        let mut entries = Vec::new();
        for (row, &symbol) in symbols.iter().enumerate() {
            let slope = self.derivative(output, symbol);
            for (column, &other) in symbols[..=row].iter().enumerate() {
                let value = self.derivative(slope, other);
                if value != ExprId::ZERO {
                    entries.push(MatrixEntry { row, column, value });
                }
            }
        }
        entries
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(pool: &ExprPool, entries: &[MatrixEntry]) -> Vec<(usize, usize, String)> {
        entries
            .iter()
            .map(|entry| {
                (
                    entry.row,
                    entry.column,
                    pool.display(entry.value).to_string(),
                )
            })
            .collect()
    }

    #[test]
    fn jacobian_lists_structural_nonzeros_by_row() {
        let mut pool = ExprPool::new();
        let outputs = ["x^2 + 3*y", "7", "sin(y)*x"]
            .map(|text| pool.parse(text, &|_| true).expect("test text parses"));
        let symbols = ["x", "w", "y"].map(|name| pool.symbol_id(name));
        let entries = pool.jacobian(&outputs, &symbols);
        assert_eq!(
            texts(&pool, &entries),
            [
                (0, 0, "2*x".to_owned()),
                (0, 2, "3".to_owned()),
                (2, 0, "sin(y)".to_owned()),
                (2, 2, "x*cos(y)".to_owned()),
            ]
        );
    }

    #[test]
    fn hessian_gives_the_lower_triangle() {
        let mut pool = ExprPool::new();
        let output = pool
            .parse("x^2*y + exp(y)", &|_| true)
            .expect("test text parses");
        let symbols = ["x", "y"].map(|name| pool.symbol_id(name));
        let entries = pool.hessian(output, &symbols);
        assert_eq!(
            texts(&pool, &entries),
            [
                (0, 0, "2*y".to_owned()),
                (1, 0, "2*x".to_owned()),
                (1, 1, "exp(y)".to_owned()),
            ]
        );
    }
}
