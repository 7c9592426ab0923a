//! Which summands can interact.

use std::collections::{BTreeMap, HashMap};

use super::search::{Block, Shortener};
use crate::symbolic::expand::MAX_PRODUCTS;
use crate::symbolic::intern::BuildIdHasher;
use crate::symbolic::node::{ExprId, Function, Node};
use crate::symbolic::number::Number;
use crate::symbolic::pool::ExprPool;

impl Shortener<'_> {
    /// Positions of blocks that can interact, or that are worth a look alone.
    pub(super) fn groups(&mut self, blocks: &[Block]) -> Vec<Vec<usize>> {
        let exprs: Vec<ExprId> = (blocks.iter())
            .flat_map(|block| block.summands.iter().map(|&(_, expr)| expr))
            .collect();
        let waves = self.all_angles(&exprs);
        let mut leader: Vec<usize> = (0..blocks.len()).collect();
        let mut owner: HashMap<ExprId, usize, BuildIdHasher> = HashMap::default();
        let mut is_plain = vec![true; blocks.len()];
        for (place, block) in blocks.iter().enumerate() {
            for &(_, expr) in &block.summands {
                is_plain[place] &= self.is_plain(expr);
                for monomial in self.monomials_of(expr, waves) {
                    let other = *owner.entry(monomial).or_insert(place);
                    let (a, b) = (root(&leader, place), root(&leader, other));
                    leader[a.max(b)] = a.min(b);
                }
            }
        }
        let mut groups: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for place in 0..blocks.len() {
            groups.entry(root(&leader, place)).or_default().push(place);
        }
        let is_worth = |group: &Vec<usize>| group.len() > 1 || !is_plain[group[0]];
        groups.into_values().filter(is_worth).collect()
    }

    /// A sum of one wave for each angle of the terms, which fixes the units of multiples.
    fn all_angles(&mut self, exprs: &[ExprId]) -> ExprId {
        let mut sines = Vec::new();
        for &expr in exprs {
            for atom in self.pool.atoms_of(expr) {
                if let Node::Apply(Function::Sin | Function::Cos | Function::Tan, angle) =
                    *self.pool.node(atom)
                {
                    sines.push(self.pool.apply(Function::Sin, angle));
                }
            }
        }
        sines.sort_unstable();
        sines.dedup();
        self.pool.sum(&sines)
    }

    /// The monomials of a term's normal forms.
    fn monomials_of(&mut self, expr: ExprId, waves: ExprId) -> Vec<ExprId> {
        let is_tangent =
            |factor: &ExprId| matches!(self.pool.node(*factor), Node::Apply(Function::Tan, _));
        if self.plain[&expr] && !self.pool.factors_of(expr).iter().any(is_tangent) {
            return vec![expr];
        }
        if let Some(known) = self.monomials.get(&(expr, waves)) {
            return known.clone();
        }
        let rests = |pool: &ExprPool, expr| {
            let terms = pool.terms_of(expr).into_iter();
            terms.map(|(_, rest)| rest).collect::<Vec<_>>()
        };
        let normal = self.normal(expr, waves);
        let expanded = self.pool.expand_region(normal, &mut MAX_PRODUCTS.clone());
        let mut monomials = rests(self.pool, expanded);
        if let Some((cofactor, _)) = self.pool.as_log_term(self.pool.split(expr).1) {
            // Terms with logarithms meet in a term that no model has.
            let minus_one = self.pool.constant(Number::MINUS_ONE);
            let common = self.pool.apply(Function::Log, minus_one);
            monomials.push(self.pool.product(&[cofactor, common]));
        }
        // Terms with the same denominator can be added.
        for base in self.denominators(expr) {
            monomials.push(self.pool.powi(base, -1));
        }
        monomials.extend(rests(self.pool, normal));
        if self.pool.has_waves(normal) {
            let combined = self.pool.combine_angles(normal);
            monomials.extend(rests(self.pool, combined));
        }
        monomials.extend(rests(self.pool, expr));
        monomials.push(self.pool.split(expr).1);
        self.monomials.insert((expr, waves), monomials.clone());
        monomials
    }

    /// The sums in the denominator of a term.
    pub(super) fn denominators(&self, expr: ExprId) -> Vec<ExprId> {
        let base = |factor: &ExprId| match *self.pool.node(*factor) {
            Node::Power(base, exponent) if matches!(self.pool.node(base), Node::Sum(_)) => {
                let exponent = self.pool.as_number(exponent)?;
                exponent.is_negative().then_some(base)
            }
            _ => None,
        };
        self.pool.factors_of(expr).iter().filter_map(base).collect()
    }

    /// The normal form of a term, with its angles in the units of all.
    pub(super) fn normal(&mut self, expr: ExprId, waves: ExprId) -> ExprId {
        let mut budget = MAX_PRODUCTS;
        let expanded = self.pool.expand_angles_like(expr, waves);
        self.pool.normal_form(expanded, &mut budget)
    }
}

fn root(leader: &[usize], mut place: usize) -> usize {
    while leader[place] != place {
        place = leader[place];
    }
    place
}
