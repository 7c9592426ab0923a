//! From equations as text to library and coefficients.

use std::collections::HashMap;

use nalgebra::DMatrix;

use super::ImportError;
use super::assemble::Parts;
use super::equations::{Equation, Section, Sections};
use super::library;
use super::options::{ImportOptions, PhaseRule};
use super::report::{ImportReport, ReadEquation};
use super::terms::{self, Coefficients};
use crate::model::{Library, Phase};
use crate::symbolic::{ExprId, ExprPool};

/// Makes the parts of a model out of equations, with the decisions about each.
///
/// Without a library in the options, the library is the union of the terms found.
pub(super) fn parts(
    file: &str,
    sections: &Sections,
    options: &ImportOptions,
) -> Result<(Parts, ImportReport), ImportError> {
    let latent_dim = sections.latent_dim;
    check_options(latent_dim, options)?;
    let ordered = phases_in_order(file, sections, options)?;
    let given = (options.library.as_ref())
        .map(|choice| library::build(file, choice, latent_dim))
        .transpose()?;
    let pool = given.as_ref().map(|library| library.pool().clone());
    let mut pool = pool.unwrap_or_default();
    let known = given.as_ref().map(rows_of).unwrap_or_default();
    let mut separated: Vec<Vec<Coefficients>> = Vec::new();
    for (_, section) in &ordered {
        let equations = section.equations.iter();
        let columns =
            equations.map(|equation| separate(file, latent_dim, equation, &mut pool, &known));
        separated.push(columns.collect::<Result<_, _>>()?);
    }
    let (library, rows) = match given {
        Some(library) => (library, known),
        None => union(file, latent_dim, &pool, &separated)?,
    };
    let (mut phases, mut report) = (Vec::new(), ImportReport::default());
    for ((rule, section), columns) in ordered.into_iter().zip(&separated) {
        let PhaseRule { name, feet } = rule;
        report.notes.extend(options.usual_feet(&name, &feet));
        for (equation, coefficients) in section.equations.iter().zip(columns) {
            report.equations.push(ReadEquation {
                phase: name.clone(),
                output: format!("ddz{}", equation.output + 1),
                line: equation.line,
                terms: coefficients.len(),
            });
        }
        let mut xi = DMatrix::zeros(library.len(), latent_dim);
        for (column, coefficients) in columns.iter().enumerate() {
            for (term, coefficient) in coefficients {
                let row = &rows[term];
                xi[(row.index, column)] = coefficient.to_f64() / row.factor;
            }
        }
        phases.push(Phase { name, feet, xi });
    }
    let parts = Parts {
        library,
        phases,
        encoder: None,
        decoder: None,
        scaling: options.scaling.clone(),
        statistics: Vec::new(),
    };
    Ok((parts, report))
}

/// A row of Xi, and the number in front of its term in the library (`2` for `2*z1`).
#[derive(Clone, Copy, Debug)]
struct Row {
    index: usize,
    factor: f64,
}

fn check_options(latent_dim: usize, options: &ImportOptions) -> Result<(), ImportError> {
    if let Some(given) = options.latent_dim.filter(|given| *given != latent_dim) {
        let expected = format!("{latent_dim}, as the equations have");
        let found = given.to_string();
        return Err(ImportError::option("--latent-dim", found, expected));
    }
    let given = [
        ("--map", !options.mapping.is_empty()),
        ("--weights", options.weights.is_some()),
        ("--xi-layout", options.xi_layout.is_some()),
        ("--library-order", options.library_order.is_some()),
        ("--activation", options.activation.is_some()),
        ("--input-scaling", options.input_scaling.is_some()),
        ("--order", options.order.is_some()),
    ];
    let Some((option, _)) = given.iter().find(|(_, is_given)| *is_given) else {
        return Ok(());
    };
    let (found, expected) = ("a file of equations", "a file of tensors");
    Err(ImportError::option(option, found, expected))
}

