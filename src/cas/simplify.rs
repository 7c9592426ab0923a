//! Simplification: the shortest of several equal forms. A region (see `region.rs`) is converted to a normal form, in
//! which equal expressions tend to coincide: multiplied out, angles expanded, sines reduced to cosines, exponentials
//! and logarithms merged, over a common denominator. A few shorter forms are derived from it. The one with the least
//! [`cost`](ExprPool::cost) replaces the region if it is shorter. Every accepted step lowers the cost, a natural
//! number, until none does: simplifying a result returns it. The work on one expression is bounded, counted in
//! constructors; expressions beyond the bound stay unchanged. All rewritings preserve the value wherever there is one,
//! up to rounding (see [`ExprPool`]); no term is dropped for being small.

use super::cost::Costs;
use super::*;

/// Most angles whose squares are tried both as sines and as cosines.
const MAX_CHOICES: usize = 4;

/// Most divisors below each other for which it is proven that a symbol may go.
const PROVEN_LEVELS: usize = 12;

pub(super) const MAX_WORK: u64 = 120_000;

/// Most rounds of rewriting on the way to a normal form.
const MAX_ROUNDS: usize = 6;

impl ExprPool {
    /// An equal expression that is shorter, or `expr` itself.
    pub fn simplify(&mut self, expr: ExprId) -> ExprId {
        let (mut costs, mut best) = (Costs::default(), expr);
        self.limited(MAX_WORK, |pool| {
            loop {
                let next =
                    pool.map_regions(best, |pool, region| pool.cheapest_form(region, &mut costs));
                if costs.of(pool, next) >= costs.of(pool, best) {
                    return best;
                }
                best = next;
            }
        })
    }

    fn cheapest_form(&mut self, region: ExprId, costs: &mut Costs) -> ExprId {
        if self.as_number(region).is_some() || self.as_symbol(region).is_some() {
            return region;
        }
        let mut forms = vec![region];
        forms.extend(self.forms(region));
        let cheapest = forms.into_iter().min_by_key(|form| costs.of(self, *form));
        cheapest.expect("the region is among them")
    }

    /// Forms equal to `region`, in a fixed order.
    pub(super) fn forms(&mut self, region: ExprId) -> Vec<ExprId> {
        let normal = self.normal_form(region);
        if !self.affords(1) {
            return vec![region];
        }
        let mut plain = vec![normal];
        if self.has_waves(normal) {
            let rational = self.rewrite_region(normal, ExprPool::without_sine_below);
            if rational != normal {
                plain.push(self.normal_form(rational));
            }
            plain.extend(self.with_sines(normal));
            plain.push(self.combine_angles(normal));
        }
        plain.push(self.rewrite_region(normal, ExprPool::shorter_sums));
        let expanded = self.expand_region(region);
        plain.extend(self.as_power(expanded));
        plain.push(expanded);
        plain.push(region);
        // Sines and cosines may have become factors of one divisor only now.
        for form in plain.clone() {
            if !self.affords(1) {
                break;
            }
            for combined in [self.combine_angles(form), self.combine_all_angles(form)] {
                if !plain.contains(&combined) {
                    plain.push(combined);
                }
            }
        }
        let mut forms = Vec::new();
        for form in plain {
            if !self.affords(1) {
                break;
            }
            let compact = self.rewrite_region(form, ExprPool::compact_rules);
            let merged = self.rewrite_region(compact, ExprPool::normal_rules);
            for form in [form, compact, merged] {
                if !forms.contains(&form) {
                    forms.push(form);
                }
            }
        }
        forms
    }

    /// A sum, or a product of divisors such as `(1 - x)*(1 + x)`, with fewer terms.
    fn shorter_sums(&mut self, expr: ExprId) -> ExprId {
        match self.node(expr) {
            Node::Sum(_) => self.shorter_sum(expr),
            Node::Product(factors) => {
                let is_divisor = |factor: &ExprId| matches!(self.sum_power(*factor), Some((_, -1)));
                let (divisors, mut rest): (Vec<ExprId>, Vec<ExprId>) =
                    factors.iter().partition(|factor| is_divisor(factor));
                let sums: Vec<ExprId> = (divisors.iter())
                    .map(|factor| self.base_and_exponent(*factor).0)
                    .collect();
                let product = self.product(&sums);
                let product = self.expand_region(product);
                let product = self.shorter_sum(product);
                let n_terms = |expr: &ExprId| self.terms_of(*expr).len();
                if n_terms(&product) >= sums.iter().map(n_terms).sum() {
                    return expr;
                }
                rest.push(self.powi(product, -1));
                self.product(&rest)
            }
            Node::Number(_) | Node::Symbol(_) | Node::Power(..) | Node::Apply(..) => expr,
        }
    }

