//! Array statements as loops and calls, and where their values live: which arrays hold them, in place or copied.

use super::translate::Translator;
use super::*;

/// Where the rows of a matrix of values live: `stride` apart in an array, from the home's first element on.
struct MatrixStorage {
    home: Span,
    stride: usize,
}

impl MatrixStorage {
    fn element(&self, dialect: &Dialect, row: &Ident, col: &Ident) -> Text {
        let row = Index::fixed(self.home.offset).plus(self.stride, row);
        dialect.element(&self.home.array, &row.plus(1, col))
    }
}

impl Translator<'_> {
    pub(super) fn sin_cos(&mut self, first: usize, arguments: &[ValueId]) {
        let n = arguments.len();
        if self.lane.is_some() {
            for (k, &argument) in arguments.iter().enumerate() {
                self.sin_cos_lane([first + k, first + n + k], argument);
            }
            return;
        }
        let read = self.span(arguments);
        let written = [(first, "s"), (first + n, "c")].map(|(first, name)| {
            let home = self.declared(n, name);
            self.allocate(first, home)
        });
        let call = self.printer.dialect.call(None, &[read], &written);
        self.printer.line(&call);
    }

    fn sin_cos_lane(&mut self, values: [usize; 2], argument: ValueId) {
        let argument = self.named(argument);
        let names = ["s", "c"].map(|name| self.locals.mint(name));
        for (value, name) in values.iter().zip(&names) {
            self.spell(*value, Text::atom(name.to_string()));
        }
        let is_used = values.map(|value| self.n_uses[value] > 0);
        self.printer.sin_cos_lane(&argument, &names, is_used);
    }

    fn table(&mut self, id: usize) -> (Ident, usize) {
        let table = &self.program.tables[id];
        (self.tables.name(table), table.cols)
    }

    pub(super) fn accumulate(&mut self, first: usize, table: usize, weights: &[ValueId]) {
        let (name, cols) = self.table(table);
        let w = self.span(weights);
        let home = self.matrix_storage(first, 1, cols, "y").home;
        let (i, k) = (self.locals.mint("i"), self.locals.mint("k"));
        let printer = &mut self.printer;
        let dialect = printer.dialect;
        let element =
            |span: &Span, index: Index| dialect.element(&span.array, &index.shifted(span.offset));
        let target = element(&home, Index::variable(&i));
        let entry = |row: Index| dialect.entry(&name, &row, &Index::variable(&i));
        let product = |index: Index| {
            let weight = element(&w, index.clone());
            dialect.binary(Binary::Mul, &entry(index.shifted(1)), &weight, true)
        };
        let offset = entry(Index::fixed(0));
        printer.looped(&i, cols, |body| body.assign(&target, &offset));
        let blocks = weights.len() / 4;
        if blocks > 0 {
            let term = |n: usize| product(Index::fixed(n).plus(4, &k));
            let pair = |n: usize| dialect.binary(Binary::Add, &term(n), &term(n + 1), true);
            let sum = dialect.binary(Binary::Add, &pair(0), &pair(2), true);
            printer.looped(&k, blocks, |body| {
                body.looped(&i, cols, |body| body.add_assign(&target, &sum));
            });
        }
        for n in 4 * blocks..weights.len() {
            let term = product(Index::fixed(n));
            printer.looped(&i, cols, |body| body.add_assign(&target, &term));
        }
    }

    pub(super) fn scaled(
        &mut self,
        first: usize,
        base: Option<&[ValueId]>,
        groups: &[(usize, Option<Vec<ValueId>>)],
    ) {
        let shape = &self.program.tables[groups[0].0];
        let (rows, cols) = (shape.rows, shape.cols);
        let (r, i) = (self.locals.mint("r"), self.locals.mint("i"));
        let dialect = self.printer.dialect;
        let mut sum = base.map(|base| {
            let home = self.span(base);
            MatrixStorage { home, stride: cols }.element(dialect, &r, &i)
        });
        for (table, weights) in groups {
            let (name, _) = self.table(*table);
            let mut term = dialect.entry(&name, &Index::variable(&r), &Index::variable(&i));
            if let Some(weights) = weights {
                let span = self.span(weights);
                let weight = dialect.element(&span.array, &Index::fixed(span.offset).plus(1, &i));
                term = dialect.binary(Binary::Mul, &term, &weight, true);
            }
            sum = Some(match sum {
                None => term,
                Some(sum) => dialect.binary(Binary::Add, &sum, &term, true),
            });
        }
        let storage = self.matrix_storage(first, rows, cols, "m");
        let target = storage.element(dialect, &r, &i);
        let sum = sum.expect("at least one group");
        self.printer.looped(&r, rows, |row| {
            row.looped(&i, cols, |body| body.assign(&target, &sum));
        });
    }

    /// A loop over the lanes, which compilers vectorise, or one lane after the other without its zeros.
    pub(super) fn lanes(
        &mut self,
        first: usize,
        start: Option<Vector>,
        terms: &[(Vector, ValueId)],
    ) {
        let dialect = self.printer.dialect;
        let weights = terms.iter().map(|&(_, weight)| self.named(weight));
        let weights: Vec<Text> = weights.collect();
        let sum = |start: Option<Text>, numbers: Vec<Option<Text>>| {
            let product = |(number, weight): (&Option<Text>, &Text)| {
                Some(dialect.binary(Binary::Mul, number.as_ref()?, weight, true))
            };
            let add = |a: Text, b: Text| dialect.binary(Binary::Add, &a, &b, true);
            let sum = alternating(start, numbers.iter().zip(&weights).map(product), add);
            sum.unwrap_or_else(|| dialect.constant(0.0))
        };
        if dialect.spelling.loops_over_lanes {
            let i = self.locals.mint("i");
            let mut number = |vector: &Vector| {
                let span = self.span(vector);
                dialect.element(&span.array, &Index::variable(&i).shifted(span.offset))
            };
            let start = start.as_ref().map(&mut number);
            let numbers = terms.iter().map(|(vector, _)| Some(number(vector)));
            let sum = sum(start, numbers.collect());
            let home = self.declared(LANES, "y");
            let target = dialect.element(&home.array, &Index::variable(&i));
            let printer = &mut self.printer;
            printer.looped(&i, LANES, |body| body.assign(&target, &sum));
            self.allocate(first, home);
            return;
        }
        for lane in 0..LANES {
            let read = |vector: &Vector| self.read(vector[lane]);
            let is_zero = |vector: &Vector| self.zeros.contains(&vector[lane].index());
            let numbers = terms.iter().map(|(v, _)| (!is_zero(v)).then(|| read(v)));
            let sum = sum(start.as_ref().map(read), numbers.collect());
            if start
                .iter()
                .chain(terms.iter().map(|(v, _)| v))
                .all(is_zero)
            {
                self.zeros.insert(first + lane);
            }
            self.define(first + lane, sum);
        }
    }

    pub(super) fn call(&mut self, first: usize, callee: usize, arguments: &[ValueId]) {
        let program = &self.program.callees[callee];
        let (mut read, mut written) = (Vec::new(), Vec::new());
        let mut rest = arguments;
        for slot in &program.inputs {
            let (these, others) = rest.split_at(slot.len);
            read.push(match self.contiguous(these).filter(Span::is_whole) {
                Some(span) => span,
                None => self.copied(these),
            });
            rest = others;
        }
        let mut next = first;
        for slot in &program.outputs {
            let output = self.output_matrix(next, 1, slot.len);
            let output = output.map(|matrix| matrix.home).filter(Span::is_whole);
            let home = output.unwrap_or_else(|| self.declared(slot.len, &slot.name));
            written.push(self.allocate(next, home));
            next += slot.len;
        }
        let callee = Some(&self.callees[callee]);
        let call = self.printer.dialect.call(callee, &read, &written);
        self.printer.line(&call);
    }

    /// The values as contiguous elements of one array: in place if they are, copied if not.
    fn span(&mut self, values: &[ValueId]) -> Span {
        self.contiguous(values)
            .unwrap_or_else(|| self.copied(values))
    }

    fn contiguous(&self, values: &[ValueId]) -> Option<Span> {
        let (array, offset) = self.element(*values.first()?)?;
        let follows = |(k, &value)| self.element(value) == Some((array, offset + k));
        if !values.iter().enumerate().all(follows) {
            return None;
        }
        let whole = self.arrays.get(array)?;
        Some(Span {
            offset,
            len: values.len(),
            ..whole.clone()
        })
    }

    fn element(&self, value: ValueId) -> Option<(&Ident, usize)> {
        let text = self.spelled[value.index()].as_ref()?;
        text.place
            .as_ref()
            .map(|(array, position)| (array, *position))
    }

    fn copied(&mut self, values: &[ValueId]) -> Span {
        if let Some(span) = self.copies.get(values) {
            return span.clone();
        }
        let array = self.locals.mint("a");
        let elements: Vec<Text> = values.iter().map(|&value| self.read(value)).collect();
        self.printer.let_array(&array, &elements);
        let span = Span::whole(&array, values.len(), false);
        self.copies.insert(values.to_vec(), span.clone());
        span
    }

    fn declared(&mut self, len: usize, wanted: &str) -> Span {
        let array = self.locals.mint(wanted);
        self.printer.declare(&array, len);
        let span = Span::whole(&array, len, false);
        self.arrays.insert(array, span.clone());
        span
    }

    fn allocate(&mut self, first: usize, home: Span) -> Span {
        for k in 0..home.len {
            let index = Index::fixed(home.offset + k);
            let element = self.printer.dialect.element(&home.array, &index);
            self.spell(first + k, element);
        }
        home
    }

    /// Reserves `rows x cols` elements for values, row by row in an output where they belong if possible.
    fn matrix_storage(
        &mut self,
        first: usize,
        rows: usize,
        cols: usize,
        wanted: &str,
    ) -> MatrixStorage {
        let output = self.output_matrix(first, rows, cols);
        let matrix = output.unwrap_or_else(|| MatrixStorage {
            home: self.declared(rows * cols, wanted),
            stride: cols,
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

    /// The output array in which these rows are equally far apart, if nothing in it is still to be read.
    fn output_matrix(&self, first: usize, rows: usize, cols: usize) -> Option<MatrixStorage> {
        let results = &self.program.results;
        let find = |value: usize| results.iter().position(|e| e.value.index() == value);
        let at = find(first)?;
        let stride = match rows {
            0 | 1 => cols,
            _ => find(first + cols)?.checked_sub(at)?,
        };
        let slot = results[at].slot;
        let output = &self.outputs[slot];
        let fits = (0..rows * cols).all(|k| {
            let entry = results.get(at + k / cols * stride + k % cols);
            entry.is_some_and(|entry| entry.slot == slot && entry.value.index() == first + k)
        });
        (fits && output.role == Role::Output).then(|| MatrixStorage {
            home: Span {
                offset: results[at].index,
                len: rows * cols,
                ..Span::whole(&output.name, output.len, true)
            },
            stride,
        })
    }
}
