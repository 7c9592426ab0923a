//! The replacements of a sum, group by group.

use super::forms::{NestedSums, collected};
use super::groups::Link;
use super::*;
use crate::cost::Costs;

const MAX_ROUNDS: usize = 4;

/// Summands that a shorter form replaces.
#[derive(Clone, Debug, PartialEq)]
pub struct Shortened {
    /// Positions of the replaced summands, ascending.
    pub replaced: Vec<usize>,
    /// Their sum in shorter form; empty if they cancel.
    pub by: Vec<(f64, ExprId)>,
}

/// Shortens sums over one pool, and caches results about their terms.
#[derive(Debug)]
pub struct Shortener<'a> {
    pub pool: &'a mut ExprPool,
    pub(super) costs: Costs,
    singles: IdMap<ExprId>,
    pub(super) plain: IdMap<bool>,
    pub(super) links: HashMap<(ExprId, ExprId), Vec<Link>>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Distance {
    /// Those whose normal forms share a monomial that is not the constant one, or a denominator.
    Near,
    /// Those that share a constant too, or have denominators of the same variables.
    Far,
}

/// Summands with variables for parts, and these parts.
type Seen = (Summands, Vec<(SymbolId, ExprId)>);

type View<'a> = fn(&mut Shortener<'a>, &[(f64, ExprId)]) -> Option<Seen>;

fn blocks_of(summands: &[(f64, ExprId)]) -> Vec<Block> {
    (summands.iter().enumerate())
        .map(|(position, &summand)| Block {
            positions: vec![position],
            summands: vec![summand],
            is_new: false,
        })
        .collect()
}

pub(super) struct Block {
    positions: Vec<usize>,
    pub(super) summands: Summands,
    is_new: bool,
}

/// Puts blocks together at the place of the first, with new summands; the others lose their positions.
fn merge(blocks: &mut [Block], places: &[usize], summands: Summands) {
    let mut positions = Vec::new();
    for &place in places {
        positions.append(&mut blocks[place].positions);
    }
    positions.sort_unstable();
    blocks[places[0]] = Block {
        positions,
        summands,
        is_new: true,
    };
}

impl<'a> Shortener<'a> {
    pub fn new(pool: &'a mut ExprPool) -> Self {
        Self {
            pool,
            costs: Costs::default(),
            singles: IdMap::default(),
            plain: IdMap::default(),
            links: HashMap::new(),
        }
    }

    /// The replacements that make `sum coefficient * expr` shortest, ordered by first position; none if it is short.
    pub fn shorten(&mut self, summands: &[(f64, ExprId)]) -> Vec<Shortened> {
        let mut seen = IdSet::default();
        let is_plain = |&(_, expr): &(f64, ExprId)| seen.insert(expr) && self.is_plain(expr);
        if summands.iter().all(is_plain) && self.parts_of_powers(summands).is_empty() {
            return Vec::new();
        }
        let searched = summands.iter().filter(|(_, expr)| !self.is_plain(*expr));
        let n_searched = searched.count().max(1);
        let outer = (self.pool).limit_work(2 * MAX_WORK * n_searched as u64);
        let mut blocks = blocks_of(summands);
        for _ in 0..MAX_ROUNDS {
            let mut is_changed = false;
            let unchanged: View<'a> = |_, summands| Some((summands.to_vec(), Vec::new()));
            for view in [Self::whole_factors, Self::whole_angles, unchanged] {
                is_changed |= self.pass(&mut blocks, view);
            }
            if !is_changed {
                break;
            }
        }
        self.pool.work_limit = outer;
        // Agreement of each step does not imply agreement of the result: parts were replaced by variables.
        let new = blocks.into_iter().filter(|block| {
            let replaced = block.positions.iter().map(|&at| summands[at]).collect();
            block.is_new && Agreement::with(self.pool, &replaced).holds(self.pool, &block.summands)
        });
        let mut found: Vec<Shortened> = new
            .map(|block| Shortened {
                replaced: block.positions,
                by: block.summands,
            })
            .collect();
        found.sort_by(|a, b| a.replaced.cmp(&b.replaced));
        found
    }

