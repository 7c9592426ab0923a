//! From expressions to normal forms.

use std::collections::{HashMap, HashSet};

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{ToPrimitive, Zero};

use super::atoms::{Atom, prime_powers};
use super::coefficient::{Coefficient, Literal};
use super::polynomial::{CanonicalForm, Monomial};
use crate::symbolic::node::{ExprId, Function, Node, SymbolId};
use crate::symbolic::pool::ExprPool;

/// Largest power of a sum that is multiplied out, of a single term, and index of a root.
const MAX_SUM_POWER: u32 = 40;
const MAX_TERM_POWER: u32 = 2_000;
const MAX_ROOT: i64 = 1_000;
/// Most terms that are looked at while one product is put in order.
const MAX_STEPS: usize = 200_000;
/// Most atoms that are removed by multiplying out.
const MAX_REMOVALS: usize = 40;

/// Normal forms of the expressions of a pool; see the [module](self).
pub struct CanonicalForms<'p> {
    pool: &'p ExprPool,
    literal: &'p dyn Fn(SymbolId) -> Option<Literal>,
    atoms: Vec<Atom>,
    numbers: HashMap<Atom, u32>,
    forms: HashMap<ExprId, CanonicalForm>,
    /// Arguments so far, with their radii.
    arguments: Vec<CanonicalForm>,
    known: HashSet<CanonicalForm>,
    /// Atoms that are positive wherever all given expressions are defined.
    positive: HashSet<u32>,
    rounding: f64,
}

impl<'p> CanonicalForms<'p> {
    /// Forms of `exprs` and their parts. Where they are compared they all have values: what stands
    /// under a logarithm or root of one of them is taken as positive in the others too.
    ///
    /// `literal` gives the symbols that stand for decimals.
    pub fn new(pool: &'p ExprPool, exprs: &[ExprId], literal: &'p dyn Fn(SymbolId) -> Option<Literal>) -> Self {
        let mut forms = Self {
            pool,
            literal,
            atoms: Vec::new(),
            numbers: HashMap::new(),
            forms: HashMap::new(),
            arguments: Vec::new(),
            known: HashSet::new(),
            positive: HashSet::new(),
            rounding: 0.0,
        };
        let mut guarded = Vec::new();
        for expr in pool.reachable(exprs) {
            match pool.node(expr) {
                Node::Apply(Function::Log | Function::Sqrt, argument) => guarded.push(*argument),
                Node::Power(base, exponent) if !forms.is_integer(*exponent) => guarded.push(*base),
                _ => {}
            }
        }
        for expr in guarded {
            let form = forms.of(expr);
            if let Some((coefficient, monomial)) = form.as_term()
                && !coefficient.is_negative()
                && let [(atom, power)] = monomial.powers[..]
                && power % 2 != 0
            {
                forms.positive.insert(atom);
            }
        }
        if !forms.positive.is_empty() {
            forms.forms.clear();
        }
        forms.rounding = 0.0;
        forms
    }

    /// Largest difference between arguments of functions that only rounding of decimals explains.
    pub fn rounding(&self) -> f64 {
        self.rounding
    }

    /// The normal form. Parts that grow too large while they are multiplied out stay as they are.
    pub fn of(&mut self, expr: ExprId) -> CanonicalForm {
        if let Some(form) = self.forms.get(&expr) {
            return form.clone();
        }
        for part in self.pool.reachable(&[expr]) {
            if !self.forms.contains_key(&part) {
                let form = self.node(part).filter(CanonicalForm::is_small);
                let form = form.unwrap_or_else(|| self.atom(Atom::Opaque(part)));
                self.forms.insert(part, form);
            }
        }
        self.forms[&expr].clone()
    }

    /// The form with all reciprocals of sums, tangents and hyperbolic tangents removed: times a
    /// factor that is zero nowhere in the interior of the domain. `None` if it grows too large.
    pub fn without_fractions(&mut self, form: &CanonicalForm) -> Option<CanonicalForm> {
        let mut form = form.clone();
        for _ in 0..MAX_REMOVALS {
            let numbers = form.terms.keys().flat_map(|monomial| &monomial.powers).map(|(atom, _)| *atom);
            let removable = |atom: &u32| matches!(self.atoms[*atom as usize], Atom::Sum(_) | Atom::Tan(_) | Atom::Tanh(_));
            // An atom is made after those in its argument.
            let Some(atom) = numbers.filter(removable).max() else {
                return Some(form);
            };
            form = self.removed(&form, atom)?;
        }
        None
    }

