//! Whether a shorter form may replace a sum: it must have the same values, also far out. There the sum is enclosed over
//! inputs that reach a few units in the last place around a point. Where the enclosure is narrow and code of the sum,
//! in 64 or 32 bits, would evaluate to a value inside it, code of the form must do so as well. Its derivatives must be
//! finite where those of the sum are accurate. Sums and products of variables and bounded functions need no test: equal
//! ones have the same degrees.

use std::rc::Rc;

use super::*;
use crate::interval::power_by;

/// Ranges of the variables for the points near the origin.
const NEAR: [(f64, f64); 6] = [
    (0.11, 1.03),
    (1.27, 2.9),
    (-1.03, 1.4),
    (-2.71, -0.2),
    (-0.3, 0.1),
    (2.13, 5.9),
];
const EVALUATION: f64 = 1e-11;
const GOLDEN: f64 = 0.618_033_988_749_894_9;

type Column = Rc<[f64]>;

struct Points {
    count: usize,
    columns: BTreeMap<SymbolId, Column>,
}

struct Precision {
    round: fn(f64) -> f64,
    /// Relative distance of the inputs that are enclosed around a point.
    inputs: f64,
    /// Relative error that evaluation far out may have, in addition to one relative to the summands.
    evaluation: f64,
    rounding: f64,
    /// Least number with all its digits.
    least: f64,
    /// Powers of ten of variables: one where squares nearly overflow, the others far from where any power of one does.
    powers: [f64; 7],
    /// Magnitudes at which `exp` of 1 to 4 times a variable overflows; at the last, `exp(-x)` does not underflow yet.
    exponents: [f64; 5],
}

const PRECISIONS: [Precision; 2] = [
    Precision {
        round: |value| value,
        inputs: 1e-13,
        evaluation: 1e-9,
        rounding: 1e-13,
        least: f64::MIN_POSITIVE,
        powers: [300.0, 200.0, 125.0, 90.0, 68.0, 50.0, 154.08],
        exponents: [1000.0, 400.0, 260.0, 200.0, 712.0],
    },
    Precision {
        round: |value| f64::from(value as f32),
        inputs: 1e-6,
        evaluation: 1e-3,
        rounding: 1e-5,
        least: f32::MIN_POSITIVE as f64,
        powers: [36.0, 27.0, 16.0, 11.0, 8.0, 5.0, 19.22],
        exponents: [200.0, 60.0, 35.0, 25.0, 89.0],
    },
];

pub(super) struct Agreement {
    sum: Summands,
    symbols: Vec<SymbolId>,
    far: Option<[Far; 2]>,
}

struct Far {
    points: Points,
    /// Where its values lie, and how large its summands are; nothing where it is not accurate itself.
    expected: Vec<Option<(Interval, f64)>>,
}

impl Agreement {
    pub(super) fn with(pool: &ExprPool, sum: &Summands) -> Self {
        let symbols: BTreeSet<SymbolId> = (sum.iter())
            .flat_map(|&(_, expr)| pool.symbols_of(expr))
            .collect();
        Self {
            sum: sum.clone(),
            symbols: symbols.into_iter().collect(),
            far: None,
        }
    }

    /// Whether `form` has the sum's values, up to rounding, at all points where the sum has one.
    pub(super) fn holds(&mut self, pool: &mut ExprPool, form: &Summands) -> bool {
        if !self.holds_near(pool, form) {
            return false;
        }
        if is_tame(pool, &self.sum) && is_tame(pool, form) {
            return true;
        }
        let (sum, symbols) = (&self.sum, &self.symbols);
        let far = (self.far)
            .get_or_insert_with(|| [0, 1].map(|p| Far::of(pool, sum, symbols, &PRECISIONS[p])));
        let mut far = far.iter().zip(&PRECISIONS);
        far.all(|(far, precision)| far.holds(pool, form, precision)) && self.slopes_hold(pool, form)
    }

    /// Whether derivatives of `form` are numbers where generated code of those of the sum is accurate.
    fn slopes_hold(&self, pool: &mut ExprPool, form: &Summands) -> bool {
        self.symbols.iter().all(|&symbol| {
            let [of_sum, of_form] = [&self.sum, form].map(|summands| -> Summands {
                let slopes = (summands.iter()).map(|&(c, expr)| (c, pool.derivative(expr, symbol)));
                slopes.filter(|slope| slope.1 != ExprId::ZERO).collect()
            });
            is_tame(pool, &of_form)
                || PRECISIONS.iter().all(|precision| {
                    let far = Far::of(pool, &of_sum, &self.symbols, precision);
                    let (values, _) = sum_by_code(pool, &of_form, &far.points, precision.round);
                    let mut known = far.expected.iter().zip(&values);
                    known.all(|(expected, value)| expected.is_none() || value.is_finite())
                })
        })
    }

