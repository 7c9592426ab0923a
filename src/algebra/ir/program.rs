//! The program itself: statements in static single assignment form.

use std::ops::Range;

/// Neighbouring columns that [`Statement::Separable`] adds side by side: what the widest common
/// registers hold.
pub(crate) const LANES: usize = 8;

/// Numbers that [`Statement::Quads`] adds side by side: one register of most processors.
pub(crate) const QUAD: usize = 4;

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
    /// Position of the value in schedule order.
    pub(crate) fn index(self) -> usize {
        self.0 as usize
    }
}

/// One constant table of a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TableId(pub(super) u32);

impl TableId {
    /// Position of the table in [`Program::tables`].
    pub(crate) fn index(self) -> usize {
        self.0 as usize
    }
}

/// A constant matrix, row-major.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Table<T = f64> {
    pub(super) rows: usize,
    pub(super) cols: usize,
    pub(super) entries: Vec<T>,
}

impl<T> Table<T> {
    /// A table of `rows` x `cols` from its row-major entries.
    ///
    /// # Panics
    /// If the number of entries is not `rows * cols`; a caller's defect.
    pub(crate) fn new(rows: usize, cols: usize, entries: Vec<T>) -> Self {
        assert_eq!(entries.len(), rows * cols, "table entries fill the shape");
        Self {
            rows,
            cols,
            entries,
        }
    }

    /// Number of rows.
    pub(crate) fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    pub(crate) fn cols(&self) -> usize {
        self.cols
    }

    /// One row, `cols` entries.
    pub(crate) fn row(&self, row: usize) -> &[T] {
        &self.entries[row * self.cols..(row + 1) * self.cols]
    }

    /// All entries, row-major.
    pub(crate) fn entries(&self) -> &[T] {
        &self.entries
    }
}

/// Operations on one scalar.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Unary {
    /// `-a`
    Neg,
    /// Square root, correctly rounded.
    Sqrt,
    /// Absolute value.
    Abs,
    /// `1`, `-1` or `0` as `a` is positive, negative or zero; NaN of NaN.
    Sign,
    /// Tangent of the target's library.
    Tan,
    /// Hyperbolic tangent of the target's library.
    Tanh,
    /// Exponential of the target's library.
    Exp,
    /// Natural logarithm of the target's library.
    Log,
}

/// Operations on two scalars, each rounded once except powers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Binary {
    /// `a + b`
    Add,
    /// `a - b`
    Sub,
    /// `a * b`
    Mul,
    /// `a / b`
    Div,
    /// `a ^ b` of the target's library, for exponents that are no integers.
    Pow,
}

/// Derivatives of a group of functions, one a column.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Slopes<V = Vec<ValueId>> {
    /// All are one: the group is the variables themselves.
    One,
    /// These values.
    Plus(V),
    /// The negatives of these values.
    Minus(V),
}

impl<V> Slopes<V> {
    /// The values that are read, if any.
    pub(crate) fn values(&self) -> Option<&V> {
        match self {
            Self::One => None,
            Self::Plus(values) | Self::Minus(values) => Some(values),
        }
    }

    /// The same with other values.
    pub(crate) fn map<W>(&self, of: impl FnOnce(&V) -> W) -> Slopes<W> {
        match self {
            Self::One => Slopes::One,
            Self::Plus(values) => Slopes::Plus(of(values)),
            Self::Minus(values) => Slopes::Minus(of(values)),
        }
    }
}

/// Functions of one variable each, one a column of a table.
#[derive(Clone, Debug, PartialEq)]
pub struct Group<T = TableId, V = Vec<ValueId>> {
    /// Coefficients, a multiple of `LANES` columns.
    pub table: T,
    /// Value of each function; zero behind the last variable, as the coefficients are.
    pub values: V,
    /// Derivative of each function by its variable.
    pub slopes: Slopes<V>,
}

/// A vector of `QUAD` numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quad {
    /// A row of the statement's table.
    Row(usize),
    /// An earlier sum of the statement.
    Sum(usize),
}

/// One sum of [`Statement::Quads`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct QuadSum {
    /// What the sum begins with.
    pub start: Quad,
    /// What is added: positions of weights, and the vectors that they scale.
    pub terms: Vec<(usize, Quad)>,
}

impl QuadSum {
    /// The vectors that are added, then that of the start.
    pub(crate) fn vectors(&self) -> impl Iterator<Item = Quad> {
        let added = self.terms.iter().map(|&(_, vector)| vector);
        added.chain([self.start])
    }
}