    /// The form times the powers of numerator and denominator of an atom that clear it.
    fn removed(&mut self, form: &CanonicalForm, atom: u32) -> Option<CanonicalForm> {
        let one = || CanonicalForm::constant(Coefficient::integer(1));
        let (top, bottom) = match self.atoms[atom as usize].clone() {
            Atom::Sum(sum) => (sum, one()),
            Atom::Tan(argument) => {
                let [plus, minus] = exponentials(&argument, true);
                (plus.minus(&minus).scaled(&Coefficient::imaginary(-1, 1)), plus.plus(&minus))
            }
            Atom::Tanh(argument) => {
                let [plus, minus] = exponentials(&argument, false);
                (plus.minus(&minus), plus.plus(&minus))
            }
            _ => return None,
        };
        let powers = form.terms.keys().map(|monomial| monomial.power_of(atom));
        let (lowest, highest) = powers.fold((0, 0), |(low, high), power| (low.min(power), high.max(power)));
        let mut sum = CanonicalForm::default();
        for (monomial, coefficient) in &form.terms {
            let power = monomial.power_of(atom);
            let over = self.power(&top, power - lowest)?;
            let under = self.power(&bottom, highest - power)?;
            let rest = CanonicalForm::term(coefficient.clone(), monomial.without(atom));
            let factor = self.product(&over, &under)?;
            sum = sum.plus(&self.product(&rest, &factor)?);
        }
        sum.is_small().then_some(sum)
    }

    fn is_integer(&self, expr: ExprId) -> bool {
        match self.pool.node(expr) {
            Node::Number(number) => number.as_integer().is_some(),
            Node::Symbol(symbol) => (self.literal)(*symbol).is_some_and(|literal| literal.value.is_integer()),
            _ => false,
        }
    }

    fn atom(&mut self, atom: Atom) -> CanonicalForm {
        CanonicalForm::term(Coefficient::integer(1), Monomial::atom(self.number(atom), 1))
    }

    fn number(&mut self, atom: Atom) -> u32 {
        if let Some(number) = self.numbers.get(&atom) {
            return *number;
        }
        let number = u32::try_from(self.atoms.len()).expect("fewer atoms than expressions in a pool");
        self.atoms.push(atom.clone());
        self.numbers.insert(atom, number);
        number
    }

    // ---- from nodes -------------------------------------------------------------------------

    fn node(&mut self, expr: ExprId) -> Option<CanonicalForm> {
        let pool = self.pool;
        match pool.node(expr) {
            Node::Number(number) => Some(CanonicalForm::constant(Coefficient::from(*number))),
            Node::Symbol(symbol) => Some(match (self.literal)(*symbol) {
                Some(literal) => CanonicalForm::constant(Coefficient::from(literal)),
                None => self.atom(Atom::Symbol(*symbol)),
            }),
            Node::Sum(terms) => {
                let mut sum = CanonicalForm::default();
                for term in terms {
                    for (monomial, coefficient) in &self.forms[term].terms {
                        sum.add(coefficient.clone(), monomial.clone());
                    }
                }
                Some(sum)
            }
            Node::Product(factors) => {
                let mut product = self.forms[&factors[0]].clone();
                for factor in &factors[1..] {
                    let factor = self.forms[factor].clone();
                    product = self.product(&product, &factor)?;
                }
                Some(product)
            }
            Node::Power(base, exponent) => {
                let (base, exponent) = (self.forms[base].clone(), self.forms[exponent].clone());
                self.power_of_forms(&base, exponent)
            }
            Node::Apply(function, argument) => {
                let argument = self.forms[argument].clone();
                self.apply(*function, &argument)
            }
        }
    }

