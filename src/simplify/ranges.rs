//! The terms of equations, their possible replacements, and ranges of their combinations over a box.

use super::equation::Rewrite;
use super::*;

/// Relative error of the algebra's constants, with room to spare: a merged or halved float has an error of 2^-53.
const CONSTANT_ROUNDING: f64 = 1.0 / (1u64 << 48) as f64;
/// A range counts as sharp when its ends are this close to values of the function, as a share of its width.
const SHARP: f64 = 1e-3;
const MAX_BOXES: usize = 64;
const MAX_VISITS: usize = 50_000;

type Part = (usize, Interval);

#[derive(Clone, Debug)]
pub(super) struct Workspace {
    pub library: Library,
    /// Number of the equations' own terms; the others are appended.
    original: usize,
    /// The rows of variables, and of the constant under none.
    pub rows: BTreeMap<Option<SymbolId>, usize>,
}

impl Workspace {
    /// The terms of `equations`, with `1` and the variables of summands that are not affine if a library holds them.
    pub(crate) fn new(equations: &Equations<'_>) -> Result<Self, ModelError> {
        let own = &equations.terms;
        let mut texts: Vec<String> = own.iter().map(|term| term.text.clone()).collect();
        let known: BTreeSet<ExprId> = own.iter().map(|term| term.expr).collect();
        let wanted = wanted(equations).into_iter();
        texts.extend(
            wanted
                .filter(|(expr, _)| !known.contains(expr))
                .map(|(_, text)| text),
        );
        let dim = equations.latent_dim();
        let library = Library::from_terms(dim, &texts)
            .or_else(|_| Library::from_terms(dim, &texts[..own.len()]))?;
        let of = |expr| match library.pool().as_symbol(expr) {
            None if expr == ExprId::ONE => Some(None),
            symbol => symbol.map(Some),
        };
        let terms = library.terms().iter().enumerate();
        let rows = terms.filter_map(|(row, term)| Some((of(term.expr)?, row)));
        Ok(Self {
            original: own.len(),
            rows: rows.collect(),
            library,
        })
    }

    pub(crate) fn text(&self, row: usize) -> &str {
        &self.library.terms()[row].text
    }

    pub(crate) fn constant(&self) -> Option<usize> {
        self.rows.get(&None).copied()
    }

    /// The coefficients of a phase with zeros for the appended terms, one row per term.
    pub(crate) fn coefficients(&self, equations: &Equations<'_>, phase: usize) -> DMatrix<f64> {
        let added = self.library.terms().len() - self.original;
        let own = equations.coefficients(phase);
        own.insert_rows(self.original, added, 0.0)
    }

    /// A model of these coefficients, one matrix per phase; appended terms that no phase uses are left out.
    pub(crate) fn finish(&self, model: ReducedModel, xi: &[DMatrix<f64>]) -> Result<ReducedModel> {
        let used = |row: &usize| xi.iter().any(|xi| xi.row(*row).iter().any(|&c| c != 0.0));
        let rows: Vec<usize> = (0..self.original)
            .chain((self.original..self.library.terms().len()).filter(used))
            .collect();
        let library = if rows.len() == self.original {
            model.library().clone()
        } else {
            let texts: Vec<String> = rows.iter().map(|&row| self.text(row).to_owned()).collect();
            Library::from_terms(model.latent_dim(), &texts)?
        };
        let phases = (model.phases().iter().zip(xi))
            .map(|(phase, xi)| crate::model::Phase {
                xi: xi.select_rows(&rows),
                ..phase.clone()
            })
            .collect();
        let builder = model.into_builder();
        Ok(builder.library(library).phases(phases).build()?)
    }
}

/// `1` and every variable of the terms in use that are no variables themselves, with their texts.
fn wanted(equations: &Equations<'_>) -> Vec<(ExprId, String)> {
    let pool = &equations.pool;
    let phases = equations.phases.iter();
    let summands = phases.flat_map(|phase| &phase.ddz).flatten();
    let active: BTreeSet<usize> = summands.map(|summand| summand.term).collect();
    let mut wanted = vec![(ExprId::ONE, "1".to_owned())];
    for term in active.into_iter().map(|term| &equations.terms[term]) {
        if pool.as_symbol(term.expr).is_none() {
            let symbols = pool.symbols_of(term.expr).into_iter();
            wanted.extend(symbols.map(|s| (pool.symbol_expr(s), pool.symbol_name(s).to_owned())));
        }
    }
    let mut seen = BTreeSet::new();
    wanted.retain(|(expr, _)| seen.insert(*expr));
    wanted
}

