//! Laws of the computer algebra on random expressions.
//!
//! Values are compared within rounding: every value comes with a bound on its own error,
//! propagated to first order through the expression.

use crate::cost::Costs;
use crate::{ExprId, ExprPool, Function, Interval, Node, Number, SymbolId};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

const NAMES: [&str; 3] = ["x", "y", "z1"];

/// A recipe for an expression, independent of any pool.
#[derive(Clone, Debug)]
enum Tree {
    Integer(i64),
    Ratio(i64, i64),
    Float(f64),
    Symbol(usize),
    Sum(Vec<Tree>),
    Product(Vec<Tree>),
    Quotient(Box<Tree>, Box<Tree>),
    PowerOf(Box<Tree>, i32),
    Root(Box<Tree>, i64),
    Exponential(Box<Tree>, Box<Tree>),
    Call(Function, Box<Tree>),
}

impl Tree {
    fn build(&self, pool: &mut ExprPool) -> ExprId {
        match self {
            Tree::Integer(value) => pool.integer(*value),
            Tree::Ratio(numerator, denominator) => ratio(pool, *numerator, *denominator),
            Tree::Float(value) => pool.number(*value),
            Tree::Symbol(index) => pool.symbol(NAMES[*index]),
            Tree::Sum(operands) => {
                let operands: Vec<ExprId> = operands.iter().map(|tree| tree.build(pool)).collect();
                pool.sum(&operands)
            }
            Tree::Product(operands) => {
                let operands: Vec<ExprId> = operands.iter().map(|tree| tree.build(pool)).collect();
                pool.product(&operands)
            }
            Tree::Quotient(a, b) => {
                let (a, b) = (a.build(pool), b.build(pool));
                pool.div(a, b)
            }
            Tree::PowerOf(base, exponent) => {
                let base = base.build(pool);
                pool.powi(base, *exponent)
            }
            Tree::Root(base, thirds) => {
                let base = base.build(pool);
                let exponent = ratio(pool, *thirds, 3);
                pool.pow(base, exponent)
            }
            Tree::Exponential(base, exponent) => {
                let (base, exponent) = (base.build(pool), exponent.build(pool));
                pool.pow(base, exponent)
            }
            Tree::Call(function, argument) => {
                let argument = argument.build(pool);
                pool.apply(*function, argument)
            }
        }
    }
}

fn ratio(pool: &mut ExprPool, numerator: i64, denominator: i64) -> ExprId {
    pool.constant(Number::rational(numerator, denominator).expect("denominators are not zero"))
}

fn leaf() -> impl Strategy<Value = Tree> {
    prop_oneof![
        4 => (0..NAMES.len()).prop_map(Tree::Symbol),
        2 => (-4..5_i64).prop_map(Tree::Integer),
        1 => (-5..6_i64, 2..5_i64).prop_map(|(n, d)| Tree::Ratio(n, d)),
        1 => (-300..300_i32).prop_map(|n| Tree::Float(f64::from(n) / 100.0)),
    ]
}

/// Expressions with all operations and functions.
fn tree() -> impl Strategy<Value = Tree> {
    leaf().prop_recursive(4, 24, 4, |inner| {
        let boxed = || inner.clone().prop_map(Box::new);
        prop_oneof![
            4 => prop::collection::vec(inner.clone(), 2..4).prop_map(Tree::Sum),
            4 => prop::collection::vec(inner.clone(), 2..4).prop_map(Tree::Product),
            1 => (boxed(), boxed()).prop_map(|(a, b)| Tree::Quotient(a, b)),
            2 => (boxed(), -3..5_i32).prop_map(|(base, n)| Tree::PowerOf(base, n)),
            1 => (boxed(), -4..5_i64).prop_map(|(base, n)| Tree::Root(base, n)),
            1 => (boxed(), boxed()).prop_map(|(base, n)| Tree::Exponential(base, n)),
            4 => (prop::sample::select(&Function::ALL[..]), boxed())
                .prop_map(|(function, argument)| Tree::Call(function, argument)),
        ]
    })
}

fn point() -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3(prop_oneof![0.2..2.5_f64, -2.5..-0.2_f64])
}