    fn power_of_forms(&mut self, base: &CanonicalForm, exponent: CanonicalForm) -> Option<CanonicalForm> {
        let exponent = self.argument(exponent);
        if let Some(constant) = exponent.as_constant()
            && let Some(value) = constant.as_real()
            && let (Some(top), Some(bottom)) = (value.numer().to_i32(), value.denom().to_i64())
            && bottom <= MAX_ROOT
        {
            return match bottom {
                1 => self.power(base, top),
                _ => {
                    let root = self.root(base, u32::try_from(bottom).ok()?)?;
                    self.power(&root, top)
                }
            };
        }
        let log = self.log(base)?;
        let argument = self.product(&exponent, &log)?;
        self.exp(argument)
    }

    fn apply(&mut self, function: Function, argument: &CanonicalForm) -> Option<CanonicalForm> {
        match function {
            Function::Sin | Function::Cos => {
                let argument = self.argument(argument.clone());
                let [plus, minus] = exponentials(&argument, true);
                let half = Coefficient::complex(BigRational::new(1.into(), 2.into()), BigRational::zero());
                Some(match function {
                    Function::Sin => plus.minus(&minus).scaled(&Coefficient::imaginary(-1, 2)),
                    _ => plus.plus(&minus).scaled(&half),
                })
            }
            Function::Tan => self.odd(argument, Atom::Tan),
            Function::Tanh => self.odd(argument, Atom::Tanh),
            Function::Exp => self.exp(argument.clone()),
            Function::Log => self.log(argument),
            Function::Sqrt => self.root(argument, 2),
            Function::Abs => self.abs(argument),
            Function::Sign => self.sign(argument),
        }
    }

    /// An odd function of an argument whose leading coefficient is positive.
    fn odd(&mut self, argument: &CanonicalForm, atom: fn(CanonicalForm) -> Atom) -> Option<CanonicalForm> {
        let argument = self.argument(argument.clone());
        let Some(leading) = argument.leading() else {
            return Some(CanonicalForm::default());
        };
        let sign = Coefficient::integer(if leading.is_negative() { -1 } else { 1 });
        let argument = argument.scaled(&sign);
        Some(self.atom(atom(argument)).scaled(&sign))
    }

    /// An argument of a function without its radii: one from before that agrees within them.
    fn argument(&mut self, form: CanonicalForm) -> CanonicalForm {
        let exact = form.exact();
        if self.known.contains(&exact) {
            return exact;
        }
        let known = self.arguments.iter().find(|known| {
            (form.has_radius() || known.has_radius()) && form.minus(known).may_be_zero()
        });
        if let Some(known) = known {
            let differences = form.minus(known);
            let largest = differences.coefficients().map(Coefficient::magnitude).fold(0.0, f64::max);
            self.rounding = self.rounding.max(largest);
            return known.exact();
        }
        self.known.insert(exact.clone());
        self.arguments.push(form);
        exact
    }

    // ---- products and powers ----------------------------------------------------------------

    fn product(&mut self, a: &CanonicalForm, b: &CanonicalForm) -> Option<CanonicalForm> {
        let products = a.products(b)?;
        self.settled(products)
    }

    /// The sum of terms, with the powers of roots, magnitudes and signs in their ranges.
    fn settled(&mut self, mut pending: Vec<(Coefficient, Monomial)>) -> Option<CanonicalForm> {
        let mut form = CanonicalForm::default();
        let mut steps = 0;
        while let Some((coefficient, monomial)) = pending.pop() {
            steps += 1;
            if steps > MAX_STEPS {
                return None;
            }
            match self.rewritten(&monomial)? {
                None => form.add(coefficient, monomial),
                Some((rest, factor)) => pending.extend(
                    (factor.terms.iter()).map(|(other, scale)| (coefficient.times(scale), rest.times(other))),
                ),
            }
        }
        Some(form)
    }