/// The sections with their phases, in the order of `--phase` or of the file.
fn phases_in_order<'s>(
    file: &str,
    sections: &'s Sections,
    options: &ImportOptions,
) -> Result<Vec<(PhaseRule, &'s Section)>, ImportError> {
    let mut ordered = Vec::new();
    let by_order = options.phases.len() == sections.sections.len();
    for (place, section) in sections.sections.iter().enumerate() {
        let name = match &section.phase {
            Some(name) => name.clone(),
            None if by_order => options.phases[place].name.clone(),
            None => {
                let found = "equations of no phase";
                let expected = "a phase such as `[contact]` before them (LaTeX: `% Phase contact`, \
                                or a label that ends in its name), or one --phase NAME=FEET for each";
                return Err(ImportError::at(file, (section.line, 1), found, expected));
            }
        };
        let found = format!("equations (line {})", section.line);
        let feet = options.feet_of(file, &name, &found)?;
        ordered.push((PhaseRule { name, feet }, section));
    }
    for PhaseRule { name, .. } in &options.phases {
        if ordered.iter().all(|(rule, _)| rule.name != *name) {
            let found = format!("{name}, which {file} has no equations for");
            let expected = format!("`[{name}]` in the file");
            return Err(ImportError::option("--phase", found, expected));
        }
    }
    // Those that `--phase` does not name come last, in the order of the file.
    let last = options.phases.len();
    ordered.sort_by_key(|(rule, _)| options.given(&rule.name).unwrap_or(last));
    Ok(ordered)
}

fn rows_of(library: &Library) -> HashMap<ExprId, Row> {
    let rows = library.terms().iter().enumerate().map(|(index, term)| {
        let (factor, rest) = library.pool().split(term.expr());
        let factor = factor.to_f64();
        (rest, Row { index, factor })
    });
    rows.collect()
}

/// The terms of an equation with their coefficients; all are `known` ones, if there are any.
fn separate(
    file: &str,
    latent_dim: usize,
    equation: &Equation,
    pool: &mut ExprPool,
    known: &HashMap<ExprId, Row>,
) -> Result<Coefficients, ImportError> {
    let (place, output) = ((equation.line, 1), equation.output + 1);
    let expr = equation.parse(file, latent_dim, pool)?;
    let is_term = |expr| known.contains_key(&expr);
    let coefficients = terms::coefficients(pool, expr, &is_term).ok_or_else(|| {
        let found = format!("a coefficient of ddz{output} beyond the range of numbers");
        ImportError::at(file, place, found, "finite coefficients")
    })?;
    let is_strange = |term: &ExprId| !known.is_empty() && !is_term(*term);
    let strange = coefficients.keys().copied().filter(is_strange);
    let mut strange: Vec<ExprId> = strange.collect();
    terms::sort(pool, latent_dim, &mut strange);
    match strange.first() {
        None => Ok(coefficients),
        Some(&term) => {
            let term = pool.display(term).to_string();
            let short: String = term.chars().take(80).collect();
            let found = format!("the term `{short}` in ddz{output}");
            Err(ImportError::at(
                file,
                place,
                found,
                "the terms of --library only",
            ))
        }
    }
}

fn union(
    file: &str,
    latent_dim: usize,
    pool: &ExprPool,
    separated: &[Vec<Coefficients>],
) -> Result<(Library, HashMap<ExprId, Row>), ImportError> {
    let found = separated.iter().flatten().flat_map(Coefficients::keys);
    let mut found: Vec<ExprId> = found.copied().collect();
    found.sort_unstable();
    found.dedup();
    terms::sort(pool, latent_dim, &mut found);
    let texts = found.iter().map(|&term| pool.display(term).to_string());
    let mut texts: Vec<String> = texts.collect();
    if texts.is_empty() {
        // Equations whose right sides are all zero need some term to have zero times of.
        texts.push("1".to_owned());
    }
    let library = Library::from_terms(latent_dim, &texts)
        .map_err(|source| ImportError::unusable(file, source))?;
    let row = |(index, &term): (usize, &ExprId)| (term, Row { index, factor: 1.0 });
    Ok((library, found.iter().enumerate().map(row).collect()))
}