/// Whether an expression calls an elementary function, or has a power that is not a whole number.
pub(super) fn has_function(pool: &ExprPool, expr: ExprId) -> bool {
    (pool.reachable(&[expr]).into_iter()).any(|part| match pool.node(part) {
        Node::Apply(_, _) => true,
        Node::Power(_, exponent) => pool.as_integer(*exponent).is_none(),
        Node::Number(_) | Node::Symbol(_) | Node::Sum(_) | Node::Product(_) => false,
    })
}

/// The terms of a workspace over one box.
#[derive(Debug)]
pub(super) struct Ranges<'a> {
    pub workspace: &'a Workspace,
    pub pool: ExprPool,
    domain: Vec<(SymbolId, Interval)>,
    known: Vec<Option<Interval>>,
    /// Possible replacements of each term, computed on request.
    pub rewrites: Vec<Option<Vec<Rewrite>>>,
}

impl<'a> Ranges<'a> {
    pub(crate) fn new(workspace: &'a Workspace, domain: &[Interval]) -> Self {
        let library = &workspace.library;
        let variables = LatentVariable::all(library.latent_dim());
        let symbols = variables.filter_map(|variable| library.symbol(variable));
        Self {
            workspace,
            pool: library.pool().clone(),
            domain: symbols.zip(domain.iter().copied()).collect(),
            known: vec![None; library.terms().len()],
            rewrites: vec![None; library.terms().len()],
        }
    }

    pub(crate) fn expr(&self, row: usize) -> ExprId {
        self.workspace.library.terms()[row].expr
    }

    pub(crate) fn term(&mut self, row: usize) -> Interval {
        if let Some(range) = self.known[row] {
            return range;
        }
        let range = self.range(self.expr(row));
        self.known[row] = Some(range);
        range
    }

    /// All values of `sum delta_j theta_j`, for every choice of the `delta_j` in their intervals. Terms without common
    /// variables are independent: their ranges add. Others are bounded together, with the middles of the intervals as
    /// coefficients. For many terms it is sharper to bound together only terms with equal variables: both are done.
    pub(crate) fn combination(&mut self, parts: &[Part]) -> Interval {
        let connected = self.sum_of_groups(self.connected(parts));
        let alike = self.sum_of_groups(self.alike(parts));
        connected.intersection(alike)
    }

    fn sum_of_groups(&mut self, groups: Vec<Vec<Part>>) -> Interval {
        let mut total = Interval::point(0.0);
        for group in groups {
            if let [(row, delta)] = group[..] {
                total = total + delta * self.term(row);
                continue;
            }
            let mut summands = Vec::new();
            for &(row, delta) in &group {
                let (middle, expr) = (delta.middle(), self.expr(row));
                let factor = self.pool.number(middle);
                summands.push(self.pool.mul(factor, expr));
                let rest = delta - Interval::point(middle);
                let slack = Interval::point(CONSTANT_ROUNDING) * (delta.hull(-delta));
                total = total + (rest + slack) * self.term(row);
            }
            let sum = self.pool.sum(&summands);
            total = total + self.range(sum);
        }
        total
    }

    fn alike(&self, parts: &[Part]) -> Vec<Vec<Part>> {
        let mut groups: BTreeMap<Vec<SymbolId>, Vec<Part>> = BTreeMap::new();
        for &(row, delta) in parts {
            let symbols = self.pool.symbols_of(self.expr(row)).into_iter().collect();
            groups.entry(symbols).or_default().push((row, delta));
        }
        groups.into_values().collect()
    }

    /// Connected components: terms that share a variable, directly or through others.
    fn connected(&self, parts: &[Part]) -> Vec<Vec<Part>> {
        let mut groups: Vec<(BTreeSet<SymbolId>, Vec<Part>)> = Vec::new();
        for &(row, delta) in parts {
            let mut symbols = self.pool.symbols_of(self.expr(row));
            let mut members = vec![(row, delta)];
            let (joined, apart): (Vec<_>, Vec<_>) =
                (groups.into_iter()).partition(|(other, _)| !other.is_disjoint(&symbols));
            for (other, others) in joined {
                symbols.extend(other);
                members.extend(others);
            }
            groups = apart;
            groups.push((symbols, members));
        }
        groups.into_iter().map(|(_, members)| members).collect()
    }

    pub(crate) fn restricted(&self, expr: ExprId) -> Vec<(SymbolId, Interval)> {
        let symbols = self.pool.symbols_of(expr);
        let mut sides = self.domain.clone();
        sides.retain(|(symbol, _)| symbols.contains(symbol));
        sides
    }

