//! The accelerations of all phases as sums of coefficients times expressions, and their shortest form, equal as real
//! functions. The algebra finds it ([`Shortener`]). A new term stands in the place of the first term that it replaces.

use std::collections::HashMap;

use serde::{Serialize, Serializer};

use super::*;

/// One summand of an equation: `coefficient * terms[term]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Summand {
    pub coefficient: f64, // finite and not zero
    pub term: usize,
}

#[derive(Clone, Debug, PartialEq)]
pub struct PhaseEquations {
    pub name: String,
    /// Foot patterns that select the phase.
    pub feet: FeetRule,
    /// The right-hand sides `ddz1`, `ddz2` and so on; terms are distinct and in ascending order.
    pub ddz: Vec<Vec<Summand>>,
}

/// `ddz = Xi^T Theta(z, dz, u_lat)` of all phases, with the model of its maps, names and scale factors.
#[derive(Clone)]
pub struct Equations<'a> {
    /// The model with maps, names and scale factors; its Xi may be that of equal, longer equations.
    pub model: Cow<'a, ReducedModel>,
    /// The pool of the terms. Clone it to build on them: ids stay valid in the clone.
    pub pool: ExprPool,
    pub terms: Vec<CandidateTerm>,
    /// In the model's order.
    pub phases: Vec<PhaseEquations>,
    /// The steps of exact simplification, in the order of phases and equations.
    pub steps: Vec<ExactStep>,
    /// The units of equations in physical units, and the original equations.
    pub(super) physical: Option<(LatentUnits, Box<Equations<'static>>)>,
}

impl<'a> Equations<'a> {
    /// The equations as they are printed and emitted unless asked otherwise: in the shortest equal form that is found.
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

    /// A model whose Xi and library are these equations: the one they were made from if nothing was simplified.
    ///
    /// # Errors
    /// [`ModelError::Invalid`] if new terms make the library too large.
    pub fn to_model(&self) -> Result<Cow<'_, ReducedModel>, ModelError> {
        if self.steps.is_empty() {
            return Ok(Cow::Borrowed(&self.model));
        }
        let texts: Vec<String> = (self.terms.iter()).map(|term| term.text.clone()).collect();
        let phases = self.model.phases().iter().enumerate();
        let phases = phases.map(|(index, phase)| Phase {
            xi: self.coefficients(index),
            ..phase.clone()
        });
        let builder = self.model.clone().into_owned().into_builder();
        let builder = builder.library(Library::from_terms(self.latent_dim(), &texts)?);
        Ok(Cow::Owned(builder.phases(phases.collect()).build()?))
    }

    /// The same with all parts of terms that have no variable computed in double precision. `exp(100)` may be beyond
    /// the range of generated code, although its product with a coefficient is not.
    #[must_use]
    pub fn with_constants_folded(mut self) -> Self {
        let exprs: Vec<ExprId> = self.terms.iter().map(|term| term.expr).collect();
        let folded = self.pool.fold_constants(&exprs);
        for (term, expr) in self.terms.iter_mut().zip(folded) {
            *term = CandidateTerm {
                text: term.text.clone(),
                expr,
            };
        }
        self
    }

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

    /// These equations in the scaled units of the model's maps, with the latent inputs of `W_e`, for controllers.
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

    pub fn latent_dim(&self) -> usize {
        self.model.latent_dim()
    }

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
        let terms = &equations.terms;
        (self.ddz[output].iter()).map(|summand| (summand.coefficient, &terms[summand.term]))
    }

    /// Number of summands of all accelerations.
    pub fn active_count(&self) -> usize {
        self.ddz.iter().map(Vec::len).sum()
    }
}

/// Terms of one equation that a shorter form replaced.
#[derive(Clone, Debug, PartialEq)]
pub struct ExactStep {
    pub phase: String,
    /// Index of the latent coordinate.
    pub output: usize,
    /// Coefficients and terms as learned.
    pub before: Vec<(f64, String)>,
    /// Their sum in shorter form; empty if they cancel.
    pub after: Vec<(f64, String)>,
}

impl fmt::Display for ExactStep {
    /// `contact, ddz1: 3 terms became 1`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, ddz{}: ", self.phase, self.output + 1)?;
        match (self.before.len(), self.after.len()) {
            (1, 0) => f.write_str("1 term is zero"),
            (before, 0) => write!(f, "{before} terms cancelled"),
            (1, 1) => f.write_str("1 term became shorter"),
            (before, after) if before == after => write!(f, "{before} terms became shorter"),
            (1, after) => write!(f, "1 term became {after} shorter ones"),
            (before, after) => write!(f, "{before} terms became {after}"),
        }
    }
}

impl ExactStep {
    /// `0.5*sin(z1) + 1.0*z1` for either side; `0` for no term.
    pub fn sum_words(side: &[(f64, String)]) -> String {
        let words = side.iter().map(|(xi, text)| summand_words(*xi, text));
        match side {
            [] => "0".to_owned(),
            _ => words.collect::<Vec<_>>().join(" + "),
        }
    }
}

