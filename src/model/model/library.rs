//! The library Theta: ordered candidate terms over `z`, `dz` and `u`, evaluated in one pass over their subexpressions.

use super::*;

pub const MAX_LATENT_DIM: usize = 64;
pub(crate) const MAX_LIBRARY_DIM: usize = 20_000;
pub const MAX_TERM_LEN: usize = 1_000;

/// A variable of candidate terms; indices count from 0, names in files from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LatentVariable {
    /// Latent coordinate, `z1` for index 0.
    Z(usize),
    Dz(usize),
    U(usize),
}

/// The kinds in the order of [`LatentVariable::all`], with their names.
const KINDS: [(&str, fn(usize) -> LatentVariable); 3] = [
    ("z", LatentVariable::Z),
    ("dz", LatentVariable::Dz),
    ("u", LatentVariable::U),
];

impl LatentVariable {
    pub fn from_name(name: &str, latent_dim: usize) -> Option<Self> {
        let digits_at = name.find(|c: char| c.is_ascii_digit())?;
        let (kind, digits) = name.split_at(digits_at);
        let canonical = !digits.starts_with('0') && digits.bytes().all(|b| b.is_ascii_digit());
        let number: usize = digits.parse().ok().filter(|_| canonical)?;
        let index = number.checked_sub(1).filter(|&index| index < latent_dim)?;
        let (_, variable) = KINDS.iter().find(|(known, _)| *known == kind)?;
        Some(variable(index))
    }

    fn parts(self) -> (usize, usize) {
        match self {
            LatentVariable::Z(index) => (0, index),
            LatentVariable::Dz(index) => (1, index),
            LatentVariable::U(index) => (2, index),
        }
    }

    pub fn place(self, latent_dim: usize) -> Option<usize> {
        let (kind, index) = self.parts();
        (index < latent_dim).then_some(kind * latent_dim + index)
    }

    pub fn all(latent_dim: usize) -> impl Iterator<Item = Self> {
        (KINDS.into_iter()).flat_map(move |(_, variable)| (0..latent_dim).map(variable))
    }
}

impl Serialize for LatentVariable {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.collect_str(self)
    }
}

impl fmt::Display for LatentVariable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (kind, index) = self.parts();
        write!(f, "{}{}", KINDS[kind].0, index + 1)
    }
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CandidateTerm {
    /// In the syntax of the model file.
    pub text: String,
    pub expr: ExprId,
}

/// The terms of a library as they are given; the model file keeps the form.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(untagged)]
pub enum LibraryChoice {
    Terms(Vec<String>),
    Standard(StandardLibrary),
}

/// Candidate terms in order, over `z1..zd`, `dz1..dzd`, `u1..ud`.
#[derive(Clone, Debug)]
pub struct Library {
    latent_dim: usize,
    standard: Option<StandardLibrary>,
    pool: ExprPool,
    symbols: Vec<SymbolId>,
    terms: Vec<CandidateTerm>,
    tape: Tape,
}

impl Library {
    pub fn from_terms(latent_dim: usize, texts: &[String]) -> Result<Self> {
        Self::of(latent_dim, LibraryChoice::Terms(texts.to_vec()))
    }

    /// Refuses terms that are zero everywhere or have a constant part beyond the range of floats.
    pub fn of(latent_dim: usize, choice: LibraryChoice) -> Result<Self> {
        check_count("`latent_dim`", latent_dim, "", 1..=MAX_LATENT_DIM)?;
        let (texts, standard) = match choice {
            LibraryChoice::Terms(texts) => (texts, None),
            LibraryChoice::Standard(standard) => (standard.texts(latent_dim)?, Some(standard)),
        };
        check(!texts.is_empty(), "`library`", || "no term", "at least one")?;
        check_term_count(texts.len())?;
        let mut pool = ExprPool::new();
        let symbols: Vec<SymbolId> = LatentVariable::all(latent_dim)
            .map(|variable| pool.symbol_id(&variable.to_string()))
            .collect();
        let mut terms: Vec<CandidateTerm> = Vec::with_capacity(texts.len());
        for (index, text) in texts.into_iter().enumerate() {
            let expr = parse_term(&mut pool, latent_dim, index, &text)?;
            terms.push(CandidateTerm { text, expr });
        }
        let exprs: Vec<ExprId> = terms.iter().map(|term| term.expr).collect();
        let tape = Tape::new(&pool, &exprs, &symbols);
        Ok(Self {
            latent_dim,
            standard,
            pool,
            symbols,
            terms,
            tape,
        })
    }

    /// Refuses terms that are equal: their coefficients cannot be learned.
    pub fn check_distinct(&self) -> Result<()> {
        let mut first_use = HashMap::new();
        for (second, term) in self.terms.iter().enumerate() {
            if let Some(first) = first_use.insert(term.expr, second) {
                let (place, earlier) = (place(second), &self.terms[first].text);
                let found = format!("{:?}, which equals [{first}] {earlier:?}", term.text);
                return Err(ModelError::invalid(place, found, "different terms"));
            }
        }
        Ok(())
    }

