//! The library Theta: ordered candidate terms over `z`, `dz` and `u`.

use std::collections::HashMap;
use std::fmt;

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::error::{LibraryError, ModelError, check_shape};
use super::evaluation::Tape;
use super::standard_library::StandardLibrary;
use super::variable::LatentVariable;
use crate::symbolic::{ExprId, ExprPool, ParseLimits, SymbolId};

/// Largest number of latent coordinates.
pub const MAX_LATENT_DIM: usize = 64;
/// Largest number of candidate terms.
pub(crate) const MAX_LIBRARY_DIM: usize = 20_000;
/// Longest candidate term in bytes.
pub(crate) const MAX_TERM_LEN: usize = 1_000;

/// One column of Theta.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CandidateTerm {
    text: String,
    expr: ExprId,
}

impl CandidateTerm {
    /// A term of a pool with its text in the syntax of the model file.
    pub(crate) fn new(text: String, expr: ExprId) -> Self {
        Self { text, expr }
    }

    /// The term as the model file writes it.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The term in the library's pool.
    pub fn expr(&self) -> ExprId {
        self.expr
    }
}

/// The terms of a library as they are given; the model file keeps the form.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(untagged)]
pub enum LibraryChoice {
    /// A list of expressions over `z1..zd`, `dz1..dzd`, `u1..ud`.
    Terms(Vec<String>),
    /// The shorthand: polynomials, sines and cosines, inputs.
    Standard(StandardLibrary),
}

/// Candidate terms in order, over `z1..zd`, `dz1..dzd`, `u1..ud`.
#[derive(Clone)]
pub struct Library {
    latent_dim: usize,
    /// The shorthand, if the library was given by it.
    standard: Option<StandardLibrary>,
    pool: ExprPool,
    symbols: Vec<SymbolId>,
    terms: Vec<CandidateTerm>,
    tape: Tape,
}

impl Library {
    /// The library with these terms, in the expression syntax of the model file.
    ///
    /// # Errors
    /// Each variant of [`LibraryError`] except [`LibraryError::Degree`] and
    /// [`LibraryError::Duplicate`].
    pub fn from_terms(latent_dim: usize, texts: &[String]) -> Result<Self, LibraryError> {
        Self::of(latent_dim, LibraryChoice::Terms(texts.to_vec()))
    }

    /// The standard library, in the order of the published arrays.
    ///
    /// # Errors
    /// [`LibraryError::LatentDim`], [`LibraryError::Degree`], [`LibraryError::TooManyTerms`].
    pub fn standard(latent_dim: usize, standard: StandardLibrary) -> Result<Self, LibraryError> {
        Self::of(latent_dim, LibraryChoice::Standard(standard))
    }

    /// The library with the terms that were chosen.
    ///
    /// # Errors
    /// As [`Self::from_terms`] and [`Self::standard`].
    pub fn of(latent_dim: usize, choice: LibraryChoice) -> Result<Self, LibraryError> {
        if !(1..=MAX_LATENT_DIM).contains(&latent_dim) {
            return Err(LibraryError::LatentDim { found: latent_dim });
        }
        let (texts, standard) = match choice {
            LibraryChoice::Terms(texts) => (texts, None),
            LibraryChoice::Standard(standard) => (standard.texts(latent_dim)?, Some(standard)),
        };
        if texts.is_empty() {
            return Err(LibraryError::Empty);
        }
        if texts.len() > MAX_LIBRARY_DIM {
            return Err(LibraryError::TooManyTerms { found: texts.len() });
        }
        let mut pool = ExprPool::new();
        let symbols: Vec<SymbolId> = LatentVariable::all(latent_dim)
            .map(|variable| pool.symbol_id(&variable.to_string()))
            .collect();
        let mut terms: Vec<CandidateTerm> = Vec::with_capacity(texts.len());
        for (index, text) in texts.into_iter().enumerate() {
            let expr = parse_term(&mut pool, latent_dim, index, &text)?;
            if expr == ExprId::ZERO {
                return Err(LibraryError::Zero { index, text });
            }
            if !constants_are_finite(&pool, expr) {
                return Err(LibraryError::NotFinite { index, text });
            }
            terms.push(CandidateTerm { text, expr });
        }
        let exprs: Vec<ExprId> = terms.iter().map(CandidateTerm::expr).collect();
        let tape = Tape::new(&pool, &exprs, &symbols);
        Ok(Self {
            latent_dim,
            standard,
            pool,
            symbols,
            terms,
            tape,
        })
    }

