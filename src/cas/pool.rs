//! The pool that owns all expressions: storage, symbols and traversal.

use super::factors::Identity;
use super::node::BuildIdHasher;
use super::order::SymbolKey;
use super::slope::Slope;
use super::*;

/// Owner of hash-consed, canonical expressions. Only constructors make them ([`sum`](ExprPool::sum),
/// [`product`](ExprPool::product), [`pow`](ExprPool::pow), [`apply`](ExprPool::apply) and functions that call these),
/// with the following invariants:
///
/// - sums and products are flat and sorted by [`compare`](ExprPool::compare), independent of the order of the given
///   operands; constants are folded, like terms and like factors collected;
/// - a product has at most one number, in front (two only where folding would overflow);
/// - a sum raised to an integer power, or a factor, has a positive first coefficient, and the
///   argument of an even or odd function does not start with a minus;
/// - `x^(k/2)` is stored as `sqrt(x)^k`.
///
/// # Which rewritings are allowed
///
/// Wherever the expression as written has a finite real value, the canonical one has the same up to rounding. A
/// rewriting may remove singularities, as in `x/x = 1`, `0 * log(x) = 0`, `sqrt(x)^2 = x` or `exp(log(x)) = x`, but
/// never adds one. Constants without a value (`1/0`, `log(0)`, `sqrt(-1)`) stay; folding gives no infinity or NaN.
#[derive(Clone, Debug)]
pub struct ExprPool {
    nodes: Vec<Node>,
    facts: Vec<Facts>,
    ids: HashMap<Node, ExprId, BuildIdHasher>,
    symbols: Vec<Symbol>,
    symbol_ids: HashMap<String, SymbolId>,
    pub(super) is_exact: bool,
    /// Constructors that were called and steps of about that effort, and how many of them there may be.
    work_done: u64,
    pub(super) work_limit: u64,
    pub(super) derivatives: HashMap<(ExprId, SymbolId), ExprId, BuildIdHasher>,
    pub(super) identities: Option<Arc<[Identity]>>,
    pub(super) slopes: HashMap<(ExprId, SymbolId), Slope, BuildIdHasher>,
}

#[derive(Clone, Debug)]
struct Symbol {
    key: SymbolKey,
    expr: ExprId,
    selection: Option<[ExprId; 3]>,
    /// See [`ExprPool::decimal`]; with the nearest float.
    decimal: Option<(Coefficient, f64)>,
}

#[derive(Clone, Copy, Debug)]
struct Facts {
    /// The node's own id, to lend it as a list of one.
    itself: ExprId,
    /// The node without its numeric factor.
    rest: ExprId,
    grade: u32,
    /// The symbols that occur: bit `i` for symbol `i`, the last bit for all from 63 on.
    symbols: u64,
    sign: Sign,
}

/// The values that a node can have, as far as its operands show it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Sign {
    Any,
    NonNegative,
    Positive,
}

impl Default for ExprPool {
    fn default() -> ExprPool {
        ExprPool::new()
    }
}

impl ExprPool {
    /// An empty pool: it holds `0` and `1`.
    pub fn new() -> ExprPool {
        let mut pool = ExprPool {
            nodes: Vec::new(),
            facts: Vec::new(),
            ids: HashMap::default(),
            symbols: Vec::new(),
            symbol_ids: HashMap::new(),
            is_exact: false,
            work_done: 0,
            work_limit: u64::MAX,
            derivatives: HashMap::default(),
            slopes: HashMap::default(),
            identities: None,
        };
        let zero = pool.intern(Node::Number(Number::ZERO));
        let one = pool.intern(Node::Number(Number::ONE));
        debug_assert_eq!((zero, one), (ExprId::ZERO, ExprId::ONE));
        pool
    }

    /// An empty pool that folds only exact results (`10^20 + 1` stays): equal expressions are equal to the last digit.
    pub fn exact() -> ExprPool {
        ExprPool {
            is_exact: true,
            ..ExprPool::new()
        }
    }

    /// Runs `step` within this amount of work and the limit around it; expressions that would exceed it stay unchanged.
    pub(super) fn limited<T>(&mut self, work: u64, step: impl FnOnce(&mut Self) -> T) -> T {
        let outer = self.limit_work(work);
        let result = step(self);
        self.work_limit = outer;
        result
    }