/// A value and a bound on its error.
#[derive(Clone, Copy, Debug)]
struct Approximate {
    value: f64,
    error: f64,
    /// Surely without a value: rounding cannot be the cause.
    undefined: bool,
}

impl Approximate {
    fn exact(value: f64) -> Approximate {
        Approximate {
            value,
            error: 0.0,
            undefined: false,
        }
    }

    /// Marks the result of an operation on an operand without a value.
    fn undefined_if(self, undefined: bool) -> Approximate {
        Approximate { undefined, ..self }
    }

    /// Whether the argument is below zero for every error within its bound.
    fn is_surely_negative(self) -> bool {
        self.value.is_finite() && self.value < -2.0 * self.error
    }

    fn new(value: f64, error: f64) -> Approximate {
        let error = if value.is_finite() {
            error + value.abs() * f64::EPSILON
        } else {
            f64::INFINITY
        };
        Approximate {
            value,
            error,
            undefined: false,
        }
    }

    fn is_reliable(self) -> bool {
        self.value.is_finite() && self.error < 1e-4 * (1.0 + self.value.abs())
    }

    fn agrees_with(self, other: Approximate) -> bool {
        let tolerance = 8.0 * (self.error + other.error) + f64::MIN_POSITIVE;
        if other.undefined {
            return false;
        }
        !other.error.is_finite() || (self.value - other.value).abs() <= tolerance
    }

    fn times(self, other: Approximate) -> Approximate {
        let error = self.value.abs() * other.error
            + other.value.abs() * self.error
            + self.error * other.error;
        Approximate::new(self.value * other.value, error)
            .undefined_if(self.undefined || other.undefined)
    }

    fn reciprocal(self) -> Approximate {
        let room = self.value.abs() - self.error;
        let error = if room > 0.0 {
            self.error / (self.value.abs() * room)
        } else {
            f64::INFINITY
        };
        Approximate::new(1.0 / self.value, error).undefined_if(self.undefined)
    }

    fn apply(self, function: Function) -> Approximate {
        let (x, error) = (self.value, self.error);
        let value = function.evaluate(x);
        let error = match function {
            Function::Sin | Function::Cos | Function::Tanh | Function::Abs => error,
            Function::Tan => {
                let grown = (1.0 + value * value) * error;
                if grown * (1.0 + value.abs()) < 0.1 {
                    2.0 * grown
                } else {
                    f64::INFINITY
                }
            }
            Function::Exp => value * error.exp_m1(),
            Function::Log | Function::Sqrt if x <= 2.0 * error && !(x == 0.0 && error == 0.0) => {
                f64::INFINITY
            }
            Function::Log => 2.0 * error / x,
            Function::Sqrt => {
                if x == 0.0 {
                    0.0
                } else {
                    error / value
                }
            }
            Function::Sign if x.abs() <= error && error > 0.0 => f64::INFINITY,
            Function::Sign => 0.0,
        };
        let outside =
            matches!(function, Function::Log | Function::Sqrt) && self.is_surely_negative();
        Approximate::new(value, error + f64::EPSILON * value.abs())
            .undefined_if(self.undefined || outside)
    }

    fn power(self, exponent: Approximate) -> Approximate {
        let value = self.value.powf(exponent.value);
        let undefined = self.undefined
            || exponent.undefined
            || (value.is_nan() && self.is_surely_negative() && exponent.value.is_finite());
        if self.value <= 2.0 * self.error {
            let exact = self.error == 0.0 && exponent.error == 0.0;
            let error = if exact { 0.0 } else { f64::INFINITY };
            return Approximate::new(value, error).undefined_if(undefined);
        }
        let log_error =
            exponent.value.abs() * self.error / self.value + self.value.ln().abs() * exponent.error;
        Approximate::new(
            value,
            value * 2.0 * (2.0 * log_error).exp_m1() + 4.0 * f64::EPSILON * value,
        )
        .undefined_if(undefined)
    }
}