/// A coefficient times a term: `0.5*sin(z1)`, `2.0*(z1 + z2)`, `3.0`.
pub(crate) fn summand_words(coefficient: f64, term: &str) -> String {
    match term {
        "1" => format!("{coefficient:?}"),
        _ if term.contains(['+', '-']) => format!("{coefficient:?}*({term})"),
        _ => format!("{coefficient:?}*{term}"),
    }
}

impl Serialize for ExactStep {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let [before, after] = [&self.before, &self.after];
        let step = serde_json::json!({
            "phase": self.phase,
            "equation": format!("ddz{}", self.output + 1),
            "terms": { "before": before.len(), "after": after.len() },
            "before": Self::sum_words(before),
            "after": Self::sum_words(after),
        });
        step.serialize(to)
    }
}

impl Equations<'_> {
    /// The equations in their shortest form; equations that are already shortest keep their bits.
    #[must_use]
    pub(crate) fn simplified(mut self) -> Self {
        let mut pool = std::mem::take(&mut self.pool);
        let mut shortener = Shortener::new(&mut pool);
        let mut new = NewTerms {
            places: (0..self.terms.len()).map(|term| (term, 0)).collect(),
            known: HashMap::new(),
        };
        let mut steps = Vec::new();
        for phase in &mut self.phases {
            for (output, equation) in phase.ddz.iter_mut().enumerate() {
                let summands = equation.iter();
                let summands = summands.map(|s| (s.coefficient, self.terms[s.term].expr));
                let summands: Vec<(f64, ExprId)> = summands.collect();
                let mut is_kept = vec![true; equation.len()];
                let mut all: Vec<Summand> = Vec::new();
                for Shortened { replaced, by } in shortener.shorten(&summands) {
                    let first = equation[replaced[0]].term;
                    let after = new.placed(shortener.pool, &mut self.terms, first, &by);
                    let Some((placed, texts)) = after else {
                        continue;
                    };
                    let before = replaced.iter().map(|&position| {
                        let Summand { coefficient, term } = equation[position];
                        (coefficient, self.terms[term].text.clone())
                    });
                    let after = placed.iter().map(|summand| summand.coefficient).zip(texts);
                    steps.push(ExactStep {
                        phase: phase.name.clone(),
                        output,
                        before: before.collect(),
                        after: after.collect(),
                    });
                    replaced
                        .iter()
                        .for_each(|&position| is_kept[position] = false);
                    all.extend(placed);
                }
                let kept = equation.iter().zip(is_kept).filter(|(_, is_kept)| *is_kept);
                all.extend(kept.map(|(summand, _)| *summand));
                *equation = all;
            }
        }
        self.pool = pool;
        if !steps.is_empty() {
            self.sort_terms(&new.places);
        }
        self.steps.extend(steps);
        self
    }

    /// Puts the terms in the order of their places; equal ones of an equation become one.
    fn sort_terms(&mut self, places: &[(usize, usize)]) {
        let mut order: Vec<usize> = (0..places.len()).collect();
        order.sort_by_key(|&term| places[term]);
        let mut index = vec![0; order.len()];
        for (new, &old) in order.iter().enumerate() {
            index[old] = new;
        }
        self.terms = order.iter().map(|&term| self.terms[term].clone()).collect();
        for equation in self.phases.iter_mut().flat_map(|phase| &mut phase.ddz) {
            for summand in equation.iter_mut() {
                summand.term = index[summand.term];
            }
            equation.sort_by_key(|summand| summand.term);
            equation.dedup_by(|later, first| {
                let is_same = later.term == first.term;
                first.coefficient += if is_same { later.coefficient } else { 0.0 };
                is_same
            });
            equation.retain(|summand| summand.coefficient != 0.0);
        }
    }
}

struct NewTerms {
    /// Of each term: the term as learned that it is or follows, then its number among new ones.
    places: Vec<(usize, usize)>,
    known: HashMap<ExprId, usize>, // by expression, made at the first need
}

impl NewTerms {
    /// New summands and their texts, after the term `first`; nothing if one has no text that a model file could hold.
    fn placed(
        &mut self,
        pool: &ExprPool,
        terms: &mut Vec<CandidateTerm>,
        first: usize,
        summands: &[(f64, ExprId)],
    ) -> Option<(Vec<Summand>, Vec<String>)> {
        let text = |expr: ExprId| pool.display(expr).to_string();
        if self.known.is_empty() {
            for (index, term) in terms.iter().enumerate() {
                let known = self.known.entry(term.expr).or_insert(index);
                // Of several spellings the canonical one is printed.
                if term.text == text(term.expr) {
                    *known = index;
                }
            }
        }
        let texts: Vec<String> = summands.iter().map(|&(_, expr)| text(expr)).collect();
        if texts.iter().any(|text| text.len() > MAX_TERM_LEN) {
            return None;
        }
        let placed = |(&(coefficient, expr), text): (&(f64, ExprId), &String)| {
            let term = *self.known.entry(expr).or_insert(terms.len());
            if term == terms.len() {
                self.places.push((first, term));
                terms.push(CandidateTerm {
                    text: text.clone(),
                    expr,
                });
            }
            Summand { coefficient, term }
        };
        Some((summands.iter().zip(&texts).map(placed).collect(), texts))
    }
}
