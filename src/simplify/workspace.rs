//! The terms of equations, with those that they may be rewritten to.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::DMatrix;

use super::domain::SimplifyError;
use super::ranges::Ranges;
use crate::equations::Equations;
use crate::model::{LatentVariable, Library, ModelError, ReducedModel};
use crate::symbolic::{ExprId, ExprPool, Interval, Node, SymbolId};

#[derive(Clone, Debug)]
pub(super) struct Workspace {
    library: Library,
    /// Number of the equations' own terms; the others are appended.
    original: usize,
    rows: BTreeMap<Option<SymbolId>, usize>,
}

impl Workspace {
    /// The terms of `equations`, extended by `1` and by every variable of those summands that are not affine. Where
    /// these would be too many for a library, nothing is appended.
    pub(crate) fn new(equations: &Equations<'_>) -> Result<Self, ModelError> {
        let own = equations.terms();
        let mut texts: Vec<String> = own.iter().map(|term| term.text().to_owned()).collect();
        let mut pool = equations.pool().clone();
        let known: BTreeSet<ExprId> = own.iter().map(|term| term.expr()).collect();
        for text in wanted(equations) {
            let expr = pool
                .parse(&text, &|_| true)
                .expect("constants and variables parse");
            if !known.contains(&expr) {
                texts.push(text);
            }
        }
        let dim = equations.latent_dim();
        let library = Library::from_terms(dim, &texts)
            .or_else(|_| Library::from_terms(dim, &texts[..own.len()]))?;
        Ok(Self {
            original: own.len(),
            rows: rows(&library),
            library,
        })
    }

    pub(crate) fn len(&self) -> usize {
        self.library.len()
    }

    pub(crate) fn library(&self) -> &Library {
        &self.library
    }

    pub(crate) fn text(&self, row: usize) -> &str {
        self.library.terms()[row].text()
    }

    pub(crate) fn variable(&self, symbol: SymbolId) -> Option<usize> {
        self.rows.get(&Some(symbol)).copied()
    }

    pub(crate) fn constant(&self) -> Option<usize> {
        self.rows.get(&None).copied()
    }

    pub(crate) fn ranges(&self, domain: &[Interval]) -> Ranges {
        let variables = LatentVariable::all(self.library.latent_dim());
        let symbols = variables.filter_map(|variable| self.library.symbol(variable));
        let terms = self.library.terms().iter().map(|term| term.expr());
        Ranges::new(
            self.library.pool().clone(),
            symbols.zip(domain.iter().copied()).collect(),
            terms.collect(),
        )
    }

    /// The coefficients of a phase with zeros for the appended terms, one row per term.
    pub(crate) fn coefficients(&self, equations: &Equations<'_>, phase: usize) -> DMatrix<f64> {
        let added = self.len() - self.original;
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
            .chain((self.original..self.len()).filter(used))
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

/// The rows of variables, and of the constant under none.
fn rows(library: &Library) -> BTreeMap<Option<SymbolId>, usize> {
    let of = |expr| match library.pool().as_symbol(expr) {
        None if expr == ExprId::ONE => Some(None),
        symbol => symbol.map(Some),
    };
    let terms = library.terms().iter().enumerate();
    terms
        .filter_map(|(row, term)| Some((of(term.expr())?, row)))
        .collect()
}

fn wanted(equations: &Equations<'_>) -> Vec<String> {
    let pool = equations.pool();
    let phases = equations.phases().iter();
    let summands = phases.flat_map(|phase| &phase.ddz).flatten();
    let active: BTreeSet<usize> = summands.map(|summand| summand.term).collect();
    let mut texts = vec!["1".to_owned()];
    for term in active.into_iter().map(|term| &equations.terms()[term]) {
        if pool.as_symbol(term.expr()).is_some() {
            continue;
        }
        let symbols = pool.symbols_of(term.expr());
        let names = symbols.iter().map(|&symbol| pool.symbol_name(symbol));
        texts.extend(names.map(str::to_owned));
    }
    let mut seen = BTreeSet::new();
    texts.retain(|text| seen.insert(text.clone()));
    texts
}

/// Whether an expression calls an elementary function, or has a power that is not a whole number.
pub(super) fn has_function(pool: &ExprPool, expr: ExprId) -> bool {
    (pool.reachable(&[expr]).into_iter()).any(|part| match pool.node(part) {
        Node::Apply(_, _) => true,
        Node::Power(_, exponent) => pool.as_integer(*exponent).is_none(),
        Node::Number(_) | Node::Symbol(_) | Node::Sum(_) | Node::Product(_) => false,
    })
}
