//! Pairs phases and equations, and decides each pair.

use std::collections::HashMap;

use serde::Serialize;

use super::point::{Sides, search};
use super::side::{Floats, RightSide, SidePhase};
use super::*;

const MAX_TERMS: usize = 5;

#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Phases of the first file in its order, then those that only the second has.
    pub(crate) phases: Vec<PhaseComparison>,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PhaseComparison {
    /// Its name, or its place from 1 where no file names it.
    pub name: String,
    pub equations: Vec<EquationComparison>,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct EquationComparison {
    pub output: String,
    pub verdict: Verdict,
    /// A point where only one side has a value.
    pub one_sided: Option<Gap>,
}

#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    /// Proven equal wherever both have a value.
    Equal,
    /// But for the rounding of printed decimals, which moves coefficients of the normal form by at most this.
    EqualAsPrinted(f64),
    Different(Difference),
    /// Neither a proof nor a point; the largest difference that was seen, and terms that differ.
    Undecided(Option<Gap>, Vec<TermDifference>),
    /// The first (`false`) or second (`true`) file does not have it.
    Missing(bool),
}

#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    pub gap: Gap,
    /// Terms with different coefficients as the files write them, largest difference first.
    pub(crate) terms: Vec<TermDifference>,
    /// The terms differ by more than their own rounding explains, but at no one point by more than all rounding.
    pub beside_rounding: bool,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TermDifference {
    pub term: String,
    /// Coefficient in the first file, 0 without the term.
    pub left: f64,
    pub right: f64,
}

impl Verdict {
    pub(crate) fn is_equal(&self) -> bool {
        matches!(self, Verdict::Equal | Verdict::EqualAsPrinted(_))
    }
}

impl Comparison {
    pub fn is_equal(&self) -> bool {
        self.verdicts().all(Verdict::is_equal)
    }

    pub fn verdicts(&self) -> impl Iterator<Item = &Verdict> {
        let equations = self.phases.iter().flat_map(|phase| &phase.equations);
        equations.map(|equation| &equation.verdict)
    }
}

pub fn compare(left: &Side, right: &Side, options: &CheckOptions) -> Comparison {
    let outputs = left.latent_dim.max(right.latent_dim);
    let phases =
        (paired(&left.phases, &right.phases).into_iter().enumerate()).map(|(place, pair)| {
            let name = (pair.iter().flatten()).find_map(|phase| phase.name.clone());
            let name = name.unwrap_or_else(|| (place + 1).to_string());
            let equations = (0..outputs).map(|output| {
                let ddz = pair.map(|phase| phase.and_then(|phase| phase.ddz.get(output)));
                let output = format!("ddz{}", output + 1);
                let (verdict, one_sided) = match ddz {
                    [Some(a), Some(b)] => decide([left, right], [a, b], &name, options),
                    [first, _] => (Verdict::Missing(first.is_some()), None),
                };
                EquationComparison {
                    output,
                    verdict,
                    one_sided,
                }
            });
            PhaseComparison {
                name: name.clone(),
                equations: equations.collect(),
            }
        });
    Comparison {
        phases: phases.collect(),
    }
}

/// Phases by name; those without a name in one of the files by their order among the rest.
fn paired<'p>(left: &'p [SidePhase], right: &'p [SidePhase]) -> Vec<[Option<&'p SidePhase>; 2]> {
    let mut taken = vec![false; right.len()];
    let mut pairs: Vec<[Option<&SidePhase>; 2]> =
        left.iter().map(|phase| [Some(phase), None]).collect();
    for [phase, partner] in &mut pairs {
        let name = phase.and_then(|phase| phase.name.as_ref());
        let is_same = |other: &SidePhase| name.is_some() && other.name.as_ref() == name;
        if let Some(place) = right.iter().position(is_same) {
            (*partner, taken[place]) = (Some(&right[place]), true);
        }
    }
    for [phase, partner] in pairs.iter_mut().filter(|pair| pair[1].is_none()) {
        let is_named = phase.is_some_and(|phase| phase.name.is_some());
        let free = (0..right.len())
            .find(|place| !(taken[*place] || is_named && right[*place].name.is_some()));
        if let Some(place) = free {
            (*partner, taken[place]) = (Some(&right[place]), true);
        }
    }
    let rest = right.iter().zip(&taken).filter(|(_, taken)| !**taken);
    pairs.extend(rest.map(|(phase, _)| [None, Some(phase)]));
    pairs
}

