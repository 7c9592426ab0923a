//! The program itself: statements in static single assignment form.

use std::ops::Range;

use super::operation::{Binary, Unary};

/// A named, contiguous array of scalars that enters or leaves a program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Slot {
    /// Name of the array, as the generated function's parameter.
    pub name: String,
    /// Number of scalars.
    pub len: usize,
}

/// One scalar computed by a program; numbered in schedule order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ValueId(pub(super) u32);

impl ValueId {
    pub(crate) fn index(self) -> usize {
        self.0 as usize
    }
}

/// How many sums one `Lanes` statement computes.
pub(crate) const LANES: usize = 2;

/// A number per lane.
pub(crate) type Vector = [ValueId; LANES];

/// A constant matrix, row-major.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Table<T = f64> {
    pub(crate) rows: usize,
    pub(crate) cols: usize,
    pub(crate) entries: Vec<T>,
}

impl<T> Table<T> {
    pub(crate) fn new(rows: usize, cols: usize, entries: Vec<T>) -> Self {
        assert_eq!(entries.len(), rows * cols, "table entries fill the shape");
        Self {
            rows,
            cols,
            entries,
        }
    }

    pub(crate) fn row(&self, row: usize) -> &[T] {
        &self.entries[row * self.cols..(row + 1) * self.cols]
    }
}

/// One step of the schedule; defines one or several values.
#[derive(Clone, Debug, PartialEq)]
pub enum Statement {
    Constant(f64),
    /// Element `index` of input `slot`; every element has one such statement, in their order.
    Input {
        slot: usize,
        index: usize,
    },
    Unary(Unary, ValueId),
    /// A scalar operation on two values.
    Binary(Binary, ValueId, ValueId),
    /// The second value where the first is zero of either sign, else the third, also for NaN; both are computed.
    Select([ValueId; 3]),
    /// Sine and cosine of all arguments by [`super::sin_cos`]: defines the n sines, then the n cosines.
    SinCos {
        /// The n arguments, in rad.
        arguments: Vec<ValueId>,
    },
    /// Matrix-vector product with an offset, `y_j = t_0j + sum_i t_(i+1)j w_i`. The accumulator starts at the offset,
    /// the first row, and adds four rows at a time, `y += (t_1 w_1 + t_2 w_2) + (t_3 w_3 + t_4 w_4)`; the rows that
    /// remain are added one by one. Defines `cols` values.
    Accumulate {
        /// Position of a table with one row more than there are weights.
        table: usize,
        /// One weight per row after the first, at least one.
        weights: Vec<ValueId>,
    },
    /// Tables whose columns are scaled, `y_ri = base_ri + sum_g T_g,ri w_g,i`, added in the order of the groups.
    /// Defines `rows x cols` values, row-major.
    Scaled {
        /// Start values of the sums, row-major; zero if absent.
        base: Option<Vec<ValueId>>,
        /// Positions of at least one table, all of one shape, each with a weight per column or added as it is.
        groups: Vec<(usize, Option<Vec<ValueId>>)>,
    },
    /// A sum per lane, `y_l = v_0l + sum_t v_tl w_t`, the odd terms to the start and the even ones
    /// apart. Code may leave out products with the constant zero, which changes sums of infinite weights alone.
    Lanes {
        /// Start values of the sums.
        start: Option<Vector>,
        /// At least one vector with its weight.
        terms: Vec<(Vector, ValueId)>,
    },
    /// Evaluation of another program: arguments fill its input slots, values are those of its output slots, in order.
    Call {
        /// Position in [`Program::callees`].
        callee: usize,
        /// The elements of all input slots of the callee, one after the other.
        arguments: Vec<ValueId>,
    },
}

impl Statement {
    pub(crate) fn operands(&self) -> Vec<ValueId> {
        match self {
            Self::Constant(_) | Self::Input { .. } => Vec::new(),
            Self::Unary(_, a) => vec![*a],
            Self::Binary(_, a, b) => vec![*a, *b],
            Self::Select(operands) => operands.to_vec(),
            Self::SinCos { arguments } | Self::Call { arguments, .. } => arguments.clone(),
            Self::Accumulate { weights, .. } => weights.clone(),
            Self::Lanes { start, terms } => {
                let weights = terms.iter().map(|(_, weight)| weight);
                let vectors = terms.iter().map(|(vector, _)| vector).chain(start);
                vectors.flatten().chain(weights).copied().collect()
            }
            Self::Scaled { base, groups } => {
                let weights = groups.iter().filter_map(|(_, weights)| weights.as_ref());
                base.iter().chain(weights).flatten().copied().collect()
            }
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ResultEntry {
    pub slot: usize,
    pub index: usize,
    pub value: ValueId,
}

/// A validated, scheduled computation of named output arrays from named input arrays; see `ProgramBuilder`.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    pub name: String,
    pub inputs: Vec<Slot>,
    pub outputs: Vec<Slot>,
    /// All statements, in order of evaluation.
    pub statements: Vec<Statement>,
    pub(super) first: Vec<u32>, // value of each statement, and the number of values at the end
    pub(crate) tables: Vec<Table>,
    pub callees: Vec<Program>,
    /// Values of the output elements, each once, ordered by slot and index.
    pub(crate) results: Vec<ResultEntry>,
}

impl Program {
    pub(crate) fn n_values(&self) -> usize {
        self.first.last().map_or(0, |&count| count as usize)
    }

    /// Whether such a statement computes something that an output depends on.
    pub(crate) fn has(&self, is_wanted: impl Fn(&Statement) -> bool) -> bool {
        // Most programs have none; this test is faster than finding the live statements.
        self.statements.iter().any(&is_wanted) && {
            let mut statements = self.statements.iter().zip(self.live());
            statements.any(|(statement, live)| live && is_wanted(statement))
        }
    }

    /// Which statements compute something that an output depends on.
    pub(crate) fn live(&self) -> Vec<bool> {
        let mut live = vec![false; self.statements.len()];
        for entry in &self.results {
            live[self.definition(entry.value)] = true;
        }
        for position in (0..self.statements.len()).rev() {
            if live[position] {
                for value in self.statements[position].operands() {
                    live[self.definition(value)] = true;
                }
            }
        }
        live
    }

    pub fn values_of(&self, statement: usize) -> Range<usize> {
        self.first[statement] as usize..self.first[statement + 1] as usize
    }

    fn definition(&self, value: ValueId) -> usize {
        self.first.partition_point(|&first| first <= value.0) - 1
    }
}