    /// Refuses a library in which a term equals an earlier one under another spelling: its
    /// coefficients cannot be learned.
    ///
    /// # Errors
    /// [`LibraryError::Duplicate`] for the first such term.
    pub fn check_distinct(&self) -> Result<(), LibraryError> {
        let mut first_use = HashMap::new();
        for (second, term) in self.terms.iter().enumerate() {
            if let Some(first) = first_use.insert(term.expr, second) {
                return Err(LibraryError::Duplicate {
                    first,
                    second,
                    text: term.text.clone(),
                    earlier: self.terms[first].text.clone(),
                });
            }
        }
        Ok(())
    }

    /// The terms as steps of one pass over their subexpressions.
    pub fn tape(&self) -> &Tape {
        &self.tape
    }

    /// Number of latent coordinates, `d`.
    pub fn latent_dim(&self) -> usize {
        self.latent_dim
    }

    /// Number of terms: the rows of Xi.
    pub fn len(&self) -> usize {
        self.terms.len()
    }

    /// Whether there is no term; never true of a library that was built.
    pub fn is_empty(&self) -> bool {
        self.terms.is_empty()
    }

    /// The terms in the form in which they were given.
    pub fn choice(&self) -> LibraryChoice {
        match self.standard {
            Some(standard) => LibraryChoice::Standard(standard),
            None => {
                let texts = self.terms.iter().map(|term| term.text.clone());
                LibraryChoice::Terms(texts.collect())
            }
        }
    }

    /// The standard library that has the same terms in whatever order, and for each of its terms in
    /// romc's order the row of this library; none for other terms.
    pub fn as_standard(&self) -> Option<(StandardLibrary, Vec<usize>)> {
        if let Some(standard) = self.standard {
            return Some((standard, (0..self.len()).collect()));
        }
        let mut pool = self.pool.clone();
        let rows = self.terms.iter().map(CandidateTerm::expr).zip(0..);
        let rows: HashMap<ExprId, usize> = rows.collect();
        StandardLibrary::small().find_map(|standard| {
            if standard.term_count(self.latent_dim) != Some(rows.len().max(self.len())) {
                return None;
            }
            let texts = standard.texts(self.latent_dim).ok()?;
            let of = |text: String| rows.get(&pool.parse(&text, &|_| true).ok()?).copied();
            let rows: Option<Vec<usize>> = texts.into_iter().map(of).collect();
            Some((standard, rows?))
        })
    }

    /// The terms in order.
    pub fn terms(&self) -> &[CandidateTerm] {
        &self.terms
    }

    /// The pool in which the terms live. Clone it to build on them: ids stay valid in the clone.
    pub fn pool(&self) -> &ExprPool {
        &self.pool
    }

    /// The symbol of a variable in the library's pool, and in clones of it.
    ///
    /// `None` if its index is not below `latent_dim`.
    pub fn symbol(&self, variable: LatentVariable) -> Option<SymbolId> {
        Some(self.symbols[variable.place(self.latent_dim)?])
    }

    /// Theta at one point: the value of each term, in order.
    ///
    /// # Errors
    /// [`ModelError::Dimension`] if an argument is not `latent_dim` long.
    pub fn evaluate(
        &self,
        z: &DVector<f64>,
        dz: &DVector<f64>,
        u_lat: &DVector<f64>,
    ) -> Result<DVector<f64>, ModelError> {
        let d = self.latent_dim;
        ModelError::check_dimension("latent state z", z.len(), d)?;
        ModelError::check_dimension("latent velocity dz", dz.len(), d)?;
        ModelError::check_dimension("latent input u_lat", u_lat.len(), d)?;
        let variables: Vec<f64> = z.iter().chain(dz).chain(u_lat).copied().collect();
        let mut values = vec![0.0; self.tape.steps.len()];
        let mut theta = DVector::zeros(self.len());
        self.tape.run(&variables, &mut values, theta.as_mut_slice());
        Ok(theta)
    }

    /// Theta at many points: one row a point, one column a term.
    ///
    /// `variables` holds one point a column (`3 latent_dim x n`): `z`, then `dz`, then `u_lat`.
    ///
    /// # Errors
    /// [`ModelError::Invalid`] if it has another number of rows.
    pub fn evaluate_points(&self, variables: &DMatrix<f64>) -> Result<DMatrix<f64>, ModelError> {
        let expected = (3 * self.latent_dim, variables.ncols());
        check_shape("z, dz, u_lat", variables.shape(), expected)?;
        let mut values = vec![0.0; self.tape.steps.len()];
        let mut theta = vec![0.0; self.len()];
        let mut all = DMatrix::zeros(variables.ncols(), self.len());
        for (point, mut row) in variables.column_iter().zip(all.row_iter_mut()) {
            self.tape.run(point.as_slice(), &mut values, &mut theta);
            row.copy_from_slice(&theta);
        }
        Ok(all)
    }
}

