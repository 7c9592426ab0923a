//! Array statements as loops.

use super::code::{Argument, Expr, Index, Infix, Span, Stmt};
use super::ident::Ident;
use super::literal::Literal;
use super::translate::{MatrixHome, Translator};
use crate::ir::{Group, Slopes, TableId, ValueId};

/// A group of functions where its numbers live.
struct GroupCode {
    table: Ident,
    values: Span,
    slopes: SlopeCode,
}

enum SlopeCode {
    One,
    Plus(Span),
    Minus(Span),
}

impl MatrixHome {
    fn element(&self, row: &Ident, col: &Ident) -> Expr {
        let index = Index::fixed(self.offset)
            .plus(self.stride, row)
            .plus(1, col);
        Expr::Element(self.array.clone(), index)
    }
}

impl Translator<'_> {
    pub(super) fn sin_cos(&mut self, first: usize, arguments: &[ValueId]) {
        let n = arguments.len();
        if self.lane.is_some() {
            for (k, &argument) in arguments.iter().enumerate() {
                self.sin_cos_lane(first + k, first + n + k, argument);
            }
            return;
        }
        let arguments = self.span(arguments);
        let sines = self.local_home(first, n, "s");
        let cosines = self.local_home(first + n, n, "c");
        self.body.push(Stmt::SinCos {
            arguments,
            sines,
            cosines,
        });
    }

    fn table(&mut self, id: TableId) -> Ident {
        self.names.tables.name(&self.program.tables()[id.index()])
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
        let weights: Vec<Span> = sections.iter().map(|section| self.span(section)).collect();
        let home = self.home(first, cols, "y");
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
                Expr::infix(Infix::Mul, entry(index.shifted(row)), weight)
            };
            let blocks = w.len / 4;
            if blocks > 0 {
                let term = |n: usize| product(Index::fixed(n).plus(4, &k));
                let front = Expr::infix(Infix::Add, term(0), term(1));
                let back = Expr::infix(Infix::Add, term(2), term(3));
                let sum = Expr::infix(Infix::Add, front, back);
                self.body.push(Stmt::For(k.clone(), blocks, vec![add(sum)]));
            }
            for n in 4 * blocks..w.len {
                self.body.push(add(product(Index::fixed(n))));
            }
            row += w.len;
        }
    }

    /// A constant table, copied to where its entries belong.
    pub(super) fn constants(&mut self, first: usize, table: TableId) {
        let shape = &self.program.tables()[table.index()];
        let (rows, cols) = (shape.rows(), shape.cols());
        let name = self.table(table);
        let home = self.matrix_home(first, rows, cols);
        let (r, i) = (self.names.locals.mint("r"), self.names.locals.mint("i"));
        let entry = Expr::Entry(name, Index::variable(&r), Index::variable(&i));
        let assign = Stmt::Assign(home.element(&r, &i), entry);
        let inner = Stmt::For(i, cols, vec![assign]);
        self.body.push(Stmt::For(r, rows, vec![inner]));
    }

    /// One loop over the rows: the columns' sums and slopes, then the lanes.
    pub(super) fn separable(
        &mut self,
        first: usize,
        start: &[ValueId],
        base: Option<&[ValueId]>,
        groups: &[Group],
    ) {
        let shape = &self.program.tables()[groups[0].table.index()];
        let (rows, cols) = (shape.rows(), shape.cols());
        let start = self.span(start);
        let base = base.map(|base| self.span(base));
        let groups: Vec<GroupCode> = groups.iter().map(|group| self.group(group)).collect();
        let sums = self.home(first, rows, "y");
        let slopes = self.matrix_home(first + rows, rows, cols);
        let [r, i, q] = ["r", "i", "q"].map(|name| self.names.locals.mint(name));

        let (mut sum, mut slope): (Option<Expr>, Option<Expr>) = (None, None);
        if let Some(base) = base {
            let index = Index::fixed(base.offset).plus(cols, &r).plus(1, &i);
            slope = Some(Expr::Element(base.array, index));
        }
        for group in groups {
            let entry = || {
                Expr::Entry(
                    group.table.clone(),
                    Index::variable(&r),
                    Index::variable(&i),
                )
            };
            let times = |span: &Span| {
                let index = Index::variable(&i).shifted(span.offset);
                Expr::infix(
                    Infix::Mul,
                    entry(),
                    Expr::Element(span.array.clone(), index),
                )
            };
            sum = Some(joined(sum, Infix::Add, times(&group.values)));
            slope = Some(match &group.slopes {
                SlopeCode::One => joined(slope, Infix::Add, entry()),
                SlopeCode::Plus(span) => joined(slope, Infix::Add, times(span)),
                SlopeCode::Minus(span) => joined(slope, Infix::Sub, times(span)),
            });
        }
        let zero = || Expr::Literal(Literal::ZERO);
        let columns = vec![
            Stmt::Assign(slopes.element(&r, &i), slope.unwrap_or_else(zero)),
            Stmt::Assign(
                Expr::Element(q.clone(), Index::variable(&i)),
                sum.unwrap_or_else(zero),
            ),
        ];
        let mut row = vec![Stmt::Declare(q.clone(), cols), Stmt::For(i, cols, columns)];
        let at_row = |span: &Span| {
            Expr::Element(span.array.clone(), Index::variable(&r).shifted(span.offset))
        };
        let total = self.lane_sum(at_row(&start), &q, cols, &mut row);
        row.push(Stmt::Assign(at_row(&sums), total));
        self.body.push(Stmt::For(r, rows, row));
    }

    fn group(&mut self, group: &Group) -> GroupCode {
        GroupCode {
            table: self.table(group.table),
            values: self.span(&group.values),
            slopes: match &group.slopes {
                Slopes::One => SlopeCode::One,
                Slopes::Plus(values) => SlopeCode::Plus(self.span(values)),
                Slopes::Minus(values) => SlopeCode::Minus(self.span(values)),
            },
        }
    }

    /// `start` plus the columns `q`, in the association of the statement.
    fn lane_sum(&mut self, start: Expr, q: &Ident, cols: usize, row: &mut Vec<Stmt>) -> Expr {
        let element = |index: Index| Expr::Element(q.clone(), index);
        let blocks = cols / 4;
        let mut total = start;
        if blocks > 0 {
            let [p, l] = ["p", "l"].map(|name| self.names.locals.mint(name));
            let lane = tree(0, blocks, &|k| element(Index::variable(&l).shifted(4 * k)));
            let target = Expr::Element(p.clone(), Index::variable(&l));
            row.push(Stmt::Declare(p.clone(), 4));
            row.push(Stmt::For(l, 4, vec![Stmt::Assign(target, lane)]));
            let lane = |l: usize| Expr::Element(p.clone(), Index::fixed(l));
            let front = Expr::infix(Infix::Add, lane(0), lane(1));
            let back = Expr::infix(Infix::Add, lane(2), lane(3));
            total = Expr::infix(Infix::Add, total, Expr::infix(Infix::Add, front, back));
        }
        (4 * blocks..cols).fold(total, |total, k| {
            Expr::infix(Infix::Add, total, element(Index::fixed(k)))
        })
    }

    pub(super) fn call(&mut self, first: usize, callee: usize, arguments: &[ValueId]) {
        let program = &self.program.callees()[callee];
        let mut passed = Vec::new();
        let mut rest = arguments;
        for slot in program.inputs() {
            let (these, others) = rest.split_at(slot.len);
            passed.push(Argument::Read(self.whole_span(these)));
            rest = others;
        }
        let mut next = first;
        for slot in program.outputs() {
            let home = self.output_home(next, slot.len).filter(Span::is_whole);
            let home = match home {
                Some(home) => self.settle(next, home),
                None => self.local_home(next, slot.len, &slot.name),
            };
            passed.push(Argument::Write(home));
            next += slot.len;
        }
        let callee = self.names.callees[callee].clone();
        self.body.push(Stmt::Call(callee, passed));
    }
}

/// `a op b`, or `b` alone (negated for a difference) if there is no `a`.
fn joined(a: Option<Expr>, op: Infix, b: Expr) -> Expr {
    match (a, op) {
        (Some(a), op) => Expr::infix(op, a, b),
        (None, Infix::Sub) => Expr::Negate(Box::new(b)),
        (None, Infix::Add | Infix::Mul | Infix::Div) => b,
    }
}

/// The leaves from `low` to below `high` added in a balanced tree.
fn tree(low: usize, high: usize, leaf: &dyn Fn(usize) -> Expr) -> Expr {
    if high - low == 1 {
        return leaf(low);
    }
    let middle = (low + high).div_ceil(2);
    Expr::infix(
        Infix::Add,
        tree(low, middle, leaf),
        tree(middle, high, leaf),
    )
}
