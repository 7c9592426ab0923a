//! Programs to the text of a function's body: names, and what is nested into one expression.
//!
//! No mathematics happens here: the tree of operations of the program is kept as it is.

use super::code::{Expr, Index, Parameter, Role, Span};
use super::ident::{Ident, Namer};
use super::printer::Printer;
use super::tables::Tables;
use crate::ir::{Program, Statement, ValueId};

/// Deepest nesting of operations in one expression.
const DEEPEST: usize = 48;

/// How a program's slots, callees and tables are called where it is translated.
pub(crate) struct Names<'a> {
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

/// What has become of a program.
pub(super) struct Translator<'a> {
    pub program: &'a Program,
    pub names: Names<'a>,
    pub n_uses: Vec<usize>,
    /// How a value is read: a name, an element, or an expression to be nested once, and
    /// how deeply operations are nested in it.
    pub spelled: Vec<Option<(Expr, usize)>>,
    /// Statements, ending with the assignments of the outputs.
    pub printer: Printer<'a>,
    /// All arrays: parameters, and those that the function declares.
    pub arrays: Vec<Span>,
    /// Values that were copied to an array.
    pub copies: Vec<(Vec<ValueId>, Span)>,
    /// Loop variable of a block of lanes.
    pub lane: Option<Ident>,
}

/// Translates a program into the body of a function or, with a loop variable, into the body of a loop over the
/// lanes of a block of points; inputs and outputs of the latter are `array[element][lane]`.
pub(super) fn translate<'a>(
    program: &'a Program,
    names: Names<'a>,
    printer: Printer<'a>,
    lane: Option<Ident>,
) -> Translator<'a> {
    let live = program.live();
    let parameters = names.inputs.iter().chain(names.outputs);
    let arrays = parameters.map(|parameter| Span::whole(&parameter.name, parameter.len, true));
    let mut translator = Translator {
        program,
        n_uses: n_uses(program, &live),
        spelled: vec![None; program.n_values()],
        printer,
        arrays: arrays.collect(),
        copies: Vec::new(),
        lane,
        names,
    };
    for (position, statement) in program.statements().iter().enumerate() {
        if live[position] {
            translator.statement(position, statement);
        }
    }
    translator.results();
    translator
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
            Statement::Constant(value) => self.spell(first, Expr::Literal(*value)),
            Statement::Input { slot, index } => {
                let parameter = &self.names.inputs[*slot];
                let expr = match parameter.role {
                    _ if self.lane.is_some() => self.lane_entry(parameter, *index),
                    Role::Scalar => Expr::Name(parameter.name.clone()),
                    Role::Input | Role::Output | Role::InOut => {
                        Expr::Element(parameter.name.clone(), Index::fixed(*index))
                    }
                };
                self.spell(first, expr);
            }
            Statement::Unary(op, a) => {
                let (a, depth) = self.read(*a);
                self.define(first, Expr::Unary(*op, Box::new(a)), depth + 1);
            }
            Statement::Binary(op, a, b) => {
                let ((a, left), (b, right)) = (self.read(*a), self.read(*b));
                let expr = Expr::infix(*op, a, b);
                self.define(first, expr, left.max(right) + 1);
            }
            Statement::Select(operands) => {
                let read = operands.map(|operand| self.read(operand));
                let depth = read.iter().map(|(_, depth)| depth + 1).max();
                let expr = Expr::Select(Box::new(read.map(|(expr, _)| expr)));
                self.define(first, expr, depth.unwrap_or(1));
            }
            Statement::SinCos { arguments } => self.sin_cos(first, arguments),
            Statement::Accumulate { table, weights } => self.accumulate(first, *table, weights),
            Statement::Scaled { base, groups } => self.scaled(first, base.as_deref(), groups),
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
            self.name(value, expr);
        }
    }

    fn name(&mut self, value: usize, expr: Expr) -> Expr {
        let name = self.names.locals.mint("t");
        self.printer.let_scalar(&name, &expr);
        self.spell(value, Expr::Name(name.clone()));
        Expr::Name(name)
    }

    /// A value that is mentioned more than once: a name or an element.
    pub(super) fn named(&mut self, value: ValueId) -> Expr {
        let (expr, depth) = self.read(value);
        match depth {
            0 => expr,
            _ => self.name(value.index(), expr),
        }
    }

    pub(super) fn spell(&mut self, value: usize, expr: Expr) {
        self.spelled[value] = Some((expr, 0));
    }

    pub(super) fn read(&self, value: ValueId) -> (Expr, usize) {
        self.spelled[value.index()]
            .clone()
            .expect("values are defined before they are read")
    }

    /// Input parameters that no statement mentions.
    pub(super) fn unused(&self) -> impl Iterator<Item = &Ident> {
        let is_read = |wanted: usize| {
            let mut statements = self.program.statements().iter().enumerate();
            statements.any(|(position, statement)| {
                matches!(statement, Statement::Input { slot, .. } if *slot == wanted)
                    && self.n_uses[self.program.values_of(position).start] > 0
            })
        };
        let inputs = self.names.inputs.iter().enumerate();
        inputs
            .filter(move |&(slot, input)| input.role != Role::InOut && !is_read(slot))
            .map(|(_, input)| &input.name)
    }

    /// Assigns the outputs. What replaces an input is computed completely beforehand.
    fn results(&mut self) {
        let mut outputs = self.names.outputs.iter();
        let in_place = outputs.any(|output| output.role == Role::InOut);
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
                self.printer.let_scalar(&name, &value);
                value = Expr::Name(name);
            }
            assigned.push((target, value));
        }
        for (target, value) in assigned {
            self.printer.assign(&target, &value);
        }
    }
}
