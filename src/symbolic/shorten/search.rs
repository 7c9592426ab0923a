//! The replacements of a sum, group by group.

use std::collections::HashMap;

use super::Summands;
use crate::symbolic::cost::Costs;
use crate::symbolic::intern::BuildIdHasher;
use crate::symbolic::node::{ExprId, Function, Node, SymbolId};
use crate::symbolic::number::Number;
use crate::symbolic::pool::ExprPool;

/// Most rounds of searching for groups.
const MAX_ROUNDS: usize = 4;
/// Relative error that evaluation at a point may have.
const EVALUATION: f64 = 1e-11;

/// Ranges of points where exponentials are beyond floats.
const FAR: [(f64, f64); 2] = [(990.0, 1010.0), (-1010.0, -990.0)];
/// Ranges from which the variables of the points are taken.
const POINTS: [(f64, f64); 6] = [
    (0.11, 1.03),
    (1.27, 2.9),
    (-1.03, 1.4),
    (-2.71, -0.2),
    (-0.3, 0.1),
    (2.13, 5.9),
];

/// Summands that a shorter form takes the place of.
#[derive(Clone, Debug, PartialEq)]
pub struct Shortened {
    /// Positions of the replaced summands, ascending.
    pub replaced: Vec<usize>,
    /// What they are together; nothing if they cancel.
    pub by: Vec<(f64, ExprId)>,
}

/// Shortens sums over one pool, and remembers what it found about their terms.
#[derive(Debug)]
pub struct Shortener<'a> {
    pub(super) pool: &'a mut ExprPool,
    pub(super) costs: Costs,
    singles: HashMap<ExprId, ExprId, BuildIdHasher>,
    pub(super) plain: HashMap<ExprId, bool, BuildIdHasher>,
    /// By term and by the sum of all waves beside it.
    pub(super) monomials: HashMap<(ExprId, ExprId), Vec<ExprId>>,
}

/// How far terms are looked for that can interact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reach {
    /// Those whose normal forms share a monomial that is not the constant one, or a denominator.
    Near,
    /// Those that share a constant too, or have denominators of the same variables.
    Far,
}

fn blocks_of(summands: &[(f64, ExprId)]) -> Vec<Block> {
    (summands.iter().enumerate())
        .map(|(position, &summand)| Block {
            positions: vec![position],
            summands: vec![summand],
            is_new: false,
        })
        .collect()
}

/// Summands that stand for those of the original sum at some positions.
pub(super) struct Block {
    positions: Vec<usize>,
    pub(super) summands: Summands,
    is_new: bool,
}

impl<'a> Shortener<'a> {
    /// A shortener of sums over `pool`.
    pub fn new(pool: &'a mut ExprPool) -> Self {
        Self {
            pool,
            costs: Costs::default(),
            singles: HashMap::default(),
            plain: HashMap::default(),
            monomials: HashMap::new(),
        }
    }

    /// The pool, with the expressions that were made.
    pub fn pool(&self) -> &ExprPool {
        self.pool
    }

    /// The replacements that make `sum coefficient * expr` shortest, in the order of the first
    /// positions they replace; none if it is short already.
    pub fn shorten(&mut self, summands: &[(f64, ExprId)]) -> Vec<Shortened> {
        if self.is_plain_sum(summands) && self.parts_of_powers(summands).is_empty() {
            return Vec::new();
        }
        let mut blocks = blocks_of(summands);
        if let Some((whole, angles)) = self.whole_angles(summands) {
            blocks = blocks_of(&whole);
            self.run(&mut blocks, &whole);
            for block in &mut blocks {
                for (_, expr) in &mut block.summands {
                    *expr = self.pool.substitute(*expr, &angles);
                }
                if !block.is_new {
                    block.summands = vec![summands[block.positions[0]]];
                }
            }
        }
        self.run(&mut blocks, summands);
        let new = blocks.into_iter().filter(|block| block.is_new);
        let mut found: Vec<Shortened> = new
            .map(|block| Shortened {
                replaced: block.positions,
                by: block.summands,
            })
            .collect();
        found.sort_by(|a, b| a.replaced.cmp(&b.replaced));
        found
    }

