//! Search in ranges of variables for a point where two expressions differ by more than rounding explains.

use std::collections::{BTreeMap, BTreeSet};

use chacha20::ChaCha8Rng;
use chacha20::rand_core::{Rng, SeedableRng};

use super::*;

/// Points that are tried without a proof of equality, and with one, where they only show where both sides have values.
const POINTS: usize = 3_000;
const POINTS_OF_EQUALS: usize = 64;
const ENOUGH: usize = 200;
const SCALES: [f64; 8] = [1.0, 1.0, 1.0, 0.3, 3.0, 0.03, 10.0, 100.0];

pub(crate) type Point = BTreeMap<String, f64>;

#[derive(Clone, Debug, PartialEq)]
pub struct Gap {
    pub point: Point,
    pub left: f64,
    pub right: f64,
}

impl Gap {
    fn size(&self) -> f64 {
        (self.left - self.right).abs()
    }

    fn relative_size(&self) -> f64 {
        self.size() / (1.0 + self.left.abs().max(self.right.abs()))
    }

    fn is_one_sided(&self) -> bool {
        match [self.left, self.right] {
            [none, value] | [value, none] if none.is_nan() => value.is_finite(),
            _ => false,
        }
    }
}

#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Search {
    pub(super) gap: Option<Gap>,
    /// The point with the largest difference, which rounding may explain.
    pub(super) largest: Option<Gap>,
    /// A point where only one side has a value (the other is NaN).
    pub(super) one_sided: Option<Gap>,
    pub(super) has_common_point: bool,
}

impl Search {
    fn add(&mut self, gap: Gap, are_apart: impl FnOnce() -> bool) {
        if !(gap.left.is_finite() && gap.right.is_finite()) {
            if gap.is_one_sided() {
                self.one_sided.get_or_insert(gap);
            }
            return;
        }
        self.has_common_point = true;
        let best = self.gap.as_ref().map(Gap::relative_size);
        let largest = self.largest.as_ref().map_or(0.0, Gap::size);
        if are_apart() {
            if best.is_none_or(|best| gap.relative_size() > best) {
                self.gap = Some(gap);
            }
        } else if self.gap.is_none() && gap.size() > largest {
            self.largest = Some(gap);
        }
    }
}

pub(super) struct Sides<'s> {
    pub(super) pool: &'s ExprPool,
    pub(super) whole: [ExprId; 2],
    /// The same without the terms that both have; the difference is that of the whole sides.
    pub(super) rest: [ExprId; 2],
    /// Expressions with values exactly where each side as written has one.
    pub(super) guards: [&'s [ExprId]; 2],
}

/// All variables at once, and single groups with the others zero, so that a small term is visible next to large ones.
pub(super) fn search(
    sides: &Sides<'_>,
    phase: &str,
    domain: &CheckDomain,
    groups: &[ExprId],
    is_proven: bool,
) -> Search {
    let pool = sides.pool;
    let variables: Vec<SymbolId> = (sides.whole.iter())
        .chain(sides.guards.into_iter().flatten())
        .flat_map(|expr| pool.symbols_of(*expr))
        .filter(|symbol| pool.decimal_of(*symbol).is_none())
        .collect::<BTreeSet<_>>()
        .into_iter()
        .collect();
    let range = |symbol: &SymbolId| domain.range(phase, pool.symbol_name(*symbol));
    let ranges: Vec<Option<[f64; 2]>> = variables.iter().map(range).collect();
    let has_domain = ranges.iter().any(Option::is_some);
    let groups: Vec<BTreeSet<SymbolId>> =
        groups.iter().map(|expr| pool.symbols_of(*expr)).collect();
    let mut random = ChaCha8Rng::seed_from_u64(12);
    let mut search = Search::default();
    let last = if is_proven { POINTS_OF_EQUALS } else { POINTS };
    let nothing = BTreeSet::new();
    for attempt in 0..=last {
        let scale = match has_domain {
            true => 1.0,
            false => SCALES[attempt % SCALES.len()],
        };
        let group = match attempt % 3 {
            _ if attempt == last => Some(&nothing),
            2 => groups.get(attempt / 3 % groups.len().max(1)),
            _ => None,
        };
        let values: BTreeMap<SymbolId, f64> = (variables.iter().zip(&ranges))
            .map(|(symbol, range)| {
                let share = random.next_u32() as f64 / f64::from(u32::MAX);
                let value = match range {
                    Some([lo, hi]) => lo + share * (hi - lo),
                    None => scale * (2.0 * share - 1.0),
                };
                let value = match group {
                    Some(group) if !group.contains(symbol) => {
                        range.map_or(0.0, |[lo, hi]| 0.0_f64.clamp(lo, hi))
                    }
                    _ => format!("{value:.3e}").parse().unwrap_or(value),
                };
                (*symbol, value)
            })
            .collect();
        search.add(sides.at(&values), || sides.are_apart(&values));
        if search.gap.is_some() && attempt >= ENOUGH {
            break;
        }
    }
    search
}