/// One step of the schedule; defines one or several values.
#[derive(Clone, Debug, PartialEq)]
pub enum Statement {
    /// A finite constant.
    Constant(f64),
    /// Element `index` of input `slot`; every element has one such statement, in their order.
    Input {
        /// Which input.
        slot: usize,
        /// Which element of it.
        index: usize,
    },
    /// A scalar operation on one value.
    Unary(Unary, ValueId),
    /// A scalar operation on two values.
    Binary(Binary, ValueId, ValueId),
    /// The second value where the first one is zero, of either sign; the third elsewhere, also where the first is
    /// NaN. Both are computed.
    Select([ValueId; 3]),
    /// Sine and cosine of all arguments by [`super::sin_cos::sin_cos`]:
    /// defines the n sines, then the n cosines.
    SinCos {
        /// The n arguments, in rad.
        arguments: Vec<ValueId>,
    },
    /// Matrix-vector accumulation `y_j = t_0j + sum_i t_(i+1)j w_i`: the first row
    /// of the table is the offset, each later row is scaled by one weight.
    ///
    /// Association: the accumulator starts at the offset and takes one section of weights after
    /// the other, each four rows at a time,
    /// `y += (t_1 w_1 + t_2 w_2) + (t_3 w_3 + t_4 w_4)`; the rows of the section that
    /// remain are added one by one. Defines `cols` values.
    Accumulate {
        /// Table with one row more than there are weights.
        table: TableId,
        /// One weight a row after the first, in sections.
        sections: Vec<Vec<ValueId>>,
    },
    /// Sums of vectors of `QUAD` numbers, `y_s = start_s + sum_i w_i v_i`, where each `v_i` is a constant
    /// or an earlier sum of the statement.
    ///
    /// Association: from `start` on, one term after the other, each product rounded before it is added.
    /// No coefficient is `-0` and each chain of starts ends with a constant, so no sum is ever `-0`: with
    /// finite weights, products with coefficients of zero may be left out. Defines `QUAD` values per sum.
    Quads {
        /// The constant vectors, one per row.
        table: TableId,
        /// The weights.
        weights: Vec<ValueId>,
        /// At least one sum.
        sums: Vec<QuadSum>,
    },
    /// The entries of a constant table, row-major: defines `rows x cols` values.
    Constants {
        /// The table.
        table: TableId,
    },
    /// Sums of functions of one variable each, with their derivatives. With the groups
    /// `g` of functions, one function a column `i`, and tables `T_g`:
    ///
    /// `y_r = start_r + sum_i q_ri`, `q_ri = sum_g T_g,ri value_g,i` (groups in order), and
    /// `slope_ri = base_ri + sum_g T_g,ri slope_g,i` (base, then groups in order). A group has no
    /// part in the columns behind its table.
    ///
    /// Association of the sum over columns: eight lanes `p_l` add the columns `8 k + l` in order of
    /// `k`; then `y_r = start_r + (((p_0 + p_4) + (p_2 + p_6)) + ((p_1 + p_5) + (p_3 + p_7)))`.
    /// Defines the `rows` sums, then the `rows x cols` slopes, row-major.
    Separable {
        /// One value a row.
        start: Vec<ValueId>,
        /// What the slopes of the first columns begin with, row-major, a multiple of `LANES` values a
        /// row; nothing if absent.
        base: Option<Vec<ValueId>>,
        /// At least one group.
        groups: Vec<Group>,
        /// Number of variables.
        cols: usize,
    },
    /// Evaluation of another program; the arguments fill its input slots in order.
    /// Defines the values of its output slots in order.
    Call {
        /// Position in [`Program::callees`].
        callee: usize,
        /// The elements of all input slots of the callee, one after the other.
        arguments: Vec<ValueId>,
    },
}

impl Statement {
    /// The values that the statement reads, in order.
    pub(crate) fn operands(&self) -> Vec<ValueId> {
        match self {
            Self::Constant(_) | Self::Input { .. } | Self::Constants { .. } => Vec::new(),
            Self::Unary(_, a) => vec![*a],
            Self::Binary(_, a, b) => vec![*a, *b],
            Self::Select(operands) => operands.to_vec(),
            Self::SinCos { arguments } | Self::Call { arguments, .. } => arguments.clone(),
            Self::Accumulate { sections, .. } => sections.concat(),
            Self::Quads { weights, .. } => weights.clone(),
            Self::Separable {
                start,
                base,
                groups,
                cols: _,
            } => {
                let mut operands = start.clone();
                operands.extend(base.iter().flatten());
                for group in groups {
                    operands.extend(&group.values);
                    operands.extend(group.slopes.values().into_iter().flatten());
                }
                operands
            }
        }
    }