fn decide(
    files: [&Side; 2],
    ddz: [&RightSide; 2],
    phase: &str,
    options: &CheckOptions,
) -> (Verdict, Option<Gap>) {
    let decided = decide_with(Floats::Exact, files, ddz, phase, options);
    let are_models = ddz.map(|side| matches!(side, RightSide::Summands(_)));
    match decided.0 {
        // A text can contain 1/3, a model cannot.
        Verdict::Undecided(..) if are_models[0] != are_models[1] && !options.exact => {
            let rounded = decide_with(Floats::Rounded, files, ddz, phase, options);
            match rounded.0 {
                Verdict::EqualAsPrinted(_) => rounded,
                _ => decided,
            }
        }
        _ => decided,
    }
}

fn decide_with(
    floats: Floats,
    files: [&Side; 2],
    ddz: [&RightSide; 2],
    phase: &str,
    options: &CheckOptions,
) -> (Verdict, Option<Gap>) {
    let mut pool = ExprPool::exact();
    let read = [0, 1].map(|side| files[side].build(ddz[side], floats, &mut pool));
    let whole = [read[0].expr, read[1].expr];
    let guards = [&read[0].guards[..], &read[1].guards[..]];
    let restrictions = guards.concat();
    let table = Table::of(&mut pool, whole);
    let (rows, strange) = (table.differing().collect::<Vec<_>>(), table.unexplained());
    let rest = [0, 1].map(|side| sum(&mut pool, side, &rows));
    let unexplained = [0, 1].map(|side| sum(&mut pool, side, &strange));
    // The exact side first: rounded arguments of the other are compared with its own.
    let order = if files[0].is_rounded && !files[1].is_rounded {
        [1, 0]
    } else {
        [0, 1]
    };
    let proof = proof(&pool, &restrictions, rest, order);
    let searched = |rest: [ExprId; 2], rows: &[&Row]| {
        let groups: Vec<ExprId> = rows.iter().map(|row| row.rest).collect();
        let sides = Sides {
            pool: &pool,
            whole,
            rest,
            guards,
        };
        search(&sides, phase, &options.domain, &groups, proof.is_some())
    };
    let mut found = searched(rest, &rows);
    let mut beside_rounding = false;
    if proof.is_none() && found.gap.is_none() {
        // Rounding of some terms can hide the difference of others at every single point.
        found.gap = searched(unexplained, &strange).gap;
        beside_rounding = found.gap.is_some();
    }
    let terms = || table.largest(&pool);
    let has_points = found.has_common_point || found.one_sided.is_none();
    let verdict = match (proof, found.gap) {
        (Some(verdict), None) if has_points => verdict,
        (_, Some(gap)) => Verdict::Different(Difference {
            gap,
            terms: terms(),
            beside_rounding,
        }),
        (_, None) => Verdict::Undecided(found.largest, terms()),
    };
    (verdict, found.one_sided)
}

/// A proof that the remainders of both sides are equal wherever the restrictions have values.
fn proof(
    pool: &ExprPool,
    restrictions: &[ExprId],
    rest: [ExprId; 2],
    order: [usize; 2],
) -> Option<Verdict> {
    if rest == [ExprId::ZERO; 2] {
        return Some(Verdict::Equal);
    }
    let mut forms = CanonicalForms::new(pool, restrictions);
    let [first, second] = order.map(|side| forms.of(rest[side]));
    let difference = &first - &second;
    let verdict = |form: &CanonicalForm, rounding: f64| {
        let sizes = form.coefficients().map(Coefficient::magnitude);
        match (form.is_zero() && rounding == 0.0, form.may_be_zero()) {
            (true, _) => Some(Verdict::Equal),
            (_, true) => Some(Verdict::EqualAsPrinted(sizes.fold(rounding, f64::max))),
            _ => None,
        }
    };
    let mut found = verdict(&difference, forms.rounding);
    if found.is_none() {
        let cleared = forms.without_fractions(&difference)?;
        found = verdict(&cleared, forms.rounding);
    }
    found.filter(|_| !forms.is_contradictory)
}