/// The value of `expr` with a bound on its error.
fn approximate(pool: &ExprPool, expr: ExprId, point: &[f64; 3]) -> Approximate {
    let at = |symbol: SymbolId| {
        let name = pool.symbol_name(symbol);
        let place = NAMES
            .iter()
            .position(|known| *known == name)
            .expect("a known symbol");
        point[place]
    };
    pool.fold_up::<Approximate>(&[expr], |pool, node, child| match pool.node(node) {
        Node::Number(number) => Approximate::new(number.to_f64(), 0.0),
        Node::Symbol(symbol) => Approximate::exact(at(*symbol)),
        Node::Sum(terms) => {
            let parts: Vec<Approximate> = terms.iter().map(|term| child(*term)).collect();
            let value = parts.iter().map(|part| part.value).sum();
            let magnitude: f64 = parts.iter().map(|part| part.value.abs()).sum();
            let error: f64 = parts.iter().map(|part| part.error).sum();
            Approximate::new(value, error + magnitude * f64::EPSILON * parts.len() as f64)
                .undefined_if(parts.iter().any(|part| part.undefined))
        }
        Node::Product(factors) => factors
            .iter()
            .map(|factor| child(*factor))
            .reduce(Approximate::times)
            .expect("products have factors"),
        Node::Power(base, exponent) => {
            let base = child(*base);
            match pool
                .as_number(*exponent)
                .and_then(|number| number.as_integer())
            {
                Some(integer) => {
                    let power = (0..integer.unsigned_abs().min(100_000))
                        .fold(Approximate::exact(1.0), |power, _| power.times(base));
                    if integer < 0 {
                        power.reciprocal()
                    } else {
                        power
                    }
                }
                None => base.power(child(*exponent)),
            }
        }
        Node::Apply(function, argument) => child(*argument).apply(*function),
    })[0]
}

/// Asserts that two expressions have the same value wherever the first value is reliable.
fn same_value(
    pool: &ExprPool,
    before: ExprId,
    after: ExprId,
    point: &[f64; 3],
) -> Result<(), TestCaseError> {
    let (old, new) = (
        approximate(pool, before, point),
        approximate(pool, after, point),
    );
    prop_assert!(
        !old.is_reliable() || old.agrees_with(new),
        "{} = {old:?} became {} = {new:?} at {point:?}",
        pool.display(before),
        pool.display(after),
    );
    Ok(())
}

fn config(cases: u32) -> ProptestConfig {
    let factor = std::env::var("ROMC_PROPERTY_FACTOR")
        .ok()
        .and_then(|text| text.parse().ok());
    ProptestConfig {
        cases: cases * factor.unwrap_or(1),
        rng_seed: RngSeed::Fixed(20_240_517),
        failure_persistence: None,
        max_global_rejects: 1_000_000,
        ..ProptestConfig::default()
    }
}

