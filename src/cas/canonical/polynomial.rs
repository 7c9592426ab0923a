//! Sums of coefficients times products of atoms and one exponential.

use std::collections::BTreeMap;

use super::coefficient::Coefficient;
use crate::{ExprId, SymbolId};

/// Most terms of a form, and most products of terms that one multiplication makes.
const MAX_TERMS: usize = 2_000;
const MAX_PRODUCTS: usize = 40_000;

/// A factor that is not taken apart.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) enum Atom {
    Symbol(SymbolId),
    /// A sum whose leading coefficient has size one and is not negative, to negative powers only.
    Sum(CanonicalForm),
    /// `form^(1/index)`, to powers below the index.
    Root(CanonicalForm, u32),
    Log(CanonicalForm),
    Abs(CanonicalForm),
    Sign(CanonicalForm),
    Tan(CanonicalForm),
    Tanh(CanonicalForm),
    /// An expression that is too large to take apart, or has no value.
    Opaque(ExprId),
}

/// `prod_k atom_k^power_k * exp(sum_j c_j monomial_j)`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) struct Monomial {
    /// Atoms by their numbers, ascending, with powers that are not zero.
    pub(super) powers: Vec<(u32, i32)>,
    /// The exponential's argument, without radii.
    pub(super) exponent: CanonicalForm,
}

impl Monomial {
    pub(super) fn atom(atom: u32, power: i32) -> Self {
        Self {
            powers: vec![(atom, power)],
            exponent: CanonicalForm::default(),
        }
    }

    pub(super) fn is_one(&self) -> bool {
        self.powers.is_empty() && self.exponent.is_zero()
    }

    pub(super) fn power_of(&self, atom: u32) -> i32 {
        let found = self.powers.iter().find(|(known, _)| *known == atom);
        found.map_or(0, |(_, power)| *power)
    }

    pub(super) fn without(&self, atom: u32) -> Self {
        let mut rest = self.clone();
        rest.powers.retain(|(known, _)| *known != atom);
        rest
    }

    pub(super) fn times(&self, other: &Self) -> Self {
        let mut powers: BTreeMap<u32, i32> = self.powers.iter().copied().collect();
        for (atom, power) in &other.powers {
            let sum = powers.entry(*atom).or_insert(0);
            *sum = sum.saturating_add(*power);
        }
        powers.retain(|_, power| *power != 0);
        Self {
            powers: powers.into_iter().collect(),
            exponent: self.exponent.plus(&other.exponent),
        }
    }

    pub(super) fn reciprocal(&self) -> Self {
        let powers = self.powers.iter();
        Self {
            powers: powers
                .map(|(atom, power)| (*atom, power.saturating_neg()))
                .collect(),
            exponent: self.exponent.scaled(&Coefficient::integer(-1)),
        }
    }
}

/// A sum in normal form, made by [`CanonicalForms`](super::CanonicalForms).
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct CanonicalForm {
    pub(super) terms: BTreeMap<Monomial, Coefficient>,
}

impl CanonicalForm {
    pub(super) fn constant(coefficient: Coefficient) -> Self {
        Self::term(coefficient, Monomial::default())
    }

    pub(super) fn term(coefficient: Coefficient, monomial: Monomial) -> Self {
        let mut form = Self::default();
        form.add(coefficient, monomial);
        form
    }

    pub(super) fn one() -> Self {
        Self::monomial(Monomial::default())
    }

    pub(super) fn atom(atom: u32) -> Self {
        Self::monomial(Monomial::atom(atom, 1))
    }

    pub(super) fn monomial(monomial: Monomial) -> Self {
        Self::term(Coefficient::integer(1), monomial)
    }

    pub(super) fn exponential(exponent: CanonicalForm) -> Self {
        Self::monomial(Monomial {
            powers: Vec::new(),
            exponent,
        })
    }

