//! From expressions to normal forms.

use std::collections::{HashMap, HashSet};

use num_traits::ToPrimitive;

use super::atoms::Atom;
use super::coefficient::{Coefficient, Literal};
use super::polynomial::{CanonicalForm, Monomial};
use super::rational::Rational;
use crate::symbolic::node::{ExprId, Function, Node, SymbolId};
use crate::symbolic::pool::ExprPool;

/// Most atoms that are removed by multiplying out.
const MAX_REMOVALS: usize = 40;
/// Largest index of a root.
pub(super) const MAX_ROOT: i64 = 1_000;

/// Normal forms of the expressions of a pool; the documentation of this folder has the method.
pub struct CanonicalForms<'p> {
    pub(super) pool: &'p ExprPool,
    pub(super) literal: &'p dyn Fn(SymbolId) -> Option<Literal>,
    pub(super) atoms: Vec<Atom>,
    pub(super) numbers: HashMap<Atom, u32>,
    pub(super) forms: HashMap<ExprId, CanonicalForm>,
    /// Arguments so far, with their radii.
    pub(super) arguments: Vec<CanonicalForm>,
    pub(super) known: HashSet<CanonicalForm>,
    /// Atoms that are positive wherever all given expressions are defined.
    pub(super) positive: HashSet<u32>,
    rounding: f64,
}

impl<'p> CanonicalForms<'p> {
    /// Forms of `exprs` and their parts. Where they are compared they all have values: what stands
    /// under a logarithm or root of one of them is taken as positive in the others too.
    ///
    /// `literal` gives the symbols that stand for decimals.
    pub fn new(
        pool: &'p ExprPool,
        exprs: &[ExprId],
        literal: &'p dyn Fn(SymbolId) -> Option<Literal>,
    ) -> Self {
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
            let numbers = form
                .terms
                .keys()
                .flat_map(|monomial| &monomial.powers)
                .map(|(atom, _)| *atom);
            let removable = |atom: &u32| {
                matches!(
                    self.atoms[*atom as usize],
                    Atom::Sum(_) | Atom::Tan(_) | Atom::Tanh(_)
                )
            };
            // An atom is made after those in its argument.
            let Some(atom) = numbers.filter(removable).max() else {
                return Some(form);
            };
            form = self.removed(&form, atom)?;
        }
        None
    }

    /// The form times the powers of numerator and denominator of an atom that clear it.
    pub(super) fn removed(&mut self, form: &CanonicalForm, atom: u32) -> Option<CanonicalForm> {
        let one = || CanonicalForm::constant(Coefficient::integer(1));
        let (top, bottom) = match self.atoms[atom as usize].clone() {
            Atom::Sum(sum) => (sum, one()),
            Atom::Tan(argument) => {
                let [plus, minus] = exponentials(&argument, true);
                (
                    plus.minus(&minus).scaled(&Coefficient::imaginary(-1, 1)),
                    plus.plus(&minus),
                )
            }
            Atom::Tanh(argument) => {
                let [plus, minus] = exponentials(&argument, false);
                (plus.minus(&minus), plus.plus(&minus))
            }
            _ => return None,
        };
        let powers = form.terms.keys().map(|monomial| monomial.power_of(atom));
        let (lowest, highest) = powers.fold((0, 0), |(low, high), power| {
            (low.min(power), high.max(power))
        });
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

    pub(super) fn is_integer(&self, expr: ExprId) -> bool {
        match self.pool.node(expr) {
            Node::Number(number) => number.as_integer().is_some(),
            Node::Symbol(symbol) => {
                (self.literal)(*symbol).is_some_and(|literal| literal.value.is_integer())
            }
            _ => false,
        }
    }

    pub(super) fn atom(&mut self, atom: Atom) -> CanonicalForm {
        CanonicalForm::term(
            Coefficient::integer(1),
            Monomial::atom(self.number(atom), 1),
        )
    }

    pub(super) fn number(&mut self, atom: Atom) -> u32 {
        if let Some(number) = self.numbers.get(&atom) {
            return *number;
        }
        let number =
            u32::try_from(self.atoms.len()).expect("fewer atoms than expressions in a pool");
        self.atoms.push(atom.clone());
        self.numbers.insert(atom, number);
        number
    }

    pub(super) fn node(&mut self, expr: ExprId) -> Option<CanonicalForm> {
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

    pub(super) fn power_of_forms(
        &mut self,
        base: &CanonicalForm,
        exponent: CanonicalForm,
    ) -> Option<CanonicalForm> {
        let exponent = self.argument(exponent);
        if let Some(constant) = exponent.as_constant()
            && let Some(value) = constant.as_real()
            && let (Some(top), Some(bottom)) =
                (value.numerator().to_i32(), value.denominator().to_i64())
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

    pub(super) fn apply(
        &mut self,
        function: Function,
        argument: &CanonicalForm,
    ) -> Option<CanonicalForm> {
        match function {
            Function::Sin | Function::Cos => {
                let argument = self.argument(argument.clone());
                let [plus, minus] = exponentials(&argument, true);
                let half = Coefficient::complex(Rational::new(1, 2), Rational::zero());
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
    pub(super) fn odd(
        &mut self,
        argument: &CanonicalForm,
        atom: fn(CanonicalForm) -> Atom,
    ) -> Option<CanonicalForm> {
        let argument = self.argument(argument.clone());
        let Some(leading) = argument.leading() else {
            return Some(CanonicalForm::default());
        };
        let sign = Coefficient::integer(if leading.is_negative() { -1 } else { 1 });
        let argument = argument.scaled(&sign);
        Some(self.atom(atom(argument)).scaled(&sign))
    }

    /// An argument of a function without its radii: one from before that agrees within them.
    pub(super) fn argument(&mut self, form: CanonicalForm) -> CanonicalForm {
        let exact = form.exact();
        if self.known.contains(&exact) {
            return exact;
        }
        let known = self.arguments.iter().find(|known| {
            (form.has_radius() || known.has_radius()) && form.minus(known).may_be_zero()
        });
        if let Some(known) = known {
            let differences = form.minus(known);
            let largest = differences
                .coefficients()
                .map(Coefficient::magnitude)
                .fold(0.0, f64::max);
            self.rounding = self.rounding.max(largest);
            return known.exact();
        }
        self.known.insert(exact.clone());
        self.arguments.push(form);
        exact
    }
}

/// `exp(argument)` and `exp(-argument)`, with `i * argument` for angles.
pub(super) fn exponentials(argument: &CanonicalForm, is_angle: bool) -> [CanonicalForm; 2] {
    let exponent: Vec<_> = (argument.terms.iter())
        .map(|(monomial, coefficient)| {
            let (re, im) = (coefficient.re.clone(), coefficient.im.clone());
            (
                monomial.clone(),
                if is_angle { (-im, re) } else { (re, im) },
            )
        })
        .collect();
    let plus = Monomial {
        powers: Vec::new(),
        exponent,
    };
    let minus = plus.reciprocal();
    [plus, minus].map(|monomial| CanonicalForm::term(Coefficient::integer(1), monomial))
}