    /// Lowers the limit to so much work from here on; the limit before.
    pub(super) fn limit_work(&mut self, work: u64) -> u64 {
        let outer = self.work_limit;
        self.work_limit = outer.min(self.work_done.saturating_add(work));
        outer
    }

    pub(super) fn spend(&mut self, steps: usize) -> bool {
        self.work_done = self.work_done.saturating_add(steps as u64);
        self.work_done <= self.work_limit
    }

    pub(super) fn affords(&self, steps: usize) -> bool {
        self.work_done.saturating_add(steps as u64) <= self.work_limit
    }

    pub(super) fn folded(&self, number: Option<Number>) -> Option<Number> {
        number.filter(|number| number.is_exact() || !self.is_exact)
    }

    /// The number of distinct expressions made so far.
    pub fn n_nodes(&self) -> usize {
        self.nodes.len()
    }

    /// The variable of that name, made at its first mention.
    pub fn symbol_id(&mut self, name: &str) -> SymbolId {
        self.symbol_for(name, None, None)
    }

    /// A variable that replaces a part while expressions are rewritten; no file has a variable of this name.
    pub(super) fn placeholder(&mut self, kind: &str, number: usize) -> SymbolId {
        self.symbol_id(&format!(" {kind} {number}"))
    }

    /// A number as written, never rounded or folded, see [`Coefficient::parse`]; prints behind `~` if rounded or `#`.
    pub fn decimal(&mut self, text: &str, is_rounded: bool) -> Option<ExprId> {
        let coefficient = Coefficient::parse(text, is_rounded)?;
        let value = coefficient.to_f64();
        let name = format!("{}{text}", if is_rounded { '~' } else { '#' });
        let id = self.symbol_for(&name, None, Some((coefficient, value)));
        Some(self.symbol_expr(id))
    }

    /// The number that a symbol of [`ExprPool::decimal`] stands for, and the nearest float.
    pub fn decimal_of(&self, symbol: SymbolId) -> Option<(&Coefficient, f64)> {
        let decimal = self.symbols[symbol.index()].decimal.as_ref();
        decimal.map(|(coefficient, value)| (coefficient, *value))
    }

    /// The parts of a selection of [`ExprPool::slope`]: test, value where the test is zero, value elsewhere.
    pub fn selection(&self, symbol: SymbolId) -> Option<[ExprId; 3]> {
        self.symbols[symbol.index()].selection
    }

    /// The symbol of a name; the symbol of a selection is no variable, see [`ExprPool::selection`].
    pub(super) fn symbol_for(
        &mut self,
        name: &str,
        selection: Option<[ExprId; 3]>,
        decimal: Option<(Coefficient, f64)>,
    ) -> SymbolId {
        if let Some(&id) = self.symbol_ids.get(name) {
            return id;
        }
        let count = u32::try_from(self.symbols.len());
        let id = SymbolId(count.expect("a pool holds fewer than 2^32 symbols"));
        self.symbol_ids.insert(name.to_owned(), id);
        self.symbols.push(Symbol {
            key: SymbolKey::of(name),
            expr: ExprId::ZERO,
            selection,
            decimal,
        });
        self.symbols[id.index()].expr = self.intern(Node::Symbol(id));
        id
    }

    pub fn symbol(&mut self, name: &str) -> ExprId {
        let id = self.symbol_id(name);
        self.symbol_expr(id)
    }

    pub fn symbol_expr(&self, symbol: SymbolId) -> ExprId {
        self.symbols[symbol.index()].expr
    }

    pub fn symbol_name(&self, symbol: SymbolId) -> &str {
        &self.symbols[symbol.index()].key.name
    }

    pub(super) fn symbol_key(&self, symbol: SymbolId) -> &SymbolKey {
        &self.symbols[symbol.index()].key
    }

    /// The top level of an expression.
    pub fn node(&self, expr: ExprId) -> &Node {
        &self.nodes[expr.index()]
    }

    pub fn as_number(&self, expr: ExprId) -> Option<Number> {
        match self.node(expr) {
            Node::Number(number) => Some(*number),
            _ => None,
        }
    }

