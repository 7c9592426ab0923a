//! From equations as text to library and coefficients.

use std::collections::HashMap;

use nalgebra::DMatrix;

use super::equations::{Equation, Section, Sections};
use super::error::ImportError;
use super::library;
use super::options::{ImportOptions, feet_text};
use super::report::{Note, ReadEquation};
use super::terms::{self, Coefficients};
use crate::model::{FeetRule, Library, ModelError, Phase};
use crate::symbolic::{ExprId, ExprPool};

/// What the equations of a file make.
#[derive(Debug)]
pub(super) struct Latent {
    pub(super) library: Library,
    pub(super) phases: Vec<Phase>,
    pub(super) equations: Vec<ReadEquation>,
    pub(super) notes: Vec<Note>,
}

/// Makes library and phases out of equations.
///
/// Without a library in the options, the library is the union of the terms found.
pub(super) fn latent(
    file: &str,
    sections: &Sections,
    options: &ImportOptions,
) -> Result<Latent, ImportError> {
    let latent_dim = sections.latent_dim;
    if let Some(expected) = options
        .latent_dim
        .filter(|&expected| expected != latent_dim)
    {
        return Err(ImportError::Option {
            option: "--latent-dim",
            found: expected.to_string(),
            expected: format!("{latent_dim}, as the equations have"),
        });
    }
    check_options(options)?;
    let ordered = phases_in_order(file, sections, options)?;
    let given = given_library(file, latent_dim, options)?;
    let pool_of = |library: &Library| library.pool().clone();
    let mut separation = Separation {
        file,
        latent_dim,
        pool: given.as_ref().map_or_else(ExprPool::default, pool_of),
        given: given.as_ref().map(rows_of).unwrap_or_default(),
    };
    let mut separated = Vec::new();
    for ordered in &ordered {
        let equations = ordered.section.equations.iter();
        let columns: Result<Vec<Coefficients>, ImportError> = equations
            .map(|equation| separation.equation(equation))
            .collect();
        separated.push(columns?);
    }
    let (library, rows) = match given {
        Some(library) => (library, separation.given),
        None => union(file, latent_dim, &separation.pool, &separated)?,
    };
    let mut found = Latent {
        library,
        phases: Vec::new(),
        equations: Vec::new(),
        notes: Vec::new(),
    };
    for (ordered, columns) in ordered.iter().zip(&separated) {
        found.add(ordered, columns, &rows, options);
    }
    Ok(found)
}

impl Latent {
    fn add(
        &mut self,
        ordered: &Ordered<'_>,
        columns: &[Coefficients],
        rows: &HashMap<ExprId, Row>,
        options: &ImportOptions,
    ) {
        let mut xi = DMatrix::zeros(self.library.len(), self.library.latent_dim());
        for (column, coefficients) in columns.iter().enumerate() {
            for (term, coefficient) in coefficients {
                let row = &rows[term];
                xi[(row.index, column)] = match row.factor {
                    1.0 => coefficient.to_f64(),
                    factor => coefficient.to_f64() / factor,
                };
            }
            let equation = &ordered.section.equations[column];
            self.equations.push(ReadEquation {
                phase: ordered.name.clone(),
                output: format!("ddz{}", column + 1),
                line: equation.line,
                terms: coefficients.len(),
            });
        }
        if options.phases.is_empty() {
            self.notes.push(Note::UsualFeet {
                phase: ordered.name.clone(),
                feet: feet_text(&ordered.feet),
            });
        }
        self.phases.push(Phase {
            name: ordered.name.clone(),
            feet: ordered.feet.clone(),
            xi,
        });
    }
}

/// A row of Xi, and the number in front of its term in the library (`2` for `2*z1`).
#[derive(Clone, Copy, Debug)]
struct Row {
    index: usize,
    factor: f64,
}

/// A section with the phase that it is.
struct Ordered<'s> {
    name: String,
    feet: FeetRule,
    section: &'s Section,
}

/// Options that only tensors can follow.
fn check_options(options: &ImportOptions) -> Result<(), ImportError> {
    let refused = |option| ImportError::Option {
        option,
        found: "a file of equations".to_owned(),
        expected: "a file of tensors".to_owned(),
    };
    if !options.mapping.is_empty() {
        return Err(refused("--map"));
    }
    if options.weights.is_some() {
        return Err(refused("--weights"));
    }
    if options.xi_layout.is_some() {
        return Err(refused("--xi-layout"));
    }
    Ok(())
}

