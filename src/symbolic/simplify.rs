//! Simplification: the shortest of several equal forms.
//!
//! A region (see `region.rs`) is brought to a normal form, in which equal expressions tend to
//! coincide: multiplied out, angles expanded, sines reduced to cosines, exponentials and
//! logarithms merged, over a common denominator. From it a few shorter forms are derived: with
//! sines for cosines angle by angle, with angles combined. The one with the least
//! [`cost`](ExprPool::cost) replaces the region, if it is shorter than what was there.
//!
//! **Termination.** Every accepted step lowers the cost, a natural number. The work of one step
//! is bounded by the number of nodes and by budgets of term products ([`SimplifyLimits`]); what
//! exceeds them is left as it is.
//!
//! **Idempotence.** A result is returned once no further step lowers its cost, so simplifying it
//! again returns it.
//!
//! **Values.** All rewritings keep the value wherever the expression has one, up to rounding (see
//! [`ExprPool`]). Floats are added and multiplied when terms are collected; exact numbers stay
//! exact. Nothing is rounded to fewer digits, and no term is dropped for being small.

use super::cost::Costs;
use super::expand::ExpandLimits;
use super::node::{ExprId, Function, Node};
use super::pool::ExprPool;

/// Most angles whose squares are tried both as sines and as cosines.
const MAX_CHOICES: usize = 4;

/// How much one simplification may do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SimplifyLimits {
    /// Limits of multiplying out, per step.
    pub expand: ExpandLimits,
    /// Rounds of rewriting on the way to a normal form.
    pub rounds: usize,
}

impl Default for SimplifyLimits {
    fn default() -> SimplifyLimits {
        SimplifyLimits {
            expand: ExpandLimits {
                terms: 2_000,
                products: 100_000,
            },
            rounds: 6,
        }
    }
}

impl ExprPool {
    /// An equal expression that is shorter, or `expr` itself.
    pub fn simplify(&mut self, expr: ExprId) -> ExprId {
        self.simplify_within(expr, SimplifyLimits::default())
    }

    /// As [`simplify`](ExprPool::simplify), within given limits.
    pub fn simplify_within(&mut self, expr: ExprId, limits: SimplifyLimits) -> ExprId {
        let mut costs = Costs::default();
        let mut best = expr;
        loop {
            let mut budget = limits.expand.products;
            let next = self.map_regions(best, |pool, region| {
                pool.cheapest_form(region, limits, &mut budget, &mut costs)
            });
            if costs.of(self, next) >= costs.of(self, best) {
                return best;
            }
            best = next;
        }
    }

    /// Whether `a - b` was shown to be zero. `false` means that no proof was found, not that the
    /// two differ.
    pub fn is_equivalent(&mut self, a: ExprId, b: ExprId) -> bool {
        let limits = SimplifyLimits::default();
        let mut difference = self.sub(a, b);
        for _ in 0..limits.rounds {
            let mut budget = limits.expand.products;
            let next = self.map_regions(difference, |pool, region| {
                pool.normal_form(region, limits, &mut budget)
            });
            if next == ExprId::ZERO {
                return true;
            }
            if next == difference {
                return false;
            }
            difference = next;
        }
        false
    }

    /// The cheapest of the forms of one region; the region itself unless one is cheaper.
    fn cheapest_form(
        &mut self,
        region: ExprId,
        limits: SimplifyLimits,
        budget: &mut usize,
        costs: &mut Costs,
    ) -> ExprId {
        if self.as_number(region).is_some() || self.as_symbol(region).is_some() {
            return region;
        }
        let mut best = region;
        let mut best_cost = costs.of(self, region);
        for form in self.forms(region, limits, budget) {
            let cost = costs.of(self, form);
            if cost < best_cost {
                (best, best_cost) = (form, cost);
            }
        }
        best
    }

