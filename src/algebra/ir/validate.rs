//! What every program promises, checked once when it is built.

use super::program::{Program, Statement, Table, TableId, ValueId};

/// Why a program is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum IrError {
    /// A statement breaks a promise; the results count as the last one.
    #[error("program `{program}`: statement {statement} {fault}")]
    Statement {
        /// Name of the program.
        program: String,
        /// Position of the statement.
        statement: usize,
        /// What is wrong with it.
        fault: Fault,
    },
    /// An input or output without elements, or two with the same name.
    #[error("program `{program}`: the array `{slot}` is empty or named twice")]
    Slot {
        /// Name of the program.
        program: String,
        /// Name of the array.
        slot: String,
    },
    /// The results do not cover the outputs.
    #[error("program `{program}`: {found} results for {expected} output elements")]
    Results {
        /// Name of the program.
        program: String,
        /// Number of results.
        found: usize,
        /// Number of output elements.
        expected: usize,
    },
}

/// What is wrong with a statement.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Fault {
    /// It reads this value, which is not defined before it.
    #[error("reads value {0}, defined only later")]
    UndefinedValue(usize),
    /// It reads an input element that does not exist.
    #[error("reads element {index} of input {slot}")]
    UndefinedInput {
        /// Input slot.
        slot: usize,
        /// Element of the slot.
        index: usize,
    },
    /// A constant is infinite or not a number.
    #[error("holds the non-finite constant {0}")]
    NonFinite(f64),
    /// The operands of an array statement do not fit its table or callee.
    #[error("has {found} operands, expected {expected}")]
    OperandCount {
        /// Operands of the statement.
        found: usize,
        /// Operands that its table or callee asks for.
        expected: usize,
    },
}

/// Checks definitions before uses, finite constants, table shapes and slots.
///
/// # Errors
/// The first promise that is broken, in schedule order.
pub(crate) fn validate(program: &Program) -> Result<(), IrError> {
    check_slots(program)?;
    let at = |statement: usize, found: Result<(), Fault>| {
        found.map_err(|fault| IrError::Statement {
            program: program.name.clone(),
            statement,
            fault,
        })
    };
    for (position, statement) in program.statements.iter().enumerate() {
        at(position, check_operands(program, position, statement))?;
        at(position, check_shape(program, statement))?;
    }
    let expected = program.outputs.iter().map(|slot| slot.len).sum();
    if program.results.len() != expected {
        return Err(IrError::Results {
            program: program.name.clone(),
            found: program.results.len(),
            expected,
        });
    }
    let end = program.statements.len();
    let mut values = program.results.iter().map(|entry| entry.value);
    values.try_for_each(|value| at(end, check_value(program, end, value)))
}

fn check_slots(program: &Program) -> Result<(), IrError> {
    for slots in [&program.inputs, &program.outputs] {
        for (position, slot) in slots.iter().enumerate() {
            let twice = slots[..position]
                .iter()
                .any(|other| other.name == slot.name);
            if slot.len == 0 || twice {
                return Err(IrError::Slot {
                    program: program.name.clone(),
                    slot: slot.name.clone(),
                });
            }
        }
    }
    Ok(())
}

fn check_value(program: &Program, position: usize, value: ValueId) -> Result<(), Fault> {
    match value.0 < program.first[position] {
        true => Ok(()),
        false => Err(Fault::UndefinedValue(value.index())),
    }
}

fn check_operands(program: &Program, position: usize, statement: &Statement) -> Result<(), Fault> {
    for value in statement.operands() {
        check_value(program, position, value)?;
    }
    match *statement {
        Statement::Input { slot, index }
            if (program.inputs.get(slot)).is_none_or(|input| index >= input.len) =>
        {
            Err(Fault::UndefinedInput { slot, index })
        }
        _ => Ok(()),
    }
}

fn check_shape(program: &Program, statement: &Statement) -> Result<(), Fault> {
    let count = |found: usize, expected: usize| match found == expected {
        true => Ok(()),
        false => Err(Fault::OperandCount { found, expected }),
    };
    let finite = |values: &[f64]| match values.iter().find(|value| !value.is_finite()) {
        None => Ok(()),
        Some(&value) => Err(Fault::NonFinite(value)),
    };
    let table = |id: &TableId| -> Result<&Table, Fault> {
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

    fn finished(build: impl FnOnce(&mut ProgramBuilder)) -> Result<Program, IrError> {
        let mut builder = ProgramBuilder::new("p");
        build(&mut builder);
        builder.finish()
    }

    #[test]
    fn statement_that_breaks_a_promise_is_refused() {
        let refused = |at: usize, fault: Fault, build: fn(&mut ProgramBuilder)| {
            let program = "p".to_owned();
            let error = IrError::Statement {
                program,
                statement: at,
                fault,
            };
            assert_eq!(finished(build), Err(error));
        };
        refused(0, Fault::NonFinite(f64::INFINITY), |builder| {
            let value = builder.constant(f64::INFINITY);
            builder.output("y", &[value]);
        });
        // Values of another program.
        refused(1, Fault::UndefinedValue(2), |builder| {
            let values = ProgramBuilder::new("other").input("x", 3);
            builder.input("x", 1);
            let sum = builder.add(values[0], values[2]);
            builder.output("y", &[sum]);
        });
        let (found, expected) = (2, 3);
        refused(1, Fault::OperandCount { found, expected }, |builder| {
            let x = builder.input("x", 1);
            let y = builder.accumulate(&Table::new(3, 2, vec![1.0; 6]), x);
            builder.output("y", &y);
        });
    }

    #[test]
    fn output_without_elements_is_refused() {
        let found = finished(|builder| builder.output("y", &[]));
        assert!(matches!(found, Err(IrError::Slot { .. })), "{found:?}");
    }
}