    fn holds_near(&self, pool: &ExprPool, form: &Summands) -> bool {
        let column = |&symbol: &SymbolId| {
            let place = (symbol.index() as f64 + 1.0) * GOLDEN;
            let values: Column = (NEAR.iter())
                .map(|(low, high)| low + (high - low) * (place + low.abs()).fract())
                .collect();
            (symbol, values)
        };
        let points = Points {
            count: NEAR.len(),
            columns: self.symbols.iter().map(column).collect(),
        };
        let [(sums, sizes), (forms, other_sizes)] =
            [&self.sum, form].map(|summands| sum_by_code(pool, summands, &points, |value| value));
        let mut values = sums.iter().zip(&forms).zip(sizes.iter().zip(&other_sizes));
        values.all(|((a, b), (size, other))| {
            let slack = EVALUATION * (size + other) + f64::MIN_POSITIVE;
            !a.is_finite() || (a - b).abs() <= slack
        })
    }
}

impl Far {
    fn of(pool: &ExprPool, sum: &Summands, symbols: &[SymbolId], precision: &Precision) -> Self {
        let points = points(symbols, &scales(pool, sum, precision), precision);
        let (values, sizes) = sum_by_code(pool, sum, &points, precision.round);
        let bounds = sum_in_bounds(pool, sum, &points, precision.inputs);
        let expected = bounds.into_iter().zip(values.iter().zip(&sizes));
        let expected = expected.map(|(bounds, (value, size))| {
            let numbers = [bounds.magnitude(), *value, *size];
            let is_bounded = !bounds.is_empty() && numbers.iter().all(|number| number.is_finite());
            let is_accurate = is_bounded && precision.hits(bounds, *value, *size);
            is_accurate.then_some((bounds, *size))
        });
        Self {
            expected: expected.collect(),
            points,
        }
    }

    fn holds(&self, pool: &ExprPool, form: &Summands, precision: &Precision) -> bool {
        let (values, _) = sum_by_code(pool, form, &self.points, precision.round);
        (self.expected.iter().zip(&values[..])).all(|(expected, value)| {
            expected.is_none_or(|(bounds, size)| precision.hits(bounds, *value, size))
        })
    }
}

impl Precision {
    /// Whether a value is where it should be, up to rounding of summands of some size.
    fn hits(&self, bounds: Interval, value: f64, size: f64) -> bool {
        let slack = self.evaluation * bounds.magnitude() + self.rounding * size + self.least;
        bounds.lo() - slack <= value && value <= bounds.hi() + slack
    }
}

/// Whether all terms are products of variables, bounded functions of such terms, and magnitudes.
fn is_tame(pool: &ExprPool, summands: &Summands) -> bool {
    let roots: Vec<ExprId> = summands.iter().map(|&(_, expr)| expr).collect();
    (pool.reachable(&roots).into_iter()).all(|expr| match *pool.node(expr) {
        Node::Number(_) | Node::Symbol(_) | Node::Sum(_) | Node::Product(_) => true,
        Node::Power(_, exponent) => pool.as_integer(exponent).is_some_and(|power| power > 0),
        Node::Apply(function, _) => matches!(
            function,
            Function::Sin | Function::Cos | Function::Tanh | Function::Abs
        ),
    })
}

fn scales(pool: &ExprPool, sum: &Summands, precision: &Precision) -> Vec<f64> {
    let roots: Vec<ExprId> = sum.iter().map(|&(_, expr)| expr).collect();
    let has_exponents = (pool.reachable(&roots).into_iter()).any(|expr| {
        matches!(
            pool.node(expr),
            Node::Apply(Function::Exp | Function::Log | Function::Tanh, _)
        )
    });
    let powers = precision.powers.into_iter();
    let powers = powers.flat_map(|power| [power, -power].map(|power| 10_f64.powf(power)));
    let exponents = precision.exponents.into_iter();
    std::iter::once(1.0)
        .chain(exponents.filter(|_| has_exponents))
        .chain(powers)
        .collect()
}

/// Points with all pairs of scales for each pair of the first four variables; others are about 1 at half of them.
fn points(symbols: &[SymbolId], scales: &[f64], precision: &Precision) -> Points {
    let n_scales = scales.len();
    let first = symbols.len().min(4);
    let pairs: Vec<[usize; 2]> = match first {
        0 | 1 => vec![[0, 0]],
        _ => (0..first)
            .flat_map(|b| (0..b).map(move |a| [a, b]))
            .collect(),
    };
    let n_grid = 2 * n_scales.pow(first.min(2) as u32);
    let value = |place: usize, point: usize| {
        // Multiples of irrational numbers fall evenly.
        let share = ((point + 1) as f64 * (place as f64 + 2.3).sqrt()).fract();
        let ([a, b], at) = (pairs[point / n_grid], point % n_grid);
        let scale = match place {
            _ if place == a => at / 2 % n_scales,
            _ if place == b => at / 2 / n_scales,
            _ => ((2.0 * share - 1.0).max(0.0) * n_scales as f64) as usize,
        };
        let is_negative = match place == a {
            true => at % 2 == 1,
            false => (share * 64.0) as usize % 2 == 1,
        };
        let size = scales[scale] * (1.0 + 0.1 * (share * 8.0).fract());
        (precision.round)(if is_negative { -size } else { size })
    };
    let count = n_grid * pairs.len();
    let columns = symbols.iter().enumerate().map(|(place, &symbol)| {
        let values: Column = (0..count).map(|point| value(place, point)).collect();
        (symbol, values)
    });
    let columns = columns.collect();
    Points { count, columns }
}

