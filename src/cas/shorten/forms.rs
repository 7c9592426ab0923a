//! The shortest form of a group of summands.

use super::*;

const MAX_GROUP: usize = 64;
const MAX_CHOSEN: usize = 16;
const MAX_NUMERATOR: f64 = 4096.0;
const MAX_DENOMINATOR: i32 = 64;

impl Shortener<'_> {
    /// The shortest form of a sum that is shorter and agrees with the original summands, if there is one.
    pub(super) fn shortest(&mut self, old: &Summands, original: &Summands) -> Option<Summands> {
        let (unit, scaled) = in_units(old);
        let before = self.length(unit, &scaled);
        let mut shorter = Vec::new();
        let singles = scaled
            .iter()
            .map(|&(number, expr)| (number, self.single(expr)));
        let singles: Scaled = singles.collect();
        let mut candidates = vec![collected(self.pool, &singles, NestedSums::Kept)];
        if old.len() <= MAX_GROUP && self.pool.affords(1) {
            candidates.extend(self.candidates(unit, &singles));
            candidates.extend(self.beside_common_factors(unit, &singles));
        }
        let (n_terms, n_calls) = (self.all_terms(&scaled), self.calls(&scaled));
        let n_numbers = self.n_numbers(unit, &scaled);
        let n_written = self.spread(unit, scaled).len();
        for candidate in candidates {
            // Only a fraction whose sums become fewer, a function of a function that goes, and a sum whose decimals
            // become fewer, may be written as several terms.
            let is_resolved = || {
                let is_fraction = !self.denominators(old[0].1).is_empty();
                (is_fraction && self.all_terms(&candidate) < n_terms)
                    || self.calls(&candidate) < n_calls
                    || (unit.is_exact() && self.n_numbers(unit, &candidate) < n_numbers)
            };
            if candidate.len() > n_written && (old.len() > 1 || !is_resolved()) {
                continue;
            }
            let candidate = self.spread(unit, candidate);
            let length = self.length(unit, &candidate);
            let is_negative = |(number, _): &&(Number, ExprId)| in_f64(*number, unit) < 0.0;
            let rank = (length, candidate.iter().filter(is_negative).count());
            if rank < (before, 0) {
                shorter.push((rank, candidate));
            }
        }
        shorter.sort_by_key(|(rank, _)| *rank);
        let coefficient = |number: Number, expr: ExprId| {
            let value = in_f64(number, unit);
            let is_same = |&&(known, of): &&(f64, ExprId)| {
                of == expr && (known - value).abs() <= 2.0 * f64::EPSILON * value.abs()
            };
            old.iter().find(is_same).map_or(value, |&(known, _)| known)
        };
        let is_usable = |&(value, _): &(f64, ExprId)| value.is_finite() && value != 0.0;
        let term = |(number, expr)| (coefficient(number, expr), expr);
        let forms = shorter.into_iter();
        let mut forms = forms.map(|(_, form)| form.into_iter().map(term).collect::<Summands>());
        let mut agreement = Agreement::with(self.pool, original);
        forms.find(|form| form.iter().all(is_usable) && agreement.holds(self.pool, form))
    }

    /// The summands with sums of coefficient 1 or -1 as terms of their own, as they are written.
    fn spread(&self, unit: Number, summands: Scaled) -> Scaled {
        let mut terms = Scaled::new();
        for (number, expr) in summands {
            match self.pool.node(expr) {
                Node::Sum(_) if in_f64(number, unit).abs() == 1.0 => {
                    let parts = self.pool.terms_of(expr).into_iter();
                    let scaled = parts.map(|(part, rest)| Some((number.checked_mul(part)?, rest)));
                    match scaled.collect::<Option<Scaled>>() {
                        Some(scaled) => terms.extend(scaled),
                        None => terms.push((number, expr)),
                    }
                }
                _ => terms.push((number, expr)),
            }
        }
        collected(self.pool, &terms, NestedSums::Kept)
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
                count += self.pool.summands_of(base).len() - 1;
            }
        }
        count
    }

    fn n_numbers(&self, unit: Number, summands: &Scaled) -> usize {
        let is_written =
            |(number, rest): &(Number, ExprId)| *rest == ExprId::ONE || !number.abs().is_one();
        let of_term = |&(number, expr): &(Number, ExprId)| {
            let inner = match self.pool.node(expr) {
                Node::Sum(_) => self.pool.terms_of(expr),
                _ => Vec::new(),
            };
            let own = in_f64(number, unit).abs() != 1.0 || expr == ExprId::ONE;
            usize::from(own) + inner.iter().filter(|term| is_written(term)).count()
        };
        summands.iter().map(of_term).sum()
    }

    fn calls(&self, summands: &Scaled) -> usize {
        let roots: Vec<ExprId> = summands.iter().map(|&(_, expr)| expr).collect();
        let calls = self.pool.fold_up(&roots, |pool, expr, calls_of| {
            let own = usize::from(matches!(pool.node(expr), Node::Apply(..)));
            pool.children(expr)
                .map(calls_of)
                .fold(own, usize::saturating_add)
        });
        calls.into_iter().fold(0, usize::saturating_add)
    }

    fn length(&mut self, unit: Number, summands: &Scaled) -> u64 {
        let terms = summands
            .iter()
            .map(|&(number, expr)| (in_f64(number, unit), expr));
        self.costs.of_terms(self.pool, terms)
    }

    /// Forms of a group: of its sum as a whole, and of each term chosen by itself.
    fn candidates(&mut self, unit: Number, singles: &Scaled) -> Vec<Scaled> {
        let mut candidates = Vec::new();
        let scaled = (singles.iter()).map(|&(number, expr)| self.pool.scale(number, expr));
        let scaled: Vec<ExprId> = scaled.collect();
        let sum = self.pool.sum(&scaled);
        let mut forms = self.pool.forms(sum);
        forms.push(self.pool.simplify(sum));
        for form in forms {
            let terms = self.pool.terms_of(form);
            if let [(number, rest)] = terms.as_slice()
                && let Node::Sum(_) = self.pool.node(*rest)
            {
                candidates.push(collected(self.pool, &[(*number, *rest)], NestedSums::Split));
            }
            candidates.push(terms);
            if singles.len() == 1
                && let Node::Sum(_) = self.pool.node(form)
            {
                candidates.push(vec![(Number::ONE, form)]);
            }
        }
        candidates.extend(self.waves_as_products(singles));
        candidates.extend(self.chosen(unit, singles));
        candidates
    }

    /// Forms of the terms divided by their common factors: finds `z*tanh(a)`.
    fn beside_common_factors(&mut self, unit: Number, singles: &Scaled) -> Vec<Scaled> {
        let [(_, first), others @ ..] = &singles[..] else {
            return Vec::new();
        };
        let is_common = |factor: &ExprId| {
            let mut others = others.iter();
            *factor != ExprId::ONE
                && others.all(|&(_, expr)| self.pool.factors_of(expr).contains(factor))
        };
        let factors = self.pool.factors_of(*first).iter().copied();
        let common: Vec<ExprId> = factors.filter(is_common).collect();
        if others.is_empty() || common.is_empty() {
            return Vec::new();
        }
        let common = self.pool.product(&common);
        let mut left = singles.clone();
        for (_, expr) in &mut left {
            *expr = self.pool.div(*expr, common);
        }
        let found = self.candidates(unit, &left).into_iter();
        let with_factors = found.map(|mut form| {
            for (_, expr) in &mut form {
                *expr = self.pool.mul(common, *expr);
            }
            collected(self.pool, &form, NestedSums::Kept)
        });
        with_factors.collect()
    }

    /// Sums in which two waves are a product, of angles of any length: `cos(a + b) + cos(a - b) = 2*cos(a)*cos(b)`.
    fn waves_as_products(&mut self, singles: &Scaled) -> Vec<Scaled> {
        let mut found = Vec::new();
        if singles.len() > MAX_CHOSEN {
            return found;
        }
        for second in 1..singles.len() {
            for first in 0..second {
                let pair = [singles[first], singles[second]];
                if let Some(product) = self.product_of_waves(pair) {
                    let mut sum = singles.clone();
                    sum[first] = product;
                    sum.remove(second);
                    found.push(collected(self.pool, &sum, NestedSums::Kept));
                }
            }
        }
        found
    }

    fn product_of_waves(&mut self, pair: [(Number, ExprId); 2]) -> Option<(Number, ExprId)> {
        let [(number, first), (other, second)] = pair;
        let is_difference = number == -other;
        if !(is_difference || number == other) {
            return None;
        }
        let (cofactor, function, a) = self.wave(first)?;
        let (beside, same, b) = self.wave(second)?;
        if (cofactor, function) != (beside, same) {
            return None;
        }
        let angles = [self.pool.add(a, b), self.pool.sub(a, b)];
        let (of_sum, of_difference, factor) = match (function, is_difference) {
            (Function::Cos, false) => (Function::Cos, Function::Cos, 2),
            (Function::Cos, true) => (Function::Sin, Function::Sin, -2),
            (_, false) => (Function::Sin, Function::Cos, 2),
            (_, true) => (Function::Cos, Function::Sin, 2),
        };
        let mut factors = vec![cofactor];
        let half = self.pool.constant(Number::HALF);
        for (function, angle) in [of_sum, of_difference].into_iter().zip(angles) {
            let half = self.pool.expanded_product(half, angle);
            factors.push(self.pool.apply(function, half));
        }
        let number = number.checked_mul(Number::integer(factor))?;
        Some((number, self.pool.product(&factors)))
    }

    /// The first sine or cosine among the factors of a term: cofactor, function, angle.
    fn wave(&mut self, expr: ExprId) -> Option<(ExprId, Function, ExprId)> {
        let factors = self.pool.factors_of(expr).iter();
        let mut waves = factors.filter_map(|&factor| match *self.pool.node(factor) {
            Node::Apply(function @ (Function::Sin | Function::Cos), angle) => {
                Some((factor, function, angle))
            }
            _ => None,
        });
        let (factor, function, angle) = waves.next()?;
        Some((self.pool.div(expr, factor), function, angle))
    }

    /// Sums in which each term has the form that suits the others best.
    fn chosen(&mut self, unit: Number, singles: &Scaled) -> Vec<Scaled> {
        if singles.len() < 2 || singles.len() > MAX_CHOSEN {
            return Vec::new();
        }
        let summands = singles
            .iter()
            .map(|&(number, expr)| (number.to_f64(), expr));
        let summands: Summands = summands.collect();
        let waves = self.all_angles(&summands);
        let mut forms: Vec<Vec<ExprId>> = Vec::new();
        for &(_, expr) in singles {
            let normal = self.normal(expr, waves);
            let mut own = vec![expr, self.pool.expand_region(expr), normal];
            if self.pool.has_waves(normal) {
                let sines = self.pool.cosines_to_sines(normal);
                own.push(self.pool.expand_region(sines));
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
                if least == before || !self.pool.affords(1) {
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
            let sums = match choice[term] {
                0 => NestedSums::Kept,
                _ => NestedSums::Split,
            };
            parts.extend(collected(self.pool, &[(number, form)], sums));
        }
        let sum = collected(self.pool, &parts, NestedSums::Kept);
        self.pool.spend(parts.len());
        let length = self.length(unit, &sum);
        (sum, length)
    }
}

/// Whether sums among the terms stay terms, or become their own terms.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum NestedSums {
    Kept,
    Split,
}

/// Summands with the numbers of their terms in the coefficients and like terms added, by first appearance.
pub(super) fn collected(
    pool: &ExprPool,
    summands: &[(Number, ExprId)],
    sums: NestedSums,
) -> Scaled {
    let mut result = Scaled::new();
    let mut place: IdMap<usize> = IdMap::default();
    for &(number, expr) in summands {
        let parts = match pool.node(expr) {
            Node::Sum(_) if sums == NestedSums::Kept => vec![(Number::ONE, expr)],
            _ => pool.terms_of(expr),
        };
        for (factor, rest) in parts {
            let at = *place.entry(rest).or_insert(result.len());
            let term = number.checked_mul(factor);
            if at == result.len() {
                // A term that overflows stays as written.
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

fn decimal(value: f64) -> Number {
    let number = Number::from_f64(value).expect("coefficients are finite");
    number.decimal().unwrap_or(number)
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
