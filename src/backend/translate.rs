//! Programs to statements: names, what is nested into one expression, and where arrays live.
//!
//! No mathematics happens here: the tree of operations of the program is kept as it is.

use super::code::{
    Argument, ConstTable, Expr, Index, Infix, MathFunction, Parameter, Role, Span, Stmt,
};
use super::ident::{Ident, Namer};
use super::literal::Literal;
use crate::ir::{Binary, Program, ResultEntry, Statement, Table, TableId, Unary, ValueId};

/// Deepest nesting of operations in one expression.
const DEEPEST: usize = 48;

/// The statements of a program.
pub struct Translation {
    /// Statements, ending with the assignments of the outputs.
    pub body: Vec<Stmt>,
    /// Parameters that no statement mentions.
    pub unused: Vec<Ident>,
}

/// How a program's slots, callees and tables are called where it is translated.
pub struct Names<'a> {
    /// Parameter of each input slot.
    pub inputs: &'a [Parameter],
    /// Parameter of each output slot; one that is also an input (role `InOut`) is assigned
    /// only after everything has been read.
    pub outputs: &'a [Parameter],
    /// Function of each program that it calls.
    pub callees: &'a [Ident],
    /// Names for the local variables.
    pub locals: &'a mut Namer,
    /// Tables, which live outside of the function.
    pub tables: &'a mut Tables,
}

/// The constant tables of a file; equal tables are stored once.
#[derive(Debug)]
pub struct Tables {
    namer: Namer,
    base: String,
    known: Vec<(Table, ConstTable)>,
}

impl Tables {
    /// No table yet; names begin with `base`.
    pub fn new(namer: Namer, base: &str) -> Self {
        Self {
            namer,
            base: base.to_owned(),
            known: Vec::new(),
        }
    }

    /// All tables, in the order of their first use.
    pub fn iter(&self) -> impl Iterator<Item = &ConstTable> {
        self.known.iter().map(|(_, table)| table)
    }

    fn name(&mut self, table: &Table) -> Ident {
        if let Some((_, known)) = self.known.iter().find(|(known, _)| known == table) {
            return known.name.clone();
        }
        let name = self
            .namer
            .mint(&format!("{}_{}", self.base, self.known.len()));
        let literal = |&value| Literal::new(value).expect("tables of programs are finite");
        let printed = ConstTable {
            name: name.clone(),
            rows: table.rows(),
            cols: table.cols(),
            entries: table.entries().iter().map(literal).collect(),
        };
        self.known.push((table.clone(), printed));
        name
    }
}

struct Translator<'a> {
    program: &'a Program,
    names: Names<'a>,
    n_uses: Vec<usize>,
    /// How a value is read: a name, an element, or an expression to be nested once, and
    /// how deeply operations are nested in it.
    spelled: Vec<Option<(Expr, usize)>>,
    body: Vec<Stmt>,
}

/// Translates a program into the body of a function.
pub fn translate(program: &Program, names: Names) -> Translation {
    let live = program.live();
    let mut translator = Translator {
        program,
        names,
        n_uses: n_uses(program, &live),
        spelled: vec![None; program.n_values()],
        body: Vec::new(),
    };
    for (position, statement) in program.statements().iter().enumerate() {
        if live[position] {
            translator.statement(position, statement);
        }
    }
    translator.results();
    let unused = translator.unused(&live);
    Translation {
        body: translator.body,
        unused,
    }
}

fn n_uses(program: &Program, live: &[bool]) -> Vec<usize> {
    let mut n_uses = vec![0; program.n_values()];
    let statements = program.statements().iter().zip(live);
    let operands = statements
        .filter(|&(_, live)| *live)
        .flat_map(|(statement, _)| statement.operands());
    let results = program.results().iter().map(|entry| entry.value);
    for value in operands.chain(results) {
        n_uses[value.index()] += 1;
    }
    n_uses
}