    pub fn tape(&self) -> &Tape {
        &self.tape
    }

    pub fn latent_dim(&self) -> usize {
        self.latent_dim
    }

    pub fn choice(&self) -> LibraryChoice {
        let texts = || self.terms.iter().map(|term| term.text.clone()).collect();
        let standard = self.standard.map(LibraryChoice::Standard);
        standard.unwrap_or_else(|| LibraryChoice::Terms(texts()))
    }

    /// The standard library of the same terms, and for each of its terms in romc's order the row of this one.
    pub fn as_standard(&self) -> Option<(StandardLibrary, Vec<usize>)> {
        if let Some(standard) = self.standard {
            return Some((standard, (0..self.terms.len()).collect()));
        }
        let mut pool = self.pool.clone();
        let rows = self.terms.iter().map(|term| term.expr).zip(0..);
        let rows: HashMap<ExprId, usize> = rows.collect();
        StandardLibrary::small().find_map(|standard| {
            if standard.term_count(self.latent_dim) != Some(rows.len().max(self.terms.len())) {
                return None;
            }
            let texts = standard.texts(self.latent_dim).ok()?;
            let of = |text: String| rows.get(&pool.parse(&text, &|_| true).ok()?).copied();
            let rows: Option<Vec<usize>> = texts.into_iter().map(of).collect();
            Some((standard, rows?))
        })
    }

    pub fn terms(&self) -> &[CandidateTerm] {
        &self.terms
    }

    /// The pool in which the terms live. Clone it to build on them: ids stay valid in the clone.
    pub fn pool(&self) -> &ExprPool {
        &self.pool
    }

    pub fn symbol(&self, variable: LatentVariable) -> Option<SymbolId> {
        Some(self.symbols[variable.place(self.latent_dim)?])
    }

    /// Theta at one point: the value of each term, in order.
    pub fn evaluate(
        &self,
        z: &DVector<f64>,
        dz: &DVector<f64>,
        u_lat: &DVector<f64>,
    ) -> Result<DVector<f64>> {
        let d = self.latent_dim;
        ModelError::check_dimension("latent state z", z.len(), d)?;
        ModelError::check_dimension("latent velocity dz", dz.len(), d)?;
        ModelError::check_dimension("latent input u_lat", u_lat.len(), d)?;
        let point = z.iter().chain(dz).chain(u_lat).copied();
        let theta = self.evaluate_points(&DMatrix::from_iterator(3 * d, 1, point))?;
        Ok(theta.transpose().column(0).into_owned())
    }

    /// Theta at many points, one per row, of one point per column: `z`, then `dz`, then `u_lat`.
    pub fn evaluate_points(&self, variables: &DMatrix<f64>) -> Result<DMatrix<f64>> {
        let expected = (3 * self.latent_dim, variables.ncols());
        check_shape("z, dz, u_lat", variables.shape(), expected)?;
        let mut values = vec![0.0; self.tape.steps.len()];
        let mut theta = vec![0.0; self.terms.len()];
        let mut all = DMatrix::zeros(variables.ncols(), self.terms.len());
        for (point, mut row) in variables.column_iter().zip(all.row_iter_mut()) {
            self.tape.run(point.as_slice(), &mut values, &mut theta);
            row.copy_from_slice(&theta);
        }
        Ok(all)
    }
}

impl PartialEq for Library {
    fn eq(&self, other: &Self) -> bool {
        self.latent_dim == other.latent_dim
            && self.standard == other.standard
            && (self.terms.iter().map(|term| &term.text))
                .eq(other.terms.iter().map(|term| &term.text))
    }
}

pub(super) fn check_term_count(found: usize) -> Result<()> {
    let expected = format!("at most {MAX_LIBRARY_DIM}");
    let fits = found <= MAX_LIBRARY_DIM;
    check(fits, "`library`", || format!("{found} terms"), expected)
}

fn place(index: usize) -> String {
    format!("`library`[{index}]")
}

fn parse_term(pool: &mut ExprPool, latent_dim: usize, index: usize, text: &str) -> Result<ExprId> {
    if text.len() > MAX_TERM_LEN || text.chars().any(char::is_control) {
        let found = format!("{} bytes or a control character", text.len());
        let expected = format!("one line of at most {MAX_TERM_LEN} bytes");
        return Err(ModelError::invalid(place(index), found, expected));
    }
    let known = |name: &str| LatentVariable::from_name(name, latent_dim).is_some();
    let read = pool.parse_defined(text, &known, &|_, _| None);
    let reading = read.map_err(|source| ModelError::Term {
        index,
        text: text.to_owned(),
        source: Box::new(source),
    })?;
    let expected = if reading.expr == ExprId::ZERO {
        "a term that is not zero everywhere"
    } else if !constants_are_finite(pool, reading.expr) {
        "constant parts with values that floats hold (up to 1.8e308)"
    } else {
        return Ok(reading.expr);
    };
    let found = format!("{text:?}");
    Err(ModelError::invalid(place(index), found, expected))
}