    /// The value of a constant whole number.
    pub fn as_integer(&self, expr: ExprId) -> Option<i64> {
        self.as_number(expr)?.as_integer()
    }

    pub fn as_symbol(&self, expr: ExprId) -> Option<SymbolId> {
        match self.node(expr) {
            Node::Symbol(symbol) => Some(*symbol),
            _ => None,
        }
    }

    /// Splits `expr` into `coefficient * rest`; `rest` (1 of a number) has a number only where folding would overflow.
    pub fn split(&self, expr: ExprId) -> (Number, ExprId) {
        match self.node(expr) {
            Node::Number(number) => (*number, ExprId::ONE),
            Node::Product(factors) => {
                let rest = self.facts[expr.index()].rest;
                match self.as_number(factors[0]) {
                    Some(coefficient) if rest != expr => (coefficient, rest),
                    _ => (Number::ONE, expr),
                }
            }
            Node::Symbol(_) | Node::Sum(_) | Node::Power(..) | Node::Apply(..) => {
                (Number::ONE, expr)
            }
        }
    }

    /// The terms of a sum in canonical order, as `(coefficient, rest)`; anything else is one term, zero none.
    pub fn terms_of(&self, expr: ExprId) -> Vec<(Number, ExprId)> {
        if expr == ExprId::ZERO {
            return Vec::new();
        }
        let terms = self.summands_of(expr).iter();
        terms.map(|term| self.split(*term)).collect()
    }

    /// The terms of a sum in canonical order; anything else is its own only term.
    pub(super) fn summands_of(&self, expr: ExprId) -> &[ExprId] {
        match &self.nodes[expr.index()] {
            Node::Sum(terms) => terms,
            _ => std::slice::from_ref(&self.facts[expr.index()].itself),
        }
    }

    /// The factors of a product in canonical order; anything else is its own only factor.
    pub fn factors_of(&self, expr: ExprId) -> &[ExprId] {
        match &self.nodes[expr.index()] {
            Node::Product(factors) => factors,
            _ => std::slice::from_ref(&self.facts[expr.index()].itself),
        }
    }

    /// The factors of a product, each repeated by its exponent; none unless that is an integer from 0 to `most`.
    pub fn repeated_factors(&self, expr: ExprId, most: usize) -> Option<Vec<ExprId>> {
        let mut factors = Vec::new();
        for &factor in self.factors_of(expr) {
            let (base, exponent) = match self.node(factor) {
                Node::Power(base, exponent) => (*base, self.as_integer(*exponent)?),
                _ => (factor, 1),
            };
            let times = usize::try_from(exponent).ok()?;
            factors.extend((times <= most).then(|| std::iter::repeat_n(base, times))?);
        }
        Some(factors)
    }