    /// A monomial with one atom out of range, as a monomial without it times a form. The outer
    /// option is empty if that is too large.
    #[allow(clippy::type_complexity, reason = "a pair that is taken apart at once")]
    fn rewritten(&mut self, monomial: &Monomial) -> Option<Option<(Monomial, CanonicalForm)>> {
        for &(atom, power) in &monomial.powers {
            let with_power = |power: i32| match power {
                0 => monomial.without(atom),
                _ => monomial.without(atom).times(&Monomial::atom(atom, power)),
            };
            match self.atoms[atom as usize].clone() {
                Atom::Sum(sum) if power > 0 => {
                    return Some(Some((with_power(0), self.power(&sum, power)?)));
                }
                Atom::Root(base, index) => {
                    let index = i32::try_from(index).ok()?;
                    let (whole, rest) = (power.div_euclid(index), power.rem_euclid(index));
                    if whole != 0 {
                        return Some(Some((with_power(rest), self.power(&base, whole)?)));
                    }
                }
                Atom::Abs(base) => {
                    let rest = power.rem_euclid(2);
                    if rest != power {
                        return Some(Some((with_power(rest), self.power(&base, power - rest)?)));
                    }
                    let sign = self.numbers.get(&Atom::Sign(base.clone())).copied();
                    let sign = sign.map_or((0, 0), |sign| (sign, monomial.power_of(sign)));
                    if sign.1 > 0 {
                        // |x| sign(x) = x, |x| sign(x)^2 = |x|.
                        let rest = monomial.without(sign.0);
                        return Some(Some(match sign.1 % 2 {
                            0 => (rest, CanonicalForm::constant(Coefficient::integer(1))),
                            _ => (rest.without(atom), base),
                        }));
                    }
                }
                Atom::Sign(_) if !(0..=2).contains(&power) => {
                    let rest = 2 - power.rem_euclid(2);
                    let one = CanonicalForm::constant(Coefficient::integer(1));
                    return Some(Some((with_power(rest), one)));
                }
                _ => {}
            }
        }
        Some(None)
    }

    fn power(&mut self, base: &CanonicalForm, exponent: i32) -> Option<CanonicalForm> {
        let one = CanonicalForm::constant(Coefficient::integer(1));
        if exponent == 0 {
            return Some(one);
        }
        let base = if exponent < 0 { self.reciprocal(base)? } else { base.clone() };
        let count = exponent.unsigned_abs();
        let limit = if base.terms.len() > 1 { MAX_SUM_POWER } else { MAX_TERM_POWER };
        if count > limit {
            return None;
        }
        let (mut power, mut square, mut rest) = (one, base, count);
        loop {
            if rest % 2 == 1 {
                power = self.product(&power, &square)?;
            }
            rest /= 2;
            if rest == 0 {
                return Some(power);
            }
            square = self.product(&square, &square)?;
        }
    }

    fn reciprocal(&mut self, form: &CanonicalForm) -> Option<CanonicalForm> {
        let leading = form.leading()?;
        if let Some((coefficient, monomial)) = form.as_term() {
            let reciprocal = (coefficient.reciprocal()?, monomial.reciprocal());
            return self.settled(vec![reciprocal]);
        }
        let factor = leading.exact().reciprocal()?;
        let monic = self.argument(form.scaled(&factor));
        let atom = self.number(Atom::Sum(monic));
        Some(CanonicalForm::term(factor, Monomial::atom(atom, -1)))
    }

    // ---- roots, logarithms, magnitudes ------------------------------------------------------

    /// `scale * prod base^power * exp(E)` of a form that is positive where it is used: a positive
    /// number, forms that are positive there, and the exponential.
    fn split(&mut self, form: &CanonicalForm) -> Option<Split> {
        let form = self.argument(form.clone());
        let scale = form.leading()?.size();
        let inverse = Coefficient::real(scale.recip(), 0.0);
        let Some((coefficient, monomial)) = form.as_term() else {
            let factors = vec![(form.scaled(&inverse), 1)];
            return Some(Split { scale, factors, exponent: CanonicalForm::default() });
        };
        let mut factors = Vec::new();
        let mut rest = Monomial::default();
        for &(atom, power) in &monomial.powers {
            let base = CanonicalForm::term(Coefficient::integer(1), Monomial::atom(atom, 1));
            match &self.atoms[atom as usize] {
                Atom::Root(..) | Atom::Abs(_) => factors.push((base, power)),
                _ if self.positive.contains(&atom) => factors.push((base, power)),
                _ if power % 2 == 0 => factors.push((self.abs(&base)?, power)),
                _ => rest = rest.times(&Monomial::atom(atom, power)),
            }
        }
        let sign = coefficient.times(&inverse);
        match rest.powers[..] {
            [] if sign.is_one() => {}
            [] => return None,
            [(atom, power)] => factors.push((CanonicalForm::term(sign, Monomial::atom(atom, 1)), power)),
            _ => factors.push((CanonicalForm::term(sign, rest), 1)),
        }
        let mut exponent = CanonicalForm::default();
        for (monomial, (re, im)) in &monomial.exponent {
            exponent.add(Coefficient::complex(re.clone(), im.clone()), monomial.clone());
        }
        Some(Split { scale, factors, exponent })
    }

