//! Where values live: which arrays hold them, in place or copied.

use super::code::{Expr, Index, Role, Span, Stmt};
use super::ident::Ident;
use super::translate::Translator;
use crate::ir::{Statement, ValueId};

/// Arrays shorter than this are copied element by element, not in loops: what reads a short
/// array wholly would wait for the stores of several loops.
const LONGEST_LIST: usize = 24;

/// Where the rows of a matrix of values live: `stride` apart in an array, from the home's first element on.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct MatrixStorage {
    /// Where the first row begins.
    pub home: Span,
    /// From one row to the next.
    pub stride: usize,
}

impl MatrixStorage {
    /// The entry at a loop variable and a subscript.
    pub(crate) fn element(&self, row: &Ident, col: &Index) -> Expr {
        let row = Index::fixed(self.home.offset).plus(self.stride, row);
        Expr::Element(self.home.array.clone(), row.sum(col))
    }
}

impl Translator<'_> {
    /// The values as contiguous elements of one array: in place if they are, copied if not.
    pub(super) fn span(&mut self, values: &[ValueId]) -> Span {
        if let Some(span) = self.contiguous(values) {
            return span;
        }
        self.copied(values)
    }

    /// As [`Self::span`], but what has to be copied is copied with all that a later statement reads
    /// behind it, so that this need not copy again.
    pub(super) fn span_with_rest(&mut self, values: &[ValueId]) -> Span {
        if let Some(span) = self.contiguous(values) {
            return span;
        }
        let program = self.program;
        let mut arrays = program.statements().iter().flat_map(Statement::arrays);
        let is_read = |value: &ValueId| self.spelled[value.index()].is_some();
        let longer = arrays.find(|array| array.starts_with(values) && array.iter().all(is_read));
        let whole = self.copied(longer.unwrap_or(values));
        Span {
            len: values.len(),
            ..whole
        }
    }

    /// The values copied to an array of their own, long runs of elements by loops.
    fn copied(&mut self, values: &[ValueId]) -> Span {
        let known = self.copies.iter().find(|(copied, _)| copied == values);
        if let Some((_, array)) = known {
            return local(array.clone(), values.len());
        }
        let array = self.names.locals.mint("a");
        self.copies.push((values.to_vec(), array.clone()));
        if values.len() < LONGEST_LIST {
            let elements = values.iter().map(|&value| self.read(value).0).collect();
            self.body.push(Stmt::LetArray(array.clone(), elements));
        } else {
            let runs = self.runs(values);
            self.body.push(Stmt::Declare(array.clone(), values.len()));
            let mut at = 0;
            for run in runs {
                self.copy_run(&array, at, run);
                at += run.len();
            }
        }
        local(array, values.len())
    }

    fn copy_run(&mut self, array: &Ident, at: usize, run: &[ValueId]) {
        match self.read(run[0]).0 {
            Expr::Element(source, from) if run.len() > 1 => {
                let i = self.names.locals.mint("i");
                let target = Index::variable(&i).shifted(at);
                let source = Expr::Element(source, Index::variable(&i).shifted(from.offset));
                let assign = Stmt::Assign(Expr::Element(array.clone(), target), source);
                self.body.push(Stmt::For(i, run.len(), vec![assign]));
            }
            value => {
                let target = Expr::Element(array.clone(), Index::fixed(at));
                self.body.push(Stmt::Assign(target, value));
            }
        }
    }

    /// Divides values into runs of consecutive elements of one array.
    fn runs<'v>(&self, values: &'v [ValueId]) -> Vec<&'v [ValueId]> {
        let follows = |a: &ValueId, b: &ValueId| match (self.element(*a), self.element(*b)) {
            (Some((before, at)), Some((array, next))) => before == array && at + 1 == next,
            (None, _) | (_, None) => false,
        };
        values.chunk_by(follows).collect()
    }

    /// Array and position of a value that is an element.
    fn element(&self, value: ValueId) -> Option<(&Ident, usize)> {
        match self.spelled[value.index()].as_ref() {
            Some((Expr::Element(array, index), _)) if index.terms.is_empty() => {
                Some((array, index.offset))
            }
            _ => None,
        }
    }

    /// As [`Self::span`], but the whole of an array.
    pub(super) fn whole_span(&mut self, values: &[ValueId]) -> Span {
        match self.contiguous(values).filter(Span::is_whole) {
            Some(span) => span,
            None => self.copied(values),
        }
    }

    fn contiguous(&self, values: &[ValueId]) -> Option<Span> {
        let (array, offset) = self.element(*values.first()?)?;
        let array = array.clone();
        let n_zeros = self.program.n_zeros_behind(values);
        let elements = values.len() - n_zeros;
        if self.runs(&values[..elements]).len() != 1 {
            return None;
        }
        if n_zeros > 0 && !self.zeros.contains(&(array.clone(), offset + elements)) {
            return None;
        }
        let end = offset + values.len();
        let parameters = self.names.inputs.iter().chain(self.names.outputs);
        let parameter = parameters.clone().find(|parameter| parameter.name == array);
        let declared = self.body.iter().find_map(|statement| match statement {
            Stmt::Declare(name, len) if *name == array => Some(*len),
            _ => None,
        });
        let of = declared.or(parameter.map(|parameter| parameter.len))?;
        (end <= of).then(|| Span {
            array,
            offset,
            len: values.len(),
            of,
            is_parameter: parameter.is_some(),
        })
    }

    /// Reserves elements of a new array for values, with the zeros behind them that a later separable statement
    /// reads: no other statement reads arrays that end with zeros.
    pub(super) fn local_home(&mut self, first: usize, len: usize, wanted: &str) -> Span {
        let is_here = |values: &&[ValueId]| {
            let here = values.iter().map(|value| value.index()).take(len);
            here.eq(first..first + len)
        };
        let statements = self.program.statements().iter();
        let n_zeros = statements
            .flat_map(Statement::arrays)
            .filter(is_here)
            .map(|values| self.program.n_zeros_behind(values))
            .max()
            .unwrap_or(0);
        let array = self.names.locals.mint(wanted);
        self.body.push(Stmt::Declare(array.clone(), len + n_zeros));
        for k in len..len + n_zeros {
            let zero = Expr::Element(array.clone(), Index::fixed(k));
            let assign = Stmt::Assign(zero, Expr::Literal(0.0));
            self.body.push(assign);
        }
        if n_zeros > 0 {
            self.zeros.push((array.clone(), len));
        }
        let span = Span {
            len,
            ..local(array, len + n_zeros)
        };
        self.allocate(first, span)
    }

    /// Spells values as the elements of a span.
    pub(super) fn allocate(&mut self, first: usize, home: Span) -> Span {
        for k in 0..home.len {
            let index = Index::fixed(home.offset + k);
            self.spell(first + k, Expr::Element(home.array.clone(), index));
        }
        home
    }

    /// Reserves `rows x cols` elements for values, row by row in an output where they belong
    /// if possible.
    pub(super) fn matrix_storage(
        &mut self,
        first: usize,
        rows: usize,
        cols: usize,
        wanted: &str,
    ) -> MatrixStorage {
        let matrix = self.output_matrix(first, rows, cols).unwrap_or_else(|| {
            let array = self.names.locals.mint(wanted);
            self.body.push(Stmt::Declare(array.clone(), rows * cols));
            MatrixStorage {
                home: local(array, rows * cols),
                stride: cols,
            }
        });
        for r in 0..rows {
            let row = Span {
                offset: matrix.home.offset + matrix.stride * r,
                len: cols,
                ..matrix.home.clone()
            };
            self.allocate(first + r * cols, row);
        }
        matrix
    }

    /// The output array in which each row is a run of elements, all equally far apart, if nothing in it is still
    /// to be read.
    pub(super) fn output_matrix(
        &self,
        first: usize,
        rows: usize,
        cols: usize,
    ) -> Option<MatrixStorage> {
        let results = self.program.results();
        let find = |value: usize| results.iter().position(|e| e.value.index() == value);
        let at = find(first)?;
        let stride = match rows {
            0 | 1 => cols,
            _ => find(first + cols)?.checked_sub(at)?,
        };
        let slot = results[at].slot;
        let output = &self.names.outputs[slot];
        let fits = (0..rows).all(|r| {
            (0..cols).all(|i| {
                results.get(at + r * stride + i).is_some_and(|entry| {
                    entry.slot == slot && entry.value.index() == first + r * cols + i
                })
            })
        });
        (fits && output.role == Role::Output).then(|| MatrixStorage {
            home: Span {
                array: output.name.clone(),
                offset: results[at].index,
                len: rows * cols,
                of: output.len,
                is_parameter: true,
            },
            stride,
        })
    }
}

/// All of a local array.
fn local(array: Ident, len: usize) -> Span {
    Span {
        array,
        offset: 0,
        len,
        of: len,
        is_parameter: false,
    }
}
