//! How long equations are, and what they depend on.

use std::collections::BTreeSet;

use super::error::SimplifyError;
use crate::equations::Equations;
use crate::ir::{Program, Statement};
use crate::lower::{self, Form};
use crate::model::LatentVariable;
use crate::symbolic::SymbolId;

/// Significant decimal digits of the shortest texts that read back as the coefficients.
pub(super) fn digits(xi: &[f64]) -> usize {
    let active = xi.iter().filter(|&&coefficient| coefficient != 0.0);
    let of = |coefficient: &f64| {
        let text = format!("{coefficient:e}");
        let mantissa = text.split('e').next().unwrap_or_default();
        mantissa.chars().filter(char::is_ascii_digit).count()
    };
    active.map(of).sum()
}

/// Operations of the straight-line code of `ddz`.
pub(super) fn operations(system: &Equations<'_>, phase: usize) -> Result<usize, SimplifyError> {
    let program: Program = lower::dynamics(system, phase, Form::StraightLine)?;
    let counted = program.statements().iter().enumerate();
    Ok(counted
        .map(|(index, statement)| match statement {
            Statement::Constant(_) | Statement::Input { .. } | Statement::Constants { .. } => 0,
            _ => program.values_of(index).len(),
        })
        .sum())
}

/// The variables that any `ddz` of a phase depends on, in the order of [`LatentVariable::all`].
pub(super) fn variables(system: &Equations<'_>, phase: usize) -> Vec<LatentVariable> {
    let summands = system.phases()[phase].ddz.iter().flatten();
    let terms: BTreeSet<usize> = summands.map(|summand| summand.term).collect();
    let symbols: BTreeSet<SymbolId> = (terms.into_iter())
        .flat_map(|term| system.pool().symbols_of(system.terms()[term].expr()))
        .collect();
    LatentVariable::all(system.latent_dim())
        .filter(|variable| symbols.contains(&system.symbol(*variable)))
        .collect()
}
