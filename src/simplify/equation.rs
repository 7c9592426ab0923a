//! Replacements of a term (nothing, a constant, a straight line), and which changes are made to one equation. Each is
//! made to the equation as earlier ones left it; its error, enclosed over the box, adds as an interval to the total.

use super::certificate::Effect;
use super::ranges::has_function;
use super::*;

/// Share of the tolerance that removing terms may use; the rest is for shorter coefficients.
const REMOVAL_SHARE: f64 = 0.75;
/// A coefficient of this many significant digits reads back as itself.
const MAX_DIGITS: usize = 17;

const MAX_LINEAR_SYMBOLS: usize = 4;
/// A constant or slope that would lower the error by less than this share is left out.
const WORTHWHILE: f64 = 0.05;

/// Whether two floats are the same number but for the rounding of a product: `-0.9810000000000001` is 9.81 times -0.1.
pub(super) fn is_same_decimal(before: f64, after: f64) -> bool {
    (before - after).abs() <= 2.0 * f64::EPSILON * before.abs()
}

/// A replacement of a term `theta`: `theta = sum r_k theta_k + error`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Rewrite {
    kind: ChangeKind,
    /// Rows and factors `r_k`.
    parts: Vec<(usize, f64)>,
    error: Interval,
}

impl Ranges<'_> {
    fn effect(&self, row: usize, before: f64, after: f64) -> Effect {
        let term = self.workspace.text(row).to_owned();
        Effect {
            row,
            term,
            before,
            after,
        }
    }

    /// All replacements of a term, simplest first; none for a term without finite values in the box.
    fn rewrites(&mut self, row: usize) -> &[Rewrite] {
        if self.rewrites[row].is_none() {
            self.rewrites[row] = Some(self.found(row));
        }
        self.rewrites[row].as_deref().expect("found now or before")
    }

    fn found(&mut self, row: usize) -> Vec<Rewrite> {
        let range = self.term(row);
        if range.is_empty() || !range.magnitude().is_finite() {
            return Vec::new();
        }
        let mut all = vec![Rewrite {
            kind: ChangeKind::Dropped,
            parts: Vec::new(),
            error: range,
        }];
        if self.workspace.constant() == Some(row) {
            return all;
        }
        all.extend(self.centred(ChangeKind::Constant, Vec::new(), range));
        let Some(parts) = self.slopes(row) else {
            return all;
        };
        let negated = (parts.iter()).map(|&(row, factor)| (row, Interval::point(-factor)));
        let one = (row, Interval::point(1.0));
        let difference: Vec<_> = std::iter::once(one).chain(negated).collect();
        let error = self.combination(&difference);
        if error.magnitude().is_finite() {
            let kind = ChangeKind::Linear;
            let with_constant = self.centred(kind, parts.clone(), error);
            all.extend(with_constant.or(Some(Rewrite { kind, parts, error })));
        }
        all
    }

    /// The replacement with a constant that centres the error at zero, if the reduction justifies it.
    fn centred(
        &self,
        kind: ChangeKind,
        mut parts: Vec<(usize, f64)>,
        error: Interval,
    ) -> Option<Rewrite> {
        let middle = error.middle();
        if middle.abs() <= WORTHWHILE * error.magnitude() {
            return None;
        }
        parts.push((self.workspace.constant()?, middle));
        let error = error - Interval::point(middle);
        Some(Rewrite { kind, parts, error })
    }

    /// Slopes of the chords along each variable through the middle of the box, exact for products.
    fn slopes(&mut self, row: usize) -> Option<Vec<(usize, f64)>> {
        let expr = self.expr(row);
        let sides = self.restricted(expr);
        let is_affine = sides.iter().all(|&(symbol, _)| {
            let slope = self.pool.derivative(expr, symbol);
            self.pool.is_constant(slope)
        });
        if is_affine || sides.len() > MAX_LINEAR_SYMBOLS {
            return None;
        }
        let size = self.term(row).width();
        let mut parts = Vec::new();
        for &(moved, range) in &sides {
            let half = 0.5 * range.width();
            // where one variable is so many half widths from its centre and the others are at theirs
            let value = |step: f64| {
                self.pool.evaluate(expr, &|symbol| {
                    let side = sides.iter().find(|(known, _)| *known == symbol);
                    let centre = side.map_or(f64::NAN, |(_, range)| range.middle());
                    let step = if symbol == moved { step } else { 0.0 };
                    centre + step * half
                })
            };
            let rise = value(1.0) - value(-1.0);
            if half == 0.0 || rise.abs() <= WORTHWHILE * size {
                continue;
            }
            let row = *self.workspace.rows.get(&Some(moved))?;
            parts.push((row, rise / (2.0 * half)));
        }
        let is_line = !parts.is_empty() && parts.iter().all(|part| part.1.is_finite());
        is_line.then_some(parts)
    }
}

#[derive(Clone, Debug)]
pub(super) struct Equation {
    pub xi: Vec<f64>,
    pub changes: Vec<Change>,
    /// Encloses the original equation minus the present one.
    pub spent: Interval,
    /// The row whose coefficient is known, which keeps its value.
    known: Option<usize>,
}

impl Equation {
    pub(crate) fn new(xi: Vec<f64>, known: Option<usize>) -> Self {
        Self {
            xi,
            changes: Vec::new(),
            spent: Interval::point(0.0),
            known,
        }
    }

    pub(crate) fn simplified(mut self, terms: &mut Ranges<'_>, allowed: f64) -> Self {
        self.remove_terms(terms, REMOVAL_SHARE * allowed);
        self.fold_functions(terms, REMOVAL_SHARE * allowed);
        self.round(terms, allowed);
        self
    }