    /// The values that a separable statement reads as arrays, one a group's functions and slopes.
    pub(crate) fn arrays(&self) -> Vec<&[ValueId]> {
        match self {
            Self::Separable { groups, .. } => groups
                .iter()
                .flat_map(|group| std::iter::once(&group.values).chain(group.slopes.values()))
                .map(Vec::as_slice)
                .collect(),
            Self::Constant(_)
            | Self::Input { .. }
            | Self::Unary(..)
            | Self::Binary(..)
            | Self::Select(_)
            | Self::SinCos { .. }
            | Self::Accumulate { .. }
            | Self::Quads { .. }
            | Self::Constants { .. }
            | Self::Call { .. } => Vec::new(),
        }
    }
}

/// One element of an output slot and the value that it takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ResultEntry {
    /// Which output.
    pub slot: usize,
    /// Which element of it.
    pub index: usize,
    /// The value stored there.
    pub value: ValueId,
}

/// A validated, scheduled computation of named output arrays from named input
/// arrays; made by [`super::ProgramBuilder`].
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    pub(super) name: String,
    pub(super) inputs: Vec<Slot>,
    pub(super) outputs: Vec<Slot>,
    pub(super) statements: Vec<Statement>,
    /// First value of each statement, and the number of values at the end.
    pub(super) first: Vec<u32>,
    pub(super) tables: Vec<Table>,
    pub(super) callees: Vec<Program>,
    pub(super) results: Vec<ResultEntry>,
}

impl Program {
    /// Name of the computation.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Arrays that enter.
    pub fn inputs(&self) -> &[Slot] {
        &self.inputs
    }

    /// Arrays that leave.
    pub fn outputs(&self) -> &[Slot] {
        &self.outputs
    }

    /// All statements, in order of evaluation.
    pub fn statements(&self) -> &[Statement] {
        &self.statements
    }

    /// Constant tables of the array statements.
    pub(crate) fn tables(&self) -> &[Table] {
        &self.tables
    }

    /// Programs that this one evaluates.
    pub fn callees(&self) -> &[Program] {
        &self.callees
    }

    /// What is stored where: each output element once, ordered by slot and index.
    pub(crate) fn results(&self) -> &[ResultEntry] {
        &self.results
    }

    /// Number of scalar values.
    pub(crate) fn n_values(&self) -> usize {
        self.first.last().map_or(0, |&count| count as usize)
    }

    /// How many of the values, from the last on, are the constant zero.
    pub(crate) fn n_zeros_behind(&self, values: &[ValueId]) -> usize {
        let is_zero = |value: &&ValueId| {
            let (statement, _) = self.definition(**value);
            matches!(self.statements[statement], Statement::Constant(x) if x.to_bits() == 0)
        };
        values.iter().rev().take_while(is_zero).count()
    }

    /// Whether such a statement computes something that an output depends on.
    pub(crate) fn has(&self, is_wanted: impl Fn(&Statement) -> bool) -> bool {
        // Most programs have none, which is found sooner than what is live.
        self.statements.iter().any(&is_wanted) && {
            let mut statements = self.statements.iter().zip(self.live());
            statements.any(|(statement, live)| live && is_wanted(statement))
        }
    }

    /// Which statements compute something that an output depends on.
    pub(crate) fn live(&self) -> Vec<bool> {
        let mut live = vec![false; self.statements.len()];
        for entry in &self.results {
            live[self.definition(entry.value).0] = true;
        }
        for position in (0..self.statements.len()).rev() {
            if live[position] {
                for value in self.statements[position].operands() {
                    live[self.definition(value).0] = true;
                }
            }
        }
        live
    }

    /// Values that statement `statement` defines.
    pub fn values_of(&self, statement: usize) -> Range<usize> {
        self.first[statement] as usize..self.first[statement + 1] as usize
    }

    /// Statement that defines a value, and the value's position among those that
    /// the statement defines.
    pub(crate) fn definition(&self, value: ValueId) -> (usize, usize) {
        let statement = self.first.partition_point(|&first| first <= value.0) - 1;
        (statement, (value.0 - self.first[statement]) as usize)
    }
}
