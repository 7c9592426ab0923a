//! Builds programs; equal computations become one value.

use std::collections::HashMap;

use super::operation::{Binary, Unary};
use super::program::{LANES, Program, ResultEntry, Slot, Statement, Table, ValueId, Vector};

/// A number of a program that is not finite.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("program `{program}`: statement {statement} holds the non-finite constant {value}")]
pub struct IrError {
    program: String,
    statement: usize,
    value: f64,
}

/// Key under which two scalar statements are the same computation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Key {
    Constant(u64),
    Unary(Unary, ValueId),
    Binary(Binary, ValueId, ValueId),
    Select([ValueId; 3]),
}

/// Appends statements in order of evaluation and numbers values; equal scalar computations are made once.
#[derive(Debug)]
pub(crate) struct ProgramBuilder {
    program: Program,
    known: HashMap<Key, ValueId>,
}

impl ProgramBuilder {
    pub(crate) fn new(name: &str) -> Self {
        Self {
            program: Program {
                name: name.to_owned(),
                inputs: Vec::new(),
                outputs: Vec::new(),
                statements: Vec::new(),
                first: vec![0],
                tables: Vec::new(),
                callees: Vec::new(),
                results: Vec::new(),
            },
            known: HashMap::new(),
        }
    }

    /// Declares an input array and returns its elements.
    pub(crate) fn input(&mut self, name: &str, len: usize) -> Vec<ValueId> {
        let slot = self.program.inputs.len();
        self.program.inputs.push(Slot {
            name: name.to_owned(),
            len,
        });
        (0..len)
            .map(|index| self.push(Statement::Input { slot, index }, 1))
            .collect()
    }

    pub(crate) fn constant(&mut self, value: f64) -> ValueId {
        self.numbered(Key::Constant(value.to_bits()), Statement::Constant(value))
    }

    pub(crate) fn unary(&mut self, op: Unary, a: ValueId) -> ValueId {
        self.numbered(Key::Unary(op, a), Statement::Unary(op, a))
    }

    /// A scalar operation on two values.
    pub(crate) fn binary(&mut self, op: Binary, a: ValueId, b: ValueId) -> ValueId {
        let (low, high) = match op {
            Binary::Add | Binary::Mul => (a.min(b), a.max(b)),
            Binary::Sub | Binary::Div | Binary::Pow => (a, b),
        };
        self.numbered(Key::Binary(op, low, high), Statement::Binary(op, a, b))
    }

    pub(crate) fn add(&mut self, a: ValueId, b: ValueId) -> ValueId {
        self.binary(Binary::Add, a, b)
    }

    pub(crate) fn mul(&mut self, a: ValueId, b: ValueId) -> ValueId {
        self.binary(Binary::Mul, a, b)
    }

    pub(crate) fn div(&mut self, a: ValueId, b: ValueId) -> ValueId {
        self.binary(Binary::Div, a, b)
    }

    pub(crate) fn select(&mut self, test: ValueId, zero: ValueId, other: ValueId) -> ValueId {
        let operands = [test, zero, other];
        self.numbered(Key::Select(operands), Statement::Select(operands))
    }

    pub(crate) fn sin_cos(&mut self, arguments: &[ValueId]) -> (Vec<ValueId>, Vec<ValueId>) {
        let n = arguments.len();
        let statement = Statement::SinCos {
            arguments: arguments.to_vec(),
        };
        let values = self.push_array(statement, 2 * n);
        (values[..n].to_vec(), values[n..].to_vec())
    }

    pub(crate) fn accumulate(&mut self, table: &Table, weights: Vec<ValueId>) -> Vec<ValueId> {
        assert_eq!(weights.len() + 1, table.rows, "a weight per row");
        let position = place_of(&mut self.program.tables, table);
        let statement = Statement::Accumulate {
            table: position,
            weights,
        };
        self.push_array(statement, table.cols)
    }

    pub(crate) fn scaled(
        &mut self,
        base: Option<Vec<ValueId>>,
        groups: Vec<(Table, Option<Vec<ValueId>>)>,
    ) -> Vec<ValueId> {
        let n_values = groups[0].0.entries.len();
        let groups = groups.into_iter().map(|(table, weights)| {
            assert_eq!(table.entries.len(), n_values, "tables of one shape");
            (place_of(&mut self.program.tables, &table), weights)
        });
        let groups = groups.collect();
        self.push_array(Statement::Scaled { base, groups }, n_values)
    }