    fn log(&mut self, form: &CanonicalForm) -> Option<CanonicalForm> {
        let split = self.split(form)?;
        let mut sum = split.exponent;
        for (prime, power) in prime_powers(&split.scale) {
            let prime = CanonicalForm::constant(Coefficient::real(prime.into(), 0.0));
            let log = self.atom(Atom::Log(prime));
            sum = sum.plus(&log.scaled(&Coefficient::integer(power.into())));
        }
        for (base, power) in split.factors {
            let (base, index) = self.radicand(base);
            let share = BigRational::new(power.into(), index.into());
            let log = self.atom(Atom::Log(base));
            sum = sum.plus(&log.scaled(&Coefficient::real(share, 0.0)));
        }
        Some(sum)
    }

    fn root(&mut self, form: &CanonicalForm, index: u32) -> Option<CanonicalForm> {
        if form.is_zero() {
            return Some(CanonicalForm::default());
        }
        let split = self.split(form)?;
        let share = BigRational::new(1.into(), index.into());
        let mut root = self.exp(split.exponent.scaled(&Coefficient::real(share, 0.0)))?;
        let primes = prime_powers(&split.scale).into_iter().map(|(prime, power)| {
            (CanonicalForm::constant(Coefficient::real(prime.into(), 0.0)), power)
        });
        for (base, power) in primes.chain(split.factors) {
            let (base, inner) = self.radicand(base);
            let exponent = BigRational::new(power.into(), BigInt::from(index) * inner);
            let factor = self.positive_power(&base, &exponent)?;
            root = self.product(&root, &factor)?;
        }
        Some(root)
    }

    /// What stands under a root, with its index; anything else with 1.
    fn radicand(&self, base: CanonicalForm) -> (CanonicalForm, u32) {
        match base.as_term() {
            Some((coefficient, monomial)) if coefficient.is_one() && monomial.exponent.is_empty() => {
                match monomial.powers[..] {
                    [(atom, 1)] => match &self.atoms[atom as usize] {
                        Atom::Root(radicand, index) => (radicand.clone(), *index),
                        _ => (base, 1),
                    },
                    _ => (base, 1),
                }
            }
            _ => (base, 1),
        }
    }

    /// `base ^ exponent` of a positive base.
    fn positive_power(&mut self, base: &CanonicalForm, exponent: &BigRational) -> Option<CanonicalForm> {
        let whole = exponent.floor().numer().to_i32()?;
        let rest = exponent - exponent.floor();
        let power = self.power(base, whole)?;
        if rest.is_zero() {
            return Some(power);
        }
        let index = rest.denom().to_i64().filter(|index| *index <= MAX_ROOT)?;
        let root = self.number(Atom::Root(base.clone(), u32::try_from(index).ok()?));
        let root = CanonicalForm::term(Coefficient::integer(1), Monomial::atom(root, rest.numer().to_i32()?));
        self.product(&power, &root)
    }

    /// `exp`: multiples of logarithms become powers of what they are logarithms of.
    fn exp(&mut self, argument: CanonicalForm) -> Option<CanonicalForm> {
        let argument = self.argument(argument);
        let mut rest = CanonicalForm::default();
        let mut product = CanonicalForm::constant(Coefficient::integer(1));
        for (monomial, coefficient) in &argument.terms {
            let log = match (monomial.powers.as_slice(), monomial.exponent.is_empty()) {
                ([(atom, 1)], true) => match &self.atoms[*atom as usize] {
                    Atom::Log(base) => Some(base.clone()),
                    _ => None,
                },
                _ => None,
            };
            let factor = match (log, coefficient.as_real()) {
                (Some(base), Some(exponent)) => self.positive_power(&base, exponent),
                _ => None,
            };
            match factor {
                Some(factor) => product = self.product(&product, &factor)?,
                None => rest.add(coefficient.clone(), monomial.clone()),
            }
        }
        let [exponential, _] = exponentials(&rest, false);
        self.product(&product, &exponential)
    }

