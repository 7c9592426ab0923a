//! The model's library with the terms that others may be rewritten to.

use std::collections::BTreeMap;

use nalgebra::DMatrix;

use super::error::SimplifyError;
use super::ranges::Ranges;
use crate::model::{LatentVariable, Library, LibraryError, ReducedModel};
use crate::symbolic::{ExprId, ExprPool, Interval, Node, SymbolId};

/// Rows of the terms `1`, `z1`, `z1^2` and so on, in a library that has them.
#[derive(Clone, Debug)]
pub(super) struct Workspace {
    library: Library,
    /// Number of the model's own terms; the others are appended.
    original: usize,
    constant: Option<usize>,
    linear: BTreeMap<SymbolId, usize>,
    squares: BTreeMap<SymbolId, usize>,
}

impl Workspace {
    /// The library of `model`, extended by `1`, by every variable of its active terms that are not
    /// affine, and by the squares of variables that such a term takes a function of.
    ///
    /// # Errors
    /// [`LibraryError`] if the model's own terms are refused, which a model excludes.
    pub fn new(model: &ReducedModel) -> Result<Self, LibraryError> {
        let own = model.library();
        let mut texts: Vec<String> = (own.terms().iter())
            .map(|term| term.text().to_owned())
            .collect();
        let mut pool = own.pool().clone();
        let known: Vec<ExprId> = own.terms().iter().map(|term| term.expr()).collect();
        for text in wanted(model) {
            let expr = pool
                .parse(&text, &|_| true)
                .expect("constants, variables and their squares parse");
            if !known.contains(&expr) {
                texts.push(text);
            }
        }
        let library = match Library::from_terms(own.latent_dim(), &texts) {
            Ok(extended) => extended,
            Err(LibraryError::TooManyTerms { .. }) => own.clone(),
            Err(error) => return Err(error),
        };
        let mut workspace = Self {
            original: own.len(),
            library,
            constant: None,
            linear: BTreeMap::new(),
            squares: BTreeMap::new(),
        };
        workspace.find_rows();
        Ok(workspace)
    }

    fn find_rows(&mut self) {
        let mut pool = self.library.pool().clone();
        let one = pool.number(1.0);
        let variables = LatentVariable::all(self.library.latent_dim());
        let symbols: Vec<SymbolId> = variables
            .filter_map(|variable| self.library.symbol(variable))
            .collect();
        let mut linear = BTreeMap::new();
        let mut squares = BTreeMap::new();
        for symbol in symbols {
            let expr = pool.symbol_expr(symbol);
            linear.insert(expr, symbol);
            squares.insert(pool.powi(expr, 2), symbol);
        }
        for (row, term) in self.library.terms().iter().enumerate() {
            if term.expr() == one {
                self.constant = Some(row);
            }
            if let Some(&symbol) = linear.get(&term.expr()) {
                self.linear.insert(symbol, row);
            }
            if let Some(&symbol) = squares.get(&term.expr()) {
                self.squares.insert(symbol, row);
            }
        }
    }

    /// Number of terms.
    pub fn len(&self) -> usize {
        self.library.len()
    }

    /// The library with the appended terms.
    pub fn library(&self) -> &Library {
        &self.library
    }

    /// The text of a term.
    pub fn text(&self, row: usize) -> &str {
        self.library.terms()[row].text()
    }

    /// The row of `1`.
    pub fn constant(&self) -> Option<usize> {
        self.constant
    }

    /// The row of a variable itself.
    pub fn linear(&self, symbol: SymbolId) -> Option<usize> {
        self.linear.get(&symbol).copied()
    }

    /// The row of a variable's square.
    pub fn square(&self, symbol: SymbolId) -> Option<usize> {
        self.squares.get(&symbol).copied()
    }

    /// Ranges over a box, `3 latent_dim` intervals.
    pub fn ranges(&self, domain: &[Interval]) -> Ranges {
        let variables = LatentVariable::all(self.library.latent_dim());
        let symbols = variables.filter_map(|variable| self.library.symbol(variable));
        let terms = self.library.terms().iter().map(|term| term.expr());
        Ranges::new(
            self.library.pool().clone(),
            symbols.zip(domain.iter().copied()).collect(),
            terms.collect(),
        )
    }

    /// Xi of a phase with zeros for the appended terms.
    pub fn xi(&self, model: &ReducedModel, phase: usize) -> DMatrix<f64> {
        let added = self.len() - self.original;
        let xi = model.phases()[phase].xi.clone();
        xi.insert_rows(self.original, added, 0.0)
    }

    /// The model with these coefficients, one matrix per phase. Appended terms that no phase uses are
    /// left out, so that a model keeps its library where it can.
    ///
    /// # Errors
    /// [`SimplifyError::Model`] if a coefficient is not finite.
    pub fn finish(
        &self,
        model: &ReducedModel,
        xi: &[DMatrix<f64>],
    ) -> Result<ReducedModel, SimplifyError> {
        let used = |row: &usize| xi.iter().any(|xi| xi.row(*row).iter().any(|&c| c != 0.0));
        let added: Vec<usize> = (self.original..self.len()).filter(used).collect();
        let rows: Vec<usize> = (0..self.original).chain(added.iter().copied()).collect();
        let library = if added.is_empty() {
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
        let builder = model.clone().into_builder();
        Ok(builder.library(library).phases(phases).build()?)
    }
}

/// Texts of the terms that rewriting may need.
fn wanted(model: &ReducedModel) -> Vec<String> {
    let library = model.library();
    let pool = library.pool();
    let mut texts = vec!["1".to_owned()];
    for (row, term) in library.terms().iter().enumerate() {
        let is_active = model.phases().iter().any(|phase| {
            let coefficients = phase.xi.row(row);
            coefficients.iter().any(|&c| c != 0.0)
        });
        if !is_active || pool.as_symbol(term.expr()).is_some() {
            continue;
        }
        let symbols = pool.symbols_of(term.expr());
        let names = symbols.iter().map(|&symbol| pool.symbol_name(symbol));
        texts.extend(names.map(str::to_owned));
        if symbols.len() == 1 && has_function(pool, term.expr()) {
            let names = symbols.iter().map(|&symbol| pool.symbol_name(symbol));
            texts.extend(names.map(|name| format!("{name}^2")));
        }
    }
    let mut seen = std::collections::BTreeSet::new();
    texts.retain(|text| seen.insert(text.clone()));
    texts
}

/// Whether an expression calls an elementary function, or has a power that is not a whole number.
pub(super) fn has_function(pool: &ExprPool, expr: ExprId) -> bool {
    (pool.reachable(&[expr]).into_iter()).any(|part| match pool.node(part) {
        Node::Apply(_, _) => true,
        Node::Power(_, exponent) => pool
            .as_number(*exponent)
            .and_then(|n| n.as_integer())
            .is_none(),
        Node::Number(_) | Node::Symbol(_) | Node::Sum(_) | Node::Product(_) => false,
    })
}