impl PartialEq for Library {
    /// Equal as given: same dimension, form and texts.
    fn eq(&self, other: &Self) -> bool {
        self.latent_dim == other.latent_dim
            && self.standard == other.standard
            && (self.terms.iter().map(CandidateTerm::text))
                .eq(other.terms.iter().map(CandidateTerm::text))
    }
}

impl fmt::Debug for Library {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Library")
            .field("latent_dim", &self.latent_dim)
            .field("standard", &self.standard)
            .field("terms", &self.terms)
            .finish_non_exhaustive()
    }
}

fn parse_term(
    pool: &mut ExprPool,
    latent_dim: usize,
    index: usize,
    text: &str,
) -> Result<ExprId, LibraryError> {
    if text.len() > MAX_TERM_LEN || text.chars().any(char::is_control) {
        return Err(LibraryError::TermText {
            index,
            found: text.len(),
        });
    }
    let known = |name: &str| LatentVariable::from_name(name, latent_dim).is_some();
    let read = pool.parse_defined(text, &known, &|_, _| None, ParseLimits::default());
    read.map(|reading| reading.expr)
        .map_err(|source| LibraryError::Parse {
            index,
            text: text.to_owned(),
            source: Box::new(source),
        })
}

/// Whether every part without variables has a finite value.
fn constants_are_finite(pool: &ExprPool, expr: ExprId) -> bool {
    let constants: Vec<ExprId> = pool
        .reachable(&[expr])
        .into_iter()
        .filter(|&part| pool.is_constant(part))
        .collect();
    let no_symbol = |_| f64::NAN;
    let values = pool.evaluate_all(&constants, &no_symbol);
    values.into_iter().all(f64::is_finite)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::symbolic::ParseErrorKind;

    fn terms(texts: &[&str]) -> Vec<String> {
        texts.iter().map(|&text| text.to_owned()).collect()
    }

    #[test]
    fn library_with_equal_terms_is_accepted_but_not_distinct() {
        let library = Library::from_terms(2, &terms(&["1", "z1*z2", "u1", "z2*z1"])).unwrap();
        assert_eq!(library.len(), 4);
        let error = library.check_distinct().unwrap_err();
        assert!(matches!(
            error,
            LibraryError::Duplicate {
                first: 1,
                second: 3,
                ..
            }
        ));
    }

    #[test]
    fn library_with_vanishing_oversized_or_missing_terms_is_refused() {
        assert!(matches!(
            Library::from_terms(1, &terms(&["z1 - z1"])),
            Err(LibraryError::Zero { index: 0, .. })
        ));
        for text in ["z1/0", "log(0)*z1", "z1^(1/0)", "sqrt(-1) + z1"] {
            let error = Library::from_terms(1, &terms(&[text])).unwrap_err();
            assert!(
                matches!(&error, LibraryError::Parse { index: 0, source, .. }
                    if matches!(source.kind, ParseErrorKind::NoValue(_))),
                "{text}: {error:?}"
            );
        }
        let error = Library::from_terms(1, &terms(&["exp(1000)*z1"])).unwrap_err();
        assert!(matches!(error, LibraryError::NotFinite { index: 0, .. }));
        for text in ["z1+".repeat(400) + "z1", "z1\n+1".to_owned()] {
            let found = Library::from_terms(1, &[text]);
            assert!(matches!(
                found,
                Err(LibraryError::TermText { index: 0, .. })
            ));
        }
        assert_eq!(Library::from_terms(1, &[]), Err(LibraryError::Empty));
    }

    #[test]
    fn library_values_agree_with_the_pool_for_every_node() {
        let texts = [
            "z1^7 - 2/z1^3",
            "abs(z1)^dz1",
            "tanh(log(2 + u1^2))^1.5",
            "cos(tan(z1)*sqrt(2))",
            "0.1*z1*dz1*u1",
        ];
        let library = Library::from_terms(1, &terms(&texts)).unwrap();
        let points = [[0.3, -0.7, 2.0], [-1.25, 0.5, -0.1], [2.0, 3.0, 0.0]];
        let variables = DMatrix::from_fn(3, 3, |row, point| points[point][row]);
        let all = library.evaluate_points(&variables).unwrap();
        for (point, values) in points.iter().enumerate() {
            let [z, dz, u_lat] = values.map(|value| DVector::from_element(1, value));
            let alone = library.evaluate(&z, &dz, &u_lat).unwrap();
            assert_eq!(alone.transpose(), all.row(point));
            let exprs: Vec<ExprId> = library.terms().iter().map(CandidateTerm::expr).collect();
            let expected = library
                .pool()
                .evaluate_all(&exprs, &|symbol| values[symbol.index()]);
            for (term, expected) in expected.iter().enumerate() {
                assert_eq!(all[(point, term)], *expected, "{}", texts[term]);
            }
        }
    }
}