/// The values of a sum by generated code, and the sums of the sizes of its summands.
fn sum_by_code(
    pool: &ExprPool,
    sum: &Summands,
    points: &Points,
    round: fn(f64) -> f64,
) -> (Vec<f64>, Vec<f64>) {
    let exprs: Vec<ExprId> = sum.iter().map(|&(_, expr)| expr).collect();
    let columns = pool.fold_up(&exprs, |pool, expr, child| {
        by_code(pool, expr, points, round, child)
    });
    let (mut values, mut sizes) = (vec![0.0; points.count], vec![0.0; points.count]);
    for (column, &(coefficient, _)) in columns.iter().zip(sum) {
        for (point, value) in column.iter().enumerate() {
            let summand = round(round(coefficient) * value);
            values[point] = round(values[point] + summand);
            sizes[point] += summand.abs();
        }
    }
    (values, sizes)
}

/// In the order of generated code: negative powers in one divisor, powers as chains or exponentials of logarithms.
fn by_code(
    pool: &ExprPool,
    expr: ExprId,
    points: &Points,
    round: fn(f64) -> f64,
    child: &dyn Fn(ExprId) -> Column,
) -> Column {
    let each = |value: &dyn Fn(usize) -> f64| -> Column { (0..points.count).map(value).collect() };
    let chain =
        |base: f64, exponent: i64| power_by(base, exponent.unsigned_abs(), |a, b| round(a * b));
    match *pool.node(expr) {
        Node::Number(number) => each(&|_| round(number.to_f64())),
        Node::Symbol(symbol) => points.columns[&symbol].clone(),
        Node::Sum(ref terms) => {
            let terms: Vec<Column> = terms.iter().map(|term| child(*term)).collect();
            each(&|at| (terms[1..].iter()).fold(terms[0][at], |sum, term| round(sum + term[at])))
        }
        Node::Product(ref factors) => {
            // Bases and exponents of the divisor's factors; the others as they are.
            let factors = factors.iter().map(|&factor| match *pool.node(factor) {
                Node::Power(base, exponent) => match pool.as_integer(exponent) {
                    Some(exponent @ ..0) => (child(base), Some(exponent)),
                    _ => (child(factor), None),
                },
                _ => (child(factor), None),
            });
            let factors: Vec<(Column, Option<i64>)> = factors.collect();
            each(&|at| {
                let (mut over, mut under) = (1.0, None);
                for (column, exponent) in &factors {
                    let Some(exponent) = exponent else {
                        over = round(over * column[at]);
                        continue;
                    };
                    let power = chain(column[at], *exponent);
                    under = Some(under.map_or(power, |under| round(under * power)));
                }
                under.map_or(over, |under| round(over / under))
            })
        }
        Node::Power(base, exponent) => match (child(base), pool.as_integer(exponent)) {
            (base, Some(integer @ ..0)) => each(&|at| round(1.0 / chain(base[at], integer))),
            (base, Some(integer)) => each(&|at| chain(base[at], integer)),
            (base, None) => {
                let exponent = child(exponent);
                each(&|at| round(round(exponent[at] * round(base[at].ln())).exp()))
            }
        },
        Node::Apply(function, argument) => {
            let argument = child(argument);
            each(&|at| round(function.evaluate(argument[at])))
        }
    }
}

/// Bounds of a sum over inputs within a relative distance of the points.
fn sum_in_bounds(pool: &ExprPool, sum: &Summands, points: &Points, distance: f64) -> Vec<Interval> {
    let exprs: Vec<ExprId> = sum.iter().map(|&(_, expr)| expr).collect();
    let columns = pool.fold_up(&exprs, |pool, expr, child| -> Rc<[Interval]> {
        let operands: Vec<(ExprId, Rc<[Interval]>)> = (pool.children(expr))
            .map(|operand| (operand, child(operand)))
            .collect();
        let at = |point: usize| {
            let range_of = |symbol: SymbolId| {
                let value = points.columns[&symbol][point];
                let reach = distance * value.abs();
                Interval::new(value - reach, value + reach)
            };
            let operand = |of: ExprId| {
                let known = operands.iter().find(|(operand, _)| *operand == of);
                known.map_or(Interval::ENTIRE, |(_, column)| column[point])
            };
            pool.bounds_of_node(expr, &range_of, &operand)
        };
        (0..points.count).map(at).collect()
    });
    let at = |point: usize| {
        let summands = columns.iter().zip(sum);
        let summands = summands.map(|(column, &(c, _))| Interval::point(c) * column[point]);
        summands.fold(Interval::point(0.0), |a, b| a + b)
    };
    (0..points.count).map(at).collect()
}
