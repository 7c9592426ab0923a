//! Exact simplification: each acceleration in its shortest form, equal as a real function.
//!
//! The algebra finds the form ([`Shortener`]); here the new terms get their places among the old: each stands where the
//! first term that it replaces stood.

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

impl Equations<'_> {
    /// The equations in their shortest form; what is shortest already keeps its bits.
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
                let summands = summands.map(|s| (s.coefficient, self.terms[s.term].expr()));
                let summands: Vec<(f64, ExprId)> = summands.collect();
                let mut is_kept = vec![true; equation.len()];
                let mut all: Vec<Summand> = Vec::new();
                for Shortened { replaced, by } in shortener.shorten(&summands) {
                    let first = equation[replaced[0]].term;
                    let after = new.placed(shortener.pool(), &mut self.terms, first, &by);
                    let Some((placed, texts)) = after else {
                        continue;
                    };
                    let before = replaced.iter().map(|&position| {
                        let Summand { coefficient, term } = equation[position];
                        (coefficient, self.terms[term].text().to_owned())
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
    /// All terms by expression, made at the first need.
    known: HashMap<ExprId, usize>,
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
                let known = self.known.entry(term.expr()).or_insert(index);
                // Of several spellings the canonical one is printed.
                if term.text() == text(term.expr()) {
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
                terms.push(CandidateTerm::new(text.clone(), expr));
            }
            Summand { coefficient, term }
        };
        Some((summands.iter().zip(&texts).map(placed).collect(), texts))
    }
}
