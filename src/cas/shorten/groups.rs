//! Which summands can interact.

use super::*;
use crate::polynomial::MAX_POWER;

const MAX_PARTS: usize = 64;
const ROUNDING: f64 = 1e-13;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Link {
    /// A monomial of their normal forms.
    Monomial(ExprId),
    Logarithm(ExprId),
    /// Denominators that have the variables of this product.
    Variables(ExprId),
}

impl Shortener<'_> {
    pub(super) fn groups(&mut self, blocks: &[Block], distance: Distance) -> Vec<Vec<usize>> {
        let (places, summands): (Vec<usize>, Summands) = (blocks.iter().enumerate())
            .flat_map(|(place, block)| block.summands.iter().map(move |&summand| (place, summand)))
            .unzip();
        let waves = self.all_angles(&summands);
        let mut leader: Vec<usize> = (0..blocks.len()).collect();
        let join = |leader: &mut Vec<usize>, a: usize, b: usize| {
            let (a, b) = (root(leader, a), root(leader, b));
            leader[a.max(b)] = a.min(b);
        };
        let mut owner: HashMap<Link, usize> = HashMap::new();
        let mut is_plain = vec![true; blocks.len()];
        for (place, block) in blocks.iter().enumerate() {
            for &(_, expr) in &block.summands {
                is_plain[place] &= self.is_plain(expr);
                for link in self.links_of(expr, waves) {
                    let is_far = matches!(link, Link::Monomial(ExprId::ONE) | Link::Variables(_));
                    if distance == Distance::Near && is_far {
                        continue;
                    }
                    let other = *owner.entry(link).or_insert(place);
                    join(&mut leader, place, other);
                }
            }
        }
        for [a, b] in self.parts_of_powers(&summands) {
            join(&mut leader, places[a], places[b]);
        }
        let mut groups: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for place in 0..blocks.len() {
            groups.entry(root(&leader, place)).or_default().push(place);
        }
        let is_worth = |group: &Vec<usize>| group.len() > 1 || !is_plain[group[0]];
        groups.into_values().filter(is_worth).collect()
    }

    /// Pairs of summands of one power of a sum: of `p*a^n`, `q*a^(n-1)*b` and `r*b^n` with `q^n = n^n*p^(n-1)*r`.
    pub(super) fn parts_of_powers(&mut self, summands: &[(f64, ExprId)]) -> Vec<[usize; 2]> {
        let mut pairs = Vec::new();
        if summands.len() < 3 {
            return pairs;
        }
        let places: IdMap<usize> = (summands.iter().enumerate())
            .map(|(place, &(_, expr))| (expr, place))
            .collect();
        for power in 2..=MAX_POWER {
            let roots: Vec<(usize, ExprId)> = (summands.iter().enumerate())
                .filter_map(|(place, &(_, expr))| Some((place, self.pool.whole_root(expr, power)?)))
                .take(MAX_PARTS)
                .collect();
            for &(first, a) in &roots {
                for &(last, b) in roots.iter().filter(|(last, _)| *last != first) {
                    let mut place_of = |n_last: i64| {
                        let a = self.pool.pow_number(a, Number::integer(power - n_last));
                        let b = self.pool.pow_number(b, Number::integer(n_last));
                        places.get(&self.pool.product(&[a, b])).copied()
                    };
                    let Some(second) = place_of(1) else { continue };
                    let [p, q, r] = [first, second, last].map(|at| summands[at].0.abs());
                    let n = power as i32;
                    let expected = f64::from(n).powi(n) * p.powi(n - 1) * r;
                    if (q.powi(n) - expected).abs() > ROUNDING * expected {
                        continue;
                    }
                    pairs.push([first, last]);
                    pairs.extend((1..power).filter_map(place_of).map(|place| [first, place]));
                }
            }
        }
        pairs
    }

    /// A sum of waves that fixes the units of multiples: one for each angle of the terms. Half the angle of `cos(2*x)`
    /// is added if another term makes it `1 - cos(2*x)` or `1 + cos(2*x)`.
    pub(super) fn all_angles(&mut self, summands: &[(f64, ExprId)]) -> ExprId {
        let mut sines = Vec::new();
        for &(coefficient, expr) in summands {
            for atom in self.pool.atoms_of(expr) {
                let (function, angle) = match *self.pool.node(atom) {
                    Node::Apply(function, angle) if function.is_circular() => (function, angle),
                    _ => continue,
                };
                sines.push(self.pool.apply(Function::Sin, angle));
                if function == Function::Cos && self.pool.split(angle).0.is_even() {
                    let beside = self.pool.div(expr, atom);
                    let is_beside = |&(other, expr): &(f64, ExprId)| {
                        expr == beside && other.abs() == coefficient.abs()
                    };
                    if summands.iter().any(is_beside) {
                        let half = self.pool.scale(Number::HALF, angle);
                        sines.push(self.pool.apply(Function::Sin, half));
                    }
                }
            }
        }
        sines.sort_unstable();
        sines.dedup();
        self.pool.sum(&sines)
    }

    fn links_of(&mut self, expr: ExprId, waves: ExprId) -> Vec<Link> {
        // Tangents meet sines and cosines.
        let meets = |factor: &ExprId| match *self.pool.node(*factor) {
            Node::Apply(Function::Sin | Function::Cos, _) => false,
            Node::Apply(function, _) => function.is_circular(),
            _ => false,
        };
        let is_alone = self.plain[&expr] && !self.pool.factors_of(expr).iter().any(meets);
        if is_alone || !self.pool.affords(1) {
            return vec![Link::Monomial(expr)];
        }
        if let Some(known) = self.links.get(&(expr, waves)) {
            return known.clone();
        }
        let mut links = Vec::new();
        let mut add_terms = |pool: &ExprPool, expr| {
            links.extend((pool.terms_of(expr).into_iter()).map(|term| Link::Monomial(term.1)));
        };
        let normal = self.normal(expr, waves);
        let expanded = self.pool.expand_region(normal);
        add_terms(self.pool, expanded);
        add_terms(self.pool, normal);
        if self.pool.has_waves(normal) {
            let combined = self.pool.combine_angles(normal);
            add_terms(self.pool, combined);
        }
        add_terms(self.pool, expr);
        if let Some((cofactor, _)) = self.pool.as_log_term(self.pool.split(expr).1) {
            links.push(Link::Logarithm(cofactor));
        }
        links.extend(self.links_of_fraction(expr));
        links.push(Link::Monomial(self.pool.split(expr).1));
        self.links.insert((expr, waves), links.clone());
        links
    }

    /// The terms to which a term with sines, cosines or sums in its denominator can be added.
    fn links_of_fraction(&mut self, expr: ExprId) -> Vec<Link> {
        let mut links = Vec::new();
        for base in self.denominators(expr) {
            // Fractions: with the same denominator, or denominators of the same variables.
            links.push(Link::Monomial(self.pool.powi(base, -1)));
            let variables: Vec<ExprId> = (self.pool.symbols_of(base).into_iter())
                .map(|symbol| self.pool.symbol_expr(symbol))
                .collect();
            links.push(Link::Variables(self.pool.product(&variables)));
            // Terms that have a term of the numerator when they are multiplied by the denominator.
            let numerator = self.pool.mul(expr, base);
            let numerator = self.pool.expand_region(numerator);
            for (_, above) in self.pool.terms_of(numerator) {
                for (_, below) in self.pool.terms_of(base) {
                    links.push(Link::Monomial(self.pool.div(above, below)));
                }
            }
        }
        for factor in self.pool.factors_of(expr).to_vec() {
            match self.pool.function_power(factor) {
                Some((Function::Sin | Function::Cos, _, 0..)) => {}
                Some((Function::Sin | Function::Cos, ..)) => {
                    links.push(Link::Monomial(self.pool.div(expr, factor)));
                }
                Some((function, angle, _)) if function.is_circular() => {
                    let cofactor = self.pool.div(expr, factor);
                    let tangent = self.pool.apply(function, angle);
                    links.push(Link::Monomial(self.pool.mul(cofactor, tangent)));
                }
                _ => {}
            }
        }
        links
    }

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
        self.pool.limited(MAX_WORK / 2, |pool| {
            let expanded = pool.map_regions(expr, ExprPool::expand_region);
            let expanded = pool.expand_angles_like(expanded, waves);
            pool.normal_form(expanded)
        })
    }
}

fn root(leader: &[usize], mut place: usize) -> usize {
    while leader[place] != place {
        place = leader[place];
    }
    place
}
