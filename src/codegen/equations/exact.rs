//! Exact simplification: each acceleration in its shortest form, equal as a real function.
//!
//! The algebra finds the form ([`Shortener`]); here the new terms get their places among the old:
//! each stands where the first term that it replaces stood.

use std::collections::HashMap;
use std::fmt;

use serde::{Serialize, Serializer};

use super::system::{Equations, Summand};
use crate::model::{CandidateTerm, MAX_TERM_LEN};
use crate::symbolic::{ExprId, ExprPool, Shortened, Shortener};

/// Terms of one equation that a shorter form took the place of.
#[derive(Clone, Debug, PartialEq)]
pub struct ExactStep {
    /// The phase's name.
    pub phase: String,
    /// Index of the latent coordinate.
    pub output: usize,
    /// Coefficients and terms as learned.
    pub before: Vec<(f64, String)>,
    /// What they are together; nothing if they cancel.
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

/// Place of a term: the term as learned that it follows or is, then its number among new ones.
type Place = (usize, usize);

impl Equations<'_> {
    /// The equations in their shortest form; what is shortest already keeps its bits.
    #[must_use]
    pub(crate) fn simplified(mut self) -> Self {
        let mut new = NewTerms::default();
        let mut pool = std::mem::take(&mut self.pool);
        let mut shortener = Shortener::new(&mut pool);
        let mut steps = Vec::new();
        let mut equations = Vec::new();
        for phase in &self.phases {
            for (output, equation) in phase.ddz.iter().enumerate() {
                let summands: Vec<(f64, ExprId)> = (equation.iter())
                    .map(|summand| (summand.coefficient, self.terms[summand.term].expr()))
                    .collect();
                let mut kept: Vec<Option<(Place, f64)>> = (equation.iter())
                    .map(|summand| Some(((summand.term, 0), summand.coefficient)))
                    .collect();
                let mut placed = Vec::new();
                for Shortened { replaced, by } in shortener.shorten(&summands) {
                    let first = equation[replaced[0]].term;
                    let Some(after) = new.placed(shortener.pool(), &self.terms, first, &by) else {
                        continue;
                    };
                    let named = |&position: &usize| {
                        let Summand { coefficient, term } = equation[position];
                        (coefficient, self.terms[term].text().to_owned())
                    };
                    steps.push(ExactStep {
                        phase: phase.name.clone(),
                        output,
                        before: replaced.iter().map(named).collect(),
                        after: (after.iter())
                            .map(|(_, c, text)| (*c, text.clone()))
                            .collect(),
                    });
                    replaced.iter().for_each(|&position| kept[position] = None);
                    placed.extend(after.into_iter().map(|(place, c, _)| (place, c)));
                }
                placed.extend(kept.into_iter().flatten());
                equations.push(placed);
            }
        }
        self.pool = pool;
        if !steps.is_empty() {
            self.replace(equations, new);
        }
        self.steps.extend(steps);
        self
    }

    /// Puts the new terms among the old, and in all equations the summands that they have by place.
    fn replace(&mut self, equations: Vec<Vec<(Place, f64)>>, new: NewTerms) {
        let old = self.terms.drain(..).enumerate();
        let old = old.map(|(index, term)| ((index, 0), term));
        let mut all: Vec<(Place, CandidateTerm)> = old.chain(new.terms).collect();
        all.sort_by_key(|(place, _)| *place);
        let index: HashMap<Place, usize> = (all.iter().enumerate())
            .map(|(index, (place, _))| (*place, index))
            .collect();
        self.terms = all.into_iter().map(|(_, term)| term).collect();
        let old = self.phases.iter_mut().flat_map(|phase| &mut phase.ddz);
        for (equation, summands) in old.zip(equations) {
            let summand = |(place, coefficient)| Summand {
                coefficient,
                term: index[&place],
            };
            *equation = summands.into_iter().map(summand).collect();
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

/// Terms that simplification brought in.
#[derive(Default)]
struct NewTerms {
    terms: Vec<(Place, CandidateTerm)>,
    /// Places of all terms by expression, made at the first need.
    known: HashMap<ExprId, Place>,
}

impl NewTerms {
    /// Places, coefficients and texts of new summands, after the term `first`; nothing if one has no
    /// text that a model file could hold.
    fn placed(
        &mut self,
        pool: &ExprPool,
        old: &[CandidateTerm],
        first: usize,
        summands: &[(f64, ExprId)],
    ) -> Option<Vec<(Place, f64, String)>> {
        if self.known.is_empty() {
            for (index, term) in old.iter().enumerate() {
                let place = self.known.entry(term.expr()).or_insert((index, 0));
                // Of several spellings the canonical one is printed.
                if term.text() == pool.display(term.expr()).to_string() {
                    *place = (index, 0);
                }
            }
        }
        let texts: Vec<String> = (summands.iter())
            .map(|&(_, expr)| pool.display(expr).to_string())
            .collect();
        if texts.iter().any(|text| text.len() > MAX_TERM_LEN) {
            return None;
        }
        let placed = |(&(coefficient, expr), text): (&(f64, ExprId), String)| {
            let next = (first, self.terms.len() + 1);
            let place = *self.known.entry(expr).or_insert(next);
            if place == next {
                let term = CandidateTerm::new(text.clone(), expr);
                self.terms.push((place, term));
            }
            (place, coefficient, text)
        };
        Some(summands.iter().zip(texts).map(placed).collect())
    }
}