    fn abs(&mut self, form: &CanonicalForm) -> Option<CanonicalForm> {
        let form = self.argument(form.clone());
        let Some(leading) = form.leading() else {
            return Some(form);
        };
        let scale = Coefficient::real(leading.size(), 0.0);
        let sign = if leading.is_negative() { -1 } else { 1 };
        let normed = form.scaled(&scale.reciprocal()?).scaled(&Coefficient::integer(sign));
        let Some((coefficient, monomial)) = normed.as_term().filter(|(c, _)| c.is_one()) else {
            return Some(self.atom(Atom::Abs(normed)).scaled(&scale));
        };
        let mut product = CanonicalForm::term(
            coefficient.clone(),
            Monomial { powers: Vec::new(), exponent: monomial.exponent.clone() },
        );
        for &(atom, power) in &monomial.powers {
            let base = CanonicalForm::term(Coefficient::integer(1), Monomial::atom(atom, 1));
            let is_positive = self.positive.contains(&atom) || matches!(self.atoms[atom as usize], Atom::Root(..) | Atom::Abs(_));
            let factor = match is_positive || power % 2 == 0 {
                true => self.power(&base, power)?,
                false => {
                    let magnitude = self.atom(Atom::Abs(base));
                    self.power(&magnitude, power)?
                }
            };
            product = self.product(&product, &factor)?;
        }
        Some(product.scaled(&scale))
    }

    fn sign(&mut self, form: &CanonicalForm) -> Option<CanonicalForm> {
        let form = self.argument(form.clone());
        let Some(leading) = form.leading() else {
            return Some(form);
        };
        let sign = Coefficient::integer(if leading.is_negative() { -1 } else { 1 });
        if let Some(constant) = form.as_constant()
            && constant.as_real().is_some()
        {
            return Some(CanonicalForm::constant(sign));
        }
        let size = Coefficient::real(leading.size(), 0.0).reciprocal()?;
        let normed = form.scaled(&size).scaled(&sign);
        let is_symbol = |atom: &u32| matches!(self.atoms[*atom as usize], Atom::Symbol(_));
        let factors: Option<Vec<(u32, i32)>> = normed.as_term().and_then(|(coefficient, monomial)| {
            let symbols = monomial.powers.iter().all(|(atom, _)| is_symbol(atom));
            (coefficient.is_one() && symbols).then(|| monomial.powers.clone())
        });
        let Some(factors) = factors else {
            return Some(self.atom(Atom::Sign(normed)).scaled(&sign));
        };
        let mut product = CanonicalForm::constant(sign);
        for (atom, power) in factors {
            if self.positive.contains(&atom) {
                continue;
            }
            let base = CanonicalForm::term(Coefficient::integer(1), Monomial::atom(atom, 1));
            let factor = self.atom(Atom::Sign(base));
            let factor = self.power(&factor, 2 - (power.abs() % 2))?;
            product = self.product(&product, &factor)?;
        }
        Some(product)
    }
}

/// See [`CanonicalForms::split`].
struct Split {
    scale: BigRational,
    factors: Vec<(CanonicalForm, i32)>,
    exponent: CanonicalForm,
}

/// `exp(argument)` and `exp(-argument)`, with `i * argument` for angles.
fn exponentials(argument: &CanonicalForm, is_angle: bool) -> [CanonicalForm; 2] {
    let exponent: Vec<_> = (argument.terms.iter())
        .map(|(monomial, coefficient)| {
            let (re, im) = (coefficient.re.clone(), coefficient.im.clone());
            (monomial.clone(), if is_angle { (-im, re) } else { (re, im) })
        })
        .collect();
    let plus = Monomial { powers: Vec::new(), exponent };
    let minus = plus.reciprocal();
    [plus, minus].map(|monomial| CanonicalForm::term(Coefficient::integer(1), monomial))
}
