//! Programs to statements: names, what is nested into one expression, and where arrays live.
//!
//! No mathematics happens here: the tree of operations of the program is kept as it is.

use std::ops::Range;

use super::code::{Expr, Index, Infix, MathFunction, Parameter, Role, Span, Stmt};
use super::ident::{Ident, Namer};
use super::literal::Literal;
use super::tables::Tables;
use crate::ir::{Binary, Program, ResultEntry, Statement, Unary, ValueId};

/// Deepest nesting of operations in one expression.
const DEEPEST: usize = 48;

/// Arrays up to this length are copied element by element, not in loops: what reads a short
/// array wholly would wait for the stores of several loops.
const LONGEST_LIST: usize = 24;

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

/// Where the rows of a matrix of values live: `array[offset + stride * row + col]`.
pub(super) struct MatrixHome {
    pub array: Ident,
    pub offset: usize,
    pub stride: usize,
}

pub(super) struct Translator<'a> {
    pub program: &'a Program,
    pub names: Names<'a>,
    pub n_uses: Vec<usize>,
    /// How a value is read: a name, an element, or an expression to be nested once, and
    /// how deeply operations are nested in it.
    spelled: Vec<Option<(Expr, usize)>>,
    pub body: Vec<Stmt>,
    /// Values that were copied to an array.
    copies: Vec<(Vec<ValueId>, Ident)>,
    /// Loop variable of a block of lanes.
    pub lane: Option<Ident>,
}

/// Translates a program into the body of a function.
pub fn translate(program: &Program, names: Names) -> Translation {
    translate_as(program, names, None)
}

/// Translates a program into the body of a loop over the lanes of a block of points; inputs
/// and outputs are `array[element][lane]`. Nothing if the program is better run point
/// by point: it loops over tables itself, or calls functions that no compiler vectorises.
pub fn translate_lanes(program: &Program, names: Names, lane: Ident) -> Option<Vec<Stmt>> {
    let vectorises = program
        .statements()
        .iter()
        .all(|statement| match statement {
            Statement::Constant(_)
            | Statement::Input { .. }
            | Statement::Binary(..)
            | Statement::SinCos { .. } => true,
            Statement::Unary(op, _) => match op {
                Unary::Neg | Unary::Sqrt | Unary::Abs => true,
                Unary::Sign | Unary::Tan | Unary::Tanh | Unary::Exp | Unary::Log => false,
            },
            Statement::Accumulate { .. }
            | Statement::Constants { .. }
            | Statement::Separable { .. }
            | Statement::Call { .. } => false,
        });
    vectorises.then(|| translate_as(program, names, Some(lane)).body)
}

