//! The shortest form of a long sum with floating-point coefficients, such as an equation of a model.
//!
//! What can be said about one term alone is found by [`ExprPool::simplify`]. Then the terms that can
//! interact are found: each is brought to its normal form, and those whose normal forms have a
//! monomial in common, as powers or as sines and cosines of multiple angles, are a group. Only
//! groups are searched, and only a form that is shorter replaces one; all other terms keep their
//! bits and their places. A sum of monomials, each with at most one function of a variable, needs
//! no search at all, so that the time for long sums of these is linear.
//!
//! **Coefficients.** Those of a group that are small multiples of one of them, to a unit in the last
//! place, are taken as such multiples (`0.1` and `-0.3` are 1 and -3 times `0.1`); otherwise they
//! are the decimal fractions that are written for them, as far as these fit, and floats beyond.
//!
//! **Check.** Every replacement is evaluated at some points, beside what it replaces; one that
//! differs by more than rounding explains, or has no value where there was one, is dropped.

use std::collections::{BTreeMap, HashMap};

use super::cost::Costs;
use super::intern::BuildIdHasher;
use super::node::{ExprId, Function, Node};
use super::number::Number;
use super::pool::ExprPool;
use super::simplify::SimplifyLimits;

/// Most rounds of searching for groups.
const MAX_ROUNDS: usize = 4;
/// Largest group whose forms are searched, and largest whose terms are chosen one by one.
const MAX_GROUP: usize = 64;
const MAX_CHOSEN: usize = 16;
/// Largest numerator and denominator of a ratio of coefficients.
const MAX_NUMERATOR: f64 = 4096.0;
const MAX_DENOMINATOR: i32 = 64;
/// Largest decimal fractions that are taken as exact.
const MAX_DECIMALS: usize = 15;
/// Relative error that evaluation at a point may have.
const EVALUATION: f64 = 1e-11;

/// Ranges from which the variables of the points are taken.
const POINTS: [(f64, f64); 6] = [
    (0.11, 1.03),
    (1.27, 2.9),
    (-1.03, 1.4),
    (-2.71, -0.2),
    (-0.3, 0.1),
    (2.13, 5.9),
];

/// Summands `coefficient * expr`.
type Summands = Vec<(f64, ExprId)>;
/// The same with coefficients of a group's own.
type Scaled = Vec<(Number, ExprId)>;

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
    pool: &'a mut ExprPool,
    costs: Costs,
    singles: HashMap<ExprId, ExprId, BuildIdHasher>,
    plain: HashMap<ExprId, bool, BuildIdHasher>,
    /// By term and by the sum of all waves beside it.
    monomials: HashMap<(ExprId, ExprId), Vec<ExprId>>,
}

/// Summands that stand for those of the original sum at some positions.
struct Block {
    positions: Vec<usize>,
    summands: Summands,
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
        if self.is_plain_sum(summands) {
            return Vec::new();
        }
        let mut blocks: Vec<Block> = (summands.iter().enumerate())
            .map(|(position, &summand)| Block {
                positions: vec![position],
                summands: vec![summand],
                is_new: false,
            })
            .collect();
        for _ in 0..MAX_ROUNDS {
            let mut is_changed = false;
            for group in self.groups(&blocks) {
                is_changed |= self.shorten_group(&mut blocks, &group, summands);
            }
            blocks.retain(|block| !block.positions.is_empty());
            if !is_changed {
                break;
            }
        }
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

    /// Whether the terms are distinct monomials that cannot interact.
    fn is_plain_sum(&mut self, summands: &[(f64, ExprId)]) -> bool {
        let mut seen = std::collections::HashSet::with_hasher(BuildIdHasher::default());
        (summands.iter()).all(|&(_, expr)| seen.insert(expr) && self.is_plain(expr))
    }

