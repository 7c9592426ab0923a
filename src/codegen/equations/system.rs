//! The accelerations of all phases as sums of coefficients times expressions.

use std::borrow::Cow;

use nalgebra::DMatrix;

use super::exact::ExactStep;
use super::physical::LatentUnits;
use crate::model::{
    CandidateTerm, FeetRule, LatentVariable, Library, ModelError, Phase, ReducedModel,
};
use crate::symbolic::{ExprId, ExprPool, SymbolId};

/// One summand of an equation: `coefficient * terms[term]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Summand {
    /// The factor, finite and not zero; scaled units.
    pub coefficient: f64,
    /// Index into [`Equations::terms`].
    pub term: usize,
}

/// The accelerations of one phase.
#[derive(Clone, Debug, PartialEq)]
pub struct PhaseEquations {
    /// Name, such as `contact`.
    pub name: String,
    /// Foot patterns that select the phase.
    pub feet: FeetRule,
    /// The right-hand sides `ddz1`, `ddz2` and so on; terms are distinct and in ascending order.
    pub ddz: Vec<Vec<Summand>>,
}

/// `ddz = Xi^T Theta(z, dz, u_lat)` of all phases of a model, with the model whose maps, names and
/// scale factors belong to it.
#[derive(Clone)]
pub struct Equations<'a> {
    pub(super) model: Cow<'a, ReducedModel>,
    pub(super) pool: ExprPool,
    pub(super) terms: Vec<CandidateTerm>,
    pub(super) phases: Vec<PhaseEquations>,
    pub(super) steps: Vec<ExactStep>,
    /// The units of equations in physical units, and what these were made from.
    pub(super) physical: Option<(LatentUnits, Box<Equations<'static>>)>,
}

impl<'a> Equations<'a> {
    /// The equations of a model as they are printed and emitted unless asked otherwise: in the shortest equal
    /// form that is found.
    pub fn of(model: &'a ReducedModel) -> Self {
        Self::as_learned(model).simplified()
    }

    /// Coefficients times candidate terms exactly as the model has them.
    pub fn as_learned(model: &'a ReducedModel) -> Self {
        let phases = model.phases().iter().map(|phase| PhaseEquations {
            name: phase.name.clone(),
            feet: phase.feet.clone(),
            ddz: (0..model.latent_dim())
                .map(|output| {
                    let active = phase.active_terms(output);
                    active
                        .map(|(term, coefficient)| Summand { coefficient, term })
                        .collect()
                })
                .collect(),
        });
        Self {
            pool: model.library().pool().clone(),
            terms: model.library().terms().to_vec(),
            phases: phases.collect(),
            model: Cow::Borrowed(model),
            steps: Vec::new(),
            physical: None,
        }
    }

    /// What exact simplification did, in the order of phases and equations.
    pub fn steps(&self) -> &[ExactStep] {
        &self.steps
    }

    /// A model whose Xi and library are these equations: the one they were made from if nothing
    /// was simplified.
    ///
    /// # Errors
    /// [`ModelError::Invalid`] if new terms make the library too large.
    pub fn to_model(&self) -> Result<Cow<'_, ReducedModel>, ModelError> {
        if self.steps.is_empty() {
            return Ok(Cow::Borrowed(&self.model));
        }
        let texts: Vec<String> = (self.terms.iter())
            .map(|term| term.text().to_owned())
            .collect();
        let phases = self.model.phases().iter().enumerate();
        let phases = phases.map(|(index, phase)| Phase {
            xi: self.coefficients(index),
            ..phase.clone()
        });
        let builder = self.model.clone().into_owned().into_builder();
        let builder = builder.library(Library::from_terms(self.latent_dim(), &texts)?);
        Ok(Cow::Owned(builder.phases(phases.collect()).build()?))
    }

    /// The same with all parts of terms that have no variable computed in double precision: `exp(100)` may be beyond
    /// what generated code computes with, its product with a coefficient not.
    #[must_use]
    pub fn with_constants_folded(mut self) -> Self {
        let exprs: Vec<ExprId> = self.terms.iter().map(CandidateTerm::expr).collect();
        let folded = self.pool.fold_constants(&exprs);
        for (term, expr) in self.terms.iter_mut().zip(folded) {
            *term = CandidateTerm::new(term.text().to_owned(), expr);
        }
        self
    }

    /// The same equations with a model of their own.
    pub(crate) fn into_owned(self) -> Equations<'static> {
        Equations {
            model: Cow::Owned(self.model.into_owned()),
            pool: self.pool,
            terms: self.terms,
            phases: self.phases,
            steps: self.steps,
            physical: self.physical,
        }
    }

    /// These equations in the scaled units of the model's maps, whose latent inputs are those of `W_e`: what a
    /// controller computes with.
    pub fn in_scaled_units(&self) -> &Equations<'_> {
        match &self.physical {
            Some((_, scaled)) => scaled,
            None => self,
        }
    }

    /// Units of latent coordinates and inputs, if they are physical; none where they are scaled.
    pub fn latent_units(&self) -> Option<&LatentUnits> {
        self.physical.as_ref().map(|(units, _)| units)
    }

    /// The model with maps, names and scale factors; its Xi may be that of equal, longer equations.
    pub fn model(&self) -> &ReducedModel {
        &self.model
    }

    /// Number of latent coordinates.
    pub fn latent_dim(&self) -> usize {
        self.model.latent_dim()
    }

    /// The pool of the terms. Clone it to build on them: ids stay valid in the clone.
    pub fn pool(&self) -> &ExprPool {
        &self.pool
    }

    /// The distinct terms in the order in which they are printed; a term may be unused.
    pub fn terms(&self) -> &[CandidateTerm] {
        &self.terms
    }

    /// All phases, in the model's order.
    pub fn phases(&self) -> &[PhaseEquations] {
        &self.phases
    }

    /// The phase with this index.
    ///
    /// # Errors
    /// [`ModelError::PhaseIndex`].
    pub fn phase(&self, phase: usize) -> Result<&PhaseEquations, ModelError> {
        self.phases.get(phase).ok_or(ModelError::PhaseIndex {
            found: phase,
            count: self.phases.len(),
        })
    }

    /// The symbol in the pool of a variable whose index is below `latent_dim`.
    pub fn symbol(&self, variable: LatentVariable) -> SymbolId {
        let symbol = self.model.library().symbol(variable);
        symbol.expect("variables up to latent_dim are in the library's pool")
    }

    /// The coefficients of an existing phase as a matrix, one row per term, one column per acceleration.
    pub fn coefficients(&self, phase: usize) -> DMatrix<f64> {
        let mut xi = DMatrix::zeros(self.terms.len(), self.latent_dim());
        for (output, equation) in self.phases[phase].ddz.iter().enumerate() {
            for summand in equation {
                xi[(summand.term, output)] = summand.coefficient;
            }
        }
        xi
    }
}

impl PhaseEquations {
    /// The summands of one acceleration, as coefficients and terms of `equations`.
    pub fn summands<'e>(
        &'e self,
        equations: &'e Equations<'_>,
        output: usize,
    ) -> impl Iterator<Item = (f64, &'e CandidateTerm)> + 'e {
        let terms = equations.terms();
        (self.ddz[output].iter()).map(|summand| (summand.coefficient, &terms[summand.term]))
    }

    /// Number of summands of all accelerations.
    pub fn active_count(&self) -> usize {
        self.ddz.iter().map(Vec::len).sum()
    }
}