    /// All values of an expression over the box, cut where bounds reach furthest until values come close to them.
    pub(crate) fn range(&mut self, expr: ExprId) -> Interval {
        let domain = self.restricted(expr);
        if self.is_single_use(expr) {
            return self.pool.bound_by_slopes(expr, &[], &domain);
        }
        let slopes = domain.iter().map(|(symbol, _)| *symbol);
        let slopes: Vec<ExprId> = slopes.map(|s| self.pool.derivative(expr, s)).collect();
        let whole = self.pool.bound_by_slopes(expr, &slopes, &domain);
        if !whole.magnitude().is_finite() || whole.is_empty() {
            return whole;
        }
        let walked = slopes.iter().chain([&expr]);
        let visits: usize = walked.map(|&part| self.pool.reachable(&[part]).len()).sum();
        let mut parts = vec![(domain.clone(), whole)];
        let mut reached = Interval::EMPTY;
        for _ in 1..MAX_BOXES.min(MAX_VISITS / visits.max(1)) {
            let newest = parts.len().saturating_sub(2);
            for (cell, _) in &parts[newest..] {
                reached = reached.hull(self.values(expr, cell));
            }
            let gap = SHARP * reached.width();
            let furthest = |key: fn(&Interval) -> f64| {
                let score = |place: &usize| key(&parts[*place].1);
                (0..parts.len()).max_by(|a, b| score(a).total_cmp(&score(b)))
            };
            let (top, bottom) = (furthest(|r| r.hi()), furthest(|r| -r.lo()));
            let worst = match (top, bottom) {
                (Some(top), _) if parts[top].1.hi() > reached.hi() + gap => top,
                (_, Some(bottom)) if parts[bottom].1.lo() < reached.lo() - gap => bottom,
                _ => break,
            };
            let (cell, range) = parts.swap_remove(worst);
            for half in halves(&cell, &domain) {
                let sharper = self.pool.bound_by_slopes(expr, &slopes, &half);
                parts.push((half, sharper.intersection(range)));
            }
        }
        let all = parts.iter().map(|(_, range)| *range);
        all.fold(Interval::EMPTY, Interval::hull)
            .intersection(whole)
    }

    /// Some values of `expr` in a box, in floating point: they only decide when to stop.
    fn values(&self, expr: ExprId, cell: &[(SymbolId, Interval)]) -> Interval {
        let ends: [fn(Interval) -> f64; 3] = [Interval::lo, Interval::middle, Interval::hi];
        let at = |end: fn(Interval) -> f64| {
            let value = self.pool.evaluate(expr, &|symbol| {
                let range = cell.iter().find(|(known, _)| *known == symbol);
                range.map_or(f64::NAN, |(_, range)| end(*range))
            });
            match value.is_finite() {
                true => Interval::point(value),
                false => Interval::EMPTY,
            }
        };
        (ends.map(at).into_iter()).fold(Interval::EMPTY, Interval::hull)
    }

    /// Whether every symbol occurs once, so that interval evaluation is sharp.
    fn is_single_use(&self, expr: ExprId) -> bool {
        let mut seen = BTreeSet::new();
        let mut open = vec![expr];
        while let Some(part) = open.pop() {
            if let Node::Symbol(symbol) = self.pool.node(part)
                && !seen.insert(*symbol)
            {
                return false;
            }
            // shared parts are walked again, to count occurrences; a repeated symbol ends the walk before that can grow
            open.extend(self.pool.children(part));
        }
        true
    }
}

/// A box cut in the middle of its widest side, measured by the sides of the whole domain.
fn halves(
    cell: &[(SymbolId, Interval)],
    whole: &[(SymbolId, Interval)],
) -> [Vec<(SymbolId, Interval)>; 2] {
    let width = |place: &usize| match whole[*place].1.width() {
        all if all > 0.0 => cell[*place].1.width() / all,
        _ => 0.0,
    };
    let widest = (0..cell.len()).max_by(|a, b| width(a).total_cmp(&width(b)));
    let mut halves = [cell.to_vec(), cell.to_vec()];
    if let Some(side) = widest {
        let range = cell[side].1;
        let middle = range.middle();
        halves[0][side].1 = Interval::new(range.lo(), middle);
        halves[1][side].1 = Interval::new(middle, range.hi());
    }
    halves
}

#[cfg(test)]
#[path = "../../tests/units/simplify_ranges.rs"]
mod tests;
