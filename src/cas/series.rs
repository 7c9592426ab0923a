//! Arithmetic of series with terms `c t^r`, whose coefficients and exponents are expressions.

use super::*;

/// Differences of exponents that count as zero: 0.1 + 0.9 and 1 are the same.
const SAME_EXPONENT: f64 = 1e-12;
/// Coefficients from this exponent on are assumed not to vanish by chance together with all before them.
const RARE: f64 = 3.0;
const MOST_TERMS: i64 = 24;

/// `sum coefficient t^exponent`, and the omitted terms: those from the exponents of `rest` on.
#[derive(Clone, Debug, Default)]
pub(super) struct Series {
    /// Exponent and coefficient; exponents are distinct as expressions.
    pub(super) terms: Vec<(ExprId, ExprId)>,
    pub(super) rest: Vec<ExprId>,
}

impl Series {
    fn term(exponent: ExprId, coefficient: ExprId) -> Series {
        Series {
            terms: vec![(exponent, coefficient)],
            rest: Vec::new(),
        }
    }

    pub(super) fn constant(value: ExprId) -> Series {
        Series::term(ExprId::ZERO, value)
    }

    pub(super) fn is_zero(&self) -> bool {
        self.terms.is_empty() && self.rest.is_empty()
    }

    pub(super) fn has_pole(&self, pool: &ExprPool) -> bool {
        let number = |exponent| pool.as_number(exponent).is_some_and(Number::is_negative);
        self.terms.iter().any(|&(exponent, _)| number(exponent))
    }

    /// Omits the value at the point, and terms smaller than `t`.
    pub(super) fn keep_up_to_one(&mut self, pool: &ExprPool) {
        let number = |exponent| pool.as_number(exponent).map(Number::to_f64);
        let is_small = |exponent| number(exponent).is_some_and(|n| n > 1.0 + SAME_EXPONENT);
        (self.terms).retain(|&(exponent, _)| exponent != ExprId::ZERO && !is_small(exponent));
        for (exponent, _) in &mut self.terms {
            let difference = number(*exponent).map(|n| n - 1.0);
            if difference.is_some_and(|d| d.abs() <= SAME_EXPONENT) {
                *exponent = ExprId::ONE;
            }
        }
        self.rest.retain(|&exponent| !is_small(exponent));
    }
}

