//! Programs to functions of one target.

use super::code::{Function, Parameter, Role};
use super::dialect::Dialect;
use super::ident::{Ident, Namer};
use super::interface::{FunctionSpec, computes_angles};
use super::printer::Printer;
use super::sines::SineCosine;
use super::tables::Tables;
use super::translate::{Names, translate};
use crate::ir::{Binary, Program, Slot, Statement, Unary};

/// The body of the loop over the lanes of a block of points; arrays are called `z_lanes` and so on, the
/// loop variable `lane`. Nothing if the program is better run point by point: it loops over tables itself,
/// or calls functions that no compiler vectorises.
pub(crate) fn lanes(program: &Program, dialect: &dyn Dialect, sines: SineCosine) -> Option<String> {
    let is_by_library = sines == SineCosine::Library && program.has(computes_angles);
    if is_by_library || !program.statements().iter().all(vectorises) {
        return None;
    }
    let mut locals = Namer::new(dialect.reserved());
    let lane = locals.mint("lane");
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
    let names = Names {
        inputs: &inputs,
        outputs: &outputs,
        callees: &[],
        locals: &mut locals,
        tables: &mut Tables::new(Namer::new(""), ""),
    };
    let printer = Printer::new(dialect, 3, true);
    let translator = translate(program, names, printer, Some(lane));
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

/// The function of an entry, with the functions that it calls.
pub(crate) fn function(
    entry: &FunctionSpec,
    name: Ident,
    dialect: &dyn Dialect,
    callees: &[Ident],
    tables: &mut Tables,
) -> Function {
    let mut locals = Namer::new(dialect.reserved());
    let parameter = |parameter: &Parameter<String>| Parameter {
        name: locals.mint(&parameter.name),
        len: parameter.len,
        role: parameter.role,
    };
    let parameters: Vec<Parameter> = entry.parameters.iter().map(parameter).collect();
    let of_slot = |slot: &Slot| {
        let position = entry.parameters.iter().position(|p| p.name == slot.name);
        parameters[position.expect("every slot is a parameter")].clone()
    };
    let [inputs, outputs] = [entry.program.inputs(), entry.program.outputs()]
        .map(|slots| slots.iter().map(of_slot).collect::<Vec<_>>());
    let names = Names {
        inputs: &inputs,
        outputs: &outputs,
        callees,
        locals: &mut locals,
        tables,
    };
    let printer = Printer::new(dialect, 1, false);
    let translator = translate(&entry.program, names, printer, None);
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