fn sum(pool: &mut ExprPool, side: usize, rows: &[&Row]) -> ExprId {
    let terms: Vec<ExprId> = ((rows.iter()).flat_map(|row| row.terms[side].clone())).collect();
    pool.sum(&terms)
}

/// Terms of both sides, identified without their numbers.
struct Table {
    rows: Vec<Row>,
}

struct Row {
    rest: ExprId,
    coefficients: [Coefficient; 2],
    terms: [Vec<ExprId>; 2],
}

impl Row {
    fn difference(&self) -> Coefficient {
        &self.coefficients[0] - &self.coefficients[1]
    }
}

impl Table {
    fn of(pool: &mut ExprPool, whole: [ExprId; 2]) -> Self {
        let mut rows: Vec<Row> = Vec::new();
        let mut places: HashMap<ExprId, usize> = HashMap::new();
        for (side, expr) in whole.into_iter().enumerate() {
            let mut open = vec![(ExprId::ONE, Coefficient::from(Number::ONE), expr)];
            while let Some((factor, scale, expr)) = open.pop() {
                let factors = pool.factors_of(expr).iter();
                let (numbers, rest): (Vec<ExprId>, Vec<ExprId>) =
                    factors.partition(|factor| value_of(pool, **factor).is_some());
                let values = numbers.iter().filter_map(|number| value_of(pool, *number));
                let value = values.reduce(|product, value| &product * &value);
                let coefficient = value.map_or_else(|| scale.clone(), |value| &scale * &value);
                let rest = pool.product(&rest);
                let factor = pool.product(&[&[factor], numbers.as_slice()].concat());
                if let Node::Sum(terms) = pool.node(rest) {
                    let terms = terms.iter();
                    open.extend(terms.map(|&term| (factor, coefficient.clone(), term)));
                    continue;
                }
                let place = *places.entry(rest).or_insert_with(|| {
                    let zero = Coefficient::from(Number::ZERO);
                    rows.push(Row {
                        rest,
                        coefficients: [zero.clone(), zero],
                        terms: [Vec::new(), Vec::new()],
                    });
                    rows.len() - 1
                });
                let term = pool.product(&[factor, rest]);
                let row = &mut rows[place];
                row.coefficients[side] = &row.coefficients[side] + &coefficient;
                row.terms[side].push(term);
            }
        }
        Self { rows }
    }

    fn differing(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter().filter(|row| {
            let difference = row.difference();
            !difference.is_zero() || difference.radius() > 0.0
        })
    }

    fn unexplained(&self) -> Vec<&Row> {
        let rows = self.differing();
        rows.filter(|row| !row.difference().may_be_zero()).collect()
    }

    /// The rows that rounding does not explain, largest difference first.
    fn largest(&self, pool: &ExprPool) -> Vec<TermDifference> {
        let mut rows = self.unexplained();
        let size = |row: &Row| row.difference().magnitude();
        rows.sort_by(|a, b| size(b).total_cmp(&size(a)));
        rows.truncate(MAX_TERMS);
        let term = |row: &&Row| {
            let [left, right] =
                [&row.coefficients[0], &row.coefficients[1]].map(Coefficient::to_f64);
            let text = pool.display(row.rest).to_string().replace(['#', '~'], "");
            let term = match text.char_indices().nth(60) {
                Some((end, _)) => format!("{}...", &text[..end]),
                None => text,
            };
            TermDifference { term, left, right }
        };
        rows.iter().map(term).collect()
    }
}

fn value_of(pool: &ExprPool, factor: ExprId) -> Option<Coefficient> {
    match pool.node(factor) {
        Node::Number(number) => Some(Coefficient::from(*number)),
        Node::Symbol(symbol) => pool.decimal_of(*symbol).map(|(decimal, _)| decimal.clone()),
        _ => None,
    }
}