    /// Forms equal to `region`, in a fixed order.
    pub(super) fn forms(
        &mut self,
        region: ExprId,
        limits: SimplifyLimits,
        budget: &mut usize,
    ) -> Vec<ExprId> {
        let normal = self.normal_form(region, limits, budget);
        let mut plain = vec![normal];
        if self.has_waves(normal) {
            plain.extend(self.with_sines(normal, limits, budget));
            plain.push(self.combine_angles(normal));
        }
        plain.push(self.expand_region(region, limits, budget));
        plain.push(region);
        let mut forms = Vec::new();
        for form in plain {
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

    /// The forms that have sines instead of cosines of some of the angles with squares.
    fn with_sines(
        &mut self,
        normal: ExprId,
        limits: SimplifyLimits,
        budget: &mut usize,
    ) -> Vec<ExprId> {
        let angles = self.squared_angles(normal);
        let n_choices = 1_usize << angles.len().min(MAX_CHOICES);
        let mut forms = Vec::new();
        for choice in 1..n_choices {
            let is_chosen = |angle: ExprId| {
                let place = angles.iter().position(|known| *known == angle);
                place.is_none_or(|place| choice >> place.min(MAX_CHOICES - 1) & 1 == 1)
            };
            let sines = self.reduce_powers(normal, Function::Cos, Function::Sin, is_chosen);
            forms.push(self.expand_region(sines, limits, budget));
        }
        forms
    }

    /// The normal form of one region, after a bounded number of rounds.
    pub(super) fn normal_form(
        &mut self,
        region: ExprId,
        limits: SimplifyLimits,
        budget: &mut usize,
    ) -> ExprId {
        let mut form = region;
        for _ in 0..limits.rounds {
            let before = form;
            form = self.rewrite_region(form, ExprPool::normal_rules);
            if self.has_waves(form) {
                form = self.expand_angles(form);
                form = self.sines_to_cosines(form);
            }
            form = self.expand_region(form, limits, budget);
            form = self.together_spending(form, limits.expand.terms, budget);
            if form == before {
                break;
            }
        }
        form
    }

    pub(super) fn expand_region(
        &mut self,
        region: ExprId,
        limits: SimplifyLimits,
        budget: &mut usize,
    ) -> ExprId {
        self.rewrite_region(region, |pool, node| {
            pool.expand_node(node, limits.expand.terms, budget)
        })
    }

    /// Whether sines, cosines or tangents are among the atoms of a region.
    pub(super) fn has_waves(&self, region: ExprId) -> bool {
        self.atoms_of(region).into_iter().any(|atom| {
            matches!(
                self.node(atom),
                Node::Apply(Function::Sin | Function::Cos | Function::Tan, _)
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn simplified(text: &str) -> String {
        let mut pool = ExprPool::new();
        let expr = pool.parse(text, &|_| true).expect("test text parses");
        let result = pool.simplify(expr);
        assert_eq!(pool.simplify(result), result, "{text} is not stable");
        pool.display(result).to_string()
    }

    #[test]
    fn simplify_finds_short_forms() {
        for (text, expected) in [
            ("sin(x)^2 + cos(x)^2", "1"),
            ("2*sin(x)*cos(x)", "sin(2*x)"),
            ("cos(x)^2 - sin(x)^2", "cos(2*x)"),
            ("exp(2*log(x))", "x^2"),
            ("2 - sin(x)^2 - cos(y)^2", "sin(y)^2 + cos(x)^2"),
            ("1 + tan(x)^2", "1/cos(x)^2"),
            ("tan(x)*cos(x)", "sin(x)"),
            ("log(exp(x)*exp(y))", "x + y"),
            ("(x + y)^2 - x^2 - y^2", "2*x*y"),
            ("x/(x + y) + y/(x + y)", "1"),
            ("sin(x)/cos(x)", "tan(x)"),
            ("1 - sin(x)^2", "cos(x)^2"),
            ("exp(x)*exp(y)", "exp(x + y)"),
            ("sin((x + 1)^2 - x^2 - 2*x)", "sin(1)"),
            ("log(x) + log(y)", "log(x*y)"),
            ("abs(x)*sign(x)", "x"),
        ] {
            assert_eq!(simplified(text), expected, "{text}");
        }
    }

    #[test]
    fn simplify_leaves_what_is_short_already() {
        for text in [
            "0.36 - 0.16*dz1 - 0.91*dz2 - 0.75*sin(dz1)",
            "(x + y)^5",
            "x*y + x*z",
            "sin(x) + cos(x)",
            "0.3*sin(x)^2",
            "sqrt(x^2 + y^2)",
            "x^a",
            "0^-1",
        ] {
            assert_eq!(simplified(text), text);
        }
    }

    #[test]
    fn simplify_of_hostile_input_is_bounded() {
        for text in [
            "(a + b + c + d + e)^1000",
            "(a + b)^1000*(a - b)^1000",
            "1/((a + 1)^50 + (b + 1)^50) + 1/((c + 1)^50 + (d + 1)^50)",
            "sin(1000*x)^1000*cos(x)^1000",
            "exp(exp(exp(exp(exp(x)))))^1000",
        ] {
            let mut pool = ExprPool::new();
            let expr = pool.parse(text, &|_| true).expect("test text parses");
            let result = pool.simplify(expr);
            assert!(pool.cost(result) <= pool.cost(expr), "{text}");
        }
    }

    #[test]
    fn simplify_of_deep_nesting_takes_linear_work() {
        let mut pool = ExprPool::new();
        let x = pool.symbol("x");
        let mut deep = x;
        for _ in 0..3_000 {
            let sine = pool.apply(Function::Tanh, deep);
            deep = pool.add(sine, x);
        }
        assert_eq!(pool.simplify(deep), deep);
        assert!(pool.len() < 100_000, "{} expressions were made", pool.len());
    }

    #[test]
    fn is_equivalent_proves_identities_and_only_these() {
        let mut pool = ExprPool::new();
        let mut check = |a: &str, b: &str| {
            let a = pool.parse(a, &|_| true).expect("test text parses");
            let b = pool.parse(b, &|_| true).expect("test text parses");
            pool.is_equivalent(a, b)
        };
        assert!(check("sin(x + y)", "sin(x)*cos(y) + cos(x)*sin(y)"));
        assert!(check("1/(1 + 1/x)", "x/(1 + x)"));
        assert!(!check("sin(x)", "cos(x)"));
        assert!(!check("sqrt(x^2)", "x"));
    }
}