    /// Sums side by side, see [`Statement::Lanes`].
    pub(crate) fn lanes(&mut self, start: Option<Vector>, terms: Vec<(Vector, ValueId)>) -> Vector {
        match start.filter(|_| terms.is_empty()) {
            Some(start) => start,
            None => {
                let first = self.push(Statement::Lanes { start, terms }, LANES);
                std::array::from_fn(|lane| ValueId(first.0 + lane as u32))
            }
        }
    }

    /// Evaluates another program; returns the values of each of its outputs.
    pub(crate) fn call(&mut self, callee: &Program, arguments: &[ValueId]) -> Vec<Vec<ValueId>> {
        let position = place_of(&mut self.program.callees, callee);
        let n_inputs: usize = callee.inputs.iter().map(|slot| slot.len).sum();
        assert_eq!(arguments.len(), n_inputs, "arguments fill all inputs");
        let n = callee.outputs.iter().map(|slot| slot.len).sum();
        let statement = Statement::Call {
            callee: position,
            arguments: arguments.to_vec(),
        };
        let values = self.push_array(statement, n);
        let mut values = values.into_iter();
        let outputs = callee.outputs.iter();
        outputs
            .map(|slot| values.by_ref().take(slot.len).collect())
            .collect()
    }

    /// Declares an output array with the given values.
    pub(crate) fn output(&mut self, name: &str, values: &[ValueId]) {
        let slot = self.program.outputs.len();
        let is_other = |known: &Slot| known.name != name;
        assert!(
            !values.is_empty() && self.program.outputs.iter().all(is_other),
            "`{name}`"
        );
        self.program.outputs.push(Slot {
            name: name.to_owned(),
            len: values.len(),
        });
        let entries = values.iter().enumerate();
        self.program
            .results
            .extend(entries.map(|(index, &value)| ResultEntry { slot, index, value }));
    }

    pub(crate) fn finish(self) -> Result<Program, IrError> {
        let of_table = |table: &usize| {
            let mut entries = self.program.tables[*table].entries.iter().copied();
            entries.find(|entry| !entry.is_finite())
        };
        let first = |(statement, s): (usize, &Statement)| {
            let value = match s {
                Statement::Constant(value) => Some(*value).filter(|value| !value.is_finite()),
                Statement::Accumulate { table, .. } => of_table(table),
                Statement::Scaled { groups, .. } => groups.iter().find_map(|(t, _)| of_table(t)),
                _ => None,
            };
            let program = self.program.name.clone();
            value.map(|value| IrError {
                program,
                statement,
                value,
            })
        };
        match self.program.statements.iter().enumerate().find_map(first) {
            Some(fault) => Err(fault),
            None => Ok(self.program),
        }
    }

    fn numbered(&mut self, key: Key, statement: Statement) -> ValueId {
        if let Some(&value) = self.known.get(&key) {
            return value;
        }
        let value = self.push(statement, 1);
        self.known.insert(key, value);
        value
    }

    fn push(&mut self, statement: Statement, n_values: usize) -> ValueId {
        let first = self.program.n_values() as u32;
        let is_defined = |value: &ValueId| value.0 < first;
        debug_assert!(statement.operands().iter().all(is_defined), "{statement:?}");
        self.program.statements.push(statement);
        self.program.first.push(first + n_values as u32);
        ValueId(first)
    }

    fn push_array(&mut self, statement: Statement, n_values: usize) -> Vec<ValueId> {
        let first = self.push(statement, n_values).0;
        (first..first + n_values as u32).map(ValueId).collect()
    }
}

/// The position of an element equal to `wanted`, which is added if there is none.
fn place_of<T: PartialEq + Clone>(list: &mut Vec<T>, wanted: &T) -> usize {
    let known = list.iter().position(|known| known == wanted);
    known.unwrap_or_else(|| {
        list.push(wanted.clone());
        list.len() - 1
    })
}
