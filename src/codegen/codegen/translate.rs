//! Programs to the text of a function's body: names and nested expressions; the tree of operations stays.

use super::printer::Printer;
use super::*;

/// Deepest nesting of operations in one expression.
const DEEPEST: usize = 48;

pub(super) struct Translator<'a> {
    pub program: &'a Program,
    pub tables: &'a mut Tables,
    pub callees: &'a [Ident],
    inputs: Vec<Parameter>,
    /// Parameters of output slots; one that is an input too (`InOut`) is assigned after everything has been read.
    pub outputs: Vec<Parameter>,
    pub locals: Namer,
    pub n_uses: Vec<usize>,
    pub spelled: Vec<Option<Text>>, // a name, an element, or an expression to be nested once
    pub printer: Printer<'a>,
    pub arrays: HashMap<Ident, Span>,
    pub copies: HashMap<Vec<ValueId>, Span>,
    pub lane: Option<Ident>,
    pub zeros: HashSet<usize>, // values that are the constant 0, or sums of nothing else
}

pub(crate) fn function(
    entry: &FunctionSpec,
    name: Ident,
    dialect: &Dialect,
    callees: &[Ident],
    tables: &mut Tables,
) -> Function {
    let mut locals = Namer::new(dialect.spelling.reserved);
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
    let slots = [&entry.program.inputs, &entry.program.outputs];
    let slots = slots.map(|slots| slots.iter().map(of_slot).collect());
    let printer = Printer::new(dialect, 1);
    let mut translator = Translator::new(&entry.program, slots, locals, tables, printer);
    translator.callees = callees;
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

/// The body of the loop over the lanes of a block of points, with elements `z_lanes[element][lane]` and so on. Nothing
/// if the program runs better point by point: it loops over tables, or calls functions that no compiler vectorises.
pub(crate) fn lanes(program: &Program, dialect: &Dialect, sines: SineCosine) -> Option<String> {
    let is_by_library = sines == SineCosine::Library && program.has(computes_angles);
    if is_by_library || !program.statements.iter().all(vectorises) {
        return None;
    }
    let mut locals = Namer::new(dialect.spelling.reserved);
    let lane = Some(locals.mint("lane"));
    for taken in ["beyond", "count", "first", "point"] {
        locals.mint(taken);
    }
    let mut parameter = |slot: &Slot, role| Parameter {
        name: locals.mint(&format!("{}_lanes", slot.name)),
        len: slot.len,
        role,
    };
    let slots = [
        (&program.inputs, Role::Input),
        (&program.outputs, Role::Output),
    ];
    let slots = slots.map(|(slots, role)| slots.iter().map(|s| parameter(s, role)).collect());
    // No statement that vectorises reads a table, so the store of tables stays empty.
    let tables = &mut Tables::new("", String::new());
    let printer = Printer::new(dialect, 3);
    let mut translator = Translator::new(program, slots, locals, tables, printer);
    translator.lane = lane;
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
        | Statement::Lanes { .. }
        | Statement::Call { .. } => false,
    }
}

impl<'a> Translator<'a> {
    fn new(
        program: &'a Program,
        [inputs, outputs]: [Vec<Parameter>; 2],
        locals: Namer,
        tables: &'a mut Tables,
        printer: Printer<'a>,
    ) -> Self {
        let mut n_uses = vec![0; program.n_values()];
        let live = program.statements.iter().zip(program.live());
        let operands = live
            .filter(|(_, live)| *live)
            .flat_map(|(s, _)| s.operands());
        let results = program.results.iter().map(|entry| entry.value);
        for value in operands.chain(results) {
            n_uses[value.index()] += 1;
        }
        let is_zero = |s: &Statement| matches!(s, Statement::Constant(c) if c.to_bits() == 0);
        let zero = program.statements.iter().position(is_zero);
        let arrays = inputs.iter().chain(&outputs);
        let whole = |p: &Parameter| (p.name.clone(), Span::whole(&p.name, p.len, true));
        Self {
            arrays: arrays.map(whole).collect(),
            spelled: vec![None; program.n_values()],
            program,
            tables,
            callees: &[],
            inputs,
            outputs,
            locals,
            n_uses,
            printer,
            copies: HashMap::new(),
            lane: None,
            zeros: HashSet::from_iter(zero.map(|zero| program.values_of(zero).start)),
        }
    }