proptest! {
    #![proptest_config(config(400))]

    #[test]
    fn constructors_preserve_value_of_the_recipe(tree in tree(), point in point()) {
        let mut pool = ExprPool::new();
        let expr = tree.build(&mut pool);
        let direct = direct_value(&tree, &point);
        let canonical = approximate(&pool, expr, &point);
        prop_assert!(
            !direct.is_reliable() || direct.agrees_with(canonical),
            "{tree:?} = {direct:?} was built as {} = {canonical:?}", pool.display(expr)
        );
    }

    #[test]
    fn constructors_return_canonical_expressions_unchanged(tree in tree()) {
        let mut pool = ExprPool::new();
        let expr = tree.build(&mut pool);
        let identity: Vec<(SymbolId, ExprId)> = NAMES
            .map(|name| (pool.symbol_id(name), pool.symbol(name)))
            .to_vec();
        let rebuilt = pool.substitute(expr, &identity);
        prop_assert_eq!(rebuilt, expr, "{} was rebuilt as {}", pool.display(expr), pool.display(rebuilt));
    }

    #[test]
    fn display_parses_back_to_the_same_expression(tree in tree()) {
        let mut pool = ExprPool::new();
        let expr = tree.build(&mut pool);
        let text = pool.display(expr).to_string();
        prop_assert_eq!(pool.parse(&text, &|_| true), Ok(expr), "{}", text);
    }

    #[test]
    fn shuffled_operands_print_identically(
        (trees, shuffled) in prop::collection::vec(tree(), 2..7)
            .prop_flat_map(|trees| (Just(trees.clone()), Just(trees).prop_shuffle())),
    ) {
        // Different pools: their order of creation also differs.
        let text = |trees: &[Tree], make: fn(&mut ExprPool, &[ExprId]) -> ExprId| {
            let mut pool = ExprPool::new();
            let operands: Vec<ExprId> = trees.iter().map(|tree| tree.build(&mut pool)).collect();
            let expr = make(&mut pool, &operands);
            pool.display(expr).to_string()
        };
        prop_assert_eq!(text(&trees, ExprPool::sum), text(&shuffled, ExprPool::sum));
        prop_assert_eq!(text(&trees, ExprPool::product), text(&shuffled, ExprPool::product));
    }

    #[test]
    fn simplification_preserves_value_and_never_costs_more(tree in tree(), point in point()) {
        let mut pool = ExprPool::new();
        let expr = tree.build(&mut pool);
        let simple = pool.simplify(expr);
        let cost = |expr| Costs::default().of(&pool, expr);
        prop_assert!(cost(simple) <= cost(expr));
        same_value(&pool, expr, simple, &point)?;
    }

    #[test]
    fn simplifying_twice_is_simplifying_once(tree in tree()) {
        let mut pool = ExprPool::new();
        let expr = tree.build(&mut pool);
        let once = pool.simplify(expr);
        prop_assert_eq!(pool.simplify(once), once, "{}", pool.display(once));
    }

    #[test]
    fn simplification_does_not_depend_on_creation_order(tree in tree(), other in tree()) {
        let mut pool = ExprPool::new();
        let expr = tree.build(&mut pool);
        let simple = pool.simplify(expr);
        let mut second = ExprPool::new();
        other.build(&mut second);
        second.symbol("z1");
        let expr = tree.build(&mut second);
        let again = second.simplify(expr);
        prop_assert_eq!(pool.display(simple).to_string(), second.display(again).to_string());
    }

    #[test]
    fn rewritings_preserve_value(tree in tree(), point in point()) {
        let mut pool = ExprPool::new();
        let expr = tree.build(&mut pool);
        for rewrite in [
            ExprPool::expand_angles,
            ExprPool::combine_angles,
            ExprPool::sines_to_cosines,
            ExprPool::cosines_to_sines,
        ] {
            let result = rewrite(&mut pool, expr);
            same_value(&pool, expr, result, &point)?;
        }
    }

    #[test]
    fn derivative_agrees_with_finite_differences(tree in tree(), point in point()) {
        let mut pool = ExprPool::new();
        let expr = tree.build(&mut pool);
        let x = pool.symbol_id("x");
        let derivative = pool.derivative(expr, x);
        let exact = approximate(&pool, derivative, &point);
        // Central differences with three steps: used where they agree, that is where the
        // expression is smooth and well conditioned.
        let slope = |step: f64| {
            let at = |x: f64| approximate(&pool, expr, &[x, point[1], point[2]]);
            let (plus, minus) = (at(point[0] + step), at(point[0] - step));
            Approximate::new((plus.value - minus.value) / (2.0 * step), (plus.error + minus.error) / (2.0 * step))
        };
        let slopes = [slope(2e-4), slope(1e-4), slope(0.7e-4)];
        let spread = (slopes[0].value - slopes[1].value).abs().max((slopes[2].value - slopes[1].value).abs());
        let scale = 1.0 + slopes[1].value.abs();
        let usable = slopes.iter().all(|slope| slope.error < 1e-5 * scale) && spread < 1e-5 * scale;
        prop_assume!(usable && exact.is_reliable());
        prop_assert!(
            (exact.value - slopes[1].value).abs() < 1e-4 * scale,
            "d {} = {} is {exact:?}, differences give {slopes:?} at {point:?}",
            pool.display(expr), pool.display(derivative)
        );
    }

    #[test]
    fn interval_contains_sampled_values(
        tree in tree(),
        lows in point(),
        widths in prop::array::uniform3(0.0..1.5_f64),
        shares in prop::collection::vec(prop::array::uniform3(0.0..1.0_f64), 16),
    ) {
        let mut pool = ExprPool::new();
        let expr = tree.build(&mut pool);
        let ids = NAMES.map(|name| pool.symbol_id(name));
        let place = |symbol: SymbolId| ids.iter().position(|id| *id == symbol).expect("known");
        let range = |place: usize| Interval::new(lows[place], lows[place] + widths[place]);
        let natural = pool.evaluate_intervals(&[expr], &|symbol| range(place(symbol)))[0];
        let domain: Vec<(SymbolId, Interval)> = pool
            .symbols_of(expr)
            .into_iter()
            .map(|symbol| (symbol, range(place(symbol))))
            .collect();
        let slopes: Vec<ExprId> = domain.iter().map(|(symbol, _)| pool.derivative(expr, *symbol)).collect();
        let bounds = pool.bound_by_slopes(expr, &slopes, &domain);
        prop_assert!(natural.lo() <= bounds.lo() && bounds.hi() <= natural.hi());
        for share in shares {
            let point: [f64; 3] = std::array::from_fn(|i| (lows[i] + widths[i] * share[i]).min(lows[i] + widths[i]));
            let sample = approximate(&pool, expr, &point);
            if sample.is_reliable() {
                let slack = Interval::new(bounds.lo() - 4.0 * sample.error, bounds.hi() + 4.0 * sample.error);
                prop_assert!(slack.contains(sample.value), "{} = {sample:?} outside {bounds} at {point:?}", pool.display(expr));
            }
        }
    }

    #[test]
    fn parser_of_arbitrary_text_gives_a_term_or_an_error(text in "[-+*/^() .0-9a-z]{0,40}|\\PC{0,30}") {
        let mut pool = ExprPool::new();
        if let Ok(expr) = pool.parse(&text, &|_| true) {
            let printed = pool.display(expr).to_string();
            prop_assert_eq!(pool.parse(&printed, &|_| true), Ok(expr), "{}", printed);
        }
    }
}