impl Sides<'_> {
    /// NaN for a side without a value, also if the undefined part cancelled; an infinity where floats overflow.
    fn at(&self, values: &BTreeMap<SymbolId, f64>) -> Gap {
        let value_of = |symbol: SymbolId| values.get(&symbol).copied().unwrap_or(0.0);
        let both = [0, 1].map(|side| {
            let all = [&[self.whole[side]], self.guards[side]].concat();
            let found = self.pool.evaluate_all(&all, &value_of);
            if found.iter().all(|value| value.is_finite()) {
                return found[0];
            }
            let bounds = self.bounds_of(&all, values);
            let mut parts = found.iter().zip(bounds);
            match parts.any(|(value, bounds)| !value.is_finite() && bounds.is_empty()) {
                true => f64::NAN,
                false => f64::INFINITY,
            }
        });
        Gap {
            point: (values.iter())
                .map(|(symbol, value)| (self.pool.symbol_name(*symbol).to_owned(), *value))
                .collect(),
            left: both[0],
            right: both[1],
        }
    }

    fn bounds_of(&self, exprs: &[ExprId], values: &BTreeMap<SymbolId, f64>) -> Vec<Interval> {
        let range_of =
            |symbol: SymbolId| Interval::point(values.get(&symbol).copied().unwrap_or(0.0));
        self.pool.evaluate_intervals(exprs, &range_of)
    }

    fn are_apart(&self, values: &BTreeMap<SymbolId, f64>) -> bool {
        let bounds = self.bounds_of(&self.rest, values);
        let [left, right] = [bounds[0], bounds[1]];
        !left.is_empty() && !right.is_empty() && (left.hi() < right.lo() || right.hi() < left.lo())
    }
}

/// A range per variable and phase; -1 to 1 where there is none.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct CheckDomain {
    phases: BTreeMap<String, BTreeMap<String, [f64; 2]>>,
}

impl CheckDomain {
    /// Reads a TOML text: a table per phase with ranges such as `z1 = [-0.2, 0.4]`, scaled units.
    pub(crate) fn from_toml(path: &Path, text: &str) -> Result<Self, ImportError> {
        let file = path.display().to_string();
        let refused = |message: String| ImportError::text(&file, Place::Whole, message);
        let phases: BTreeMap<String, BTreeMap<String, [f64; 2]>> =
            toml::from_str(text).map_err(|error| refused(error.to_string()))?;
        for (phase, ranges) in &phases {
            for (name, [lo, hi]) in ranges {
                let place = format!("[{phase}] `{name}`");
                if LatentVariable::from_name(name, MAX_LATENT_DIM).is_none() {
                    return Err(refused(format!("{place}: expected z1, dz1, u1 and so on")));
                }
                if !(lo.is_finite() && hi.is_finite() && lo <= hi) {
                    let found =
                        format!("{place}: found [{lo}, {hi}], expected two rising finite numbers");
                    return Err(refused(found));
                }
            }
        }
        Ok(Self { phases })
    }

    /// The first phase or variable that is none of these: its ranges would be without effect.
    pub(crate) fn foreign(&self, phases: &[&str], latent_dim: usize) -> Option<String> {
        let foreign = self.phases.iter().find_map(|(phase, ranges)| {
            if !phases.contains(&phase.as_str()) {
                return Some(format!("[{phase}]"));
            }
            let is_foreign = |name: &&String| LatentVariable::from_name(name, latent_dim).is_none();
            let name = ranges.keys().find(is_foreign)?;
            Some(format!("[{phase}] `{name}`"))
        });
        foreign.map(|found| {
            let phases = phases.join(", ");
            format!("{found}: expected phases {phases}, and variables of {latent_dim} latent coordinates")
        })
    }

    pub(crate) fn range(&self, phase: &str, variable: &str) -> Option<[f64; 2]> {
        self.phases.get(phase)?.get(variable).copied()
    }
}