    /// Shortens group after group: first those that share a term, then all that can interact.
    fn run(&mut self, blocks: &mut Vec<Block>, summands: &[(f64, ExprId)]) {
        for _ in 0..MAX_ROUNDS {
            let is_changed = [Reach::Near, Reach::Far].into_iter().any(|reach| {
                let mut is_changed = false;
                for group in self.groups(blocks, reach) {
                    is_changed |= self.shorten_group(blocks, &group, summands);
                }
                blocks.retain(|block| !block.positions.is_empty());
                is_changed
            });
            if !is_changed {
                break;
            }
        }
    }

    /// The summands with a variable of its own in the place of each sum that is an angle, and these sums;
    /// nothing if no angle is one. So what is true of one angle is found before angles are taken apart.
    fn whole_angles(
        &mut self,
        summands: &[(f64, ExprId)],
    ) -> Option<(Summands, Vec<(SymbolId, ExprId)>)> {
        let exprs: Vec<ExprId> = summands.iter().map(|&(_, expr)| expr).collect();
        let order = self.pool.reachable(&exprs);
        let mut families: Vec<(ExprId, Vec<(Number, ExprId)>)> = Vec::new();
        for &expr in &order {
            let Node::Apply(Function::Sin | Function::Cos | Function::Tan, angle) =
                *self.pool.node(expr)
            else {
                continue;
            };
            let (outer, inner) = self.pool.split(angle);
            let terms = self.pool.terms_of(inner);
            let Some(&(first, _)) = terms.get(1).and(terms.first()) else {
                continue;
            };
            let Some(factor) = outer.checked_mul(first) else {
                continue;
            };
            let monic: Option<Vec<ExprId>> = (terms.into_iter())
                .map(|(number, rest)| Some(self.pool.scale(number.checked_div(first)?, rest)))
                .collect();
            let Some(monic) = monic else { continue };
            let monic = self.pool.sum(&monic);
            match families.iter_mut().find(|(known, _)| *known == monic) {
                Some((_, angles)) => angles.push((factor, angle)),
                None => families.push((monic, vec![(factor, angle)])),
            }
        }
        let mut variables = Vec::new();
        let mut replaced: HashMap<ExprId, ExprId, BuildIdHasher> = HashMap::default();
        for (place, (monic, angles)) in families.into_iter().enumerate() {
            let least = angles.iter().map(|(factor, _)| factor.abs()).min()?;
            let angle: Option<Vec<ExprId>> = (self.pool.terms_of(monic).into_iter())
                .map(|(number, rest)| Some(self.pool.scale(number.checked_mul(least)?, rest)))
                .collect();
            let Some(angle) = angle else { continue };
            // No file has a variable of this name.
            let variable = self.pool.symbol_id(&format!(" angle {place}"));
            let symbol = self.pool.symbol_expr(variable);
            for (factor, angle) in angles {
                let multiple = factor.checked_div(least);
                if let Some(multiple) = multiple.filter(|multiple| multiple.as_integer().is_some())
                {
                    replaced.insert(angle, self.pool.scale(multiple, symbol));
                }
            }
            variables.push((variable, self.pool.sum(&angle)));
        }
        if replaced.is_empty() {
            return None;
        }
        for expr in order {
            if !replaced.contains_key(&expr) {
                let known = &replaced;
                let operand = |child: ExprId| known.get(&child).copied().unwrap_or(child);
                let new = self.pool.rebuild(expr, operand);
                replaced.insert(expr, new);
            }
        }
        let whole = summands.iter().map(|(c, expr)| (*c, replaced[expr]));
        Some((whole.collect(), variables))
    }

    /// Whether the terms are distinct monomials that cannot interact.
    fn is_plain_sum(&mut self, summands: &[(f64, ExprId)]) -> bool {
        let mut seen = std::collections::HashSet::with_hasher(BuildIdHasher::default());
        (summands.iter()).all(|&(_, expr)| seen.insert(expr) && self.is_plain(expr))
    }

