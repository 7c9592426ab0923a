//! Sums of products in nested form: `a x y + b x z^2` becomes `x (a y + b z^2)`, Horner's rule for several variables.
//!
//! Moving a common factor out of products that only one sum uses saves a multiplication each and costs one for the
//! group. A product of many sums is computed once for all and stays. The remaining sum is often needed again, as the
//! derivative of the sum by that factor.

use super::*;
use crate::symbolic::Number;

/// `flat + shared + sum_g factor_g (single_g + repeated_g)`.
pub(super) struct Nested {
    pub flat: Combination,
    /// A part that another sum has computed: which sum, and the group of which it is the `single`.
    pub shared: Option<(usize, usize)>,
    pub groups: Vec<Group>,
}

pub(super) struct Group {
    pub factor: ExprId,
    /// Its cofactor without the factor: the derivative of these terms by the factor.
    pub single: Combination,
    /// Its cofactor with the factor again.
    pub repeated: Combination,
}

impl Nested {
    /// The group whose terms, divided by their `factor`, all occur in `derivative`.
    pub(crate) fn part_of(&self, factor: ExprId, derivative: &Combination) -> Option<usize> {
        let occurs = |item: &(f64, ExprId)| derivative.items.contains(item);
        let is_part = |group: &Group| {
            let items = &group.single.items;
            group.factor == factor && items.len() > 1 && items.iter().all(occurs)
        };
        self.groups.iter().position(is_part)
    }

    /// All expressions that are multiplied by a coefficient or are factors of a group.
    pub(crate) fn expressions(&self) -> impl Iterator<Item = ExprId> + '_ {
        let sums = self.groups.iter().flat_map(|g| [&g.single, &g.repeated]);
        let factors = self.groups.iter().map(|group| group.factor);
        let items = sums.chain([&self.flat]).flat_map(|sum| &sum.items);
        items.map(|&(_, expr)| expr).chain(factors)
    }
}

/// How often each product is wanted, by all sums of a program.
pub(super) struct Demand {
    uses: HashMap<ExprId, usize>,
}

/// A product of a sum, divided by one of its factors.
struct Quotient {
    factor: ExprId,
    rest: ExprId,
    repeats: bool,
    /// Multiplications that are saved when the product becomes this one.
    saving: f64,
}

impl Demand {
    /// Counts the products of all sums, and those that remain when a factor is moved out.
    pub(crate) fn new<'a>(
        pool: &mut ExprPool,
        sums: impl Iterator<Item = &'a Combination>,
    ) -> Self {
        let mut uses: HashMap<ExprId, usize> = HashMap::new();
        for &(_, expr) in sums.flat_map(|sum| &sum.items) {
            let rests = quotients(pool, expr)
                .into_iter()
                .map(|quotient| quotient.rest);
            for product in rests.chain([expr]) {
                *uses.entry(product).or_default() += 1;
            }
        }
        Self { uses }
    }

    /// Share of one multiplication that a sum pays for a product whose own parts are known.
    fn share(&self, pool: &ExprPool, expr: ExprId) -> f64 {
        if n_factors(pool, expr) < 2 {
            return 0.0;
        }
        let uses = self.uses.get(&expr).copied().unwrap_or(0);
        1.0 / uses.max(1) as f64
    }

    fn quotients(&self, pool: &mut ExprPool, expr: ExprId) -> Vec<Quotient> {
        let mut quotients = quotients(pool, expr);
        let shares = quotients
            .iter()
            .map(|quotient| self.share(pool, quotient.rest));
        let parts = shares.fold(f64::INFINITY, f64::min);
        for quotient in &mut quotients {
            let product = (1.0 + parts) * self.share(pool, expr);
            quotient.saving = product - self.share(pool, quotient.rest);
        }
        quotients
    }

    /// Moves factors out of a sum: first the one whose group saves most, as long as one saves more than it costs.
    pub(crate) fn nest(&self, pool: &mut ExprPool, sum: &Combination) -> Nested {
        let items = sum.items.iter();
        let mut items: Vec<((f64, ExprId), Vec<Quotient>)> = items
            .map(|&item| (item, self.quotients(pool, item.1)))
            .collect();
        let mut groups = Vec::new();
        loop {
            let mut savings: BTreeMap<ExprId, f64> = BTreeMap::new();
            for quotient in items.iter().flat_map(|(_, quotients)| quotients) {
                *savings.entry(quotient.factor).or_default() += quotient.saving.max(0.0);
            }
            let worth = savings.into_iter().filter(|&(_, saving)| saving > 1.0);
            let best = worth.max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
            let Some((factor, _)) = best else {
                break;
            };
            let (mut single, mut repeated) = (Combination::default(), Combination::default());
            items.retain(|((coefficient, _), quotients)| {
                let own = quotients
                    .iter()
                    .find(|q| q.factor == factor && q.saving > 0.0);
                if let Some(quotient) = own {
                    let part = if quotient.repeats {
                        &mut repeated
                    } else {
                        &mut single
                    };
                    part.items.push((*coefficient, quotient.rest));
                }
                own.is_none()
            });
            groups.push(Group {
                factor,
                single,
                repeated,
            });
        }
        Nested {
            flat: Combination {
                constant: sum.constant,
                items: items.into_iter().map(|(item, _)| item).collect(),
            },
            shared: None,
            groups,
        }
    }
}

/// Base and exponent of a factor that can be moved out, up to as many times as its exponent.
fn base_of(pool: &ExprPool, factor: ExprId) -> Option<(ExprId, i64)> {
    match pool.node(factor) {
        Node::Power(base, exponent) => {
            let exponent = pool.as_integer(*exponent)?;
            (exponent > 0).then_some((*base, exponent))
        }
        _ => Some((factor, 1)),
    }
}

fn n_factors(pool: &ExprPool, expr: ExprId) -> usize {
    let count = |&factor: &ExprId| match base_of(pool, factor) {
        Some((_, exponent)) => usize::try_from(exponent).unwrap_or(usize::MAX),
        None => 1,
    };
    let counts = pool.factors_of(expr).iter().map(count);
    counts.fold(0, usize::saturating_add)
}

/// The quotients of a product by each distinct factor; empty unless all exponents are positive integers.
fn quotients(pool: &mut ExprPool, expr: ExprId) -> Vec<Quotient> {
    let factors = pool.factors_of(expr).to_vec();
    let bases: Option<Vec<(ExprId, i64)>> = factors.iter().map(|&f| base_of(pool, f)).collect();
    let Some(bases) = bases.filter(|_| n_factors(pool, expr) > 1) else {
        return Vec::new();
    };
    let mut quotients = Vec::new();
    for (k, &(factor, exponent)) in bases.iter().enumerate() {
        let mut rest = factors.clone();
        let lower = pool.integer(exponent - 1);
        rest[k] = pool.pow(factor, lower);
        let rest = pool.product(&rest);
        // Coefficients stand in the sums only.
        if pool.terms_of(rest) == [(Number::ONE, rest)] {
            quotients.push(Quotient {
                factor,
                rest,
                repeats: exponent > 1,
                saving: 0.0,
            });
        }
    }
    quotients
}
