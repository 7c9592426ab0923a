//! Array statements as loops.

use super::code::{Expr, Index, Span, Stmt};
use super::fours::{FourBlock, Fours, SUMS_AT_ONCE};
use super::ident::Ident;
use super::lanes::Row;
use super::storage::MatrixStorage;
use super::translate::Translator;
use crate::ir::{Binary, Group, QUAD, QuadSum, TableId, ValueId};

impl Translator<'_> {
    pub(super) fn sin_cos(&mut self, first: usize, arguments: &[ValueId]) {
        let n = arguments.len();
        if self.lane.is_some() {
            for (k, &argument) in arguments.iter().enumerate() {
                self.sin_cos_lane(first + k, first + n + k, argument);
            }
            return;
        }
        let read = vec![self.span_with_rest(arguments)];
        let sines = self.local_home(first, n, "s");
        let cosines = self.local_home(first + n, n, "c");
        self.body.push(Stmt::Call {
            callee: None,
            read,
            written: vec![sines, cosines],
        });
    }

    fn table(&mut self, id: TableId) -> Ident {
        let table = self.names.tables.stored(&self.program.tables()[id.index()]);
        table.is_entered = true;
        table.name.clone()
    }

    fn sin_cos_lane(&mut self, sine_value: usize, cosine_value: usize, argument: ValueId) {
        let argument = self.named(argument);
        let [sine, cosine] = ["s", "c"].map(|name| self.names.locals.mint(name));
        self.spell(sine_value, Expr::Name(sine.clone()));
        self.spell(cosine_value, Expr::Name(cosine.clone()));
        self.body.push(Stmt::SinCosLane {
            argument,
            sine,
            cosine,
            is_used: [sine_value, cosine_value].map(|value| self.n_uses[value] > 0),
        });
    }

    /// A loop over four rows a time for each section of weights.
    pub(super) fn accumulate(&mut self, first: usize, table: TableId, sections: &[Vec<ValueId>]) {
        let cols = self.program.tables()[table.index()].cols();
        let name = self.table(table);
        if sections.is_empty() {
            for k in 0..cols {
                let entry = Expr::Entry(name.clone(), Index::fixed(0), Index::fixed(k));
                self.spell(first + k, entry);
            }
            return;
        }
        let weights: Vec<Span> = sections.iter().map(|section| self.span(section)).collect();
        let home = self.matrix_storage(first, 1, cols, "y").home;
        let (i, k) = (self.names.locals.mint("i"), self.names.locals.mint("k"));
        let target = || Expr::Element(home.array.clone(), Index::variable(&i).shifted(home.offset));
        let entry = |row: Index| Expr::Entry(name.clone(), row, Index::variable(&i));
        let offset = Stmt::Assign(target(), entry(Index::fixed(0)));
        self.body.push(Stmt::For(i.clone(), cols, vec![offset]));
        let add = |value| Stmt::For(i.clone(), cols, vec![Stmt::AddAssign(target(), value)]);
        let mut row = 1;
        for w in weights {
            let product = |index: Index| {
                let weight = Expr::Element(w.array.clone(), index.clone().shifted(w.offset));
                Expr::infix(Binary::Mul, entry(index.shifted(row)), weight)
            };
            let blocks = w.len / 4;
            if blocks > 0 {
                let term = |n: usize| product(Index::fixed(n).plus(4, &k));
                let front = Expr::infix(Binary::Add, term(0), term(1));
                let back = Expr::infix(Binary::Add, term(2), term(3));
                let sum = Expr::infix(Binary::Add, front, back);
                self.body.push(Stmt::For(k.clone(), blocks, vec![add(sum)]));
            }
            for n in 4 * blocks..w.len {
                self.body.push(add(product(Index::fixed(n))));
            }
            row += w.len;
        }
    }

    /// Vectors of four numbers in a local array of their own.
    pub(super) fn quads(
        &mut self,
        first: usize,
        table: TableId,
        weights: &[ValueId],
        sums: &[QuadSum],
    ) {
        let table = &self.program.tables()[table.index()];
        let weights = self.whole_span(weights);
        let home = self.local_home(first, QUAD * sums.len(), "y");
        let stored = self.names.tables.stored(table);
        stored.is_in_lanes = true;
        let table = (table.clone(), stored.name.clone());
        let name = |_| self.names.locals.mint("v");
        let names = (0..SUMS_AT_ONCE.min(sums.len())).map(name).collect();
        self.body.push(Stmt::Fours(Box::new(Fours {
            array: home.array,
            sums: sums.to_vec(),
            weights,
            names,
            filled: Fours::filled(&table.0, sums),
            table,
            blocks: FourBlock::divide(sums),
        })));
    }

    /// A constant table, copied to where its entries belong.
    pub(super) fn constants(&mut self, first: usize, table: TableId) {
        let shape = &self.program.tables()[table.index()];
        let (rows, cols) = (shape.rows(), shape.cols());
        let name = self.table(table);
        let home = self.matrix_storage(first, rows, cols, "m");
        let (r, i) = (self.names.locals.mint("r"), self.names.locals.mint("i"));
        let entry = Expr::Entry(name, Index::variable(&r), Index::variable(&i));
        let assign = Stmt::Assign(home.element(&r, &Index::variable(&i)), entry);
        let inner = Stmt::For(i, cols, vec![assign]);
        self.body.push(Stmt::For(r, rows, vec![inner]));
    }

    /// One loop over the rows.
    pub(super) fn separable(
        &mut self,
        first: usize,
        start: &[ValueId],
        base: Option<&[ValueId]>,
        groups: &[Group],
        cols: usize,
    ) {
        let rows = start.len();
        let r = self.names.locals.mint("r");
        let start = self.at(start, &r);
        let base = base.map(|base| self.span(base));
        let base = base.map(|home| MatrixStorage {
            stride: home.len / rows,
            home,
        });
        let groups: Vec<_> = groups.iter().map(|group| self.group(group)).collect();
        let sums = self.matrix_storage(first, 1, rows, "y").home;
        let slopes = self.matrix_storage(first + rows, rows, cols, "m");
        self.in_lanes.push(slopes.home.array.clone());
        let names = ["i", "k", "l", "q", "p"].map(|name| self.names.locals.mint(name));
        let row = Row {
            names,
            groups,
            base,
            slopes,
            n_slopes: cols,
            start,
            sum: Expr::Element(sums.array, Index::variable(&r).shifted(sums.offset)),
            row: r.clone(),
        };
        self.body
            .push(Stmt::For(r, rows, vec![Stmt::Row(Box::new(row))]));
    }

    /// The value at a loop's variable: an entry of a table if the values are the entries of its
    /// first row, an element of an array if not.
    fn at(&mut self, values: &[ValueId], variable: &Ident) -> Expr {
        if let Expr::Entry(table, row, _) = self.named(values[0]) {
            let entry = |col| Expr::Entry(table.clone(), row.clone(), col);
            let mut indexed = values.iter().enumerate();
            if indexed.all(|(k, &value)| self.named(value) == entry(Index::fixed(k))) {
                return entry(Index::variable(variable));
            }
        }
        let span = self.span(values);
        Expr::Element(span.array, Index::variable(variable).shifted(span.offset))
    }

    fn group(&mut self, group: &Group) -> Group<Ident, Span> {
        let table = self.table(group.table);
        let values = &self.program.tables()[group.table.index()];
        self.names.tables.stored(values).is_in_lanes = true;
        Group {
            table,
            values: self.span(&group.values),
            slopes: group.slopes.map(|values| self.span(values)),
        }
    }

    pub(super) fn call(&mut self, first: usize, callee: usize, arguments: &[ValueId]) {
        let program = &self.program.callees()[callee];
        let (mut read, mut written) = (Vec::new(), Vec::new());
        let mut rest = arguments;
        for slot in program.inputs() {
            let (these, others) = rest.split_at(slot.len);
            read.push(self.whole_span(these));
            rest = others;
        }
        let mut next = first;
        for slot in program.outputs() {
            let output = self
                .output_matrix(next, 1, slot.len)
                .map(|matrix| matrix.home);
            written.push(match output.filter(Span::is_whole) {
                Some(home) => self.allocate(next, home),
                None => self.local_home(next, slot.len, &slot.name),
            });
            next += slot.len;
        }
        let callee = Some(self.names.callees[callee].clone());
        self.body.push(Stmt::Call {
            callee,
            read,
            written,
        });
    }
}