    /// Whether a term is a product of variables to integer powers and at most one function of a
    /// variable, without a number.
    pub(super) fn is_plain(&mut self, expr: ExprId) -> bool {
        let pool = &self.pool;
        *self.plain.entry(expr).or_insert_with(|| {
            if expr == ExprId::ONE {
                return true;
            }
            let mut n_functions = 0;
            (pool.factors_of(expr).iter()).all(|&factor| match *pool.node(factor) {
                Node::Symbol(_) => true,
                // Logarithms of different variables become one.
                Node::Apply(Function::Log, _) => false,
                // Signs and magnitudes merge with their variables.
                Node::Apply(Function::Sign | Function::Abs, _) if factor != expr => false,
                Node::Apply(_, argument) => {
                    n_functions += 1;
                    n_functions < 2 && pool.as_symbol(argument).is_some()
                }
                Node::Power(base, exponent) => {
                    let exponent = pool.as_number(exponent).and_then(Number::as_integer);
                    exponent.is_some() && pool.as_symbol(base).is_some()
                }
                Node::Number(_) | Node::Sum(_) | Node::Product(_) => false,
            })
        })
    }

    /// The term alone in its shortest form.
    pub(super) fn single(&mut self, expr: ExprId) -> ExprId {
        if self.is_plain(expr) {
            return expr;
        }
        if let Some(&known) = self.singles.get(&expr) {
            return known;
        }
        let single = self.pool.simplify(expr);
        self.singles.insert(expr, single);
        single
    }

    /// Replaces the blocks of a group by one, if that is shorter.
    fn shorten_group(
        &mut self,
        blocks: &mut [Block],
        group: &[usize],
        original: &[(f64, ExprId)],
    ) -> bool {
        let old: Summands = (group.iter())
            .flat_map(|&place| blocks[place].summands.iter().copied())
            .collect();
        let mut positions: Vec<usize> = (group.iter())
            .flat_map(|&place| blocks[place].positions.iter().copied())
            .collect();
        positions.sort_unstable();
        let Some(new) = self.shortest(&old) else {
            return false;
        };
        let replaced: Summands = positions.iter().map(|&place| original[place]).collect();
        if !self.agrees(&replaced, &new) {
            return false;
        }
        for &place in &group[1..] {
            blocks[place].positions.clear();
            blocks[place].is_new = false;
        }
        blocks[group[0]] = Block {
            positions,
            summands: new,
            is_new: true,
        };
        true
    }

    /// Whether two sums have the same values, up to rounding, at all points tried where the first
    /// has one.
    fn agrees(&self, old: &Summands, new: &Summands) -> bool {
        let value = |summands: &Summands, low: f64, high: f64| {
            let exprs: Vec<ExprId> = summands.iter().map(|&(_, expr)| expr).collect();
            let values = self.pool.evaluate_all(&exprs, &|symbol| {
                // Multiples of the golden ratio fill an interval evenly.
                let place = (symbol.index() as f64 + 1.0) * 0.618_033_988_749_894_9;
                low + (high - low) * (place + low.abs()).fract()
            });
            let products = values.iter().zip(summands).map(|(value, (c, _))| value * c);
            products.fold((0.0, 0.0), |(sum, size), p: f64| (sum + p, size + p.abs()))
        };
        let near = POINTS.into_iter().all(|(low, high)| {
            let ((a, size_a), (b, size_b)) = (value(old, low, high), value(new, low, high));
            !a.is_finite() || (a - b).abs() <= EVALUATION * (size_a + size_b)
        });
        // `1 - 1/(1 + exp(z))` has values where `exp(z)/(1 + exp(z))` is infinity over infinity in floats.
        near && FAR.into_iter().all(|(low, high)| {
            let is_finite = |summands| value(summands, low, high).0.is_finite();
            !is_finite(old) || is_finite(new)
        })
    }
}