fn translate_as(program: &Program, names: Names, lane: Option<Ident>) -> Translation {
    let live = program.live();
    let mut translator = Translator {
        program,
        names,
        n_uses: n_uses(program, &live),
        spelled: vec![None; program.n_values()],
        body: Vec::new(),
        copies: Vec::new(),
        lane,
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
                    _ if self.lane.is_some() => self.lane_entry(parameter, *index),
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
            Statement::Accumulate { table, sections } => self.accumulate(first, *table, sections),
            Statement::Constants { table } => self.constants(first, *table),
            Statement::Separable {
                start,
                base,
                groups,
            } => self.separable(first, start, base.as_deref(), groups),
            Statement::Call { callee, arguments } => self.call(first, *callee, arguments),
        }
    }

    /// Element of a parameter: `array[index]`, or `array[index][lane]` in a block of lanes.
    fn lane_entry(&self, parameter: &Parameter, index: usize) -> Expr {
        let (array, index) = (parameter.name.clone(), Index::fixed(index));
        match &self.lane {
            None => Expr::Element(array, index),
            Some(lane) => Expr::Entry(array, index, Index::variable(lane)),
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

    /// A value that is mentioned more than once: a name or an element.
    pub(super) fn named(&mut self, value: ValueId) -> Expr {
        let (expr, depth) = self.read(value);
        if depth == 0 {
            return expr;
        }
        let name = self.names.locals.mint("t");
        self.body.push(Stmt::Let(name.clone(), expr));
        self.spell(value.index(), Expr::Name(name.clone()));
        Expr::Name(name)
    }

    pub(super) fn spell(&mut self, value: usize, expr: Expr) {
        self.spelled[value] = Some((expr, 0));
    }

    fn read(&self, value: ValueId) -> (Expr, usize) {
        self.spelled[value.index()]
            .clone()
            .expect("values are defined before they are read")
    }

    /// The values as contiguous elements of one array: in place if they are, copied if not.
    pub(super) fn span(&mut self, values: &[ValueId]) -> Span {
        if let Some(span) = self.contiguous(values) {
            return span;
        }
        self.copied(values)
    }

    /// The values copied to an array of their own, long runs of elements by loops.
    fn copied(&mut self, values: &[ValueId]) -> Span {
        let known = self.copies.iter().find(|(copied, _)| copied == values);
        if let Some((_, array)) = known {
            return local(array.clone(), values.len());
        }
        let array = self.names.locals.mint("a");
        self.copies.push((values.to_vec(), array.clone()));
        let runs = self.runs(values);
        if values.len() < LONGEST_LIST {
            let elements = values.iter().map(|&value| self.read(value).0).collect();
            self.body.push(Stmt::LetArray(array.clone(), elements));
            return local(array, values.len());
        }
        self.body.push(Stmt::Declare(array.clone(), values.len()));
        for run in runs {
            self.copy_run(&array, values, run);
        }
        local(array, values.len())
    }

    fn copy_run(&mut self, array: &Ident, values: &[ValueId], run: Range<usize>) {
        let from = self.read(values[run.start]).0;
        match from {
            Expr::Element(source, at) if run.len() > 1 => {
                let i = self.names.locals.mint("i");
                let target = Index::variable(&i).shifted(run.start);
                let source = Expr::Element(source, Index::variable(&i).shifted(at.offset));
                let assign = Stmt::Assign(Expr::Element(array.clone(), target), source);
                self.body.push(Stmt::For(i, run.len(), vec![assign]));
            }
            value => {
                let target = Expr::Element(array.clone(), Index::fixed(run.start));
                self.body.push(Stmt::Assign(target, value));
            }
        }
    }

    /// Divides values into runs of consecutive elements of one array.
    fn runs(&self, values: &[ValueId]) -> Vec<Range<usize>> {
        let mut runs: Vec<Range<usize>> = Vec::new();
        for (k, &value) in values.iter().enumerate() {
            let follows = k > 0
                && match (self.element(values[k - 1]), self.element(value)) {
                    (Some((before, at)), Some((array, next))) => before == array && at + 1 == next,
                    _ => false,
                };
            match runs.last_mut() {
                Some(run) if follows => run.end = k + 1,
                _ => runs.push(k..k + 1),
            }
        }
        runs
    }

    /// Array and position of a value that is an element.
    fn element(&self, value: ValueId) -> Option<(&Ident, usize)> {
        match self.spelled[value.index()].as_ref() {
            Some((Expr::Element(array, index), _)) if index.terms.is_empty() => {
                Some((array, index.offset))
            }
            _ => None,
        }
    }

    /// As [`Self::span`], but the whole of an array.
    pub(super) fn whole_span(&mut self, values: &[ValueId]) -> Span {
        match self.contiguous(values).filter(Span::is_whole) {
            Some(span) => span,
            None => self.copied(values),
        }
    }

    fn contiguous(&self, values: &[ValueId]) -> Option<Span> {
        let (array, offset) = self.element(*values.first()?)?;
        let array = array.clone();
        if self.runs(values).len() != 1 {
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
    pub(super) fn home(&mut self, first: usize, len: usize, wanted: &str) -> Span {
        match self.output_home(first, len) {
            Some(home) => self.settle(first, home),
            None => self.local_home(first, len, wanted),
        }
    }

    /// Reserves `len` elements of a new array for values.
    pub(super) fn local_home(&mut self, first: usize, len: usize, wanted: &str) -> Span {
        let array = self.names.locals.mint(wanted);
        self.body.push(Stmt::Declare(array.clone(), len));
        self.settle(first, local(array, len))
    }

    /// Spells values as the elements of a span.
    pub(super) fn settle(&mut self, first: usize, home: Span) -> Span {
        for k in 0..home.len {
            let index = Index::fixed(home.offset + k);
            self.spelled[first + k] = Some((Expr::Element(home.array.clone(), index), 0));
        }
        home
    }

    /// The output array, if the values are just a run of its elements and nothing in it is
    /// still to be read.
    pub(super) fn output_home(&self, first: usize, len: usize) -> Option<Span> {
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

    /// Reserves `rows x cols` elements for values, row by row in an output where they belong
    /// if possible.
    pub(super) fn matrix_home(&mut self, first: usize, rows: usize, cols: usize) -> MatrixHome {
        let home = self.output_matrix(first, rows, cols).unwrap_or_else(|| {
            let array = self.names.locals.mint("m");
            self.body.push(Stmt::Declare(array.clone(), rows * cols));
            MatrixHome {
                array,
                offset: 0,
                stride: cols,
            }
        });
        for r in 0..rows {
            for i in 0..cols {
                let index = Index::fixed(home.offset + home.stride * r + i);
                let element = Expr::Element(home.array.clone(), index);
                self.spelled[first + r * cols + i] = Some((element, 0));
            }
        }
        home
    }

    /// The output array in which each row is a run of elements, all equally far apart.
    fn output_matrix(&self, first: usize, rows: usize, cols: usize) -> Option<MatrixHome> {
        let results = self.program.results();
        let find = |value: usize| {
            results
                .iter()
                .position(|entry| entry.value.index() == value)
        };
        let at = find(first)?;
        let stride = if rows > 1 {
            find(first + cols)?.checked_sub(at)?
        } else {
            cols
        };
        let slot = results[at].slot;
        let output = &self.names.outputs[slot];
        let fits = (0..rows).all(|r| {
            (0..cols).all(|i| {
                results.get(at + r * stride + i).is_some_and(|entry| {
                    entry.slot == slot && entry.value.index() == first + r * cols + i
                })
            })
        });
        (fits && output.role == Role::Output).then(|| MatrixHome {
            array: output.name.clone(),
            offset: results[at].index,
            stride,
        })
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
            let target = self.lane_entry(output, entry.index);
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
