//! How long equations are, and what they depend on.

use super::error::SimplifyError;
use crate::ir::{Program, Statement};
use crate::lower::{self, Form, LowerOptions};
use crate::model::{LatentVariable, ReducedModel};

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
pub(super) fn operations(model: &ReducedModel, phase: usize) -> Result<usize, SimplifyError> {
    let options = LowerOptions {
        form: Form::StraightLine,
    };
    let program: Program = lower::dynamics(model, phase, &options)?;
    let counted = program.statements().iter().enumerate();
    Ok(counted
        .map(|(index, statement)| match statement {
            Statement::Constant(_) | Statement::Input { .. } | Statement::Constants { .. } => 0,
            _ => program.values_of(index).len(),
        })
        .sum())
}

/// The variables that any `ddz` of a phase depends on, in the order of [`LatentVariable::all`].
pub(super) fn variables(model: &ReducedModel, phase: usize) -> Vec<LatentVariable> {
    let (library, xi) = (model.library(), &model.phases()[phase].xi);
    let active = (library.terms().iter().enumerate())
        .filter(|(row, _)| xi.row(*row).iter().any(|&coefficient| coefficient != 0.0));
    let symbols: Vec<_> = active
        .flat_map(|(_, term)| library.pool().symbols_of(term.expr()))
        .collect();
    let acts = |variable: &LatentVariable| {
        library
            .symbol(*variable)
            .is_some_and(|symbol| symbols.contains(&symbol))
    };
    LatentVariable::all(model.latent_dim())
        .filter(acts)
        .collect()
}