/// The sections in the order of `--phase`, or of the file.
fn phases_in_order<'s>(
    file: &str,
    sections: &'s Sections,
    options: &ImportOptions,
) -> Result<Vec<Ordered<'s>>, ImportError> {
    let mut ordered = Vec::new();
    let by_order = options.phases.len() == sections.sections.len();
    for (place, section) in sections.sections.iter().enumerate() {
        let name = match &section.phase {
            Some(name) => name.clone(),
            None if by_order => options.phases[place].name.clone(),
            None => {
                return Err(ImportError::Text {
                    file: file.to_owned(),
                    line: section.line,
                    column: 1,
                    found: "equations of no phase".to_owned(),
                    expected:
                        "a phase such as `[contact]` before them (LaTeX: `% Phase contact`, or a \
                               label that ends in its name), or one --phase NAME=FEET for each"
                            .to_owned(),
                });
            }
        };
        let feet = options.feet_of(&name).ok_or_else(|| ImportError::NoFeet {
            file: file.to_owned(),
            phase: name.clone(),
            found: format!("equations (line {})", section.line),
        })?;
        ordered.push(Ordered {
            name,
            feet,
            section,
        });
    }
    for rule in &options.phases {
        if ordered.iter().all(|ordered| ordered.name != rule.name) {
            return Err(ImportError::Option {
                option: "--phase",
                found: format!("{}, which {file} has no equations for", rule.name),
                expected: format!("`[{}]` in the file", rule.name),
            });
        }
    }
    let rank = |name: &str| options.phases.iter().position(|rule| rule.name == name);
    ordered.sort_by_key(|ordered| rank(&ordered.name));
    Ok(ordered)
}

fn model_error(file: &str, source: ModelError) -> ImportError {
    ImportError::Model {
        file: file.to_owned(),
        source: Box::new(source),
    }
}

fn given_library(
    file: &str,
    latent_dim: usize,
    options: &ImportOptions,
) -> Result<Option<Library>, ImportError> {
    let library = options
        .library
        .as_ref()
        .map(|choice| library::build(choice, latent_dim));
    library
        .transpose()
        .map_err(|source| model_error(file, source.into()))
}

fn rows_of(library: &Library) -> HashMap<ExprId, Row> {
    let rows = library.terms().iter().enumerate().map(|(index, term)| {
        let (factor, rest) = library.pool().split(term.expr());
        let row = Row {
            index,
            factor: factor.to_f64(),
        };
        (rest, row)
    });
    rows.collect()
}

struct Separation<'f> {
    file: &'f str,
    latent_dim: usize,
    pool: ExprPool,
    /// The terms of a library that was given.
    given: HashMap<ExprId, Row>,
}

impl Separation<'_> {
    fn equation(&mut self, equation: &Equation) -> Result<Coefficients, ImportError> {
        let refused = |found: String, expected: &str| ImportError::Text {
            file: self.file.to_owned(),
            line: equation.line,
            column: 1,
            found,
            expected: expected.to_owned(),
        };
        let expr = equation.parse(self.file, self.latent_dim, &mut self.pool)?;
        let is_term = |expr| self.given.contains_key(&expr);
        let coefficients = terms::coefficients(&self.pool, expr, &is_term).ok_or_else(|| {
            refused(
                format!(
                    "a coefficient of ddz{} beyond the range of numbers",
                    equation.output + 1
                ),
                "finite coefficients",
            )
        })?;
        if !self.given.is_empty() {
            let mut strange: Vec<ExprId> = (coefficients.keys().copied())
                .filter(|term| !self.given.contains_key(term))
                .collect();
            terms::sort(&self.pool, self.latent_dim, &mut strange);
            if let Some(&term) = strange.first() {
                let term = self.pool.display(term).to_string();
                let short: String = term.chars().take(80).collect();
                return Err(refused(
                    format!("the term `{short}` in ddz{}", equation.output + 1),
                    "the terms of --library only",
                ));
            }
        }
        Ok(coefficients)
    }
}

/// The library of all terms found.
fn union(
    file: &str,
    latent_dim: usize,
    pool: &ExprPool,
    separated: &[Vec<Coefficients>],
) -> Result<(Library, HashMap<ExprId, Row>), ImportError> {
    let mut found: Vec<ExprId> = (separated.iter().flatten())
        .flat_map(|coefficients| coefficients.keys().copied())
        .collect();
    found.sort_unstable();
    found.dedup();
    terms::sort(pool, latent_dim, &mut found);
    let texts: Vec<String> = found
        .iter()
        .map(|&term| pool.display(term).to_string())
        .collect();
    let library = Library::from_terms(latent_dim, &texts)
        .map_err(|source| model_error(file, source.into()))?;
    let row = |(index, &term): (usize, &ExprId)| (term, Row { index, factor: 1.0 });
    Ok((library, found.iter().enumerate().map(row).collect()))
}