    /// Prints all that an output depends on, ending with the assignments of the outputs.
    fn translate(&mut self) {
        let statements = self.program.statements.iter().enumerate();
        for ((position, statement), live) in statements.zip(self.program.live()) {
            if live {
                self.statement(position, statement);
            }
        }
        self.results();
    }

    fn statement(&mut self, position: usize, statement: &Statement) {
        let first = self.program.values_of(position).start;
        let dialect = self.printer.dialect;
        match statement {
            Statement::Constant(value) => self.spell(first, dialect.constant(*value)),
            Statement::Input { slot, index } => {
                let parameter = &self.inputs[*slot];
                let text = match parameter.role {
                    Role::Scalar => Text::atom(parameter.name.to_string()),
                    Role::Input | Role::Output | Role::InOut => self.parameter(parameter, *index),
                };
                self.spell(first, text);
            }
            Statement::Unary(op, a) => self.define(first, dialect.unary(*op, &self.read(*a))),
            Statement::Binary(op, a, b) => {
                let (a, b) = (self.read(*a), self.read(*b));
                self.define(first, dialect.binary(*op, &a, &b, self.lane.is_some()));
            }
            Statement::Select(operands) => {
                let operands = operands.map(|operand| self.read(operand));
                self.define(first, dialect.select(&operands));
            }
            Statement::SinCos { arguments } => self.sin_cos(first, arguments),
            Statement::Accumulate { table, weights } => self.accumulate(first, *table, weights),
            Statement::Scaled { base, groups } => self.scaled(first, base.as_deref(), groups),
            Statement::Lanes { start, terms } => self.lanes(first, *start, terms),
            Statement::Call { callee, arguments } => self.call(first, *callee, arguments),
        }
    }

    /// Element of a parameter: `array[index]`, or `array[index][lane]` in a block of lanes.
    fn parameter(&self, parameter: &Parameter, index: usize) -> Text {
        let (array, index) = (&parameter.name, &Index::fixed(index));
        match &self.lane {
            None => self.printer.dialect.element(array, index),
            Some(lane) => self
                .printer
                .dialect
                .entry(array, index, &Index::variable(lane)),
        }
    }

    /// Nests an operation into its only use, or gives it a name.
    pub(super) fn define(&mut self, value: usize, text: Text) {
        if text.depth == 0 || self.n_uses[value] <= 1 && text.depth < DEEPEST {
            self.spell(value, text);
        } else {
            self.name(value, &text);
        }
    }

    fn name(&mut self, value: usize, text: &Text) -> Text {
        let name = self.locals.mint("t");
        self.printer.let_scalar(&name, text);
        let name = Text::atom(name.to_string());
        self.spell(value, name.clone());
        name
    }

    /// A value that is mentioned more than once: a name or an element.
    pub(super) fn named(&mut self, value: ValueId) -> Text {
        let text = self.read(value);
        match text.depth {
            0 => text,
            _ => self.name(value.index(), &text),
        }
    }

    pub(super) fn spell(&mut self, value: usize, text: Text) {
        self.spelled[value] = Some(text);
    }

    pub(super) fn read(&self, value: ValueId) -> Text {
        let text = self.spelled[value.index()].clone();
        text.expect("values are defined before they are read")
    }

    pub(super) fn unused(&self) -> impl Iterator<Item = &Ident> {
        let is_read = |wanted: usize| {
            let mut statements = self.program.statements.iter().enumerate();
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

    fn results(&mut self) {
        let mut outputs = self.outputs.iter();
        let in_place = outputs.any(|output| output.role == Role::InOut);
        let mut assigned = Vec::new();
        for entry in &self.program.results {
            let output = &self.outputs[entry.slot];
            let target = self.parameter(output, entry.index);
            let mut value = self.read(entry.value);
            if value.text == target.text {
                continue;
            }
            if in_place {
                let name = self.locals.mint(&format!("{}_next", output.name));
                self.printer.let_scalar(&name, &value);
                value = Text::atom(name.to_string());
            }
            assigned.push((target, value));
        }
        for (target, value) in assigned {
            self.printer.assign(&target, &value);
        }
    }
}