    /// Adds a term. A coefficient of value zero is kept as long as it has a radius.
    pub(super) fn add(&mut self, coefficient: Coefficient, monomial: Monomial) {
        let sum = match self.terms.remove(&monomial) {
            Some(before) => before.plus(&coefficient),
            None => coefficient,
        };
        if !sum.is_zero() || sum.radius() > 0.0 {
            self.terms.insert(monomial, sum);
        }
    }

    /// Whether every coefficient has the value zero.
    pub fn is_zero(&self) -> bool {
        self.terms.values().all(Coefficient::is_zero)
    }

    /// Whether zero is among the sums that it may stand for, each coefficient taken by itself.
    pub fn may_be_zero(&self) -> bool {
        self.terms.values().all(Coefficient::may_be_zero)
    }

    /// The coefficients.
    pub fn coefficients(&self) -> impl Iterator<Item = &Coefficient> {
        self.terms.values()
    }

    pub(super) fn as_constant(&self) -> Option<Coefficient> {
        let mut terms = self.terms.iter();
        match (terms.next(), terms.next()) {
            (None, _) => Some(Coefficient::integer(0)),
            (Some((monomial, coefficient)), None) if monomial.is_one() => Some(coefficient.clone()),
            _ => None,
        }
    }

    pub(super) fn as_atom(&self) -> Option<u32> {
        let (coefficient, monomial) = self.as_term()?;
        match monomial.powers[..] {
            [(atom, 1)] if coefficient.is_one() && monomial.exponent.is_zero() => Some(atom),
            _ => None,
        }
    }

    pub(super) fn as_term(&self) -> Option<(&Coefficient, &Monomial)> {
        let mut terms = self.terms.iter();
        match (terms.next(), terms.next()) {
            (Some((monomial, coefficient)), None) => Some((coefficient, monomial)),
            _ => None,
        }
    }

    /// The form divided by size and sign of its leading coefficient, and these; nothing for zero, or where the size is
    /// beyond the range of floats.
    pub(super) fn normed(&self) -> Option<(Self, Coefficient, Coefficient)> {
        let leading = self.leading()?;
        let (size, sign) = (Coefficient::from(leading.size()), leading.sign());
        let factor = size.reciprocal()?.times(&sign);
        Some((self.scaled(&factor), size, sign))
    }

    pub(super) fn leading(&self) -> Option<&Coefficient> {
        self.terms.values().next_back()
    }

    pub(super) fn has_radius(&self) -> bool {
        self.terms.values().any(|c| c.radius() > 0.0)
    }

    pub(super) fn exact(&self) -> Self {
        let terms = self.terms.iter().filter(|(_, c)| !c.is_zero());
        Self {
            terms: terms
                .map(|(monomial, c)| (monomial.clone(), c.exact()))
                .collect(),
        }
    }

    pub(super) fn scaled(&self, factor: &Coefficient) -> Self {
        let mut scaled = Self::default();
        for (monomial, coefficient) in &self.terms {
            scaled.add(coefficient.times(factor), monomial.clone());
        }
        scaled
    }

    pub(crate) fn plus(&self, other: &Self) -> Self {
        let (mut sum, rest) = match self.terms.len() >= other.terms.len() {
            true => (self.clone(), other),
            false => (other.clone(), self),
        };
        for (monomial, coefficient) in &rest.terms {
            sum.add(coefficient.clone(), monomial.clone());
        }
        sum
    }

    /// `self - other`.
    pub fn minus(&self, other: &Self) -> Self {
        self.plus(&other.scaled(&Coefficient::integer(-1)))
    }

    pub(super) fn products(&self, other: &Self) -> Option<Vec<(Coefficient, Monomial)>> {
        let count = self.terms.len().checked_mul(other.terms.len())?;
        if count > MAX_PRODUCTS {
            return None;
        }
        let mut products = Vec::with_capacity(count);
        for (monomial, coefficient) in &self.terms {
            for (other_monomial, other_coefficient) in &other.terms {
                products.push((
                    coefficient.times(other_coefficient),
                    monomial.times(other_monomial),
                ));
            }
        }
        Some(products)
    }

    pub(super) fn is_small(&self) -> bool {
        self.terms.len() <= MAX_TERMS
    }
}
