//! From expressions to normal forms.

use super::*;

/// Most fractions of two arguments that are compared by multiplying out, and most such comparisons.
const MAX_FRACTIONS: usize = 4;
const MAX_FRACTION_TRIES: usize = 300;
const MAX_REMOVALS: usize = 40;
/// Most sums under roots and logarithms by which others are divided.
const MAX_SUMS: usize = 12;
pub(super) const MAX_ROOT: i64 = 1_000;

/// Normal forms of the expressions of a pool; the documentation of this folder has the method.
pub struct CanonicalForms<'p> {
    pub(super) pool: &'p ExprPool,
    pub(super) atoms: Vec<Atom>,
    pub(super) numbers: HashMap<Atom, u32>,
    pub(super) forms: HashMap<ExprId, CanonicalForm>,
    arguments: Vec<Argument>,
    known: HashSet<CanonicalForm>,
    /// Atoms that are positive wherever all given expressions are defined, and sums that are.
    pub(super) positive: HashSet<u32>,
    pub(super) positive_sums: Vec<CanonicalForm>,
    pub(super) negative: HashSet<u32>,
    /// Largest difference between arguments of functions that only rounding of decimals explains.
    pub rounding: f64,
    is_rounded: bool,
    /// Whether no numbers round to all decimals whose arguments were treated as equal: then equal forms prove nothing.
    pub is_contradictory: bool,
    n_fraction_tries: usize,
}