    fn pass(&mut self, blocks: &mut Vec<Block>, view: View<'a>) -> bool {
        let flat: Vec<(usize, (f64, ExprId))> = (blocks.iter().enumerate())
            .flat_map(|(place, block)| block.summands.iter().map(move |&summand| (place, summand)))
            .collect();
        let written: Summands = flat.iter().map(|&(_, summand)| summand).collect();
        let Some((summands, parts)) = view(self, &written) else {
            return false;
        };
        let mut found = blocks_of(&summands);
        self.run(&mut found, &summands);
        let mut is_changed = false;
        let mut moved: Vec<usize> = (0..blocks.len()).collect();
        for new in found.into_iter().filter(|block| block.is_new) {
            let written_out: Option<Scaled> = (new.summands.into_iter())
                .map(|(c, expr)| Some((Number::from_f64(c)?, self.pool.substitute(expr, &parts))))
                .collect();
            let Some(written_out) = written_out else {
                continue;
            };
            let by = collected(self.pool, &written_out, NestedSums::Kept).into_iter();
            let mut by: Summands = by.map(|(number, expr)| (number.to_f64(), expr)).collect();
            let lost: Summands = new.positions.iter().map(|&at| written[at]).collect();
            let mut length =
                |summands: &Summands| (self.costs).of_terms(self.pool, summands.iter().copied());
            if length(&by) > length(&lost) {
                continue;
            }
            is_changed = true;
            // The blocks that lost a summand become one, with their remaining summands.
            let mut places: Vec<usize> = (new.positions.iter())
                .map(|&at| moved[flat[at].0])
                .collect();
            places.sort_unstable();
            places.dedup();
            for place in &mut moved {
                if places.contains(place) {
                    *place = places[0];
                }
            }
            let taken = places
                .iter()
                .flat_map(|&place| std::mem::take(&mut blocks[place].summands));
            let mut left: Summands = taken.collect();
            for summand in lost {
                if let Some(at) = left.iter().position(|known| *known == summand) {
                    left.remove(at);
                }
            }
            by.extend(left);
            merge(blocks, &places, by);
        }
        blocks.retain(|block| !block.positions.is_empty());
        is_changed
    }