fn constants_are_finite(pool: &ExprPool, expr: ExprId) -> bool {
    let parts = pool.reachable(&[expr]).into_iter();
    let constants: Vec<ExprId> = parts.filter(|&part| pool.is_constant(part)).collect();
    let values = pool.evaluate_all(&constants, &|_| f64::NAN);
    values.into_iter().all(f64::is_finite)
}

/// The terms of a library as steps, each of which reads the results of earlier ones.
#[derive(Clone, Debug)]
pub struct Tape {
    pub steps: Vec<Step>,
    pub terms: Vec<usize>,
}

/// One operation; operands are positions of earlier steps.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    Number(f64),
    /// Index into the variables: z, then dz, then u.
    Variable(usize),
    Sum(Vec<usize>),
    Product(Vec<usize>),
    Integer(usize, i32),
    Power(usize, usize),
    /// Followed by the cosine of the same argument, which may be computed with it.
    Sine(usize),
    Cosine(usize),
    Apply(Function, usize),
}

impl Tape {
    pub(crate) fn new(pool: &ExprPool, terms: &[ExprId], symbols: &[SymbolId]) -> Self {
        let mut builder = Builder {
            pool,
            symbols,
            seen: BTreeMap::new(),
            sines: BTreeMap::new(),
            steps: Vec::new(),
        };
        let terms = terms.iter().map(|&term| builder.step(term)).collect();
        Self {
            steps: builder.steps,
            terms,
        }
    }

    /// `values` is scratch space, one entry per step. Integer powers are multiplication chains, as everywhere in romc.
    pub(crate) fn run(&self, variables: &[f64], values: &mut [f64], theta: &mut [f64]) {
        for (index, step) in self.steps.iter().enumerate() {
            values[index] = match step {
                Step::Number(value) => *value,
                Step::Variable(variable) => variables[*variable],
                Step::Sum(operands) => operands.iter().map(|&term| values[term]).sum(),
                Step::Product(operands) => operands.iter().map(|&factor| values[factor]).product(),
                Step::Integer(base, exponent) => integer_power(values[*base], (*exponent).into()),
                Step::Power(base, exponent) => values[*base].powf(values[*exponent]),
                Step::Sine(argument) => Function::Sin.evaluate(values[*argument]),
                Step::Cosine(argument) => Function::Cos.evaluate(values[*argument]),
                Step::Apply(function, argument) => function.evaluate(values[*argument]),
            };
        }
        for (value, &step) in theta.iter_mut().zip(&self.terms) {
            *value = values[step];
        }
    }
}

struct Builder<'a> {
    pool: &'a ExprPool,
    symbols: &'a [SymbolId],
    seen: BTreeMap<ExprId, usize>,
    sines: BTreeMap<usize, usize>, // by the step of their argument
    steps: Vec<Step>,
}

impl Builder<'_> {
    fn step(&mut self, expression: ExprId) -> usize {
        if let Some(&known) = self.seen.get(&expression) {
            return known;
        }
        let step = match self.pool.node(expression) {
            Node::Number(number) => Step::Number(number.to_f64()),
            Node::Symbol(symbol) => {
                let known = self.symbols.iter().position(|known| known == symbol);
                Step::Variable(known.expect("terms mention the library's variables only"))
            }
            Node::Sum(parts) => Step::Sum(self.all(parts)),
            Node::Product(parts) => Step::Product(self.all(parts)),
            Node::Power(base, exponent) => {
                let base = self.step(*base);
                let integer = self.pool.as_number(*exponent).and_then(Number::as_integer);
                match integer.and_then(|integer| i32::try_from(integer).ok()) {
                    Some(integer) => Step::Integer(base, integer),
                    None => Step::Power(base, self.step(*exponent)),
                }
            }
            Node::Apply(function @ (Function::Sin | Function::Cos), argument) => {
                let sine = self.sine(*argument);
                let step = sine + usize::from(*function == Function::Cos);
                self.seen.insert(expression, step);
                return step;
            }
            Node::Apply(function, argument) => Step::Apply(*function, self.step(*argument)),
        };
        self.steps.push(step);
        self.seen.insert(expression, self.steps.len() - 1);
        self.steps.len() - 1
    }

    fn all(&mut self, parts: &[ExprId]) -> Vec<usize> {
        parts.iter().map(|&part| self.step(part)).collect()
    }

    /// Sine and cosine of one argument stand next to each other, whichever of them the library has.
    fn sine(&mut self, argument: ExprId) -> usize {
        let argument = self.step(argument);
        *self.sines.entry(argument).or_insert_with(|| {
            let both = [Step::Sine(argument), Step::Cosine(argument)];
            self.steps.extend(both);
            self.steps.len() - 2
        })
    }
}