impl<'p> CanonicalForms<'p> {
    /// Forms to compare where all of `exprs` have values: arguments of their logarithms and roots count as positive.
    pub fn new(pool: &'p ExprPool, exprs: &[ExprId]) -> Self {
        let mut forms = Self {
            pool,
            atoms: Vec::new(),
            numbers: HashMap::new(),
            forms: HashMap::new(),
            arguments: Vec::new(),
            known: HashSet::new(),
            positive: HashSet::new(),
            negative: HashSet::new(),
            positive_sums: Vec::new(),
            rounding: 0.0,
            is_rounded: false,
            is_contradictory: false,
            n_fraction_tries: 0,
        };
        let mut guarded = Vec::new();
        for expr in pool.reachable(exprs) {
            match pool.node(expr) {
                Node::Apply(Function::Log | Function::Sqrt, argument) => guarded.push(*argument),
                Node::Power(base, exponent) if !forms.is_integer(*exponent) => guarded.push(*base),
                _ => {}
            }
        }
        let mut sums = Vec::new();
        for expr in guarded {
            let (sign, base) = of_odd_power(pool, expr);
            let form = forms.of(base).scaled(&Coefficient::integer(sign));
            if form.terms.len() > 1 && !form.has_radius() && !sums.contains(&form) {
                sums.push(form.clone());
            }
            if let Some((coefficient, monomial)) = form.as_term()
                && let [(atom, power)] = monomial.powers[..]
                && power % 2 != 0
            {
                match coefficient.is_negative() {
                    true => forms.negative.insert(atom),
                    false => forms.positive.insert(atom),
                };
            }
        }
        sums.sort_by_key(|sum| sum.terms.len());
        sums.truncate(MAX_SUMS);
        if !(forms.positive.is_empty() && forms.negative.is_empty() && sums.is_empty()) {
            forms.forms.clear();
        }
        forms.positive_sums = sums;
        forms.rounding = 0.0;
        forms
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

    /// The form times a factor that is zero nowhere in the interior of the domain. All reciprocals of sums, tangents
    /// and hyperbolic tangents are removed, and magnitudes of sums whose signs occur. `None` if it grows too large.
    pub fn without_fractions(&mut self, form: &CanonicalForm) -> Option<CanonicalForm> {
        let mut form = form.clone();
        for _ in 0..MAX_REMOVALS {
            // An atom is made after those in its argument.
            let Some(atom) = self.fractions(&form).into_iter().max() else {
                return Some(form);
            };
            form = self.removed(&form, atom)?;
        }
        None
    }

    /// The form times the powers of numerator and denominator of an atom that clear it.
    pub(super) fn removed(&mut self, form: &CanonicalForm, atom: u32) -> Option<CanonicalForm> {
        let (top, bottom) = match self.atoms[atom as usize].clone() {
            Atom::Sum(sum) => (sum, CanonicalForm::one()),
            Atom::Call(function @ (Function::Tan | Function::Tanh), argument) => {
                let [plus, minus] = exponentials(&argument, function.is_circular());
                let unit = match function.is_circular() {
                    true => Coefficient::imaginary(-1, 1),
                    false => Coefficient::integer(1),
                };
                ((&plus - &minus).scaled(&unit), plus.plus(&minus))
            }
            Atom::Call(Function::Abs, base) => {
                let sign = self.call(Function::Sign, base.clone());
                (self.product(&base, &sign)?, CanonicalForm::one())
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

    fn is_integer(&mut self, expr: ExprId) -> bool {
        let value = self.of(expr).as_constant();
        value.is_some_and(|value| value.is_integer())
    }

    pub(super) fn atom(&mut self, atom: Atom) -> CanonicalForm {
        CanonicalForm::atom(self.number(atom))
    }

    pub(super) fn call(&mut self, function: Function, argument: CanonicalForm) -> CanonicalForm {
        self.atom(Atom::Call(function, argument))
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
            Node::Symbol(symbol) => Some(match pool.decimal_of(*symbol) {
                Some((decimal, _)) => CanonicalForm::constant(decimal.clone()),
                None => self.atom(Atom::Symbol(*symbol)),
            }),
            Node::Sum(terms) => {
                let mut sum = CanonicalForm::default();
                for term in terms.iter() {
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

    pub(super) fn apply(
        &mut self,
        function: Function,
        argument: &CanonicalForm,
    ) -> Option<CanonicalForm> {
        match function {
            Function::Sin | Function::Cos => {
                let argument = self.argument(argument.clone());
                let [plus, minus] = exponentials(&argument, true);
                let half = Coefficient::from(ratio(1, 2));
                Some(match function {
                    Function::Sin => (&plus - &minus).scaled(&Coefficient::imaginary(-1, 2)),
                    _ => plus.plus(&minus).scaled(&half),
                })
            }
            Function::Tan | Function::Tanh => self.odd(function, argument),
            Function::Exp => self.exp(argument.clone()),
            Function::Log => self.log(argument),
            Function::Sqrt => self.root(argument, 2),
            Function::Abs => self.abs(argument),
            Function::Sign => self.sign(argument),
        }
    }

    fn odd(&mut self, function: Function, argument: &CanonicalForm) -> Option<CanonicalForm> {
        let argument = self.argument(argument.clone());
        let Some(leading) = argument.leading() else {
            return Some(CanonicalForm::default());
        };
        let sign = leading.sign();
        let argument = argument.scaled(&sign);
        Some(self.call(function, argument).scaled(&sign))
    }

    /// An argument of a function without radii: an earlier one, if there are numbers that round to the decimals of all.
    pub(super) fn argument(&mut self, form: CanonicalForm) -> CanonicalForm {
        let exact = form.exact();
        self.is_rounded |= form.has_radius();
        if self.is_rounded {
            for known in &mut self.arguments {
                if let Some(largest) = known.take(&form) {
                    self.rounding = self.rounding.max(largest);
                    return known.form.exact();
                }
            }
        } else if self.known.contains(&exact) {
            return exact;
        }
        if let Some(known) = self.equal_fraction(&exact) {
            return known;
        }
        // The same digits, but with a smaller range of possible numbers than before.
        self.is_contradictory |= self.known.contains(&exact);
        self.known.insert(exact.clone());
        self.arguments.push(Argument {
            form,
            room: HashMap::new(),
        });
        exact
    }

    /// An argument that is the same once fractions are removed.
    fn equal_fraction(&mut self, exact: &CanonicalForm) -> Option<CanonicalForm> {
        for place in 0..self.arguments.len() {
            let known = &self.arguments[place].form;
            let of_both = [exact, known].map(|form| self.fractions(form));
            let count = of_both[0].union(&of_both[1]).count();
            if count == 0 || count > MAX_FRACTIONS || self.n_fraction_tries == MAX_FRACTION_TRIES {
                continue;
            }
            self.n_fraction_tries += 1;
            let known = known.exact();
            let difference = self.without_fractions(&(exact - &known));
            if difference.is_some_and(|difference| difference.is_zero()) {
                return Some(known);
            }
        }
        None
    }

    fn fractions(&self, form: &CanonicalForm) -> HashSet<u32> {
        let atoms = form.terms.keys().flat_map(|monomial| &monomial.powers);
        let atoms = atoms.map(|(atom, _)| *atom);
        atoms.filter(|atom| self.is_removable(*atom)).collect()
    }

    fn is_removable(&self, atom: u32) -> bool {
        match &self.atoms[atom as usize] {
            Atom::Sum(_) | Atom::Call(Function::Tan | Function::Tanh, _) => true,
            // `|x + y| = (x + y) sign(x + y)`; magnitudes of single atoms have their own rules.
            Atom::Call(Function::Abs, base) => {
                let sign = Atom::Call(Function::Sign, base.clone());
                base.as_atom().is_none() && self.numbers.contains_key(&sign)
            }
            _ => false,
        }
    }
}

/// An argument of a function, and the numbers that its coefficients may still stand for.
pub(super) struct Argument {
    form: CanonicalForm,
    /// Bounds of each coefficient's distance from the one of `form`, where they are narrower than its radius.
    room: HashMap<Monomial, (f64, f64)>,
}

impl Argument {
    /// Accepts another form as equal to this one if their numbers can be the same, and narrows the possible numbers.
    /// Returns the coefficients' largest distance.
    fn take(&mut self, other: &CanonicalForm) -> Option<f64> {
        let radius = |form: &CanonicalForm, monomial: &Monomial| {
            form.terms.get(monomial).map_or(0.0, |c| c.radius())
        };
        let mut room = self.room.clone();
        let mut largest = 0.0_f64;
        for (monomial, difference) in &(other - &self.form).terms {
            let (own, its) = (radius(&self.form, monomial), radius(other, monomial));
            let slack = 1e-9 * (own + its);
            let distance = nearest(&difference.re);
            let (low, high) = room.get(monomial).copied().unwrap_or((-own, own));
            let (low, high) = (low.max(distance - its), high.min(distance + its));
            if low > high + slack || nearest(&difference.im).abs() > own + its + slack {
                return None;
            }
            largest = largest.max(difference.magnitude());
            room.insert(monomial.clone(), (low.min(high), high.max(low)));
        }
        self.room = room;
        Some(largest)
    }
}

/// The sign and the base of an odd power: it is positive where their product is. Anything else is its own base.
fn of_odd_power(pool: &ExprPool, mut expr: ExprId) -> (i64, ExprId) {
    let mut sign = 1;
    loop {
        expr = match (pool.factors_of(expr), pool.node(expr)) {
            (&[number, factor], _) if pool.as_number(number).is_some() => {
                let is_negative = pool.as_number(number).is_some_and(Number::is_negative);
                sign *= if is_negative { -1 } else { 1 };
                factor
            }
            (_, &Node::Power(base, exponent)) if matches!(pool.as_integer(exponent), Some(odd @ 1..) if odd % 2 != 0) => {
                base
            }
            _ => return (sign, expr),
        }
    }
}

/// `exp(argument)` and `exp(-argument)`, with `i * argument` for angles.
pub(super) fn exponentials(argument: &CanonicalForm, is_angle: bool) -> [CanonicalForm; 2] {
    let unit = match is_angle {
        true => Coefficient::imaginary(1, 1),
        false => Coefficient::integer(1),
    };
    let minus_unit = &Coefficient::integer(-1) * &unit;
    [unit, minus_unit].map(|factor| CanonicalForm::exponential(argument.scaled(&factor)))
}