    fn run(&mut self, blocks: &mut Vec<Block>, summands: &[(f64, ExprId)]) {
        for _ in 0..MAX_ROUNDS {
            let is_changed = [Distance::Near, Distance::Far].into_iter().any(|distance| {
                let mut is_changed = false;
                for group in self.groups(blocks, distance) {
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

    /// The summands with variables for sums that are angles, and these sums. This finds identities of an angle as a
    /// whole.
    fn whole_angles(&mut self, summands: &[(f64, ExprId)]) -> Option<Seen> {
        let exprs: Vec<ExprId> = summands.iter().map(|&(_, expr)| expr).collect();
        let order = self.pool.reachable(&exprs);
        let mut families: Vec<(ExprId, Vec<(Number, ExprId)>)> = Vec::new();
        for &expr in &order {
            let angle = match *self.pool.node(expr) {
                Node::Apply(function, angle) if function.is_circular() => angle,
                _ => continue,
            };
            let (factor, monic) = self.pool.content(angle);
            if !matches!(self.pool.node(monic), Node::Sum(_)) {
                continue;
            }
            match families.iter_mut().find(|(known, _)| *known == monic) {
                Some((_, angles)) => angles.push((factor, angle)),
                None => families.push((monic, vec![(factor, angle)])),
            }
        }
        let mut variables = Vec::new();
        let mut replaced: IdMap<ExprId> = IdMap::default();
        for (place, (monic, angles)) in families.into_iter().enumerate() {
            let least = angles.iter().map(|(factor, _)| factor.abs()).min()?;
            // `cos(2*a)` may be a square of `cos(a)`.
            let half = least.checked_mul(Number::HALF);
            let least = half.filter(|_| least.is_even()).unwrap_or(least);
            let factor = self.pool.constant(least);
            let unit = self.pool.expanded_product(factor, monic);
            let variable = self.pool.placeholder("angle", place);
            let symbol = self.pool.symbol_expr(variable);
            for (factor, angle) in angles {
                let multiple = factor.checked_div(least);
                if let Some(multiple) = multiple.filter(|multiple| multiple.as_integer().is_some())
                {
                    replaced.insert(angle, self.pool.scale(multiple, symbol));
                }
            }
            variables.push((variable, unit));
        }
        if replaced.is_empty() {
            return None;
        }
        let whole = self.pool.replace(&exprs, order, replaced);
        let whole = summands.iter().zip(whole).map(|((c, _), expr)| (*c, expr));
        Some((whole.collect(), variables))
    }

    /// The summands with a variable for each sum that is a factor, and for each function other than waves that is a
    /// factor of several terms. `(a + b)^2*sin(c)^2` is searched as `f^2*sin(c)^2`.
    fn whole_factors(&mut self, summands: &[(f64, ExprId)]) -> Option<Seen> {
        let mut n_terms: IdMap<usize> = IdMap::default();
        for &(_, expr) in summands {
            for &factor in self.pool.factors_of(expr) {
                *n_terms.entry(factor).or_insert(0) += 1;
            }
        }
        let mut parts: Vec<(SymbolId, ExprId)> = Vec::new();
        let mut whole = Summands::new();
        for &(coefficient, expr) in summands {
            let mut factors = self.pool.factors_of(expr).to_vec();
            for factor in &mut factors {
                let (base, exponent) = self.pool.base_and_exponent(*factor);
                let (part, exponent) = match (self.pool.node(base), exponent) {
                    (_, Exponent::Number(exponent)) if exponent.is_negative() => continue,
                    (Node::Sum(_), Exponent::Number(exponent)) => (base, exponent),
                    (Node::Apply(function, _), _) if function.is_circular() => continue,
                    (Node::Symbol(_), Exponent::Number(exponent))
                        if exponent.as_integer().is_some() =>
                    {
                        continue;
                    }
                    _ if n_terms[factor] < 2 => continue,
                    _ => (*factor, Number::ONE),
                };
                let known = parts.iter().position(|(_, known)| *known == part);
                let place = known.unwrap_or_else(|| {
                    parts.push((self.pool.placeholder("factor", parts.len()), part));
                    parts.len() - 1
                });
                let symbol = self.pool.symbol_expr(parts[place].0);
                *factor = self.pool.pow_number(symbol, exponent);
            }
            whole.push((coefficient, self.pool.product(&factors)));
        }
        (!parts.is_empty()).then_some((whole, parts))
    }

    /// Whether a term is integer powers of variables times at most one function of a variable, without a number.
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
                    pool.as_integer(exponent).is_some() && pool.as_symbol(base).is_some()
                }
                Node::Number(_) | Node::Sum(_) | Node::Product(_) => false,
            })
        })
    }

    pub(super) fn single(&mut self, expr: ExprId) -> ExprId {
        if self.is_plain(expr) {
            return expr;
        }
        if let Some(&known) = self.singles.get(&expr) {
            return known;
        }
        let mut single = self.pool.simplify(expr);
        let agreement = || Agreement::with(self.pool, &vec![(1.0, expr)]);
        if single != expr && !agreement().holds(self.pool, &vec![(1.0, single)]) {
            single = expr;
        }
        self.singles.insert(expr, single);
        single
    }

    fn shorten_group(
        &mut self,
        blocks: &mut [Block],
        group: &[usize],
        original: &[(f64, ExprId)],
    ) -> bool {
        let (mut old, mut positions) = (Summands::new(), Vec::<usize>::new());
        for &place in group {
            old.extend(&blocks[place].summands);
            positions.extend(&blocks[place].positions);
        }
        positions.sort_unstable();
        let replaced: Summands = positions.iter().map(|&place| original[place]).collect();
        let new = self.shortest(&old, &replaced);
        new.map(|new| merge(blocks, group, new)).is_some()
    }
}