    /// The operands of the top level, left to right.
    pub fn children(&self, expr: ExprId) -> impl Iterator<Item = ExprId> + '_ {
        let symbol = self.as_symbol(expr);
        let selection = symbol.and_then(|symbol| self.selection(symbol));
        let operands = self.node(expr).operands();
        operands.chain(selection.into_iter().flatten())
    }

    /// Every expression that occurs in `roots`, each once, operands before their users.
    pub fn reachable(&self, roots: &[ExprId]) -> Vec<ExprId> {
        self.walk(roots, |_| true, |_| true)
    }

    /// As [`reachable`](ExprPool::reachable), without expressions that fail `wanted` and those reached only through
    /// them. Operands of expressions that fail `opened` are not visited. Ids increase from operands to users, so
    /// sorting them is a topological order.
    pub(super) fn walk(
        &self,
        roots: &[ExprId],
        mut wanted: impl FnMut(ExprId) -> bool,
        opened: impl Fn(ExprId) -> bool,
    ) -> Vec<ExprId> {
        let mut seen = IdSet::default();
        let mut found = Vec::new();
        let mut stack: Vec<ExprId> = roots.to_vec();
        while let Some(expr) = stack.pop() {
            if wanted(expr) && seen.insert(expr) {
                found.push(expr);
                if opened(expr) {
                    stack.extend(self.children(expr));
                }
            }
        }
        found.sort_unstable();
        found
    }

    pub fn symbols_of(&self, expr: ExprId) -> BTreeSet<SymbolId> {
        let varying = self.walk(&[expr], |node| !self.is_constant(node), |_| true);
        (varying.into_iter().filter_map(|node| self.as_symbol(node))).collect()
    }

    pub fn is_constant(&self, expr: ExprId) -> bool {
        self.facts[expr.index()].symbols == 0
    }

    /// Whether `symbol` may occur in `expr`: exact for the pool's first 63 symbols.
    pub(super) fn may_contain(&self, expr: ExprId, symbol: SymbolId) -> bool {
        self.facts[expr.index()].symbols & symbol_bit(symbol) != 0
    }

    /// Whether the same symbols occur in both; those beyond the pool's first 63 count as one.
    pub(super) fn have_same_symbols(&self, a: ExprId, b: ExprId) -> bool {
        self.facts[a.index()].symbols == self.facts[b.index()].symbols
    }

    pub(super) fn grade(&self, expr: ExprId) -> u32 {
        self.facts[expr.index()].grade
    }

    /// Whether an expression has no negative values, or none that is zero either.
    pub(super) fn sign(&self, expr: ExprId) -> Sign {
        self.facts[expr.index()].sign
    }

    pub(super) fn intern(&mut self, node: Node) -> ExprId {
        self.work_done += 1;
        if let Some(&id) = self.ids.get(&node) {
            return id;
        }
        // Interning the rest first keeps operands at smaller ids.
        let rest = self.rest_of(&node);
        let count = u32::try_from(self.nodes.len());
        let id = ExprId(count.expect("a pool holds fewer than 2^32 expressions"));
        let facts = Facts {
            rest: rest.unwrap_or(id),
            itself: id,
            grade: self.grade_of(&node),
            symbols: self.symbols_in(&node),
            sign: self.sign_of(&node),
        };
        self.nodes.push(node.clone());
        self.facts.push(facts);
        self.ids.insert(node, id);
        id
    }

    fn rest_of(&mut self, node: &Node) -> Option<ExprId> {
        match node {
            Node::Product(factors) if self.as_number(factors[0]).is_some() => match &factors[1..] {
                [number, ..] if self.as_number(*number).is_some() => None,
                [only] => Some(*only),
                several => Some(self.intern(Node::Product(several.into()))),
            },
            _ => None,
        }
    }

    fn sign_of(&self, node: &Node) -> Sign {
        let of = |operand: &ExprId| self.sign(*operand);
        match node {
            Node::Number(number) if number.is_negative() => Sign::Any,
            Node::Number(number) if number.is_zero() => Sign::NonNegative,
            Node::Number(_) | Node::Apply(Function::Exp, _) => Sign::Positive,
            Node::Symbol(_) => Sign::Any,
            Node::Sum(terms) => match terms.iter().map(of).min() {
                Some(Sign::NonNegative) if terms.iter().map(of).max() == Some(Sign::Positive) => {
                    Sign::Positive
                }
                least => least.unwrap_or(Sign::NonNegative),
            },
            Node::Product(factors) => factors.iter().map(of).min().unwrap_or(Sign::Positive),
            Node::Power(base, exponent) => match self.as_number(*exponent) {
                Some(number) if number.is_even() || number.as_integer().is_none() => {
                    of(base).max(Sign::NonNegative)
                }
                _ => of(base),
            },
            Node::Apply(Function::Abs | Function::Sqrt, argument) => {
                of(argument).max(Sign::NonNegative)
            }
            Node::Apply(..) => Sign::Any,
        }
    }

    fn symbols_in(&self, node: &Node) -> u64 {
        let of = |expr: ExprId| self.facts[expr.index()].symbols;
        match node {
            Node::Symbol(symbol) => match self.selection(*symbol) {
                Some(parts) => parts.into_iter().fold(0, |mask, part| mask | of(part)),
                None => symbol_bit(*symbol),
            },
            _ => node.operands().fold(0, |mask, operand| mask | of(operand)),
        }
    }
}

fn symbol_bit(symbol: SymbolId) -> u64 {
    1 << symbol.index().min(63)
}