/// The value of a recipe, without canonical forms in between.
fn direct_value(tree: &Tree, point: &[f64; 3]) -> Approximate {
    let value = |tree: &Tree| direct_value(tree, point);
    let exact = Approximate::exact;
    match tree {
        Tree::Integer(value) => exact(*value as f64),
        Tree::Ratio(numerator, denominator) => {
            Approximate::new(*numerator as f64 / *denominator as f64, 0.0)
        }
        Tree::Float(value) => exact(*value),
        Tree::Symbol(index) => exact(point[*index]),
        Tree::Sum(operands) => operands.iter().map(value).fold(exact(0.0), |a, b| {
            Approximate::new(a.value + b.value, a.error + b.error)
        }),
        Tree::Product(operands) => operands
            .iter()
            .map(value)
            .fold(exact(1.0), Approximate::times),
        Tree::Quotient(a, b) => value(a).times(value(b).reciprocal()),
        Tree::PowerOf(base, exponent) => {
            let base = value(base);
            let power = (0..exponent.unsigned_abs()).fold(exact(1.0), |power, _| power.times(base));
            if *exponent < 0 {
                power.reciprocal()
            } else {
                power
            }
        }
        // Integer powers are defined for every base, others only for non-negative bases.
        Tree::Root(base, thirds) if thirds % 3 == 0 => {
            let power = Tree::PowerOf(base.clone(), i32::try_from(thirds / 3).expect("small"));
            value(&power)
        }
        Tree::Root(base, thirds) => value(base).power(Approximate::new(*thirds as f64 / 3.0, 0.0)),
        Tree::Exponential(base, exponent) => {
            let (base, exponent) = (value(base), value(exponent));
            // If an exponent is an integer only by rounding, the domain is undecided: no test.
            if base.value <= 0.0 {
                return Approximate::new(f64::NAN, f64::INFINITY);
            }
            base.power(exponent)
        }
        Tree::Call(function, argument) => value(argument).apply(*function),
    }
}
