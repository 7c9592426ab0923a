//! The terms of equations, with those that they may be rewritten to.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::DMatrix;

use super::domain::SimplifyError;
use crate::equations::Equations;
use crate::model::{Library, ModelError, ReducedModel};
use crate::symbolic::{ExprId, ExprPool, Node, SymbolId};

#[derive(Clone, Debug)]
pub(super) struct Workspace {
    pub library: Library,
    /// Number of the equations' own terms; the others are appended.
    original: usize,
    /// The rows of variables, and of the constant under none.
    pub rows: BTreeMap<Option<SymbolId>, usize>,
}

impl Workspace {
    /// The terms of `equations`, extended by `1` and by every variable of those summands that are not affine. Where
    /// these would be too many for a library, nothing is appended.
    pub(crate) fn new(equations: &Equations<'_>) -> Result<Self, ModelError> {
        let own = equations.terms();
        let mut texts: Vec<String> = own.iter().map(|term| term.text().to_owned()).collect();
        let known: BTreeSet<ExprId> = own.iter().map(|term| term.expr()).collect();
        let wanted = wanted(equations).into_iter();
        texts.extend(
            wanted
                .filter(|(expr, _)| !known.contains(expr))
                .map(|(_, text)| text),
        );
        let dim = equations.latent_dim();
        let library = Library::from_terms(dim, &texts)
            .or_else(|_| Library::from_terms(dim, &texts[..own.len()]))?;
        let of = |expr| match library.pool().as_symbol(expr) {
            None if expr == ExprId::ONE => Some(None),
            symbol => symbol.map(Some),
        };
        let terms = library.terms().iter().enumerate();
        let rows = terms.filter_map(|(row, term)| Some((of(term.expr())?, row)));
        Ok(Self {
            original: own.len(),
            rows: rows.collect(),
            library,
        })
    }

    pub(crate) fn text(&self, row: usize) -> &str {
        self.library.terms()[row].text()
    }

    pub(crate) fn constant(&self) -> Option<usize> {
        self.rows.get(&None).copied()
    }

    /// The coefficients of a phase with zeros for the appended terms, one row per term.
    pub(crate) fn coefficients(&self, equations: &Equations<'_>, phase: usize) -> DMatrix<f64> {
        let added = self.library.len() - self.original;
        let own = equations.coefficients(phase);
        own.insert_rows(self.original, added, 0.0)
    }

    /// A model of these coefficients, one matrix per phase. Appended terms that no phase uses are left out, so that a
    /// model keeps its library where it can.
    pub(crate) fn finish(
        &self,
        model: ReducedModel,
        xi: &[DMatrix<f64>],
    ) -> Result<ReducedModel, SimplifyError> {
        let used = |row: &usize| xi.iter().any(|xi| xi.row(*row).iter().any(|&c| c != 0.0));
        let rows: Vec<usize> = (0..self.original)
            .chain((self.original..self.library.len()).filter(used))
            .collect();
        let library = if rows.len() == self.original {
            model.library().clone()
        } else {
            let texts: Vec<String> = rows.iter().map(|&row| self.text(row).to_owned()).collect();
            Library::from_terms(model.latent_dim(), &texts)?
        };
        let phases = (model.phases().iter().zip(xi))
            .map(|(phase, xi)| crate::model::Phase {
                xi: xi.select_rows(&rows),
                ..phase.clone()
            })
            .collect();
        let builder = model.into_builder();
        Ok(builder.library(library).phases(phases).build()?)
    }
}

/// `1` and every variable of the terms in use that are no variables themselves, with their texts.
fn wanted(equations: &Equations<'_>) -> Vec<(ExprId, String)> {
    let pool = equations.pool();
    let phases = equations.phases().iter();
    let summands = phases.flat_map(|phase| &phase.ddz).flatten();
    let active: BTreeSet<usize> = summands.map(|summand| summand.term).collect();
    let mut wanted = vec![(ExprId::ONE, "1".to_owned())];
    for term in active.into_iter().map(|term| &equations.terms()[term]) {
        if pool.as_symbol(term.expr()).is_none() {
            let symbols = pool.symbols_of(term.expr()).into_iter();
            wanted.extend(symbols.map(|s| (pool.symbol_expr(s), pool.symbol_name(s).to_owned())));
        }
    }
    let mut seen = BTreeSet::new();
    wanted.retain(|(expr, _)| seen.insert(*expr));
    wanted
}

/// Whether an expression calls an elementary function, or has a power that is not a whole number.
pub(super) fn has_function(pool: &ExprPool, expr: ExprId) -> bool {
    (pool.reachable(&[expr]).into_iter()).any(|part| match pool.node(part) {
        Node::Apply(_, _) => true,
        Node::Power(_, exponent) => pool.as_integer(*exponent).is_none(),
        Node::Number(_) | Node::Symbol(_) | Node::Sum(_) | Node::Product(_) => false,
    })
}
