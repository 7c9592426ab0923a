//! From equations as text to library and coefficients. A coefficient is the number in front of a term, bit for bit.
//! Sums inside a product with a number are multiplied out (`2*(0.5*z1 - u1)` is `z1 - 2*u1`); products of sums stay one
//! term (`z1*(1 + dz1)`).

use super::equations::{Equation, Section};
use super::run::ReadEquation;
use super::*;
use crate::symbolic::Number;

/// Makes the parts of a model; without a library in the options, it is the union of the terms found.
pub(super) fn parts(
    file: &str,
    sections: &Sections,
    options: &ImportOptions,
) -> Read<(Parts, ImportReport)> {
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
        let PhasePattern { name, feet } = rule;
        report.notes.extend(options.usual_feet(&name, &feet));
        for (equation, coefficients) in section.equations.iter().zip(columns) {
            report.equations.push(ReadEquation {
                phase: name.clone(),
                output: format!("ddz{}", equation.output + 1),
                line: equation.line,
                terms: coefficients.len(),
            });
        }
        let mut xi = DMatrix::zeros(library.terms().len(), latent_dim);
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

fn check_options(latent_dim: usize, options: &ImportOptions) -> Read<()> {
    if let Some(given) = options.latent_dim.filter(|given| *given != latent_dim) {
        let expected = format!("{latent_dim}, as the equations have");
        let found = given.to_string();
        return Err(ImportError::option("--latent-dim", found, expected));
    }
    const OF_TENSORS: [&str; 7] = [
        "--map",
        "--weights",
        "--xi-layout",
        "--library-order",
        "--activation",
        "--input-scaling",
        "--order",
    ];
    let (found, expected) = ("a file of equations", "a file of tensors");
    match options.first_of(&OF_TENSORS) {
        Some(option) => Err(ImportError::option(option, found, expected)),
        None => Ok(()),
    }
}

/// The sections with their phases, in the order of `--phase` or of the file.
fn phases_in_order<'s>(
    file: &str,
    sections: &'s Sections,
    options: &ImportOptions,
) -> Read<Vec<(PhasePattern, &'s Section)>> {
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
        ordered.push((PhasePattern { name, feet }, section));
    }
    for PhasePattern { name, .. } in &options.phases {
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
        let (factor, rest) = library.pool().split(term.expr);
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
) -> Read<Coefficients> {
    let (place, output) = ((equation.line, 1), equation.output + 1);
    let expr = equation.parse(file, latent_dim, pool)?;
    let is_term = |expr| known.contains_key(&expr);
    let coefficients = coefficients(pool, expr, &is_term).ok_or_else(|| {
        let found = format!("a coefficient of ddz{output} beyond the range of numbers");
        ImportError::at(file, place, found, "finite coefficients")
    })?;
    let is_strange = |term: &ExprId| !known.is_empty() && !is_term(*term);
    let strange = coefficients.keys().copied().filter(is_strange);
    let mut strange: Vec<ExprId> = strange.collect();
    sort(pool, latent_dim, &mut strange);
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
) -> Read<(Library, HashMap<ExprId, Row>)> {
    let found = separated.iter().flatten().flat_map(Coefficients::keys);
    let mut found: Vec<ExprId> = found.copied().collect();
    found.sort_unstable();
    found.dedup();
    sort(pool, latent_dim, &mut found);
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

pub(super) type Coefficients = HashMap<ExprId, Number>;

/// Coefficients of `expr` as a sum over terms; `None` if one overflows. A sum that is itself a term is not divided.
pub(super) fn coefficients(
    pool: &ExprPool,
    expr: ExprId,
    is_term: &dyn Fn(ExprId) -> bool,
) -> Option<Coefficients> {
    let mut found = Coefficients::new();
    let mut open = vec![(Number::ONE, expr)];
    while let Some((factor, expr)) = open.pop() {
        let (inner, rest) = pool.split(expr);
        let coefficient = multiply(factor, inner)?;
        match pool.node(rest) {
            Node::Sum(terms) if !is_term(rest) => {
                open.extend(terms.iter().map(|&term| (coefficient, term)));
            }
            _ if coefficient.is_zero() => {}
            _ => {
                let sum = found.entry(rest).or_insert(Number::ZERO);
                *sum = sum.checked_add(coefficient)?;
            }
        }
    }
    found.retain(|_, coefficient| !coefficient.is_zero());
    Some(found)
}

/// The product, without touching a number that is multiplied by one.
fn multiply(a: Number, b: Number) -> Option<Number> {
    match (a.is_one(), b.is_one()) {
        (true, _) => Some(b),
        (false, true) => Some(a),
        (false, false) => a.checked_mul(b),
    }
}

/// Sorts terms as the standard library does; others stand before the inputs.
pub(super) fn sort(pool: &ExprPool, latent_dim: usize, terms: &mut [ExprId]) {
    let key = |expr: &ExprId| place(pool, latent_dim, *expr);
    terms.sort_by(|a, b| key(a).cmp(&key(b)).then_with(|| pool.compare(*a, *b)));
}

/// A term's kind (constant, monomial, sine, cosine, other, input), degree, and indices into (z, dz) by [`monomial`].
fn place(pool: &ExprPool, latent_dim: usize, expr: ExprId) -> (usize, usize, Vec<usize>) {
    const OTHER: (usize, usize, Vec<usize>) = (4, 0, Vec::new());
    if expr == ExprId::ONE {
        return (0, 0, Vec::new());
    }
    if let Some(LatentVariable::U(index)) = variable(pool, latent_dim, expr) {
        return (5, 1, vec![index]);
    }
    if let Node::Apply(function, argument) = pool.node(expr) {
        return match (function, state_index(pool, latent_dim, *argument)) {
            (Function::Sin, Some(index)) => (2, 1, vec![index]),
            (Function::Cos, Some(index)) => (3, 1, vec![index]),
            _ => OTHER,
        };
    }
    monomial(pool, latent_dim, expr).map_or(OTHER, |indices| (1, indices.len(), indices))
}

fn variable(pool: &ExprPool, latent_dim: usize, expr: ExprId) -> Option<LatentVariable> {
    let symbol = pool.as_symbol(expr)?;
    LatentVariable::from_name(pool.symbol_name(symbol), latent_dim)
}

fn state_index(pool: &ExprPool, latent_dim: usize, expr: ExprId) -> Option<usize> {
    let place = variable(pool, latent_dim, expr)?.place(latent_dim)?;
    (place < 2 * latent_dim).then_some(place)
}

/// Indices into (z, dz), rising, each as often as its power.
fn monomial(pool: &ExprPool, latent_dim: usize, expr: ExprId) -> Option<Vec<usize>> {
    let bases = pool.repeated_factors(expr, usize::MAX)?.into_iter();
    let indices = bases.map(|base| state_index(pool, latent_dim, base));
    let mut indices: Vec<usize> = indices.collect::<Option<_>>()?;
    indices.sort_unstable();
    Some(indices)
}
