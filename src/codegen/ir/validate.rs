//! What every program promises, checked once when it is built.

use super::program::{Program, Statement, Table, TableId, ValueId};

/// Why a program is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("program `{program}`: {fault}")]
pub struct IrError {
    program: String,
    fault: String,
}

/// Checks definitions before uses, finite constants, table shapes and slots.
///
/// # Errors
/// The first promise that is broken, in schedule order.
pub(crate) fn validate(program: &Program) -> Result<(), IrError> {
    faults(program).map_err(|fault| IrError {
        program: program.name.clone(),
        fault,
    })
}

fn faults(program: &Program) -> Result<(), String> {
    for slots in [&program.inputs, &program.outputs] {
        for (position, slot) in slots.iter().enumerate() {
            let is_twice = slots[..position].iter().any(|s| s.name == slot.name);
            if slot.len == 0 || is_twice {
                return Err(format!("the array `{}` is empty or named twice", slot.name));
            }
        }
    }
    for (position, statement) in program.statements.iter().enumerate() {
        check_operands(program, position, statement)
            .and_then(|()| check_shape(program, statement))
            .map_err(|fault| format!("statement {position} {fault}"))?;
    }
    let expected: usize = program.outputs.iter().map(|slot| slot.len).sum();
    let found = program.results.len();
    if found != expected {
        return Err(format!("{found} results for {expected} output elements"));
    }
    let end = program.statements.len();
    let mut values = program.results.iter().map(|entry| entry.value);
    values
        .try_for_each(|value| check_value(program, end, value))
        .map_err(|fault| format!("statement {end} {fault}"))
}

fn check_value(program: &Program, position: usize, value: ValueId) -> Result<(), String> {
    match value.0 < program.first[position] {
        true => Ok(()),
        false => Err(format!("reads value {}, defined only later", value.index())),
    }
}

fn check_operands(program: &Program, position: usize, statement: &Statement) -> Result<(), String> {
    for value in statement.operands() {
        check_value(program, position, value)?;
    }
    match *statement {
        Statement::Input { slot, index }
            if (program.inputs.get(slot)).is_none_or(|input| index >= input.len) =>
        {
            Err(format!("reads element {index} of input {slot}"))
        }
        _ => Ok(()),
    }
}

fn check_shape(program: &Program, statement: &Statement) -> Result<(), String> {
    let count = |found: usize, expected: usize| match found == expected {
        true => Ok(()),
        false => Err(format!("has {found} operands, expected {expected}")),
    };
    let finite = |values: &[f64]| match values.iter().find(|value| !value.is_finite()) {
        None => Ok(()),
        Some(value) => Err(format!("holds the non-finite constant {value}")),
    };
    let table = |id: &TableId| -> Result<&Table, String> {
        let table = &program.tables[id.index()];
        finite(&table.entries).map(|()| table)
    };
    match statement {
        Statement::Constant(value) => finite(&[*value]),
        Statement::Accumulate { table: id, weights } => count(weights.len() + 1, table(id)?.rows),
        Statement::Scaled { base, groups } => {
            let shape = table(&groups[0].0)?;
            if let Some(base) = base {
                count(base.len(), shape.entries.len())?;
            }
            for (id, weights) in groups {
                count(table(id)?.rows, shape.rows)?;
                count(table(id)?.cols, shape.cols)?;
                count(weights.as_ref().map_or(shape.cols, Vec::len), shape.cols)?;
            }
            Ok(())
        }
        Statement::Call { callee, arguments } => {
            let inputs = &program.callees[*callee].inputs;
            count(arguments.len(), inputs.iter().map(|slot| slot.len).sum())
        }
        Statement::Input { .. }
        | Statement::Unary(..)
        | Statement::Binary(..)
        | Statement::Select(_)
        | Statement::SinCos { .. } => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::super::ProgramBuilder;
    use super::*;

    #[test]
    fn program_that_breaks_a_promise_is_refused() {
        let refused = |expected: &str, build: fn(&mut ProgramBuilder)| {
            let mut builder = ProgramBuilder::new("p");
            build(&mut builder);
            let error = builder.finish().expect_err(expected);
            assert_eq!(error.to_string(), format!("program `p`: {expected}"));
        };
        refused("statement 0 holds the non-finite constant inf", |builder| {
            let value = builder.constant(f64::INFINITY);
            builder.output("y", &[value]);
        });
        // Values of another program.
        refused("statement 1 reads value 2, defined only later", |builder| {
            let values = ProgramBuilder::new("other").input("x", 3);
            builder.input("x", 1);
            let sum = builder.add(values[0], values[2]);
            builder.output("y", &[sum]);
        });
        refused("statement 1 has 2 operands, expected 3", |builder| {
            let x = builder.input("x", 1);
            let y = builder.accumulate(&Table::new(3, 2, vec![1.0; 6]), x);
            builder.output("y", &y);
        });
        refused("the array `y` is empty or named twice", |builder| {
            builder.output("y", &[]);
        });
    }
}