impl Translator<'_> {
    fn statement(&mut self, position: usize, statement: &Statement) {
        let first = self.program.values_of(position).start;
        match statement {
            Statement::Constant(value) => {
                let literal = Literal::new(*value).expect("constants of programs are finite");
                self.spelled[first] = Some((Expr::Literal(literal), 0));
            }
            Statement::Input { slot, index } => {
                let parameter = &self.names.inputs[*slot];
                let expr = match parameter.role {
                    Role::Scalar => Expr::Name(parameter.name.clone()),
                    Role::Input | Role::Output | Role::InOut => {
                        Expr::Element(parameter.name.clone(), Index::fixed(*index))
                    }
                };
                self.spelled[first] = Some((expr, 0));
            }
            Statement::Unary(op, a) => {
                let (a, depth) = self.read(*a);
                let a = Box::new(a);
                let expr = match math_function(*op) {
                    Some(function) => Expr::Apply(function, a),
                    None => Expr::Negate(a),
                };
                self.define(first, expr, depth + 1);
            }
            Statement::Binary(op, a, b) => {
                let ((a, left), (b, right)) = (self.read(*a), self.read(*b));
                let expr = Expr::infix(infix(*op), a, b);
                self.define(first, expr, left.max(right) + 1);
            }
            Statement::SinCos { arguments } => self.sin_cos(first, arguments),
            Statement::Accumulate { table, weights } => self.accumulate(first, *table, weights),
            Statement::ScaleColumns { offset, scaled } => {
                self.scale_columns(first, *offset, scaled);
            }
            Statement::Call { callee, arguments } => self.call(first, *callee, arguments),
        }
    }

    /// Nests an operation into its only use, or gives it a name.
    fn define(&mut self, value: usize, expr: Expr, depth: usize) {
        if self.n_uses[value] <= 1 && depth < DEEPEST {
            self.spelled[value] = Some((expr, depth));
        } else {
            let name = self.names.locals.mint("t");
            self.body.push(Stmt::Let(name.clone(), expr));
            self.spelled[value] = Some((Expr::Name(name), 0));
        }
    }

    fn read(&self, value: ValueId) -> (Expr, usize) {
        self.spelled[value.index()]
            .clone()
            .expect("values are defined before they are read")
    }

    /// The values as contiguous elements of one array: in place if they are, copied if not.
    fn span(&mut self, values: &[ValueId]) -> Span {
        if let Some(span) = self.contiguous(values) {
            return span;
        }
        self.copied(values)
    }

    fn copied(&mut self, values: &[ValueId]) -> Span {
        let elements = values.iter().map(|&value| self.read(value).0).collect();
        let array = self.names.locals.mint("a");
        self.body.push(Stmt::LetArray(array.clone(), elements));
        local(array, values.len())
    }

    /// As [`Self::span`], but the whole of an array.
    fn whole_span(&mut self, values: &[ValueId]) -> Span {
        match self.contiguous(values).filter(Span::is_whole) {
            Some(span) => span,
            None => self.copied(values),
        }
    }

    fn contiguous(&self, values: &[ValueId]) -> Option<Span> {
        let element = |value: &ValueId| match self.spelled[value.index()].as_ref() {
            Some((Expr::Element(array, index), _)) if index.terms.is_empty() => {
                Some((array.clone(), index.offset))
            }
            _ => None,
        };
        let (array, offset) = element(values.first()?)?;
        let in_place = values
            .iter()
            .enumerate()
            .all(|(k, value)| element(value) == Some((array.clone(), offset + k)));
        if !in_place {
            return None;
        }
        let parameters = self.names.inputs.iter().chain(self.names.outputs);
        let parameter = parameters.clone().find(|parameter| parameter.name == array);
        let declared = self.body.iter().find_map(|statement| match statement {
            Stmt::Declare(name, len) if *name == array => Some(*len),
            _ => None,
        });
        Some(Span {
            array,
            offset,
            len: values.len(),
            of: declared.or(parameter.map(|parameter| parameter.len))?,
            is_parameter: parameter.is_some(),
        })
    }

    /// Reserves `len` elements for values, in an output where they belong if possible.
    fn home(&mut self, first: usize, len: usize, wanted: &str) -> Span {
        match self.output_home(first, len) {
            Some(home) => self.settle(first, home),
            None => self.local_home(first, len, wanted),
        }
    }

    /// Reserves `len` elements of a new array for values.
    fn local_home(&mut self, first: usize, len: usize, wanted: &str) -> Span {
        let array = self.names.locals.mint(wanted);
        self.body.push(Stmt::Declare(array.clone(), len));
        self.settle(first, local(array, len))
    }

    /// Spells values as the elements of a span.
    fn settle(&mut self, first: usize, home: Span) -> Span {
        for k in 0..home.len {
            let index = Index::fixed(home.offset + k);
            self.spelled[first + k] = Some((Expr::Element(home.array.clone(), index), 0));
        }
        home
    }

    /// The output array, if the values are just a run of its elements and nothing in it is
    /// still to be read.
    fn output_home(&self, first: usize, len: usize) -> Option<Span> {
        let results = self.program.results();
        let at = results
            .iter()
            .position(|entry| entry.value.index() == first)?;
        let run: &[ResultEntry] = results.get(at..at + len)?;
        let slot = run[0].slot;
        let fits = run
            .iter()
            .enumerate()
            .all(|(k, entry)| entry.slot == slot && entry.value.index() == first + k);
        let output = &self.names.outputs[slot];
        (fits && output.role == Role::Output).then(|| Span {
            array: output.name.clone(),
            offset: run[0].index,
            len,
            of: output.len,
            is_parameter: true,
        })
    }

    fn sin_cos(&mut self, first: usize, arguments: &[ValueId]) {
        let n = arguments.len();
        let arguments = self.span(arguments);
        let sines = self.local_home(first, n, "s");
        let cosines = self.local_home(first + n, n, "c");
        self.body.push(Stmt::SinCos {
            arguments,
            sines,
            cosines,
        });
    }

    fn table(&mut self, id: TableId) -> Ident {
        self.names.tables.name(&self.program.tables()[id.index()])
    }

    fn accumulate(&mut self, first: usize, table: TableId, weights: &[ValueId]) {
        let cols = self.program.tables()[table.index()].cols();
        let name = self.table(table);
        let weights_at = (!weights.is_empty()).then(|| self.span(weights));
        let home = self.home(first, cols, "y");
        let (i, k) = (self.names.locals.mint("i"), self.names.locals.mint("k"));
        let target = |home: &Span| {
            Expr::Element(home.array.clone(), Index::variable(&i).shifted(home.offset))
        };
        let entry = |row: Index| Expr::Entry(name.clone(), row, Index::variable(&i));
        let offset = Stmt::Assign(target(&home), entry(Index::fixed(0)));
        self.body.push(Stmt::For(i.clone(), cols, vec![offset]));
        let Some(w) = weights_at else { return };
        let product = |row: Index| {
            let weight = Expr::Element(w.array.clone(), row.clone().shifted(w.offset));
            Expr::infix(Infix::Mul, entry(row.shifted(1)), weight)
        };
        let add = |value| Stmt::For(i.clone(), cols, vec![Stmt::AddAssign(target(&home), value)]);
        let blocks = weights.len() / 4;
        if blocks > 0 {
            let row = |n: usize| product(Index::fixed(n).plus(4, &k));
            let front = Expr::infix(Infix::Add, row(0), row(1));
            let back = Expr::infix(Infix::Add, row(2), row(3));
            let sum = Expr::infix(Infix::Add, front, back);
            self.body.push(Stmt::For(k.clone(), blocks, vec![add(sum)]));
        }
        for row in 4 * blocks..weights.len() {
            self.body.push(add(product(Index::fixed(row))));
        }
    }

    fn scale_columns(&mut self, first: usize, offset: TableId, scaled: &[(TableId, Vec<ValueId>)]) {
        let shape = &self.program.tables()[offset.index()];
        let (rows, cols) = (shape.rows(), shape.cols());
        let offset = self.table(offset);
        let scaled: Vec<(Ident, Span)> = scaled
            .iter()
            .map(|(table, weights)| (self.table(*table), self.span(weights)))
            .collect();
        let home = self.home(first, rows * cols, "y");
        let (r, i) = (self.names.locals.mint("r"), self.names.locals.mint("i"));
        let entry = |table: Ident| Expr::Entry(table, Index::variable(&r), Index::variable(&i));
        let mut sum = entry(offset);
        for (table, weights) in scaled {
            let index = Index::variable(&i).shifted(weights.offset);
            let weight = Expr::Element(weights.array, index);
            let product = Expr::infix(Infix::Mul, entry(table), weight);
            sum = Expr::infix(Infix::Add, sum, product);
        }
        let index = Index::fixed(home.offset).plus(cols, &r).plus(1, &i);
        let assign = Stmt::Assign(Expr::Element(home.array, index), sum);
        let inner = Stmt::For(i, cols, vec![assign]);
        self.body.push(Stmt::For(r, rows, vec![inner]));
    }

    fn call(&mut self, first: usize, callee: usize, arguments: &[ValueId]) {
        let program = &self.program.callees()[callee];
        let mut passed = Vec::new();
        let mut rest = arguments;
        for slot in program.inputs() {
            let (these, others) = rest.split_at(slot.len);
            passed.push(Argument::Read(self.whole_span(these)));
            rest = others;
        }
        let mut next = first;
        for slot in program.outputs() {
            let home = self.output_home(next, slot.len).filter(Span::is_whole);
            let home = match home {
                Some(home) => self.settle(next, home),
                None => self.local_home(next, slot.len, &slot.name),
            };
            passed.push(Argument::Write(home));
            next += slot.len;
        }
        let callee = self.names.callees[callee].clone();
        self.body.push(Stmt::Call(callee, passed));
    }

    /// Input parameters without a live element, and outputs without elements.
    fn unused(&self, live: &[bool]) -> Vec<Ident> {
        let statements = || self.program.statements().iter().zip(live);
        let is_read = |slot: usize| {
            statements().any(|(statement, &live)| {
                live && matches!(statement, Statement::Input { slot: read, .. } if *read == slot)
            })
        };
        let inputs = self.names.inputs.iter().enumerate();
        inputs
            .filter(|&(slot, input)| input.role != Role::InOut && !is_read(slot))
            .map(|(_, input)| input.name.clone())
            .collect()
    }

    /// Assigns the outputs. What replaces an input is computed completely beforehand.
    fn results(&mut self) {
        let in_place = self
            .names
            .outputs
            .iter()
            .any(|output| output.role == Role::InOut);
        let mut assigned = Vec::new();
        for entry in self.program.results() {
            let output = &self.names.outputs[entry.slot];
            let target = Expr::Element(output.name.clone(), Index::fixed(entry.index));
            let (mut value, _) = self.read(entry.value);
            if value == target {
                continue;
            }
            if in_place {
                let name = self.names.locals.mint(&format!("{}_next", output.name));
                self.body.push(Stmt::Let(name.clone(), value));
                value = Expr::Name(name);
            }
            assigned.push(Stmt::Assign(target, value));
        }
        self.body.extend(assigned);
    }
}

/// All of a local array.
fn local(array: Ident, len: usize) -> Span {
    Span {
        array,
        offset: 0,
        len,
        of: len,
        is_parameter: false,
    }
}

fn infix(op: Binary) -> Infix {
    match op {
        Binary::Add => Infix::Add,
        Binary::Sub => Infix::Sub,
        Binary::Mul => Infix::Mul,
        Binary::Div => Infix::Div,
    }
}

fn math_function(op: Unary) -> Option<MathFunction> {
    match op {
        Unary::Neg => None,
        Unary::Sqrt => Some(MathFunction::Sqrt),
        Unary::Abs => Some(MathFunction::Abs),
        Unary::Sign => Some(MathFunction::Sign),
        Unary::Tan => Some(MathFunction::Tan),
        Unary::Tanh => Some(MathFunction::Tanh),
        Unary::Exp => Some(MathFunction::Exp),
        Unary::Log => Some(MathFunction::Log),
    }
}
