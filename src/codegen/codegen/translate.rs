//! Programs to the text of a function's body: names, and what is nested into one expression.
//!
//! No mathematics happens here: the tree of operations of the program is kept as it is.

use super::code::{Expr, Function, Index, Parameter, Role, Span};
use super::dialect::Dialect;
use super::ident::{Ident, Namer};
use super::interface::{FunctionSpec, computes_angles};
use super::options::SineCosine;
use super::printer::Printer;
use super::tables::Tables;
use crate::ir::{Binary, Program, Slot, Statement, Unary, ValueId};

/// Deepest nesting of operations in one expression.
const DEEPEST: usize = 48;

pub(super) struct Translator<'a> {
    pub program: &'a Program,
    pub tables: &'a mut Tables,
    /// Function of each program that this one calls.
    pub callees: &'a [Ident],
    inputs: Vec<Parameter>,
    /// Parameter of each output slot; one that is also an input (role `InOut`) is assigned
    /// only after everything has been read.
    pub outputs: Vec<Parameter>,
    pub locals: Namer,
    pub n_uses: Vec<usize>,
    /// How a value is read: a name, an element, or an expression to be nested once, and
    /// how deeply operations are nested in it.
    pub spelled: Vec<Option<(Expr, usize)>>,
    pub printer: Printer<'a>,
    /// All arrays: parameters, and those that the function declares.
    pub arrays: Vec<Span>,
    /// Values that were copied to an array.
    pub copies: Vec<(Vec<ValueId>, Span)>,
    /// Loop variable of a block of lanes.
    pub lane: Option<Ident>,
}

/// The function of an entry, with the functions that it calls.
pub(crate) fn function(
    entry: &FunctionSpec,
    name: Ident,
    dialect: &dyn Dialect,
    callees: &[Ident],
    tables: &mut Tables,
) -> Function {
    let mut locals = Namer::new(dialect.spelling().reserved);
    let parameters = entry.parameters.iter().map(|parameter| Parameter {
        name: locals.mint(&parameter.name),
        len: parameter.len,
        role: parameter.role,
    });
    let parameters: Vec<Parameter> = parameters.collect();
    let of_slot = |slot: &Slot| {
        let position = entry.parameters.iter().position(|p| p.name == slot.name);
        parameters[position.expect("every slot is a parameter")].clone()
    };
    let mut translator = Translator {
        inputs: entry.program.inputs().iter().map(of_slot).collect(),
        outputs: entry.program.outputs().iter().map(of_slot).collect(),
        callees,
        printer: Printer::new(dialect, 1, false),
        ..Translator::new(&entry.program, locals, tables, dialect)
    };
    translator.translate();
    let is_empty = |p: &&Parameter| p.role == Role::Output && p.len == 0;
    let empty = parameters.iter().filter(is_empty).map(|p| &p.name);
    Function {
        name,
        docs: entry.docs.clone(),
        unused: translator.unused().chain(empty).cloned().collect(),
        body: translator.printer.into_text(),
        parameters,
    }
}

/// The body of the loop over the lanes of a block of points; arrays are called `z_lanes` and so on, with elements
/// `array[element][lane]`, the loop variable `lane`. Nothing if the program is better run point by point: it loops
/// over tables itself, or calls functions that no compiler vectorises.
pub(crate) fn lanes(program: &Program, dialect: &dyn Dialect, sines: SineCosine) -> Option<String> {
    let is_by_library = sines == SineCosine::Library && program.has(computes_angles);
    if is_by_library || !program.statements().iter().all(vectorises) {
        return None;
    }
    let mut locals = Namer::new(dialect.spelling().reserved);
    let lane = Some(locals.mint("lane"));
    for taken in ["beyond", "count", "first", "point"] {
        locals.mint(taken);
    }
    let mut parameters = |slots: &[Slot], role: Role| -> Vec<Parameter> {
        let parameter = |slot: &Slot| Parameter {
            name: locals.mint(&format!("{}_lanes", slot.name)),
            len: slot.len,
            role,
        };
        slots.iter().map(parameter).collect()
    };
    let inputs = parameters(program.inputs(), Role::Input);
    let outputs = parameters(program.outputs(), Role::Output);
    // No statement that vectorises reads a table, so the store of tables stays empty.
    let tables = &mut Tables::new(Namer::new(""), "");
    let mut translator = Translator {
        inputs,
        outputs,
        lane,
        ..Translator::new(program, locals, tables, dialect)
    };
    translator.translate();
    Some(translator.printer.into_text())
}

fn vectorises(statement: &Statement) -> bool {
    match statement {
        Statement::Constant(_) | Statement::Input { .. } | Statement::SinCos { .. } => true,
        Statement::Binary(op, ..) => *op != Binary::Pow,
        Statement::Unary(op, _) => *op != Unary::Sign && !op.is_by_library(),
        Statement::Select(_)
        | Statement::Accumulate { .. }
        | Statement::Scaled { .. }
        | Statement::Call { .. } => false,
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

impl<'a> Translator<'a> {
    /// Without parameters; prints the body of a loop.
    fn new(
        program: &'a Program,
        locals: Namer,
        tables: &'a mut Tables,
        dialect: &'a dyn Dialect,
    ) -> Self {
        Self {
            program,
            tables,
            callees: &[],
            inputs: Vec::new(),
            outputs: Vec::new(),
            locals,
            n_uses: n_uses(program, &program.live()),
            spelled: vec![None; program.n_values()],
            printer: Printer::new(dialect, 3, true),
            arrays: Vec::new(),
            copies: Vec::new(),
            lane: None,
        }
    }

    /// Prints all that an output depends on, ending with the assignments of the outputs.
    fn translate(&mut self) {
        for parameter in self.inputs.iter().chain(&self.outputs) {
            let array = Span::whole(&parameter.name, parameter.len, true);
            self.arrays.push(array);
        }
        let statements = self.program.statements().iter().enumerate();
        for ((position, statement), live) in statements.zip(self.program.live()) {
            if live {
                self.statement(position, statement);
            }
        }
        self.results();
    }

    fn statement(&mut self, position: usize, statement: &Statement) {
        let first = self.program.values_of(position).start;
        match statement {
            Statement::Constant(value) => self.spell(first, Expr::Literal(*value)),
            Statement::Input { slot, index } => {
                let parameter = &self.inputs[*slot];
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
        let name = self.locals.mint("t");
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
        let inputs = self.inputs.iter().enumerate();
        inputs
            .filter(move |&(slot, input)| input.role != Role::InOut && !is_read(slot))
            .map(|(_, input)| &input.name)
    }

    /// Assigns the outputs. What replaces an input is computed completely beforehand.
    fn results(&mut self) {
        let mut outputs = self.outputs.iter();
        let in_place = outputs.any(|output| output.role == Role::InOut);
        let mut assigned = Vec::new();
        for entry in self.program.results() {
            let output = &self.outputs[entry.slot];
            let target = self.lane_entry(output, entry.index);
            let (mut value, _) = self.read(entry.value);
            if value == target {
                continue;
            }
            if in_place {
                let name = self.locals.mint(&format!("{}_next", output.name));
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