    fn active(&self) -> Vec<usize> {
        (0..self.xi.len())
            .filter(|&row| self.xi[row] != 0.0)
            .collect()
    }

    /// Removes terms, the cheapest first: without replacement, or into terms that are there anyway.
    fn remove_terms(&mut self, terms: &mut Ranges<'_>, allowed: f64) {
        loop {
            let mut best: Option<(f64, usize, usize)> = None;
            for row in self.active() {
                let size = self.xi[row].abs();
                for (choice, rewrite) in terms.rewrites(row).iter().enumerate() {
                    let mut parts = rewrite.parts.iter();
                    let cost = size * rewrite.error.magnitude();
                    let is_better = best.is_none_or(|(least, _, _)| cost < least);
                    let is_open = self.keeps_known(row, rewrite);
                    if is_open && is_better && parts.all(|&(part, _)| self.xi[part] != 0.0) {
                        best = Some((cost, row, choice));
                    }
                }
            }
            let Some((_, row, choice)) = best else { return };
            let rewrite = terms.rewrites(row)[choice].clone();
            let change = self.change(terms, row, &rewrite);
            if !self.fits(&change, allowed) {
                return;
            }
            self.make(change);
        }
    }

    /// Replaces terms that call functions by the simplest form that fits, the cheapest first.
    fn fold_functions(&mut self, terms: &mut Ranges<'_>, allowed: f64) {
        loop {
            let mut best: Option<Change> = None;
            for row in self.active() {
                let expr = terms.expr(row);
                if !has_function(&terms.pool, expr) {
                    continue;
                }
                let rewrites = terms.rewrites(row).to_vec();
                let open = rewrites.iter().filter(|r| self.keeps_known(row, r));
                let mut changes = open.map(|rewrite| self.change(terms, row, rewrite));
                let Some(change) = changes.find(|change| self.fits(change, allowed)) else {
                    continue;
                };
                let size = change.bound.magnitude();
                if (best.as_ref()).is_none_or(|best| size < best.bound.magnitude()) {
                    best = Some(change);
                }
            }
            let Some(change) = best else { return };
            self.make(change);
        }
    }

    /// Rounds coefficients: the cheapest digits go first, one after another, as long as all together fit.
    fn round(&mut self, terms: &mut Ranges<'_>, allowed: f64) {
        let mut chosen: Vec<Option<Change>> = vec![None; self.xi.len()];
        // sums of floats select candidates; accepted changes are checked with intervals
        let (mut lo, mut hi) = (self.spent.lo(), self.spent.hi());
        for change in self.roundings(terms) {
            let place = &mut chosen[change.own.row];
            let former = (place.as_ref()).map_or((0.0, 0.0), |c| (c.bound.lo(), c.bound.hi()));
            let new_lo = lo - former.0 + change.bound.lo();
            let new_hi = hi - former.1 + change.bound.hi();
            if new_hi.max(-new_lo) <= allowed {
                (lo, hi) = (new_lo, new_hi);
                *place = Some(change);
            }
        }
        for change in chosen.into_iter().flatten() {
            if self.fits(&change, allowed) {
                self.make(change);
            }
        }
    }

    fn roundings(&self, terms: &mut Ranges<'_>) -> Vec<Change> {
        let mut changes: Vec<Change> = Vec::new();
        for row in self.active() {
            let range = terms.term(row);
            if range.is_empty() || !range.magnitude().is_finite() {
                continue;
            }
            let before = self.xi[row];
            let mut last = before;
            for digits in (1..MAX_DIGITS).rev() {
                let after = rounded(before, digits);
                if self.known == Some(row) && !is_same_decimal(before, after) {
                    break;
                }
                if after == last {
                    // fewer digits write the same number
                    let same = changes.last_mut().filter(|change| change.own.row == row);
                    if let Some(change) = same {
                        change.digits = Some(digits);
                    }
                    continue;
                }
                last = after;
                changes.push(Change {
                    kind: ChangeKind::Rounded,
                    digits: Some(digits),
                    own: terms.effect(row, before, after),
                    effects: Vec::new(),
                    measured: None,
                    bound: (Interval::point(before) - Interval::point(after)) * range,
                });
            }
        }
        changes.sort_by(|a, b| a.bound.magnitude().total_cmp(&b.bound.magnitude()));
        changes
    }

    fn change(&self, terms: &mut Ranges<'_>, row: usize, rewrite: &Rewrite) -> Change {
        let before = self.xi[row];
        let mut bound = Interval::point(before) * rewrite.error;
        let mut effects = Vec::new();
        for &(part, factor) in &rewrite.parts {
            let (old, new) = (self.xi[part], self.xi[part] + before * factor);
            // rounding error of the sum of floats
            let exact = Interval::point(before) * Interval::point(factor);
            let rounding = exact - (Interval::point(new) - Interval::point(old));
            bound = bound + rounding * terms.term(part);
            effects.push(terms.effect(part, old, new));
        }
        Change {
            kind: rewrite.kind,
            digits: None,
            own: terms.effect(row, before, 0.0),
            effects,
            bound,
            measured: None,
        }
    }

    fn keeps_known(&self, row: usize, rewrite: &Rewrite) -> bool {
        let mut rows = rewrite.parts.iter().map(|&(part, _)| part);
        self.known
            .is_none_or(|known| known != row && rows.all(|part| part != known))
    }

    fn fits(&self, change: &Change, allowed: f64) -> bool {
        let is_finite = change.effects.iter().all(|effect| effect.after.is_finite());
        is_finite && (self.spent + change.bound).magnitude() <= allowed
    }

    fn make(&mut self, change: Change) {
        for effect in change.coefficients() {
            self.xi[effect.row] = effect.after;
        }
        self.spent = self.spent + change.bound;
        self.changes.push(change);
    }
}