impl Germs<'_> {
    pub(super) fn number_of(&self, exponent: ExprId) -> Option<f64> {
        self.pool.as_number(exponent).map(Number::to_f64)
    }

    pub(super) fn push(&mut self, series: &mut Series, (exponent, coefficient): (ExprId, ExprId)) {
        let value = self.number_of(exponent);
        let is_same = |&(other, _): &(ExprId, ExprId)| {
            let difference = value.zip(self.number_of(other)).map(|(a, b)| a - b);
            exponent == other || difference.is_some_and(|d| d.abs() < SAME_EXPONENT)
        };
        match series.terms.iter().position(is_same) {
            Some(at) => {
                let sum = self.pool.add(series.terms[at].1, coefficient);
                match sum {
                    ExprId::ZERO => drop(series.terms.remove(at)),
                    _ => series.terms[at].1 = sum,
                }
            }
            None if coefficient == ExprId::ZERO => {}
            None => series.terms.push((exponent, coefficient)),
        }
    }

    /// The series without terms from the order on; `rest` receives the first omitted exponents. The order counts from
    /// zero. For exponents that vary with the point it counts from the least of those that differ by numbers.
    pub(super) fn cut(&mut self, mut series: Series) -> Series {
        let exponents: Vec<ExprId> = series.terms.iter().map(|term| term.0).collect();
        let order = self.pool.constant(Number::integer(self.order));
        let mut ends = vec![order];
        for &first in &exponents {
            if self.number_of(first).is_some() {
                continue;
            }
            let mut is_later =
                |&other: &ExprId| self.difference(first, other).is_some_and(|d| d > 0.0);
            if !exponents.iter().any(&mut is_later) {
                ends.push(self.pool.add(first, order));
            }
        }
        for end in ends {
            let n_terms = series.terms.len();
            let is_kept = |&(exponent, _): &(ExprId, ExprId)| {
                self.difference(exponent, end)
                    .is_none_or(|d| d < -SAME_EXPONENT)
            };
            series.terms.retain(is_kept);
            if series.terms.len() < n_terms {
                series.rest.push(end);
            }
        }
        series.rest.sort_unstable();
        series.rest.dedup();
        let all = series.rest.clone();
        (series.rest).retain(|&rest| {
            !all.iter()
                .any(|&other| self.difference(rest, other).is_some_and(|d| d > 0.0))
        });
        series
    }

    fn difference(&mut self, a: ExprId, b: ExprId) -> Option<f64> {
        match self.number_of(a).zip(self.number_of(b)) {
            Some((a, b)) => Some(a - b),
            None if self.pool.is_constant(a) || self.pool.is_constant(b) => None,
            None => {
                let difference = self.pool.sub(a, b);
                self.number_of(difference)
            }
        }
    }

    pub(super) fn plus(&mut self, mut a: Series, b: Series) -> Series {
        for term in b.terms {
            self.push(&mut a, term);
        }
        a.rest.extend(b.rest);
        self.cut(a)
    }

    pub(super) fn times(&mut self, a: &Series, b: &Series) -> Series {
        let mut product = Series::default();
        for &(r, c) in &a.terms {
            for &(s, d) in &b.terms {
                let term = (self.pool.add(r, s), self.pool.mul(c, d));
                self.push(&mut product, term);
            }
        }
        for (one, other) in [(a, b), (b, a)] {
            let exponents = other.terms.iter().map(|&(exponent, _)| exponent);
            for exponent in exponents.chain(other.rest.iter().copied()) {
                for &rest in &one.rest {
                    product.rest.push(self.pool.add(rest, exponent));
                }
            }
        }
        self.cut(product)
    }

    pub(super) fn shifted(
        &mut self,
        series: &Series,
        exponent: ExprId,
        coefficient: ExprId,
    ) -> Series {
        let order = std::mem::replace(&mut self.order, i64::MAX);
        let shifted = self.times(series, &Series::term(exponent, coefficient));
        self.order = order;
        shifted
    }

    pub(super) fn compare(&mut self, a: ExprId, b: ExprId) -> Result<Ordering, Stop> {
        let difference = self.pool.sub(a, b);
        let difference = self.facts.at(self.pool, difference);
        if let Some(number) = self.number_of(difference) {
            let is_same = number.abs() < SAME_EXPONENT;
            return Ok(if is_same { 0.0 } else { number }.total_cmp(&0.0));
        }
        if self.vanishes(difference)? {
            return Ok(Ordering::Equal);
        }
        Ok(match self.is_positive(difference)? {
            true => Ordering::Greater,
            false => Ordering::Less,
        })
    }

    pub(super) fn is_positive(&mut self, expr: ExprId) -> Result<bool, Stop> {
        self.facts.is_positive(self.pool, expr)
    }

    /// Removes and returns the first term that is not zero: exponent and coefficient.
    pub(super) fn lead(&mut self, series: &mut Series) -> Result<Option<(ExprId, ExprId)>, Stop> {
        while let Some(&(first, _)) = series.terms.first() {
            let mut least = first;
            for position in 1..series.terms.len() {
                let exponent = series.terms[position].0;
                if self.compare(exponent, least)?.is_lt() {
                    least = exponent;
                }
            }
            for position in 0..series.rest.len() {
                if self.compare(series.rest[position], least)?.is_le() {
                    return Err(Stop::Order);
                }
            }
            let mut coefficients = Vec::new();
            for (exponent, coefficient) in std::mem::take(&mut series.terms) {
                match self.compare(exponent, least)? {
                    Ordering::Equal => coefficients.push(coefficient),
                    _ => series.terms.push((exponent, coefficient)),
                }
            }
            let coefficient = self.pool.sum(&coefficients);
            let coefficient = self.facts.at(self.pool, coefficient);
            let vanishes = match self.vanishes(coefficient) {
                Err(Stop::Undecided(_)) if self.number_of(least).is_some_and(|n| n >= RARE) => {
                    false
                }
                known => known?,
            };
            if !vanishes {
                return Ok(Some((least, coefficient)));
            }
        }
        match series.rest.is_empty() || self.order >= LAST_ORDER {
            true => Ok(None),
            false => Err(Stop::Order),
        }
    }

    pub(super) fn linear(&mut self, series: &Series) -> Result<Option<ExprId>, Stop> {
        if !series.terms.iter().all(|term| term.0 == ExprId::ONE) {
            return Ok(None);
        }
        for &rest in &series.rest {
            if self.compare(rest, ExprId::ONE)?.is_le() {
                return Err(Stop::Order);
            }
        }
        let coefficient = series.terms.first().map(|term| term.1);
        Ok(Some(coefficient.unwrap_or(ExprId::ZERO)))
    }

    /// The value at `t = 0` and the terms that vanish there; the leading coefficient as an error where there is a pole.
    pub(super) fn split(
        &mut self,
        mut series: Series,
    ) -> Result<Result<(ExprId, Series), ExprId>, Stop> {
        let mut exponents = series.terms.iter().map(|term| self.number_of(term.0));
        if exponents.all(|number| number.is_some_and(|number| number >= 0.0)) {
            let is_constant = |&(e, _): &(ExprId, ExprId)| e == ExprId::ZERO;
            let at = series.terms.iter().position(is_constant);
            let value = at.map_or(ExprId::ZERO, |at| series.terms.remove(at).1);
            return Ok(Ok((value, series)));
        }
        let Some((exponent, coefficient)) = self.lead(&mut series)? else {
            return Ok(Ok((ExprId::ZERO, series)));
        };
        Ok(match self.compare(exponent, ExprId::ZERO)? {
            Ordering::Less => Err(coefficient),
            Ordering::Equal => Ok((coefficient, series)),
            Ordering::Greater => {
                self.push(&mut series, (exponent, coefficient));
                Ok((ExprId::ZERO, series))
            }
        })
    }

    /// `sum_k f_k G^k` for a series without terms that do not vanish.
    pub(super) fn composed(
        &mut self,
        inner: &Series,
        mut coefficient: impl FnMut(&mut Self, i64) -> ExprId,
    ) -> Series {
        let mut result = Series::constant(coefficient(self, 0));
        let mut exponents = inner.terms.iter().map(|term| self.number_of(term.0));
        let most = match exponents.all(|number| number.is_some()) {
            true => MOST_TERMS,
            false => 1,
        };
        let mut power = Series::constant(ExprId::ONE);
        for k in 1.. {
            power = self.times(&power, inner);
            if power.is_zero() {
                break;
            }
            if power.terms.is_empty() || k > most {
                let exponents = power.terms.into_iter().map(|(exponent, _)| exponent);
                result.rest.extend(exponents.chain(power.rest));
                break;
            }
            let factor = coefficient(self, k);
            let term = self.shifted(&power, ExprId::ZERO, factor);
            result = self.plus(result, term);
        }
        self.cut(result)
    }
}