    /// A sum as a power, or with sines for cosines, if it has fewer terms then.
    fn shorter_sum(&mut self, sum: ExprId) -> ExprId {
        if !matches!(self.node(sum), Node::Sum(_)) {
            return sum;
        }
        let mut forms = self.with_sines(sum);
        forms.extend(self.as_power(sum));
        let n_terms = |pool: &ExprPool, form| pool.terms_of(form).len();
        let shorter = forms.into_iter().min_by_key(|form| n_terms(self, *form));
        (shorter.filter(|form| n_terms(self, *form) < n_terms(self, sum))).unwrap_or(sum)
    }

    /// The forms that have sines instead of cosines of some of the angles with squares.
    fn with_sines(&mut self, normal: ExprId) -> Vec<ExprId> {
        let angles = self.squared_angles(normal);
        let n_choices = 1_usize << angles.len().min(MAX_CHOICES);
        let mut forms = Vec::new();
        for choice in 1..n_choices {
            if !self.affords(1) {
                break;
            }
            let is_chosen = |angle: ExprId| {
                let place = angles.iter().position(|known| *known == angle);
                place.is_none_or(|place| choice >> place.min(MAX_CHOICES - 1) & 1 == 1)
            };
            let sines = self.reduce_powers(normal, Function::Cos, Function::Sin, is_chosen);
            forms.push(self.expand_region(sines));
        }
        forms
    }

    pub(super) fn normal_form(&mut self, region: ExprId) -> ExprId {
        let mut form = region;
        for _ in 0..MAX_ROUNDS {
            if !self.affords(1) {
                break;
            }
            let before = form;
            form = self.rewrite_region(form, ExprPool::normal_rules);
            if self.has_waves(form) {
                form = self.expand_angles(form);
                form = self.sines_to_cosines(form);
            }
            form = self.expand_region(form);
            form = self.together(form);
            if form == before {
                break;
            }
            if self.is_lost_by_rounding(before, form) {
                return before;
            }
        }
        form
    }

    /// Whether a symbol vanished when fractions in a divisor were combined, and would not vanish in exact arithmetic.
    /// `0.3/(0.7 + 0.3/(0.7 + x))`, nested deep, would become 0.3, which is wrong at `x = -1`. Without a proof up to
    /// [`PROVEN_LEVELS`] the loss is attributed to rounding.
    fn is_lost_by_rounding(&self, before: ExprId, form: ExprId) -> bool {
        if self.have_same_symbols(before, form) {
            return false;
        }
        match self.levels_of_divisors(before) {
            0 | 1 => false,
            2..=PROVEN_LEVELS if self.affords(1) => {
                let mut forms = CanonicalForms::new(self, &[before, form]);
                let difference = &forms.of(before) - &forms.of(form);
                let difference = forms.without_fractions(&difference);
                difference.is_none_or(|difference| !difference.is_zero())
            }
            _ => true,
        }
    }

    fn levels_of_divisors(&self, expr: ExprId) -> usize {
        let levels = self.fold_up(&[expr], |pool, part, levels_of| {
            let (base, exponent) = pool.base_and_exponent(part);
            let is_divisor = matches!(exponent, Exponent::Number(number) if number.is_negative());
            let own = usize::from(is_divisor && matches!(pool.node(base), Node::Sum(_)));
            own + pool.children(part).map(levels_of).max().unwrap_or(0)
        });
        levels[0]
    }

    pub(super) fn has_waves(&self, region: ExprId) -> bool {
        let mut atoms = self.atoms_of(region).into_iter();
        atoms.any(|atom| matches!(self.node(atom), Node::Apply(f, _) if f.is_circular()))
    }
}
