//! Entries to functions of one target.

use super::code::{Function, Parameter, Role, Stmt};
use super::dialect::Dialect;
use super::ident::{Ident, Namer};
use super::interface::{FunctionSpec, ModelInterface};
use super::requirements::calls_kernel;
use super::tables::Tables;
use super::translate::{Names, translate, translate_lanes};
use crate::ir::Slot;

/// The functions of a model in one target, with the tables that they share.
#[derive(Debug)]
pub struct ModelFunctions {
    /// Functions of the maps.
    pub maps: Vec<Function>,
    /// Per phase: dynamics, dynamics with Jacobian, step.
    pub phases: Vec<[Function; 3]>,
    /// Per phase: body of the loop over the lanes of a batch, if it runs in blocks.
    pub lanes: Vec<Option<Vec<Stmt>>>,
    /// Constant tables.
    pub tables: Tables,
}

impl ModelFunctions {
    /// Translates all entries; `prefix` begins each name.
    pub fn new(entries: &ModelInterface, dialect: &dyn Dialect, prefix: &str) -> Self {
        let mut globals = Namer::new(dialect.reserved());
        let mut tables = Tables::new(Namer::new(dialect.reserved()), &dialect.table_base(prefix));
        let mut generate = |entry: &FunctionSpec, callees: &[Ident]| {
            let name = globals.mint(&format!("{prefix}{}", entry.name));
            function(entry, name, dialect, callees, &mut tables)
        };
        let maps = entries.maps.iter().map(|map| generate(map, &[])).collect();
        let phases = entries
            .phases
            .iter()
            .map(|phase| {
                let dynamics = generate(&phase.dynamics, &[]);
                let jacobian = generate(&phase.jacobian, &[]);
                let callees = std::slice::from_ref(&dynamics.name);
                let step = generate(&phase.step, callees);
                [dynamics, jacobian, step]
            })
            .collect();
        let lanes = entries
            .phases
            .iter()
            .map(|phase| lanes(&phase.dynamics, dialect, &mut tables))
            .collect();
        Self {
            maps,
            phases,
            lanes,
            tables,
        }
    }

    /// Leaves batches with sines to single calls, for kernels that no compiler vectorises.
    pub fn sines_point_by_point(&mut self) {
        for lanes in &mut self.lanes {
            if lanes.as_deref().is_some_and(calls_kernel) {
                *lanes = None;
            }
        }
    }

    /// All functions in the order of the file.
    pub fn all(&self) -> impl Iterator<Item = &Function> {
        self.maps.iter().chain(self.phases.iter().flatten())
    }
}

/// The body of the loop over a block's lanes; arrays are called `z_lanes` and so on, the
/// loop variable `lane`.
fn lanes(entry: &FunctionSpec, dialect: &dyn Dialect, tables: &mut Tables) -> Option<Vec<Stmt>> {
    let mut locals = Namer::new(dialect.reserved());
    let lane = locals.mint("lane");
    for taken in ["beyond", "count", "first", "point"] {
        locals.mint(taken);
    }
    let mut parameters = |slots: &[Slot], role: Role| -> Vec<Parameter> {
        slots
            .iter()
            .map(|slot| Parameter {
                name: locals.mint(&format!("{}_lanes", slot.name)),
                len: slot.len,
                role,
            })
            .collect()
    };
    let inputs = parameters(entry.program.inputs(), Role::Input);
    let outputs = parameters(entry.program.outputs(), Role::Output);
    let names = Names {
        inputs: &inputs,
        outputs: &outputs,
        callees: &[],
        locals: &mut locals,
        tables,
    };
    translate_lanes(&entry.program, names, lane)
}

fn function(
    entry: &FunctionSpec,
    name: Ident,
    dialect: &dyn Dialect,
    callees: &[Ident],
    tables: &mut Tables,
) -> Function {
    let mut locals = Namer::new(dialect.reserved());
    let parameters: Vec<Parameter> = entry
        .parameters
        .iter()
        .map(|parameter| Parameter {
            name: locals.mint(&parameter.name),
            len: parameter.len,
            role: parameter.role,
        })
        .collect();
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
    let translation = translate(&entry.program, names);
    let mut unused = translation.unused;
    let empty = parameters
        .iter()
        .filter(|p| p.role == Role::Output && p.len == 0);
    unused.extend(empty.map(|p| p.name.clone()));
    Function {
        name,
        docs: entry.docs.clone(),
        parameters,
        unused,
        body: translation.body,
    }
}