    /// Whether a term is a product of variables to integer powers and at most one function of a
    /// variable, without a number.
    fn is_plain(&mut self, expr: ExprId) -> bool {
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
    fn single(&mut self, expr: ExprId) -> ExprId {
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

    /// Positions of blocks that can interact, or that are worth a look alone.
    fn groups(&mut self, blocks: &[Block]) -> Vec<Vec<usize>> {
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
        let limits = SimplifyLimits::default();
        let expanded = self
            .pool
            .expand_region(normal, limits, &mut limits.expand.products.clone());
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
    fn denominators(&self, expr: ExprId) -> Vec<ExprId> {
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
    fn normal(&mut self, expr: ExprId, waves: ExprId) -> ExprId {
        let limits = SimplifyLimits::default();
        let mut budget = limits.expand.products;
        let expanded = self.pool.expand_angles_like(expr, waves);
        self.pool.normal_form(expanded, limits, &mut budget)
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

    /// A shorter form of a sum, if one is found.
    fn shortest(&mut self, old: &Summands) -> Option<Summands> {
        let (unit, scaled) = in_units(old);
        let before = self.length(unit, &scaled);
        let mut best = ((before, 0), None);
        let singles: Scaled = (scaled.iter())
            .map(|&(number, expr)| (number, self.single(expr)))
            .collect();
        let mut candidates = vec![collected(self.pool, &singles, Keep::Sums)];
        if old.len() <= MAX_GROUP {
            candidates.extend(self.candidates(unit, &singles));
        }
        let n_terms = self.all_terms(&scaled);
        for candidate in candidates {
            // Only a fraction whose sums become fewer may be written as several terms.
            let is_resolved = old.len() == 1
                && self.all_terms(&candidate) < n_terms
                && !self.denominators(old[0].1).is_empty();
            if candidate.len() > old.len() && !is_resolved {
                continue;
            }
            let length = self.length(unit, &candidate);
            let is_negative = |(number, _): &&(Number, ExprId)| in_f64(*number, unit) < 0.0;
            let rank = (length, candidate.iter().filter(is_negative).count());
            if rank < best.0 {
                best = (rank, Some(candidate));
            }
        }
        let found = best.1?;
        let coefficient = |number: Number, expr: ExprId| {
            let value = in_f64(number, unit);
            let is_same = |&&(known, of): &&(f64, ExprId)| {
                of == expr && (known - value).abs() <= 2.0 * f64::EPSILON * value.abs()
            };
            old.iter().find(is_same).map_or(value, |&(known, _)| known)
        };
        let summands: Summands = (found.into_iter())
            .map(|(number, expr)| (coefficient(number, expr), expr))
            .collect();
        let is_usable = |&(value, _): &(f64, ExprId)| value.is_finite() && value != 0.0;
        summands.iter().all(is_usable).then_some(summands)
    }

    /// Terms of a sum with those of sums inside products and fractions.
    fn all_terms(&self, summands: &Scaled) -> usize {
        let mut count = summands.len();
        for &(_, expr) in summands {
            for &factor in self.pool.factors_of(expr) {
                let base = match *self.pool.node(factor) {
                    Node::Power(base, _) => base,
                    _ => factor,
                };
                if let Node::Sum(terms) = self.pool.node(base) {
                    count += terms.len() - 1;
                }
            }
        }
        count
    }

    fn length(&mut self, unit: Number, summands: &Scaled) -> u64 {
        let terms = summands
            .iter()
            .map(|&(number, expr)| (in_f64(number, unit), expr));
        self.costs.of_terms(self.pool, terms)
    }

    /// Forms of a group: of its sum as a whole, and of each term chosen by itself.
    fn candidates(&mut self, unit: Number, singles: &Scaled) -> Vec<Scaled> {
        let limits = SimplifyLimits::default();
        let mut budget = limits.expand.products;
        let mut candidates = Vec::new();
        let products: Vec<ExprId> = (singles.iter())
            .map(|&(number, expr)| {
                let factor = self.pool.constant(number);
                self.pool.product(&[factor, expr])
            })
            .collect();
        let sum = self.pool.sum(&products);
        let mut forms = self.pool.forms(sum, limits, &mut budget);
        forms.push(self.pool.simplify(sum));
        for form in forms {
            let terms = self.pool.terms_of(form);
            if let [(number, rest)] = terms.as_slice()
                && let Node::Sum(_) = self.pool.node(*rest)
            {
                candidates.push(collected(self.pool, &[(*number, *rest)], Keep::Nothing));
            }
            candidates.push(terms);
            if singles.len() == 1
                && let Node::Sum(_) = self.pool.node(form)
            {
                candidates.push(vec![(Number::ONE, form)]);
            }
        }
        candidates.extend(self.chosen(unit, singles, sum));
        candidates
    }

    /// Sums in which each term has the form that suits the others best.
    fn chosen(&mut self, unit: Number, singles: &Scaled, sum: ExprId) -> Vec<Scaled> {
        if singles.len() < 2 || singles.len() > MAX_CHOSEN {
            return Vec::new();
        }
        let limits = SimplifyLimits::default();
        let mut budget = limits.expand.products;
        let mut forms: Vec<Vec<ExprId>> = Vec::new();
        for &(_, expr) in singles {
            let normal = self.normal(expr, sum);
            let mut own = vec![
                expr,
                self.pool.expand_region(expr, limits, &mut budget),
                normal,
            ];
            if self.pool.has_waves(normal) {
                let sines = self.pool.cosines_to_sines(normal);
                own.push(self.pool.expand_region(sines, limits, &mut budget));
                own.push(self.pool.combine_angles(normal));
            } else {
                own.extend([normal, normal]);
            }
            forms.push(own);
        }
        let mut found = Vec::new();
        for start in 1..forms[0].len() {
            let mut choice = vec![start; singles.len()];
            let (mut best, mut least) = self.of_choice(unit, singles, &forms, &choice);
            loop {
                let before = least;
                for term in 0..singles.len() {
                    let kept = choice[term];
                    for other in 0..forms[term].len() {
                        choice[term] = other;
                        let (candidate, length) = self.of_choice(unit, singles, &forms, &choice);
                        if length < least {
                            (best, least) = (candidate, length);
                            break;
                        }
                        choice[term] = kept;
                    }
                }
                if least == before {
                    break;
                }
            }
            found.push(best);
        }
        found
    }

    fn of_choice(
        &mut self,
        unit: Number,
        singles: &Scaled,
        forms: &[Vec<ExprId>],
        choice: &[usize],
    ) -> (Scaled, u64) {
        let mut parts = Scaled::new();
        for (term, &(number, _)) in singles.iter().enumerate() {
            let form = forms[term][choice[term]];
            let keep = match choice[term] {
                0 => Keep::Sums,
                _ => Keep::Nothing,
            };
            parts.extend(collected(self.pool, &[(number, form)], keep));
        }
        let sum = collected(self.pool, &parts, Keep::Sums);
        let length = self.length(unit, &sum);
        (sum, length)
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
        POINTS.into_iter().all(|(low, high)| {
            let ((a, size_a), (b, size_b)) = (value(old, low, high), value(new, low, high));
            !a.is_finite() || (a - b).abs() <= EVALUATION * (size_a + size_b)
        })
    }
}

/// Whether sums among the terms stay terms.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Keep {
    Sums,
    Nothing,
}

/// Summands with the numbers of their terms in the coefficients and like terms added, in the order
/// of their first appearance.
fn collected(pool: &ExprPool, summands: &[(Number, ExprId)], keep: Keep) -> Scaled {
    let mut result = Scaled::new();
    let mut place: HashMap<ExprId, usize, BuildIdHasher> = HashMap::default();
    for &(number, expr) in summands {
        let parts = match pool.node(expr) {
            Node::Sum(_) if keep == Keep::Sums => vec![(Number::ONE, expr)],
            _ => pool.terms_of(expr),
        };
        for (factor, rest) in parts {
            let at = *place.entry(rest).or_insert(result.len());
            let term = number.checked_mul(factor);
            if at == result.len() {
                // What overflows stays as written.
                let fallback = (number, if factor.is_one() { rest } else { expr });
                result.push(term.map_or(fallback, |term| (term, rest)));
                continue;
            }
            match term.and_then(|term| result[at].0.checked_add(term)) {
                Some(sum) => result[at].0 = sum,
                None => result.push((number, expr)),
            }
        }
    }
    result.retain(|(number, _)| !number.is_zero());
    result
}

/// A unit, and the coefficients as multiples of it: small fractions if all are such.
fn in_units(summands: &Summands) -> (Number, Scaled) {
    let unit = summands[0].0;
    let ratios: Option<Scaled> = (summands.iter())
        .map(|&(coefficient, expr)| Some((small_ratio(coefficient, unit)?, expr)))
        .collect();
    match ratios {
        Some(scaled) => (decimal(unit), scaled),
        None => {
            let exact = summands.iter().map(|&(c, expr)| (decimal(c), expr));
            (Number::ONE, exact.collect())
        }
    }
}

/// `a / b` as a fraction of small numbers, if it is one to a unit in the last place.
fn small_ratio(a: f64, b: f64) -> Option<Number> {
    let ratio = a / b;
    (1..=MAX_DENOMINATOR).find_map(|denominator| {
        let numerator = (ratio * f64::from(denominator)).round();
        let error = (numerator * b / f64::from(denominator) - a).abs();
        let fits =
            numerator != 0.0 && numerator.abs() <= MAX_NUMERATOR && error <= f64::EPSILON * a.abs();
        fits.then(|| Number::rational(numerator as i64, i64::from(denominator)))?
    })
}

/// The decimal fraction that is written for a float, if it is short; the float itself otherwise.
fn decimal(value: f64) -> Number {
    let exact = || {
        let text = format!("{value:e}");
        let (mantissa, exponent) = text.split_once('e')?;
        let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
        let exponent = exponent.parse::<i32>().ok()? - fraction.len() as i32;
        if whole.len() + fraction.len() > MAX_DECIMALS {
            return None;
        }
        let digits: i64 = format!("{whole}{fraction}").parse().ok()?;
        let power = 10_i64.checked_pow(exponent.unsigned_abs())?;
        match exponent {
            0.. => Some(Number::integer(digits.checked_mul(power)?)),
            _ => Number::rational(digits, power),
        }
    };
    let number = exact().filter(|number| number.to_f64() == value);
    number.unwrap_or_else(|| Number::from_f64(value).expect("coefficients are finite"))
}

/// `number * unit`, rounded once if the unit is a short decimal fraction, else twice.
fn in_f64(number: Number, unit: Number) -> f64 {
    match number.as_rational() {
        Some((numerator, denominator)) if !unit.is_exact() => {
            numerator as f64 * unit.to_f64() / denominator as f64
        }
        _ => number
            .checked_mul(unit)
            .map_or(f64::INFINITY, Number::to_f64),
    }
}

fn root(leader: &[usize], mut place: usize) -> usize {
    while leader[place] != place {
        place = leader[place];
    }
    place
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The shortest form of a sum of coefficients times terms, with the number of summands.
    fn shortest(sum: &[(f64, &str)]) -> String {
        let mut pool = ExprPool::new();
        let summands: Vec<(f64, ExprId)> = (sum.iter())
            .map(|(c, text)| (*c, pool.parse(text, &|_| true).expect("test text parses")))
            .collect();
        let mut left: Vec<Option<Summands>> = summands
            .iter()
            .map(|&summand| Some(vec![summand]))
            .collect();
        for Shortened { replaced, by } in Shortener::new(&mut pool).shorten(&summands) {
            replaced.iter().for_each(|&place| left[place] = None);
            left[replaced[0]] = Some(by);
        }
        let texts = left.into_iter().flatten().flatten();
        let texts: Vec<String> = texts
            .map(|(c, expr)| format!("{c} {}", pool.display(expr)))
            .collect();
        texts.join(" | ")
    }

    #[test]
    fn shorten_finds_the_simplest_form_of_each_family() {
        let mut wrong = Vec::new();
        for (sum, expected) in [
            (&[(1.0, "sin(x)^2"), (1.0, "cos(x)^2")][..], "1 1"),
            (
                &[(0.37, "sin(x)^2"), (0.37, "cos(x)^2"), (2.0, "y")],
                "0.37 1 | 2 y",
            ),
            (&[(3.0, "sin(x)^2"), (2.0, "cos(x)^2")], "2 1 | 1 sin(x)^2"),
            (&[(2.0, "sin(x)*cos(x)"), (-1.0, "sin(2*x)")], ""),
            (
                &[(0.7, "sin(x)*cos(y)"), (0.7, "cos(x)*sin(y)")],
                "0.7 sin(x + y)",
            ),
            (&[(1.0, "sin(-x)"), (1.0, "sin(x)")], ""),
            (&[(1.0, "cos(-x)"), (1.0, "cos(x)")], "2 cos(x)"),
            (&[(1.0, "x/2"), (0.5, "x")], "1 x"),
            (&[(1.0, "(x^2 - 1)/(x - 1)")], "1 1 | 1 x"),
            (&[(1.0, "(x + 1)^2"), (-1.0, "x^2"), (-2.0, "x")], "1 1"),
            (
                &[
                    (0.1, "(x + 1)^3"),
                    (-0.1, "x^3"),
                    (-0.3, "x^2"),
                    (-0.3, "x"),
                ],
                "0.1 1",
            ),
            (&[(1.0, "exp(x)*exp(-x)"), (2.0, "x")], "1 1 | 2 x"),
            (&[(0.3, "log(exp(x))"), (0.1, "x")], "0.4 x"),
            (&[(1.3, "exp(2*log(x))")], "1.3 x^2"),
            (&[(0.4, "log(x)"), (0.4, "log(y)")], "0.4 log(x*y)"),
            (&[(0.1, "x*y"), (-0.1, "y*x")], ""),
            (&[(0.1, "sqrt(x)^2"), (0.2, "x")], "0.3 x"),
            (
                &[(1.0, "sin(x + y)"), (1.0, "sin(x - y)")],
                "2 sin(x)*cos(y)",
            ),
            (
                &[
                    (1.0, "sin(x)*cos(y)"),
                    (1.0, "cos(x)*sin(y)"),
                    (0.3, "sin(x)*cos(z)"),
                ],
                "1 sin(x + y) | 0.3 sin(x)*cos(z)",
            ),
            (&[(1.0, "tan(x)*cos(x)"), (1.0, "sin(x)")], "2 sin(x)"),
            (&[(1.0, "1"), (1.0, "tan(x)^2")], "1 1/cos(x)^2"),
            (&[(1.0, "1"), (-2.0, "sin(x)^2")], "1 cos(2*x)"),
            (
                &[
                    (1.0, "(x + 1)^2"),
                    (-1.0, "x^2"),
                    (-2.0, "x"),
                    (0.3, "(x + 1)^3"),
                ],
                "1 1 | 0.3 (1 + x)^3",
            ),
        ] {
            let found = shortest(sum);
            if found != expected {
                wrong.push(format!("{sum:?}: {found}, expected {expected}"));
            }
        }
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    }

    #[test]
    fn shorten_leaves_what_is_short_already() {
        for sum in [
            &[
                (0.36, "1"),
                (-0.16, "dz1"),
                (-0.91, "dz2"),
                (-0.75, "sin(dz1)"),
            ][..],
            &[(0.1, "x"), (0.2, "x*y"), (0.3, "(x + 1)^2")],
            &[(1.0, "x*y"), (1.0, "x*z")],
            &[(0.37, "sin(x)*cos(y)"), (0.21, "sin(z)*cos(x)")],
            &[(1.0, "1/3*x")],
            &[(1.0, "exp(x)"), (1.0, "tanh(y)"), (0.5, "sqrt(x^2 + y^2)")],
        ] {
            let texts: Vec<String> = sum.iter().map(|(c, t)| format!("{c} {t}")).collect();
            assert_eq!(shortest(sum).replace("1 + x", "x + 1"), texts.join(" | "));
        }
    }

    #[test]
    fn shorten_of_a_long_plain_sum_makes_no_expression() {
        let mut pool = ExprPool::new();
        let summands: Vec<(f64, ExprId)> = (0..20_000)
            .map(|i| {
                (
                    0.1,
                    pool.parse(&format!("x{}*x{}*sin(y{i})", i % 97, i % 89), &|_| true),
                )
            })
            .map(|(c, expr)| (c, expr.expect("test text parses")))
            .collect();
        let before = pool.len();
        assert_eq!(Shortener::new(&mut pool).shorten(&summands), []);
        assert_eq!(pool.len(), before);
    }
}
